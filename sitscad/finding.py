"""What is said of a design: what found no room, one `Finding` a complaint, one `NotChecked` a silence explained."""

from __future__ import annotations

from enum import StrEnum

from sitscad.record import record


class Severity(StrEnum):
    """How much a finding weighs; only an error stops a build."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"


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
class Finding:
    """One complaint about a design.

    ``key`` is the dotted path of the spec's entry (``coil.turns``); ``line`` and ``column`` count from 1 and are filled
    in where the spec's text is known. ``measured`` and ``limit`` are SI values in ``unit``; ``sigma`` says how many
    standard deviations of manufacture lie between them, where that is known. ``file`` is the path of the file that line
    and column count in, where that is not the spec itself (a fabricator's profile).
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


@record
class NotChecked:
    """A rule that could not be applied, and why: silence never means that a rule passed."""

    rule: str
    reason: str
