"""By how much one unit of a design differs from the next, before it is calibrated: every cause with its sigma.

What is simulated as a unit (errors by cause, calibration on simulated units) draws from this one list.
"""

from __future__ import annotations

import math

from sitscad.data import is_unverified
from sitscad.estimates.states import pressing
from sitscad.estimates.uncertainty import CAPACITOR, Tolerance, sigmas, tolerances
from sitscad.estimates.values import Estimates
from sitscad.record import record
from sitscad.scene.bodies import lines_below_target
from sitscad.scene.column import WRITTEN, placement, plate_tolerance
from sitscad.scene.column import Tolerance as Band
from sitscad.scene.state import FREE
from sitscad.spec.sensor import SensorSpec

GLUE, OFFSET_X, OFFSET_Y = pressing.GLUE, "target beside, x", "target beside, y"
TILT_X, TILT_Y, YAW = "target tilted about x", "target tilted about y", "target turned"
THICKNESS, SIZE, MODULUS = "elastomer thickness", "elastomer size", "elastomer modulus"
INDUCTANCE, CLOCK = "coil inductance", "clock"

UNIT, COIL = "unit", "coil"
"""What has a cause to itself: the assembled unit, or each of its coils."""


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
    target = spec.target
    if target is None:
        return []
    found, placed = [], placement(spec)
    for name in (OFFSET_X, OFFSET_Y):
        found.append(_even(name, placed.band, "m", placed))
    across = min(target.size)
    found.append(_even(YAW, 2.0 * placed.band / across, "rad", placed, f"of both ends, {1e3 * across:.3g} mm apart: "))
    glue = _glue(spec)
    if glue is not None:
        lines = lines_below_target(spec)
        band = math.sqrt(lines) * glue.band
        found.append(_even(GLUE, band, "m", glue, f"{lines} line{'s' if lines > 1 else ''}: "))
        for name, length in ((TILT_X, target.size[1]), (TILT_Y, target.size[0])):
            found.append(_even(name, band / length, "rad", glue, f"lines thicker by it at one of two edges "
                                                                 f"{1e3 * length:.3g} mm apart: "))  # fmt: skip
    return found


def _glue(spec: SensorSpec) -> Band | None:
    assembly = spec.assembly
    if not assembly.glue_tolerance:
        return None
    return Band(assembly.glue_tolerance, assembly.adhesive.source if assembly.adhesive is not None else WRITTEN)


def _pad(spec: SensorSpec) -> list[Scatter]:
    """How the pad scatters: thickness, size and modulus."""
    pad = spec.elastomer
    if pad is None:
        return []
    own, rows = spec.assembly.tolerance("elastomer"), tolerances()
    thickness = rows[THICKNESS] if own is None else Tolerance(own, WRITTEN, True)
    size = plate_tolerance(spec, "elastomer", min(pad.size))
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
                                                                   "(data/tolerances.csv)", False))  # fmt: skip
    row = limits["capacitor_tolerance"]
    found.append(Scatter(CAPACITOR, sigmas(spec)[CAPACITOR], "1", COIL, row.source, row.verified))
    row = limits["clock_tolerance"]
    found.append(Scatter(CLOCK, row.value / math.sqrt(3.0), "1", UNIT, row.source, row.verified))
    return found


def _even(name: str, band: float, unit: str, tolerance: Band, how: str = "") -> Scatter:
    seen = not is_unverified(tolerance.source)
    return Scatter(name, band / math.sqrt(3.0), unit, UNIT, how + tolerance.source, seen)
