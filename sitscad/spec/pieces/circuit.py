"""The flexible printed circuit: its tail, connector, chips and panel."""

from __future__ import annotations

import math

from sitscad.record import record
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.stackup import Stackup


@record
class Connector:
    """How the tail ends: contacts at a pitch, their bare length and their width, the insertion thickness (0: solder
    pads).

    ``positions`` are the numbers of contacts that it is made with (none: any); ``width_tolerance`` (m) is what it
    takes, plus and minus, of the tail's width.
    """

    name: str
    kind: str
    pitch: float
    contact_width: float
    contact_length: float
    edge_margin: float
    insertion_thickness: float
    insertion_thickness_tolerance: float
    stiffener_length: float
    source: str = ""
    width_tolerance: float = 0.0
    positions: tuple[int, ...] = ()

    def contacts_for(self, needed: int) -> int:
        """The fewest contacts that it is made with and that are enough; just those where it has none so many."""
        return min((count for count in self.positions if count >= needed), default=needed)

    def width(self, contacts: int) -> float:
        """Width (m) of the tail's end for a number of contacts: outer contact centres plus a margin on each side."""
        return self.pitch * (contacts - 1) + 2.0 * self.edge_margin


@record
class Chip:
    """The land pattern of a two-terminal chip: its pads' size along and across it, distance of their centres (m).

    ``model`` is the path of its solid among KiCad's 3-D models.
    """

    name: str
    pad_along: float
    pad_across: float
    pitch: float
    source: str = ""
    model: str = ""


@record
class Tail:
    """The strip that leads to the converter: length in metres along its middle, its connector, its copper layers and
    how it bends.

    ``turn`` is how it turns in its plane before the contacts, seen from the top and from the coils: ``none``, ``left``
    or ``right`` (by 90 degrees); ``offset`` (m, to the left) how far it is led aside instead; ``turn_radius`` (m) that
    of its inner edge. It bends about a line across it, whose distance from the body is ``bend_at`` (m; None: the pivot
    of the jaw's hinge, or the middle of the stretch that may be bent), ``down`` (away from the face with the coils) or
    ``up``, by an angle (rad; half of the jaw's opening leads it into the shaft) at an inside radius (m; None: the
    fabricator's least). ``contacts`` is how many the connector has, None where it is the fewest that are enough;
    ``stiffener`` (m, with its adhesive) is None where the stock one is taken that fits best.
    """

    length: float
    connector: Connector
    layers: int
    bend: str
    turn: str = "none"
    offset: float = 0.0
    turn_radius: float = 2e-3
    bend_at: float | None = None
    bend_direction: str = "down"
    bend_angle: float = math.pi / 2
    bend_radius: float | None = None
    contacts: int | None = None
    stiffener: float | None = None


MOST_PARTS = 500
"""Boards on one panel: every copy is drawn out in full (about 50 kB of Gerber each), and nobody cuts more by hand."""


@record
class PanelSpec:
    """How parts are delivered: ``wish`` is ``auto`` (in a panel if too small to be made singly), ``none``, ``always``.

    ``parts`` are columns and rows (None: as many as fit the fabricator's panel); ``gap`` is between parts, ``rail`` the
    frame's width, ``bridge`` the width of what holds a part, all in metres.
    """

    wish: str = "auto"
    parts: tuple[int, int] | None = None
    gap: float = 2e-3
    rail: float = 5e-3
    bridge: float = 0.5e-3


@record
class FpcSpec:
    """The flexible printed circuit: stack-up, the fabricator's rules, the tail (none: solder pads at the outline).

    ``panel`` says how parts are delivered, ``finish`` what is on the bare contacts (a row of the finishes' data),
    ``copper`` is ``rolled-annealed`` or ``electrodeposited``, ``teardrops`` is ``auto`` or ``none``; ``boards`` is how
    many are wanted, None where the order says so; ``margin`` (m, along and across) is what the body is larger by on
    each side than coils and leads need it.
    """

    stackup: Stackup
    rules: DesignRules
    tail: Tail | None
    panel: PanelSpec = PanelSpec()
    finish: str = "enig"
    copper: str = "rolled-annealed"
    teardrops: str = "none"
    boards: int | None = None
    margin: tuple[float, float] = (0.0, 0.0)
