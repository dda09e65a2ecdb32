"""Routing of the leads of all coils: along lanes if the coils lie in one line, otherwise by a maze search."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import field
from itertools import chain, islice, product
from typing import Any

from sitscad.basics.finding import Shortfall
from sitscad.basics.record import record, replace
from sitscad.kernels.geometry.path import Point
from sitscad.layout.clearance import Breadth, Obstacles, TrackToPlace, hole_keep_out, joined_hole, via_room
from sitscad.layout.lanes import Bus, Exit, Lane, Ring, assign_lanes, exits, lane_height, rows_of_lanes
from sitscad.layout.outline import body_breadth, ends, far_end, roots, walls
from sitscad.layout.routing.branches import BranchGround, OuterEnd, outermost_turns
from sitscad.layout.routing.escape import NEGLIGIBLE_ARC_TURNS, TRIALS_OF_A_WAVE, Escape, Joined, SearchLimit, escape
from sitscad.layout.routing.maze import Ground, Lattice, Maze
from sitscad.layout.tail.chips import ThermistorSpot
from sitscad.layout.tail.frame import TailFrame, frame, pair_height, turn_lag
from sitscad.layout.tail.thermistor import (
    ThermistorPlace,
    ThermistorRun,
    lowest_place,
    place_in_corner,
    thermistor_entries,
    thermistor_run,
    widest_gap,
)
from sitscad.layout.tail.tracks import Ends, Run, runs, stretched, ways_down
from sitscad.layout.windings import WoundCoil
from sitscad.spec.mount import Jaw
from sitscad.spec.presets import connector
from sitscad.spec.sensor import ArtworkSpec


@record
class Routing:
    """Complete leads of all coils, on a body with the y range `breadth`.

    For each coil, `escapes` holds its leads up to the tail, and `ends` the two conductors from there to the contacts.
    `far` (m) is the x of the body's end away from the tail, for which all copper keeps its distance from the edge.
    """

    bus: Bus
    escapes: tuple[Escape, ...]
    ends: tuple[tuple[Run, Run], ...]
    breadth: Breadth
    far: float
    tail: TailFrame
    thermistor: ThermistorRun | Shortfall | None = None
    """Copper of the soldered thermistor, or the room that it lacks. None if the board carries none."""

    @property
    def excess(self) -> float:
        """Largest number of turns by which a coil's leads run around the coil in excess of the necessary minimum."""
        return max(way.excess for way in self.escapes)


@record
class Stuck:
    """The coil (index) for which the search found no path to the tail.

    `walled` is True if no path can even leave the coil's lead ring. A wider board then does not help.
    """

    coil: int
    walled: bool = False


def front_of(artwork: ArtworkSpec, bus: Bus) -> float:
    """Return the x (m) beyond which leads only run in lanes. All coils, their vias and lead rings end before it."""
    placements = artwork.array.placements
    reach = via_room(artwork.fpc.rules, bus.spacing, bus.width)
    lanes = (len(placements) - 1) // 2 + 1
    ends = (p.centre[0] + Ring(artwork.coil, p, 0.0).half_size[0] for p in placements)
    return max(ends) + reach + lanes * bus.pitch


def boards(artwork: ArtworkSpec, bus: Bus) -> list[tuple[Bus, Breadth]]:
    """Return the trial boards, narrow ones first: (dimensions of the leads, y range of the body).

    The additional room between the coils and the innermost lane is 0, the room of a track, or the room of a via. For
    each of these cases, three board widths are tried. They have room for the lanes alone, for a track beside the coils,
    or for a via beside the coils.
    """
    rules = artwork.fpc.rules
    room = via_room(rules, bus.spacing, bus.width)
    passing = len(artwork.array.placements) // 2
    boards = []
    for base in (0.0, bus.pitch, room) if passing else (0.0,):
        raised = replace(bus, base=base)
        lanes = lane_height(raised, passing - 1, 1) + bus.width / 2 if passing else bus.reach
        for beside in (0.0, bus.spacing + bus.width, room):
            boards.append(
                (raised, _beyond_coils(bus, max(lanes, bus.reach + beside) + rules.copper_to_edge - bus.reach))
            )
    if (box := artwork.body_box) is not None:
        boards = [(raised, Breadth(box[1], box[3])) for raised, _ in boards]
    return sorted(set(boards), key=lambda board: (board[1].half, board[0].base))


def _beyond_coils(bus: Bus, room: float) -> Breadth:
    """Return the y range of a body with `room` (m) beside the outermost coils."""
    return Breadth(round(bus.coils.low - room, 9), round(bus.coils.high + room, 9))


def route_in_line(
    artwork: ArtworkSpec, bus: Bus, windings: tuple[WoundCoil, ...], front: float, searches: SearchLimit
) -> Routing | None:
    """Return the leads of coils in one line, on the narrowest body with sufficient room. None if no body has room.

    The first lane is on the side where the winding of the far coil begins, or else on the other side. Pairs leave their
    lead rings at the corner towards the tail. The far coils are routed first. If no board has room, pairs may also
    leave beside the corner, and a coil without a path is routed first. If leads run farther around their coils than
    necessary, the other side and wider boards are tried as well, up to the jaw's width.
    """
    searches.begin(len(windings))
    placements = artwork.array.placements
    begins = windings[0].windings[0].path.start.y - placements[0].centre[1]
    first_sides = ((1, -1) if begins >= -1e-9 else (-1, 1))[: len(windings)]
    far_first = sorted(range(len(windings)), key=lambda i: placements[i].centre[0])
    cache: dict[tuple[Any, ...], Escape | None] = {}  # ways out that were found, or not, by what a search may differ by
    joined: Joined = {}
    edges = walls(artwork, body_frame(artwork, bus, front, bus.coils))

    def routed(turned: bool, reordered: bool) -> Iterator[Routing]:
        for (raised, breadth), side in product(boards(artwork, bus), first_sides):
            lanes = assign_lanes(placements, side)
            board = _BoardToRoute(artwork, raised, windings, lanes, front, breadth, searches, joined, edges)

            def way_out(index: int, there: tuple[Escape, ...], board: _BoardToRoute = board) -> Escape | Stuck:
                for beside in (False, True) if turned else (False,):
                    key = (*board.key(index, there), beside)
                    if key not in cache:
                        choices = exits(artwork.coil, board.bus, board.lanes[index], front, beside)
                        cache[key] = _lead_out(board, index, choices, board.laid(there))
                    if (routing := cache[key]) is not None:
                        return routing
                return Stuck(index)

            escapes = _in_turn(board, far_first, way_out, reordered)
            if not isinstance(escapes, Stuck):
                routing = _routing(board, escapes, body_frame(artwork, raised, front, breadth))
                if _necks_keep(routing, board):
                    yield routing

    # the first try; pairs leave beside the corner; and coils choose in another order
    efforts = ((False, False), (bus.is_stacked, False), (bus.is_stacked, True))
    for turned, reordered in dict.fromkeys(efforts) if len(windings) > 1 else efforts[:1]:
        routing = _least_round(routed(turned, reordered), widest(artwork.fpc.margin, artwork.jaw), searches)
        if routing is not None:
            return routing
    return None


def _least_round(routed: Iterator[Routing], widest: float, searches: SearchLimit) -> Routing | None:
    """Return the routing whose leads run the least around their coils, beyond the necessary minimum.

    The first routing is always considered. Others are considered until the search limit is reached, if the board's half
    width is at most `widest` (m).
    """
    best = next(routed, None)
    if best is None or best.excess < NEGLIGIBLE_ARC_TURNS:
        return best
    with searches.at_most(LONG_LEAD_TRIALS):
        for routing in routed:
            if routing.breadth.half > max(widest, best.breadth.half):
                break
            best = routing if routing.excess < best.excess - NEGLIGIBLE_ARC_TURNS else best
            if best.excess < NEGLIGIBLE_ARC_TURNS:
                break
    return best


def widest(margin: tuple[float, float], jaw: Jaw | None) -> float:
    """Return the largest half width (m) of a body that is made wider for shorter leads. Infinite without a jaw.

    It is half the jaw's width minus the margin.
    """
    return math.inf if jaw is None else jaw.width / 2 - margin[1]


def _in_turn(board: _BoardToRoute, order: list[int], way_out: _WayOut, reordered: bool) -> dict[int, Escape] | Stuck:
    """Return the leads of all coils up to the tail, routed in the given order, or the coil without a path.

    If `reordered` is True, a coil without a path is moved to the first place and the search is repeated.
    """
    orders: set[tuple[int, ...]] = set()
    while True:
        orders.add(tuple(order))
        escapes = _led_out(board, order, way_out)
        if not isinstance(escapes, Stuck) or not reordered:
            return escapes
        order = [escapes.coil, *(index for index in order if index != escapes.coil)]
        if tuple(order) in orders or len(orders) > len(order):
            return escapes


def _led_out(board: _BoardToRoute, order: list[int], way_out: _WayOut) -> dict[int, Escape] | Stuck:
    """Return the leads of each coil up to the tail, routed one coil after the other, or the coil without a path."""
    escapes: dict[int, Escape] = {}
    for index in order:
        board.searches.stuck = index
        if board.searches.is_spent:
            return Stuck(index)
        result = way_out(index, tuple(escapes.values()))
        if isinstance(result, Stuck):
            return result
        board.searches.stuck = None
        escapes[index] = result
        board.searches.led_out(len(escapes), len(board.wound))
    return escapes


@record
class _BoardToRoute:
    """A trial board whose coils are to be routed. From x = `front` (m) on, only the tail's lanes run.

    `joined` caches connections between two layer ends from earlier boards. `walls` are the board's edges as tracks;
    empty if the spec gives no outline.
    """

    artwork: ArtworkSpec
    bus: Bus
    wound: tuple[WoundCoil, ...]
    lanes: tuple[Lane, ...]
    front: float
    breadth: Breadth
    searches: SearchLimit
    joined: Joined
    walls: tuple[TrackToPlace, ...] = ()

    def laid(self, there: Iterable[Escape]) -> Obstacles:
        """Return the obstacles on the board: its edges, and the tracks and vias of the routed coils `there`."""
        obstacles = Obstacles(self.artwork.fpc.rules, self.bus.spacing, self.breadth)
        obstacles.add(self.walls)
        for branch in chain.from_iterable(way.branches for way in there):
            obstacles.add(branch.tracks, branch.holes)
        return obstacles

    def key(self, index: int, there: Iterable[Escape]) -> tuple[Any, ...]:
        """Return the key under which the search result of coil number `index` is cached.

        `there` are the leads of the coils routed before. Equal searches in another order, or with another limit, use
        the same key.
        """
        return (self.bus.base, self.breadth, self.lanes[index], index, *map(id, there))


_WayOut = Callable[[int, tuple[Escape, ...]], "Escape | Stuck"]
"""Function of a coil's index and the leads of the coils routed before. It returns the coil's leads, or `Stuck`."""


def _routing(board: _BoardToRoute, escapes: dict[int, Escape], tail: TailFrame) -> Routing:
    """Return the complete routing after all coils have leads. The tail is made long enough for its tracks."""
    artwork, bus, lanes = board.artwork, board.bus, board.lanes
    leads = tuple(escapes[i] for i in range(len(lanes)))
    pieces = [branch for way in leads for branch in way.branches]
    first = far_end(artwork.array.placements, artwork.coil, artwork.fpc.rules.copper_to_edge,
                  (t for b in pieces for t in b.tracks), (h for b in pieces for h in b.holes))
    if _leads_wait(artwork, tail):
        tail = reaching_ahead(artwork, first, tail)
    entries = [way.entries for way in leads]
    begin, body = max(end.x for pair in entries for end in pair), body_breadth(artwork, board.breadth)
    thermistor: ThermistorRun | Shortfall | None = None
    place: ThermistorPlace | Shortfall | None
    spot = None if tail.thermistor is None else tail.thermistor.spot
    if spot is ThermistorSpot.CORNER:
        begin, corner = board.front, place_in_corner(tail, board.laid(leads), board.front, body.low, bus.pitch)
        place, own = (corner, ()) if isinstance(corner, Shortfall) else (corner[0], corner[1:])
        down = [*ways_down(bus, tail, lanes, entries), *own]
    else:
        place = widest_gap(tail, bus, entries, body) if spot is ThermistorSpot.LEADS else lowest_place(tail)
        flat: Ends | tuple[()] = ()
        if isinstance(place, ThermistorPlace):
            lanes, flat = place.beside(lanes), thermistor_entries(tail, place, begin)
        numbers = place.numbers if isinstance(place, ThermistorPlace) else ()
        down = ways_down(bus, tail, lanes, entries, flat, numbers)
    long = reaching_ahead(artwork, first, stretched(artwork.fpc.rules, bus, tail, down))
    laid = tuple(runs(artwork.fpc, bus, long, lane, pair) for lane, pair in zip(lanes, down, strict=False))
    if isinstance(place, ThermistorPlace):
        thermistor = thermistor_run(long, place, begin, down[-1] if len(down) > len(lanes) else None)
    elif place is not None:
        thermistor = place
    return Routing(bus, leads, laid, board.breadth, first, long, thermistor)


def _necks_keep(routing: Routing, board: _BoardToRoute) -> bool:
    """Whether the tracks in the funnel keep their clearance from a board outline in the spec."""
    edge = Obstacles(board.artwork.fpc.rules, board.bus.spacing)
    edge.add(board.walls)
    return edge.admits(run.neck for pair in routing.ends for run in pair)


def _lead_out(
    board: _BoardToRoute, index: int, choices: Iterable[tuple[Exit, Exit]], laid: Obstacles, first: bool = False
) -> Escape | None:
    """Return the leads of coil number `index` that keep their clearances to other coils and to the tracks in `laid`.

    `choices` are pairs of candidate beginnings of the two leads. If `first` is True, the first solution is returned
    instead of the cheapest. None if there is no solution.
    """
    windings = board.wound[index]
    turns = [
        turn
        for i, placement in enumerate(board.artwork.array.placements)
        if i != index
        for turn in outermost_turns(placement.own or board.artwork.coil, placement)
    ]
    ends = [OuterEnd(w.path.start if w.inward else w.path.end, w.layer) for w in windings.windings]
    joins, passed = list(zip(ends[1:-1:2], ends[2::2], strict=False)), []
    if len(ends) % 2:  # it ends inside: its lead comes out under the turns, past all vias but the one that it begins at
        assert windings.way_out_layer is not None, "a coil without a way out is not routed"
        ends.append(OuterEnd(windings.inner[-1].hole.centre, windings.way_out_layer, from_inside=True))
        passed = [join.hole for join in windings.inner[:-1]]
    obstacles = laid.copy()
    obstacles.add(turns, passed)
    lead_ends = ends[0], ends[-1]
    around = BranchGround(board.artwork, board.bus, board.lanes[index].placement, board.breadth)
    return escape(around, joins, lead_ends, choices, obstacles, board.searches, first, board.joined)


def route_freely(
    artwork: ArtworkSpec, bus: Bus, windings: tuple[WoundCoil, ...], front: float, searches: SearchLimit
) -> Routing | None:
    """Return the leads of coils that are not in one line. None if none are found.

    The coils near the tail are routed first, each with its shortest possible path. The narrowest board with room is
    used, in one of the likely orders of pairs in the tail, or else in another order. If no board has room, a coil
    without a path is routed before the others. If leads run farther around their coils than necessary, the next wider
    boards are tried as well, up to the jaw's width.
    """
    searches.begin(len(windings))
    widest_body = widest(artwork.fpc.margin, artwork.jaw)
    return _least_round(_free_ways(artwork, bus, windings, front, searches), widest_body, searches)


@record(eq=False)
class _Mazes:
    """Search results for coils routed through mazes on one lattice.

    `known` caches them, each with its number of trials.
    """

    artwork: ArtworkSpec
    wound: tuple[WoundCoil, ...]
    front: float
    searches: SearchLimit
    lattice: Lattice
    joined: Joined = field(default_factory=dict)
    known: dict[tuple[Any, ...], tuple[Escape | Stuck, int]] = field(default_factory=dict)

    def rows(
        self, ground: tuple[Bus, Breadth, TailFrame], lanes: tuple[Lane, ...]
    ) -> tuple[_BoardToRoute, TailFrame, _WayOut]:
        """Return a trial board, its tail, and the function that routes one coil through a maze."""
        tail = ground[2]
        edges = walls(self.artwork, tail)
        board = _BoardToRoute(
            self.artwork, ground[0], self.wound, lanes, self.front, ground[1], self.searches, self.joined, edges
        )

        def search(index: int, there: tuple[Escape, ...]) -> Escape | Stuck:
            maze = Maze(self.lattice, board.bus, Ground(self.front, tail.funnel, board.breadth, tail.half_width))
            maze.add(edges, ())
            for branch in chain.from_iterable(way.branches for way in there):
                maze.add(branch.tracks, branch.holes)
            self.searches.left -= TRIALS_OF_A_WAVE
            entry = Point(tail.funnel, pair_height(tail, lanes[index]))
            choices = islice(maze.exits(lanes[index].placement, entry), MAX_EXITS)
            shortest = next(choices, None)
            if shortest is None:
                return Stuck(index, walled=True)
            paths = chain([shortest], choices)
            return _lead_out(board, index, paths, board.laid(there), first=True) or Stuck(index)

        def way_out(index: int, there: tuple[Escape, ...]) -> Escape | Stuck:
            key = board.key(index, there)
            if key in self.known:  # counted as if it was tried again: so orders that begin alike get no more trials
                self.searches.left -= self.known[key][1]
            else:
                before = self.searches.left
                self.known[key] = search(index, there), before - self.searches.left
            return self.known[key][0]

        return board, tail, way_out


def _free_ways(
    artwork: ArtworkSpec, bus: Bus, windings: tuple[WoundCoil, ...], front: float, searches: SearchLimit
) -> Iterator[Routing]:
    """Yield the routings of boards on which all coils have leads, narrow boards and likely orders first."""
    placements = artwork.array.placements
    grounds = []
    for raised, breadth in grounds_between(artwork, bus):
        tail = body_frame(artwork, raised, front, breadth)
        # in the taper, where the pairs come together
        gather = max(tail.start - _straight(tail), front + 0.3e-3 * len(placements))
        grounds.append((raised, breadth, replace(tail, start=gather, funnel=gather)))
    start = min(p.centre[0] - Ring(artwork.coil, p, 0.0).half_size[0] for p in placements)
    roomiest = max(grounds, key=lambda ground: (ground[1].half, -ground[0].base))
    lattice = Lattice(artwork, bus, start, max(tail.funnel for _, _, tail in grounds), roomiest[1])
    near_first = sorted(range(len(windings)), key=lambda i: -placements[i].centre[0])
    can_leave: set[int] = set()
    mazes = _Mazes(artwork, windings, front, searches, lattice)
    orders = rows_of_lanes(placements)
    likely, unlikely = orders[:LIKELY_ORDERS], orders[LIKELY_ORDERS:]
    for reordered, ranks in ((False, likely), (True, likely), (False, unlikely), (True, unlikely)):
        walled: set[tuple[Breadth, int]] = set()
        for ground, (rank, lanes) in product(grounds[-BASES:] if reordered else grounds, enumerate(ranks)):
            if (ground[1], rank) in walled:
                continue
            board, tail, way_out = mazes.rows(ground, lanes)
            escapes = _in_turn(board, near_first, way_out, reordered)
            if not isinstance(escapes, Stuck):
                end = tail.funnel + _straight(tail)
                routing = _routing(board, escapes, replace(tail, start=end, funnel=end))
                if _necks_keep(routing, board):
                    yield routing
                continue
            if escapes.walled:
                walled.add((ground[1], rank))
            if escapes.coil not in can_leave:
                board, _, way_out = mazes.rows(roomiest, lanes)
                if isinstance(_led_out(board, [escapes.coil], way_out), Stuck):
                    return  # no routing even for this coil alone
            can_leave.add(escapes.coil)


def _straight(tail: TailFrame) -> float:
    """Return the length (m) along which leads through a maze run straight, beside a thermistor at the tail's root."""
    return tail.zone if tail.thermistor is not None and tail.thermistor.spot is ThermistorSpot.ROOT else 0.0


def grounds_between(artwork: ArtworkSpec, bus: Bus) -> list[tuple[Bus, Breadth]]:
    """Return trial boards for coils that are not in one line, narrow ones first: (lead dimensions, y range).

    The dimensions include the distance that leads keep from other coils. Outside the coils, there is room for a track,
    for a via, or for a via and a track beside it.
    """
    rules = artwork.fpc.rules
    keep_out = hole_keep_out(joined_hole(rules, bus.width), rules, bus.spacing)
    across = sorted({breadth for _, breadth in boards(artwork, bus)}, key=lambda breadth: breadth.half)[-2:]
    if artwork.fpc.body is None:
        across.append(_beyond_coils(bus, across[-1].high - bus.coils.high + keep_out + bus.width))
    bases = (0.0, bus.pitch, via_room(rules, bus.spacing, bus.width))
    return [(replace(bus, base=base), breadth) for breadth in across for base in bases]


def body_frame(artwork: ArtworkSpec, bus: Bus, front: float, needed: Breadth) -> TailFrame:
    """Return the tail of a body for coils and leads that need the y range `needed`."""
    half_width = body_breadth(artwork, needed).farthest
    contacts = artwork.fpc.tail.connector if artwork.fpc.tail else connector("solder-pads")
    tail, edge, box = frame(artwork, bus, contacts, front, half_width), artwork.body_outline, artwork.body_box
    if edge is None or box is None:
        return tail
    # its length counts from the body's end; what is straight begins beside the rounded root
    tail, sides = tail.reaching(box[2] - tail.body_end), roots(edge, tail)
    beyond = max(0.0, *(each.on_tail.x - tail.start for each in sides)) if sides else 0.0
    tail = replace(tail, start=tail.start + beyond)
    return replace(tail, end=tail.end + turn_lag(artwork.fpc.rules, bus, tail))


def reaching_ahead(artwork: ArtworkSpec, first: float, tail: TailFrame) -> TailFrame:
    """Return the tail, moved if the body must be longer for its margin or to centre the coils.

    `first` is the x (m) at which coils and leads begin.
    """
    ahead = ends(artwork, first, tail.body_end - tail.ahead - tail.zone)[1] + tail.zone - tail.body_end
    return tail.reaching(ahead, _leads_wait(artwork, tail)) if ahead > 1e-12 else tail


def _leads_wait(artwork: ArtworkSpec, tail: TailFrame) -> bool:
    """Whether leads may run on straight beyond the coils before they move outwards to a tail wider than the body.

    This holds for coils in line. Leads through a maze end at the beginning of the funnel.
    """
    return artwork.array.is_in_line and not tail.taper.narrows


LONG_LEAD_TRIALS = 1_500  # Extra trials if leads run farther round their coils than necessary
"""Number of additional trials if leads run farther around their coils than necessary."""
BASES = 3  # Distances of paths from other coils: the minimum, plus a track, plus a via
"""Number of distances that paths keep from other coils: the minimum, plus a track, plus a via."""

LIKELY_ORDERS = 2
"""Number of orders of pairs in the tail that are tried on all boards first.

A wider board costs less than a trial of all orders.
"""

MAX_EXITS = 8  # Exits of a coil that are tried in an array not in line, shortest way first
"""Largest number of candidate beginnings tried for a coil in an array not in line, the shortest path first."""
