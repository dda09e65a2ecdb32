"""Neumann's sum by clusters against the sum over every pair of points."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tolerance import approx

from sitscad.kernels.electromagnetics.inductance import clusters
from sitscad.kernels.electromagnetics.inductance.clusters import Plans, neumann_sum

MM = 1e-3


@pytest.fixture(autouse=True)
def small_clusters(monkeypatch):
    monkeypatch.setattr(clusters, "LEAF", 40)


def rings(turns, layers, points=60, plans=2):
    """Concentric rings on layers, their plans by turns shifted and wound in the same sense."""
    angle = 2 * math.pi * np.arange(points) / points
    places, elements, owner = [], [], []
    for plan in range(plans):
        for k in range(turns):
            radius, centre = (1.0 + 0.2 * k) * MM, np.array([0.03 * plan, -0.02 * plan]) * MM
            outward = np.stack([np.cos(angle), np.sin(angle)], axis=1)
            places.append(centre + radius * outward)
            elements.append(radius * 2 * math.pi / points * np.stack([-outward[:, 1], outward[:, 0]], axis=1))
            owner.append(np.full(points, plan))
    stack = tuple((k % plans, -70e-6 * k, (18e-6, 35e-6)[k in (0, layers - 1)]) for k in range(layers))
    return Plans(np.concatenate(places), np.concatenate(elements), np.concatenate(owner), stack)


def moved(plans, *step):
    return Plans(plans.places + np.array(step), plans.elements, plans.owner, plans.layers)


def directly(first, second):
    total = 0.0
    away = first.places[:, None] - second.places
    square = np.sum(away * away, axis=2)
    dot = first.elements @ second.elements.T
    for a, z, thickness in first.layers:
        for b, other, other_thickness in second.layers:
            pairs = np.ix_(first.owner == a, second.owner == b)
            spread = math.sqrt((thickness**2 + other_thickness**2) / 12)
            for height in (abs(z - other) - spread, abs(z - other) + spread):
                total += 0.5 * np.sum(dot[pairs] / np.sqrt(square[pairs] + height * height))
    return total


@pytest.mark.parametrize("layers", [1, 2, 8])
@pytest.mark.parametrize("step", [(3.6 * MM, 0.0), (0.0, -3.6 * MM), (3.1 * MM, 3.3 * MM), (-40 * MM, 11 * MM)])
def test_clustered_sum_equals_sum_over_all_pairs(step, layers):
    item = rings(4, layers, plans=min(layers, 2))
    other = moved(item, *step)
    assert neumann_sum(item, other) == approx(directly(item, other), rel=3e-7)


def test_clustered_sum_converges_with_interpolation_order(monkeypatch):
    item = rings(4, 4)
    other = moved(item, 3.6 * MM, 0.0)
    exact, errors = directly(item, other), []
    for order in (4, 6, 8, 10):
        monkeypatch.setattr(clusters, "ORDER", order)
        errors.append(abs(neumann_sum(item, other) / exact - 1))
    assert errors[0] > 20 * errors[2] > 0 and errors[3] < 1e-8


def test_clustered_sum_handles_coincident_and_collinear_points():
    count = clusters.LEAF + 50
    heap = Plans(np.zeros((count, 2)), np.full((count, 2), 1e-6), np.zeros(count, dtype=int), ((0, 0.0, 0.0),))
    line = Plans(np.stack([np.linspace(1, 3, count) * MM, np.zeros(count)], axis=1), heap.elements, heap.owner,
                 heap.layers)
    assert neumann_sum(heap, line) == approx(directly(heap, line), rel=1e-7)
    assert neumann_sum(line, heap) == approx(directly(heap, line), rel=1e-7)


def test_clustered_work_grows_linearly_with_points():
    """Eight times as many turns used to be 64 times the pairs."""
    seen = []
    for turns in (3, 24):
        item = rings(turns, 2, points=150)
        other = moved(item, 2.2 * (1.0 + 0.2 * turns) * MM, 0.0)
        pairs = clusters._pairs(clusters._whole_cluster(item), clusters._whole_cluster(other))
        seen.append(sum(len(a[0]) * len(b[0]) for a, b, _ in pairs))
    assert seen[1] < 8 * seen[0]
