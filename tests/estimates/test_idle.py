"""Idle neighbours: closed results for two loops, and what metal does to the coupling of two coils."""

from __future__ import annotations

import math

import numpy as np
import pytest
from neumann import sampled_mutual_inductance
from tolerance import approx

from sitscad.estimates import estimate
from sitscad.estimates.windings.neighbours import idle_coil_load, idle_neighbour_effect
from sitscad.kernels.electromagnetics.inductance.spirals import SpiralLayer
from sitscad.kernels.electromagnetics.metal.current_spectrum import spiral_spectrum
from sitscad.kernels.electromagnetics.metal.half_spaces import MetalLayer, Reflector, reflected_inductances
from sitscad.layout import lay_out
from sitscad.spec import presets
from sitscad.spec.load import load_text
from sitscad.spec.sensor import Cable, ReadoutSpec

ALONE = (2.5e-6, 4.0)
SEVEN = np.array([7e6])
"""Frequencies (Hz) come as arrays."""


def wired(cable):
    return ReadoutSpec(presets.converter("ldc1614"), None, "converter", None, cable, 40e6, 100.0)


def test_single_idle_neighbour_acts_as_loaded_secondary():
    mutual, omega = -80e-9, 2 * math.pi * 7e6
    circuits = [lambda f: ALONE, lambda f: ALONE]
    result = idle_neighbour_effect(0, circuits, lambda i, j, f: mutual, wired(None))(SEVEN)
    change, added = (float(part[0]) for part in result)
    loop = complex(4.0 + 20.0, omega * 2.5e-6)
    expected = (omega * mutual) ** 2 / loop
    assert (change * omega, added) == approx((expected.imag, expected.real), rel=1e-6)
    assert change < 0.0 < added
    assert change == approx(-(mutual**2) / 2.5e-6, rel=0.1)


def test_two_coupled_idle_neighbours_equal_closed_solution():
    omega = 2 * math.pi * 7e6
    matrix = np.array([[0, -80, -10], [-80, 0, -80], [-10, -80, 0]]) * 1e-9
    result = idle_neighbour_effect(1, [lambda f: ALONE] * 3, lambda i, j, f: matrix[i, j], wired(None))(SEVEN)
    loop = complex(24.0, omega * 2.5e-6)
    both = 2.0 * (omega * 80e-9) ** 2 / (loop + 1j * omega * -10e-9)
    assert (result[0][0] * omega, result[1][0]) == approx((both.imag, both.real), rel=1e-6)


def test_idle_coupling_at_several_frequencies_equals_separate_calls():
    matrix = np.array([[0, -80, -10], [-80, 0, -80], [-10, -80, 0]]) * 1e-9
    circuits = [lambda f: (2.5e-6 + 0.0 * f, 1e-3 * np.sqrt(f))] * 3
    idle = idle_neighbour_effect(
        0, circuits, lambda i, j, f: matrix[i, j] * (1 + 1j * 1e5 / f), wired(Cable(0.3, 180e-9, 3e-11, 1.0))
    )
    frequencies = np.array([1e6, 3e6, 9e6])
    together = np.array(idle(frequencies))
    assert together == approx(np.concatenate([idle(f) for f in frequencies[:, None]], axis=1), rel=1e-12)
    assert np.all(np.diff(together, axis=1) != 0.0)


def test_idle_load_consists_of_pins_and_cable():
    assert idle_coil_load(np.array([1e7]), wired(None))[0] == 20.0
    assert idle_coil_load(np.array([1e7]), wired(Cable(0.3, 180e-9, 30e-12, 0.3)))[0] == approx(20.3 + 1.8j, rel=1e-6)


def ring(radius, centre, height, count=240):
    """A ring as points and elements."""
    angle = 2 * np.pi * (np.arange(count) + 0.5) / count
    points = np.stack([centre + radius * np.cos(angle), radius * np.sin(angle), np.full(count, height)], axis=1)
    return points, np.stack([-np.sin(angle), np.cos(angle)], axis=1) * (2 * np.pi * radius / count)


def test_perfect_plate_adds_mutual_inductance_of_neighbour_image():
    width, gap, apart = 10e-6, 0.7e-3, 4.5e-3
    layer = SpiralLayer(2e-3, 10.001e-6, 1.0, 0.0, 1, True, 0.0, width, 1e-6)
    spectrum = spiral_spectrum([layer], gap)
    (found,) = reflected_inductances(spectrum, np.array([5e6]), Reflector(gap, (MetalLayer(1e18),)), None, (0.0, apart))
    image = -sampled_mutual_inductance(ring(1.995e-3, 0.0, 0.0), ring(1.995e-3, apart, 2 * gap))
    assert found[1].real == approx(image, rel=2e-2)
    assert found[0].real < 0.0 < found[1].real


@pytest.mark.slow
def test_idle_neighbour_lowers_rest_inductance_but_not_free_inductance():
    text = """
sitscad: 1
name: two
coil: {shape: circle, outer_diameter: 4.0, turns: 7.75, layers: 4, trace_width: 80 um, trace_spacing: 80 um}
array: {pattern: line, count: COUNT, pitch: 4.1}
fpc: {stackup: flex-4l, rules: generic-fine}
target: {shape: rectangle, size: [40, 30], thickness: 0.2, material: copper}
elastomer: {material: dragon-skin-10, shape: rectangle, size: [40, 30], thickness: 3, kerf: 0.15}
readout: {device: ldc1614, capacitance: 220 pF}
"""
    item = estimate(lay_out(load_text(text.replace("count: COUNT, pitch: 4.1", "count: 1").replace("line", "single")
                                     .replace(", count: 1", ""), "one.yaml")))
    two = estimate(lay_out(load_text(text.replace("COUNT", "2"), "two.yaml")))
    share = (two.inductance_matrix[0][1] / two.inductance_matrix[0][0]) ** 2
    free = [e.coils[0].states["free"].inductance - e.coils[0].lead_inductance for e in (item, two)]
    rest = [e.coils[0].states["rest"].inductance - e.coils[0].lead_inductance for e in (item, two)]
    assert free[1] == approx(free[0], rel=2e-4)
    assert 1.0 - rest[1] / rest[0] == approx(share, rel=0.3)
