"""What differs from one unit of a design to the next: every cause once, with its band, its source, and what it moves.

Units are simulated on three levels, all by this list. `performance.causes` moves pad and pose of a unit by one sigma of
a cause at a time and adds up squares, the part of the pad under the target staying as drawn. `calibration.sensors`
draws all causes together and reads a chart. `study.spreads` makes a spec of each unit and works out the whole design,
which costs a hundred times as much. tests/estimates/test_scatter.py holds them together: what one cause does to the
readings is on the first two levels within a tenth, of what all causes do, of what it does on the third, and what all
causes do within 1 %.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from sitscad.data import UNVERIFIED, is_unverified
from sitscad.estimates.states.pressing import GLUE, MODULUS, PAD, PAD_SIZE
from sitscad.estimates.values import Estimates
from sitscad.record import record, replace
from sitscad.scene.bodies import lines_below_target
from sitscad.scene.column import WRITTEN, SizeTolerance, elastomer_tolerance, placement, usual_tolerances
from sitscad.scene.state import FREE
from sitscad.spec.circuit import LayerKind
from sitscad.spec.sensor import SensorSpec

WIDTH, FOIL, PLATING = "trace width", "copper foil", "copper plating"
DISTANCE, DIAMETER, PERMITTIVITY = "layer distance", "diameter", "permittivity"
CAPACITOR, CLOCK, INDUCTANCE = "capacitor", "clock", "coil inductance"
OFFSET_X, OFFSET_Y, YAW = "target beside, x", "target beside, y", "target turned"
TILT_X, TILT_Y = "target tilted about x", "target tilted about y"

BOARD, UNIT, COIL = "board", "unit", "coil"
"""What has a cause to itself: the board, the assembled unit, or each of its coils."""

LEAST_FACTOR = 0.05
"""What a figure of a unit is scaled by at least, however large its sigma is."""

Moved = Callable[[SensorSpec, float], SensorSpec]


@record
class Cause:
    """One cause. Its `tolerance` gives half of its band in `unit` (``m``, ``rad``; ``1`` is relative), evenly filled,
    or where it `is_logarithmic` one sigma of the figure's logarithm; None where the sensor has no such part. A unit
    that is off by so much has its resting target off in that number of its `pose` (x, y, z, rx, ry, rz), where there is
    one, and is the spec that `moved` gives, where a spec can say it: studies know it by the `key`.
    """

    name: str
    unit: str
    per: str
    tolerance: Callable[[SensorSpec], SizeTolerance | None]
    key: str = ""
    moved: Moved | None = None
    pose: int | None = None
    is_logarithmic: bool = False

    def sigma(self, spec: SensorSpec) -> float:
        """The standard deviation, in the cause's unit; 0 where the sensor has no such part."""
        found = self.tolerance(spec)
        if found is None:
            return 0.0
        return found.band if self.is_logarithmic else found.sigma


@record
class Scatter:
    """A cause as a design has it: its standard deviation in `unit`, what it is drawn for anew (`per`), its source."""

    name: str
    sigma: float
    unit: str
    per: str
    source: str

    @property
    def verified(self) -> bool:
        """Whether the source was seen."""
        return not is_unverified(self.source)


# ----------------------------------------------------------------------------------------------- bands of the causes


def _of_table(name: str) -> Callable[[SensorSpec], SizeTolerance]:
    return lambda spec: usual_tolerances()[name]


def _of_converter(name: str) -> Callable[[SensorSpec], SizeTolerance]:
    def tolerance(spec: SensorSpec) -> SizeTolerance:
        row = spec.readout.device.limits[name]
        return SizeTolerance(row.value, row.source if row.verified else UNVERIFIED + row.source)

    return tolerance


def _of_pad(written: str, name: str) -> Callable[[SensorSpec], SizeTolerance | None]:
    return lambda spec: None if spec.elastomer is None else elastomer_tolerance(spec.assembly, written, name)


def _modulus_sigma(spec: SensorSpec) -> SizeTolerance | None:
    if spec.elastomer is None:
        return None
    material = spec.elastomer.material
    return SizeTolerance(material.shear_modulus_sigma, UNVERIFIED + material.source)


def _glue_band(spec: SensorSpec) -> SizeTolerance | None:
    """All glue below the target: of independent lines squares add up."""
    assembly, lines = spec.assembly, lines_below_target(spec)
    if not lines or not assembly.glue_tolerance:
        return None
    source = WRITTEN if assembly.adhesive is None else assembly.adhesive.source
    counted = f"{lines} line{'s' if lines > 1 else ''}: "
    return SizeTolerance(math.sqrt(lines) * assembly.glue_tolerance, counted + source)


def _placement_band(spec: SensorSpec) -> SizeTolerance | None:
    return None if spec.target is None else placement(spec.assembly)


def _turn_band(spec: SensorSpec) -> SizeTolerance | None:
    if spec.target is None:
        return None
    placed, across = placement(spec.assembly), min(spec.target.size)
    ends = f"of both ends, {1e3 * across:.3g} mm apart: "
    return SizeTolerance(2.0 * placed.band / across, ends + placed.source)


def _tilt_band(side: int) -> Callable[[SensorSpec], SizeTolerance | None]:
    """A tilt by glue that is thicker at one of two edges, as far apart as the target's side of that number is long."""

    def tolerance(spec: SensorSpec) -> SizeTolerance | None:
        glue = _glue_band(spec)
        if spec.target is None or glue is None:
            return None
        length = spec.target.size[side]
        edges = f"thicker at one of two edges {1e3 * length:.3g} mm apart: "
        return SizeTolerance(glue.band / length, edges + glue.source)

    return tolerance


# ------------------------------------------------------------------------------------------ specs of units that are off


def _with_width(spec: SensorSpec, off: float) -> SensorSpec:
    coil = spec.coil
    width = coil.trace_width * max(LEAST_FACTOR, 1.0 + off)
    # centre lines stay, for the film of the artwork keeps the pitch
    return replace(spec, coil=replace(coil, trace_width=width, trace_spacing=coil.pitch - width))


def _with_layers(kind: LayerKind) -> Moved:
    """Moves the thickness of all layers of a kind: foils and films are of one delivery."""

    def moved(spec: SensorSpec, off: float) -> SensorSpec:
        stackup = spec.fpc.stackup
        layers = tuple(
            replace(one, thickness=one.thickness + off * (one.thickness - one.plated)) if one.kind is kind else one
            for one in stackup.layers
        )
        return replace(spec, fpc=replace(spec.fpc, stackup=replace(stackup, layers=layers)))

    return moved


def _with_capacitor(spec: SensorSpec, off: float) -> SensorSpec:
    chosen = spec.readout.capacitance
    return spec if chosen is None else replace(spec, readout=replace(spec.readout, capacitance=chosen * (1.0 + off)))


def with_pad(spec: SensorSpec, off: float) -> SensorSpec:
    """The spec with a pad thicker by so much (m)."""
    pad = spec.elastomer
    if pad is None:
        return spec
    return replace(spec, elastomer=replace(pad, thickness=max(LEAST_FACTOR * pad.thickness, pad.thickness + off)))


def with_modulus(spec: SensorSpec, off: float) -> SensorSpec:
    """The spec with a pad whose shear modulus has a logarithm larger by so much."""
    pad = spec.elastomer
    if pad is None:
        return spec
    material = replace(pad.material, shear_modulus=pad.material.shear_modulus * math.exp(off))
    return replace(spec, elastomer=replace(pad, material=material))


def _with_glue(spec: SensorSpec, off: float) -> SensorSpec:
    """A target that stands higher by so much (m): a spec has one thickness for all its lines of glue."""
    line = spec.assembly.glue_line + off / max(1, lines_below_target(spec))
    return replace(spec, assembly=replace(spec.assembly, glue_line=max(0.0, line)))


def _beside(axis: int) -> Moved:
    def moved(spec: SensorSpec, off: float) -> SensorSpec:
        if spec.target is None:
            return spec
        x, y = spec.target.offset
        offset = (x + off, y) if axis == 0 else (x, y + off)
        return replace(spec, target=replace(spec.target, offset=offset))

    return moved


def _turned(spec: SensorSpec, off: float) -> SensorSpec:
    target = spec.target
    return spec if target is None else replace(spec, target=replace(target, rotation=target.rotation + off))


CAUSES = (
    Cause(WIDTH, "1", BOARD, _of_table(WIDTH), "coil.trace_width", _with_width),
    Cause(FOIL, "1", BOARD, _of_table(FOIL), "fpc.stackup.copper", _with_layers(LayerKind.COPPER)),
    Cause(PLATING, "m", BOARD, _of_table(PLATING)),
    Cause(DISTANCE, "1", BOARD, _of_table(DISTANCE), "fpc.stackup.dielectric", _with_layers(LayerKind.DIELECTRIC)),
    Cause(DIAMETER, "1", BOARD, _of_table(DIAMETER)),
    Cause(PERMITTIVITY, "1", BOARD, _of_table(PERMITTIVITY)),
    Cause(CAPACITOR, "1", COIL, _of_converter("capacitor_tolerance"), "readout.capacitance", _with_capacitor),
    Cause(PAD, "m", UNIT, _of_pad("elastomer", PAD), "elastomer.thickness", with_pad, pose=2),
    Cause(PAD_SIZE, "m", UNIT, _of_pad("elastomer_size", PAD_SIZE)),
    Cause(MODULUS, "1", UNIT, _modulus_sigma, "elastomer.modulus", with_modulus, is_logarithmic=True),
    Cause(GLUE, "m", UNIT, _glue_band, "assembly.glue_line", _with_glue, pose=2),
    Cause(OFFSET_X, "m", UNIT, _placement_band, "target.offset.x", _beside(0), pose=0),
    Cause(OFFSET_Y, "m", UNIT, _placement_band, "target.offset.y", _beside(1), pose=1),
    Cause(YAW, "rad", UNIT, _turn_band, "target.rotation", _turned, pose=5),
    Cause(TILT_X, "rad", UNIT, _tilt_band(1), pose=3),
    Cause(TILT_Y, "rad", UNIT, _tilt_band(0), pose=4),
    Cause(CLOCK, "1", UNIT, _of_converter("clock_tolerance")),
)
"""All causes; independent, and of mean nothing. Glue raises the target over the board without making the pad softer, as
a thicker pad does. Where the target lies beside, tilted and turned is at rest, in the axes and signs of a pose.
"""


def scatter(spec: SensorSpec) -> dict[str, Scatter]:
    """All causes that a sensor has the parts of, by name."""
    found = {}
    for cause in CAUSES:
        tolerance = cause.tolerance(spec)
        if tolerance is not None and tolerance.band:
            found[cause.name] = Scatter(cause.name, cause.sigma(spec), cause.unit, cause.per, tolerance.source)
    return found


def manufacturing_scatter(spec: SensorSpec, estimates: Estimates) -> tuple[Scatter, ...]:
    """What differs between assembled units: in place of the board's own causes their sum, `coil_scatter`."""
    return (*(one for one in scatter(spec).values() if one.per != BOARD), *coil_scatter(estimates))


def coil_scatter(estimates: Estimates) -> tuple[Scatter, ...]:
    """How the inductance of the bare coils with their leads scatters by all causes of the board, of the coil that
    scatters most; nothing where it has no numbers.
    """
    free = [coil.states[FREE] for coil in estimates.coils if FREE in coil.states]
    known = [(state.spread.inductance / state.inductance, state.spread) for state in free if state.spread is not None]
    if not known:
        return ()
    cause = known[0][1].causes["inductance"]
    source = f"{UNVERIFIED}tolerances of the board, mostly of the {cause} (data/tolerances.csv)"
    return (Scatter(INDUCTANCE, max(share for share, _ in known), "1", COIL, source),)
