"""What a layout's tracks spare direct current where they end: in pads of vias, teardrops and contacts, and where one
goes on as another, round a corner or narrower.
"""

from __future__ import annotations

import math
from itertools import pairwise

from sitscad.geometry.path import Point, Segment
from sitscad.layout.board import Coil, Layout, Pad, Teardrop, Trace, Via
from sitscad.physics.loss.corners import MOST_TURN
from sitscad.physics.loss.resistance import bend_squares, contact_squares, pad_squares, step_squares, teardrop_squares

SAME = 1e-9  # Points nearer to each other than this (m) are one
LEAST = 0.1  # Share of a track's centre line that counts in any case: short stubs lie in pads at both ends
LEAST_TURN = 1e-3  # Turns of less (rad) are none
START = 1e-4  # Share of a piece from which its direction is taken


def spared_squares(coil: Coil, layout: Layout) -> dict[int, float]:
    """Squares that each copper layer's tracks of a coil have less than their centre lines, by layer."""
    drops = {(id(layout.traces[drop.track]), drop.at_start): drop for drop in layout.teardrops}
    vias = [item for item in coil.series if isinstance(item, Via)]
    pads = [pad for pad in layout.pads if pad.net == coil.net]
    tracks = [item for item in coil.series if isinstance(item, Trace)]
    spared = {
        id(trace): [-_end(trace, at_start, vias, pads, drops.get((id(trace), at_start))) for at_start in (True, False)]
        for trace in tracks
    }
    for one, other in pairwise(coil.series):
        if isinstance(one, Trace) and isinstance(other, Trace):
            spared[id(min(one, other, key=lambda trace: trace.width))].append(-_joint(one, other))
    found: dict[int, float] = {}
    for trace in tracks:
        most = (1.0 - LEAST) * trace.path.length / trace.width
        found[trace.layer] = found.get(trace.layer, 0.0) + min(math.fsum(spared[id(trace)]), most)
    return found


def _joint(one: Trace, other: Trace) -> float:
    """Squares beyond both centre lines where a track goes on as another: a corner, and a change of width.

    A corner sharper than MOST_TURN counts as that; one whose legs are shorter than the track is wide counts less: the
    current has no room to cut it.
    """
    here, there = min(
        ((a, b) for a in _legs(one) for b in _legs(other)), key=lambda legs: legs[0].start.distance(legs[1].start)
    )
    wide, narrow = max(one.width, other.width), min(one.width, other.width)
    # the directions (rad) in which the legs begin
    ways = [math.atan2(leg.at(START).y - leg.start.y, leg.at(START).x - leg.start.x) for leg in (here, there)]
    turn = math.pi - abs(math.remainder(ways[0] - ways[1], 2.0 * math.pi))
    share = min(1.0, here.length / wide, there.length / wide)
    bend = share * bend_squares(round(min(turn, MOST_TURN), 6)) if turn > LEAST_TURN else 0.0
    return bend + step_squares(round(wide / narrow, 6))


def _legs(trace: Trace) -> tuple[Segment, Segment]:
    """The first and the last piece of a track, each from the track's end."""
    return trace.path.segments[0], trace.path.segments[-1].reversed()


def _end(trace: Trace, at_start: bool, vias: list[Via], pads: list[Pad], drop: Teardrop | None) -> float:
    """Squares of one end of a track beyond its centre line."""
    leg, width = _legs(trace)[0 if at_start else 1], trace.width
    place, reach = leg.start, 0.0
    if drop is not None:  # how far (m) along the leg the corners of its teardrop lie
        length = leg.start.distance(leg.end)
        ux, uy = (leg.end.x - place.x) / length, (leg.end.y - place.y) / length
        reach = max((s.start.x - place.x) * ux + (s.start.y - place.y) * uy for s in drop.outline.segments)
    via = next((via for via in vias if via.centre.distance(place) < SAME), None)
    if via is not None:
        ring, drill = via.pad / width, via.drill / width
        rest = (reach / width) ** 2 - (ring - 1.0)
        if reach == 0.0 or rest < 0.0:
            return pad_squares(round(ring, 6), round(drill, 6))
        # corners are where the tangents meet the track's circle: (ring - 1) / (4 reach) beyond its centre, in widths
        far = (reach / width + math.sqrt(rest)) / 2.0
        return teardrop_squares(round(ring, 6), round(drill, 6), round(far, 6))
    for pad in pads:
        if pad.layer == trace.layer and pad.holds(place):
            inside, across = _depth(pad, leg.start, leg.end)
            return contact_squares(inside / width, across / width, max(0.0, reach - inside) / width)
    return 0.0


def _depth(pad: Pad, start: Point, end: Point) -> tuple[float, float]:
    """How deep (m) a track lies in a contact that it leaves towards `end`, and the contact's width across the way."""
    across, along = (0, 1) if abs(end.y - start.y) > abs(end.x - start.x) else (1, 0)
    side = math.copysign(1.0, end[along] - start[along])
    edge = pad.centre[along] + side * pad.size[along] / 2
    return min(max(0.0, side * (edge - start[along])), start.distance(end)), pad.size[across]
