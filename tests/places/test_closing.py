"""Jaws about their hinge: closed formulas against points that are turned one by one."""

from __future__ import annotations

import math
from dataclasses import replace

import handmade
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tolerance import approx

from sitscad.assembly.places.fit import closed_section, closing_motion
from sitscad.assembly.places.jaws import POCKET_CLEARANCE, jaw_section, jaw_with_rims, seat_half_width
from sitscad.basics.check_results import Closing
from sitscad.spec import presets

CLOSING = Closing(0.5e-3, 18e-3, math.radians(60.0))


def turned(point, pivot, angle):
    """A point (x, z) turned about a pivot by an angle, so that what lies at the tip goes up."""
    x, z = point[0] - pivot[0], point[1] - pivot[1]
    cos, sin = math.cos(angle), math.sin(angle)
    return pivot[0] + x * cos + z * sin, pivot[1] - x * sin + z * cos


def faces(closing, tilt):
    """The middles of both faces (x, z), each turned by half an angle; x runs to the hinge, z from this jaw up."""
    pivot, half = (0.0, -closing.offset), closing.parallel_at / 2.0
    lower = turned((-closing.reach, -half), pivot, -tilt / 2.0)
    return lower, turned((-closing.reach, half), pivot, tilt / 2.0)


@given(st.floats(0.0, 6e-3), st.floats(-4e-3, 4e-3), st.floats(-2e-3, 2e-3))
def test_gap_at_tilt_equals_tissue_for_all_pivots(thickness, offset, parallel_at):
    closing = Closing(parallel_at, 18e-3, math.radians(60.0), offset)
    lower, upper = faces(closing, closing.tilt(thickness))
    assert upper[1] - lower[1] == approx(thickness, abs=1e-12)
    assert upper[0] - lower[0] == approx(closing.slide(thickness), abs=1e-12)


def test_jaws_with_central_pivot_do_not_slide():
    assert CLOSING.slide(3e-3) == 0.0
    assert abs(Closing(0.5e-3, 18e-3, 1.0, 2e-3).slide(3e-3)) > 0.1e-3


def test_faces_are_parallel_on_remaining_port_height():
    assert CLOSING.tilt(0.5e-3) == approx(0.0, abs=1e-15) and CLOSING.tilt(0.0) < 0.0 < CLOSING.tilt(1e-3)
    assert CLOSING.most == approx(0.5e-3 * math.cos(math.radians(30.0)) + 18e-3, rel=1e-6)
    assert CLOSING.tilt(CLOSING.most) == approx(CLOSING.opening, rel=1e-6)
    assert CLOSING.tilt(1.0) is None


def test_sensor_closing_follows_closed_section():
    layout = handmade.jaw_sensor()
    result = closing_motion(layout)
    assert result.parallel_at == approx(5e-3 - closed_section(layout).height, rel=1e-6)
    assert result.reach is None and result.tilt(1e-3) is None and result.most is None
    jaw = replace(handmade.jaw(), hinge=8e-3)
    hinged = handmade.jaw_sensor(mount=handmade.Mount("grasper-pad", jaw, 1e-3))
    assert closing_motion(hinged).reach == approx(8e-3 + 8e-3, rel=1e-6)
    assert closing_motion(handmade.bench_sensor()) is None


@pytest.mark.parametrize("name", presets.names("jaw"))
def test_jaw_presets_pass_port_and_state_hinge(name):
    jaw = presets.jaw(name)
    bar = jaw_section(jaw_with_rims(jaw))
    assert 2.0 * jaw.height < jaw.port_diameter and jaw_with_rims(jaw).height < jaw.port_diameter / 2
    assert math.hypot(bar.face / 2, jaw.port_diameter / 2 - bar.height) <= jaw.port_diameter / 2 + 1e-12
    assert jaw.hinge and jaw.opening and "unverified" in jaw.source
    if jaw.pocket:
        assert jaw.pocket[0] <= jaw.length and jaw.pocket[1] < bar.face and jaw.recess > 0.0


def test_face_wider_than_port_chord_has_flatter_back():
    written = jaw_section(replace(handmade.jaw(height=1.2e-3), face=4.8e-3))
    assert written.face == approx(4.8e-3, rel=1e-6) and written.radius > 2.5e-3 and written.side == 0.0
    narrow = jaw_section(replace(handmade.jaw(height=1.2e-3), face=3e-3))
    assert narrow.face == approx(3e-3, rel=1e-6) and narrow.radius == approx(2.5e-3, rel=1e-6) and narrow.side > 0.0
    assert written.outline.is_closed and narrow.outline.is_closed


def test_pieces_in_pad_pocket_are_narrower_than_pocket():
    jaw = replace(handmade.jaw(height=0.9e-3), recess=0.6e-3, pocket=(14e-3, 3.4e-3))
    layout = handmade.jaw_sensor(mount=handmade.Mount("grasper-pad", jaw, 1e-3))
    floor = -0.2e-3 - 1e-3
    assert seat_half_width(layout, floor + 0.1e-3) == approx(1.7e-3 - POCKET_CLEARANCE, rel=1e-6)
    assert seat_half_width(layout, floor + 0.7e-3) > 1.9e-3


@pytest.mark.slow
@pytest.mark.cad
def test_insert_touches_only_pocket_floor():
    from solid_pairs import interferences

    from sitscad.assembly.places.bodies import BodyRole
    from tests.oracles.envelope import closed_pair

    jaw = replace(handmade.jaw(height=0.9e-3), recess=0.6e-3, pocket=(14e-3, 3.4e-3), fenestration=(3e-3, 1e-3))
    pair = closed_pair(handmade.jaw_sensor(mount=handmade.Mount("grasper-pad", jaw, 1e-3)))
    assert interferences(pair) == ()
    metal = next(s for s in pair if s.role is BodyRole.JAW)
    box = metal.shape.bounding_box()
    assert approx(1.5, rel=1e-6) == box.size.Z and metal.shape.is_valid
    plain = handmade.Mount("grasper-pad", replace(jaw, fenestration=None), 1e-3)
    whole = next(s for s in closed_pair(handmade.jaw_sensor(mount=plain)) if s.role is BodyRole.JAW)
    assert whole.volume - metal.volume == approx(3e-3 * 1e-3 * 0.9e-3, rel=0.06)  # through a round back
