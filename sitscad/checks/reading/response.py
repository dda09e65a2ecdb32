"""SIT215, SIT217 and SIT218: whether every coil responds to the required forces, and by how much."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from sitscad.assembly.places.state import PRESSED, REST, SIGNAL, STATES
from sitscad.basics.check_results import Signal
from sitscad.basics.finding import Severity
from sitscad.basics.record import record
from sitscad.basics.units import show
from sitscad.checks.assembly.plates import is_as_long_as_line
from sitscad.checks.fixes.pads import (
    centred_plates,
    families_for_more_signal,
    larger_target,
    pad_cut_to_target,
    smaller_targets,
    temperature_sensors,
    wider_arrays,
)
from sitscad.checks.fixes.search import Family, Fix
from sitscad.checks.reading.readings import failed_state_reasons
from sitscad.checks.rules import (
    ROUNDING,
    Rule,
    Verdict,
    Violation,
    constant_limits,
    not_checked,
    rule_of,
    violation_of,
)
from sitscad.estimates import estimate_layout
from sitscad.estimates.design import Design
from sitscad.estimates.loads.pad import loaded_poses
from sitscad.estimates.loads.pressing import rests_on_pad
from sitscad.estimates.loads.working_range import USUAL_STRAIN, full_normal_force, measured_axes
from sitscad.estimates.performance.screen import target_effects
from sitscad.kernels.converters.conversion import Conversion
from sitscad.kernels.geometry.path import Point
from sitscad.spec import presets
from sitscad.spec.coil import CoilPlacement
from sitscad.spec.materials import Target
from sitscad.spec.places import coil_positions_on_plate, overlap_centres, span_over_coils
from sitscad.spec.sensor import ReadoutSpec, SensorSpec

if TYPE_CHECKING:
    from sitscad.estimates.coil_estimates import CoilEstimate

FEWEST_STEPS = 30.0
"""Change of the converter's result from rest to pressed, in steps, below which there is a finding.

TI requires a signal of 30 standard deviations (SNOAA04A), which is 9 steps with quantisation noise alone. Real noise is
a few times larger. With 30 steps, a thirtieth of the required force is still one step.
"""

LEAST_SHARE = 0.05
"""Ratio of a coil's change to the largest change of all coils, below which there is a finding. Derived here.

The target's estimated effect has an error of 3 to 5 % of the change, so a smaller change may be absent. Coupling
between neighbours and a shifted target add changes of this size, too.
"""


DETECTION_SIGMAS = 3.0
"""Ratio of a change to the standard deviation of the noise, below which the change counts as lost in the noise.

It is the usual limit of detection.
"""


@record
class SignalChange:
    """Change of one coil's inductance from rest to a loaded state, as the converter measures it.

    `change` is the change (H), and `step` the inductance (H) of one step of the converter's result. `steps` is the
    change in steps. `noise` is the standard deviation of the noise in steps, computed with the noise measured on the
    converter.
    """

    coil: str
    change: float
    step: float
    steps: float
    noise: float

    @property
    def is_lost(self) -> bool:
        """Whether the change cannot be distinguished from the noise."""
        return self.steps < DETECTION_SIGMAS * self.noise


def responses(
    coils: Sequence[CoilEstimate], conversion: Conversion | None, state: str = PRESSED
) -> list[SignalChange]:
    """Return the change from rest to the state `state`, for every coil that has finite values in both states.

    Empty if `conversion` (the converter's settings) is None.
    """
    changes = []
    for coil in coils:
        rest, pressed = coil.states.get(REST), coil.states.get(state)
        if rest is None or pressed is None or conversion is None:
            continue
        before, after = rest.converter_inductance, pressed.converter_inductance
        if before is not None and after is not None and math.isfinite(after - before):
            noise = conversion.noise(rest.frequency) / conversion.resolution(rest.frequency)
            step = conversion.inductance_step(before, rest.frequency)
            steps = conversion.steps(rest.frequency, pressed.frequency)
            changes.append(SignalChange(coil.name, after - before, step, steps, noise))
    return changes


def coil_response(design: Design) -> Iterator[Verdict]:
    """Yield findings on coils whose reading changes too little from rest to the loaded states.

    The limits are `FEWEST_STEPS` converter steps, and `LEAST_SHARE` of the largest change of all coils. The state with
    the largest load is checked first. After the first state with a finding, no further state is checked. If no normal
    force is required, the rule only checks whether any coil responds to full load.
    """
    required = design.spec.requirements.normal_force
    if not required:
        yield from _signal_without_requirement(design)
        return
    yield from failed_state_reasons(design.estimates.coils, "change from rest to pressed")
    loads = {kind.name: kind.load[0] for kind in STATES if kind.load is not None and SIGNAL in kind.judged_by}
    for state, part in sorted(loads.items(), key=lambda each: -each[1]):
        verdicts = list(_weak_change_findings(design, state, part * required))
        yield from verdicts
        if any(isinstance(verdict, Violation) for verdict in verdicts):
            return


def _weak_change_findings(design: Design, state: str, required: float) -> Iterator[Verdict]:
    """Yield a finding if a coil's reading changes too little from rest to the state `state`.

    The limits are `FEWEST_STEPS` and `LEAST_SHARE`. `required` is the required force (N) in this state.
    """
    coils = design.estimates.coils
    changes = responses(coils, design.estimates.readout.conversion, state)
    if len(changes) < len(coils):
        yield not_checked("no-change", state=state)
        if not changes:
            return
    best = max(changes, key=lambda response: abs(response.change))
    deaf = [r for r in changes if r.steps < FEWEST_STEPS or abs(r.change) < LEAST_SHARE * abs(best.change)]
    if not deaf:
        return
    worst = min(deaf, key=lambda response: response.steps)
    beside, untold = best.steps >= FEWEST_STEPS, _unmeasured_shear(design.spec.cell_placements, changes)
    lost, is_nothing_felt = [response.coil for response in changes if response.is_lost], _are_all_lost(changes)
    is_needed = untold and design.spec.requirements.shear_force
    target = design.spec.target
    assert target is not None
    places = coil_positions_on_plate(design.spec, target)
    outside = max(abs(places[r.coil][k]) - 0.5 * target.size[k] for r in deaf for k in (0, 1))
    details = (*["weak-best"] * beside, *["lost-coils"] * bool(lost), *["lost-shear"] * bool(lost and untold),
               *["weak-outside"] * (beside and outside > 0.0))
    change = _larger_change_hint(design.spec.readout, design.estimates.readout.conversion, coils, target, worst.steps)
    yield violation_of(
        "nothing-felt" if is_nothing_felt else "weak-change", "target.size" if beside else "elastomer.thickness",
        worst.steps, max(FEWEST_STEPS, LEAST_SHARE * abs(best.change) / worst.step), "steps",
        hint=("reach-offset" if any(target.offset) else "reach-target") if beside else change.case,
        details=() if is_nothing_felt else details, fixes=_cover_all_coils(design.spec) if beside
        else families_for_more_signal(design.spec),
        severity=Severity.ERROR if is_needed or is_nothing_felt else Severity.WARNING,
        coils=[response.coil for response in deaf], force=required, state=state, changes=_change_texts(deaf),
        fewest=FEWEST_STEPS, share=LEAST_SHARE, best=best.coil, best_change=best.change, best_steps=best.steps,
        lost=lost, untold=untold, outside=outside, size=target.size, sigmas=DETECTION_SIGMAS, noise=best.noise,
        rate=change.rate, devices=change.devices,
    )


def _are_all_lost(changes: Sequence[SignalChange]) -> bool:
    """Whether all coils' changes are too small to distinguish from noise."""
    return all(response.is_lost for response in changes)


def _unmeasured_shear(
    cells: tuple[tuple[CoilPlacement, ...], ...], changes: Sequence[SignalChange]
) -> list[str]:
    """Return the names of the axes along which shear cannot be distinguished from normal force.

    Along such an axis, the coils of at least one cell have different positions, but its responding coils have equal
    positions. `cells` are the coils of each cell, and `changes` the change of each coil.
    """
    lost, untold = {response.coil for response in changes if response.is_lost}, set()
    for cell in cells:
        for axis in (0, 1):
            places = [placement.centre[axis] for placement in cell]
            sensing = [placement.centre[axis] for placement in cell if placement.name not in lost]
            if max(places) - min(places) > ROUNDING and sensing and max(sensing) - min(sensing) <= ROUNDING:
                untold.add(AXES[axis])
    return sorted(untold)


def _signal_without_requirement(design: Design) -> Iterator[Verdict]:
    # Without a required normal force: a finding if no coil responds to the full load of data sheet and calibration.
    # Whether each coil responds enough is not known.
    yield not_checked("no-requirement", keys=["requirements.normal_force"])
    if not rests_on_pad(design.spec):
        return
    full = full_normal_force(design.spec)
    requirements = replace(design.spec.requirements, normal_force=full)
    loaded = design.drawn(replace(design.spec, requirements=requirements))
    numbers = estimate_layout(loaded.layout, is_solved=design.estimates.is_solved)
    changes = responses(numbers.coils, numbers.readout.conversion)
    if changes and _are_all_lost(changes):
        best = max(changes, key=lambda response: response.steps)
        numbers, spec = design.estimates, design.spec
        change = _larger_change_hint(spec.readout, numbers.readout.conversion, numbers.coils, spec.target, best.steps)
        yield violation_of(
            "nothing-felt", "elastomer.thickness", best.steps, FEWEST_STEPS, "steps", hint=change.case,
            details=("full-load",), severity=Severity.ERROR, force=full, state=PRESSED, changes=_change_texts(changes),
            sigmas=DETECTION_SIGMAS, noise=best.noise, strain=USUAL_STRAIN, rate=change.rate, devices=change.devices,
        )


def _change_texts(deaf: Sequence[SignalChange]) -> list[str]:
    """Return a text for each change: the coil, the change in henries, and the change in converter steps."""
    return [f"{r.coil} {show(r.change, 'H', 3)} ({r.steps:.2g} steps of {show(r.step, 'H', 3)})" for r in deaf]


def _cover_all_coils(spec: SensorSpec) -> tuple[Family, ...]:
    """Return the family of changes that moves the target over the middle of the coils.

    If the target lies there already, the family enlarges it until it covers all coils.
    """
    target = spec.target
    assert target is not None
    length, width = (reach + max(spec.coil.size) for reach in span_over_coils(spec, target))
    if any(target.offset):
        return (partial(centred_plates, spec),)
    return (partial(larger_target, spec, length, width),)


@record
class _LargerChangeHint:
    """Hint with ways to a larger change of inductance.

    ``case`` is the key of the hint in ``data/messages.csv``. ``rate`` is the proposed scan rate as text, and
    ``devices`` are the names of the proposed converters; each is empty if the hint has none.
    """

    case: str
    rate: str = ""
    devices: tuple[str, ...] = ()


def _larger_change_hint(
    readout: ReadoutSpec, conversion: Conversion | None, coils: Sequence[CoilEstimate], target: Target | None,
    steps: float,
) -> _LargerChangeHint:
    """Return the hint on how to make the change larger or the converter's step finer.

    `steps` is the present change in converter steps. Longer conversions are advised only if the result has enough bits
    for them.
    """
    device, states = readout.device, [state.frequency for coil in coils for state in coil.states.values()]
    if target is not None and any(target.offset):
        return _LargerChangeHint("change-offset")
    if conversion is not None and any(map(conversion.rounding, states)):
        converters = map(presets.converter, presets.names("converter"))
        return _LargerChangeHint("change-bits", devices=tuple(
            o.name for o in converters
            if o.law is device.law and o.bits > device.bits and o.channels >= device.channels))
    rate = _slower_scan_rate(conversion, readout, len(coils), steps)
    return _LargerChangeHint("change-scans") if rate is None else _LargerChangeHint("change-rate", f"{rate:g} Hz")


def _slower_scan_rate(
    conversion: Conversion | None, readout: ReadoutSpec, coil_count: int, steps: float
) -> float | None:
    """Return the scan rate (Hz, a whole number) at which the change reaches `FEWEST_STEPS` converter steps.

    `steps` is the change in steps at the present rate. The number of steps is inversely proportional to the rate. The
    result is at most the rate at which the results of `coil_count` coils can be read over I2C. None if the needed
    conversion is longer than the longest possible conversion, or if the rate is below 1 Hz.
    """
    if conversion is None or conversion.conversion_time * FEWEST_STEPS > conversion.longest_conversion * steps:
        return None
    readable = 1.0 / readout.device.read_back_time(coil_count)
    rate = math.floor(min(readable, readout.scan_rate * steps / FEWEST_STEPS))
    return float(rate) if rate >= 1 else None


def small_signal(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the strongest coil's relative signal is small compared with the drift with temperature.

    The signal is the relative change of the reading over the required force. The limit is lower if the readings are
    compensated for temperature. For a sensor with cells, the cell with the smallest signal is checked.
    """
    coil_signals = design.estimates.signals
    yield from failed_state_reasons(design.estimates.coils, "signal over the required force")
    if not coil_signals:
        yield not_checked("no-change", state=PRESSED)
        return
    cells, strongest = design.spec.cell_placements, dict[int, Signal]()  # by cell
    numbers = {place.name: k for k, cell in enumerate(cells, 1) for place in cell}
    for signal in sorted(coil_signals, key=lambda signal: -abs(signal.share)):
        strongest.setdefault(numbers[signal.coil], signal)
    number, best = min(strongest.items(), key=lambda pair: abs(pair[1].share))
    is_compensated = design.spec.readout.compensation is not None
    least = constant_limits()["least_signal_compensated" if is_compensated else "least_signal"]
    if abs(best.share) >= least.value:
        return
    spec = design.spec
    has_metal = spec.shield is not None or spec.metal is not None
    drift, share = constant_limits()["drift_of_ten_kelvin"].value, abs(best.share)
    is_enough = share >= constant_limits()["least_signal_compensated"].value
    compensating = (partial(temperature_sensors, spec),) if is_enough else ()
    yield violation_of(
        "small-signal-cell" if len(cells) > 1 else "small-signal", "elastomer.thickness", share, least.value,
        source=least.source, fixes=(*families_for_more_signal(spec), *compensating),
        details=(*["small-signal"] * (len(cells) > 1), *["small-signal-steps"] * bool(best.steps),
                 *["small-signal-loss"] * best.has_loss_in_it),
        cell=number, coil=best.coil, force=best.force, inductance=best.by_inductance, per_newton=best.per_newton,
        frequency=best.frequency_share, drift=drift, scale=drift / share if share else math.inf,
        steps=best.steps or 0.0, hint="small-signal",
        ways=_more_signal_texts(spec.target, spec.array.placements, max(spec.coil.size), pad_cut_to_target(spec),
                                has_metal),
    )


def _more_signal_texts(
    target: Target | None, placements: tuple[CoilPlacement, ...], length: float, narrower: Fix | None, has_metal: bool
) -> list[str]:
    """Return texts of advice for a larger change over the force. Advice that the spec has no room for is left out.

    `length` is the longer side (m) of a coil. `narrower` is the change to a pad cut to its target, None if the pad is
    no larger. `has_metal` states whether metal lies behind the coils.
    """
    coils = [p.centre for p in placements]
    is_offset = target is not None and any(target.offset)
    changes = ["target.offset: [0, 0] over the middle of the coils"] * is_offset
    changes += ["a softer elastomer", "one of another thickness"]
    if narrower is not None:
        changes.append(f"a pad no wider than the target ({narrower.words})")
    if target is not None:
        whole = [max(c[k] for c in coils) - min(c[k] for c in coils) + length for k in (0, 1)]
        if min(target.size) < min(whole) or max(target.size) < max(whole):
            changes.append("a larger target")
    if has_metal:
        changes.append("more distance from the metal behind the coils")
    return changes


AXES = ("x", "y")


def shear_response(design: Design) -> Iterator[Verdict]:
    """Yield findings if the required shear changes all coils nearly equally, or less than one degree of tilt does.

    Each axis along which the array has coils at different positions is checked.
    """
    spec, target, force = design.spec, design.spec.target, design.spec.requirements.shear_force
    assert force is not None and target is not None
    # the array can measure shear only along axes (0: x, 1: y) on which the coils have different positions
    centres = [placement.centre for placement in spec.array.placements]
    axes = [k for k in (0, 1) if max(c[k] for c in centres) - min(c[k] for c in centres) > ROUNDING]
    if not axes:
        yield not_checked("shear-one-coil")
        return
    if any(spec.requirements.moments):
        axes = [k for k in axes if f"shear_{AXES[k]}" in measured_axes(spec.cell_placements[0], spec.requirements)]
        if not axes:
            yield not_checked("shear-moments")
            return
    if not rests_on_pad(spec):
        yield not_checked("beside-pad")
        return
    # held level and not pressed: the smallest move by the force
    normal = spec.requirements.normal_force or 0.0
    poses, _ = loaded_poses(spec, np.array([(0.0, force, 0.0), (0.0, 0.0, force), (normal, 0.0, 0.0)]))
    travels = float(poses[0, 0]), float(poses[1, 1])
    rest = [coil.states[REST] for coil in design.estimates.coils if REST in coil.states]
    steps = [state.quantum for state in rest if state.quantum]
    if not steps:
        yield not_checked("no-rest")
        return
    moves = [(travels[0], 0.0), (0.0, travels[1])]
    by_moves = _moved_changes(design, moves, rest[0].frequency)
    changes = responses(design.estimates.coils, design.estimates.readout.conversion)
    pressed, middles = max((abs(change.change) for change in changes), default=0.0), overlap_centres(spec)
    for axis in axes:
        moved = by_moves[axis]
        apart = max(moved) - min(moved)
        edges = _edge_hint(target, axis, span_over_coils(spec, target)[axis], min(spec.coil.size))
        minimum = max(FEWEST_STEPS, LEAST_SHARE * pressed / max(steps))
        if apart / max(steps) < minimum:
            yield violation_of(
                "shear-weak", "target.size", apart / max(steps), minimum, "steps", hint=edges.case,
                fixes=_nearer_edges(spec), details=(*["shear-normal"] * bool(pressed), *edges.details), force=force,
                travel=travels[axis], difference=apart, fewest=FEWEST_STEPS, share=LEAST_SHARE, pressed=pressed,
                axis=AXES[axis], apart=edges.apart, beyond=edges.beyond,
            )
            continue
        reading = _tilt_reading(middles, axis, force, apart, pressed, -float(poses[2, 2]))
        if reading > force:
            yield violation_of("shear-tilt", "target.size", reading, force, "N", hint=edges.case,
                               fixes=_nearer_edges(spec), details=edges.details, axis=AXES[axis], other=AXES[1 - axis],
                               apart=edges.apart, beyond=edges.beyond)


def _moved_changes(design: Design, moves: Sequence[tuple[float, float]], frequency: float) -> list[list[float]]:
    """Return changes (moves, coils; H) of inductance if the level target is moved from rest by each of `moves`.

    A move is (x, y) in metres. `frequency` is in Hz. If the target is too large for the field solver, the model of a
    finite plate is used.
    """
    if design.estimates.is_solved:
        poses = np.zeros((1 + len(moves), 6))
        poses[1:, :2] = moves
        inductances = design.response.own_inductance_changes(poses, frequency).real
    else:
        inductances = target_effects(design.layout, [(0.0, 0.0), *moves], [0.0], frequency)[0]
    return [[float(value) for value in row] for row in inductances[1:] - inductances[0]]


def _tilt_reading(
    middles: Sequence[Point], axis: int, force: float, apart: float, pressed: float, travel: float
) -> float:
    """Return the shear force (N) that the sensor reads if the target tilts by one degree. 0 if it is unknown.

    The tilt is along `axis` (0: x, 1: y). `middles` (m) are the centres of the parts of the target over each coil.
    `pressed` (H) is the change of the strongest coil due to the normal force, and `travel` (m) the pad's compression by
    this force. `apart` (H) is the difference between the changes of the coils due to the shear force `force` (N).

    Notes
    -----
    Over each coil, the tilted target counts as a level target. Its height is the height of the target's part over this
    coil. The change per height is `pressed` / `travel`. The result agrees within a fifth with the data sheet's error
    due to tilt.
    """
    if travel <= 0.0 or apart <= 0.0:
        return 0.0
    places = [(middle.x, middle.y)[axis] for middle in middles]
    return force * (pressed / travel) * (max(places) - min(places)) * math.tan(DEGREE) / apart


def _nearer_edges(spec: SensorSpec) -> tuple[Family, ...]:
    # Targets that end nearer to the coils' middles, and coils farther apart. Over two coils in a line only changes
    # that SIT306 requires, too: first a target as long as the distance of the coils.
    def fitting(fixes: Iterable[Fix]) -> list[Fix]:
        fitting_fixes = [fix for fix in fixes if is_as_long_as_line(fix.spec.array, fix.spec.target)]
        return fitting_fixes[::-1] if len(spec.array.placements) == 2 else fitting_fixes

    return lambda: fitting(smaller_targets(spec)), lambda: fitting(wider_arrays(spec))


@record
class _EdgeHint:
    """Hint on the place to which the target's edges must move.

    ``case`` is the key of the hint in ``data/messages.csv``, and ``details`` are the keys of its details. ``apart`` is
    the distance (m) between the centres of the outer coils. ``beyond`` is the length (m) by which the target extends
    past these centres, negative if it ends before them.
    """

    case: str
    details: tuple[str, ...] = ()
    apart: float = 0.0
    beyond: float = 0.0


def _edge_hint(target: Target, axis: int, apart: float, side: float) -> _EdgeHint:
    """Return the hint on the place to which the target's edges must move, for a larger signal by shear along `axis`.

    `apart` is twice the largest distance (m) of a coil's centre from the target's middle along the axis. `side` is the
    shorter side (m) of a coil.
    """
    if abs(math.sin(target.rotation)) > 1e-9 and not target.outline.is_disc:
        return _EdgeHint("edges-rotated")
    beyond = 0.5 * (target.size[axis] - apart)
    return _EdgeHint("edges", ("edges", *["edges-beyond"] * (beyond > 0.25 * side)), apart, beyond)


DEGREE = math.radians(1.0)


RULES: tuple[Rule, ...] = (
    rule_of(
        "SIT215", coil_response, "target", "elastomer", fewest_steps=FEWEST_STEPS, least_share=100.0 * LEAST_SHARE,
        told_from_noise=DETECTION_SIGMAS,
    ),
    rule_of(
        "SIT217", small_signal, "target", "elastomer", "normal force",
        least_compensated=100.0 * constant_limits()["least_signal_compensated"].value,
        least_signal=100.0 * constant_limits()["least_signal"].value,
        drift_of_ten_kelvin=100.0 * constant_limits()["drift_of_ten_kelvin"].value,
        signal_source=constant_limits()["least_signal"].source,
    ),
    rule_of(
        "SIT218", shear_response, "target", "elastomer", "shear force", fewest_steps=FEWEST_STEPS,
        least_share=100.0 * LEAST_SHARE,
    ),
)
