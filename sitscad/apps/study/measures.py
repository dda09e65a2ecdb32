"""Measures (quantities) of a design for studies and sweeps: name, unit, meaning, and a function for the value."""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sitscad.apps.study.evaluation import FULL, SCREEN
from sitscad.assembly.places.fit import CLOSED_PAIR
from sitscad.assembly.places.state import MOVED_SIDEWAYS, PRESSED, REST
from sitscad.basics.check_results import Measure as FitMeasure
from sitscad.basics.quantities import TANK
from sitscad.basics.record import record
from sitscad.estimates.circuits.uncertainty import SHARE
from sitscad.estimates.coil_estimates import crowding_error
from sitscad.estimates.design import Design
from sitscad.estimates.loads.pressing import GLUE, PAD
from sitscad.estimates.loads.working_range import measured_axes
from sitscad.estimates.performance.inversion import crosstalk_at
from sitscad.estimates.performance.points import COURSE
from sitscad.estimates.performance.screen import NEARLY
from sitscad.estimates.performance_values import AXES, AXIS_WORDS, FORCES, MOMENTS, load_unit
from sitscad.kernels.geometry.path import enclosed_area

if TYPE_CHECKING:
    from sitscad.estimates.coil_estimates import CoilEstimate, StateEstimate
    from sitscad.estimates.performance.points import SensingAnalysis
    from sitscad.estimates.sensing import Sensing
    from sitscad.spec.sensor import SensorSpec

Figure = tuple[float, float]
"""A value and its error bound, both in the measure's unit."""

Reader = Callable[[Design], Figure]


class AbsentError(ValueError):
    """Raised if a design does not have the measure. The text gives the reason."""


@record
class Need:
    """A part of a spec that a measure needs.

    ``name`` is its name, ``is_present`` returns whether a spec has it, and ``keys`` are the keys of a spec that can add
    it.
    """

    name: str
    is_present: Callable[[SensorSpec], bool]
    keys: tuple[str, ...]


@record
class DesignMeasure:
    """A measure of a design.

    ``unit`` is the SI unit, and empty for fractions and counts. ``needs`` are parts of a spec without which the measure
    is missing. ``levels`` are the levels at which it is computed. ``read`` returns its value and error bound for a
    design, and raises `AbsentError` if it is missing. ``decided_by`` are keys that alone determine it; empty if many
    keys do.
    """

    name: str
    unit: str
    meaning: str
    needs: tuple[Need, ...]
    read: Reader
    levels: tuple[str, ...] = (SCREEN, FULL)
    decided_by: tuple[str, ...] = ()

    @property
    def needs_text(self) -> str:
        """Text with the parts of a spec that the measure needs."""
        return ", ".join(need.name for need in self.needs)


def _states(coils: Sequence[CoilEstimate]) -> Iterator[tuple[CoilEstimate, StateEstimate]]:
    """Yield each coil with each of its states. Raises AbsentError if a state could not be estimated."""
    failures = {state: why for coil in coils for state, why in coil.failed_states.items()}
    failed = next((why for why in failures.values() if why != MOVED_SIDEWAYS), None)
    if failed is not None:
        raise AbsentError(failed)
    for coil in coils:
        yield from ((coil, state) for state in coil.states.values())


def inductance_error(coil: CoilEstimate, state: StateEstimate) -> float:
    """Return the error bound (H) of a state's inductance.

    It is the sum of three errors: of the winding's inductance at direct current, of the current crowding at the
    frequency, and of the change by the target.
    """
    least = 0.01 * coil.winding_inductance
    crowding = crowding_error(coil.winding_inductance, coil.inductance_parts["crowding"])
    by_target = (state.target_change_error or 0.0) * max(abs(state.target_change or 0.0), least)
    return coil.inductance_error * coil.winding_inductance + crowding + by_target


def _worst_tank(
    coils: Sequence[CoilEstimate], pick: Callable[..., Any], name: str
) -> tuple[CoilEstimate, StateEstimate]:
    """Return the coil and the state with the worst value of the field `name`. `pick` (min or max) selects the worst."""
    pairs = [pair for pair in _states(coils) if math.isfinite(getattr(pair[1], name))]
    if not pairs:
        raise AbsentError("no tank of this design oscillates")
    worst: tuple[CoilEstimate, StateEstimate] = pick(pairs, key=lambda pair: getattr(pair[1], name))
    return worst


def _tank_reader(pick: Callable[..., Any], name: str, by_inductance: float, by_loss: float) -> Reader:
    """Return a function that reads a tank quantity of a design, at the coil and state with the worst value.

    `pick` is min or max, and `name` is a field of `StateEstimate`. `by_inductance` and `by_loss` are the exponents of
    inductance and resistance in the quantity. The error bound follows from these exponents.
    """

    def read(design: Design) -> Figure:
        coil, state = _worst_tank(design.estimates.all_coils, pick, name)
        value = float(getattr(state, name))
        relative = abs(by_inductance) * inductance_error(coil, state) / state.inductance
        return value, abs(value) * (relative + abs(by_loss) * (state.resistance_error or 0.0))

    return read


def _sigma_reader(pick: Callable[..., Any], name: str) -> Reader:
    """Return a function that reads the standard deviation of a quantity between manufactured sensors.

    It is read at the coil and state with the worst value of the field `name`. `pick` (min or max) selects the worst.
    """

    def read(design: Design) -> Figure:
        sigmas = _worst_tank(design.estimates.all_coils, pick, name)[1].spread
        if sigmas is None:
            raise AbsentError("no tank of this design oscillates")
        return float(getattr(sigmas, name)), 0.0

    return read


def _signal(design: Design) -> Figure:
    by_coil = design.estimates.signals
    if not by_coil:
        raise AbsentError("no coil is read both at rest and pressed")
    least = min(by_coil, key=lambda signal: abs(signal.share))
    coil = next(coil for coil in design.estimates.coils if coil.name == least.coil)
    rest, pressed = coil.states[REST], coil.states[PRESSED]
    moved = [s.spread.shifts.get(SHARE, (0.0, 0.0))[1] if s.spread is not None else 0.0 for s in (rest, pressed)]
    change = pressed.frequency - rest.frequency
    value = abs(least.share)
    return value, value * abs((moved[1] - moved[0]) / change) if change else 0.0


def _sensing(results: Sensing) -> SensingAnalysis:
    sensing = results.analysis
    if sensing is None:
        raise AbsentError("it needs a target on a pad, and tanks that oscillate at rest")
    if not all(sensing.is_pad_stable):
        raise AbsentError("the pad fails sideways within the required normal force")
    return sensing


def _axis_readers(of: Callable[[SensingAnalysis, str], float]) -> Callable[[str], Reader]:
    """Return a function that takes an axis and returns a reader of a sensing quantity on this axis.

    `of` computes the quantity from the sensing analysis and the axis. The reader raises `AbsentError` if the coils do
    not measure the axis.
    """

    def reader_for_axis(axis: str) -> Reader:
        def of_axis(sensing: SensingAnalysis) -> float:
            if axis not in sensing.bench.range.axes:
                raise AbsentError(f"the coils cannot measure {axis}")
            value = of(sensing, axis)
            if not math.isfinite(value):
                raise AbsentError(f"no reading depends on {axis}")
            return value

        return _sensing_reader(of_axis)

    return reader_for_axis


def _sensing_reader(of: Callable[[SensingAnalysis], float]) -> Reader:
    """Return a function that reads a sensing quantity of a design, with its error bound.

    The relative error is `NEARLY` at the screen level and 0 at the full level.
    """

    def read(design: Design) -> Figure:
        value = of(_sensing(design.sensing))
        return value, (NEARLY if design.estimates.is_rough else 0.0) * value

    return read


def _resolution(sensing: SensingAnalysis, axis: str) -> float:
    k = sensing.bench.range.axes.index(axis)
    return max(float(point.noise[k]) for point in sensing.points)


def _tilt_error(sensing: SensingAnalysis, axis: str) -> float:
    k = sensing.bench.range.axes.index(axis)
    return max(float(point.tilt_errors(point.tilt)[k].max()) for point in sensing.points)


def _drift_reader(place: int) -> Callable[[SensingAnalysis, str], float]:
    """Return a function that reads the temperature drift of an axis. `place` is 0 for no load, and -1 for full load."""
    return lambda sensing, axis: float(sensing.warmed[place].drift[sensing.bench.range.axes.index(axis)])


def _uncompensated_drift(sensing: SensingAnalysis, axis: str) -> float:
    return float(sensing.warmed[-1].uncompensated_drift[sensing.bench.range.axes.index(axis)])


def _range_reader(axis: str) -> Reader:
    def read(design: Design) -> Figure:
        _sensing(design.sensing)
        points = design.performance
        if not points:
            raise AbsentError("no coil responds to a force")
        if axis not in points[0].axes:
            raise AbsentError(f"the coils cannot measure {axis}")
        apart = design.sensing.solved.bench.validated_loads[axis] / (COURSE - 1)  # spacing of the evaluated loads
        return points[0].axes[axis].range, apart

    return read


def _crosstalk(sensing: SensingAnalysis) -> float:
    if len(sensing.bench.range.axes) == 1:
        raise AbsentError("one coil measures one axis")
    if not sensing.is_pad_stable_in_range:
        raise AbsentError("the pad fails sideways within the required loads")
    tables = [crosstalk_at(sensing.working, point.load, point.inverse)[0] for point in sensing.points]
    return max(error for table in tables for row in table.values() for error in row.values())


def _error_by_gap(sensing: SensingAnalysis) -> float:
    if not sensing.is_pad_stable_in_range:
        raise AbsentError("the pad fails sideways within the required loads")
    units, full = sensing.units, sensing.bench.range.normal
    near = np.abs(units.loads[:, 0] - full) < 1e-9 * full
    causes = [units.after_tare[name][near] for name in (GLUE, PAD) if name in units.after_tare]
    if not causes:
        raise AbsentError("neither glue lines nor the pad's thickness scatter")
    is_force = [name in FORCES for name in sensing.bench.range.axes]
    return float(np.sqrt(np.mean(np.sum(np.square(causes), axis=0), axis=0))[is_force].max())


def _fit_reader(of: Callable[[dict[str, FitMeasure]], float]) -> Reader:
    def read(design: Design) -> Figure:
        by_name = {measure.name: measure for measure in design.fit}
        if not by_name:
            raise AbsentError("it needs a jaw with known dimensions, and room for the shield in the standoff")
        return of(by_name), 0.0

    return read


def _exact_reader(of: Callable[[Design], float | None], why: str = "") -> Reader:
    """Return a function that reads a quantity with error bound 0.

    `why` is the reason if the design does not have it.
    """
    def read(design: Design) -> Figure:
        value = of(design)
        if value is None or not math.isfinite(value):
            raise AbsentError(why)
        return float(value), 0.0

    return read


WORST: dict[str, tuple[Callable[..., Any], str, float, float]] = {
    "inductance": (min, "least inductance at the contacts, of all coils and states", 1.0, 0.0),
    "Rp": (min, "least parallel resistance of all tanks and states", 1.0, 1.0),
    "Q": (min, "least quality factor of all tanks and states", 0.5, 1.0),
    "frequency": (max, "highest frequency of all tanks and states", 0.5, 0.0),
    "amplitude": (min, "least amplitude at the converter, of all tanks and states", 1.0, 1.0),
}
"""Tank quantities by name: min or max (selects the worst state), meaning, exponents of inductance and of resistance."""

PADDED = (Need("target", lambda spec: spec.target is not None, ("target",)),
          Need("elastomer", lambda spec: spec.elastomer is not None, ("elastomer",)))
FORCE = Need("requirements.normal_force", lambda spec: spec.requirements.normal_force is not None,
             ("requirements.normal_force",))
JAW = Need("mount.jaw", lambda spec: spec.jaw is not None, ("mount",))
CELLS = Need("cells", lambda spec: spec.cells is not None, ("cells",))
TWO_COILS = Need("two coils", lambda spec: len(spec.cell_placements[0]) > 1, ("array", "cells"))


def _measured_axis_need(axis: str) -> Need:
    def has_measured_axis(spec: SensorSpec) -> bool:
        return axis in measured_axes(spec.cell_placements[0], spec.requirements)

    if axis in MOMENTS:
        return Need(f"requirements.{axis}, and coils that tell it apart", has_measured_axis,
                    ("array", "cells", f"requirements.{axis}"))
    return Need("coils that tell it apart", has_measured_axis, ("array", "cells", "requirements"))


AXIS_MEASURES = (
    ("resolution", "noise of {axis} at the scan rate (one sigma); the largest of rest, half and full load",
     _axis_readers(_resolution), (SCREEN, FULL)),
    ("range", "largest {axis} from rest that the sensor can measure (full response; takes seconds)",
     _range_reader, (FULL,)),
    ("error.temperature", "drift of {axis} at full load, from requirements.temperature to the farther end of "
     "temperature_range, or over 10 K. With readout.compensation it is what this leaves",
     _axis_readers(_drift_reader(-1)), (SCREEN, FULL)),
    ("error.uncompensated", "error.temperature of {axis} without the compensation",
     _axis_readers(_uncompensated_drift), (SCREEN, FULL)),
    ("error.zero_drift", "zero drift of {axis}, at rest, over the same temperatures as error.temperature",
     _axis_readers(_drift_reader(0)), (SCREEN, FULL)),
    ("error.tilt", "error of {axis} by requirements.tilt, or by one degree, at the worst load",
     _axis_readers(_tilt_error), (FULL,)),
)
"""Name, meaning, reader and levels of each measure that exists for every axis."""

LOADED_DRIFTS = ("error.temperature", "error.uncompensated")
"""Drifts under load. For shear, they need the slope of the map under shear, which the screen level does not have."""


def _measure_rows() -> Iterator[DesignMeasure]:
    quantities = {each.label: each for each in TANK}
    for name, (pick, meaning, by_inductance, by_loss) in WORST.items():
        tank = quantities[name]
        yield DesignMeasure(name.lower(), tank.unit, meaning, (),
                            _tank_reader(pick, tank.field, by_inductance, by_loss))
    yield DesignMeasure("signal.normal", "", "relative change of the reading from rest to "
                        "requirements.normal_force, for the coil with the smallest change",
                        (*PADDED, FORCE), _signal)
    for name, meaning, read, levels in AXIS_MEASURES:
        for axis in AXES:
            needs = {"normal": PADDED}.get(axis, (*PADDED, _measured_axis_need(axis)))
            is_full_only = axis in MOMENTS or (axis != "normal" and name in LOADED_DRIFTS)
            yield DesignMeasure(f"{name}.{axis}", load_unit(axis), meaning.format(axis=AXIS_WORDS[axis]), needs,
                                read(axis), (FULL,) if is_full_only else levels)
    yield DesignMeasure("crosstalk", "", "largest error of an axis by the full scale of another axis, as a fraction of "
                        "its own full scale, with the best polynomial of the design as drawn", (*PADDED, TWO_COILS),
                        _sensing_reader(_crosstalk), (FULL,))
    yield DesignMeasure("crosstalk.cells", "", "largest change of a cell's reading by full load on all its neighbours, "
                        "as a fraction of the cell's full signal", (CELLS,), _exact_reader(
                            lambda design: getattr(design.cells.skin.crosstalk, "total", None),
                            "it needs cells with a signal"), (FULL,))
    yield DesignMeasure("error.gap", "N", "error at full load by scatter of glue lines and pad thickness (one "
                        "sigma), tared but not calibrated, on the worst axis of force", PADDED,
                        _sensing_reader(_error_by_gap), (FULL,))
    yield DesignMeasure("fit.closed_pair", "m", "diameter of the circle that the closed jaws need, at worst tolerances",
                        (JAW,), _fit_reader(lambda fits: fits[CLOSED_PAIR].worst))
    yield DesignMeasure("fit.spare", "m", "smallest room left in the jaw, of all its fits, at worst tolerances", (JAW,),
                        _fit_reader(lambda fits: min(measure.margin for measure in fits.values())))
    yield DesignMeasure("fit.width", "m", "width of the board's body, across the jaw", (),
                        _exact_reader(lambda design: design.layout.body_size[1]))
    yield DesignMeasure("fit.length", "m", "length of the board's body, reader_for_axis the jaw", (),
                        _exact_reader(lambda design: design.layout.body_size[0]))
    yield DesignMeasure("board.area", "m2", "area of the board with its tail", (),
                        _exact_reader(lambda design: abs(enclosed_area(design.layout.outline))))
    yield DesignMeasure("board.layers", "", "copper layers of the board", (),
                        _exact_reader(lambda design: float(len(design.spec.fpc.stackup.copper))),
                        decided_by=("fpc.stackup", "coil.layers"))
    uncounted = "no tank of this design can be counted"
    yield DesignMeasure("rate", "Hz", "complete scans per second", (),
                        _exact_reader(lambda design: design.estimates.readout.scan_rate, uncounted))
    yield DesignMeasure("supply_current", "A", "supply current of all converters, with their drive", (),
                        _exact_reader(lambda design: design.estimates.readout.supply_current, uncounted))
    for name, (pick, *_) in WORST.items():
        if name != "Q":
            lower, tank = name.lower(), quantities[name]
            meaning = f"scatter of {lower} from unit to unit (one sigma, to first order), at its worst value"
            yield DesignMeasure(f"sigma.{lower}", tank.unit, meaning, (), _sigma_reader(pick, tank.field))
    yield DesignMeasure("yield", "", "fraction of units that pass the electrical, readout and sensing rules, with "
                        "manufacturing scatter", (),
                        _exact_reader(lambda design: None, "only a study computes it, for the designs that it keeps"))


MEASURES: dict[str, DesignMeasure] = {row.name: row for row in _measure_rows()}
"""All measures by name, in the order of lists."""


def checked_measure_names(names: list[str] | tuple[str, ...] | None, level: str = SCREEN) -> tuple[str, ...]:
    """Return the names of measures without duplicates, after a check that they exist.

    If `names` is None, return all measures of the level except ranges, sigmas, yield and drifts without compensation.
    Raises ValueError for an unknown name, with the most similar names.
    """
    if names is None:
        dear = ("range.", "sigma.", "yield", "error.uncompensated.")
        return tuple(name for name, row in MEASURES.items() if level in row.levels and not name.startswith(dear))
    unknown = next((name for name in names if name not in MEASURES), None)
    if unknown is not None:
        raise ValueError(f"there is no measure {unknown!r}: {similar_measures_text(unknown)}")
    return tuple(dict.fromkeys(names))


def similar_measures_text(word: str) -> str:
    """Return a text with measures whose names are similar to a word."""
    near = difflib.get_close_matches(word.lower(), list(MEASURES), n=3, cutoff=0.5)
    near = near or [name for name in MEASURES if word and (word in name or name.partition(".")[0] in word)]
    return f"did you mean {', '.join(near)}?" if near else "`sitscad measures` lists them all"
