"""The layout as drawn: copper, vias, pads, openings and outline, every piece with its net. Frozen values, metres."""

from __future__ import annotations

from functools import cached_property
from itertools import pairwise

from sitscad.finding import Shortfall
from sitscad.geometry.path import Path, Point
from sitscad.geometry.region import Region
from sitscad.layout.pieces import Pad, Teardrop, Trace, Via
from sitscad.record import record
from sitscad.spec.coil import CoilPlacement
from sitscad.spec.sensor import SensorSpec


@record
class Capacitor:
    """Two pads for a coil's tank capacitor across its pair, the first on end A; ``package`` is the chip's name."""

    reference: str
    coil: str
    package: str
    pads: tuple[Pad, Pad]

    @property
    def centre(self) -> Point:
        """The middle between the pads."""
        one, other = (pad.centre for pad in self.pads)
        return Point((one.x + other.x) / 2, (one.y + other.y) / 2)


@record
class Winding:
    """One layer of a coil, walked in the coil's direction.

    ``outer_angle`` (rad) is where this layer's outer end stands; ``sense`` is +1 when the layer, walked from the
    outside in, runs counter-clockwise, -1 otherwise; ``inward`` says which way the coil's current walks it; ``z`` is
    the copper's mid-plane below the board's top face (m, negative).
    """

    layer: int
    z: float
    thickness: float
    outer_angle: float
    sense: int
    inward: bool
    path: Path


@record
class Coil:
    """One coil as drawn. ``series`` lists every conductor from contact A to contact B in the order of the current."""

    placement: CoilPlacement
    net: str
    windings: tuple[Winding, ...]
    series: tuple[Trace | Via, ...]
    is_closed_circuit: bool

    @property
    def name(self) -> str:
        """The coil's name (C1, C2, ...)."""
        return self.placement.name

    @property
    def centre(self) -> Point:
        """The coil's centre on the board."""
        return Point(*self.placement.centre)


@record
class Stiffener:
    """A plate bonded to the bottom face: its outline and its thickness with the adhesive (m).

    ``adhesive`` (m) is that of a stock film with a stock adhesive; 0 where none comes near what is needed.
    """

    outline: Region
    thickness: float
    material: str
    adhesive: float = 0.0


@record
class Layout:
    """Everything that is drawn. ``shortfalls`` holds what found no room: the pieces in question are then missing.

    ``tail_length`` (m) is the tail's as laid, from the body's end along its middle line: at least what the spec asks.
    """

    spec: SensorSpec
    coils: tuple[Coil, ...]
    traces: tuple[Trace, ...]
    vias: tuple[Via, ...]
    pads: tuple[Pad, ...]
    outline: Path
    body: tuple[float, float, float, float]
    top_openings: tuple[Region, ...]
    bottom_openings: tuple[Region, ...]
    stiffener: Stiffener | None
    bend_zone: tuple[float, float] | None
    shortfalls: tuple[Shortfall, ...] = ()
    capacitors: tuple[Capacitor, ...] = ()
    tail_length: float = 0.0

    def __repr__(self) -> str:
        """A line: all fields are half a million characters."""
        return (
            f"<Layout of {self.spec.name}: {len(self.coils)} coils, {len(self.traces)} traces, {len(self.vias)} vias>"
        )

    @property
    def all_pads(self) -> tuple[Pad, ...]:
        """The contacts, and the capacitors' pads."""
        return self.pads + tuple(pad for capacitor in self.capacitors for pad in capacitor.pads)

    @property
    def copper_layers(self) -> int:
        """Number of copper layers of the stack-up."""
        return len(self.spec.fpc.stackup.copper)

    @property
    def body_size(self) -> tuple[float, float]:
        """Length along the jaw and width across it (m) of the part with the coils, without the tail."""
        x0, y0, x1, y1 = self.body
        return x1 - x0, y1 - y0

    @property
    def nets(self) -> tuple[str, ...]:
        """The nets, one a coil."""
        return tuple(coil.net for coil in self.coils)

    @cached_property
    def teardrops(self) -> tuple[Teardrop, ...]:
        """The teardrops where tracks meet vias and contacts; none where the spec wants none."""
        from sitscad.layout.teardrops import teardrops

        return teardrops(self)

    def reach_at(self, x: float) -> tuple[float, float]:
        """The lowest and the highest y (m) of the board's outline at a place along x; both 0 where there is no board.

        Arcs count as chords within 10 um.
        """
        points = self.outline.flattened(1e-5)
        found = [
            a.y + (x - a.x) / (b.x - a.x) * (b.y - a.y)
            for a, b in pairwise(points)
            if a.x != b.x and min(a.x, b.x) <= x <= max(a.x, b.x)
        ]
        return min(found, default=0.0), max(found, default=0.0)

    def on_layer(self, number: int) -> tuple[Trace, ...]:
        """The traces on one copper layer."""
        return tuple(trace for trace in self.traces if trace.layer == number)

    def lowest_layer(self, via: Via) -> int:
        """The last copper layer, from the top, that a hole goes through."""
        return self.copper_layers if via.lowest is None else via.lowest

    def vias_on(self, number: int) -> tuple[Via, ...]:
        """The holes that go through one copper layer and have a pad there."""
        return tuple(via for via in self.vias if number <= self.lowest_layer(via))

    @property
    def spans(self) -> tuple[int, ...]:
        """The last copper layer of every kind of hole: those through the whole board first."""
        return tuple(sorted({self.lowest_layer(via) for via in self.vias}, reverse=True))
