"""SIT120 to SIT125: what is drawn: corners, slivers, loops, loose ends, the bend zone, the plug's worst case."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from sitscad.checks.clearances import ALLOWED_SHORTFALL, copper_in, name_of
from sitscad.checks.copper import Copper, conductor_notches
from sitscad.checks.fabrication import FABRICATOR, ROUNDING, source_of, um
from sitscad.checks.rules import Complaint, Rule, Subject, Undecided, Verdict
from sitscad.checks.track_graph import TrackGraph, closed_loops, loose_ends, open_nets
from sitscad.finding import Place, Severity
from sitscad.geometry.path import bounding_box
from sitscad.geometry.primitives import Floats
from sitscad.layout.board import Pad, Trace, Via
from sitscad.layout.tail import tail_thickness
from sitscad.layout.thickness import Where, finished_thickness
from sitscad.units import show

ACUTE = math.radians(59.9)
"""Legs that part at less than this angle (rad) make a wedge in which etchant stays (unverified: workshop practice). Our
own stubs meet their spirals at 75 degrees and more."""

STRAIGHT = math.radians(10.0)
"""Tracks may cross the bend zone at this angle (rad) to the tail's length."""

_SAME_PLACE = 1e-8


def acute_angle(subject: Subject) -> Iterator[Verdict]:
    """Legs of one track, or of two that meet, that part at an acute angle where no pad covers the corner."""
    copper = copper_in(subject)
    seen: set[tuple[int, int]] = set()
    for one, other, point, angle in _corners(copper):
        a, b = copper.items[copper.item[one]], copper.items[copper.item[other]]
        pair = int(copper.item[one]), int(copper.item[other])
        if a.net != b.net or pair in seen or _is_covered(subject, point, int(copper.layer[one])):
            continue
        seen.add(pair)
        what = f"two legs of {name_of(a)}" if a is b else f"{name_of(a)} and {name_of(b)}"
        yield Complaint(
            f"{what} meet at {math.degrees(angle):.3g} degrees on layer {copper.layer[one]}",
            "part them at 60 degrees or more, better at a right angle, or round the corner",
            "coil",
            math.degrees(angle),
            math.degrees(ACUTE),
            "degrees",
            place=Place(float(point[0]), float(point[1]), int(copper.layer[one]), (a.net,)),
        )


def sliver(subject: Subject) -> Iterator[Verdict]:
    """Gaps between parts of one conductor that turns back on itself, narrower than the fabricator's spacing."""
    rules = subject.spec.fpc.rules
    asked = min(rules.trace_spacing, subject.spec.coil.trace_spacing)
    for near in conductor_notches(copper_in(subject), asked - ALLOWED_SHORTFALL):
        a, b = name_of(near.one), name_of(near.other)
        what = f"two parts of {a}" if near.one is near.other else f"{a} and {b}"
        yield Complaint(
            f"{what} leave a notch of {um(near.gap)} between them on layer {near.layer}; {rules.name} asks {um(asked)}",
            f"{um(asked - near.gap)} are missing: a gap this narrow is not etched through, or leaves a strip of resist "
            "that comes off; turn the track in a wider bend",
            "coil",
            near.gap,
            asked,
            "m",
            source=source_of(subject, "trace_spacing"),
            place=Place(near.x, near.y, near.layer, (near.one.net,)),
        )


def shorted_turn(subject: Subject) -> Iterator[Verdict]:
    """Closed conducting loops of any net, and how often they run round each coil."""
    for loop in closed_loops(_graph(subject)):
        round_what = [coil.name for coil in subject.layout.coils if abs(loop.turns_round(coil.centre)) > 0.5]
        nets = " and ".join(loop.nets)
        if round_what:
            message = f"copper of {nets} closes a loop round coil {' and '.join(round_what)}: a shorted turn"
        else:
            message = (
                f"copper of {nets} closes a loop of {loop.area * 1e6:.3g} mm2: a coil leads from contact to contact"
            )
        yield Complaint(
            message,
            "open the loop: the current induced in it takes away inductance and quality",
            "coil",
            place=Place(*loop.place, loop.layer, loop.nets),
        )


def bend_zone(subject: Subject) -> Iterator[Verdict]:
    """Nothing stiff and nothing that starts a crack lies where the tail bends."""
    zone, tail = subject.layout.bend_zone, subject.spec.fpc.tail
    assert tail is not None
    if tail.bend == "none":
        yield Undecided("the tail does not bend (fpc.tail.bend: none)")
        return
    if zone is None:
        yield _too_short(subject, 0.0)
        return
    yield from _stiff_in_bend(subject, zone)
    yield from _tracks_in_bend(subject, zone)


def contact_worst_case(subject: Subject) -> Iterator[Verdict]:
    """The finished thickness at the contacts with the fabricator's tolerance against what the connector takes."""
    tail = subject.spec.fpc.tail
    assert tail is not None
    connector = tail.connector
    if connector.insertion_thickness <= 0.0:
        yield Undecided("the tail ends in solder pads: no connector takes it")
        return
    band = finished_thickness(subject.layout, Where.CONTACT)
    allowed = connector.insertion_thickness_tolerance
    low, high = connector.insertion_thickness - allowed, connector.insertion_thickness + allowed
    worst = max((low - band.minimum, band.minimum), (band.maximum - high, band.maximum))
    if worst[0] > ROUNDING and low - ROUNDING <= band.nominal <= high + ROUNDING:
        yield Complaint(
            f"the contacts come out {um(band.minimum)} to {um(band.maximum)} thick with the fabricator's tolerance; "
            f"{connector.name} takes {um(low)} to {um(high)}",
            f"write the connector's band on the order ({um(connector.insertion_thickness)} +- {um(allowed)}) and have "
            "it confirmed, or measure the parts before they are plugged in",
            "fpc.tail.connector",
            worst[1],
            high if worst[1] == band.maximum else low,
            "m",
            source=band.source,
            place=Place(*subject.layout.pads[0].centre, 1) if subject.layout.pads else None,
        )


def unconnected(subject: Subject) -> Iterator[Verdict]:
    """Ends of tracks and vias that meet nothing, and contacts of one net that nothing joins, of a whole layout."""
    layout = subject.layout
    if any(finding.severity is Severity.ERROR for finding in layout.findings):
        yield Undecided("the layout is not complete: see what found no room")
        return
    for point, layer, net in loose_ends(_graph(subject)):
        yield Complaint(
            f"copper of {net} ends in nothing on layer {layer}",
            "a track or via is missing there, or does not meet its neighbour",
            "coil",
            place=Place(*point, layer, (net,)),
        )
    for one, other in open_nets(_graph(subject)):
        yield Complaint(
            f"no copper joins contacts {one.pin} and {other.pin} of {one.net}",
            "a track or via is missing between them",
            "coil",
            place=Place(*other.centre, other.layer, (one.net,)),
        )


def _graph(subject: Subject) -> TrackGraph:
    return subject.once("track graph", lambda: TrackGraph(subject.layout))


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


def _is_covered(subject: Subject, point: Floats, layer: int) -> bool:
    x, y = float(point[0]), float(point[1])
    return any(math.hypot(via.centre.x - x, via.centre.y - y) < _SAME_PLACE for via in subject.layout.vias) or any(
        pad.layer == layer and abs(pad.centre.x - x) <= pad.size[0] / 2 and abs(pad.centre.y - y) <= pad.size[1] / 2
        for pad in subject.layout.all_pads
    )


# -------------------------------------------------------------------------------------------------------- the bend


def _stiff_in_bend(subject: Subject, zone: tuple[float, float]) -> Iterator[Complaint]:
    layout = subject.layout
    for via in layout.vias:
        if _overlap(via.centre.x, via.pad / 2, zone) > ROUNDING:
            yield _in_bend(f"a via of {via.net}", _overlap(via.centre.x, via.pad / 2, zone), _place_of(via))
    for pad in layout.all_pads:
        if _overlap(pad.centre.x, pad.size[0] / 2, zone) > ROUNDING:
            yield _in_bend(f"contact {pad.pin}", _overlap(pad.centre.x, pad.size[0] / 2, zone), _place_of(pad))
    if layout.stiffener is not None:
        x0, y0, x1, y1 = bounding_box([layout.stiffener.outline.outline])
        inside = _overlap((x0 + x1) / 2, (x1 - x0) / 2, zone)
        if inside > ROUNDING:
            yield _in_bend("the stiffener", inside, Place(max(x0, zone[0]), (y0 + y1) / 2))


def _tracks_in_bend(subject: Subject, zone: tuple[float, float]) -> Iterator[Complaint]:
    """Where in the bend zone the tracks cross straight and keep their width, if not everywhere."""
    unfit = sorted(_unfit_for_bending(subject, zone), key=lambda stretch: stretch[:2])
    if not unfit:
        if zone[1] - zone[0] < _bend_length(subject) - ROUNDING:
            yield _too_short(subject, zone[1] - zone[0])
        return
    starts = [zone[0], *(np.maximum.accumulate([last for _, last, _ in unfit]).tolist())]
    ends = [*(first for first, *_ in unfit), zone[1]]
    length, start = max((end - start, start) for start, end in zip(starts, ends, strict=True))
    needed, where = _bend_length(subject), unfit[0][2]
    yield Complaint(
        f"in the bend zone tracks turn or change their width; they run straight at one width for "
        f"{show(max(0.0, length), 'm', 3)} from x = {show(start, 'm', 4)}",
        "bend the tail there and nowhere else"
        if length >= needed
        else f"a bend by a right angle needs {show(needed, 'm', 3)}: lengthen the tail",
        "fpc.tail.bend",
        length,
        needed,
        "m",
        Severity.NOTE if length >= needed else Severity.WARNING,
        place=Place(start, where.y, where.layer, where.nets),
    )


def _too_short(subject: Subject, length: float) -> Complaint:
    tail, needed = subject.spec.fpc.tail, _bend_length(subject)
    assert tail is not None
    return Complaint(
        f"the tail has {show(length, 'm', 3)} free of vias, turns and stiffener for its {tail.bend} bend; one by a "
        f"right angle needs {show(needed, 'm', 3)} at the fabricator's radius",
        "lengthen the tail until this is no longer told, or fpc.tail.bend: none",
        "fpc.tail.length",
        length,
        needed,
        "m",
        Severity.WARNING,
    )


def _unfit_for_bending(subject: Subject, zone: tuple[float, float]) -> Iterator[tuple[float, float, Place]]:
    """Stretches of x (m) in the zone where a track runs askew or changes its width, each with a place on it."""
    copper = copper_in(subject)
    boxes = copper.pieces.boxes
    for k in np.flatnonzero((boxes[:, 0] < zone[1] - ROUNDING) & (boxes[:, 2] > zone[0] + ROUNDING)).tolist():
        item = copper.items[copper.item[k]]
        if isinstance(item, Trace) and _askew(copper, k) > STRAIGHT:
            first, last = max(zone[0], float(boxes[k, 0])), min(zone[1], float(boxes[k, 2]))
            yield first, last, Place(first, float(boxes[k, 1]), item.layer, (item.net,))
    widths: dict[tuple[int, int, int], float] = {}
    for trace in subject.layout.traces:
        for end in (trace.path.start, trace.path.end):
            key = trace.layer, round(end.x / _SAME_PLACE), round(end.y / _SAME_PLACE)
            if zone[0] < end.x < zone[1] and abs(widths.setdefault(key, trace.width) - trace.width) > ROUNDING:
                yield end.x, end.x, Place(end.x, end.y, trace.layer, (trace.net,))


def _bend_length(subject: Subject) -> float:
    """The length (m) of a bend by a right angle with the fabricator's smallest radius; 0 where that is not stated."""
    spec = subject.spec
    assert spec.fpc.tail is not None
    dynamic, layers = spec.fpc.tail.bend == "dynamic", spec.fpc.tail.layers
    ratios = spec.fpc.rules.dynamic_bend_ratio if dynamic else spec.fpc.rules.static_bend_ratio
    ratio = ratios.get(layers, ratios[max(ratios)]) if ratios else 0.0
    return math.pi / 2 * ratio * tail_thickness(spec)


def _askew(copper: Copper, k: int) -> float:
    """The largest angle (rad, at most a right one) between a piece and the tail's length."""
    one = copper.pieces.take(np.array([k]))
    directions = [ends[0] for ends in one.tangents]
    return max(math.acos(min(1.0, abs(float(d[0])))) if float(np.hypot(*d)) else 0.0 for d in directions)


def _in_bend(what: str, inside: float, place: Place) -> Complaint:
    return Complaint(
        f"{what} reaches {show(inside, 'm', 3)} into the bend zone",
        "lengthen the tail, so that it lies outside the bend, or do without a bend (fpc.tail.bend: none)",
        "fpc.tail.bend",
        inside,
        0.0,
        "m",
        place=place,
    )


def _overlap(middle: float, half: float, zone: tuple[float, float]) -> float:
    return min(middle + half, zone[1]) - max(middle - half, zone[0])


def _place_of(item: Via | Pad) -> Place:
    return Place(*item.centre, item.layer if isinstance(item, Pad) else None, (item.net,))


DRAWN_FORM_RULES: tuple[Rule, ...] = (
    Rule(
        "SIT120", "acute-angle", Severity.WARNING,
        "Tracks part at 60 degrees or more, but under a pad.",
        "Etchant stays in an acute corner and eats the track there; the corner itself starts a crack when it is bent.",
        "Turn the track in two corners of 45 degrees, or round it.",
        "IPC-2221, 5.3 (unverified: quoted from memory)", apply=acute_angle,
    ),
    Rule(
        "SIT121", "sliver", Severity.WARNING,
        "Where one conductor turns back on itself the gap is as wide as the fabricator's spacing, also near the turn.",
        "A strip of resist as narrow as that lifts off and shorts another place; or the gap is not etched through.",
        "Turn the track in a wider bend.",
        FABRICATOR, apply=sliver,
    ),
    Rule(
        "SIT122", "shorted-turn", Severity.ERROR,
        "No copper closes a loop: every net is a chain from contact to contact.",
        "A closed loop round a coil is the secondary of a transformer that is shorted: inductance and Q fall, and no "
        "electrical test sees it, because both contacts are still joined.",
        "Open the loop; keep guard rings and planes slotted.",
        "Lenz's law; README, The coil", apply=shorted_turn,
    ),
    Rule(
        "SIT123", "bend-zone", Severity.ERROR,
        "Where the tail bends there are no vias, no contacts, no stiffener, and tracks run straight at one width.",
        "Plated holes and stiffener edges crack the copper beside them at the first bend; a corner or step gathers the "
        "strain. Tracks that turn or change their width there are a note that says where to bend instead.",
        "Lengthen the tail, so that everything lies outside the bend.",
        "IPC-2223, 5.2.4 (unverified: quoted from memory)", ("tail",), bend_zone,
    ),
    Rule(
        "SIT124", "contact-worst-case", Severity.NOTE,
        "The contacts' thickness stays in the connector's band with the fabricator's tolerance of finished thickness.",
        "The sum of the layers may be right and the part still too thick to go in, or too thin to make contact.",
        "Agree on the band with the fabricator, or choose a connector that takes more.",
        FABRICATOR, ("tail",), contact_worst_case,
    ),
    Rule(
        "SIT125", "unconnected", Severity.ERROR,
        "Every track and via as drawn is joined at both ends, and every coil's contacts are joined.",
        "A coil that is open somewhere is no coil; a loose end is a track that was meant to lead somewhere.",
        "Tell us: a layout that was said to be whole must be.",
        "README, The coil", apply=unconnected,
    ),
)  # fmt: skip
