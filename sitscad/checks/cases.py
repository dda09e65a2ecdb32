"""What a rule can find, as rows: how much it weighs, and the words for it; one function puts figures into them."""

from __future__ import annotations

import re
from string import Formatter
from typing import Any

from sitscad.checks.rules import Advice, Complaint
from sitscad.finding import Place, Severity
from sitscad.record import record
from sitscad.units import show

USUAL_DIGITS = 4

_QUANTITY = re.compile(r"(m|H|F|ohm|Hz|N|Pa|V|A|s)(?:,(\d+))?")


@record
class Case:
    """One thing that a rule can find: its message, hint and detail (`Finding`), and its severity where that is not the
    rule's; ``grave`` is that of a grave one.

    Message, hint and detail are templates (`worded`). The figures of the finding stand in them as ``measured`` and
    ``limit``, all others under names of their own.
    """

    message: str
    hint: str = ""
    severity: Severity | None = None
    grave: Severity | None = None
    detail: str = ""

    def found(self, key: str | None = None, measured: float | None = None, limit: float | None = None,
              unit: str | None = None, *, hint: str | None = None, severity: Severity | None = None,
              is_grave: bool = False, source: str | None = None, place: Place | None = None, sigma: float | None = None,
              advice: Advice | None = None, keeps_limit: bool = False, **values: object) -> Complaint:
        """The complaint with its figures (SI, in ``unit``); a hint or severity that is given stands for the row's."""
        values |= {"measured": measured, "limit": limit}
        return Complaint(worded(self.message, values), worded(self.hint, values) if hint is None else hint, key,
                         measured, limit, unit, severity or (self.grave if is_grave else self.severity), source, place,
                         sigma, advice, keeps_limit,
                         detail=worded(self.detail, values).replace("; ; ", "; ").strip("; "))


def worded(template: str, values: dict[str, Any]) -> str:
    """A template with values in the place of their names: ``{gap:m}`` and ``{gap:m,3}`` are quantities as people write
    them, with so many digits; ``{share:%.0f}`` is in per cent, without the sign; everything else is as `str.format` has
    it.
    """
    return _WORDS.vformat(template, (), values)


class _Words(Formatter):
    def format_field(self, value: Any, format_spec: str) -> str:
        """One value in words."""
        if quantity := _QUANTITY.fullmatch(format_spec):
            return show(value, quantity[1], int(quantity[2] or USUAL_DIGITS))
        if format_spec.startswith("%"):
            return format(100.0 * value, format_spec[1:])
        return str(format(value, format_spec))


_WORDS = _Words()
