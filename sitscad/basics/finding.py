"""What is said of a design: what found no room, one `Finding` a complaint, one `NotChecked` a silence explained."""

from __future__ import annotations

from enum import StrEnum

from sitscad.basics.record import record


class Severity(StrEnum):
    """How much a finding weighs; only an error stops a build."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"

    def weighs(self, least: Severity) -> bool:
        """Whether it is as grave as `least`, or graver."""
        order = list(Severity)
        return order.index(self) <= order.index(least)


@record
class Place:
    """A point on the board in metres, with the copper layer (1 is the top one) and the nets where these matter."""

    x: float
    y: float
    layer: int | None = None
    nets: tuple[str, ...] = ()


class Missing(StrEnum):
    """What a board can lack."""

    WAY_OUT = "a copper layer on which a coil comes out"
    INNER_ROOM = "room for the vias inside a coil"
    LEAD_ROOM = "room for leads and outer vias"
    TAIL_LAYERS = "copper layers in the tail for the pairs"
    TAIL_ROOM = "room for the tracks at the contacts"
    BODY_ROOM = "room inside the outline that is given to the body"


@record
class Shortfall:
    """Something that found no room on a board: what, how much there is of what it takes, and where.

    ``have`` and ``need`` are in ``unit``; None where nobody can say how much it takes. ``facts`` are what else its
    words name (`_WORDS`).
    """

    what: Missing
    have: float | None = None
    need: float | None = None
    unit: str | None = None
    place: Place | None = None
    facts: tuple[tuple[str, str | float], ...] = ()

    @property
    def missing(self) -> float | None:
        """How much is missing, as far as it is known."""
        return None if self.have is None or self.need is None else self.need - self.have

    @property
    def message(self) -> str:
        """What found no room, in words."""
        facts = dict(self.facts)
        words = _WORDS_OF_ONE.get(self.what, "") if facts.get("count") == 1 else ""
        asked = _WORDS_OF_NEED.get(self.what, "") if self.need is not None else ""
        return ((words or _WORDS[self.what]) + asked).format(**facts)


_WORDS = {
    Missing.WAY_OUT: "a coil of {count} layers ends inside its turns, and the stack-up {stackup} has no copper layer "
    "left on which it could come out",
    Missing.INNER_ROOM: "no room for {count} vias and the stubs to them inside the innermost turn, where {clear:.3f} "
    "mm are clear",
    Missing.LEAD_ROOM: "the coils' leads and outer vias find no way out of the windings",
    Missing.TAIL_LAYERS: "the pairs of a {pattern} array are led out above each other on two copper layers, and here "
    "the tail has only one: the coils are drawn and estimated, but not led out",
    Missing.TAIL_ROOM: "the tracks of {coils} coils come too near each other on their way to the contacts of "
    "{connector} (pitch {pitch:g} mm, {tail:.1f} mm of tail)",
    Missing.BODY_ROOM: "{what} not inside the body that is asked for ({body})",
}
"""What is said of a shortfall, with its facts in their places; lengths there are in millimetres."""

_WORDS_OF_ONE = {
    Missing.WAY_OUT: "a coil of {count} layer ends inside its turns, and the stack-up {stackup} has no copper layer "
    "left on which it could come out",
    Missing.INNER_ROOM: "no room for the via and the stubs to it inside the innermost turn, where {clear:.3f} mm are "
    "clear",
}
"""The words of a need where it is of a single coil."""

_WORDS_OF_NEED = {
    Missing.TAIL_ROOM: ": {rules} asks {track:g} um from track to track",
    Missing.BODY_ROOM: ": {missing:.0f} um are missing on its side",
}
"""What is added where it is known how much it takes."""


@record
class Edit:
    """One key of the spec, and the value that it takes, as it is written there.

    ``old`` is what stands there now, None for a key that is not there; ``what`` is ``value``, or ``name`` where not the
    value but the key's name becomes another.
    """

    key: str
    new: str
    old: str | None = None
    what: str = "value"

    @property
    def words(self) -> str:
        """What it changes, in words."""
        if self.what == "name":
            return f"{self.key} is now {self.new}"
        return f"{self.key}: {self.new}" + ("" if self.old is None else f" instead of {self.old}")

    @property
    def is_safe(self) -> bool:
        """Whether it leaves alone what the sensor is: its turns, size, layers and materials, and how often it reads."""
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
"""Keys that, like materials, decide what a sensor is and gives, and who makes it: only who designed it changes them."""


@record
class Remedy:
    """Edits that together mend a finding, found by trying, and the rules that warn of the changed design and not, or of
    less, of the design as it stands. ``is_sure`` is False where a word is only guessed.
    """

    edits: tuple[Edit, ...]
    brings: tuple[str, ...] = ()
    is_sure: bool = True

    @property
    def is_safe(self) -> bool:
        """Whether it may be written into a spec without asking."""
        return self.is_sure and all(edit.is_safe for edit in self.edits)


@record
class Finding:
    """One complaint about a design.

    ``key`` is the dotted path of the spec's entry (``coil.turns``); ``line`` and ``column`` count from 1 and are filled
    in where the spec's text is known. ``measured`` and ``limit`` are SI values in ``unit``; ``sigma`` says how many
    standard deviations of manufacture lie between them, where that is known. ``file`` is the path of the file that line
    and column count in, where that is not the spec itself (a fabricator's profile). ``fixes`` are what mends it, the
    best first. ``keeps_limit`` is set where ``measured`` lies on the right side of the limit, by little. ``detail`` is
    what the message leaves to those who want to know more: spreads, figures of every coil, where a limit is from.
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

    def __repr__(self) -> str:
        """A line with rule, severity and message."""
        return f"<Finding {self.rule} {self.severity}: {self.message[:160]}>"

    @property
    def whole_message(self) -> str:
        """The message with its detail."""
        return f"{self.message}; {self.detail}" if self.detail else self.message

    @property
    def advised_message(self) -> str:
        """The message with the hint in a line of its own, for forms that have no place for hints."""
        return f"{self.whole_message}\nHint: {self.hint}" if self.hint else self.whole_message


@record
class NotChecked:
    """A rule that could not be applied, and why: silence never means that a rule passed."""

    rule: str
    reason: str


@record
class Ignored:
    """A finding not held against the design, why, and by what: ``comment``, ``configuration``, ``baseline``."""

    finding: Finding
    reason: str
    by: str
