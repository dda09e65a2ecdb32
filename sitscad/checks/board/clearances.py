"""SIT107 to SIT110, SIT114 and SIT115: distances between copper, holes, the board's edge and coverlay openings.

The coverlay rules check the strips between openings, and the copper that openings expose.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations, pairwise

import numpy as np

from sitscad.basics.arrays import Array, Index
from sitscad.basics.finding import Missing, Place
from sitscad.checks.board.fabrication import length_violation, minimum_gap_source
from sitscad.checks.fixes.moves import larger_connectors, wider_tracks
from sitscad.checks.fixes.search import Family, with_value
from sitscad.checks.rules import ROUNDING, Rule, Verdict, Violation, rule_of, violation_of
from sitscad.data import is_unverified
from sitscad.estimates.design import Design, cached_per_board
from sitscad.kernels.geometry.path import Arc, Line, Path, Point
from sitscad.kernels.geometry.primitives import (
    Primitives,
    distances,
    distances_to_points,
    from_rows,
    nearest_pairs,
    path_rows,
)
from sitscad.layout.board import Pad, Role, Trace, Via
from sitscad.layout.gaps import (
    Copper,
    Item,
    Nearness,
    copper_of,
    drill_nearness,
    name_of,
    pair_in_words,
    too_near,
)
from sitscad.layout.outline import rim_lap
from sitscad.spec.circuit import LayerKind
from sitscad.spec.coil import CoilSpec
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.resolver.coils import reference_coil_key
from sitscad.spec.sensor import SensorSpec

GRAIN = 1e-6
"""Rounding step (m) of the spacings that hints propose."""

ALLOWED_SHORTFALL = 1e-6
"""Largest length (m) by which a drawn gap may be smaller than the minimum of the rules.

The gap between turns of a spiral, perpendicular to the track, is a little smaller than the spacing in the spec.
"""


def spiral_gap_reduction(coil: CoilSpec) -> float:
    """Return the largest difference (m) between a round coil's spacing and the gap between neighbouring turns.

    The gap is measured perpendicular to the track, so it is smaller than the spacing. The difference is largest at the
    inner end. There, the spiral deviates most from a circle, by the ratio of pitch to circumference.
    """
    if not coil.outline.is_round:
        return 0.0
    inner = (coil.size[0] - coil.trace_width) / 2 - coil.pitch * max(coil.layer_turns)
    slope = coil.pitch / (2.0 * math.pi * max(inner, coil.pitch / 2))
    return coil.pitch * (1.0 - math.cos(math.atan(slope)))


def copper_to_edge(design: Design) -> Iterator[Verdict]:
    """Yield findings on copper that is nearer to the board's outline than the fabricator's minimum.

    The contacts of a tail may extend to the end that is plugged into the connector.
    """
    spec, rules, tail, copper = design.spec, design.spec.fpc.rules, design.spec.fpc.tail, cached_copper(design)
    # A body too small for its coils is one finding (SIT135), not one for every layer of every coil
    has_body_room = not any(short.what is Missing.BODY_ROOM for short in design.layout.shortfalls)
    for (name, layer), (gap, index, item) in _near_edge(copper, design.layout.outline, rules, tail is not None).items():
        x, y = copper.pieces.start[index].tolist()
        place, missing = Place(x, y, layer, (item.net,)), rules.copper_to_edge - gap
        if tail is not None and isinstance(item, Trace) and item.role is Role.TAIL:
            yield length_violation(
                "edge", rules, "copper_to_edge", gap, "fpc.tail.connector", place, hint=(
                    "edge-contacts-unverified" if is_unverified(tail.connector.source, "edge_margin")
                    else "edge-contacts"),
                fixes=(lambda: larger_connectors(spec, "edge_margin"),), item=name, layer=layer, missing=missing,
                gap=max(0.0, gap), connector=tail.connector.name, margin=tail.connector.edge_margin,
            )
        elif has_body_room:
            yield length_violation("edge", rules, "copper_to_edge", gap, "coil.outer_diameter", place, item=name,
                                   layer=layer, missing=missing, gap=max(0.0, gap))


def _near_edge(
    copper: Copper, outline: Path, rules: DesignRules, has_tail: bool
) -> dict[tuple[str, int], tuple[float, int, Item]]:
    """Return the items of copper (tracks, vias, contacts) that are too near to the board's edge.

    Keys are (item's name, copper layer). Values are (smallest gap in m, number of the piece of copper with this gap,
    item). The limit is the fabricator's ``copper_to_edge``. Contacts are left out if the board has a tail.
    """
    worst: dict[tuple[str, int], tuple[float, int, Item]] = {}
    for index, gap in edge_gaps(copper, outline_primitives(outline), rules.copper_to_edge):
        item, layer = copper.items[copper.item[index]], int(copper.layer[index])
        if isinstance(item, Pad) and has_tail:
            continue
        name = name_of(item), layer
        if name not in worst or gap < worst[name][0]:
            worst[name] = gap, index, item
    return worst


def drill_to_copper(design: Design) -> Iterator[Verdict]:
    """Yield findings on holes whose wall is too near to copper of another conductor, on any layer."""
    rules = design.spec.fpc.rules
    for near in drill_nearness(cached_copper(design), rules.drill_to_copper - ALLOWED_SHORTFALL):
        via, foreign = (near.one, near.other) if isinstance(near.one, Via) else (near.other, near.one)
        yield length_violation("drill-to-copper", rules, "drill_to_copper", near.gap, "coil.turns",
                               Place(near.x, near.y, near.layer, near.nets), net=via.net, item=name_of(foreign),
                               layer=near.layer, gap=max(0.0, near.gap), missing=rules.drill_to_copper - near.gap)


def outline_primitives(outline: Path) -> Primitives:
    """Return the lines and arcs of a closed outline as `Primitives`, the arrays from which distances are computed."""
    return from_rows([row for row, _ in path_rows(outline)])


def cached_copper(design: Design) -> Copper:
    """Return the copper of the design, computed once for all rules."""
    return cached_per_board(design, "copper", lambda: copper_of(design.layout))


def edge_gaps(copper: Copper, edge: Primitives, minimum: float) -> Iterator[tuple[int, float]]:
    """Yield (number of the piece, gap in m) for each piece of copper nearer to the edge than `minimum` (m).

    Gaps that are smaller by no more than `ALLOWED_SHORTFALL` are allowed.
    """
    reach = copper.half + minimum
    pairs = nearest_pairs(copper.pieces.boxes, reach, edge.boxes, np.zeros(len(edge)))
    i, j = pairs[:, 0], pairs[:, 1]
    gap = distances(copper.pieces.take(i), edge.take(j)) - copper.half[i]
    for k in np.flatnonzero(gap < minimum - ALLOWED_SHORTFALL):
        yield int(i[k]), float(gap[k])


def _worst_pair_of_each_kind(design: Design, of_vias: bool, key: str) -> Iterator[Violation]:
    """Yield a violation for each kind of pair of copper pieces that are too near to each other.

    For each kind, the pair with the smallest gap is reported. A kind is, for example, turn to turn, or lead to turn of
    another net. With `of_vias`, only pairs with a via are compared, otherwise only pairs of tracks and contacts. `key`
    is the key of the spec to which the finding points.
    """
    kinds: dict[tuple[object, ...], list[Nearness]] = {}
    spacing = design.spec.fpc.rules.trace_spacing
    winding = min(spacing, design.spec.coil.trace_spacing, design.spec.reference_coil.trace_spacing)
    for near in cached_per_board(design, "near copper", lambda: tuple(
            too_near(cached_copper(design), spacing - ALLOWED_SHORTFALL, winding - ALLOWED_SHORTFALL))):
        if (isinstance(near.one, Via) or isinstance(near.other, Via)) is of_vias:
            pair = sorted((_conductor_kind(near.one), _conductor_kind(near.other)))
            kinds.setdefault((*pair, near.one.net == near.other.net, near.one is near.other), []).append(near)
    for places in kinds.values():
        yield _gap_violation(design.spec, design.layout.traces, places[0], len(places), key)


def _gap_violation(spec: SensorSpec, traces: tuple[Trace, ...], near: Nearness, places: int, key: str) -> Violation:
    """Return the violation for two pieces of copper that are too near to each other.

    `traces` are the tracks of the board, and `near` describes the pair. `places` is the number of pairs of this kind.
    `key` is the key of the spec to which the finding points.
    """
    minimum = near.asked + ALLOWED_SHORTFALL
    holder, source = minimum_gap_source(spec.fpc.rules, minimum)
    hint, fixes = "", tuple[Family, ...]()
    # a turn near another turn of its coil, or near the conductor that continues it
    kinds, of_turns = {_conductor_kind(near.one), _conductor_kind(near.other)}, {Role.WINDING, Role.STUB, Role.LEAD}
    is_of_turns = near.one.net == near.other.net and Role.WINDING in kinds <= of_turns
    is_own = is_of_turns and spec.reference_coil is not spec.coil and near.one.net == spec.all_placements[-1].name
    coil = spec.reference_coil if is_own else spec.coil
    radius = _common_radius(coil, traces, near.one.net) if is_of_turns else None
    if radius is not None:
        key, hint = "coil.corner_radius", "gap-radius"
        fixes = (lambda: [with_value(spec, "coil.corner_radius", radius, f"{radius * 1e3:.6g}")],)
    elif is_of_turns and minimum - near.gap <= spiral_gap_reduction(coil):
        spacing = GRAIN * math.ceil((coil.trace_spacing + (minimum - near.gap)) / GRAIN - 1e-6)
        # with fewer turns if the wider pitch needs their room
        key, hint, fixes = "coil.trace_spacing", "gap-spiral", (lambda: wider_tracks(spec, 0.0, spacing),)
    if is_own and key.startswith("coil."):
        key, fixes = reference_coil_key(key), ()
    return violation_of(
        "gap", key, near.gap, minimum, "m", hint=hint, details=("gap-places",) if places > 1 else (), source=source,
        place=Place(near.x, near.y, near.layer, near.nets), fixes=fixes, pair=pair_in_words(near), layer=near.layer,
        gap=max(0.0, near.gap), house=holder, places=places, missing=minimum - near.gap,
        radius=f"{(radius or 0.0) * 1e3:.6g}",
    )


def _common_radius(coil: CoilSpec, traces: tuple[Trace, ...], net: str) -> float | None:
    """Return the largest corner radius (m) that fits at all corners of the coil of the net `net`, a multiple of 10 um.

    None if all corners have the radius in the spec. None, too, if the layers begin at corners, because the radii there
    differ intentionally.
    """
    if not coil.is_mid_side:
        return None
    radii = [side.radius for trace in traces if trace.role is Role.WINDING and trace.net == net
             for side in trace.path if isinstance(side, Arc)]
    least = min(radii, default=math.inf)
    return math.floor(least * 1e5) * 1e-5 if least < coil.corner_radius - ROUNDING else None


def _conductor_kind(item: Item) -> str:
    return item.role.value if isinstance(item, Trace) else type(item).__name__.lower()


def coverlay_web(design: Design) -> Iterator[Verdict]:
    """Yield findings on strips of coverlay between two openings, and between an opening and the board's edge."""
    layout, rules = design.layout, design.spec.fpc.rules
    for side, openings in (("top", layout.top_openings), ("bottom", layout.bottom_openings)):
        pieces = [outline_primitives(region.outline) for region in openings]
        for opening, next_opening in combinations(pieces, 2):
            yield from _web_findings("web-between-openings", rules, opening, next_opening, side)
        for opening in pieces:
            # an opening's sides and the board's edges, except sides on an edge: there the opening reaches the edge
            edge = outline_primitives(layout.outline)
            pairs = nearest_pairs(opening.boxes, np.full(len(opening), ROUNDING), edge.boxes, np.zeros(len(edge)))
            near, edges = opening.take(pairs[:, 0]), edge.take(pairs[:, 1])
            on = (distances_to_points(edges, near.start) < ROUNDING) & (distances_to_points(edges, near.end) < ROUNDING)
            sides = opening.take(_remaining_numbers(len(opening), pairs[on, 0]))
            inside = _sides_inside(sides, layout.outline, rules.coverlay_web)
            yield from _web_findings("web-to-edge", rules, inside,
                                     edge.take(_remaining_numbers(len(edge), pairs[on, 1])), side)


def _remaining_numbers(count: int, used: Index) -> Index:
    """Return the integers from 0 to `count` - 1 that are not in `used`.

    numpy's own function for this would import its masked arrays first, which takes time.
    """
    free = np.ones(count, dtype=bool)
    free[used] = False
    return np.flatnonzero(free)


def edge_crossings(start: Point, end: Point, corners: Sequence[Point]) -> Iterator[float]:
    """Yield each place at which the line from `start` to `end` crosses a closed polygon, as a fraction of its length.

    `corners` are the corners of the polygon.
    """
    # Line and edge, start + t d and a + u b, meet at parameters given by cross products:
    # t = (a x b) / (d x b) and u = (a x d) / (d x b), with `a` counted from the line's start.
    dx, dy = end - start
    for a, b in pairwise(corners):
        (ax, ay), (bx, by) = (a.x - start.x, a.y - start.y), (b.x - a.x, b.y - a.y)
        across = dx * by - dy * bx
        if across != 0.0 and 0.0 <= (ax * dy - ay * dx) / across < 1.0:
            fraction = (ax * by - ay * bx) / across
            if 0.0 < fraction < 1.0:
                yield fraction


def _web_findings(
    case: str, rules: DesignRules, edges: Primitives, across: Primitives, side: str
) -> Iterator[Violation]:
    """Yield a violation if the distance between two groups of edges is smaller than the rules' ``coverlay_web``.

    The distance is the width of the coverlay strip between two openings, or between an opening and the board's edge.
    `case` is the key of the texts in ``data/messages.csv``, and `side` the board's side (top or bottom).
    """
    # the smallest distance, searched only up to the limit
    pairs = nearest_pairs(edges.boxes, np.full(len(edges), rules.coverlay_web), across.boxes, np.zeros(len(across)))
    web = float(np.min(distances(edges.take(pairs[:, 0]), across.take(pairs[:, 1])), initial=np.inf))
    if web < rules.coverlay_web - ROUNDING:
        yield length_violation(case, rules, "coverlay_web", web, "fpc.tail.connector",
                               Place(float(edges.start[0, 0]), float(edges.start[0, 1])), side=side)


def coverlay_opening(design: Design) -> Iterator[Verdict]:
    """Yield findings on a missing coverlay, on openings too near to tracks and vias, and on rims of solder pads.

    The coverlay must cover the rim of a solder pad by the fabricator's minimum.
    """
    spec, layout, films = design.spec, design.layout, design.spec.fpc.stackup.layers
    rules, tail, target = spec.fpc.rules, spec.fpc.tail, spec.target
    for side, film, openings in (("top", films[0], layout.top_openings), ("bottom", films[-1], layout.bottom_openings)):
        if film.kind is LayerKind.COPPER:
            is_shorted = side == "top" and target is not None and spec.elastomer is None
            yield violation_of("no-coverlay", "fpc.stackup", details=("no-coverlay-target",) if is_shorted else (),
                               side=side, finish=spec.fpc.finish, metal="" if target is None else target.material.name)
        elif film.kind is not LayerKind.COVERLAY and openings:
            yield violation_of("no-opening", "fpc.stackup", side=side, kind=str(film.kind))
    for number, openings in ((1, layout.top_openings), (layout.copper_layers, layout.bottom_openings)):
        for region in openings:
            for item, gap, point in _exposed_copper(cached_copper(design), rules.coverlay_opening_to_trace, number,
                                                    region.outline):
                yield length_violation("opening-to-track", rules, "coverlay_opening_to_trace", gap, "fpc.tail",
                                       Place(float(point[0]), float(point[1]), number, (item.net,)),
                                       item=name_of(item), layer=number, gap=max(0.0, gap))
    # solder pads too small for the coverlay to cover their rims as far as the rules require; all have the same size
    for pad in layout.pads[:1] if tail is None or tail.connector.kind == "pads" else ():
        lap = rim_lap(rules, pad)
        if lap < rules.pad_lap - ROUNDING:
            yield length_violation("pad-lap", rules, "pad_lap", lap, "fpc.tail.connector",
                                   Place(*pad.centre, 1, (pad.net,)))


def _exposed_copper(
    copper: Copper, minimum: float, number: int, opening: Path
) -> Iterator[tuple[Trace | Via, float, Array]]:
    """Yield tracks and vias that a coverlay opening exposes, or that are nearer to it than `minimum` (m).

    Each result has the item, the smallest gap (m; negative inside) and the place of this gap. `number` is the copper
    layer. Tracks that end in the opening are left out, because they lead to its contact.
    """
    edge, corners = outline_primitives(opening), opening.flattened(1e-6)
    worst: dict[int, tuple[float, int]] = {}
    for index, gap in edge_gaps(copper, edge, minimum):
        if copper.layer[index] == number:
            key = int(copper.item[index])
            worst[key] = min(worst.get(key, (gap, index)), (gap, index))
    for key, item in enumerate(copper.items):
        if isinstance(item, Via) and _is_inside_polygon(corners, item.centre):
            worst[key] = (-item.pad / 2.0, int(np.flatnonzero(copper.item == key)[0]))
    for key, (gap, index) in sorted(worst.items()):
        item = copper.items[key]
        ends = (item.path.start, item.path.end) if isinstance(item, Trace) else ()
        if isinstance(item, Via) or (isinstance(item, Trace)
                                     and not any(_is_inside_polygon(corners, end) for end in ends)):
            yield item, gap, copper.pieces.start[index]


def _sides_inside(sides: Primitives, outline: Path, web: float) -> Primitives:
    """Return the parts of an opening's straight sides inside the board's outline.

    The last `web` (m) before an edge that a side crosses is left out, because there the opening extends over the edge
    and leaves no strip. Arcs are returned unchanged.
    """
    corners = outline.flattened(1e-6)
    parts: list[tuple[int, float, float]] = []
    for index in range(len(sides)):
        if sides.radius[index] > 0.0:
            parts.append((index, 0.0, 1.0))
            continue
        start, end = Point(*sides.start[index].tolist()), Point(*sides.end[index].tolist())
        short = web / max(start.distance(end), ROUNDING)
        for first, last in pairwise([0.0, *sorted(edge_crossings(start, end, corners)), 1.0]):
            a, b = first + (short if first > 0.0 else 0.0), last - (short if last < 1.0 else 0.0)
            if b > a and _is_inside_polygon(corners, Line(start, end).at((first + last) / 2.0)):
                parts.append((index, a, b))
    table = np.array(parts, dtype=float).reshape(-1, 3)
    return sides.take(table[:, 0].astype(np.intp)).trimmed(table[:, 1], table[:, 2])


def _is_inside_polygon(corners: Sequence[Point], point: Point) -> bool:
    """Whether a point lies inside a closed polygon (even-odd rule)."""
    inside = False
    for a, b in pairwise(corners):
        if (a.y > point.y) != (b.y > point.y) and point.x < a.x + (point.y - a.y) * (b.x - a.x) / (b.y - a.y):
            inside = not inside
    return inside


RULES: tuple[Rule, ...] = (
    # via pads to conductors that do not join them; then all other pairs, with turns of one coil
    rule_of("SIT107", lambda design: _worst_pair_of_each_kind(design, True, "coil.turns")),
    rule_of("SIT108", lambda design: _worst_pair_of_each_kind(design, False, "coil")),
    rule_of("SIT109", copper_to_edge),
    rule_of("SIT110", drill_to_copper),
    rule_of("SIT114", coverlay_web),
    rule_of("SIT115", coverlay_opening),
)
