"""A plate that bends on a bonded pad, in finite elements, against the springs that SIT327 judges it by: they are on the
safe side, near the limit by at most two thirds, and several times where the plate is hardly larger than what presses.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from bricks import Bricks
from tolerance import approx

from sitscad.checks.rules import constant_limits
from sitscad.kernels.mechanics.plate_bending import POISSON, plate_deflection, rigidity

pytestmark = [pytest.mark.clients("ccx"), pytest.mark.slow, pytest.mark.more]

COPPER, SHEAR, RUBBER = 117e9, 30e3, 0.499
PRESSED = 10e-3


def _line(half: float, count: int, inner: float) -> np.ndarray:
    """From the middle to a free edge, where elements are shorter, with a line at what is pressed."""
    within = np.linspace(0.0, inner, max(2, round(count * inner / half)) + 1)
    beside = count + 1 - len(within)
    return np.append(within, inner + (half - inner) * np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, beside + 1))[1:])


def _quarter(size, pad, foil, rim, counts) -> Bricks:
    """The pad reaches `rim` (m) beyond the plate."""
    sides = [_line(0.5 * side, count, 0.5 * min(PRESSED, side)) for side, count in zip(size, counts, strict=False)]
    sides = [np.append(item, item[-1] + rim * np.array([0.2, 0.5, 1.0])) if rim else item for item in sides]
    heights = pad * np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, counts[2] + 1))

    def kind(x: float, y: float, z: float) -> str:
        return "PAD" if z < pad else "FOIL" if x < 0.5 * size[0] and y < 0.5 * size[1] else ""

    return Bricks((*sides, np.append(heights, pad + foil)), kind)


def _held(model: Bricks) -> Iterator[tuple[np.ndarray, int, float]]:
    """The pad's lower face on the board, and two planes of symmetry."""
    x, y, z = model.places.T
    yield from ((z < 1e-12, axis, 0.0) for axis in range(3))
    yield from ((x < 1e-12, 0, 0.0), (y < 1e-12, 1, 0.0))


def _compared(folder, size, pad, foil, rim, counts) -> tuple[float, float]:
    """How much farther the middle goes down than the highest place, over the way of a rigid plate: by elements, and by
    springs as stiff as the pad under that plate.
    """
    model, area = _quarter(size, pad, foil, rim, counts), size[0] * size[1]
    materials = {"PAD": (2.0 * SHEAR * (1.0 + RUBBER), RUBBER), "FOIL": (COPPER, POISSON)}
    plate = [(model.of("FOIL"), axis, -1e-6 * (axis == 2)) for axis in range(3)]
    springs = 4.0 * model.borne(model.solved(folder, materials, [*_held(model), *plate])[1]) / 1e-6 / area
    load = 1e3
    moved, forces = model.solved(folder, materials, list(_held(model)), lambda kind, middle: load * (
        kind == "FOIL" and bool((middle[:2] < 0.5 * PRESSED).all())))
    total = load * PRESSED * min(PRESSED, size[1])
    assert 4.0 * model.borne(forces) == approx(total, rel=1e-3)
    down = -moved[model.places[:, 2] > pad + 0.9 * foil, 2]
    middle = -moved[np.argmin(np.hypot(*model.places[:, :2].T) - model.places[:, 2]), 2]
    ratio = np.array([rigidity(COPPER, foil) / springs])
    return (middle - down.min()) / (total / springs / area), float(plate_deflection(size, False, (PRESSED, PRESSED),
                                                                                    ratio)[0])


@pytest.mark.parametrize(
    ("size", "pad", "foil", "rim", "counts", "most"),
    [
        ((59e-3, 10e-3), 2e-3, 1.6e-3, 0.0, (20, 5, 4), 1.12),
        ((59e-3, 10e-3), 2e-3, 3.2e-3, 0.0, (20, 5, 4), 1.15),
        ((20e-3, 20e-3), 2e-3, 0.94e-3, 0.0, (9, 9, 4), 1.65),
        ((11.5e-3, 11.5e-3), 2e-3, 0.2e-3, 1e-3, (10, 10, 4), 4.0),
    ],
    ids=["strip", "stiff strip", "square", "hardly larger than the finger"],
)
def test_plate_on_springs_bends_more_than_on_elastic_pad(size, pad, foil, rim, counts, most, tmp_path):
    elements, springs = _compared(tmp_path, size, pad, foil, rim, counts)
    assert 1.0 < springs / elements < most


@pytest.mark.parametrize(("side", "pad"), [(10e-3, 1.5e-3), (10e-3, 3e-3), (16e-3, 2.5e-3)])
def test_uniformly_pressed_plate_of_stated_rigidity_is_flat(side, pad, tmp_path):
    """Half of its thickness does not: SIT327 says below which rigidity it does not judge even pressure."""
    size, materials = (side, side), {"PAD": (2.0 * SHEAR * (1.0 + RUBBER), RUBBER), "FOIL": (COPPER, POISSON)}

    def solved(foil: float, is_rigid: bool) -> tuple[float, float]:
        model = _quarter(size, pad, foil, 0.0, (10, 10, 4))
        plate = [(model.of("FOIL"), axis, -1e-6 * (axis == 2)) for axis in range(3)] if is_rigid else []
        moved, forces = model.solved(tmp_path, materials, [*_held(model), *plate], lambda kind, _: 1e3 * (
            kind == "FOIL" and not is_rigid))
        return np.ptp(moved[model.places[:, 2] > pad + 0.9 * foil, 2]), 4.0 * model.borne(forces) / side**2

    springs = solved(0.3e-3, True)[1] / 1e-6
    least = (constant_limits()["evenly_pressed"].value * side) ** 4 * springs
    foil = (12.0 * (1.0 - POISSON**2) * least / COPPER) ** (1.0 / 3.0)
    flat, half = (solved(thickness, False)[0] / (1e3 / springs) for thickness in (foil, 0.5 * foil))
    assert flat < 0.1 < 0.2 < half
