"""Two pads joined by a web, in finite elements: what it carries from one target to the next, and how much it stiffens a
pad, against the envelope that SIT219 states.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from bricks import Bricks

from sitscad.estimates.cells import WEB_DECAY, WEB_EDGE, WEB_MEAN, WEB_STIFFENS

pytestmark = [pytest.mark.clients("ccx"), pytest.mark.slow, pytest.mark.more]

SHEAR, POISSON, PLATE, PRESS = 60e3, 0.4995, 0.2e-3, 1e-6
PAIRS = [
    (10e-3, 10e-3, 1.5e-3, 6e-3, 2e-3), (10e-3, 10e-3, 1.5e-3, 6e-3, 9.9e-3), (10e-3, 10e-3, 2.5e-3, 1.7e-3, 1e-3),
    (10e-3, 10e-3, 1e-3, 0.7e-3, 2e-3), (4e-3, 10e-3, 1.5e-3, 2e-3, 2e-3),
]
"""Sides of the pads along and across, thickness, gap, width of the web (m)."""


def _lines(along: float, across: float, thickness: float, gap: float, web: float) -> tuple[np.ndarray, ...]:
    """Half of both pads and the web, which lies in the plane of symmetry; elements are shorter at edges."""

    def fine(length: float, count: int) -> np.ndarray:
        return length * 0.5 * (1.0 - np.cos(np.pi * np.linspace(0.0, 1.0, count + 1)))

    x = [fine(along, 12) - along, fine(gap, max(4, round(4.0 * gap / thickness))), gap + fine(along, 12)]
    beside = 0.5 * web + 0.5 * (across - web) * np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, 7))
    y, z = np.concatenate([np.linspace(0.0, 0.5 * web, 3), beside]), np.linspace(0.0, thickness, 5)
    return np.unique(np.concatenate(x).round(12)), np.unique(y.round(12)), np.append(z, thickness + PLATE)


def _pressed(folder, pair, is_joined: bool) -> tuple[np.ndarray, float]:
    """How far (of the pressed one's way) the other target's nodes go, and the force on the pad (N, half of it)."""
    *_, thickness, gap, web = pair

    def kind(x: float, y: float, z: float) -> str:
        if z > thickness:
            return "NEAR" if x < 0.0 else "FAR" if x > gap else ""
        return "PAD" if not 0.0 < x < gap or (is_joined and y < 0.5 * web) else ""

    model = Bricks(_lines(*pair), kind)
    _, y, z = model.places.T
    held = [(z < 1e-12, axis, 0.0) for axis in range(3)] + [(y < 1e-12, 1, 0.0)]
    held += [(model.of("NEAR"), axis, -PRESS * (axis == 2)) for axis in range(3)]
    metal = (117e9, 0.3)
    materials = {"PAD": (2.0 * SHEAR * (1.0 + POISSON), POISSON), "NEAR": metal, "FAR": metal}
    moved, force = model.solved(folder, materials, held)
    return moved[model.of("FAR"), 2] / PRESS, force


@pytest.mark.parametrize("pair", PAIRS)
def test_a_web_carries_less_than_is_stated_and_not_a_quarter_of_it(pair, tmp_path):
    along, across, thickness, gap, web = pair
    went, force = _pressed(tmp_path, pair, True)
    share = web / min(along, across) * math.exp(-WEB_DECAY * gap / thickness)
    assert 0.25 < abs(went.mean()) / (WEB_MEAN * share) < 1.0
    assert 0.25 < np.abs(went).max() / (WEB_EDGE * share) < 1.0
    apart, alone = _pressed(tmp_path, pair, False)
    assert np.abs(apart).max() < 1e-9
    assert 0.25 < (force / alone - 1.0) / (WEB_STIFFENS * web / min(along, across)) < 1.0
