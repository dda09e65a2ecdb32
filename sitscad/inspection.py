"""A spec as a path leads to it, checked: what is wrong with it, whether it could be read or not, and its picture."""

from __future__ import annotations

from pathlib import Path

from sitscad.checks import RULES, mended
from sitscad.design import Design
from sitscad.finding import NotChecked
from sitscad.record import record
from sitscad.remedy.budget import DECISIVE
from sitscad.report.findings import CheckedSpec, checked_spec, numbered_places
from sitscad.review import Review
from sitscad.spec.load import load
from sitscad.spec.rules import SpecError

SHOWN = 1 << 18
"""Bytes of an unreadable spec that are read to show its lines: as many as a spec may have."""


@record
class Inspection:
    """One spec after its checks; ``design`` is None where it could not be read."""

    checked: CheckedSpec
    design: Design | None = None

    @property
    def picture(self) -> str:
        """The board in text with the findings' numbers at their places; empty where there is none."""
        if self.design is None:
            return ""
        from sitscad.drawing.board_picture import Mark
        from sitscad.drawing.dots import dot_picture  # nobody else shows text where a picture should be

        numbered = ((number, finding.place) for number, finding in numbered_places(self.checked.findings))
        marks = [Mark(place.x, place.y, str(number), "") for number, place in numbered if place is not None]
        return dot_picture(self.design.layout, marks)


def inspect(path: str, hints: str = DECISIVE) -> Inspection:
    """Load and check one spec; what keeps it from being read is a finding too.

    `hints` is what is tried for hints, as in `check`.
    """
    try:
        spec = load(path)
    except SpecError as error:
        return Inspection(unreadable(path, error, hints))
    design = Design(spec)
    result = Review(design, hints).result
    return Inspection(checked_spec(spec, result.findings, result.not_checked, result.signals), design)


def unreadable(path: str, error: SpecError, hints: str = DECISIVE) -> CheckedSpec:
    """The findings of a spec that could not be loaded; every other rule is listed as not checked."""
    reported = {finding.rule for finding in error.findings}
    skipped = (rule.id for rule in RULES if rule.id not in reported)
    not_checked = tuple(NotChecked(rule, "the spec could not be read") for rule in skipped)
    return CheckedSpec(path, _beginning(path), mended(error, hints), not_checked, error.texts)


def _beginning(path: str) -> str:
    """What a spec may hold at most, to show a line of it; nothing of what is no plain file (a pipe would never end)."""
    try:
        if not Path(path).is_file():
            return ""
        with Path(path).open("rb") as stream:
            return stream.read(SHOWN).decode("utf-8", errors="replace")
    except (OSError, ValueError):
        return ""
