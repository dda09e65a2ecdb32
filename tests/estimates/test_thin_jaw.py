"""The jaw is as thick as it is, with air behind it: against Dodd and Deeds's integral for rings over a plate."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from reflected import reflected_impedance
from scipy.special import j1
from tolerance import approx

from sitscad.estimates import estimate
from sitscad.estimates.targets.assembly import assemble, metal_behind
from sitscad.estimates.windings.methods import metal_spectrum, winding_geometry
from sitscad.kernels.electromagnetics.constants import MU0, skin_depth
from sitscad.layout import lay_out
from sitscad.spec.load import load_text

TEXT = """
sitscad: 1
name: thin-jaw
coil: {shape: circle, outer_diameter: 4, turns: 8, layers: 1, trace_width: 0.1, trace_spacing: 0.1}
fpc: {stackup: flex-2l-35um}
mount: {standoff: 0.5}
readout: {capacitance: 470 pF}
"""

FREQUENCY, STEEL = 5e6, 1.389e6
WIDTH = 0.1e-3


def jaw(height, conductivity=STEEL, permeability=1.0):
    """The coil over a jaw so thick (m)."""
    spec = load_text(TEXT, "thin_jaw.yaml")
    metal = replace(spec.mount.jaw.material, conductivity=conductivity, relative_permeability=permeability)
    return replace(spec, mount=replace(spec.mount, jaw=replace(spec.mount.jaw, height=height, material=metal)))


def by_dodd_and_deeds(radii, height, thickness, conductivity, permeability):
    """Change of inductance (H) and resistance (ohm) of rings (m) at a height (m) over a plate in air:
    the integral over k, with the plate's factor in closed form.
    """
    k = (np.arange(60_000) + 0.5) * 2.0
    alpha = np.sqrt(k**2 + 2j * math.pi * FREQUENCY * MU0 * permeability * conductivity)
    lost, own = np.exp(-2.0 * alpha * thickness), permeability * k
    factor = (own**2 - alpha**2) * (1.0 - lost) / ((own + alpha) ** 2 - (own - alpha) ** 2 * lost)
    waves = (np.sinc(k * WIDTH / (2.0 * math.pi)) * np.sum(radii[:, None] * j1(k * radii[:, None]), axis=0)) ** 2
    change = MU0 * math.pi * 2.0 * np.sum(waves * factor * np.exp(-2.0 * k * height))
    return change.real, -2.0 * math.pi * FREQUENCY * change.imag


@pytest.mark.parametrize("depths", [0.1, 0.3, 1.0, 2.0, 3.0, 5.0, 20.0])
@pytest.mark.parametrize("permeability", [1.0, 50.0])
def test_change_by_jaw_of_any_thickness_equals_dodd_deeds_integral(depths, permeability):
    thickness = depths * skin_depth(FREQUENCY, STEEL, permeability)
    spec = jaw(thickness, permeability=permeability)
    coil, (_, around) = lay_out(spec).coils[0], assemble(spec).states
    spectrum = metal_spectrum(winding_geometry(spec.coil, coil), around.below.distance, is_rough=True)  # as rings
    result = reflected_impedance(spectrum, FREQUENCY, None, around.below)
    radii = 0.5 * (4e-3 - WIDTH) - 2.0 * WIDTH * (np.arange(8) + 0.5)
    height = around.below.distance + coil.windings[0].z
    true, mirror = (by_dodd_and_deeds(radii, height, thickness, at, 1.0 if at > STEEL else permeability)
                    for at in (STEEL, 1e15))
    assert result[0] == approx(true[0], rel=5e-4, abs=2e-4 * abs(mirror[0]))
    assert result[1] == approx(true[1], rel=5e-4)


def test_thick_jaw_equals_half_space():
    """Twenty skin depths and more: no figure may move."""
    plain = estimate(lay_out(jaw(0.02))).coils[0].states["rest"]
    thick = estimate(lay_out(jaw(0.01))).coils[0].states["rest"]
    assert (thick.inductance, thick.resistance) == (plain.inductance, plain.resistance)


def test_thin_poor_conductor_differs_from_deep_one():
    """0.3 mm of 0.1 MS/m are half a skin depth there, and were taken as endlessly deep."""
    thin, deep = (estimate(lay_out(jaw(height, 0.1e6))).coils[0].states["rest"] for height in (0.3e-3, 20e-3))
    assert abs(thin.resistance / deep.resistance - 1.0) > 0.1


def test_metal_finger_thickness_equals_its_height():
    finger = "{kind: fingertip, standoff: 0.5, finger: {size: [16, 10], material: brass}}"
    (plate,) = metal_behind(load_text(TEXT.replace("{standoff: 0.5}", finger), "finger.yaml")).plates
    assert plate.thickness == approx(10e-3, rel=1e-9)
