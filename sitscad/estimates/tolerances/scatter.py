"""Causes of differences between units of a design, each with its tolerance band, its source and its effect.

Units are simulated on three levels, all with this list. `performance.causes` changes pad and pose of a unit by one
sigma of one cause at a time, and adds squares. The part of the pad under the target stays as drawn.
`calibration.sensors` draws all causes together, with a surrogate. `study.spreads` makes a spec of each unit and
computes the whole design, at a hundred times the cost.

tests/estimates/test_scatter.py compares the levels. For one cause, the effect on readings by the first two levels
agrees with the third level. The difference is within a tenth of the effect of all causes. The effect of all causes
agrees within 1 %.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from sitscad.assembly.places.bodies import (
    backing_of,
    plates_of,
)
from sitscad.assembly.places.column import (
    WRITTEN,
    SizeTolerance,
    elastomer_tolerance,
    film_tolerance,
    jaw_tolerance,
    metal_tolerances,
    mount_tolerance,
    placement_tolerance,
    plate_tolerance,
    sheet_tolerance,
    usual_tolerances,
)
from sitscad.assembly.places.state import FREE, PRESSED, REST
from sitscad.basics.record import record
from sitscad.basics.units import count_text
from sitscad.data import UNVERIFIED, is_unverified
from sitscad.estimates.coil_estimates import CoilEstimate
from sitscad.estimates.loads.pressing import FILM, FILM_THICKNESS, GLUE, MODULUS, PAD, PAD_SIZE, TARGET_SIZE
from sitscad.estimates.tolerances import units_made as made
from sitscad.spec.circuit import LayerKind, Stackup
from sitscad.spec.materials import ElastomerPad, Encapsulation, Target
from sitscad.spec.mount import Assembly, Mount
from sitscad.spec.sensor import SensorSpec

ACCEPTED_SIGMAS = 3.0
"""Largest deviation of an acceptable bare coil from the design, in standard deviations by manufacture.

All documents use it.
"""

WIDTH, FOIL, PLATING = "trace width", "copper foil", "copper plating"
DISTANCE, DIAMETER, PERMITTIVITY = "layer distance", "diameter", "permittivity"
CAPACITOR, CLOCK, INDUCTANCE = "capacitor", "clock", "coil inductance"
OFFSET_X, OFFSET_Y, YAW = "target beside, x", "target beside, y", "target turned"
TILT_X, TILT_Y = "target tilted about x", "target tilted about y"
HEIGHT, UNDER_SHIELD = "board over shield or metal", "shield over metal"
SHIELD, METAL, TARGET = "shield thickness", "thickness of jaw or metal behind", "target thickness"
THICKNESS = "copper thickness"
"""Name of the cause that combines foil and plating. It is not in `CAUSES`."""

BOARD, UNIT, COIL = "board", "unit", "coil"
"""Scopes of a cause. Its error is common to a board, common to an assembled unit, or separate for each coil."""

BEHIND = (HEIGHT, UNDER_SHIELD, SHIELD, METAL)
"""Names of the causes that change the thickness or the distance of metal behind the board."""


Band = Callable[[SensorSpec], SizeTolerance | None]
"""Function of a spec that returns the tolerance of a cause. None if the sensor lacks the part."""


@record
class Cause:
    """One cause of scatter.

    `tolerance` returns half of the tolerance band in `unit` (``m``, ``rad``; ``1`` is relative). Errors are uniformly
    distributed over the band. If `is_logarithmic`, `tolerance` returns the standard deviation of the value's logarithm.
    It returns None if the sensor lacks the part. `per` is the scope (`BOARD`, `UNIT`, `COIL`). `pose` is the index of
    the component of the resting target's pose (x, y, z, rx, ry, rz) that the error changes; None if it changes no
    component. `moved` is the function that returns the spec of a unit with the error; None if a spec cannot express it.
    `key` is the cause's name in studies.
    """

    name: str
    """Name of the cause."""
    unit: str
    per: str
    tolerance: Band
    key: str = ""
    moved: made.SpecChange | None = None
    pose: int | None = None
    is_logarithmic: bool = False

    def sigma(self, spec: SensorSpec) -> float:
        """Return the standard deviation of the cause, in the cause's `unit`. 0 if the sensor lacks the part."""
        tolerance = self.tolerance(spec)
        if tolerance is None:
            return 0.0
        return tolerance.band if self.is_logarithmic else tolerance.sigma


@record
class Scatter:
    """A cause in a design: its standard deviation `sigma` in `unit`, its scope (`per`), and its source."""

    name: str
    sigma: float
    unit: str
    per: str
    source: str
    """Source of the standard deviation."""

    @property
    def verified(self) -> bool:
        """Whether the source of the standard deviation is verified."""
        return not is_unverified(self.source)


# ----------------------------------------------------------------------------------------------- bands of the causes


def _of_table(name: str) -> Band:
    return lambda spec: usual_tolerances()[name]


def _of_converter(name: str) -> Band:
    def band(spec: SensorSpec) -> SizeTolerance:
        limit = spec.readout.device.limits[name]
        return SizeTolerance(limit.value, limit.source if limit.verified else UNVERIFIED + limit.source)

    return band


def _part_tolerance(part: str, tolerance: Callable[[Any, Assembly], SizeTolerance]) -> Band:
    """Return the function for the tolerance of a part of the spec.

    `tolerance` gets the part and the spec's section `assembly`. The function returns None if the spec lacks the part.
    """
    return lambda spec: None if getattr(spec, part) is None else tolerance(getattr(spec, part), spec.assembly)


def _of_pad(written: str, name: str) -> Band:
    return _part_tolerance("elastomer", lambda pad, assembly: elastomer_tolerance(assembly, written, name))


def _film_tolerance(tolerance: Callable[[Encapsulation, Assembly], SizeTolerance]) -> Band:
    """Return the function for a tolerance of the film.

    The result is None if the spec has no pad.
    """
    film_band = _part_tolerance("encapsulation", tolerance)
    return lambda spec: None if spec.elastomer is None else film_band(spec)


def _modulus_sigma(piece: ElastomerPad | Encapsulation, _: Assembly) -> SizeTolerance:
    return SizeTolerance(piece.material.shear_modulus_sigma, UNVERIFIED + piece.material.source)


def _plating_band(stackup: Stackup) -> SizeTolerance | None:
    """Return the tolerance (m) of one step of plating. None if no layer is plated.

    It is the whole step if the fabricator's copper thickness may exclude the plating.
    """
    if not any(layer.plated for layer in stackup.copper):
        return None
    if stackup.is_plating_stated:
        return usual_tolerances()[PLATING]
    return SizeTolerance(stackup.plating_thickness, UNVERIFIED + "all of it: not stated whether the copper contains it")


def _glued_part_band(assembly: Assembly, lines: int, piece: SizeTolerance | None = None) -> SizeTolerance | None:
    """Return the combined tolerance (m) of glue lines and a printed piece, by root sum of squares.

    None if it is zero.
    """
    band = math.hypot(math.sqrt(lines) * assembly.glue_tolerance, 0.0 if piece is None else piece.band)
    if not band:
        return None
    glue = WRITTEN if assembly.adhesive is None else assembly.adhesive.source
    counted = f"{count_text(lines, 'line')}: {glue}"
    if piece is None or not piece.band:
        return SizeTolerance(band, counted)
    if not lines or not assembly.glue_tolerance:
        return piece
    unseen = UNVERIFIED * (is_unverified(piece.source) or is_unverified(glue))
    return SizeTolerance(band, f"{unseen}mount: {piece.source.removeprefix(UNVERIFIED)}; glue, {counted}")


def _glue_band(spec: SensorSpec) -> SizeTolerance | None:
    """Return the tolerance (m) of all glue lines below the target. None if there is no glue line."""
    lines = plates_of(spec).lines_below_target
    return _glued_part_band(spec.assembly, lines) if lines else None


def _height_band(spec: SensorSpec) -> SizeTolerance | None:
    """Return the tolerance (m) of the board's height over the nearest metal behind it.

    None if there is no mount, or no metal behind the board.
    """
    mount, spans = spec.mount, backing_of(spec).spans
    if mount is None or (spec.shield is None and mount.metal is None):
        return None
    if spec.shield is None:
        return _over_metal_band(spec.assembly, spec.mount, backing_of(spec).glue_lines_below_board, bool(spans))
    lines = backing_of(spec).glue_lines_above_shield
    return _glued_part_band(spec.assembly, lines, mount_tolerance(spec.assembly, spec.mount) if lines > 1 else None)


def _over_metal_band(assembly: Assembly, mount: Mount | None, lines: int, is_printed: bool) -> SizeTolerance | None:
    """Return the combined thickness tolerance (m) between the board (or shield) and the metal behind it.

    It covers the glue lines and the parts between. None if it is zero. `lines` is the number of glue lines.
    `is_printed` is True if printed parts are between.
    """
    tolerances = metal_tolerances(assembly, mount)
    if tolerances is not None:
        return _glued_part_band(assembly, lines, tolerances[0])
    return _glued_part_band(assembly, lines, mount_tolerance(assembly, mount) if is_printed else None)


def _under_shield_band(spec: SensorSpec) -> SizeTolerance | None:
    """Return the tolerance (m) of the shield's height over the metal behind it. None if no shield lies over metal."""
    mount, sheet = spec.mount, backing_of(spec).shield_heights
    if mount is None or sheet is None or mount.metal is None:
        return None
    backing = backing_of(spec)
    printed = any(upper <= sheet[0] + 1e-9 for _, upper in backing.spans)
    lines = backing.glue_lines_below_board - backing.glue_lines_above_shield
    return _over_metal_band(spec.assembly, spec.mount, lines, printed)


def _sheet_tolerance(part: str) -> Band:
    """Return the function for the thickness tolerance (m) of a sheet (``shield`` or ``target``)."""
    return _part_tolerance(part, lambda sheet, assembly: sheet_tolerance(assembly, part, sheet.thickness))


def _metal_band(assembly: Assembly, mount: Mount | None) -> SizeTolerance | None:
    """Return the thickness tolerance (m) of the metal behind the board, or else of the jaw.

    None if both are missing.
    """
    if (tolerances := metal_tolerances(assembly, mount)) is not None:
        return tolerances[1]
    jaw = None if mount is None else mount.jaw
    return None if jaw is None else jaw_tolerance(assembly, jaw.height)


_PLACEMENT = _part_tolerance("target", lambda target, assembly: placement_tolerance(assembly))
"""Function that returns the tolerance (m) of the target's place along x or y."""


def _turn_band(target: Target, assembly: Assembly) -> SizeTolerance:
    """Return the tolerance (rad) of the target's rotation about z, from the placement of its two ends."""
    place, across = placement_tolerance(assembly), min(target.size)
    ends = f"of both ends, {1e3 * across:.3g} mm apart: "
    return SizeTolerance(2.0 * place.band / across, ends + place.source)


def _tilt_band(side: int) -> Callable[[SensorSpec], SizeTolerance | None]:
    """Return the function for the tolerance (rad) of a tilt by thicker glue at one of two edges of the target.

    `side` is the index of the target's side (0: x, 1: y) that is the distance between the edges.
    """

    def tolerance(spec: SensorSpec) -> SizeTolerance | None:
        glue = _glue_band(spec)
        if spec.target is None or glue is None:
            return None
        length = spec.target.size[side]
        edges = f"thicker at one of two edges {1e3 * length:.3g} mm apart: "
        return SizeTolerance(glue.band / length, edges + glue.source)

    return tolerance


CAUSES = (
    Cause(WIDTH, "1", BOARD, _of_table(WIDTH), "coil.trace_width", made.with_width),
    Cause(FOIL, "1", BOARD, _of_table(FOIL), "fpc.stackup.copper", made.with_layers(LayerKind.COPPER)),
    Cause(PLATING, "m", BOARD, lambda spec: _plating_band(spec.fpc.stackup), "fpc.plating", made.with_plating),
    Cause(DISTANCE, "1", BOARD, _of_table(DISTANCE), "fpc.stackup.dielectric",
          made.with_layers(LayerKind.DIELECTRIC, LayerKind.COVERLAY)),
    Cause(DIAMETER, "1", BOARD, _of_table(DIAMETER), "coil.outer_diameter", made.with_diameter),
    Cause(PERMITTIVITY, "1", BOARD, _of_table(PERMITTIVITY), "fpc.stackup.permittivity", made.with_permittivity),
    Cause(CAPACITOR, "1", COIL, _of_converter("capacitor_tolerance"), "readout.capacitance", made.with_capacitor),
    Cause(PAD, "m", UNIT, _of_pad("elastomer", PAD), "elastomer.thickness", made.with_thickness("elastomer"), pose=2),
    Cause(PAD_SIZE, "m", UNIT, _of_pad("elastomer_size", PAD_SIZE), "elastomer.size", made.with_size("elastomer")),
    Cause(MODULUS, "1", UNIT, _part_tolerance("elastomer", _modulus_sigma), "elastomer.modulus",
          made.with_modulus("elastomer"), is_logarithmic=True),
    Cause(FILM, "1", UNIT, _film_tolerance(_modulus_sigma), "encapsulation.modulus",
          made.with_modulus("encapsulation"), is_logarithmic=True),
    Cause(FILM_THICKNESS, "m", UNIT,
          _film_tolerance(lambda film, assembly: film_tolerance(assembly, film.thickness)), "encapsulation.thickness",
          made.with_thickness("encapsulation")),
    Cause(GLUE, "m", UNIT, _glue_band, "assembly.glue_line", made.with_glue, pose=2),
    Cause(HEIGHT, "m", UNIT, _height_band, "mount.standoff", made.with_height),
    Cause(UNDER_SHIELD, "m", UNIT, _under_shield_band, "shield.standoff",
          lambda spec, off: made.with_distances(spec, metal=off)),
    Cause(SHIELD, "m", UNIT, _sheet_tolerance("shield"), "shield.thickness", made.with_shield),
    Cause(METAL, "m", UNIT, lambda spec: _metal_band(spec.assembly, spec.mount), "mount.jaw.height", made.with_metal),
    Cause(TARGET, "m", UNIT, _sheet_tolerance("target"), "target.thickness", made.with_thickness("target")),
    Cause(TARGET_SIZE, "m", UNIT,
          _part_tolerance("target", lambda target, assembly: plate_tolerance(assembly, "target", min(target.size))),
          "target.size", made.with_size("target")),
    Cause(OFFSET_X, "m", UNIT, _PLACEMENT, "target.offset.x", made.with_target_offset(0), pose=0),
    Cause(OFFSET_Y, "m", UNIT, _PLACEMENT, "target.offset.y", made.with_target_offset(1), pose=1),
    Cause(YAW, "rad", UNIT, _part_tolerance("target", _turn_band), "target.rotation", made.with_target_rotation,
          pose=5),
    Cause(TILT_X, "rad", UNIT, _tilt_band(1), pose=3),
    Cause(TILT_Y, "rad", UNIT, _tilt_band(0), pose=4),
    Cause(CLOCK, "1", UNIT, _of_converter("clock_tolerance")),
)
"""All causes of scatter, independent and with mean zero.

Glue raises the target over the board without making the pad softer; a thicker pad is softer. Lateral shift, tilt and
rotation of the target are at rest, in the axes and signs of a pose.
"""

MOVED = {cause.name: cause.moved for cause in CAUSES if cause.moved is not None}
"""Functions that return the spec of a unit with an error of one cause, by the cause's name."""


def scatter_by_cause(spec: SensorSpec) -> dict[str, Scatter]:
    """Return all causes for which a sensor has the parts and a tolerance above 0, by name."""
    causes = {}
    for cause in CAUSES:
        tolerance = cause.tolerance(spec)
        if tolerance is not None and tolerance.band:
            causes[cause.name] = Scatter(cause.name, cause.sigma(spec), cause.unit, cause.per, tolerance.source)
    return causes


def manufacturing_scatter(spec: SensorSpec, coils: tuple[CoilEstimate, ...]) -> tuple[Scatter, ...]:
    """Return the causes by which assembled units differ.

    Causes of the bare board are replaced by one cause, the scatter of the coils' inductance (`coil_scatter`).
    """
    return (*(cause for cause in scatter_by_cause(spec).values() if cause.per != BOARD), *coil_scatter(coils))


def coil_scatter(coils: tuple[CoilEstimate, ...]) -> tuple[Scatter, ...]:
    """Return the relative scatter of the inductance of bare coils with leads, by all causes of the board together.

    It is for the coil with the most scatter. Empty if no coil has a free state with a scatter.
    """
    free = [coil.states[FREE] for coil in coils if FREE in coil.states]
    sigmas = [(state.spread.inductance / state.inductance, state.spread) for state in free if state.spread is not None]
    if not sigmas:
        return ()
    cause = sigmas[0][1].causes["inductance"]
    source = f"{UNVERIFIED}tolerances of the board, mostly of the {cause} (data/tolerances.csv)"
    return (Scatter(INDUCTANCE, max(share for share, _ in sigmas), "1", COIL, source),)


def signal_share(coil: CoilEstimate, cause: str) -> float:
    """Return the relative change of a coil's signal by one sigma of a cause.

    The signal is the change of ln(frequency) from rest to pressed. The result is 0 if a state or its scatter is
    missing.
    """
    rest, pressed = coil.states.get(REST), coil.states.get(PRESSED)
    if rest is None or pressed is None or rest.spread is None or pressed.spread is None:
        return 0.0
    whole = math.log(pressed.frequency / rest.frequency)
    if abs(whole) < LEAST_SIGNAL:
        return 0.0
    before = rest.spread.shifts.get(cause, NO_SHIFTS)[1] / rest.frequency
    after = pressed.spread.shifts.get(cause, NO_SHIFTS)[1] / pressed.frequency
    return (after - before) / whole


LEAST_SIGNAL = 1e-6
"""Least signal, |ln(frequency pressed / frequency at rest)|, for which a relative change is computed."""

NO_SHIFTS = (0.0, 0.0, 0.0, 0.0)
"""Shifts (inductance, frequency, resistance, R_P) of a state by a cause that has no effect on it."""


def behind_scatter(coils: tuple[CoilEstimate, ...]) -> tuple[float, float]:
    """Return the relative standard deviations of the inductance at rest and of the signal, by metal behind the board.

    They include the target's thickness. Each is for the coil with the largest value.
    """
    causes = (*BEHIND, TARGET)
    inductances, signals = [0.0], [0.0]
    for coil in coils:
        rest = coil.states.get(REST)
        if rest is not None and rest.spread is not None:
            shifts = [rest.spread.shifts.get(cause, NO_SHIFTS)[0] for cause in causes]
            inductances.append(math.hypot(*shifts) / rest.inductance)
            signals.append(math.hypot(*(signal_share(coil, cause) for cause in causes)))
    return max(inductances), max(signals)


def production_limits(coils: Sequence[CoilEstimate]) -> dict[str, dict[str, float]]:
    """Return the limits of each coil's inductance (H) and frequency (Hz) before assembly, by coil name.

    They are `ACCEPTED_SIGMAS` standard deviations to either side. A coil outside is faulty even if it oscillates.
    """
    limits = {}
    for coil in coils:
        free = coil.states.get(FREE)
        if free is None or free.spread is None:
            continue
        limits[coil.name] = {
            "inductance_min_H": free.inductance - ACCEPTED_SIGMAS * free.spread.inductance,
            "inductance_max_H": free.inductance + ACCEPTED_SIGMAS * free.spread.inductance,
            "frequency_min_Hz": free.frequency - ACCEPTED_SIGMAS * free.spread.frequency,
            "frequency_max_Hz": free.frequency + ACCEPTED_SIGMAS * free.spread.frequency,
        }
    return limits
