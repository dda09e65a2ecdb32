"""The winding's inductance: references, invariants, and that the bound of every method holds."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tolerance import approx
from windings import MM, UM, bench, coil, four_layers

from sitscad.kernels.electromagnetics.inductance.spirals import (
    Resolution,
    SpiralLayer,
    spiral_inductance_matrix,
    spiral_mutual_inductance,
)


def test_bench_coil_inductance_matches_reference():
    matrix = spiral_inductance_matrix(bench())
    assert matrix.sum() == approx(2.523424e-6, rel=5e-6)
    assert matrix[0, 0] == approx(0.649863e-6, rel=5e-6)


def test_layer_pair_inductances_are_in_correct_matrix_entries():
    layers = four_layers()
    matrix = spiral_inductance_matrix(layers)
    each = np.array([[spiral_mutual_inductance(a, b) for b in layers] for a in layers])
    assert matrix == approx(each, rel=2e-5)
    assert each == approx(each.T, rel=2e-5)


@pytest.mark.parametrize(("sense", "within"), [(1, 1e-9), (-1, 3e-6)])
def test_layer_inductance_equals_sum_of_outer_and_inner_turns(sense, within):
    """Layers of different numbers of turns: exact, for Neumann's integral is one over the other layer's parts."""
    first = SpiralLayer(2e-3, 160e-6, 7.3, 0.4, 1, True, 0.0, 80e-6, 18e-6)
    second = SpiralLayer(2e-3, 160e-6, 5.6, 1.9, sense, sense < 0, -50e-6, 80e-6, 18e-6)
    outer = replace(second, turns=2.35)
    inner = replace(second, turns=5.6 - 2.35, radius=outer.inner_radius, angle=second.angle + sense * outer.span)
    parts = spiral_mutual_inductance(first, outer) + spiral_mutual_inductance(first, inner)
    whole = spiral_mutual_inductance(first, second)
    assert parts == approx(whole, rel=within)
    assert spiral_mutual_inductance(second, first) == approx(whole, rel=1e-9)


def test_pairs_of_layers_with_different_turns_are_in_correct_entries():
    layers = [replace(layer, turns=turns) for layer, turns in zip(four_layers(), (7.75, 6.5, 5.25, 6.5), strict=True)]
    each = np.array([[spiral_mutual_inductance(a, b) for b in layers] for a in layers])
    assert spiral_inductance_matrix(layers) == approx(each, rel=2e-5)


designs = st.tuples(
    st.sampled_from([0.5, 0.75, 1.0, 1.3, 2.25, 3.5, 6.5, 12.0]),
    st.integers(1, 4),
    st.floats(0.2, 1.0),
    st.sampled_from([9, 18, 35, 70]),
)


def drawn(turns, layers, fill, copper):
    # tracks as wide as gaps; the inner radius stays above one track width
    pitch = fill * 1.9 * MM / (turns + 1.0)
    return coil(4 * MM, turns, pitch / 2, pitch / 2, [-60 * UM * k * (1 + copper / 60) for k in range(layers)],
                [copper * UM] * layers)


@settings(max_examples=25, deadline=None)
@given(designs)
def test_layer_inductance_matrix_is_symmetric_positive_definite(design):
    matrix = spiral_inductance_matrix(drawn(*design))
    assert matrix == approx(matrix.T, rel=1e-12)
    assert np.linalg.eigvalsh(matrix).min() > 0.0
    if design[0] >= 1.0:
        # half turns on opposite sides carry opposite currents; whole ones never do
        assert np.all(matrix > 0.0)


@settings(max_examples=15, deadline=None)
@given(designs, st.floats(1e-6, 1e3))
def test_spiral_inductance_scales_with_length(design, scale):
    layers = drawn(*design)
    fields = ("radius", "pitch", "z", "width", "thickness")
    from dataclasses import replace

    grown = [replace(layer, **{name: scale * getattr(layer, name) for name in fields}) for layer in layers]
    assert spiral_inductance_matrix(grown).sum() == approx(scale * spiral_inductance_matrix(layers).sum(), rel=1e-9)


@pytest.mark.parametrize("turn", [0.3, 2.0, -1.1])
def test_spiral_inductance_is_invariant_to_rotation_and_mirror(turn):
    plain = spiral_inductance_matrix(bench()).sum()
    assert spiral_inductance_matrix(bench(angle=turn)).sum() == approx(plain, rel=1e-9)
    assert spiral_inductance_matrix(bench(angle=turn, sense=-1)).sum() == approx(plain, rel=1e-9)


def test_spiral_inductance_converges_with_resolution():
    layers = four_layers()
    fine = spiral_inductance_matrix(layers, Resolution(40, 30, 4)).sum()
    errors = [abs(spiral_inductance_matrix(layers, Resolution(n, n, 3)).sum() / fine - 1.0) for n in (4, 8, 16)]
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 5e-6


def test_inductance_of_sixty_turns_agrees_with_fine_resolution():
    layers = coil(40 * MM, 60, 100 * UM, 200 * UM, (0.0, -435 * UM), (35 * UM, 35 * UM))
    fine = spiral_inductance_matrix(layers, Resolution(30, 24, 2)).sum()
    assert spiral_inductance_matrix(layers).sum() == approx(fine, rel=1e-5)


def test_single_turn_inductance_agrees_with_ring_formula():
    layer = coil(20 * MM, 1.0, 10 * UM, 1 * UM, (0.0,), (10 * UM,))
    radius = 10 * MM - 5 * UM
    ring = 4e-7 * math.pi * radius * (math.log(8 * radius / (0.44705 * 10 * UM)) - 2)
    assert spiral_inductance_matrix(layer).sum() == approx(ring, rel=2e-3)
