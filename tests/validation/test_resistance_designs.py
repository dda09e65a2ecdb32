"""The resistance at frequency and its stated error, on random designs of every shape, against the finer solution."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import resistance_designs as designs
from tolerance import approx
from windings import UM, coil

from sitscad.estimates.circuits.solved_winding import resistance_bound
from sitscad.estimates.windings.losses import FINE_TOLERANCE, USUAL_TOLERANCE, winding_losses
from sitscad.estimates.windings.methods import winding_geometry
from sitscad.kernels.electromagnetics.loss import proximity

REFERENCES = designs.references()
EVERY = 10
"""The quick tests take one design in so many, the slow ones all."""


@cache
def compared(families, tolerance=None, unseen=False, every=1):
    """Rows (family, number, frequency, error, stated error)."""
    rows = []
    for (family, number), reference in REFERENCES.items():
        if family not in families or (number >= designs.UNSEEN) != unseen or number % every:
            continue
        spec, wound = designs.design(family, number)
        spirals = winding_geometry(spec, wound).spirals
        loss = winding_losses(spec, wound, spirals, designs.COPPER, tolerance)
        wanted = USUAL_TOLERANCE if tolerance is None else FINE_TOLERANCE
        bound = resistance_bound(spec, wound, spirals, designs.COPPER, wanted)
        for frequency, exact in zip(designs.FREQUENCIES, reference, strict=True):
            ratio = loss.resistance_ratio(frequency)
            rows.append((family, number, frequency, abs(ratio / exact - 1.0), bound.relative(ratio, frequency)))
    return rows


def assert_bounded(rows):
    assert rows and [row for row in rows if row[3] > row[4]] == []


def test_default_azimuths_resolve_quarter_turns_on_four_layers():
    """Four azimuths met two offsets of the crossing turns: 3.202 was read at 8.34 MHz, converged it is 3.129."""
    layers = coil(6.18e-3, 7.75, 135 * UM, 129 * UM, [0, -43 * UM, -86 * UM, -129 * UM], [18 * UM] * 4)
    resolution = proximity.suited_resolution(layers, designs.COPPER, USUAL_TOLERANCE)
    assert len(proximity.sectors(layers, resolution.cuts)) == 8
    usual = proximity.winding_loss(layers, designs.COPPER).resistance_ratio(8.34e6)
    many = proximity.LossResolution(resolution.modes, 32, resolution.steps)
    converged = proximity.winding_loss(layers, designs.COPPER, resolution=many).resistance_ratio(8.34e6)
    assert usual == approx(converged, rel=2e-3)
    assert proximity.crossing_error(layers, 3) > 0.023  # the error that was, of the loss that is added


def test_layers_without_crossings_use_minimum_azimuths():
    alone = coil(6e-3, 7.75, 135 * UM, 129 * UM, [0.0], [18 * UM])
    apart = coil(6e-3, 7.75, 135 * UM, 129 * UM, [0.0, -2e-3], [18 * UM] * 2)
    for layers in (alone, apart):
        assert proximity.suited_resolution(layers, designs.COPPER, 0.03).cuts == proximity.LEAST_CUTS


@pytest.mark.parametrize("family", designs.FAMILIES)
def test_resistance_stated_error_holds_on_sampled_designs(family):
    assert_bounded(compared((family,), every=EVERY))


def test_resistance_stated_error_holds_on_held_out_designs():
    assert_bounded(compared(("circle", "square", "hexagon"), unseen=True, every=2))


def test_resistance_stated_error_is_within_factor_10_in_median():
    """Half of them are less than ten times the error."""
    rows = [row for family in ("circle", "square", "hexagon") for row in compared((family,), every=EVERY)]
    assert np.median([stated / error for *_, error, stated in rows]) < 10.0


@pytest.mark.slow
@pytest.mark.parametrize("unseen", [False, True])
@pytest.mark.parametrize("tolerance", [None, 1e-3])
def test_resistance_stated_error_holds_on_all_designs(unseen, tolerance):
    rows = compared(designs.FAMILIES, tolerance, unseen)
    assert_bounded(rows)
    if tolerance is None and not unseen:
        assert np.median([stated / error for *_, error, stated in rows]) < 10.0


@pytest.mark.slow
@pytest.mark.parametrize(("family", "number"), [("circle", 8), ("square", 8), ("racetrack", 1)])
def test_resistance_reference_is_reproduced(family, number):
    loss = designs.finer(*designs.design(family, number))
    again = [loss.resistance_ratio(frequency) for frequency in designs.FREQUENCIES]
    # a tenth of the least error of the usual solution
    assert again == approx(REFERENCES[family, number], rel=1e-4)
