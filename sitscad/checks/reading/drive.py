"""SIT204: the oscillation amplitude of every coil at the drive current, against the converter's low-noise window."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from sitscad.basics.finding import Severity
from sitscad.checks.reading.readings import (
    NEAR,
    Reading,
    all_readings,
    coil_state_text,
    is_below_limit_in_air,
    missing_value_reasons,
    more_distance_text,
    near_limit_findings,
    point_to_own_windings,
    worst_beyond_limit,
    worst_reading,
)
from sitscad.checks.rules import Rule, Verdict, Violation, join_texts, not_checked, rule_of, violation_of
from sitscad.estimates.design import Design, at_room_temperature
from sitscad.kernels.converters.converter import Converter

if TYPE_CHECKING:
    from sitscad.estimates.coil_estimates import CoilEstimate, ReadoutEstimate

CODE_KEY = "readout.drive_code"
"""Key of the spec to which a finding points if another drive code removes it.

If the drive code that sitscad chose is too weak, the finding points to the turns, which determine the parallel
resistance.
"""


def drive_amplitude(design: Design) -> Iterator[Verdict]:
    """Yield findings on the oscillation amplitude at the chosen drive code, in all states of the assembled sensor."""
    device, readout, coils = design.spec.readout.device, design.estimates.readout, design.estimates.all_coils
    if readout.high_current:
        yield from _high_current_findings(device, coils)
        return
    yield from missing_value_reasons(coils, "amplitude")
    if readout.drive_code is None:
        return
    spec = design.spec
    distance = more_distance_text(spec.target, spec.shield, spec.jaw, spec.metal)
    violations = [*_strong_drive_findings(design, worst_reading(coils, "amplitude", max, True)),
                  *_weak_drive_findings(device, readout, coils, worst_reading(coils, "amplitude", min, True),
                                        is_set=design.spec.readout.drive_code is not None, distance=distance)]
    yield from (each for each in violations if not each.keeps_limit)
    # notes and warnings on one drive code become one finding: separate findings could ask for a weaker
    # code and for a stronger code. Place and values are from the gravest finding
    near = [*(each for each in violations if each.keeps_limit), *_copper_thickness_findings(device, readout, coils)]
    if near:
        gravest = min(near, key=lambda violation: list(Severity).index(violation.severity or Severity.NOTE))
        texts = [text for each in near if each is not gravest for text in (each.text("message"), each.text("detail"))]
        code, _ = suitable_code(device, readout, coils, (NEAR,))
        yield replace(
            gravest, hint_case="code-near-none" if code is None else "code-near",
            details=(*gravest.details, *["amplitude-others"] * bool(texts)),
            values={**gravest.values, "others": join_texts(*dict.fromkeys(texts)), "serving": code, "margin": NEAR,
                    "low": device.limit("amplitude_optimum_min"), "high": device.limit("amplitude_max")},
        )


def suitable_codes(
    converter: Converter, readout: ReadoutEstimate, coils: Sequence[CoilEstimate], sigmas: float, name: str = "",
) -> list[int]:
    """Return the drive codes with which the oscillation amplitudes lie in the converter's low-noise window.

    If `name` is given, only the coil of this name is tested, otherwise all coils. Each amplitude must meet both limits
    with a margin of `sigmas` standard deviations (manufacturing). It must also meet the upper limit with the thickest
    copper that the fabricator may deliver. The code nearest to the present code is first.
    """
    readings = all_readings(coils, "amplitude", True)
    low, high = converter.limit("amplitude_optimum_min"), converter.limit("amplitude_max")
    states = {(coil.name, name): state for coil in coils for name, state in coil.states.items()}
    ends = []  # the smallest and the largest amplitude of each reading, and the drive current for which they hold
    for reading in readings:
        if name and reading.coil != name:
            continue
        margin, scatter = sigmas * (reading.sigma or 0.0), states[reading.coil, reading.state].spread
        thickest = 0.0 if scatter is None else (
            reading.value * scatter.thickest_copper / states[reading.coil, reading.state].parallel_resistance)
        ends.append((reading.value - margin, reading.value + max(margin, thickest),
                     converter.drive_currents[_drive_code(readout, coils, reading)]))
    now = readout.drive_code or 0
    codes = [code for code, current in enumerate(converter.drive_currents)
             if all(low <= least * current / at and most * current / at <= high for least, most, at in ends)]
    return sorted(codes, key=lambda code: abs(code - now))


def suitable_code(
    converter: Converter, readout: ReadoutEstimate, coils: Sequence[CoilEstimate],
    margins: tuple[float, ...] = (NEAR, 0.0),
) -> tuple[int | None, float]:
    """Return (drive code, margin) for a code with which the amplitudes of all coils lie in the low-noise window.

    The margin to both limits is in standard deviations (manufacturing). It is the first of `margins` that any code
    meets. The code is None, and the margin 0, if no code meets the limits with any of these margins.
    """
    for margin in margins:
        if codes := suitable_codes(converter, readout, coils, margin):
            return codes[0], margin
    return None, 0.0


def _code_hint(
    converter: Converter, readout: ReadoutEstimate, coils: Sequence[CoilEstimate], serving: int | None, margin: float,
    is_set: bool,
) -> str:
    """Return the key of the hint in ``data/messages.csv``: a drive code for all coils, one for each coil, or none.

    `serving` is the code that suits all coils, None if no code does. `margin` is its margin to the limits in standard
    deviations (manufacturing). `is_set` is True if the spec sets the drive code.
    """
    if serving is not None:
        return "code-serves-margin" if margin else "code-serves"
    is_apart = is_set and len(coils) > 1 and all(
        suitable_codes(converter, readout, coils, 0.0, coil.name) for coil in coils)
    return "code-apart" if is_apart else "code-none"


def _copper_thickness_findings(
    converter: Converter, readout: ReadoutEstimate, coils: Sequence[CoilEstimate]
) -> Iterator[Violation]:
    # The amplitude with the thinnest and the thickest copper delivered, if either amplitude leaves the window
    # although the board as drawn keeps it: no test of the bare board detects such copper.
    low, high = converter.limit("amplitude_optimum_min"), converter.limit("amplitude_max")
    readings = all_readings(coils, "amplitude", True)
    states = [
        (state.amplitude, state.amplitude * state.spread.thickest_copper / state.parallel_resistance, reading)
        for coil in coils
        for reading in readings
        if reading.coil == coil.name
        and (state := coil.states[reading.state]).amplitude is not None
        and state.spread is not None
    ]
    thick = max(states, key=lambda each: each[0] + each[1], default=None)
    thin = min(states, key=lambda each: each[0] - each[1], default=None)
    if thick is not None and thick[0] <= high < thick[0] + thick[1]:
        yield violation_of(
            "copper-thick", CODE_KEY, thick[0] + thick[1], high, "V", severity=Severity.WARNING,
            where=coil_state_text(thick[2]), code=_drive_code(readout, coils, thick[2]),
        )
    if thin is not None and thin[0] - thin[1] < low <= thin[0]:
        yield violation_of(
            "copper-thin", CODE_KEY, thin[0] - thin[1], low, "V", severity=Severity.NOTE,
            where=coil_state_text(thin[2]), code=_drive_code(readout, coils, thin[2]),
        )


def _strong_drive_findings(design: Design, largest: Reading | None) -> Iterator[Violation]:
    """Yield a finding if the largest amplitude exceeds the clamping limit, or is only little below it.

    The amplitude with the same drive code at power-up, at room temperature, is also checked.
    """
    converter, readout, coils = design.spec.readout.device, design.spec.readout, design.estimates.all_coils
    high, source = converter.limit("amplitude_max"), converter.limits["amplitude_max"].source
    if largest is not None and largest.value > high * (1.0 + 1e-9):
        numbers, is_set = design.estimates.readout, readout.drive_code is not None
        code = _drive_code(numbers, coils, largest)
        serving, margin = suitable_code(converter, numbers, coils)
        hint = "swing-weakest" if code == 0 else _code_hint(converter, numbers, coils, serving, margin, is_set)
        yield worst_beyond_limit(
            "swing-high", largest, high, "V", CODE_KEY, hint=hint, source=source,
            details=() if readout.drive_code is None else ("code-set",), code=code, serving=serving, margin=margin,
            low=converter.limit("amplitude_optimum_min"), high=high,
            load=converter.limit("parallel_resistance_max"), cite=converter.source_of("cite_drive"),
        )
        return
    if largest is not None:
        yield from near_limit_findings("near-amplitude", largest, high, "V", CODE_KEY)
    cold = at_room_temperature(design)
    if cold is design:
        return
    resistances = all_readings(cold.estimates.all_coils, "parallel_resistance", True)
    swings = [(converter.amplitude(r.value, _drive_code(design.estimates.readout, coils, r)), r) for r in resistances]
    swing, widest = max(swings, key=lambda pair: pair[0], default=(0.0, None))
    if widest is not None and swing > high:
        careful = converter.drive_code(widest.value + (widest.sigma or 0.0))
        yield violation_of(
            "swing-cold", "requirements.temperature", swing, high, "V", severity=Severity.WARNING, source=source,
            where=coil_state_text(widest), code=_drive_code(design.estimates.readout, coils, widest),
            temperature=design.estimates.temperature, careful=careful,
        )


def _weak_drive_findings(
    converter: Converter, readout: ReadoutEstimate, coils: Sequence[CoilEstimate], smallest: Reading | None, *,
    is_set: bool, distance: str,
) -> Iterator[Violation]:
    """Yield a finding if the smallest amplitude is below the low-noise window, or only little above its lower limit.

    Below a second, lower limit, the oscillation may stop. `is_set` is True if the spec sets the drive code. `distance`
    is advice for more distance from metal (`more_distance_text`).
    """
    limit = converter.limit
    optimum, high = limit("amplitude_optimum_min"), limit("amplitude_max")
    if smallest is None:
        return
    code = _drive_code(readout, coils, smallest)
    if smallest.value >= optimum:
        yield from near_limit_findings("near-amplitude", smallest, optimum, "V", CODE_KEY)
        return
    case, name, severity = "swing-stops", "amplitude_stable_min", None
    if smallest.value >= limit(name):
        case, name, severity = "swing-noisy", "amplitude_optimum_min", Severity.WARNING
    serving, margin = suitable_code(converter, readout, coils) if is_set else (None, 0.0)
    values = all_readings(coils, "parallel_resistance", True)
    resistances = [r.value for r in values if r.coil == smallest.coil]
    most = max(values, key=lambda r: r.value)
    changes = [*[distance] * bool(distance), "more turns"]
    # its states differ, the coils differ, or R_P is too low even for the strongest drive
    if is_set:
        hint = _code_hint(converter, readout, coils, serving, margin, is_set)
    elif code == len(converter.drive_currents) - 1:
        hint = "weak-drive"
        # the amplitude is the drive's current times R_P
        required = min(resistances) * optimum / smallest.value
        if is_below_limit_in_air(coils, smallest, "parallel_resistance", required):
            changes = ["more turns", "a larger coil"]
    else:
        hint = "weak-states" if most.value / max(resistances) <= max(resistances) / min(resistances) else "weak-coils"
    yield worst_beyond_limit(
        case, smallest, limit(name), "V", CODE_KEY if is_set else "coil.turns", hint=hint, severity=severity,
        details=("code-set",) if is_set else (), source=converter.limits[name].source, code=code,
        serving=serving, margin=margin, low=optimum, high=high, ways=changes, coil=smallest.coil,
        least=min(resistances), most=max(resistances), strongest=most.value, strongest_coil=most.coil,
    )


def _drive_code(readout: ReadoutEstimate, coils: Sequence[CoilEstimate], reading: Reading) -> int:
    names = [coil.name for coil in coils]
    code = readout.code_of(names.index(reading.coil))
    assert code is not None
    return code


def _high_current_findings(converter: Converter, coils: Sequence[CoilEstimate]) -> Iterator[Verdict]:
    """Yield a finding with the amplitudes of the high-current drive. Two texts of the maker state different currents.

    The smallest amplitude is computed with the lower current, the largest with the higher current. Either may exceed
    its limit.
    """
    low_current, high_current = converter.high_current_range
    values = [reading.value for reading in all_readings(coils, "parallel_resistance", True)]
    if not values:
        yield not_checked("no-estimate", quantity="parallel resistance")
        return
    least = converter.amplitude_at(min(values), low_current)
    most = converter.amplitude_at(max(values), high_current)
    too_weak = least < converter.limit("amplitude_optimum_min")
    if too_weak or most > converter.limit("amplitude_max"):
        yield violation_of(
            "high-current", "coil.turns", least if too_weak else most,
            converter.limit("amplitude_optimum_min" if too_weak else "amplitude_max"), "V", severity=Severity.WARNING,
            source=converter.limits["high_current_max"].source, least=least, most=most, low_current=low_current,
            high_current=high_current,
        )


RULES: tuple[Rule, ...] = (
    rule_of("SIT204", point_to_own_windings(drive_amplitude)),
)
