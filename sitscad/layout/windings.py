"""Windings of the coils, and the vias and short tracks that join their layers inside the coil.

The spiral of each layer is joined to the spiral of the next layer, so that the current circulates in one sense through
all layers. A stub is the short track from a spiral's inner end to a via. Inner vias are searched once for all coils
with the same rotation.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cache, lru_cache
from itertools import combinations, islice, pairwise

import numpy as np

from sitscad.basics.arrays import Array, Flags, Index
from sitscad.basics.finding import Missing, Shortfall
from sitscad.basics.record import record, replace
from sitscad.kernels.geometry.path import Path, Point, Segment, polar, polyline
from sitscad.kernels.geometry.shapes import CHORD_TOLERANCE, SpiralDimensions
from sitscad.layout.board import Winding
from sitscad.layout.clearance import ALONG, ViaToPlace, hole_distance, hole_keep_out, joined_hole, off_stretch
from sitscad.layout.lanes import lead_spacings
from sitscad.spec.circuit import CopperLayer
from sitscad.spec.coil import CoilPlacement, CoilSpec
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.sensor import ArtworkSpec

RADII, ANGLES = 7, 48  # Rings of places about the centre
"""Number of rings about a coil's centre, and number of trial positions for a via on each ring."""
ROWS, COLUMNS = 9, 61  # The grid of places in a coil that is longer than wide
"""Numbers of rows and columns in the grid of trial positions for a via in a coil that is longer than wide."""

MOST = 160
"""Largest number of candidate vias for one pair of layers in the comparison with the candidates of other pairs.

Some are the candidates with the shortest stubs. The others are an even selection of the remaining candidates.
"""

TRIALS = 4_000  # Combinations after which the search gives up
"""Largest number of trials in the search for vias that keep their distance from each other."""
SAMPLE = 60e-6  # Distance (m) of the points that stand for a turn
"""Distance (m) of sampled points on a turn or stub."""

SHARPEST = math.cos(math.radians(82.0))
"""Cosine of the smallest permitted angle between a straight stub and the turn at its end.

Etchant stays in sharper corners.
"""

AT_ONCE = 60_000  # Places and points that are compared at once: as many as stay near the processor
"""Number of distances from via positions to points on turns in one array. More would not fit into the CPU's cache."""
ROUNDING = 0.5e-6  # Error (m) of distances between sampled points
"""Tolerance (m) for distances that are computed between sampled points."""


@record
class InnerJoin:
    """A via inside the coil (`hole`), and its stubs.

    Each of `stubs` is (copper layer, path from the winding's inner end to the via).
    """

    hole: ViaToPlace
    stubs: tuple[tuple[int, Path], ...]

    def shifted(self, dx: float, dy: float) -> InnerJoin:
        """Return the join moved by `dx`, `dy` (m)."""
        hole = ViaToPlace(self.hole.centre.shifted(dx, dy), self.hole.pad, self.hole.drill)
        return InnerJoin(hole, tuple((layer, path.shifted(dx, dy)) for layer, path in self.stubs))


@record
class InnerEnd:
    """Inner end of one layer's spiral, on copper layer `layer`.

    `back` is the unit vector from this end back along the innermost turn.
    """

    point: Point
    layer: int
    back: tuple[float, float]


@record
class Inside:
    """Free area inside a coil.

    `clear_radius` (m) is the radius of the largest circle about `centre` without copper. `longer` (m) is the coil's
    length minus its width, and `rotation` (rad) is the direction of its length.
    """

    centre: Point
    clear_radius: float
    longer: float = 0.0
    rotation: float = 0.0


def place_inner_vias(
    windings: Sequence[Winding], turns: Sequence[float], inside: Inside, width: float, rules: DesignRules,
    spacing: float, turn_spacing: float, thorough: bool = True,
) -> tuple[InnerJoin, ...] | None:
    """Return one via and its stubs for each pair of inner ends.

    If the number of layers is odd, the last end has its own via.

    `turns` are the numbers of turns of the windings. `width` (m) is the track width, `spacing` (m) the gap that vias
    and stubs must keep, and `turn_spacing` (m) the gap between turns. Positions with short stubs are preferred. If
    `thorough` is False, not all positions are tried. None if there is no room.
    """
    innermost = [_Innermost.of(winding, count) for winding, count in zip(windings, turns, strict=True)]
    joins = [tuple(turn.end for turn in innermost[i : i + 2]) for i in range(0, len(innermost), 2)]
    hole = ViaToPlace(inside.centre, rules.via_pad, rules.via_drill)
    least_spacing = width + min(turn_spacing, rules.trace_spacing)
    room = _StubRoom({turn.end.layer: turn.points for turn in innermost}, width + spacing, least_spacing)
    distinct = [room.points[layer] for layer in sorted(set(room.alike.values()))]
    places = _clear_places(inside, joins[0][0].point, distinct, hole_keep_out(hole, rules, spacing), width)
    if inside.longer > 1e-9 and len(places):  # the grid along a long coil reaches into its corners, beyond round ones
        for turn, count in zip(innermost, turns, strict=True):
            if count > 1.0 - 1e-9:  # less than a turn encloses no point
                # whether a turn, closed by a straight line, goes round each place (n): its winding
                # number about it is not 0
                points = Path(tuple(turn.segments)).flattened(SAMPLE / 6)
                corners = np.array([*points, points[0]])
                (ax, ay), (bx, by) = corners[:-1].T[..., None], corners[1:].T[..., None]
                x, y = places.T
                side = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
                up, down = (ay <= y) & (by > y) & (side > 0), (ay > y) & (by <= y) & (side < 0)
                places = places[np.asarray(np.sum(up, axis=0) != np.sum(down, axis=0))]
    options = [_Candidates(ends, places, room, hole) for ends in joins]
    chosen, thinned = _at_once(options, rules, spacing, width), list[list[InnerJoin]]()
    if chosen is None:
        thinned = [option.thinned for option in options]
        chosen = _choose(thinned, rules, spacing, width)
    if chosen is not None or not thorough:
        return chosen
    if not holes_fit(places, len(joins), hole_distance(hole, hole, rules, spacing)):
        return None
    everywhere = []  # the first third as they are, the rest thinned out evenly
    for candidates in map(list, options):
        stride = max(1, math.ceil((len(candidates) - MOST // 3) / (MOST - MOST // 3)))
        everywhere.append(candidates[: MOST // 3] + candidates[MOST // 3 :: stride])
    return None if everywhere == thinned else _choose(everywhere, rules, spacing, width)


@record
class _Innermost:
    """The innermost one and a quarter turns of a layer: inner end, segments, and points (n, 2; m) on these segments."""

    end: InnerEnd
    segments: tuple[Segment, ...]
    points: Array

    @classmethod
    def of(cls, winding: Winding, turns: float) -> _Innermost:
        """Return the innermost 1.25 turns of a winding with `turns` turns."""
        path = winding.path if winding.inward else winding.path.reversed()
        end, before = path.end, path.segments[-1].at(1.0 - min(0.5, 20e-6 / path.segments[-1].length))
        length = end.distance(before)
        inner = InnerEnd(end, winding.layer, ((before.x - end.x) / length, (before.y - end.y) / length))
        segments = path.segments[-math.ceil(len(path.segments) * min(1.0, 1.25 / turns)) :]
        points: list[Point] = []
        for segment in segments:
            count = max(2, math.ceil(segment.length / SAMPLE))
            points.extend(segment.at(i / count) for i in range(count + 1))
        return cls(inner, segments, np.array(points))


def room_needed(joins: int, rules: DesignRules, spacing: float) -> float:
    """Return the diameter (m) of the area inside a coil that `joins` vias need on one ring with gaps `spacing` (m)."""
    hole = joined_hole(rules, 0.0)
    keep = hole_keep_out(hole, rules, spacing)
    if joins == 1:
        return 2.0 * keep
    return 2.0 * keep + hole_distance(hole, hole, rules, spacing) / math.sin(math.pi / joins)


def _clear_places(inside: Inside, towards: Point, copper: Sequence[Array], keep: float, width: float) -> Array:
    """Return positions (n, 2; m) for a via inside the coil with sufficient distance from the turns of each layer.

    `towards` is the position at which the order of positions begins. `copper` lists points (n, 2; m) on the turns.
    `keep` (m) is the least distance from the via's centre to the edge of a track of `width` (m).
    """
    reach = inside.clear_radius - keep
    if reach < -1e-9:
        return np.empty((0, 2))
    places = np.array(list(_places(inside, towards, max(0.0, reach))))
    turns = np.concatenate(copper)
    rows = max(1, AT_ONCE // len(turns))
    nearest = []
    for some in (places[k : k + rows] for k in range(0, len(places), rows)):
        across, up = (np.square(some[:, None, axis] - turns[None, :, axis]) for axis in (0, 1))
        across += up
        nearest.append(np.min(across, axis=1))
    return np.asarray(places[np.sqrt(np.concatenate(nearest)) >= keep + width / 2 - ROUNDING])


def _places(inside: Inside, towards: Point, reach: float) -> Iterator[Point]:
    """Yield trial positions for a via: the centre, then rings about it with a radius of `reach` (m) or less.

    A long coil also has a grid along its length, no wider than the rings.
    """
    centre = inside.centre
    start = math.atan2(towards.y - centre.y, towards.x - centre.x)
    yield centre
    for ring in range(RADII):
        radius = reach * (1.0 - ring / RADII)
        for i in range(ANGLES):
            yield polar(radius, start + 2.0 * math.pi * i / ANGLES, centre)
    if inside.longer > 1e-9:
        lengths, widths = np.meshgrid(
            np.linspace(-1.0, 1.0, COLUMNS) * (reach + inside.longer / 2), np.linspace(-1.0, 1.0, ROWS) * reach
        )
        cosine, sine = math.cos(inside.rotation), math.sin(inside.rotation)
        for x, y in zip(lengths.ravel().tolist(), widths.ravel().tolist(), strict=True):
            yield Point(centre.x + x * cosine - y * sine, centre.y + x * sine + y * cosine)


class _StubRoom:
    """Check of stubs against the turns. Each layer's turn is represented by points (n, 2; m).

    The distance of a stub's centre line from the turns must be `wanted` (m) or more. Near the stub's own end, the
    smaller distance `asked` (m) is sufficient.
    """

    def __init__(self, points: dict[int, Array], spacing: float, least_spacing: float) -> None:
        self.points, self.wanted, self.asked = points, spacing, least_spacing
        self._stub_paths: dict[int, Array] = {}  # from each point along the turn to its end (m)
        self.alike: dict[int, int] = {}  # for each layer, the first layer with the same position
        for layer, turn in points.items():
            steps = np.hypot(*np.diff(turn, axis=0).T)
            self._stub_paths[layer] = np.append(np.cumsum(steps[::-1])[::-1], 0.0)
            earlier = ((k, points[k]) for k in self.alike.values())
            same = (k for k, p in earlier if p.shape == turn.shape and np.all(np.abs(p - turn) <= 1e-12))
            self.alike[layer] = next(same, layer)
        self._known: dict[tuple[int, Point], int | None] = {}

    def stub(self, end: InnerEnd, place: Point) -> Path | None:
        """Return the path from a turn's end to a via at `place`.

        It is straight, or begins at a right angle to the turn, or begins along the turn. None if each path bends back
        sharply or comes too close to a turn away from its own end.
        """
        if end.point.distance(place) < 1e-9:
            return None
        key = self.alike[end.layer], place
        if key not in self._known:
            paths = enumerate(_stub_paths(end, place, self.wanted))
            self._known[key] = next((k for k, path in paths if self.admits(end, path)), None)
        which = self._known[key]
        return None if which is None else polyline(next(islice(_stub_paths(end, place, self.wanted), which, None)))

    def admits(self, end: InnerEnd, corners: list[Point]) -> bool:
        """Whether a stub keeps the distance `wanted` from the turns, and `asked` near its own end.

        `corners` are the stub's corner points.
        """
        turns, points = self.points[end.layer], _spread(corners)
        beside = _in_box(turns, points, max(self.wanted, self.asked))
        squares = np.square(turns[beside, :1] - points[:, 0])
        squares += np.square(turns[beside, 1:] - points[:, 1])
        near = squares < (self.asked - ROUNDING) ** 2
        off = np.hypot(points[:, 0] - end.point.x, points[:, 1] - end.point.y) > 1.7 * self.wanted
        if (squares[:, off] < (self.wanted - ROUNDING) ** 2).any():
            return False
        near[:, off] = False
        if not near.any():
            return True
        steps = np.hypot(*(points - np.concatenate([[end.point], points[:-1]])).T)
        way = self._stub_paths[end.layer][beside, None] + np.cumsum(steps)
        return not np.any(near & (way >= ALONG * self.asked))


def _in_box(points: Array, centres: Array, reach: float) -> Index:
    """Return the indices of `points` in the bounding box of `centres`, enlarged by `reach` (m) on each side.

    Other points are farther than `reach` from all centres.
    """
    (low_x, low_y), (high_x, high_y) = (centres.min(axis=0) - reach).tolist(), (centres.max(axis=0) + reach).tolist()
    x, y = points.T
    return np.flatnonzero((x >= low_x) & (x <= high_x) & (y >= low_y) & (y <= high_y))


def _stub_paths(end: InnerEnd, place: Point, keep: float) -> Iterator[list[Point]]:
    """Yield the corner points of possible stubs from an inner end to a via at `place`: straight, or with one bend.

    `keep` (m) is the distance of the stub from the turns.
    """
    dx, dy = place.x - end.point.x, place.y - end.point.y
    back = dx * end.back[0] + dy * end.back[1]
    if back <= SHARPEST * math.hypot(dx, dy):
        yield [end.point, place]
    nx, ny = -end.back[1], end.back[0]
    across = dx * nx + dy * ny
    for most in (1.5 * keep, abs(across)):
        step = math.copysign(min(most, abs(across)), across)
        if abs(step) > 1e-9:
            yield [end.point, end.point.shifted(step * nx, step * ny), place]
    if back < -1e-9:
        yield [end.point, end.point.shifted(back * end.back[0], back * end.back[1]), place]


def _spread(corners: list[Point]) -> Array:
    """Return points (n, 2; m) on a stub, at most `SAMPLE` apart and at least eight on each straight piece."""
    parts = []
    for start, end in pairwise(corners):
        fractions = _shares(max(8, math.ceil(start.distance(end) / SAMPLE)))
        parts.append(np.array(start) + fractions * np.array((end.x - start.x, end.y - start.y)))
    return np.concatenate(parts) if len(parts) > 1 else parts[0]


@lru_cache(maxsize=256)
def _shares(count: int) -> Array:
    """Return the fractions 1/`count` to 1, in steps of 1/`count`: (count, 1)."""
    return np.asarray(np.arange(1, count + 1)[:, None] / count)


class _Candidates:
    """Candidate vias for one or two inner ends, sorted by the sum of the straight distances to these ends.

    All candidates keep their distance from the turns. They are computed on demand, because few are needed.
    """

    def __init__(self, ends: tuple[InnerEnd, ...], places: Array, room: _StubRoom, hole: ViaToPlace) -> None:
        lengths = np.round(sum(np.hypot(places[:, 0] - e.point.x, places[:, 1] - e.point.y) for e in ends), 9)
        self._ends, self._room, self._hole = ends, room, hole
        self._places = places[np.argsort(lengths, kind="stable")] if len(places) else places
        self._known: dict[int, InnerJoin | None] = {}

    def __iter__(self) -> Iterator[InnerJoin]:
        return self._at(range(len(self._places)))

    @property
    def thinned(self) -> list[InnerJoin]:
        """At most `MOST` candidates: a third with the shortest stubs, and an even selection of the others."""
        near = list(islice(self, MOST // 3))
        rest = range(max(self._known, default=-1) + 1, len(self._places))
        stride = max(1, math.ceil(len(rest) / (MOST - len(near))))
        return near + list(self._at(rest[::stride]))

    def _at(self, order: range) -> Iterator[InnerJoin]:
        """Yield the candidates at the positions with the indices `order`. Each candidate is computed once."""
        for index in order:
            if index not in self._known:
                self._known[index] = self._join(Point(*self._places[index].tolist()))
            join = self._known[index]
            if join is not None:
                yield join

    def _join(self, place: Point) -> InnerJoin | None:
        stubs = []
        for end in self._ends:
            stub = self._room.stub(end, place)
            if stub is None:
                return None
            stubs.append((end.layer, stub))
        return InnerJoin(ViaToPlace(place, self._hole.pad, self._hole.drill), tuple(stubs))


def _at_once(
    options: Sequence[_Candidates], rules: DesignRules, spacing: float, width: float
) -> tuple[InnerJoin, ...] | None:
    """Return, for each join, the first candidate that keeps the clearances to the vias chosen before.

    None if a join has no such candidate.
    """
    chosen: list[InnerJoin] = []
    for each in options:
        near = islice(each, MOST // 3)
        fits = (j for j in near if all(_apart([[other], [j]], rules, spacing, width)[0, 1].all() for other in chosen))
        join = next(fits, None)
        if join is None:
            return None
        chosen.append(join)
    return tuple(chosen)


def holes_fit(places: Array, count: int, apart: float) -> bool:
    """Whether `count` holes could lie at some of the positions with centre distances of `apart` (m) or more.

    Stubs are not considered. False is certain; True may be wrong.
    """
    if len(places) < count:
        return False
    apart_sets = _sets(np.hypot(*(places[:, None] - places).transpose(2, 0, 1)) >= apart - 1e-9)
    pairs = {(i, j): apart_sets for i in range(count) for j in range(i + 1, count)}
    choice, is_certain = one_of_each([len(places)] * count, pairs)
    return choice is not None or not is_certain


def _choose(
    candidates: list[list[InnerJoin]], rules: DesignRules, spacing: float, width: float
) -> tuple[InnerJoin, ...] | None:
    """Return one candidate per join, so that all keep their clearances to each other. None if the search finds none."""
    if not all(candidates):
        return None
    apart = {pair: _sets(table) for pair, table in _apart(candidates, rules, spacing, width).items()}
    chosen, _ = one_of_each([len(each) for each in candidates], apart)
    return None if chosen is None else tuple(each[k] for each, k in zip(candidates, chosen, strict=True))


def one_of_each(sizes: Sequence[int], apart: dict[tuple[int, int], list[int]]) -> tuple[list[int] | None, bool]:
    """Return one candidate number per join so that all keep their clearances, and whether the search was complete.

    If the search finds no such combination, None replaces the numbers. `sizes` are the joins' numbers of candidates.
    `apart` maps two joins to a list of bit sets, one for each candidate of the first join. Bit k is 1 if candidate k of
    the second join keeps its clearance to this candidate.
    """
    count, trials = len(sizes), 0

    def search(join: int, remaining: list[int]) -> list[int] | None:
        """Return candidate numbers for the joins from `join` on. None if no combination keeps all clearances.

        `remaining` holds a bit set of possible candidates per join.
        """
        nonlocal trials
        options = remaining[join]
        while options and trials < TRIALS:
            trials += 1
            pick = (options & -options).bit_length() - 1
            options &= options - 1
            if join + 1 == count:
                return [pick]
            after = [mask & apart[join, k][pick] if k > join else mask for k, mask in enumerate(remaining)]
            if all(after[join + 1 :]):
                rest = search(join + 1, after)
                if rest is not None:
                    return [pick, *rest]
        return None

    return search(0, [(1 << size) - 1 for size in sizes]), trials < TRIALS


def _sets(table: Flags) -> list[int]:
    """Return each row of a table of flags as an integer whose bit k is the flag in column k."""
    return [int.from_bytes(np.packbits(row, bitorder="little").tobytes(), "little") for row in table]


def _apart(
    candidates: list[list[InnerJoin]], rules: DesignRules, spacing: float, width: float
) -> dict[tuple[int, int], Flags]:
    """Return, for each pair of joins, flags (first, second): whether two candidates keep their clearances.

    If two joins have the same positions for their holes, the distances to these holes are computed once.
    """
    hole = candidates[0][0].hole
    keep = hole_keep_out(hole, rules, spacing) + width / 2 - 1e-9
    holes = [np.array([join.hole.centre for join in joins]) for joins in candidates]
    alike = [next(k for k, first in enumerate(holes) if np.array_equal(first, places)) for places in holes]
    stubs_clear = cache(lambda join, other: _stubs_clear(candidates[join], holes[other], keep))
    tables = {}
    for i, j in combinations(range(len(candidates)), 2):
        distances = np.hypot(*(holes[i][:, None] - holes[j]).transpose(2, 0, 1))
        apart = distances >= hole_distance(hole, hole, rules, spacing) - 1e-9
        if apart.any():
            apart &= stubs_clear(i, alike[j]) & stubs_clear(j, alike[i]).T
        tables[i, j] = np.asarray(apart)
    return tables


def _stubs_clear(joins: list[InnerJoin], holes: Array, keep: float) -> Flags:
    """Return flags (joins, holes): whether the stubs of each join are `keep` (m) or more from each hole's centre."""
    rows = [(k, *line.start, *line.end) for k, join in enumerate(joins) for _, path in join.stubs for line in path]
    table = np.array(rows)
    start, step = table[:, 1:3], table[:, 3:5] - table[:, 1:3]
    distance = off_stretch(*(holes.T[:, None] - start.T[:, :, None]), *step.T[:, :, None])
    nearest = np.full((len(joins), len(holes)), np.inf)
    np.minimum.at(nearest, table[:, 0].astype(int), distance)
    return np.asarray(nearest >= keep)


def wind_coil(
    artwork: ArtworkSpec, placement: CoilPlacement, tolerance: float = CHORD_TOLERANCE
) -> tuple[Winding, ...]:
    """Return the windings of a coil's layers in the order of the current.

    The current flows inwards in the first, third, ... winding. The other windings are mirrored, and the current flows
    outwards. `tolerance` (m) is the largest distance between the spiral and the segments that replace it.
    """
    coil, copper = placement.own or artwork.coil, artwork.fpc.stackup.copper
    windings = _wind(coil, tuple(copper[number - 1] for number in coil.layers), placement.rotation, tolerance)
    if placement.centre == (0.0, 0.0):
        return windings
    return tuple(replace(winding, path=winding.path.shifted(*placement.centre)) for winding in windings)


@lru_cache(maxsize=16)
def _wind(coil: CoilSpec, layers: tuple[CopperLayer, ...], rotation: float, tolerance: float) -> tuple[Winding, ...]:
    """Return the windings of a coil whose centre is the origin, for all coils of an array with this rotation."""
    sense = -1 if coil.clockwise else 1
    sweeps = [sense * 2.0 * math.pi * turns for turns in coil.layer_turns]
    angle = coil.outline.start(coil.start_angle, sense, coil.is_mid_side)
    windings = []
    for index, copper in enumerate(layers):
        inward = index % 2 == 0
        if not inward:
            angle += sweeps[index - 1] + sweeps[index]  # on to the inner end of the layer before, and out as far again
        layer_sense = sense if inward else -sense
        turns = coil.layer_turns[index]
        dimensions = SpiralDimensions(coil.size, coil.trace_width, coil.pitch, turns, tolerance, coil.is_mid_side)
        path = coil.outline.wind(dimensions, angle, layer_sense, coil.corner_radius)
        path = path if inward else path.reversed()
        path = path.rotated(rotation) if rotation else path
        windings.append(Winding(copper.number, copper.z, copper.thickness, angle + rotation, layer_sense, inward, path))
    return tuple(windings)


@record
class WoundCoil:
    """A coil without leads.

    `inner` holds its inner vias. `way_out_layer` is the copper layer on which a lead runs from inside the coil under
    the turns to the outside. It is None if the number of layers is even or if no layer is free. `shortfalls` lists
    missing room.
    """

    windings: tuple[Winding, ...]
    inner: tuple[InnerJoin, ...]
    way_out_layer: int | None
    shortfalls: tuple[Shortfall, ...]


def wind_all(artwork: ArtworkSpec) -> tuple[WoundCoil, ...]:
    """Return all coils with their inner vias, which are searched once for each kind and rotation of a coil."""
    coils = []
    joined: dict[tuple[CoilSpec, float], tuple[tuple[InnerJoin, ...], tuple[Shortfall, ...]]] = {}
    for placement in artwork.array.placements:
        coil = placement.own or artwork.coil
        # the copper layer on which a coil with an odd number of layers comes out from under its turns: 2 if free
        free = [layer.number for layer in artwork.fpc.stackup.copper if layer.number not in coil.layers]
        out = next((number for number in free if number == 2), free[0] if free else None)
        way_out = out if len(coil.layers) % 2 else None
        key = coil, placement.rotation
        if key not in joined:
            joined[key] = _joined_inside(artwork, placement, way_out)
        joins, shortfalls = joined[key]
        moved = tuple(join.shifted(*placement.centre) for join in joins)
        coils.append(WoundCoil(wind_coil(artwork, placement), moved, way_out, shortfalls))
    return tuple(coils)


def _joined_inside(
    artwork: ArtworkSpec, placement: CoilPlacement, way_out: int | None
) -> tuple[tuple[InnerJoin, ...], tuple[Shortfall, ...]]:
    """Return the inner vias of a coil with their stubs, and the shortfalls of room.

    The gap of vias and stubs is the first value of `lead_spacings` for which there is room inside the coil.
    """
    stackup, rules, centre = artwork.fpc.stackup, artwork.fpc.rules, Point(0.0, 0.0)
    coil, windings = placement.own or artwork.coil, wind_coil(artwork, replace(placement, centre=centre))
    if len(windings) % 2 and way_out is None:  # it ends inside, and no copper layer is left to come out on
        layers = len(coil.layers)
        have, named = float(len(stackup.copper)), (("count", layers), ("stackup", stackup.name), ("more", layers + 1))
        return (), (Shortfall(Missing.WAY_OUT, have, float(layers + 1), "copper layers", facts=named),)
    clear = min(winding.path.distance(centre) for winding in windings) - coil.trace_width / 2  # no turn's copper enters
    inside = Inside(centre, clear, coil.size[0] - coil.size[1], placement.rotation)
    for spacing in lead_spacings(coil.trace_spacing, rules.trace_spacing):
        widths = coil.trace_width, rules, spacing, coil.trace_spacing
        is_least = spacing == rules.trace_spacing
        joins = _inner_joins(windings, coil.layer_turns, inside, *widths, is_least)
        if joins is not None:
            return joins, ()
    count = (len(windings) + 1) // 2
    # in a long coil the vias lie in a row along it, so its width needs room for one
    need = room_needed(1 if inside.longer > 1e-9 else count, rules, rules.trace_spacing)
    return (), (no_inner_room(count, 2.0 * clear, need if need > 2.0 * clear else None),)


def no_inner_room(count: int, have: float, need: float | None) -> Shortfall:
    """Return the shortfall of room for inner vias: `have` and `need` are the available and the needed diameter (m).

    `need` is None if the needed diameter is unknown, because the vias have room but their stubs have not.
    """
    return Shortfall(Missing.INNER_ROOM, have, need, "m", facts=(("count", count), ("clear", max(0.0, have))))


_inner_joins = lru_cache(maxsize=64)(place_inner_vias)
# Coils that differ in their place only share it, and so do boards that are tried to find out what helps.
