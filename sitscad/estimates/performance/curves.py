"""What a data sheet draws: the converter's inductances over the loads, with the band that manufacture makes of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sitscad.estimates.performance.bench import Bench, Solved, bench_of, held_shear
from sitscad.estimates.performance.quick import quick_performance
from sitscad.estimates.performance.scatter import manufacturing_scatter
from sitscad.estimates.performance.units import readings_of, together
from sitscad.estimates.performance.values import AXES
from sitscad.estimates.response.model import ResponseModel
from sitscad.record import record
from sitscad.scene.state import REST

Array = NDArray[np.float64]

STEPS, LINES = 15, 9
"""Loads along a curve, and lines of constant load in the map of the working range."""


@record(eq=False)
class Curve:
    """One axis' course: forces (n; N), the normal force under it, every coil's inductance as the converter makes it
    (n, coils; H), and one sigma of it by manufacture since the tare.
    """

    axis: str
    normal: float
    forces: Array
    inductance: Array
    sigma: Array


@record(eq=False)
class Curves:
    """The courses of all axes that are told apart, shear at rest, half and full normal force; the places of the coils
    (coils, 2; m), and for every shear axis the inductances (normal, shear, coils; H) over the working range; the shear
    force (N) up to which the pad's law was `held` against finite elements: beyond, curves are extrapolated.
    """

    coils: tuple[str, ...]
    places: Array
    normal: Curve
    shears: tuple[Curve, ...]
    ranges: tuple[tuple[str, Array, Array, Array], ...]
    held: float


def curves(model: ResponseModel) -> Curves:
    """The curves of a design that `performance` has something to say of."""
    spec, estimates = model.spec, model.estimates
    bench = bench_of(spec, estimates, Solved(model).frequencies)
    full = bench.full["normal"]
    shears = [name for name in bench.names if name != "normal"]
    found = tuple(_curve(bench, model, name, normal) for name in shears for normal in (0.0, 0.5 * full, full))
    places = np.array([placement.centre for placement in spec.array.placements]) - np.array(spec.array.middle)
    return Curves(tuple(coil.name for coil in estimates.coils), places, _curve(bench, model, "normal", 0.0), found,
                  tuple(_range(bench, model, name) for name in shears), held_shear(spec))  # fmt: skip


def _loads(bench: Bench, axis: str, normal: float) -> Array:
    loads = np.zeros((STEPS, 3))
    loads[:, 0] = normal
    first = 0.0 if axis == "normal" else -1.0
    loads[:, AXES.index(axis)] = np.linspace(first, 1.0, STEPS) * bench.full[axis]
    return loads


def _curve(bench: Bench, model: ResponseModel, axis: str, normal: float) -> Curve:
    loads = _loads(bench, axis, normal)
    inductance = _inductance(model, bench.readings(bench.poses(loads)))
    return Curve(axis, normal, loads[:, AXES.index(axis)], inductance, 2.0 * inductance * _scatter(model, loads))


def _inductance(model: ResponseModel, readings: Array) -> Array:
    """What the converter's formula makes of readings (n, coils), with its own capacitor: 1 / (C omega^2)."""
    rest = [coil.states[REST].converter_inductance or coil.states[REST].inductance for coil in model.estimates.coils]
    return np.asarray(np.array(rest) * np.exp(-2.0 * readings))


def _scatter(model: ResponseModel, loads: Array) -> Array:
    """One sigma of the readings (n, coils) by manufacture, each cause by the quick method."""
    quick = quick_performance(model.layout, model.estimates)
    if quick is None:
        return np.zeros((len(loads), len(model.estimates.coils)))
    nominal = quick.bench.readings(quick.bench.poses(loads))
    apart = [
        [one - nominal for one in ways]
        for cause in manufacturing_scatter(model.spec, model.estimates)
        for ways in readings_of(quick.bench, cause, loads)
    ]
    return together(apart)


def _range(bench: Bench, model: ResponseModel, axis: str) -> tuple[str, Array, Array, Array]:
    # Normal and shear forces (N) of the grid, and the inductances over it.
    normal = np.linspace(0.0, bench.full["normal"], LINES)
    shear = np.linspace(-1.0, 1.0, LINES) * bench.full[axis]
    loads = np.zeros((LINES, LINES, 3))
    loads[:, :, 0] = normal[:, None]
    loads[:, :, AXES.index(axis)] = shear[None, :]
    readings = bench.readings(bench.poses(loads.reshape(-1, 3)))
    return axis, normal, shear, _inductance(model, readings).reshape(LINES, LINES, -1)
