"""Modes of many tracks: full blocks of neighbours and the lowest modes of far tracks are as good as all of them."""

from __future__ import annotations

import numpy as np
import pytest
from tolerance import approx
from windings import coil

from sitscad.kernels.electromagnetics.loss import mode_matrix, proximity
from sitscad.kernels.electromagnetics.loss.mode_matrix import NearAndFar
from sitscad.kernels.electromagnetics.loss.track_modes import Cut, ModeSet
from sitscad.kernels.electromagnetics.metal.half_spaces import MetalLayer, Reflector
from sitscad.kernels.electromagnetics.metal.near_metal import crowding_near_metal

COPPER = 58e6
UM = 1e-6
REST = ("height", "width", "thickness", "length", "curvature")


def rows(count, thickness=35 * UM):
    """Two layers of tracks of 100 um, 200 um apart."""
    across = np.tile(1e-3 + 200 * UM * np.arange(count // 2), 2)
    height = np.repeat([0.0, -60 * UM], count // 2)
    item = np.ones(count)
    return Cut(across, height, 100 * UM * item, thickness * item, item, 1.0 / across)


def blocks_of(matrix):
    return sum(group.neighbours.shape[1] for group in matrix.near)


def pairs_of(matrix):
    return sum(int(np.sum(group.neighbours < len(matrix.scale))) for group in matrix.near)


@pytest.mark.parametrize("thickness", [9 * UM, 100 * UM])
def test_sparse_mode_matrix_products_agree_with_full_matrix(monkeypatch, thickness):
    cut, modes = rows(80, thickness), ModeSet(6, 2, (7, 3))
    sparse = mode_matrix.mode_matrix(cut, COPPER, modes)
    assert isinstance(sparse, NearAndFar)
    monkeypatch.setattr(mode_matrix, "MANY", 1000)
    full = mode_matrix.mode_matrix(cut, COPPER, modes)
    size = 3 * len(modes.orders)
    # of the first three tracks: their own blocks to the last mode, all others within what far tracks may lack
    result = sparse @ np.eye(full.shape[0])[:, :size]
    assert np.abs(result - full[:, :size]).max() < 3e-4 * np.diagonal(full).max()
    assert result[:size] == approx(full[:size, :size], rel=1e-12, abs=1e-20)
    item, other = np.random.default_rng(1).normal(size=(2, full.shape[0]))
    assert item @ (sparse @ other) == approx(other @ (sparse @ item), rel=1e-5)
    assert sparse @ item == approx(full @ item, abs=1e-3 * np.abs(full @ item).max())


def test_pairs_with_equal_offsets_share_one_block(monkeypatch):
    """As good as every pair with a block of its own, and unevenly spaced tracks have just that."""
    cut, modes = rows(80), ModeSet(6, 2, (7, 3))
    vector = np.random.default_rng(2).normal(size=(80 * len(modes.orders), 3))
    shared = mode_matrix.mode_matrix(cut, COPPER, modes)
    assert blocks_of(shared) < 0.1 * pairs_of(shared)
    monkeypatch.setattr(mode_matrix, "REPEATED", 1e9)
    alone = mode_matrix.mode_matrix(cut, COPPER, modes)
    assert blocks_of(alone) == pairs_of(alone) == pairs_of(shared)
    assert shared @ vector == approx(alone @ vector, rel=1e-9, abs=1e-18)
    monkeypatch.undo()
    uneven = Cut(cut.across * (1.0 + 0.01 * np.sin(np.arange(80.0))), *[getattr(cut, name) for name in REST])
    matrix = mode_matrix.mode_matrix(uneven, COPPER, modes)
    assert blocks_of(matrix) == pairs_of(matrix)


def test_sparse_mode_matrix_needs_less_than_30_percent_memory():
    matrix = mode_matrix.mode_matrix(rows(400), COPPER, ModeSet(6, 2, (7, 3)))
    room = sum(group.blocks.nbytes + group.neighbours.nbytes for group in matrix.near) + matrix.far.nbytes
    assert room < 0.3 * 8 * matrix.scale.size**2


def test_losses_by_sparse_matrix_agree_with_full_matrix(monkeypatch):
    layers = tuple(coil(30e-3, 35, 200 * UM, 60 * UM, [0.0, -60 * UM], [35 * UM] * 2))
    frequencies = np.array([1e5, 1e6, 1e7])
    wall = Reflector(100 * UM, (MetalLayer(COPPER),))
    result = []
    for many in (60, 1000):
        monkeypatch.setattr(mode_matrix, "MANY", many)
        proximity.winding_cuts.cache_clear()
        resolution = proximity.suited_resolution(layers, COPPER, 0.03)
        cuts = proximity.winding_cuts(layers, COPPER, resolution)
        assert isinstance(cuts[0].system.matrix, NearAndFar) == (many == 60)
        loss = proximity.winding_loss(layers, COPPER)
        near = crowding_near_metal(cuts, COPPER, resolution.modes, 100 * UM).changes(frequencies, wall, None)
        result.append((loss.resistance_ratios(frequencies), loss.inductance_changes(frequencies), near))
    proximity.winding_cuts.cache_clear()
    for some, all_modes in zip(*result, strict=True):
        assert np.abs(some / all_modes - 1.0).max() < 3e-4
