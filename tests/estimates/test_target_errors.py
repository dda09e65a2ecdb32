"""The stated errors of a target's shares go on without a jump while its size, thickness, gap and metal do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tolerance import approx

from sitscad.estimates.targets import finite_target
from sitscad.kernels.electromagnetics.metal.finite_plate import (
    EASED,
    CoaxialRings,
    FinitePlate,
    error_with_transition,
    loss_ratio_error,
    magnetic_ratio_error,
    ratio_error,
)
from sitscad.spec.load import load_text

TEXT = """
sitscad: 1
name: errors
coil: {shape: circle, outer_diameter: 6, turns: 8, layers: 2, trace_width: 100 um, trace_spacing: 100 um}
target: {shape: square, size: 6, thickness: 0.2, material: copper}
"""
RINGS = CoaxialRings(np.linspace(1.5e-3, 2.95e-3, 8), np.zeros(8), np.ones(8))
METALS = {
    "copper": (58e6, 1.0), "aluminium": (36e6, 1.0), "titanium": (0.6e6, 1.0), "stainless": (1.4e6, 1.05),
    "magnetic steel": (1.3e6, 95.0), "mild steel": (6e6, 300.0), "ferrite": (1e-2, 120.0),
}


def targets(metal, shape, quantity):
    """501 targets from small to large in one quantity, each with its gap (m)."""
    spec = load_text(TEXT, "errors.yaml").target
    conductivity, permeability = METALS[metal]
    for part in np.linspace(0.0, 1.0, 501):
        size, thickness, gap, sigma = 5e-3, 0.3e-3, 1e-3, conductivity
        if quantity == "size":
            size = 0.8e-3 + 16e-3 * part
        elif quantity == "thickness":
            thickness = 0.01e-3 * 400.0**part
        elif quantity == "gap":
            gap = 0.2e-3 + 4e-3 * part
        else:
            sigma = conductivity * 0.1 * 100.0**part
        material = replace(spec.material, conductivity=sigma, relative_permeability=permeability)
        yield replace(spec, shape=shape, size=(size, size), thickness=thickness, material=material), gap


@pytest.mark.parametrize("quantity", ["size", "thickness", "gap", "conductivity"])
@pytest.mark.parametrize("shape", ["circle", "rectangle"])
@pytest.mark.parametrize("metal", METALS)
def test_target_ratio_errors_change_continuously(metal, shape, quantity, monkeypatch):
    """The shares' own values, which are smooth, are held here: the errors alone are looked at."""
    monkeypatch.setattr(finite_target, "plate_ratio", lambda *_: np.array([0.8]))
    monkeypatch.setattr(finite_target, "plate_loss_ratio", lambda *_: np.array([0.7]))
    monkeypatch.setattr(finite_target, "magnetic_ratio", lambda *_: np.array([0.5]))
    places = np.zeros((1, 2))
    sweep = targets(metal, shape, quantity)
    result = [finite_target.target_sheet_ratios(target, RINGS, places, gap, -np.inf) for target, gap in sweep]
    for values in ([item.error for item in result], [item.loss_error for item in result]):
        steps = np.abs(np.diff(values))
        beside = np.maximum(np.r_[0.0, steps[:-1]], np.r_[steps[1:], 0.0])
        assert np.all(steps <= 4.0 * beside + 4e-3 * np.array(values[1:])), (metal, shape, quantity, steps.max())


def stepped_share_error(thick, wide):
    """The errors as they were compared: nowhere may less be stated."""
    if wide < 0.35:
        return 0.25 if wide >= 0.24 else 0.9
    if wide < 0.6:
        return 0.05 if thick <= 0.03 else 0.12
    return 0.03 if thick <= 0.055 else 0.05


def stepped_loss_error(thick, wide):
    """The same of the loss."""
    if wide < 0.6:
        return 0.4 if wide >= 0.2 else 0.5
    return 0.15 if thick <= 0.03 else 0.2


def test_smooth_errors_are_never_below_stepped_errors():
    diameter = 2.0 * float(RINGS.radii.max())
    for wide in np.geomspace(0.1, 3.0, 60):
        for thick in np.geomspace(2e-3, 0.3, 40):
            plate = FinitePlate((wide * diameter,) * 2, thick * diameter, is_round=True)
            for ours, known in ((ratio_error, stepped_share_error), (loss_ratio_error, stepped_loss_error)):
                stated, least = ours(plate, RINGS), known(thick, wide)
                if wide >= 0.6 and 0.055 < thick < 0.055 * EASED:
                    # discs and boxes of this thickness are within it: what they need grows with the thickness
                    least = min(least, known(0.05, wide))
                assert stated >= least - 1e-12
                if wide > 0.6 * EASED and not 0.03 / EASED < thick < 0.055 * EASED:
                    assert stated == approx(least, rel=1e-6)
            ratio = 0.1 if wide >= 1.45 else 0.22 if wide >= 0.95 else 0.6 if wide >= 0.2 else 0.9
            assert magnetic_ratio_error(plate, RINGS) >= ratio - 1e-12


def test_eased_error_reaches_its_end_values():
    assert error_with_transition(0.6, 0.6, 0.12, 0.03) == 0.12
    assert error_with_transition(0.6 * EASED, 0.6, 0.12, 0.03) == approx(0.03, rel=1e-6)
    assert 0.03 < error_with_transition(0.7, 0.6, 0.12, 0.03) < 0.12
