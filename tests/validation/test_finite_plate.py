"""The share of a finite plate against converged boxes of surface loops, boxes of poles and discs of rings."""

from __future__ import annotations

import math

import numpy as np
import pytest
from box_of_loops import box_change, converged_change, endless_change
from tolerance import approx

from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.metal.finite_plate import (
    CoaxialRings,
    FinitePlate,
    loss_ratio_error,
    magnetic_ratio,
    magnetic_ratio_error,
    plate_loss_ratio,
    plate_ratio,
    ratio_error,
)


def coil(outer, turns, pitch, width, heights):
    radii = (outer - width) / 2 - pitch * (np.arange(turns) + 0.5)
    return np.tile(radii, len(heights)), np.repeat(heights, turns)


JAW = coil(4e-3, 7, 160e-6, 80e-6, np.array([-15e-6, -64e-6, -142e-6, -191e-6]))
BENCH = coil(7e-3, 12, 200e-6, 100e-6, np.array([30e-6, -30e-6]))
BETWEEN, OVER = 2.25e-3, 0.0
QUICK = (
    (JAW, (4.5e-3, 4.2e-3), 0.2e-3, BETWEEN, 1e-3, None),
    (JAW, (4.5e-3, 4.2e-3), 0.2e-3, OVER, 1e-3, None),
    (JAW, (2e-3, 2e-3), 0.2e-3, OVER, 0.5e-3, None),
    (BENCH, (3e-3, 7e-3), 0.2e-3, 4e-3, 1e-3, None),
)
SLOW = (
    (JAW, (4.5e-3, 4.2e-3), 0.2e-3, BETWEEN, 0.4e-3, None),
    (JAW, (4.5e-3, 4.2e-3), 0.2e-3, OVER, 0.4e-3, None),
    (JAW, (4.5e-3, 4.2e-3), 0.1e-3, BETWEEN, 1e-3, None),
    (JAW, (4.5e-3, 4.2e-3), 0.5e-3, BETWEEN, 1e-3, None),
    (JAW, (4.5e-3, 4.2e-3), 0.5e-3, OVER, 1e-3, None),
    (JAW, (4.5e-3, 4.2e-3), 0.2e-3, BETWEEN, 1e-3, -0.9e-3),
    (JAW, (4.5e-3, 4.2e-3), 0.2e-3, OVER, 1e-3, -0.9e-3),
    (JAW, (8e-3, 8e-3), 0.2e-3, 2.5e-3, 1.5e-3, None),
    (BENCH, (8e-3, 8e-3), 0.2e-3, 4e-3, 2e-3, None),
    (BENCH, (8e-3, 8e-3), 0.5e-3, 4e-3, 1e-3, None),
    (BENCH, (3e-3, 7e-3), 0.2e-3, 2e-3, 1e-3, None),
)


def label(case):
    rings, size, thickness, offset, gap, floor = case
    mounted = "free" if floor is None else f"mirror {-1e3 * floor:g}"
    name = "jaw" if rings is JAW else "bench"
    plate = "x".join(f"{1e3 * length:g}" for length in (*size, thickness))
    return f"{name} {plate} at {1e3 * offset:g} gap {1e3 * gap:g} {mounted}"


def share_and_reference(rings, size, thickness, offset, gap, floor, across=24, through=8):
    radii, heights = rings
    endless = endless_change(radii, heights, gap, floor)
    box = converged_change(size, thickness, offset, radii, heights, gap, floor=floor, across=across, through=through)
    plate, winding = FinitePlate(size, thickness), CoaxialRings(radii, heights, np.ones_like(radii))
    share = plate_ratio(plate, winding, np.array([[offset, 0.0]]), gap, -math.inf if floor is None else floor)[0]
    return float(share), box / endless, ratio_error(plate, winding)


@pytest.mark.few(1)
@pytest.mark.parametrize("case", QUICK, ids=label)
def test_plate_ratio_agrees_with_box_model(case):
    share, reference, error = share_and_reference(*case)
    assert share == approx(reference, rel=error)


@pytest.mark.slow
@pytest.mark.parametrize("case", SLOW, ids=label)
def test_plate_ratio_agrees_with_many_box_models(case):
    share, reference, error = share_and_reference(*case)
    assert share == approx(reference, rel=error)


@pytest.mark.slow
def test_box_model_converges_with_panel_size():
    radii, heights = JAW
    arguments = ((4.5e-3, 4.2e-3), 0.2e-3, BETWEEN, radii, heights, 1e-3)
    coarse, middle, fine = (box_change(*arguments, n, n // 3) for n in (12, 24, 36))
    assert 2.0 * middle - coarse == approx(3.0 * fine - 2.0 * middle, rel=0.005)
    assert abs(coarse) > abs(middle) > abs(fine)


@pytest.mark.slow
@pytest.mark.parametrize("case", (*QUICK[:3], SLOW[3], SLOW[5], SLOW[9]), ids=label)
def test_loss_ratio_agrees_with_receded_boxes(case):
    # Boxes 10 um smaller at every face against 10 um larger ones: off centre and with a mirror, unlike discs.
    (radii, heights), size, thickness, offset, gap, floor = case

    def receded(by):
        smaller, place = (size[0] - 2 * by, size[1] - 2 * by), gap + by
        box = converged_change(smaller, thickness - 2 * by, offset, radii, heights, place, floor=floor, across=24,
                               through=8)
        return box, endless_change(radii, heights, place, floor)

    (more, more_endless), (less, less_endless) = receded(-10e-6), receded(10e-6)
    plate, rings = FinitePlate(size, thickness), CoaxialRings(radii, heights, np.ones_like(radii))
    ours = plate_loss_ratio(plate, rings, np.array([[offset, 0.0]]), gap, -math.inf if floor is None else floor)[0]
    reference = (more - less) / (more_endless - less_endless)
    assert ours == approx(reference, rel=loss_ratio_error(plate, rings))


EIGHT = (8e-3 - 0.15e-3) / 2 - 0.3e-3 * (np.arange(8) + 0.5)
SKIN = 1.0 / math.sqrt(math.pi * 5e6 * MU0 * 5.8e7)
ENDLESS = 20e-3
"""Diameter (m) from which a disc does all that an endless plate would to this coil."""


def shares_and_discs(gap, diameter, thickness):
    """Shares of inductance and loss: ours, of discs of rings, and our errors; faces lie half a skin deeper."""
    from disc_of_rings import disc_change

    disc, endless = disc_change(EIGHT, gap, diameter, thickness), disc_change(EIGHT, gap, ENDLESS, thickness)
    depth = min(0.25 * thickness, 0.5 * SKIN)
    plate = FinitePlate((diameter - 2 * depth,) * 2, thickness - 2 * depth, is_round=True)
    rings = CoaxialRings(EIGHT, np.zeros(8), np.ones(8))
    ours = (float(share(plate, rings, np.zeros((1, 2)), gap + depth)[0]) for share in (plate_ratio, plate_loss_ratio))
    return tuple(ours), (disc[0] / endless[0], disc[1] / endless[1]), (
        ratio_error(plate, rings), loss_ratio_error(plate, rings))


def check_disc(gap, diameter, thickness):
    ours, true, errors = shares_and_discs(gap, diameter, thickness)
    assert ours[0] == approx(true[0], abs=errors[0] * ours[0])
    assert ours[1] == approx(true[1], abs=errors[1] * ours[1])


# gap, diameter and thickness (m): a coil of 8 mm
DISCS = [(0.3e-3, 3e-3, 0.2e-3), (0.3e-3, 5e-3, 0.2e-3), (0.3e-3, 6e-3, 0.2e-3), (1e-3, 8e-3, 0.2e-3),
         (1e-3, 8e-3, 1e-3), (2e-3, 5e-3, 0.05e-3)]
MORE_DISCS = [(g, d, t) for g in (0.3e-3, 1e-3, 2e-3) for d in (1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3, 8e-3, 12e-3)
              for t in (0.05e-3, 0.2e-3, 0.5e-3, 1e-3, 3e-3)]


@pytest.mark.few(1)
@pytest.mark.needs("scipy")
@pytest.mark.parametrize("case", DISCS, ids=str)
def test_disc_ratios_agree_with_ring_model(case):
    """One share for both lost up to four fifths of the loss, a sheet in the middle half of a thick disc."""
    check_disc(*case)


@pytest.mark.slow
@pytest.mark.needs("scipy")
@pytest.mark.parametrize("case", MORE_DISCS, ids=str)
def test_many_disc_ratios_agree_with_ring_model(case):
    check_disc(*case)


@pytest.mark.slow
@pytest.mark.needs("scipy")
def test_ring_model_of_disc_has_converged():
    from disc_of_rings import disc_change

    for case in ((0.3e-3, 3e-3, 0.2e-3), (1e-3, 8e-3, 3e-3)):
        coarse, fine = disc_change(EIGHT, *case), disc_change(EIGHT, *case, first=4e-6, growth=1.25)
        assert coarse == approx(fine, rel=0.01)


def test_thin_box_model_agrees_with_sheet_ratio():
    radii, heights = JAW
    box = converged_change((4.5e-3, 4.2e-3), 20e-6, BETWEEN, radii, heights, 1e-3, across=24, through=2)
    sheet = plate_ratio(FinitePlate((4.5e-3, 4.2e-3), 20e-6), CoaxialRings(radii, heights, np.ones_like(radii)),
                        np.array([[BETWEEN, 0.0]]), 1e-3)[0]
    assert sheet == approx(box / endless_change(radii, heights, 1e-3), rel=0.03)


# coil, sides, thickness, offset and gap of a magnetic plate in coil diameters
MAGNETS = [
    (BENCH, (1.0, 1.0), 0.1, 0.0, 0.15), (BENCH, (1.0, 1.0), 0.1, 0.5, 0.4), (BENCH, (1.5, 1.5), 0.1, 0.0, 0.4),
    (JAW, (1.5, 1.5), 0.2, 0.5, 0.15), (JAW, (1.0, 1.0), 0.2, 0.0, 0.4), (BENCH, (0.6, 0.6), 0.1, 0.0, 0.4),
    (BENCH, (1.0, 2.0), 0.1, 0.5, 0.4), (BENCH, (1.0, 2.0), 0.2, 0.0, 0.15), (BENCH, (0.25, 0.25), 0.03, 0.0, 0.15),
    (BENCH, (0.25, 0.25), 0.5, 0.0, 0.4), (BENCH, (0.5, 0.5), 2.5, 0.3, 0.15), (BENCH, (0.13, 0.13), 0.06, 0.0, 0.4),
    (JAW, (0.13, 0.13), 2.5, 0.0, 0.4), (BENCH, (2.0, 2.0), 1.0, 0.0, 0.4),
]


@pytest.mark.few(2)
@pytest.mark.needs("scipy")
@pytest.mark.parametrize("case", MAGNETS)
def test_magnetic_ratio_agrees_with_pole_box_model(case):
    # Ferrite was given a conductor's share, +- 3 %: double of what a plate of the coil's size does over its middle.
    from box_of_poles import pole_share

    (radii, heights), sides, thickness, offset, gap = case
    size = 2.0 * radii.max()
    sides, thickness, offset, gap = (size * np.asarray(value) for value in (sides, thickness, offset, gap))
    coarse, better = (pole_share(sides, thickness, offset, radii, heights, gap, *n) for n in ((16, 4), (24, 6)))
    reference = 3.0 * better - 2.0 * coarse
    assert better == approx(reference, rel=0.05 if thickness <= 0.2 * sides.min() else 0.15)
    plate, rings = FinitePlate(tuple(sides), thickness), CoaxialRings(radii, heights, np.ones_like(radii))
    ours = magnetic_ratio(plate, rings, np.array([[offset, 0.0]]), gap)[0]
    error = magnetic_ratio_error(plate, rings)
    assert ours == approx(reference, rel=error)
    if offset == 0.0 and 0.5 * size < max(sides) <= size:
        conductor = plate_ratio(plate, rings, np.array([[offset, 0.0]]), gap)[0]
        assert conductor > 1.3 * reference
