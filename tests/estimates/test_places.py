"""A target offset or turned: every coil has the share of it that its own place under it gives."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tolerance import approx

from sitscad.estimates.loads import pressing
from sitscad.estimates.loads.pressing import loaded_face, pressed_pad
from sitscad.estimates.targets.assembly import assemble
from sitscad.estimates.targets.finite_target import target_ratios
from sitscad.kernels.electromagnetics.metal.finite_plate import CoaxialRings, FinitePlate, plate_ratio
from sitscad.kernels.geometry.convex import Footprint
from sitscad.kernels.geometry.path import Point
from sitscad.kernels.mechanics.elastomer import compress_part
from sitscad.spec.load import load_text
from sitscad.spec.places import footprint

MM = 1e-3
HEIGHTS = (-30e-6, -60e-6)


def sensor(array="", target="size: 5", pad="size: 9, shape: square"):
    return load_text(
        "sitscad: 1\nname: places\ncoil: {shape: circle, outer_diameter: 5, turns: 8, layers: 2, trace_width: 100 um, "
        f"trace_spacing: 100 um}}\n{array}\ntarget: {{{target}}}\nelastomer: {{{pad}}}\n"
        "requirements: {normal_force: 5 N}\n"
    )


def shares(spec):
    result = target_ratios(spec, HEIGHTS, assemble(spec).states)
    return {name: result.ratios_for(name, "rest") for name in (place.name for place in spec.array.placements)}


def turned(spec, angle):
    """The sensor with its coils' centres turned about the origin."""
    cos, sin = math.cos(angle), math.sin(angle)
    places = (
        replace(p, centre=(cos * p.centre[0] - sin * p.centre[1], sin * p.centre[0] + cos * p.centre[1]))
        for p in spec.array.placements
    )
    return replace(spec, array=replace(spec.array, placements=tuple(places)))


TRIANGLE = "array: {pattern: triangle, pitch: 5.8}"


def test_rotated_target_equals_array_rotated_backwards():
    straight = sensor(TRIANGLE, "shape: rectangle, size: [6, 3]")
    angle = math.radians(37.0)
    oblique = replace(straight, target=replace(straight.target, rotation=angle))
    ours, same = shares(oblique), shares(turned(straight, -angle))
    for name in ours:
        assert ours[name] == approx(same[name], rel=1e-3)
    assert ours["C2"] != approx(shares(straight)["C2"], rel=0.02)


def test_offset_target_equals_array_shifted_backwards():
    spec = sensor(TRIANGLE, "size: 6, offset: [1.2, 0.7]")
    ours = shares(spec)
    for place in spec.array.placements:
        x, y = place.centre
        alone = replace(place, centre=(0.0, 0.0))
        moved = replace(spec, array=replace(spec.array, placements=(alone,)),
                        target=replace(spec.target, offset=(1.2 * MM - x, 0.7 * MM - y)))
        assert shares(moved)[place.name] == approx(ours[place.name], rel=1e-3)
    assert len({round(share, 6) for share, _ in ours.values()}) == 3


@pytest.mark.parametrize(("one", "other"), [
    ("shape: rectangle, size: [6, 3], rotation: 90 deg", "shape: rectangle, size: [3, 6]"),
    ("shape: circle, size: 5, rotation: 33 deg", "shape: circle, size: 5"),
    ("size: 5, rotation: -90 deg", "size: 5"),
])
def test_equivalent_target_rotations_give_equal_ratios(one, other):
    one, other = sensor(TRIANGLE, one), sensor(TRIANGLE, other)
    for name, share in shares(one).items():
        assert share == approx(shares(other)[name], rel=1e-3)
    assert pressed_pad(one).strain == approx(pressed_pad(other).strain, rel=1e-9)


def test_target_effect_on_single_coil_falls_with_offset():
    result = [shares(sensor("", f"size: 5, offset: [{away}, 0]"))["C1"][0] for away in (0.0, 0.5, 1.0, 2.0, 4.0, 8.0)]
    assert result == sorted(result, reverse=True) and result[-1] < 0.05 * result[0]


SIZES = st.floats(0.5, 20.0)
PLATES = st.one_of(st.tuples(st.just(True), SIZES).map(lambda one: (one[0], one[1], one[1])),
                   st.tuples(st.just(False), SIZES, SIZES))


def plate(is_round, width, height):
    """A disc or a rectangle (mm) about the origin."""
    return Footprint(is_round, (width * MM, height * MM), Point(0.0, 0.0))


def loaded(pad, target):
    """The loaded face of two plates about one centre."""
    face, beside = pressing._cached_loaded_face(plate(*pad), plate(*target), 0.0)
    assert beside == approx(0.0, abs=1e-9)
    return face


@settings(max_examples=60)
@given(PLATES, PLATES)
def test_loaded_area_equals_overlap_of_pad_and_target(pad, target):
    n, width = 400, MM * min(pad[1], target[1])
    x = [(i + 0.5) / n * 0.5 * width for i in range(n)]

    def height(face, at):
        is_round, across, up = face
        return 0.5 * MM * up * (math.sqrt(1.0 - (2.0 * at / (MM * across)) ** 2) if is_round else 1.0)

    strips = math.fsum(min(height(pad, at), height(target, at)) for at in x) * 2.0 / n * width
    assert loaded(pad, target).area == approx(strips, rel=1.5e-3)
    assert loaded(target, pad).area == approx(loaded(pad, target).area, rel=1e-9)


@pytest.mark.parametrize(("pad", "is_round"), [((True, 8.0, 8.0), False), ((False, 8.0, 8.0), True)])
def test_loaded_area_and_strain_change_continuously_with_target_size(pad, is_round):
    """A square of 5.66 mm on a round pad of 8 mm loaded a fifth less than one of 5.65 mm."""
    faces = [loaded(pad, (is_round, side, side)) for side in np.arange(3.0, 12.0, 0.05)]
    whole = loaded(pad, pad)
    strains = [compress_part(whole, face, 1e-3, 60e3, 1.5e9, 4.8).strain for face in faces]
    assert all(-1e-12 <= b.area - a.area < 0.04 * whole.area for a, b in pairwise(faces))
    assert all(-0.05 < b - a < 1e-9 for a, b in pairwise(strains))
    assert faces[-1].area == approx(whole.area, rel=1e-6)


def test_half_overlapping_target_loads_overlap_and_tilts():
    spec = sensor("", "size: 4, offset: [3, 0]", "size: 6, shape: square")
    face, beside = loaded_face(spec)
    assert face.area == approx(8e-6, rel=1e-6) and beside == approx(1e-3, rel=1e-6)
    result = pressed_pad(spec)
    assert not result.valid and "it tilts" in result.note and result.loaded_share == approx(8 / 36, rel=1e-6)
    assert result.strain > pressed_pad(sensor("", "size: 4", "size: 6, shape: square")).strain


def test_rotated_target_within_pad_loads_its_full_area():
    spec = sensor("", "shape: rectangle, size: [5, 3], rotation: 30 deg, offset: [1, 0.5]")
    face, beside = loaded_face(spec)
    assert (face.width_x, face.width_y) == approx((5e-3, 3e-3), rel=1e-6) and beside == approx(0.0, abs=1e-12)
    assert "tilts" not in pressed_pad(spec).note


def test_default_pad_size_covers_rotated_and_offset_target():
    spec = sensor(TRIANGLE, "size: 4, rotation: 45 deg, offset: [0.5, -0.2]", "thickness: 1")
    pad, target = footprint(spec, spec.elastomer), footprint(spec, spec.target)
    assert target.overhang_beyond(pad.outline()) <= 1e-9
    assert pad.centre == approx(Point(0.0, 0.0), abs=1e-12)


JAW_COIL = CoaxialRings(
    np.tile((4e-3 - 80e-6) / 2 - 160e-6 * (np.arange(7) + 0.5), 2), np.repeat([-15e-6, -64e-6], 7), np.ones(14)
)


@pytest.mark.parametrize("gap", [0.5e-3, 1e-3])
def test_square_target_ratio_lies_between_inscribed_and_circumscribed_discs(gap):
    """More metal never does less, in whatever direction the coil stands; the disc is solved in a basis of its own."""
    side, places = 4.5e-3, np.array([[0.0, 0.0], [1.5e-3, 1.5e-3], [2.25e-3, 2.25e-3], [3e-3, 3e-3], [2e-3, 3.5e-3]])
    square = plate_ratio(FinitePlate((side, side), 20e-6), JAW_COIL, places, gap)
    inner, outer = (
        plate_ratio(FinitePlate((size, size), 20e-6, is_round=True), JAW_COIL, places, gap)
        for size in (side, math.sqrt(2) * side)
    )
    assert np.all(inner <= square * 1.001) and np.all(square <= outer * 1.001)
