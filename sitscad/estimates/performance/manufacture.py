"""By how much one unit of a design differs from the next, before it is calibrated: every cause with its sigma, and what
units that are so far off read by the map of the design.

What is simulated as a unit (errors by cause, calibration on simulated units) draws from this one list.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from sitscad.arrays import Array
from sitscad.data import is_unverified
from sitscad.estimates.performance.bench import Bench
from sitscad.estimates.performance.inversion import SolvedRange
from sitscad.estimates.states import pressing
from sitscad.estimates.uncertainty import CAPACITOR, Tolerance, sigmas, tolerances
from sitscad.estimates.values import Estimates
from sitscad.record import record
from sitscad.scene.bodies import lines_below_target
from sitscad.scene.column import WRITTEN, SizeTolerance, placement, plate_tolerance
from sitscad.scene.state import FREE
from sitscad.spec.sensor import SensorSpec

GLUE, OFFSET_X, OFFSET_Y = pressing.GLUE, "target beside, x", "target beside, y"
TILT_X, TILT_Y, YAW = "target tilted about x", "target tilted about y", "target turned"
THICKNESS, SIZE, MODULUS = "elastomer thickness", "elastomer size", "elastomer modulus"
INDUCTANCE, CLOCK = "coil inductance", "clock"

UNIT, COIL = "unit", "coil"  # What has a cause to itself: the assembled unit, or each of its coils


@record
class Scatter:
    """One cause: its standard deviation in `unit` (``m``, ``rad``; ``1`` is relative), what it is drawn for anew (a
    `per` of `UNIT` or `COIL`), where the figure comes from, and whether that source was seen.
    """

    name: str
    sigma: float
    unit: str
    per: str
    source: str
    verified: bool


def manufacturing_scatter(spec: SensorSpec, estimates: Estimates) -> tuple[Scatter, ...]:
    """What differs from unit to unit, as far as the sensor has the part; independent and of mean nothing.

    ``glue lines`` raise the target over the board without making the pad softer, as ``elastomer thickness`` does.
    ``target beside``, ``tilted`` and ``turned`` belong to rest, in the axes and signs of a pose. ``coil inductance`` is
    that of the bare coil with leads, capacitor and clock are what the tank and the converter have. Bands of tolerances
    count as evenly filled: sigma is half of them over the root of three (GUM 4.3.7).
    """
    return (*_places(spec), *_pad(spec), *_electrical(spec, estimates))


def _places(spec: SensorSpec) -> list[Scatter]:
    """How the place where the target is glued scatters."""
    target, assembly = spec.target, spec.assembly
    if target is None:
        return []
    placed, across = placement(assembly), min(target.size)
    found = [_even(name, placed.band, "m", placed) for name in (OFFSET_X, OFFSET_Y)]
    found.append(_even(YAW, 2.0 * placed.band / across, "rad", placed, f"of both ends, {1e3 * across:.3g} mm apart: "))
    if assembly.glue_tolerance:
        source = WRITTEN if assembly.adhesive is None else assembly.adhesive.source
        glue = SizeTolerance(assembly.glue_tolerance, source)
        lines = lines_below_target(spec)
        band = math.sqrt(lines) * glue.band
        found.append(_even(GLUE, band, "m", glue, f"{lines} line{'s' if lines > 1 else ''}: "))
        for name, length in ((TILT_X, target.size[1]), (TILT_Y, target.size[0])):
            found.append(_even(name, band / length, "rad", glue, f"lines thicker by it at one of two edges "
                                                                 f"{1e3 * length:.3g} mm apart: "))
    return found


def _pad(spec: SensorSpec) -> list[Scatter]:
    """How the pad scatters: thickness, size and modulus."""
    pad = spec.elastomer
    if pad is None:
        return []
    own, rows = spec.assembly.tolerance("elastomer"), tolerances()
    thickness = rows[THICKNESS] if own is None else Tolerance(own, WRITTEN, True)
    size = plate_tolerance(spec.assembly, "elastomer", min(pad.size))
    return [
        Scatter(THICKNESS, thickness.sigma, "m", UNIT, thickness.source, thickness.verified),
        _even(SIZE, size.band, "m", size),
        Scatter(MODULUS, pad.material.shear_modulus_sigma, "1", UNIT, pad.material.source, False),
    ]


def _electrical(spec: SensorSpec, estimates: Estimates) -> list[Scatter]:
    """How inductance, capacitor and clock scatter, relative, one sigma."""
    found, limits = [], spec.readout.device.limits
    spreads = [coil.states[FREE].spread for coil in estimates.coils if FREE in coil.states]
    relative = [
        spread.inductance / coil.states[FREE].inductance
        for coil, spread in zip(estimates.coils, spreads, strict=False)
        if spread is not None
    ]
    if relative:
        cause = next(spread.causes["inductance"] for spread in spreads if spread is not None)
        found.append(Scatter(INDUCTANCE, max(relative), "1", COIL, f"tolerances of the board, mostly of the {cause} "
                                                                   "(data/tolerances.csv)", False))
    row = limits["capacitor_tolerance"]
    found.append(Scatter(CAPACITOR, sigmas(spec)[CAPACITOR], "1", COIL, row.source, row.verified))
    row = limits["clock_tolerance"]
    found.append(Scatter(CLOCK, row.value / math.sqrt(3.0), "1", UNIT, row.source, row.verified))
    return found


def _even(name: str, band: float, unit: str, tolerance: SizeTolerance, how: str = "") -> Scatter:
    seen = not is_unverified(tolerance.source)
    return Scatter(name, band / math.sqrt(3.0), unit, UNIT, how + tolerance.source, seen)


RAISED = {OFFSET_X: 0, OFFSET_Y: 1, GLUE: 2, TILT_X: 3, TILT_Y: 4, YAW: 5}
"""Which number of the pose at rest a cause moves."""


CANCEL = (CAPACITOR, CLOCK)
"""Causes that leave the ratio of a frequency to its tare as it was (tests/estimates/test_performance.py)."""


@record(eq=False)
class Units:
    """Errors (N) of one unit a cause that is off by one sigma, (loads, axes) by cause: as the design's map reads it
    after its own tare, and after gains and cross gains were fitted at those `loads` (3; N), too.
    """

    loads: Array
    before: Mapping[str, Array]
    after: Mapping[str, Array]

    def at(self, share: float, normal: float, is_calibrated: bool) -> Array:
        """One sigma (N) of all causes together at a share of full normal force (N), of every axis."""
        found = self.after if is_calibrated else self.before
        each = [self._near(error, share, normal) for error in found.values()]
        return np.asarray(np.sqrt(np.sum(np.square(each), axis=0)))

    def by_modulus(self, share: float, normal: float) -> Array:
        """The part of the pad's modulus in what `at` gives before a calibration (N), of every axis."""
        return self._near(self.before[MODULUS], share, normal)

    def _near(self, error: Array, share: float, normal: float) -> Array:
        near = np.argmin(np.abs(self.loads[:, 0] - share * normal))
        same = np.abs(self.loads[:, 0] - self.loads[near, 0]) < 1e-9
        return np.asarray(np.sqrt(np.mean(error[same] ** 2, axis=0)))


def units_of(working: SolvedRange, causes: tuple[Scatter, ...]) -> Units:
    """One unit for every cause of manufacture that moves what is read after a tare; clocks cancel in it."""
    bench = working.bench
    # nothing, half and full on the normal axis, to both sides on the others
    lines = [(0.0, 0.5, 1.0) if name == "normal" else (-1.0, 1.0) for name in bench.range.axes]
    loads = bench.range.loads(list(product(*lines)))
    true = loads[:, bench.range.columns]
    scaled = true / bench.range.full_scales

    def calibrated(error: Array) -> Array:
        """What is left once the straight part of the errors is taken away."""
        return np.asarray(error - scaled @ np.linalg.lstsq(scaled, error, rcond=None)[0])

    before: dict[str, Array] = {}
    after: dict[str, Array] = {}
    for cause in causes:
        ways = [[working.map(reading) - true for reading in each] for each in readings_of(bench, cause, loads)]
        if ways:
            before[cause.name] = root_sum_of_mean_squares(ways)
            after[cause.name] = root_sum_of_mean_squares([[calibrated(error) for error in each] for each in ways])
    return Units(loads, before, after)


def root_sum_of_mean_squares(ways: Sequence[Sequence[Array]]) -> Array:
    """One sigma of what differs independently (outer), each one way or the other (inner)."""
    return np.asarray(np.sqrt(sum(np.mean(np.square(each), axis=0) for each in ways)))


def readings_of(bench: Bench, cause: Scatter, loads: Array) -> list[list[Array]]:
    """What units read that are off by one sigma of a cause: one, or one for every coil that has it to itself; each one
    way, or both where they are far from alike.
    """
    if cause.name in CANCEL:
        return []
    if cause.per == COIL:  # a winding that is larger by a share changes by that much less of itself
        nominal = bench.readings(bench.poses(loads))
        return [[nominal * (1.0 - cause.sigma * one)] for one in np.eye(nominal.shape[1])]
    if cause.name == MODULUS:  # a third softer moves the target much farther than a third stiffer
        pads = [replace(bench.pad, shear_modulus=bench.pad.shear_modulus * math.exp(way * cause.sigma))
                for way in (1.0, -1.0)]
        return [[bench.readings(bench.poses(loads, each)) for each in pads]]
    moved, pad = np.zeros(6), bench.pad
    if cause.name in RAISED:
        moved[RAISED[cause.name]] = cause.sigma
    elif cause.name == THICKNESS:
        moved[2], pad = cause.sigma, replace(pad, thickness=pad.thickness + cause.sigma)
    elif cause.name == SIZE:
        pad = replace(pad, face=pressing.loaded_face(bench.spec, cause.sigma)[0])
    else:
        return []
    found = bench.frequencies(np.concatenate([moved[None], bench.poses(loads, pad) + moved]))
    return [[np.log(found[1:] / found[0])]]
