"""Windings close to metal against filaments that see their images, and what was read before the modes did.

The states of a jaw are a fraction of a millimetre from metal. There the reflection of an even current plus the crowding
in free air is wrong: by half of what is left of the inductance for a wide track at a tenth of a millimetre, and by 5 to
25 % of the resistance for ordinary coils.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from half_space_reference import RingFilaments
from reflected import reflected_impedance
from tolerance import approx
from windings import MM, UM, coil, four_layers

from sitscad.kernels.electromagnetics.inductance.filaments import PolylineTrack
from sitscad.kernels.electromagnetics.inductance.rings import radii_at
from sitscad.kernels.electromagnetics.inductance.spirals import spiral_inductance_matrix
from sitscad.kernels.electromagnetics.loss import proximity
from sitscad.kernels.electromagnetics.metal import near_metal
from sitscad.kernels.electromagnetics.metal.current_spectrum import spiral_spectrum
from sitscad.kernels.electromagnetics.metal.half_spaces import MetalLayer, Reflector
from sitscad.kernels.electromagnetics.metal.polyline_spectrum import polyline_spectrum
from tests.oracles.filament_tracks import track_mutual_inductance
from tests.oracles.losses import inductance_change

COPPER, STEEL = 58e6, 1.4e6

# layers, filaments across and through, azimuths
COILS = {
    "wide": (coil(10 * MM, 5, 500 * UM, 100 * UM, (0.0,), (35 * UM,)), (24, 2), 3),
    "crossing": (coil(5 * MM, 3.5, 300 * UM, 100 * UM, (0.0, -60 * UM), (18 * UM, 18 * UM)), (14, 2), 4),
    "narrow": (coil(4 * MM, 6, 100 * UM, 100 * UM, (0.0,), (18 * UM,)), (10, 3), 2),
    "three": (coil(3 * MM, 3, 150 * UM, 100 * UM, (0.0,), (35 * UM,)), (12, 3), 3),
}


@lru_cache
def filaments(name, cells):
    layers, _, count = COILS[name]
    found = []
    for k in range(count):
        radii = radii_at(layers, 2.0 * math.pi * (k + 0.5) / count)
        height = np.repeat([layer.z for layer in layers], [r.size for r in radii])
        found.append(RingFilaments(np.concatenate(radii), height, layers[0].width, layers[0].thickness, COPPER, *cells))
    return found


def by_filaments(name, gap, metal, frequency, cells=None):
    """Impedance (ohm) of the coil as rings, averaged over azimuths; `metal` is a conductivity, inf a perfect mirror."""
    layers, usual, count = COILS[name]
    wall = 0.5 * layers[0].thickness + gap
    total = 0j
    for rings in filaments(name, cells or usual):
        seen = rings.mirrored(wall) if math.isinf(metal) else rings.over_metal(wall, frequency, metal)
        total += rings.impedance(seen, frequency) / count
    return total


def by_modes(layers, gap, metal, frequency, tolerance=0.03, aware=True):
    """Impedance (ohm), inductance in free air (H); without `aware` the currents do not see the metal."""
    wall = 0.5 * layers[0].thickness + gap
    plate = Reflector(wall, (MetalLayer(1e30 if math.isinf(metal) else metal),))
    resolution = proximity.suited_resolution(layers, COPPER, tolerance)
    cuts = proximity.winding_cuts(tuple(layers), COPPER, resolution)
    loss = proximity.winding_loss(layers, COPPER, tolerance)
    free = float(spiral_inductance_matrix(layers).sum())
    change, added = reflected_impedance(spiral_spectrum(layers, wall), frequency, plate, None)
    omega = 2.0 * math.pi * frequency
    inductance = free + inductance_change(loss, frequency) + change
    z = loss.direct * loss.resistance_ratio(frequency) + added + 1j * omega * inductance
    if aware:
        crowding = near_metal.crowding_near_metal(cuts, COPPER, resolution.modes, wall)
        z += 1j * omega * crowding.change(frequency, plate, None)
    return z, free


METALS, GAPS = (math.inf, COPPER, STEEL), (0.05e-3, 0.1e-3, 0.3e-3, 1e-3)
CLOSE = [
    pytest.param(name, gap, metal, marks=pytest.mark.slow if (i + j + k) % 3 or i + j > 3 else ())
    for i, name in enumerate(COILS) for j, gap in enumerate(GAPS) for k, metal in enumerate(METALS)
]
"""Every coil with every gap and every metal. A sixth is tried each time, with each of these and the least gaps."""


@pytest.mark.needs("scipy")
@pytest.mark.parametrize(("name", "gap", "metal"), CLOSE)
def test_impedance_close_to_metal_agrees_with_filaments(name, gap, metal):
    for frequency in (1e5, 5e6):
        reference = by_filaments(name, gap, metal, frequency)
        ours, free = by_modes(COILS[name][0], gap, metal, frequency)
        omega = 2.0 * math.pi * frequency
        assert ours.imag / omega == approx(reference.imag / omega, abs=2.5e-3 * free)
        assert ours.real == approx(reference.real, rel=0.04 if gap < 0.2e-3 else 0.03)


@pytest.mark.more
@pytest.mark.slow
@pytest.mark.needs("scipy")
def test_near_metal_filaments_have_converged():
    for name, metal in (("wide", COPPER), ("three", STEEL)):
        coarse, fine = ((18, 2), (36, 4)) if name == "wide" else ((8, 2), (16, 4))
        item, other = (by_filaments(name, 0.1e-3, metal, 5e6, cells) for cells in (coarse, fine))
        assert item.real == approx(other.real, rel=0.015)
        assert item.imag == approx(other.imag, rel=0.01)


@pytest.mark.needs("scipy")
def test_crowding_without_metal_images_overestimates_resistance():
    # 10 mm, 5 turns of 0.5/0.1 mm, 0.1 mm from copper: 24 nH are left, 15 were read; and a quarter of the resistance
    layers = COILS["wide"][0]
    reference = by_filaments("wide", 0.1e-3, COPPER, 5e6)
    blind, _ = by_modes(layers, 0.1e-3, COPPER, 5e6, aware=False)
    aware, _ = by_modes(layers, 0.1e-3, COPPER, 5e6)
    assert blind.imag < 0.7 * reference.imag
    assert aware.imag == approx(reference.imag, rel=0.03)
    assert blind.real > 1.4 * reference.real
    blind, _ = by_modes(four_layers(), 0.3e-3, COPPER, 10e6, aware=False)
    aware, _ = by_modes(four_layers(), 0.3e-3, COPPER, 10e6)
    assert blind.real > 1.2 * aware.real


@pytest.mark.needs("scipy")
@pytest.mark.parametrize("frequency", [1e4, 1e6, 20e6])
def test_impedance_close_to_metal_agrees_at_all_frequencies(frequency):
    for name in ("three", "narrow"):
        reference = by_filaments(name, 0.1e-3, STEEL, frequency)
        ours, free = by_modes(COILS[name][0], 0.1e-3, STEEL, frequency, 0.01)
        assert ours.real == approx(reference.real, rel=0.02)
        assert ours.imag == approx(reference.imag, abs=2.0 * math.pi * frequency * 2e-3 * free)


def test_distant_metal_leaves_current_crowding_unchanged():
    layers = COILS["three"][0]
    resolution = proximity.suited_resolution(layers, COPPER, 0.03)
    cuts = proximity.winding_cuts(tuple(layers), COPPER, resolution)
    changes = []
    for gap in (0.3e-3, 1e-3, 3e-3, 10e-3):
        crowding = near_metal.crowding_near_metal(cuts, COPPER, resolution.modes, gap)
        changes.append(abs(crowding.change(5e6, Reflector(gap, (MetalLayer(COPPER),)), None)))
    assert np.all(np.diff(changes) < 0.0)
    assert changes[-1] < 1e-3 * changes[0]
    assert crowding.change(5e6, None, None) == 0.0


@pytest.mark.few(1)
@pytest.mark.parametrize("turns", [1.5, 1.0, 5.0])
def test_default_mode_subspace_agrees_with_all_modes(turns, monkeypatch):
    layers = coil(10 * MM, turns, 500 * UM, 100 * UM, (0.0,), (35 * UM,))
    resolution = proximity.suited_resolution(layers, COPPER, 0.03)
    cuts = proximity.winding_cuts(tuple(layers), COPPER, resolution)
    metal = Reflector(0.1e-3, (MetalLayer(COPPER),)), None
    usual = near_metal.crowding_near_metal(cuts, COPPER, resolution.modes, 0.1e-3).change(5e6, *metal)
    monkeypatch.setattr(near_metal, "STEPS", 60)
    everything = near_metal.crowding_near_metal(cuts, COPPER, resolution.modes, 0.1e-3).change(5e6, *metal)
    assert usual == approx(everything, rel=3e-3)


@pytest.mark.needs("scipy")
@pytest.mark.parametrize("frequency", [1e5, 5e6])
def test_impedance_between_metals_agrees_with_filaments(frequency):
    # copper above, steel below, and all their echoes
    layers, cells, count = COILS["crossing"]
    roof, floor = Reflector(0.2e-3, (MetalLayer(COPPER),)), Reflector(0.3e-3, (MetalLayer(STEEL),))
    reference = 0j
    for rings in filaments("crossing", cells):
        seen = rings.between_metals((0.2e-3, COPPER), (-0.3e-3, STEEL), frequency)
        reference += rings.impedance(seen, frequency) / count
    resolution = proximity.suited_resolution(layers, COPPER, 0.03)
    cuts = proximity.winding_cuts(tuple(layers), COPPER, resolution)
    loss = proximity.winding_loss(layers, COPPER, 0.03)
    free = float(spiral_inductance_matrix(layers).sum())
    change, added = reflected_impedance(spiral_spectrum(layers, 0.2e-3), frequency, roof, floor)
    more = near_metal.crowding_near_metal(cuts, COPPER, resolution.modes, 0.2e-3).change(frequency, roof, floor)
    omega = 2.0 * math.pi * frequency
    inductance = free + inductance_change(loss, frequency) + change + more.real
    resistance = loss.direct * loss.resistance_ratio(frequency) + added - omega * more.imag
    assert inductance == approx(reference.imag / omega, abs=2.5e-3 * free)
    assert resistance == approx(reference.real, rel=0.03)


def test_crowding_between_metals_is_symmetric_and_exceeds_one_side():
    # Symmetrical walls and a coil in the middle: either wall alone changes less than both, and sides may be swapped.
    layers = COILS["three"][0]
    resolution = proximity.suited_resolution(layers, COPPER, 0.03)
    cuts = proximity.winding_cuts(tuple(layers), COPPER, resolution)
    crowding = near_metal.crowding_near_metal(cuts, COPPER, resolution.modes, 0.2e-3)
    item, other = Reflector(0.2e-3, (MetalLayer(COPPER),)), Reflector(0.3e-3, (MetalLayer(STEEL),))
    assert crowding.change(5e6, item, other) == approx(crowding.change(5e6, other, item), rel=1e-6)
    assert abs(crowding.change(5e6, item, item)) > abs(crowding.change(5e6, item, None))


# layers, turns, width (um) and by how much of its value a change may differ: what the harmonics of ends and fractional
# turns add was missing (half a turn read 50 to 70 % low, one and a half 11 to 22 %, 6.5 turns 0.7 to 1.5 %), and the
# bend of wide tracks (0.4 %).
FRACTIONAL = [(1, 0.5, 100, 0.016), (1, 1.5, 100, 4e-3), (1, 2.25, 400, 3e-3), (1, 6.5, 400, 1e-3),
              (2, 2.25, 400, 1e-3), (3, 0.5, 100, 4e-3), (3, 1.5, 400, 1e-3), (3, 6.5, 100, 5e-4),
              (1, 12.0, 100, 1e-3)]


@pytest.mark.parametrize("gap", [0.1e-3, 0.5e-3, 2e-3])
@pytest.mark.parametrize(("count", "turns", "width", "tolerance"), FRACTIONAL)
def test_spiral_over_perfect_metal_agrees_with_image_spirals(count, turns, width, tolerance, gap):
    # Neumann's integral between the spirals and their mirror images: fractional turns, ends and slope included
    heights = tuple(-60 * UM * k for k in range(count))
    layers = coil(8 * MM, turns, width * UM, 100 * UM, heights, (18 * UM,) * count)
    images = [replace(layer, z=2.0 * gap - layer.z) for layer in layers]
    exact = -spiral_inductance_matrix([*layers, *images])[:count, count:].sum()
    ours, _ = reflected_impedance(spiral_spectrum(layers, gap), 5e6, Reflector(gap, (MetalLayer(1e30),)), None)
    assert ours == approx(exact, rel=tolerance)


def half_turns(count, half=1.5 * MM, pitch=200 * UM):
    """Corners of a square spiral of so many half turns."""
    points = [(-half, -half)]
    for m in range(2 * count):
        a, b = half - pitch * (m // 4), half - pitch * ((m + 1) // 4)
        points.append([(a, -a), (a, a), (-a, a), (-a, -b)][m % 4])
    return np.array(points)


@pytest.mark.parametrize("half_turn_count", [1, 3, 5, 12])
@pytest.mark.parametrize("gap", [0.1e-3, 1e-3])
def test_polygon_layers_over_perfect_metal_agree_with_image_layers(half_turn_count, gap):
    # The second layer turned by half a turn, as fractional turns leave it. It was taken for a copy of the first: a
    # half turn then read 33 % wrong, one and a half 5 %.
    corners = half_turns(half_turn_count)
    lines = [corners, (-corners if half_turn_count % 2 else corners * np.array([1.0, -1.0]))[::-1]]
    lines[1] = lines[1] if half_turn_count % 2 == 0 else -half_turns(half_turn_count)
    tracks = [PolylineTrack(c, 100 * UM, 18 * UM, z) for c, z in zip(lines, (0.0, -60 * UM), strict=True)]
    images = [PolylineTrack(t.corners, t.width, t.thickness, 2.0 * gap - t.z) for t in tracks]
    exact = -sum(track_mutual_inductance(a, b) for a in tracks for b in images)
    ours, _ = reflected_impedance(polyline_spectrum(tracks, gap), 5e6, Reflector(gap, (MetalLayer(1e30),)), None)
    assert ours == approx(exact, rel=6e-3)
    copies = [replace(tracks[0], z=t.z) for t in tracks]
    copied, _ = reflected_impedance(polyline_spectrum(copies, gap), 5e6, Reflector(gap, (MetalLayer(1e30),)), None)
    if half_turn_count == 1:
        assert abs(copied / exact - 1.0) > 0.2


@pytest.mark.parametrize("metal", [MetalLayer(COPPER, 1.0, 0.2e-3), MetalLayer(STEEL), MetalLayer(36e6, 1.0, 20e-6)])
@pytest.mark.parametrize("gap", [0.2e-3, 1.0e-3])
def test_one_mode_subspace_is_accurate_for_nearby_metal_distances(gap, metal):
    """It is that of a mirror up to an eighth nearer or farther: what it leaves out is as little as in its own."""
    layers = COILS["crossing"][0]
    resolution = proximity.suited_resolution(layers, COPPER, 0.03)
    cuts = proximity.winding_cuts(tuple(layers), COPPER, resolution)
    crowding = near_metal.crowding_near_metal(cuts, COPPER, resolution.modes, 0.1e-3)
    frequencies = np.array([1e6, 3e6, 1e7])
    for distance in gap * np.array([1.0, 1.03, 1.06]):
        crowding.changes(frequencies, Reflector(distance, (metal,)), None)
    assert len(crowding.known) <= 2
    around = Reflector(gap, (metal,))
    shared = crowding.changes(frequencies, around, None)
    middle = near_metal._WaveWeights(*(part[0] for part in crowding._waves(np.array([3e6]), around, None)))
    own, = near_metal._reduce_modes(crowding.cuts, [middle], True, crowding.steps)
    assert shared == approx(own.changes(frequencies, crowding._waves(frequencies, around, None)), rel=5e-4)
