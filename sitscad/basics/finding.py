"""Results of checks: `Finding` (broken rule), `NotChecked` (rule not applied), `Shortfall` (missing room)."""

from __future__ import annotations

from dataclasses import field
from enum import StrEnum

from sitscad.basics.messages import text_of
from sitscad.basics.record import record


class Severity(StrEnum):
    """Severity of a finding. Only an error stops a build."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"

    def is_at_least(self, least: Severity) -> bool:
        """Whether the severity is equal to `least` or higher."""
        order = list(Severity)
        return order.index(self) <= order.index(least)


@record
class Place:
    """A point on the board (m).

    The copper layer (1 is the top layer) and the nets are set if the finding concerns them.
    """

    x: float
    y: float
    layer: int | None = None
    nets: tuple[str, ...] = ()


class Missing(StrEnum):
    """Kinds of room that a board can lack. The values are keys in ``data/messages.csv``."""

    WAY_OUT = "way-out"
    INNER_ROOM = "inner-room"
    LEAD_ROOM = "lead-room"
    TAIL_LAYERS = "tail-pairs"
    TAIL_ROOM = "tail-room"
    BODY_ROOM = "body-room"
    THERMISTOR_ROOM = "thermistor-room"


@record
class Shortfall:
    """Part of the board for which there is no room.

    ``have`` and ``need`` are the available and the needed room in ``unit``. ``need`` is None if it is unknown.
    ``facts`` are further values for the message.
    """

    what: Missing
    have: float | None = None
    need: float | None = None
    unit: str | None = None
    place: Place | None = None
    facts: tuple[tuple[str, object], ...] = ()

    @property
    def missing(self) -> float | None:
        """Room that is missing, in ``unit``. None if it is unknown."""
        return None if self.have is None or self.need is None else self.need - self.have

    @property
    def case(self) -> str:
        """Key of the message in ``data/messages.csv``."""
        if self.what is Missing.BODY_ROOM and "coil" not in dict(self.facts):
            return "body-room-tail"
        unknown = {Missing.INNER_ROOM: "inner-room-unknown", Missing.TAIL_ROOM: "tail-room-unknown",
                   Missing.THERMISTOR_ROOM: "thermistor-room-unknown"}
        return self.what if self.need is not None else unknown.get(self.what, self.what)

    @property
    def message(self) -> str:
        """Text that names the part without room, with its values."""
        return text_of(self.case, "message", {"measured": self.have, "limit": self.need, **dict(self.facts)})


@record
class Edit:
    """A change of one key of the spec.

    ``new`` and ``old`` are written as in the spec. ``old`` is None if the spec does not have the key. ``what`` is
    ``name`` if the key is renamed, else ``value``.
    """

    key: str
    new: str
    old: str | None = None
    what: str = "value"

    @property
    def words(self) -> str:
        """Text of the change, such as "coil.turns: 9 instead of 8"."""
        if self.what == "name":
            return f"{self.key} is now {self.new}"
        return f"{self.key}: {self.new}" + ("" if self.old is None else f" instead of {self.old}")

    @property
    def is_safe(self) -> bool:
        """Whether the change keeps the sensor's design.

        A change of a material or of a `SETTLED` key, such as turns, size, layers or scan rate, is not safe.
        """
        is_settled = any(f"{self.key}.".startswith(f"{key}.") for key in SETTLED) or "material" in self.key.split(".")
        return self.what == "name" or not is_settled


SETTLED = (
    "coil.turns",
    "coil.outer_diameter",
    "coil.inner_diameter",
    "coil.layers",
    "fpc.tail.layers",
    "fpc.stackup",
    "fpc.copper",
    "fpc.finish",
    "fpc.boards",
    "fpc.plated",
    "fpc.rules",
    "target.size",
    "elastomer.size",
    "assembly.adhesive",
    "readout.device",
    "readout.buses",
    "readout.scan_rate",
    "requirements",
)
"""Keys that, like materials, define a sensor, its performance or its fabricator. Only the designer changes them."""


@record
class Remedy:
    """A fix: edits that together remove a finding, as a trial has shown.

    ``new_warnings`` names the rules with more warnings after the fix than before it. ``is_sure`` is False if
    the fix only guesses the meaning of a word.
    """

    edits: tuple[Edit, ...]
    new_warnings: tuple[str, ...] = ()
    is_sure: bool = True

    @property
    def is_safe(self) -> bool:
        """Whether the fix may be written into a spec without a question to the user."""
        return self.is_sure and all(edit.is_safe for edit in self.edits)


@record
class Finding:
    """A broken rule, or a remark of a rule, about a design.

    Attributes
    ----------
    key : str or None
        dotted path of the spec's entry (``coil.turns``)
    line, column : int or None
        place of the entry, counted from 1, if the spec's text is known
    measured, limit : float or None
        value and its limit, in ``unit`` (SI)
    sigma : float or None
        difference between value and limit, in standard deviations of manufacture; None if it is unknown
    file : str or None
        file of ``line`` and ``column`` if it is not the spec (a fabricator's profile)
    fixes : tuple of Remedy
        fixes, the best first
    keeps_limit : bool
        whether ``measured`` meets the limit, but is near to it
    detail : str
        text that the message leaves out: standard deviations, values of every coil, the source of the limit
    cases : tuple of str
        keys in ``data/messages.csv`` of message, details and hint, the message's first; not in JSON
    """

    rule: str
    name: str
    severity: Severity
    message: str
    hint: str = ""
    key: str | None = None
    line: int | None = None
    column: int | None = None
    measured: float | None = None
    limit: float | None = None
    unit: str | None = None
    source: str | None = None
    place: Place | None = None
    sigma: float | None = None
    file: str | None = None
    fixes: tuple[Remedy, ...] = ()
    keeps_limit: bool = False
    detail: str = ""
    cases: tuple[str, ...] = field(default=(), compare=False)

    def __repr__(self) -> str:
        """Return a line with rule, severity and message."""
        return f"<Finding {self.rule} {self.severity}: {self.message[:160]}>"

    @property
    def whole_message(self) -> str:
        """The message, followed by its detail."""
        return f"{self.message}; {self.detail}" if self.detail else self.message

    @property
    def advised_message(self) -> str:
        """The message, and the hint on the next line, for formats without a field for hints."""
        return f"{self.whole_message}\nHint: {self.hint}" if self.hint else self.whole_message


@record
class NotChecked:
    """A rule that could not be applied, with the reason, and the reason's key in ``data/messages.csv``.

    A rule without a finding has passed only if it is not listed here.
    """

    rule: str
    reason: str
    case: str = field(default="", compare=False)


@record
class Ignored:
    """A finding that does not count, with the reason and the waiver: ``comment``, ``configuration`` or ``baseline``."""

    finding: Finding
    reason: str
    by: str
