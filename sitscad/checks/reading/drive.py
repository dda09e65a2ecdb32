"""SIT204: the oscillation amplitude of every coil at the drive current, against the converter's low-noise window."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from sitscad.basics.finding import Severity
from sitscad.basics.units import show
from sitscad.checks.reading.readings import (
    NEAR,
    Reading,
    in_sigmas,
    is_short_alone,
    more_distance,
    near_limit,
    readings_of,
    sigmas_between,
    undecided,
    where,
    worst_of,
)
from sitscad.checks.rules import Rule, Undecided, Verdict, Violation, joined, rule_of
from sitscad.estimates.design import Design, at_room_temperature

CODE_KEY = "readout.drive_code"
"""Key of findings that another drive code mends.

If the chosen code is too weak, the finding is at the turns, which determine R_P.
"""

CODE_IS_SET = "the spec sets this drive code (readout.drive_code)"


def drive_amplitude(design: Design) -> Iterator[Verdict]:
    """Yield findings on the amplitude at the chosen drive code, in the states of the assembled sensor."""
    readout = design.estimates.readout
    if readout.high_current:
        yield from _high_current_amplitude(design)
        return
    yield from undecided(design, "amplitude")
    if readout.drive_code is None:
        return
    said = [*_too_strong(design, worst_of(design, "amplitude", max, True)),
            *_too_weak(design, worst_of(design, "amplitude", min, True))]
    yield from (each for each in said if not each.keeps_limit)
    # notes and warnings on one drive code become one finding: separate findings could ask for a weaker
    # code and for a stronger code. Place and values are from the gravest finding
    near = [*(each for each in said if each.keeps_limit), *_copper_ends(design)]
    if near:
        gravest = min(near, key=lambda aside: list(Severity).index(aside.severity or Severity.NOTE))
        yield replace(gravest, message=joined(*dict.fromkeys(aside.message for aside in near)),
                      detail=joined(*(aside.detail for aside in near)),
                      hint=joined("measure the amplitude of the first boards", *(str(aside.hint) for aside in near),
                                  code_advice(design, (NEAR,))))


def serving_codes(design: Design, sigmas: float) -> list[int]:
    """Return the drive codes that keep the amplitudes of all coils and states in the low-noise window.

    Each amplitude keeps both limits by some standard deviations of manufacture, and the upper limit with the thickest
    copper. The code nearest to the present code is first.
    """
    converter, readings = design.spec.readout.device, readings_of(design, "amplitude", True)
    low, high = converter.limit("amplitude_optimum_min"), converter.limit("amplitude_max")
    states = {(coil.name, name): state for coil in design.estimates.coils for name, state in coil.states.items()}
    ends = []  # the smallest and the largest amplitude of each reading, and the drive current for which they hold
    for reading in readings:
        margin, spread = sigmas * (reading.sigma or 0.0), states[reading.coil, reading.state].spread
        thickest = 0.0 if spread is None else (
            reading.value * spread.thickest_copper / states[reading.coil, reading.state].parallel_resistance)
        ends.append((reading.value - margin, reading.value + max(margin, thickest),
                     converter.drive_currents[_code(design, reading)]))
    now = design.estimates.readout.drive_code or 0
    codes = [code for code, current in enumerate(converter.drive_currents)
             if all(low <= least * current / at and most * current / at <= high for least, most, at in ends)]
    return sorted(codes, key=lambda code: abs(code - now))


def code_advice(design: Design, sigmas: tuple[float, ...] = (NEAR, 0.0)) -> str:
    """Return advice on the drive code: a code that keeps both limits, or the statement that no code does.

    `sigmas` are the margins to try, in standard deviations of manufacture.
    """
    limit = design.spec.readout.device.limit
    window = f"{show(limit('amplitude_optimum_min'), 'V')} to {show(limit('amplitude_max'), 'V')}"
    for margin in sigmas:
        by = f" by {margin:g} sigma" if margin else ""
        if codes := serving_codes(design, margin):
            return f"drive code {codes[0]} keeps {window} in every state{by}"
    return f"no drive code keeps {window} in every state" + (f" by {min(sigmas):g} sigma" if min(sigmas) else "")


def _copper_ends(design: Design) -> Iterator[Violation]:
    # The amplitude with the thinnest and the thickest copper delivered, if either amplitude leaves the window
    # although the board as drawn keeps it: no test of the bare board detects such copper.
    limit = design.spec.readout.device.limit
    low, high = limit("amplitude_optimum_min"), limit("amplitude_max")
    states = [
        (state.amplitude, state.amplitude * state.spread.thickest_copper / state.parallel_resistance, reading)
        for coil in design.estimates.coils
        for reading in readings_of(design, "amplitude", True)
        if reading.coil == coil.name
        and (state := coil.states[reading.state]).amplitude is not None
        and state.spread is not None
    ]
    thick = max(states, key=lambda each: each[0] + each[1], default=None)
    thin = min(states, key=lambda each: each[0] - each[1], default=None)
    if thick is not None and thick[0] <= high < thick[0] + thick[1]:
        yield Violation(
            "with the thickest copper that is delivered (foil and plating both at their ends) the tank of "
            f"{where(thick[2])} would swing {show(thick[0] + thick[1], 'V', 3)} peak with drive code "
            f"{_code(design, thick[2])}, beyond {show(high, 'V')}",
            "", CODE_KEY, thick[0] + thick[1], high, "V", severity=Severity.WARNING,
        )
    if thin is not None and thin[0] - thin[1] < low <= thin[0]:
        yield Violation(
            f"with the thinnest copper that is delivered the tank of {where(thin[2])} would swing "
            f"{show(thin[0] - thin[1], 'V', 3)} peak with drive code {_code(design, thin[2])}, below the low-noise "
            f"window from {show(low, 'V')} on: no code serves both ends of the copper",
            "choose the code by the amplitude that the boards of a batch show: they have one foil and one plating",
            CODE_KEY, thin[0] - thin[1], low, "V", severity=Severity.NOTE,
        )


def _too_strong(design: Design, largest: Reading | None) -> Iterator[Violation]:
    """Yield a finding if the largest amplitude is above the clamping limit, or below it by little.

    The same drive code is also checked at power-up at room temperature.
    """
    converter, readout = design.spec.readout.device, design.spec.readout
    high, source = converter.limit("amplitude_max"), converter.limits["amplitude_max"].source
    clamps = f"above {show(high, 'V')} the input clamps and shifts the frequency"
    if largest is not None and largest.value > high * (1.0 + 1e-9):
        code = _code(design, largest)
        hint = f"{code_advice(design)}; or use a coil whose R_P changes less between its states"
        if readout.drive_code is not None:
            hint = f"{CODE_IS_SET}: {code_advice(design)}"
        if code == 0:
            largest_load = show(converter.limit("parallel_resistance_max"), "ohm")
            hint = (f"even the weakest drive is too strong: put {largest_load} in parallel with the sensor (data sheet "
                    f"{converter.source_of('cite_drive')})")
        yield Violation(
            f"with drive code {code} the tank of {where(largest)} swings {show(largest.value, 'V', 3)} peak; {clamps}",
            hint, CODE_KEY, largest.value, high, "V", source=source,
            sigma=sigmas_between(largest, high), detail=in_sigmas(largest, high, "V"),
        )
        return
    if largest is not None:
        yield from near_limit(largest, high, "V", "amplitude", "", CODE_KEY)
    cold = at_room_temperature(design)
    if cold is design:
        return
    resistances = readings_of(cold, "parallel_resistance", True)
    swings = [(converter.amplitude(r.value, _code(design, r)), r) for r in resistances]
    swing, widest = max(swings, key=lambda pair: pair[0], default=(0.0, None))
    if widest is not None and swing > high:
        careful = converter.drive_code(widest.value + (widest.sigma or 0.0))
        yield Violation(
            f"switched on at 20 degC, the tank of {where(widest)} swings {show(swing, 'V', 3)} peak with drive code "
            f"{_code(design, widest)}, which is chosen for {design.estimates.temperature:g} degC; {clamps}",
            f"begin with drive code {careful}, and change when the sensor is warm", "requirements.temperature", swing,
            high, "V", severity=Severity.WARNING, source=source,
        )


def _too_weak(design: Design, smallest: Reading | None) -> Iterator[Violation]:
    """Yield a finding if the smallest amplitude is below the low-noise window, or above it by little.

    Below a second limit, the oscillation may stop.
    """
    limit = design.spec.readout.device.limit
    optimum, high = limit("amplitude_optimum_min"), limit("amplitude_max")
    if smallest is None:
        return
    code = _code(design, smallest)
    if smallest.value >= optimum:
        yield from near_limit(smallest, optimum, "V", "amplitude", "", CODE_KEY)
        return
    name, severity = "amplitude_stable_min", None
    window = f"below {show(limit(name), 'V')} the oscillation may stop"
    if smallest.value >= limit(name):
        name, severity = "amplitude_optimum_min", Severity.WARNING
        window = f"{show(optimum, 'V')} to {show(high, 'V')} is the low-noise window"
    yield Violation(
        f"with drive code {code} the tank of {where(smallest)} swings only {show(smallest.value, 'V', 3)} peak; "
        f"{window}", _weak_advice(design, smallest),
        "coil.turns" if design.spec.readout.drive_code is None else CODE_KEY, smallest.value, limit(name), "V",
        severity, design.spec.readout.device.limits[name].source, sigma=sigmas_between(smallest, limit(name)),
        detail=in_sigmas(smallest, limit(name), "V"),
    )


def _code(design: Design, reading: Reading) -> int:
    names = [coil.name for coil in design.estimates.coils]
    code = design.estimates.readout.code_of(names.index(reading.coil))
    assert code is not None
    return code


def _high_current_amplitude(design: Design) -> Iterator[Verdict]:
    """Yield a finding with the amplitudes of the high-current drive, for which the maker's texts disagree.

    The smallest amplitude is at the lower current of the texts, the largest at the higher. Either may exceed its limit.
    """
    converter, (low_current, high_current) = design.spec.readout.device, design.spec.readout.device.high_current_range
    values = [reading.value for reading in readings_of(design, "parallel_resistance", True)]
    if not values:
        yield Undecided("no parallel resistance was estimated")
        return
    least = converter.amplitude_at(min(values), low_current)
    most = converter.amplitude_at(max(values), high_current)
    too_weak = least < converter.limit("amplitude_optimum_min")
    if too_weak or most > converter.limit("amplitude_max"):
        yield Violation(
            f"the high-current drive is {show(low_current, 'A')} or {show(high_current, 'A')}, as the maker's texts "
            f"disagree: the amplitude lies between {show(least, 'V', 3)} and {show(most, 'V', 3)} peak",
            "measure the amplitude at the converter's pins before trusting a reading", "coil.turns",
            least if too_weak else most, converter.limit("amplitude_optimum_min" if too_weak else "amplitude_max"), "V",
            severity=Severity.WARNING, source=converter.limits["high_current_max"].source,
        )


def _weak_advice(design: Design, smallest: Reading) -> str:
    """Return the reason why a coil's amplitude is too small, with advice.

    Its states differ, the coils differ, or R_P is too low even for the strongest drive.
    """
    if design.spec.readout.drive_code is not None:
        return f"{CODE_IS_SET}: {code_advice(design)}"
    away = more_distance(design.spec)
    distance = f"{away}, or more turns" if away else "more turns"
    values = readings_of(design, "parallel_resistance", True)
    own = [r.value for r in values if r.coil == smallest.coil]
    most = max(values, key=lambda r: r.value)
    if _code(design, smallest) == len(design.spec.readout.device.drive_currents) - 1:
        # the amplitude is the drive's current times R_P
        asked = min(own) * design.spec.readout.device.limit("amplitude_optimum_min") / smallest.value
        is_short = is_short_alone(design, smallest, "parallel_resistance", asked)
        larger = "take more turns or a larger coil, for the coil misses the limit in free air, too"
        ways = larger if is_short else distance
        return f"R_P, {show(min(own), 'ohm', 3)}, is too low even for the strongest drive: {ways}"
    within, between = max(own) / min(own), most.value / max(own)
    if between <= within:
        return (
            f"R_P of coil {smallest.coil} changes too much between its states ({show(max(own), 'ohm', 3)} to "
            f"{show(min(own), 'ohm', 3)}): {distance}"
        )
    return (
        f"R_P is {show(most.value, 'ohm', 3)} in coil {most.coil} and at most {show(max(own), 'ohm', 3)} in "
        f"{smallest.coil}: one drive current does not suit both, and with a current of its own for each coil (which "
        f"the converter can) some would still swing too little; place the coils alike under the target, or {distance}"
    )


RULES: tuple[Rule, ...] = (
    rule_of("SIT204", drive_amplitude),
)
