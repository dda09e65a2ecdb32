"""Curves of a data sheet: the converter's inductances as functions of the load, with their manufacturing bands."""

from __future__ import annotations

import numpy as np

from sitscad.assembly.places.state import REST
from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.estimates.coil_estimates import CoilEstimate
from sitscad.estimates.loads.working_range import validated_shear
from sitscad.estimates.performance.points import SensingAnalysis
from sitscad.estimates.performance.unit_errors import perturbed_readings, root_sum_of_mean_squares
from sitscad.estimates.performance_values import loads_on_axis
from sitscad.estimates.tolerances.scatter import manufacturing_scatter
from sitscad.kernels.electromagnetics.threads import one_thread

STEPS, LINES = 15, 9  # Loads along a curve, and lines of constant load in the map of the working range


@record(eq=False)
class Curve:
    """Curve of one axis: inductances of all coils as functions of the load on this axis.

    `forces` (n) are in N, or in N m for a moment. `normal` (N) is the normal force that acts at the same time.
    `inductance` (n, coils; H) is by the converter's formula. `sigma` (n, coils; H) is its standard deviation by
    manufacture since the tare.
    """

    axis: str
    """Name of the axis of load."""
    normal: float
    forces: Array
    inductance: Array
    sigma: Array


@record(eq=False)
class Curves:
    """Curves of all measured axes. Axes other than normal have curves at rest, half and full normal force.

    `places` (coils, 2; m) are the coils' centres. `ranges` holds a tuple for each axis other than normal: its name, the
    normal forces (N), the loads on the axis (N, N m), and the inductances (normal, load, coils; H). `validated_shear`
    (N) is the shear force up to which the pad's law was tested with finite elements. Beyond this force, curves are
    extrapolated.
    """

    coils: tuple[str, ...]
    places: Array
    normal: Curve
    """Curve of the normal axis."""
    shears: tuple[Curve, ...]
    """Curves of the other axes, each at rest, half and full normal force."""
    ranges: tuple[tuple[str, Array, Array, Array], ...]
    validated_shear: float


@one_thread
def curves(sensing: SensingAnalysis) -> Curves:
    """Return the curves of a design, with bands of one sigma by all manufacturing causes."""
    spec, estimates, bench = sensing.bench.spec, sensing.estimates, sensing.bench
    full = bench.full_scales["normal"]
    shears = [name for name in bench.range.axes if name != "normal"]  # and moments
    shear_curves = tuple(_curve(sensing, name, normal) for name in shears for normal in (0.0, 0.5 * full, full))
    places = np.array([placement.centre for placement in spec.array.placements]) - np.array(spec.array.middle)
    return Curves(tuple(coil.name for coil in estimates.coils), places, _curve(sensing, "normal", 0.0), shear_curves,
                  tuple(_range(sensing, name) for name in shears), validated_shear(spec))


def _curve(sensing: SensingAnalysis, axis: str, normal: float) -> Curve:
    forces = np.linspace(0.0 if axis == "normal" else -1.0, 1.0, STEPS) * sensing.bench.full_scales[axis]
    loads = loads_on_axis(sensing.bench.range.normal_load(normal), axis, forces)
    inductance = _inductance(sensing.estimates.coils, sensing.working.read(loads))
    nominal = sensing.bench.readings(sensing.bench.poses(loads))
    sigma = root_sum_of_mean_squares([  # of the readings, by manufacture
        [reading - nominal for reading in readings]
        for cause in manufacturing_scatter(sensing.layout.spec, sensing.estimates.coils)
        for readings in perturbed_readings(sensing.bench, cause, loads)
    ])
    return Curve(axis, normal, forces, inductance, 2.0 * inductance * sigma)


def _inductance(coils: tuple[CoilEstimate, ...], readings: Array) -> Array:
    """Return inductances (n, coils; H) from readings (n, coils), by the converter's formula 1 / (C omega^2).

    C is the capacitance of the tank without the coil's own.
    """
    rest = [coil.states[REST].converter_inductance or coil.states[REST].inductance for coil in coils]
    return np.asarray(np.array(rest) * np.exp(-2.0 * readings))


def _range(sensing: SensingAnalysis, axis: str) -> tuple[str, Array, Array, Array]:
    # Normal and shear forces (N) of the grid, and the inductances over it.
    normal = np.linspace(0.0, sensing.bench.full_scales["normal"], LINES)
    shear = np.linspace(-1.0, 1.0, LINES) * sensing.bench.full_scales[axis]
    loads = np.concatenate([
        loads_on_axis(sensing.bench.range.normal_load(float(force)), axis, shear) for force in normal])
    inductance = _inductance(sensing.estimates.coils, sensing.working.read(loads))
    return axis, normal, shear, inductance.reshape(LINES, LINES, -1)
