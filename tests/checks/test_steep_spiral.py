"""SIT108 on a round spiral of wide pitch: it names the spacing with which the turns keep their distance."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import pytest
from tolerance import approx

from sitscad.basics.units import parse_quantity
from sitscad.checks.board.clearances import spiral_gap_reduction
from sitscad.layout import lay_out
from sitscad.spec.load import load_text


def wide(width=1.2, spacing=0.1, turns=1.35, shape="circle"):
    return load_text(
        "sitscad: 1\nname: wide\n"
        f"coil: {{shape: {shape}, outer_diameter: 10, turns: {turns}, layers: 2, trace_width: {width}, "
        f"trace_spacing: {spacing}}}\n",
        "wide.yaml",
    )


def nearest_turns(spec):
    """Copper to copper (m) of two turns of r = r0 - p theta / 2 pi, from the formula by trying all their points."""
    coil = spec.coil
    outer, total = (coil.size[0] - coil.trace_width) / 2, 2 * math.pi * coil.turns
    slope, count = coil.pitch / (2 * math.pi), 4000

    def at(theta):
        radius = outer - slope * theta
        return radius * math.cos(theta), radius * math.sin(theta)

    theta = [total * i / count for i in range(count + 1)]
    return (
        min(
            math.dist(at(item), at(item - 2 * math.pi + turned))
            for item in theta[:: count // 200]
            if item >= 2 * math.pi
            for turned in [0.5 * (k / 1000 - 0.5) for k in range(1001)]
            if item - 2 * math.pi + turned >= 0.0
        )
        - coil.trace_width
    )


def test_measured_turn_gap_equals_exact_spiral_gap(judge):
    """It is not an error of how the spiral is drawn: the formula itself, tried point by point, has the same gap."""
    spec = wide()
    result = judge("SIT108", spec, lay_out(spec))
    gap = min(finding.measured for finding in result)
    assert gap == approx(nearest_turns(spec), abs=0.2e-6)
    assert 0.0 < spec.coil.trace_spacing - gap <= spiral_gap_reduction(spec.coil)


@pytest.mark.parametrize(("width", "turns"), [(1.2, 1.35), (0.8, 2.5)])
def test_suggested_trace_spacing_clears_turn_gap_finding(advised, judge, width, turns):
    spec = wide(width, turns=turns)
    result = advised("SIT108", spec, lay_out(spec))
    assert result and all(finding.fixes for finding in result)
    edits = [edit for finding in result for edit in finding.fixes[0].edits if edit.key == "coil.trace_spacing"]
    named = max(parse_quantity(edit.new.strip('"'), "length") for edit in edits)
    mended = replace(spec, coil=replace(spec.coil, trace_spacing=named))
    assert judge("SIT108", mended, lay_out(mended)) == []
    assert 0.101e-3 <= named <= 0.104e-3


def test_polygon_and_narrow_spiral_have_no_gap_reduction(judge):
    assert spiral_gap_reduction(wide(shape="square", turns=1).coil) == 0.0
    assert spiral_gap_reduction(wide(0.1, 0.1, 5).coil) < 0.1e-6
    assert judge("SIT108", wide(0.1, 0.1, 5), lay_out(wide(0.1, 0.1, 5))) == []


@pytest.mark.parametrize(("shape", "size", "turns", "radius"), [
    ("square", "10", 5, 2.4), ("square", "10", 8, 2.0), ("rectangle", "[14, 8]", 5, 2.5)])
def test_suggested_corner_radius_clears_turn_gap_finding(judge, shape, size, turns, radius):
    """The innermost side has no room for a larger radius; its corners came out sharper, near the turn outside."""
    def text(radius):
        return (f"sitscad: 1\nname: a\ncoil: {{shape: {shape}, outer_diameter: {size}, turns: {turns}, layers: 2, "
                f"trace_width: 155 um, trace_spacing: 155 um, start: mid-side, corner_radius: {radius}}}\n")

    spec = load_text(text(radius), "a.yaml")
    (result,) = judge("SIT108", spec, lay_out(spec))
    named = float(re.search(r"coil\.corner_radius: ([0-9.]+)", result.hint)[1])
    assert result.key == "coil.corner_radius" and 0.5 * radius < named < radius
    mended = load_text(text(named), "a.yaml")
    assert judge("SIT108", mended, lay_out(mended)) == []
