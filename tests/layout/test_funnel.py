"""Tracks that draw together, or part, between the coils and their lanes in the tail keep their distance."""

import math
import random
from itertools import pairwise

import pytest
from tolerance import approx

from sitscad.basics.finding import Missing
from sitscad.checks.judging import RULES
from sitscad.checks.rules import apply_rule
from sitscad.estimates.design import Design
from sitscad.kernels.geometry.path import Point
from sitscad.layout import lay_out
from sitscad.layout.tail.tracks import descents
from sitscad.spec.load import load_text

from .test_layout import assert_sound

DRAWN = [rule for rule in RULES if "SIT105" <= rule.id <= "SIT125"]


def spec_of(coil, array, fpc):
    return load_text(f"sitscad: 1\nname: few-turns\ncoil: {coil}\narray: {array}\nfpc: {fpc}\n", "few-turns.yaml")


def assert_accepted_by_its_own_check(spec):
    layout = lay_out(spec)
    assert_sound(layout)
    subject = Design(spec, layout)
    findings = [finding for rule in DRAWN for finding in apply_rule(rule, subject)[0]]
    assert [str(finding) for finding in findings if finding.severity == "error"] == []
    return layout


def gap(one, other):
    """Least distance of two necks, sampled."""
    points = [[segment.at(k / 40) for segment in neck for k in range(41)] for neck in (one, other)]
    return min(a.distance(b) for a in points[0] for b in points[1])


@pytest.mark.parametrize("seed", range(25))
def test_funnel_tracks_are_separated_by_pitch(seed):
    """Any heights, any lanes, in one order: as near as they come in and no nearer, whichever way each one goes."""
    pick, pitch = random.Random(seed), 1.0
    tracks = pick.choice([2, 3, 5])
    entries, heights = [pick.uniform(-8.0, 2.0)], [pick.uniform(-8.0, 2.0)]
    for _ in range(tracks - 1):
        entries.append(entries[-1] + pitch * pick.choice([1.0, 1.1, 1.3, 1.6, 4.0]))
        heights.append(heights[-1] + pitch * pick.choice([1.0, 1.5, 3.0]))
    ways = descents(0.0, [Point(0.0, y) for y in entries], heights, pitch)
    assert all(way.bend >= 0.0 and way.foot.y == height for way, height in zip(ways, heights, strict=True))
    ends = max(way.foot.x for way in ways) + 1.0
    necks = [way.neck(ends - way.foot.x) for way in ways]
    assert min(gap(item, other) for item, other in pairwise(necks)) > 0.985 * pitch  # what sampling may miss


def test_funnel_track_with_room_bends_at_start():
    far, near = descents(3.0, [Point(3.0, 5.0), Point(3.0, 0.0)], [2.0, 0.5], 0.2)
    assert far.bend == 3.0 and far.foot == Point(6.0, 2.0)
    assert near.bend == 3.0 and near.parts and not far.parts


def test_second_funnel_track_bends_later_by_missing_spacing():
    ahead, behind = descents(0.0, [Point(0.0, 4.0), Point(0.0, 4.2)], [0.0, 0.5], 0.2)
    assert ahead.bend == 0.0 and behind.bend == approx((math.sqrt(2.0) - 1.0) * 0.2, rel=1e-6)


SQUARE = "{shape: square, outer_diameter: 8 mm, turns: 2, layers: 2, trace_width: 0.5 mm, trace_spacing: 0.5 mm}"


@pytest.mark.parametrize("tail", ["", ", tail: {length: 15, connector: solder-pads}", ", tail: {connector: zif-0.5mm}"])
def test_forward_lead_pair_near_other_lane_passes_design_rules(tail):
    """The near coil's pair starts out beside the far coil's lane, and both run to the other side."""
    spec = spec_of(SQUARE, "{pattern: line, count: 2, pitch: 12 mm}", f"{{rules: generic-flex{tail}}}")
    assert_accepted_by_its_own_check(spec)


@pytest.mark.parametrize(
    ("coil", "count", "pitch", "fpc"),
    [
        ("{shape: racetrack, outer_diameter: [13.92, 7.64], turns: 2.5, layers: 2, trace_width: 0.8, "
         "trace_spacing: 0.12}", 5, 15.12, "rules: generic-flex, tail: {length: 30, connector: zif-0.3mm}"),
        ("{shape: square, outer_diameter: 11.3, turns: 2.5, layers: 2, trace_width: 0.5, trace_spacing: 0.12}", 3,
         15.3, "rules: generic-fine, tail: {length: 8, connector: zif-0.3mm, layers: 1, bend: none}"),
        ("{shape: hexagon, outer_diameter: 3.27, turns: 3, layers: 2, trace_width: 0.1, trace_spacing: 0.1}", 4, 4.47,
         "rules: generic-flex, tail: {length: 30, connector: solder-pads, layers: 1}"),
        ("{shape: octagon, outer_diameter: 4.95, turns: 1, layers: 2, trace_width: 0.8, trace_spacing: 0.5}", 2, 5.75,
         "rules: generic-flex, tail: {length: 15, connector: zif-0.3mm}"),
    ],
    ids=["wide racetracks", "wide tracks side by side", "pairs side by side off the middle", "wide octagons"],
)
def test_coils_of_few_wide_turns_in_line_are_routed(coil, count, pitch, fpc):
    """Boards that were refused, or drawn with necks wider than their lanes."""
    layout = assert_accepted_by_its_own_check(
        spec_of(coil, f"{{pattern: line, count: {count}, pitch: {pitch}}}", f"{{{fpc}}}")
    )
    assert sum(bool(pad.net) for pad in layout.pads) == 2 * count


def test_tracks_too_wide_for_contact_pitch_yield_tail_room_shortfall():
    """Tracks of six mils, six mils apart, do not fit on contacts 0.3 mm apart."""
    coil = "{shape: circle, outer_diameter: 7, turns: 6.5, layers: 2, trace_width: 0.16, trace_spacing: 0.16}"
    fpc = "{rules: osh-park-flex, tail: {length: 30, connector: zif-0.3mm}}"
    layout = lay_out(spec_of(coil, "{pattern: line, count: 2, pitch: 9}", fpc))
    (lack,) = layout.shortfalls
    assert lack.what is Missing.TAIL_ROOM and lack.need > lack.have == approx(0.3e-3, rel=1e-6)
    assert layout.pads == () and not any(coil.is_closed_circuit for coil in layout.coils)
