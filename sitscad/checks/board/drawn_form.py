"""SIT120 to SIT122 and SIT125: what is drawn: corners, slivers, loops and loose ends."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from itertools import islice

import numpy as np

from sitscad.checks.board.clearances import ALLOWED_SHORTFALL, copper_in, name_of
from sitscad.checks.board.copper import Copper, conductor_notches
from sitscad.checks.board.fabrication import FABRICATOR, gap_asked_by
from sitscad.checks.board.track_graph import TrackGraph, closed_loops, loose_ends, open_nets
from sitscad.checks.cases import Case
from sitscad.checks.rules import Rule, Undecided, Verdict
from sitscad.design import Design
from sitscad.finding import Place, Severity
from sitscad.geometry.primitives import Floats
from sitscad.layout.board import Trace
from sitscad.remedy.fix import Fix
from sitscad.remedy.moves import other_ends
from sitscad.remedy.search import Left, first_that_mends

ACUTE = math.radians(59.9)
"""Legs that part at less than this angle (rad) make a wedge in which etchant stays (unverified: workshop practice). Our
own stubs meet their spirals at 75 degrees and more."""

MOST_DRAWN = 2
"""So many boards that are drawn otherwise are held against all rules."""

_SAME_PLACE = 1e-8


def acute_angle(design: Design) -> Iterator[Verdict]:
    """Legs of one track, or of two that meet, that part at an acute angle where no pad covers the corner."""
    copper = copper_in(design)
    seen: set[tuple[int, int]] = set()
    for one, other, point, angle in _corners(copper):
        a, b = copper.items[copper.item[one]], copper.items[copper.item[other]]
        pair = int(copper.item[one]), int(copper.item[other])
        if a.net != b.net or pair in seen or _is_covered(design, point, int(copper.layer[one])):
            continue
        seen.add(pair)
        what = f"two legs of {name_of(a)}" if a is b else f"{name_of(a)} and {name_of(b)}"
        yield ACUTE_ANGLE.found("coil", math.degrees(angle), math.degrees(ACUTE), "degrees",
                                place=Place(float(point[0]), float(point[1]), int(copper.layer[one]), (a.net,)),
                                advice=lambda left: _drawn_otherwise(design, acute_angle, left), what=what,
                                layer=copper.layer[one])


def sliver(design: Design) -> Iterator[Verdict]:
    """Gaps between parts of one conductor that turns back on itself, narrower than the fabricator's spacing."""
    rules = design.spec.fpc.rules
    asked = min(rules.trace_spacing, design.spec.coil.trace_spacing)
    who, source = gap_asked_by(design, asked)
    for near in conductor_notches(copper_in(design), asked - ALLOWED_SHORTFALL):
        a, b = name_of(near.one), name_of(near.other)
        what = f"two parts of {a}" if near.one is near.other else f"{a} and {b}"
        yield SLIVER.found("coil", near.gap, asked, "m", source=source,
                           place=Place(near.x, near.y, near.layer, (near.one.net,)),
                           advice=lambda left: _drawn_otherwise(design, sliver, left), what=what, layer=near.layer,
                           who=who, missing=asked - near.gap)


DRAWN = "the layout drew this, it is no fault of the spec"
OTHERWISE = "another coil.start_angle, or part of a turn more or less, makes it draw the leads otherwise"


def _drawn_otherwise(design: Design, rule: Callable[[Design], Iterable[Verdict]], left: Left) -> str:
    """Which start angle or number of turns makes the layout draw something else, found by drawing it."""

    def search() -> Fix | None:
        return first_that_mends(islice(_free_of(rule, design, left), MOST_DRAWN), left)

    found = design.once(f"{rule.__name__} drawn otherwise", search)
    if found is None and left.is_cut_short:
        return ""
    if found is None:
        return f"{DRAWN}: {OTHERWISE}; the board works as it is, only its yield is lower"
    return f"{DRAWN}: {found.words} makes it draw the leads otherwise (it was tried)"


def _free_of(rule: Callable[[Design], Iterable[Verdict]], design: Design, left: Left) -> Iterator[Fix]:
    """Other ends of the layers with which a rule finds nothing; as far as the budget goes."""
    for fix in other_ends(design.spec):
        layout = left.drawn(fix.spec)
        if layout is None:
            return
        if not list(rule(Design(fix.spec, layout))):
            yield fix


def shorted_turn(design: Design) -> Iterator[Verdict]:
    """Closed conducting loops of any net, and how often they run round each coil."""
    for loop in closed_loops(_graph(design)):
        round_what = [coil.name for coil in design.layout.coils if abs(loop.turns_round(coil.centre)) > 0.5]
        yield (SHORTED_TURN if round_what else LOOP).found(
            "coil", place=Place(*loop.place, loop.layer, loop.nets), nets=" and ".join(loop.nets),
            coils=" and ".join(round_what), area=loop.area * 1e6,
        )


def unconnected(design: Design) -> Iterator[Verdict]:
    """Ends of tracks and vias that meet nothing, and contacts of one net that nothing joins, of a whole layout."""
    layout = design.layout
    if layout.shortfalls:
        yield Undecided("the layout is not complete: see what found no room")
        return
    for point, layer, net in loose_ends(_graph(design)):
        yield ENDS_IN_NOTHING.found("coil", place=Place(*point, layer, (net,)), net=net, layer=layer)
    for one, other in open_nets(_graph(design)):
        yield NOT_JOINED.found("coil", place=Place(*other.centre, other.layer, (one.net,)), pin=one.pin,
                               other=other.pin, net=one.net)


def _graph(design: Design) -> TrackGraph:
    return design.once("track graph", lambda: TrackGraph(design.layout))


# ------------------------------------------------------------------------------------------------------------- corners


def _corners(copper: Copper) -> Iterator[tuple[int, int, Floats, float]]:
    """Pairs of pieces of tracks that meet at an acute angle: their numbers, where (m), and the angle (rad)."""
    tracks = np.flatnonzero(np.array([isinstance(copper.items[k], Trace) for k in copper.item], dtype=bool))
    pieces = copper.pieces.take(tracks)
    points = np.concatenate([pieces.start, pieces.end])
    heading, arriving = pieces.tangents
    out = np.concatenate([heading, -arriving])
    number = np.concatenate([tracks, tracks])
    keys = np.column_stack([copper.layer[number], np.round(points / _SAME_PLACE).astype(np.int64)])
    order = np.lexsort(keys.T)
    for step in (1, 2, 3):  # neighbours in this order; more than four ends never meet in one point
        a, b = order[:-step], order[step:]
        same = (keys[a] == keys[b]).all(axis=1)
        cosine = (out[a] * out[b]).sum(axis=1)
        for k in np.flatnonzero(same & (cosine > math.cos(ACUTE)) & (number[a] != number[b])):
            angle = math.acos(min(1.0, float(cosine[k])))
            yield int(number[a[k]]), int(number[b[k]]), points[a[k]], angle


def _is_covered(design: Design, point: Floats, layer: int) -> bool:
    x, y = float(point[0]), float(point[1])
    return any(math.hypot(via.centre.x - x, via.centre.y - y) < _SAME_PLACE for via in design.layout.vias) or any(
        pad.layer == layer and abs(pad.centre.x - x) <= pad.size[0] / 2 and abs(pad.centre.y - y) <= pad.size[1] / 2
        for pad in design.layout.all_pads
    )


ACUTE_ANGLE = Case(
    "{what} meet at {measured:.3g} degrees on layer {layer}",
    hint="the layout drew this, it is no fault of the spec: another coil.start_angle, or part of a turn more or less, "
    "makes it draw the leads otherwise",
)

SLIVER = Case(
    "{what} leave a notch of {measured:m} between them on layer {layer}; {who} asks {limit:m}",
    hint="{missing:m} are missing: a gap this narrow is not etched through, or leaves a strip of resist that comes "
    "off; the layout drew this, it is no fault of the spec: another coil.start_angle, or part of a turn more or less, "
    "makes it draw the leads otherwise",
)

OPEN_IT = "open the loop: the current induced in it takes inductance and quality; tell us if the layout drew it"

SHORTED_TURN = Case("copper of {nets} closes a loop round coil {coils}: a shorted turn", OPEN_IT)

LOOP = Case("copper of {nets} closes a loop of {area:.3g} mm2: a coil leads from contact to contact", OPEN_IT)

ENDS_IN_NOTHING = Case(
    "copper of {net} ends in nothing on layer {layer}",
    hint="a track or via is missing there, or does not meet its neighbour",
)

NOT_JOINED = Case("no copper joins contacts {pin} and {other} of {net}", hint="a track or via is missing between them")


DRAWN_FORM_RULES: tuple[Rule, ...] = (
    Rule("SIT120", "acute-angle", Severity.WARNING, "Tracks part at 60 degrees or more, but under a pad.",
         "Etchant stays in an acute corner and eats the track there; the corner itself starts a crack when it is bent.",
         "The layout draws the leads: another start angle or part of a turn makes it draw them otherwise.",
         "IPC-2221, 5.3 (unverified: quoted from memory)", apply=acute_angle),
    Rule(
        "SIT121", "sliver", Severity.WARNING,
        "Where one conductor turns back on itself the gap is as wide as the fabricator's spacing, also near the turn.",
        "A strip of resist as narrow as that lifts off and shorts another place; or the gap is not etched through.",
        "The layout draws the leads: another start angle or part of a turn makes it draw them otherwise.", FABRICATOR,
        apply=sliver,
    ),
    Rule(
        "SIT122", "shorted-turn", Severity.ERROR,
        "No copper closes a loop: every net is a chain from contact to contact.",
        "A closed loop round a coil is the secondary of a transformer that is shorted: inductance and Q fall, and no "
        "electrical test sees it, because both contacts are still joined.",
        "Open the loop; keep guard rings and planes slotted.", "Lenz's law; docs/coil.md", apply=shorted_turn,
    ),
    Rule("SIT125", "unconnected", Severity.ERROR,
         "Every track and via as drawn is joined at both ends, and every coil's contacts are joined.",
         "A coil that is open somewhere is no coil; a loose end is a track that was meant to lead somewhere.",
         "Tell us: a layout that was said to be whole must be.", "docs/coil.md", apply=unconnected),
)
