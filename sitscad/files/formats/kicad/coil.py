"""Footprints of single coils, for use on other boards.

Turns are graphics on copper: one line or arc per segment. Pad 1 is the beginning of the first layer, pad 2 the end of
the last layer. An end outside on an outer layer is a dot, any other end is a hole. Further pads are the holes that join
layers, and the short tracks from holes to turns, because KiCad allows no graphics near a hole. On inner layers these
tracks are a part of the hole's own form.

All pads are one piece of copper, although a schematic has the ends on two nets. The footprint declares itself a net
tie, so that KiCad's rule check accepts the join. A rule area keeps poured copper off the coil, because poured copper
would lower its inductance. There is no 3-D model: KiCad draws the copper by itself, and no part is mounted.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from sitscad.basics.record import record
from sitscad.basics.units import show
from sitscad.files.formats.kicad.library import FOOTPRINT_HEAD, courtyard, property_text
from sitscad.files.formats.kicad.sexpr import copper_names, curve, drawn, grid, identity, length, node, quoted, xy
from sitscad.kernels.geometry.path import Arc, Path, Point, arc_through, bounding_box, polar, polyline
from sitscad.layout.board import Coil, Layout, Role, Trace, Via
from sitscad.layout.clearance import ViaToPlace, hole_keep_out

MARGIN = 0.25e-3  # From the outermost copper to the courtyard (m)
SAME = 0.5e-6  # Curves within this distance (m) are equal

_OUTER = ("F.Cu", "B.Cu")
_DIRECTIONS = (0, 20, -20, 40, -40, 60, -60)
_REACHES = range(1, 40)
_CORNERS = 64


@record
class _End:
    """Terminal of a coil: a copper dot on one layer, or a plated hole.

    `size` is the diameter (m) of the dot or of the hole's ring. `hole` is None for a dot. `track` joins the winding to
    a hole beside it, and is None otherwise.
    """

    at: Point
    layer: int
    size: float
    hole: ViaToPlace | None = None
    track: Trace | None = None


def coil_footprints(layout: Layout) -> dict[str, str]:
    """Return the ``.kicad_mod`` files by name (``coil-C1``) of all coils with a closed circuit."""
    coils = (coil for coil in layout.coils if coil.is_closed_circuit)
    return {f"coil-{coil.name}": _CoilFootprint(layout, coil).text() for coil in coils}


class _CoilFootprint:
    def __init__(self, layout: Layout, coil: Coil) -> None:
        self.layout, self.coil = layout, coil
        self.spec = coil.placement.own or layout.spec.coil
        self.names = copper_names(layout.copper_layers)
        self.origin = grid(coil.centre)
        self.owner = layout.spec.name, "library", coil.name
        pieces = winding(coil)
        self.traces = [piece for piece in pieces if isinstance(piece, Trace)]
        self.joints = [piece for piece in pieces if isinstance(piece, Via)]
        self.turns = [trace for trace in self.traces if trace.role is Role.WINDING]
        self.ends = self._ends()
        self.stubs = [trace for trace in self.traces if trace.role is not Role.WINDING]
        self.stubs += [end.track for end in self.ends if end.track is not None]
        # Bounding box of all copper with a margin, relative to the coil's centre (m)
        half = self.spec.trace_width / 2
        x0, y0, x1, y1 = bounding_box([trace.path for trace in self.traces])
        x0, y0, x1, y1 = x0 - half, y0 - half, x1 + half, y1 + half
        spots = [(end.at, end.size / 2) for end in self.ends] + [(via.centre, via.pad / 2) for via in self.joints]
        for at, reach in spots:
            x0, y0, x1, y1 = min(x0, at.x - reach), min(y0, at.y - reach), max(x1, at.x + reach), max(y1, at.y + reach)
        cx, cy = self.coil.centre
        self.box = x0 - cx - MARGIN, y0 - cy - MARGIN, x1 - cx + MARGIN, y1 - cy + MARGIN

    def text(self) -> str:
        pads = list(self._pads())
        tied = ", ".join(str(1 + i) for i in range(len(pads)))
        x0, y0, x1, y1 = self.box
        name, above, below = f"{self.layout.spec.name} {self.coil.name}", round((-y1 - 1e-3) * 1e9), -y0 + 1e-3
        text = node(
            f"footprint {quoted(f'coil-{self.coil.name}')}", *FOOTPRINT_HEAD,
            property_text("Reference", "REF**", (0, above), self.owner),
            property_text("Value", name, (0, round(below * 1e9)), self.owner),
            f"(descr {quoted(self._description(len(pads)))})", '(tags "coil inductor net-tie")',
            "(attr exclude_from_pos_files exclude_from_bom allow_soldermask_bridges)",
            f"(net_tie_pad_groups {quoted(tied)})", *self._turns(),
            courtyard(grid(Point(x0, y1)), grid(Point(x1, y0)), self.owner, 0), *pads, self._keep_out(),
            "(embedded_fonts no)",
        )
        return text + "\n"

    def _description(self, pads: int) -> str:
        """Return the description text of a coil's footprint."""
        spec = self.spec
        layers = ", ".join(self.names[number - 1] for number in spec.layers)
        inside = {2: "", 3: "; pad 3 is inside the coil: connect nothing to it"}.get(
            pads, f"; pads 3 to {pads} are inside the coil: connect nothing to them"
        )
        each = "" if spec.has_unequal_turns else "each of "
        return (
            f"pads 1 and 2 are the ends of the winding{inside}; "
            f"{spec.shape} coil, {spec.turns_in_words} turns on {each}{layers}, "
            f"tracks {show(spec.trace_width, 'm')}, gaps {show(spec.trace_spacing, 'm')} (the board's rules must allow "
            f"them); its inductance holds for stack-up {self.layout.spec.fpc.stackup.name}"
        )

    # ------------------------------------------------------------------------------------------------------ terminals

    def _ends(self) -> tuple[_End, _End]:
        """Return the terminals at the beginning of the first turn and at the end of the last turn.

        If the last turn ends inside the coil, its terminal is the hole there.
        """
        first = self._end(self.traces[0].path.start, self.traces[0].layer, ())
        last = self.traces[-1]
        if last.role is not Role.WINDING:
            via = self.joints.pop()
            return first, _End(via.centre, last.layer, via.pad, ViaToPlace(via.centre, via.pad, via.drill))
        return first, self._end(last.path.end, last.layer, [first.hole] if first.hole else ())

    def _end(self, at: Point, layer: int, holes: Sequence[ViaToPlace]) -> _End:
        """Return the terminal of an end of the winding, with a new hole if the end is on an inner layer.

        Raises ValueError if no hole fits.
        """
        if self.names[layer - 1] in _OUTER:
            return _End(at, layer, self.spec.trace_width)
        for way in self._ways_out(at):
            hole = ViaToPlace(way, self.layout.spec.fpc.rules.via_pad, self.layout.spec.fpc.rules.via_drill)
            if self._is_free(hole, holes):
                width, net = self.spec.trace_width, self.coil.net
                return _End(way, layer, hole.pad, hole, Trace(polyline([at, way]), width, layer, net, Role.STUB))
        raise ValueError(f"no room for a hole beside coil {self.coil.name}, which ends on {self.names[layer - 1]}")

    def _ways_out(self, at: Point) -> Iterator[Point]:
        """Yield places for a hole in a fan away from the coil's centre, nearest first."""
        outward = math.atan2(at.y - self.coil.centre.y, at.x - self.coil.centre.x)
        for reach in _REACHES:
            for degrees in _DIRECTIONS:
                angle = outward + math.radians(degrees)
                yield at.shifted(reach * 50e-6 * math.cos(angle), reach * 50e-6 * math.sin(angle))

    def _is_free(self, hole: ViaToPlace, occupied: Sequence[ViaToPlace]) -> bool:
        """Return whether a hole keeps the design rules' distances from turns, joints and the other end's hole."""
        rules = self.layout.spec.fpc.rules
        spacing = max(rules.trace_spacing, self.spec.trace_spacing)
        distance = hole_keep_out(hole, rules, spacing) + self.spec.trace_width / 2
        apart = max(hole.pad + 2 * spacing + self.spec.trace_width, hole.drill + rules.hole_to_hole)
        holes = [*occupied, *(ViaToPlace(via.centre, via.pad, via.drill) for via in self.joints)]
        return all(trace.path.distance(hole.centre) >= distance for trace in self.traces) and all(
            other.centre.distance(hole.centre) >= apart for other in holes
        )

    # -------------------------------------------------------------------------------------------------------- drawing

    def _turns(self) -> Iterator[str]:
        for i, trace in enumerate(self.turns):
            stroke = f"(stroke (width {length(trace.width)}) (type solid))"
            reach = 1.2 * (trace.width + self.layout.spec.fpc.rules.trace_spacing)
            # KiCad lets graphics touch a pad of the net tie, but not come near it. The piece that touches the pad must
            # be long enough for the next piece to keep its distance
            long_ends = _with_long_start(_with_long_start(trace.path, reach).reversed(), reach).reversed()
            for j, segment in enumerate(drawn(long_ends)):
                kind, points = curve(segment, self.origin)
                layer = quoted(self.names[trace.layer - 1])
                yield f"(fp_{kind} {points} {stroke} (layer {layer}) {identity(*self.owner, 'turn', i, j)})"

    def _pads(self) -> Iterator[str]:
        """Yield the two ends, then the holes between layers, then the tracks from holes to turns."""
        holes = []
        for number, end in enumerate(self.ends, 1):
            if end.hole is not None:
                holes.append(end.hole)
                yield self._hole(number, end.hole)
                continue
            size, layer = length(end.size), quoted(self.names[end.layer - 1])
            where = xy("at", grid(end.at), self.origin)
            head = f'pad "{number}" smd circle {where} (size {size} {size}) (layers {layer})'
            yield f"({head} {identity(*self.owner, 'pad', number)})"
        for number, via in enumerate(self.joints, 3):
            holes.append(ViaToPlace(via.centre, via.pad, via.drill))
            yield self._hole(number, holes[-1])
        tracks = ((name, hole) for hole in holes for name in _OUTER if self._strokes(name, hole))
        for number, (name, hole) in enumerate(tracks, 3 + len(self.joints)):
            size = length(self.spec.trace_width)
            yield node(
                f'pad "{number}" smd custom {self._kicad_position(hole)} (size {size} {size}) (layers {quoted(name)})',
                "(options (clearance outline) (anchor circle))", node("primitives", *self._strokes(name, hole)),
                identity(*self.owner, "pad", number),
            )

    def _hole(self, number: int, hole: ViaToPlace) -> str:
        """Return a plated hole with its ring on every layer, and on inner layers the tracks that end there."""
        size = f"(size {length(hole.pad)} {length(hole.pad)})"
        inner = [(name, self._strokes(name, hole)) for name in self.names[1:-1]]
        stack = [node(f"layer {quoted(name)}", *_form(hole, strokes)) for name, strokes in inner]
        stack.append(node('layer "B.Cu"', *_form(hole, [])))
        return node(
            f'pad "{number}" thru_hole circle {self._kicad_position(hole)} {size}',
            f'(drill {length(hole.drill)}) (layers "*.Cu") (remove_unused_layers no)',
            *([node("padstack", "(mode custom)", *stack)] if any(strokes for _, strokes in inner) else []),
            identity(*self.owner, "pad", number),
        )

    def _kicad_position(self, hole: ViaToPlace) -> str:
        return xy("at", grid(hole.centre), self.origin)

    def _strokes(self, name: str, hole: ViaToPlace) -> list[str]:
        """Return the tracks on one layer that end at a hole, relative to the hole's centre."""
        at = grid(hole.centre)
        return [
            f"(gr_{kind} {points} (width {length(stub.width)}))"
            for stub in self.stubs
            if self.names[stub.layer - 1] == name and at in (grid(stub.path.start), grid(stub.path.end))
            for kind, points in (curve(segment, at) for segment in drawn(stub.path))
        ]

    def _keep_out(self) -> str:
        """Return a rule area that forbids poured copper over the coil on all layers.

        Tracks, vias and pads remain allowed.
        """
        x0, y0, x1, y1 = self.box
        corners = " ".join(xy("xy", grid(Point(x, y))) for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1)))
        return node(
            "zone", "(net 0)", '(net_name "")', '(layers "*.Cu")', identity(*self.owner, "keep-out"),
            '(name "no copper poured over the coil")', "(hatch edge 0.5)", "(connect_pads (clearance 0))",
            "(min_thickness 0.25)",
            "(keepout (tracks allowed) (vias allowed) (pads allowed) (copperpour not_allowed) (footprints allowed))",
            f"(polygon (pts {corners}))",
        )


def _form(hole: ViaToPlace, strokes: list[str]) -> tuple[str, ...]:
    """Return a ring's form on one layer: round, or round with the tracks that end there.

    In a composed form, KiCad draws the circle as a polygon with corners up to 5 um inside the circle, and then reports
    the ring as too narrow. The circle is therefore written as a polygon outside it (corners 0.3 um outside).
    """
    if not strokes:
        return "(shape circle)", f"(size {length(hole.pad)} {length(hole.pad)})"
    reach = hole.pad / 2 / math.cos(math.pi / _CORNERS) + 10e-9
    corners = (polar(reach, 2 * math.pi * i / _CORNERS) for i in range(_CORNERS))
    ring = f"(gr_poly (pts {' '.join(xy('xy', grid(corner)) for corner in corners)}) (width 0) (fill yes))"
    return (
        "(shape custom)", f"(size {length(hole.drill)} {length(hole.drill)})", "(options (anchor circle))",
        node("primitives", ring, *strokes),
    )


def _with_long_start(path: Path, reach: float) -> Path:
    """Return the path with its first arcs joined to one arc, up to a length of `reach` (m).

    Unchanged if these arcs do not lie on one circle.
    """
    first, way = list(path.segments), 0.0
    count = next((i for i, s in enumerate(first, 1) if (way := way + s.length) >= reach), len(first))
    head = Path(tuple(first[:count]))
    if count == 1 or not all(isinstance(segment, Arc) for segment in head):
        return path
    arc = arc_through(head.start, _halfway(head), head.end, 0.0)
    if max(arc.distance(segment.at(share)) for segment in head for share in (0.0, 0.5)) > SAME:
        return path
    return Path((arc, *first[count:]))


def _halfway(path: Path) -> Point:
    remaining = path.length / 2
    for segment in path:
        if remaining <= segment.length:
            return segment.at(remaining / segment.length)
        remaining -= segment.length
    return path.end


def winding(coil: Coil) -> tuple[Trace | Via, ...]:
    """Return the coil's conductor without its leads.

    It ends with the last turn, or with the hole if the last turn ends inside the coil.
    """
    turns = [i for i, piece in enumerate(coil.series) if isinstance(piece, Trace) and piece.role is Role.WINDING]
    last = turns[-1] + 1
    if len(turns) % 2:
        last += next(i for i, piece in enumerate(coil.series[last:], 1) if isinstance(piece, Via))
    return coil.series[turns[0] : last]
