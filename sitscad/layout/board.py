"""The finished layout: copper, vias, pads, openings and outline, each piece with its net.

Values are frozen; lengths are in metres.

Teardrops widen a track towards the via or contact at its end, if all clearances permit. The joint of a thin track and a
pad is the first place to crack in a flexible circuit. A misregistered drill also breaks the track there. The teardrop
of a via is the convex hull of its pad and a circle on the track, as wide as the track. The teardrop of a contact is the
trapezoid from the contact's edge to the track.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from enum import StrEnum
from functools import cached_property
from itertools import pairwise

import numpy as np

from sitscad.basics.arrays import Array, Index
from sitscad.basics.finding import Shortfall
from sitscad.basics.record import record, replace
from sitscad.kernels.geometry.convex import Box, clip_to_box
from sitscad.kernels.geometry.path import Arc, Line, Path, Point, Region, Segment, bounding_box, box_around
from sitscad.kernels.geometry.primitives import (
    Primitives,
    Row,
    distances,
    distances_to_points,
    from_rows,
    line_row,
    nearest_pairs,
    path_rows,
)
from sitscad.layout.clearance import ALONG
from sitscad.layout.teardrop_outlines import SLACK, contact_teardrops, via_teardrops
from sitscad.spec.coil import ArraySpec, CoilPlacement
from sitscad.spec.places import cell_specs
from sitscad.spec.sensor import SensorSpec


class Role(StrEnum):
    """Purpose of a piece of copper."""

    WINDING = "winding"
    STUB = "stub"
    LEAD = "lead"
    TAIL = "tail"


@record
class Trace:
    """A track of constant width along a path.

    `path` is its centre line, and `width` is in metres. `layer` is its copper layer, from 1 at the top. `role` is its
    use, for example a turn or a lead.
    """

    path: Path
    width: float
    layer: int
    net: str
    role: Role


@record
class Via:
    """A plated hole with equal round pads on all copper layers that it passes.

    `drill` is the diameter (m) of the hole, and `pad` the diameter (m) of its pads. A hole in a tail with fewer layers
    than the body does not pass all layers: `lowest` is the last layer that it passes, from 1 at the top. None if the
    hole passes all layers.
    """

    centre: Point
    drill: float
    pad: float
    net: str
    lowest: int | None = None


@record
class Pad:
    """A rectangular contact on copper layer `layer`, with its centre and its size [x, y] (m).

    `pin` is ``C1.A`` or ``C1.B`` for the two ends of coil C1. `number` is the contact's number in its part. `reference`
    names the part: the tail's connector or a capacitor. Net and pin are empty for connector contacts that no coil uses.
    """

    centre: Point
    size: tuple[float, float]
    layer: int
    net: str
    pin: str
    number: int
    reference: str = "J1"

    @property
    def is_unused(self) -> bool:
        """Whether no coil uses the contact: it is copper without a net."""
        return not self.net

    @property
    def name(self) -> str:
        """Display name: the pin, or the number of an unused contact."""
        return self.pin or f"{self.number} (unused)"

    def holds(self, point: Point) -> bool:
        """Whether a point lies on the pad."""
        (x, y), (w, h) = self.centre, self.size
        return abs(point.x - x) <= w / 2 and abs(point.y - y) <= h / 2


@record
class Teardrop:
    """A filled outline that widens a track towards a via or contact, on copper layer `layer`.

    `track` is the index of the track in the layout's tracks. `origin` is the end of this track in the via or contact.
    `at_start` is True if it is the track's first point.
    """

    outline: Path
    layer: int
    net: str
    track: int
    at_start: bool
    origin: Point


@record
class Capacitor:
    """Two pads for the tank capacitor of the coil `coil`, the first pad at the coil's end A.

    `reference` is the part's name on the board. `package` is the name of its chip size.
    """

    reference: str
    coil: str
    package: str
    pads: tuple[Pad, Pad]

    @property
    def centre(self) -> Point:
        """Midpoint between the pads."""
        return middle_of(self.pads)


@record
class SolderedThermistor:
    """The temperature sensor on the board: its two pads, and its tracks to two contacts of the tail.

    `reference` is the part's name on the board, and `package` the name of its chip size.
    """

    reference: str
    package: str
    pads: tuple[Pad, Pad]
    traces: tuple[Trace, ...]

    @property
    def centre(self) -> Point:
        """Midpoint between the pads."""
        return middle_of(self.pads)

    @property
    def box(self) -> Box:
        """Box (m) around both pads."""
        return box_around([(x - w / 2, y - h / 2, x + w / 2, y + h / 2)
                           for (x, y), (w, h) in ((pad.centre, pad.size) for pad in self.pads)])

    @property
    def nets(self) -> tuple[str, str]:
        """Nets of its two pads."""
        return self.pads[0].net, self.pads[1].net


def middle_of(pads: tuple[Pad, Pad]) -> Point:
    """Return the midpoint between two pads."""
    first, second = (pad.centre for pad in pads)
    return Point((first.x + second.x) / 2, (first.y + second.y) / 2)


@record
class Winding:
    """One layer of a coil: its spiral `path` on copper layer `layer`.

    `thickness` (m) is the thickness of the copper. `z` (m, negative) is the copper's mid-plane relative to the board's
    top face. `outer_angle` (rad) is the direction of the spiral's outer end. `sense` is +1 if the spiral runs
    counter-clockwise from the outside in, otherwise -1. `inward` is True if the coil's current flows from the outside
    in.
    """

    layer: int
    z: float
    thickness: float
    outer_angle: float
    sense: int
    inward: bool
    path: Path


@record
class LeadPair:
    """A part of both leads of a coil that a sketch does not draw.

    `length` (m) is its length, and `width` (m) the leads' track width. `layers` are the copper layers of the two leads,
    the upper layer first. If both leads lie side by side on one layer, `apart` (m) is their centre distance.
    """

    length: float
    width: float
    layers: tuple[int, int]
    apart: float


@record
class Coil:
    """A drawn coil, with one winding for each of its layers.

    `series` lists all conductors from contact A to contact B in the order of the current. `is_closed_circuit` is True
    if they connect both contacts. `undrawn` describes the missing leads of a sketch. `goes_on` describes a lead that
    runs around the coil beside its turns: the number of turns (positive along the current), and the distance (m) from
    the coil's centre.
    """

    placement: CoilPlacement
    net: str
    windings: tuple[Winding, ...]
    series: tuple[Trace | Via, ...]
    is_closed_circuit: bool
    undrawn: tuple[LeadPair, ...] = ()
    goes_on: tuple[float, float] = (0.0, 0.0)

    @property
    def name(self) -> str:
        """Name (C1, C2, ...)."""
        return self.placement.name

    @property
    def centre(self) -> Point:
        """Position of the centre on the board."""
        return Point(*self.placement.centre)


@record
class Stiffener:
    """A plate bonded to the bottom face: outline, and total thickness (m) with adhesive.

    `adhesive` (m) is the thickness of the adhesive on the stock film from which the stiffener is made. It is 0 if no
    stock film has about the needed thickness.
    """

    outline: Region
    thickness: float
    material: str
    adhesive: float = 0.0


@record
class Layout:
    """The complete layout.

    `coils` has the reference coil last, if there is one. `shortfalls` lists where room is lacking; the pieces without
    room are missing from the layout. `tail_length` (m) is the length of the tail along its middle line, from the body's
    end. It is at least the length in the spec.
    """

    spec: SensorSpec
    coils: tuple[Coil, ...]
    traces: tuple[Trace, ...]
    vias: tuple[Via, ...]
    pads: tuple[Pad, ...]
    outline: Path
    body: Box
    top_openings: tuple[Region, ...]
    bottom_openings: tuple[Region, ...]
    stiffener: Stiffener | None
    bend_zone: tuple[float, float] | None
    shortfalls: tuple[Shortfall, ...] = ()
    capacitors: tuple[Capacitor, ...] = ()
    thermistor: SolderedThermistor | None = None
    tail_length: float = 0.0

    def __repr__(self) -> str:
        """Return a single line, because the text of all fields has half a million characters."""
        return (
            f"<Layout of {self.spec.name}: {len(self.coils)} coils, {len(self.traces)} traces, {len(self.vias)} vias>"
        )

    def cell(self, number: int) -> Layout:
        """Return the board with only the coils of one cell (number from 1). The layout itself if there are no cells."""
        if self.spec.cells is None:
            return self
        count = self.spec.cells.coils
        coils = self.coils[(number - 1) * count : number * count]
        return replace(self, spec=cell_specs(self.spec)[number - 1], coils=coils)

    @property
    def reference(self) -> Coil | None:
        """Reference coil, the last of all coils. None if there is no reference coil."""
        return None if self.spec.array.reference is None else self.coils[-1]

    @property
    def reference_name(self) -> str:
        """Name of the reference coil. Empty if there is no reference coil."""
        return "" if self.reference is None else self.reference.name

    @property
    def labels(self) -> dict[str, str]:
        """Display name of each coil by its name. It marks the reference coil."""
        reference = self.reference
        return {coil.name: f"{coil.name} (ref.)" if coil is reference else coil.name for coil in self.coils}

    @property
    def sensing(self) -> Layout:
        """Board with its sensing coils only. The layout itself without a reference coil."""
        if self.spec.array.reference is None:
            return self
        return replace(self, spec=replace(self.spec, array=replace(self.spec.array, reference=None)),
                       coils=self.coils[:-1])

    @property
    def reference_alone(self) -> Layout | None:
        """Board with its reference coil only. None if there is no reference coil."""
        return None if self.reference is None else self.without_target(self.reference)

    def without_target(self, coil: Coil) -> Layout:
        """Return the board with one of its coils only, without the target."""
        spec = replace(self.spec, coil=coil.placement.own or self.spec.coil, cells=None, target=None, elastomer=None,
                       array=ArraySpec("single", (coil.placement,)), loads=())
        return replace(self, spec=spec, coils=(coil,))

    @property
    def all_pads(self) -> tuple[Pad, ...]:
        """Contacts, and the pads of capacitors and thermistor."""
        return self.pads + tuple(pad for chip in self.chips for pad in chip.pads)

    @property
    def chips(self) -> tuple[Capacitor | SolderedThermistor, ...]:
        """Parts that are soldered to the board."""
        return (*self.capacitors, self.thermistor) if self.thermistor is not None else self.capacitors

    @property
    def conductors(self) -> tuple[tuple[str, tuple[Trace | Via, ...]], ...]:
        """Net and pieces, in order, of each conductor: the coils, then the thermistor's two tracks."""
        coils = tuple((coil.net, coil.series) for coil in self.coils)
        if (sensor := self.thermistor) is None:
            return coils
        return *coils, *((net, tuple(trace for trace in sensor.traces if trace.net == net)) for net in sensor.nets)

    @property
    def copper_layers(self) -> int:
        """Number of copper layers of the stack-up."""
        return len(self.spec.fpc.stackup.copper)

    @property
    def size(self) -> tuple[float, float]:
        """Length along the jaw and width across the jaw (m) of the whole board with its tail."""
        x0, y0, x1, y1 = bounding_box([self.outline])
        return x1 - x0, y1 - y0

    @property
    def body_size(self) -> tuple[float, float]:
        """Length along the jaw and width across the jaw (m) of the body, without the tail."""
        x0, y0, x1, y1 = self.body
        return x1 - x0, y1 - y0

    @property
    def body_outline(self) -> Path:
        """Outline of the body with its corners, or the spec's outline: closed, convex and counter-clockwise."""
        written = self.spec.body_outline
        if written is not None:
            return written
        within = clip_to_box(self.outline, self.body)
        assert within is not None
        return within

    @property
    def largest_outline(self) -> Path | None:
        """Outline `fpc.largest` about the body's middle, or a drawn one about the coils. None if the spec has none."""
        largest = self.spec.fpc.largest
        if largest is None:
            return None
        x0, y0, x1, y1 = bounding_box([self.body_outline])
        is_drawn = largest.shape == "dxf"
        return largest.edge.shifted(*(self.spec.artwork.array.middle if is_drawn else ((x0 + x1) / 2, (y0 + y1) / 2)))

    @property
    def lap_start(self) -> float:
        """Position x (m), inside the body, at which the tail's own bottom coverlay begins."""
        return self.body[2] - self.spec.fpc.rules.coverlay_lap

    @property
    def nets(self) -> tuple[str, ...]:
        """Nets: one per coil, and two of a soldered thermistor."""
        return *(coil.net for coil in self.coils), *(self.thermistor.nets if self.thermistor is not None else ())

    @cached_property
    def teardrops(self) -> tuple[Teardrop, ...]:
        """Teardrops at joints of tracks with vias and contacts. Empty if the spec excludes them."""
        return teardrops(self)

    @cached_property
    def in_bend_zone(self) -> tuple[tuple[Trace, Segment], ...]:
        """Track segments that reach into the bend zone, each with its trace. Empty if there is no bend zone."""
        if self.bend_zone is None:
            return ()
        low, high = self.bend_zone
        middle, half, pieces = (low + high) / 2.0, (high - low) / 2.0, list[tuple[Trace, Segment]]()
        for trace in self.traces:
            for segment in trace.path:
                if isinstance(segment, Arc) and abs(segment.centre.x - middle) > half + segment.radius:
                    continue  # a coil's trace, like most: far from the tail, and its box is slow to compute
                x0, _, x1, _ = segment.box
                if x0 < high and x1 > low:
                    pieces.append((trace, segment))
        return tuple(pieces)

    def reach_at(self, x: float) -> tuple[float, float]:
        """Return the lowest and highest y (m) of the board's outline at x. Both are 0 outside the board.

        Arcs count as chords within 10 um.
        """
        heights = [a.y + (x - a.x) / (b.x - a.x) * (b.y - a.y) for a, b in pairwise(self.outline.flattened(1e-5))
                   if a.x != b.x and min(a.x, b.x) <= x <= max(a.x, b.x)]
        return min(heights, default=0.0), max(heights, default=0.0)

    def on_layer(self, number: int) -> tuple[Trace, ...]:
        """Return traces on one copper layer."""
        return tuple(trace for trace in self.traces if trace.layer == number)

    def lowest_layer(self, via: Via) -> int:
        """Return the number of the last copper layer that a hole passes, from 1 at the top."""
        return self.copper_layers if via.lowest is None else via.lowest

    def vias_on(self, number: int) -> tuple[Via, ...]:
        """Return vias that pass one copper layer and have a pad there."""
        return tuple(via for via in self.vias if number <= self.lowest_layer(via))

    @property
    def spans(self) -> tuple[int, ...]:
        """Last copper layer of each kind of hole. Holes through the whole board come first."""
        return tuple(sorted({self.lowest_layer(via) for via in self.vias}, reverse=True))


CHORD = 1e-6
"""Largest distance (m) of a teardrop's arcs from their chords."""


def teardrops(layout: Layout) -> tuple[Teardrop, ...]:
    """Return teardrops at track ends that keep the fabricator's clearance to other copper, to holes and to the edge."""
    if layout.spec.fpc.teardrops == "none":
        return ()
    tries: list[_Try] = []  # all outlines at all ends, long ones first at each
    for index, trace in enumerate(layout.traces):
        vias = layout.vias_on(trace.layer)
        for at_start in (True, False):
            leg = trace.path.segments[0] if at_start else trace.path.segments[-1].reversed()
            tries += [_Try(outline, index, at_start, leg) for outline in _outlines(vias, layout.pads, trace, leg)]
    roomy: set[int] = set()
    for layer in {layout.traces[attempt.track].layer for attempt in tries}:
        there = [k for k, attempt in enumerate(tries) if layout.traces[attempt.track].layer == layer]
        room = _CopperAround(layout, layer).leave_room([tries[k] for k in there])
        roomy.update(k for k, free in zip(there, room, strict=True) if free)
    drops: dict[tuple[int, bool], Teardrop] = {}
    for attempt in (tries[k] for k in sorted(roomy)):
        trace = layout.traces[attempt.track]
        drop = Teardrop(attempt.outline, trace.layer, trace.net, attempt.track, attempt.at_start, attempt.leg.start)
        drops.setdefault((attempt.track, attempt.at_start), drop)
    return tuple(drops.values())


def _outlines(vias: Iterable[Via], contacts: Iterable[Pad], trace: Trace, leg: Segment) -> Iterator[Path]:
    """Yield teardrop outlines for a straight segment of `trace` that leaves a via or a contact, longest first.

    `vias` are on the layer of the track.
    """
    if not isinstance(leg, Line):
        return
    via = next((via for via in vias if via.net == trace.net and via.centre.distance(leg.start) < SLACK), None)
    if via is not None:
        yield from via_teardrops(via.centre, via.pad, leg, trace.width)
        return
    for pad in contacts:
        if pad.layer == trace.layer and pad.net == trace.net and pad.holds(leg.start):
            yield from contact_teardrops(pad.centre, pad.size, leg, trace.width)


@record
class _Try:
    """A proposed teardrop, before its clearances are checked.

    `track` is the index of the track in the layout. `at_start` is True if the teardrop is at the track's first point.
    `leg` is the track's segment at the teardrop, directed away from the via or contact.
    """

    outline: Path
    track: int
    at_start: bool
    leg: Segment


class _CopperAround:
    """Copper of one layer, holes, and the board's edge, each with the clearance (m) that a teardrop must keep."""

    def __init__(self, layout: Layout, layer: int) -> None:
        self._layout, self._ways = layout, dict[int, tuple[float, float]]()
        rules, spacing = layout.spec.fpc.rules, layout.spec.fpc.rules.trace_spacing
        pieces = list[tuple[Row, float, tuple[str, int], str]]()  # with clearance (m), owner and net
        for i, trace in enumerate(layout.traces):
            if trace.layer == layer:
                station = 0.0
                for row, length in path_rows(trace.path):
                    self._ways[len(pieces)] = station, station + length
                    pieces.append((row, spacing + trace.width / 2, ("trace", i), trace.net))
                    station += length
        for i, via in enumerate(layout.vias):
            if layer > layout.lowest_layer(via):
                continue
            clearance = max(via.pad / 2 + spacing, via.drill / 2 + rules.drill_to_copper)
            pieces.append((line_row(*via.centre, *via.centre), clearance, ("via", i), via.net))
        for i, pad in enumerate(layout.all_pads):
            if pad.layer == layer:
                (x, y), half = pad.centre, min(pad.size) / 2
                dx, dy = (side / 2 - half for side in pad.size)
                pieces.append((line_row(x - dx, y - dy, x + dx, y + dy), spacing + half, ("pad", i), pad.net))
        pieces += [(row, rules.copper_to_edge, ("edge", 0), "") for row, _ in path_rows(layout.outline)]
        self._pieces: Primitives = from_rows([row for row, _, _, _ in pieces])
        self._boxes, self._keep = self._pieces.boxes, np.array([clearance for _, clearance, _, _ in pieces])
        self._owner, self._net = [owner for _, _, owner, _ in pieces], [net for _, _, _, net in pieces]

    def leave_room(self, tries: Sequence[_Try]) -> list[bool]:
        """Return, for each outline, whether it keeps all clearances.

        Copper that is joined to the track's end does not count.
        """
        rows = [(row, k) for k, attempt in enumerate(tries) for row, _ in path_rows(attempt.outline)]
        edges, owner = from_rows([row for row, _ in rows]), [k for _, k in rows]
        pairs = nearest_pairs(edges.boxes, np.zeros(len(edges)), self._boxes, self._keep)
        first, last = self._farther_on(tries, np.array(owner, dtype=np.intp)[pairs[:, 0]], pairs[:, 1])
        is_counted = first < last
        pairs, first, last = pairs[is_counted], first[is_counted], last[is_counted]
        gaps = distances(edges.take(pairs[:, 0]), self._pieces.take(pairs[:, 1]).trimmed(first, last))
        close = pairs[gaps < self._keep[pairs[:, 1]] - SLACK]
        met = {(owner[edge], piece) for edge, piece in close.tolist()}
        short = {k for k, piece in met if not self._is_joined(piece, tries[k].track, tries[k].leg)}
        return [k not in short for k in range(len(tries))]

    def _farther_on(self, tries: Sequence[_Try], numbers: Index, pieces: Index) -> tuple[Array, Array]:
        """Return start and end of the part of each copper piece that is compared with a teardrop.

        Both are fractions of the piece's length. Each element of `numbers` (index into `tries`) and `pieces` (index of
        a copper piece) is one pair. On the teardrop's own track, the part next to the teardrop is not compared.
        """
        first, last = np.zeros(len(pieces)), np.ones(len(pieces))
        for at, (k, piece) in enumerate(zip(numbers.tolist(), pieces.tolist(), strict=True)):
            attempt, (kind, number) = tries[k], self._owner[piece]
            if kind != "trace" or number != attempt.track:
                continue
            start, end = self._ways[piece]
            reach = max(attempt.leg.start.distance(corner) for corner in attempt.outline.flattened(CHORD))
            bend = reach + ALONG * float(self._keep[piece])
            if attempt.at_start:
                first[at] = min(1.0, max(0.0, (bend - start) / (end - start)))
            else:
                station = self._layout.traces[number].path.length - bend
                last[at] = min(1.0, max(0.0, (station - start) / (end - start)))
        return first, last

    def _is_joined(self, piece: int, index: int, leg: Segment) -> bool:
        """Whether copper piece number `piece` is joined to the track number `index` at `leg`.

        The teardrop may then touch it.
        """
        (kind, number), trace = self._owner[piece], self._layout.traces[index]
        if kind == "edge" or self._net[piece] != trace.net:
            return False
        if kind == "via":
            return self._layout.vias[number].centre.distance(leg.start) < SLACK
        if kind == "pad":
            return self._layout.all_pads[number].holds(leg.start)
        if number == index:
            return False  # the remaining part lies farther along the track
        other = self._layout.traces[number].path
        if min(p.distance(leg.start) for p in (other.start, other.end)) < SLACK:
            return True
        follows = min(p.distance(leg.end) for p in (other.start, other.end)) < SLACK
        there = np.array([leg.end])
        return follows and float(distances_to_points(self._pieces.take(np.array([piece])), there)[0]) < trace.width
