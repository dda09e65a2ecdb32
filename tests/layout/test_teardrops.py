"""Teardrops widen tracks towards vias and contacts, keep all distances, and are left out where there is no room."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path as FilePath

import pytest
from tolerance import approx

from sitscad.kernels.geometry.path import Point, enclosed_area, polyline
from sitscad.layout import lay_out
from sitscad.layout.board import Role, Trace, Via
from sitscad.spec.load import load, load_text

TEMPLATES = sorted((FilePath(__file__).parents[2] / "templates").glob("*.yaml"))
UM, MM = 1e-6, 1e-3


@pytest.fixture(scope="module")
def bench():
    return lay_out(load(str(next(path for path in TEMPLATES if path.stem == "bench_7mm"))))


def wanting(layout, wish):
    return replace(layout, spec=replace(layout.spec, fpc=replace(layout.spec.fpc, teardrops=wish)))


def lone(layout, points, *vias, width=100 * UM):
    """A board with one track and some vias, and nothing else."""
    track = Trace(polyline(points), width, 1, "C1", Role.LEAD)
    return replace(layout, coils=(), traces=(track,), vias=vias, pads=())


def test_via_teardrop_is_hull_of_pad_and_track(bench):
    """The sides are tangents: they stand the radius away from the pad's centre and half a width from the track's."""
    at, end = Point(14 * MM, 0.0), Point(16 * MM, 0.0)
    (drop,) = lone(bench, [at, end], Via(at, 0.2 * MM, 0.45 * MM, "C1")).teardrops
    sides = [s for s in drop.outline if abs(s.end.x - s.start.x) > 0.2 * MM]
    far = Point(at.x + 1.5 * 0.45 * MM, 0.0)
    assert [s.distance(at) for s in sides] == approx([0.225 * MM] * 2, rel=1e-6)
    assert [s.distance(far) for s in sides] == approx([50 * UM] * 2, rel=1e-6)
    assert (drop.net, drop.layer, drop.at_start) == ("C1", 1, True) and drop.origin == at
    assert abs(enclosed_area(drop.outline)) > 0.675 * MM * 100 * UM


def test_wide_or_short_track_has_no_teardrop(bench):
    at, via = Point(14 * MM, 0.0), Via(Point(14 * MM, 0.0), 0.2 * MM, 0.45 * MM, "C1")
    assert lone(bench, [at, at.shifted(2 * MM, 0.0)], via, width=0.45 * MM).teardrops == ()
    assert lone(bench, [at, at.shifted(0.3 * MM, 0.0)], via).teardrops == ()
    assert lone(bench, [at, at.shifted(2 * MM, 0.0)], replace(via, net="C2")).teardrops == ()


@pytest.mark.parametrize(("x", "y"), [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)])
def test_contact_teardrop_reaches_into_contact(bench, x, y):
    """Whichever way the track leaves: copper that only touches may leave a slit where machines round."""
    at, size = Point(14 * MM, 0.0), (0.5 * MM, 0.3 * MM) if x else (0.3 * MM, 0.5 * MM)
    pad = replace(bench.pads[0], centre=at, size=size, net="C1", layer=1)
    (drop,) = replace(lone(bench, [at, at.shifted(2 * MM * x, 2 * MM * y)]), pads=(pad,)).teardrops
    ways = [(s.start.x - at.x) * x + (s.start.y - at.y) * y for s in drop.outline]
    assert (min(ways), max(ways)) == approx((0.25 * MM - 10 * UM, 0.25 * MM + 0.45 * MM), rel=1e-6)


def test_teardrop_length_follows_room(bench):
    """A foreign via beside the track shortens the teardrop, and takes it away where it is nearer still."""
    at, rules = Point(14 * MM, 0.0), bench.spec.fpc.rules
    own, points = Via(at, 0.2 * MM, 0.45 * MM, "C1"), [at, at.shifted(2 * MM, 0.0)]

    def reach(height):
        other = Via(at.shifted(0.45 * MM, height), rules.via_drill, rules.via_pad, "C2")
        drops = lone(bench, points, own, other).teardrops
        return max((p.x - at.x for drop in drops for p in drop.outline.flattened(1e-6)), default=0.0)

    lengths = [reach(height * MM) for height in (1.0, 0.5, 0.42, 0.38)]
    assert lengths == sorted(lengths, reverse=True) and lengths[0] > lengths[-1]


def test_returning_track_shortens_its_teardrop(bench):
    """Seed 752 of the random boards: a lead turned back after 0.53 mm and passed its own teardrop at 58 um."""
    at = Point(14 * MM, 0.0)
    via = Via(at, 0.2 * MM, 0.45 * MM, "C1")
    bend = at.shifted(0.45 * MM, 0.0)

    def copper(beyond):
        return lone(bench, [at, bend, bend.shifted(*beyond)], via).teardrops

    straight, square, back = copper((2 * MM, 0.0)), copper((0.0, 2 * MM)), copper((-2 * MM, 0.6 * MM))
    assert len(straight) == len(square) == 1 and straight[0].outline == square[0].outline
    assert back == () or max(p.x for p in back[0].outline.flattened(1e-6)) < bend.x - 0.1 * MM


@pytest.mark.parametrize("template", TEMPLATES, ids=[path.stem for path in TEMPLATES])
def test_template_teardrops_pass_design_rules(template):
    from sitscad.checks.judging import RULES
    from sitscad.checks.rules import apply_rule
    from sitscad.estimates.design import Design

    layout = lay_out(load(str(template)))
    assert layout.spec.fpc.teardrops == "auto" and len(layout.teardrops) >= len(layout.vias)
    with_none = wanting(layout, "none")
    assert with_none.teardrops == ()
    drawn, subject = [f"SIT{n}" for n in (107, 108, 109, 110, 115)], Design(layout.spec, layout)
    assert [f for rule in RULES if rule.id in drawn for f in apply_rule(rule, subject)[0]] == []
    spots = [v.centre for v in layout.vias] + [p.centre for p in layout.pads]
    for drop in layout.teardrops:
        reach = max(drop.origin.distance(p) for p in drop.outline.flattened(1e-6))
        assert min(drop.origin.distance(p) for p in spots) < 1.6 * MM and reach < 4 * MM
        assert math.isfinite(enclosed_area(drop.outline))


def test_teardrop_closer_than_given_distance_is_found(bench):
    """Held against wider rules than it was made for, a teardrop is found as any copper is."""
    from sitscad.layout.board import Teardrop
    from sitscad.layout.gaps import copper_of, too_near

    copper = copper_of(bench)
    assert sum(isinstance(item, Teardrop) for item in copper.items) == len(bench.teardrops) > 4
    near = list(too_near(copper, 250 * UM, 100 * UM))
    assert any(isinstance(item, Teardrop) for pair in near for item in (pair.one, pair.other))
    assert not any(pair.gap < 100 * UM - 1 * UM for pair in near if isinstance(pair.one, Teardrop))


def test_teardrops_key_defaults_to_auto_and_accepts_none():
    coil = "{shape: circle, outer_diameter: 6, turns: 5, trace_width: 0.1, trace_spacing: 0.1}"
    text = f"sitscad: 1\nname: a\ncoil: {coil}\n"
    assert load_text(text, "a.yaml").fpc.teardrops == "auto"
    assert load_text(text + "fpc: {teardrops: none}\n", "a.yaml").fpc.teardrops == "none"
