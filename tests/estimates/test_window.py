"""A window in the jaw's face: what its metal does lies between that of the whole face and none of it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tolerance import approx

import sitscad
from sitscad.checks.assembly.joints import JOINT_RULES
from sitscad.checks.rules import apply_rule
from sitscad.design import Design
from sitscad.physics.metal.finite_plate import CoaxialRings, field_share
from sitscad.spec import templates

SHIELD = "shield: {material: copper, thickness: 0.1, gap: 0.5}"
JAW = "jaw: generic-5mm "
BARE = templates.read("grasper_4layer").replace(SHIELD, "")


def at_rest(text: str):
    found = sitscad.estimate(sitscad.lay_out(sitscad.load_text(text, "t.yaml")))
    return found.coils[0].states["rest"], found


def windowed(size: str, text: str = BARE) -> str:
    return text.replace(JAW, f"jaw: {{based_on: generic-5mm, fenestration: {size}}} ")


def test_numbers_lie_between_the_whole_face_and_none_and_say_how_far():
    """A window of 19.5 x 4.3 mm in a face of 20 x 4.386 mm left L and Rp as they were."""
    poor = BARE.replace(JAW, "jaw: {based_on: generic-5mm, material: {name: poor, conductivity: 1 S/m}} ")
    (whole, _), (none, _) = at_rest(BARE), at_rest(poor)
    small, middle, large = (at_rest(windowed(size))[0] for size in ("[0.3, 0.3]", "[3, 1]", "[19.5, 4.3]"))
    assert whole.inductance < small.inductance < middle.inductance < large.inductance < none.inductance
    assert large.inductance == approx((whole.inductance + none.inductance) / 2, rel=5e-3)
    reach = math.sqrt(3.0) * large.spread.inductance
    assert large.inductance - reach <= whole.inductance and large.inductance + 1.05 * reach >= none.inductance
    assert large.spread.causes["parallel_resistance"] == "window in the jaw"
    assert large.spread.parallel_resistance > 3.0 * whole.spread.parallel_resistance
    assert small.spread.inductance < 1.01 * whole.spread.inductance


def test_a_sheet_of_copper_before_the_window_hides_it():
    (plain, _), (found, estimates) = (at_rest(text) for text in (BARE + SHIELD, windowed("[10, 2]", BARE + SHIELD)))
    assert found.inductance == approx(plain.inductance, rel=1e-4)
    assert any("window" in note for note in estimates.notes)


@pytest.mark.parametrize("offset", [(0.0, 0.0), (1.5e-3, 0.4e-3)])
def test_a_share_of_the_field_is_that_of_a_sum_over_the_plane(offset):
    ring, gap, size = 2e-3, 0.9e-3, (3e-3, 1e-3)
    share = field_share(size, CoaxialRings(np.array([ring]), np.zeros(1), np.ones(1)), np.array([offset]), gap)
    angle = 2.0 * math.pi * (np.arange(256) + 0.5) / 256

    def along(x, y):
        """The radial field of the ring, by its own points (Biot-Savart), in any unit."""
        r = np.hypot(x, y)[..., None]
        away = (r * r + ring * ring - 2.0 * r * ring * np.cos(angle) + gap * gap) ** 1.5
        return (np.cos(angle) / away).mean(axis=-1)

    def squared(half, centre, count):
        x, y = (c + h * (2.0 * (np.arange(count) + 0.5) / count - 1.0) for c, h in zip(centre, half, strict=True))
        return (along(*np.meshgrid(x, y)) ** 2).mean() * half[0] * half[1]

    part = squared((size[0] / 2, size[1] / 2), (-offset[0], -offset[1]), 60)
    assert share[0] == approx(part / squared((0.02, 0.02), (0.0, 0.0), 500), rel=0.01)


def test_a_rim_of_a_few_hundredths_beside_a_window_is_refused():
    def said(size):
        spec = sitscad.load_text(windowed(size), "t.yaml")
        return apply_rule(JOINT_RULES[0], Design(spec))[0]

    (found,) = said("[19.5, 4.3]")
    assert found.key == "mount.jaw.fenestration" and found.measured == approx(43e-6, rel=0.01)
    assert said("[10, 2]") == []
