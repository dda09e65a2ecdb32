"""What is said of a design: what found no room, one `Finding` a complaint, one `NotChecked` a silence explained."""

from __future__ import annotations

from enum import StrEnum

from sitscad.record import record


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


@record
class Shortfall:
    """Something that found no room on a board: what, in words, how much there is of what it takes, and where.

    ``have`` and ``need`` are in ``unit``; None where nobody can say how much it takes.
    """

    what: Missing
    message: str
    have: float | None = None
    need: float | None = None
    unit: str | None = None
    place: Place | None = None

    @property
    def missing(self) -> float | None:
        """How much is missing, as far as it is known."""
        return None if self.have is None or self.need is None else self.need - self.have


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
        """Whether it leaves alone what the sensor is: its turns, size, layers and materials."""
        is_settled = any(f"{self.key}.".startswith(f"{key}.") for key in SETTLED) or "material" in self.key.split(".")
        return self.what == "name" or not is_settled


SETTLED = ("coil.turns", "coil.outer_diameter", "coil.layers", "fpc.tail.layers", "fpc.stackup")
"""Keys that, like materials, decide what a sensor is: only who designed it changes them."""


@record
class Remedy:
    """Edits that together mend a finding, found by trying, and the rules that warn of the changed design and not of the
    design as it stands. ``is_sure`` is False where a word is only guessed.
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
    best first.
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
