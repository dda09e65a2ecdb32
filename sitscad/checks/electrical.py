"""SIT201 to SIT206 and SIT214: what the LDC1614 sees, over every state that exists, against what it can drive."""

from __future__ import annotations

import math
from collections.abc import Iterator

from sitscad.checks.changes import capacitor, larger_capacitor, more_copper
from sitscad.checks.readings import (
    Reading,
    failed_states,
    in_sigmas,
    is_assembled,
    near_limit,
    nothing_estimated,
    other_states,
    overdamped_tank,
    readings_of,
    sigmas_between,
    source_of_limit,
    undecided,
    where,
    worst_of,
)
from sitscad.checks.rules import Complaint, Rule, Subject, Undecided, Verdict
from sitscad.finding import Severity
from sitscad.readout import ldc1614
from sitscad.units import show


def inductance_floor(subject: Subject) -> Iterator[Verdict]:
    """The smallest inductance over all coils and states."""
    floor = ldc1614.limit("inductance_min")
    yield from undecided(subject, "inductance")
    worst = worst_of(subject, "inductance", min)
    if worst is None:
        yield from nothing_estimated(subject)
        return
    if worst.value >= floor:
        yield from near_limit(worst, floor, "H", "inductance", "a few more turns make it safe", "coil.turns")
        return
    growth = floor / max(worst.value, 0.01 * floor)  # a coarse state can come out near or below zero
    yield Complaint(
        f"the inductance of {where(worst)} is "
        f"{show(worst.value, 'H')}{other_states(subject, worst, 'inductance', 'H')}; below {show(floor, 'H')} the "
        f"converter cannot measure it{in_sigmas(worst, floor, 'H')}",
        "inductance grows with the square of turns and layers: more of them, a larger coil, or more distance from "
        "target and jaw",
        "coil.turns",
        worst.value,
        floor,
        "H",
        sigma=sigmas_between(worst, floor),
        advice=lambda left: (
            f"inductance grows with the square of turns and layers: {more_copper(subject.spec, growth**0.5, left)}; "
            "more distance from target and jaw takes less of it away"
        ),
    )


def frequency_ceiling(subject: Subject) -> Iterator[Verdict]:
    """Highest and lowest sensor frequency over all coils and states."""
    low, high = ldc1614.limit("sensor_frequency_min"), ldc1614.limit("sensor_frequency_max")
    yield from undecided(subject, "frequency")
    worst = worst_of(subject, "frequency", max)
    if worst is not None and worst.value > high:
        from sitscad.estimates.tank import preferred_values  # only where a tank is too fast

        now = subject.estimates.readout.capacitance
        whole = next(coil.capacitance for coil in subject.estimates.coils if coil.name == worst.coil)
        wanted = now + whole * ((worst.value / (0.95 * high)) ** 2 - 1.0)
        larger = list(capacitor(subject.spec, [value for value in preferred_values() if value >= wanted][:3]))
        yield Complaint(
            f"the tank of {where(worst)} runs at {show(worst.value, 'Hz')}"
            f"{other_states(subject, worst, 'frequency', 'Hz')}; the converter stops at {show(high, 'Hz')}"
            f"{in_sigmas(worst, high, 'Hz')}",
            "a larger capacitor, or more turns",
            "readout.capacitance",
            worst.value,
            high,
            "Hz",
            sigma=sigmas_between(worst, high),
            advice=lambda left: larger_capacitor(larger, now, left),
        )
    else:
        hint = "the next larger capacitor of the series, or one of a closer tolerance"
        yield from near_limit(worst, high, "Hz", "frequency", hint, "readout.capacitance")
    lowest = worst_of(subject, "frequency", min)
    if lowest is not None and lowest.value < low:
        yield Complaint(
            f"the tank of {where(lowest)} runs at {show(lowest.value, 'Hz')}; the converter begins at "
            f"{show(low, 'Hz')}",
            "a smaller capacitor",
            "readout.capacitance",
            lowest.value,
            low,
            "Hz",
        )


def parallel_resistance(subject: Subject) -> Iterator[Verdict]:
    """The smallest R_P over all coils and states: what the driver can sustain, and what the data sheet specifies."""
    yield from undecided(subject, "parallel_resistance")
    yield from overdamped_tank(subject)
    worst = worst_of(subject, "parallel_resistance", min)
    if worst is None:
        return
    strong = subject.estimates.readout.high_current and len(subject.estimates.coils) == 1
    floor_name = "parallel_resistance_high_current" if strong else "parallel_resistance_driveable"
    floor, specified = ldc1614.limit(floor_name), ldc1614.limit("parallel_resistance_min")
    if worst.value >= specified:
        hint = "measure the first boards; a little more distance from target and jaw, or a turn more, makes it safe"
        yield from near_limit(worst, specified, "ohm", "parallel resistance", hint, "coil.layers")
        return
    is_error = worst.value < floor
    asked = floor if is_error else specified
    growth = (specified / worst.value) ** (1.0 / 3.0)
    why = (
        f"the strongest {'high-current ' if strong else ''}drive needs {show(floor, 'ohm')}"
        if is_error
        else f"the data sheet specifies from {show(specified, 'ohm')} up"
    )
    yield Complaint(
        f"the parallel resistance of {where(worst)} is {show(worst.value, 'ohm', 3)}"
        f"{other_states(subject, worst, 'parallel_resistance', 'ohm')}; {why}"
        f"{in_sigmas(worst, asked, 'ohm')}",
        f"R_P = (omega L)^2 / R grows with about the cube of turns and layers: more of them, a larger coil or a finer "
        f"pitch; {_distance_advice(subject, worst)}",
        "coil.layers",
        worst.value,
        asked,
        "ohm",
        Severity.ERROR if is_error else Severity.WARNING,
        ldc1614.limits()[floor_name if is_error else "parallel_resistance_min"].source,
        sigma=sigmas_between(worst, asked),
        advice=lambda left: (
            "R_P = (omega L)^2 / R grows with about the cube of turns and layers: "
            f"{more_copper(subject.spec, growth, left)}; {_distance_advice(subject, worst)}"
        ),
    )


def drive_amplitude(subject: Subject) -> Iterator[Verdict]:
    """The amplitude with the chosen drive code, in the states in which the sensor works."""
    readout = subject.estimates.readout
    if readout.high_current:
        yield from _high_current_amplitude(subject)
        return
    yield from undecided(subject, "amplitude")
    if readout.drive_code is None:
        return
    high, optimum = ldc1614.limit("amplitude_max"), ldc1614.limit("amplitude_optimum_min")
    stable = ldc1614.limit("amplitude_stable_min")
    largest, smallest = worst_of(subject, "amplitude", max, True), worst_of(subject, "amplitude", min, True)
    if largest is not None and largest.value > high * (1.0 + 1e-9):
        yield Complaint(
            f"with drive code {readout.drive_code} the tank of {where(largest)} swings {show(largest.value, 'V', 3)} "
            f"peak; above {show(high, 'V')} the input clamps and shifts the frequency{in_sigmas(largest, high, 'V')}",
            _clamp_advice(readout.drive_code),
            "readout",
            largest.value,
            high,
            "V",
            source=ldc1614.limits()["amplitude_max"].source,
            sigma=sigmas_between(largest, high),
        )
    else:
        hint = f"measure the amplitude of the first boards{_other_code(readout.drive_code - 1, 'weaker')}"
        yield from near_limit(largest, high, "V", "amplitude", hint, "readout")
        yield from _cold_amplitude(subject)
    if smallest is not None and smallest.value < optimum:
        below = smallest.value < stable
        yield Complaint(
            f"with drive code {readout.drive_code} the tank of {where(smallest)} swings only "
            f"{show(smallest.value, 'V', 3)} peak; "
            + (
                f"below {show(stable, 'V')} the oscillation may stop"
                if below
                else f"{show(optimum, 'V')} to {show(high, 'V')} is the low-noise window"
            )
            + in_sigmas(smallest, stable if below else optimum, "V"),
            "R_P changes too much between rest and pressed, or is too low: more distance from target and jaw, or more "
            "turns",
            "readout",
            smallest.value,
            stable if below else optimum,
            "V",
            Severity.ERROR if below else Severity.WARNING,
            ldc1614.limits()["amplitude_stable_min" if below else "amplitude_optimum_min"].source,
            sigma=sigmas_between(smallest, stable if below else optimum),
        )
    else:
        hint = f"measure the amplitude of the first boards{_other_code(readout.drive_code + 1, 'stronger')}"
        yield from near_limit(smallest, optimum, "V", "amplitude", hint, "readout")
    yield from _bare_coil_amplitude(subject)


def _cold_amplitude(subject: Subject) -> Iterator[Verdict]:
    """The same drive code when the sensor is switched on at room temperature."""
    cold, high = subject.at_room_temperature, ldc1614.limit("amplitude_max")
    largest = worst_of(cold, "parallel_resistance", max, True)
    if cold is subject or largest is None:
        return
    swing = _swing(subject, largest.value)
    if swing > high:
        yield Complaint(
            f"switched on at 20 degC, the tank of {where(largest)} swings {show(swing, 'V', 3)} peak with drive code "
            f"{subject.estimates.readout.drive_code}, which is chosen for {subject.estimates.temperature:g} degC; "
            f"above {show(high, 'V')} the input clamps and shifts the frequency",
            f"begin with drive code {ldc1614.drive_code(largest.value)}, and change when the sensor is warm",
            "requirements.temperature",
            swing,
            high,
            "V",
            Severity.WARNING,
            ldc1614.limits()["amplitude_max"].source,
        )


def _swing(subject: Subject, resistance: float) -> float:
    # Peak amplitude (V) of a parallel resistance (ohm) at the chosen drive code.
    code = subject.estimates.readout.drive_code
    assert code is not None
    return ldc1614.amplitude(resistance, code)


def _bare_coil_amplitude(subject: Subject) -> Iterator[Verdict]:
    """A note for the bench, at room temperature: the coil alone may swing too far with the assembled sensor's code."""
    bare = [r for r in readings_of(subject.at_room_temperature, "parallel_resistance") if r.state == "free"]
    worst = max(bare, key=lambda r: r.value, default=None)
    if worst is None or not is_assembled(subject):
        return
    swing = _swing(subject, worst.value)
    if swing <= ldc1614.limit("amplitude_max"):
        return
    yield Complaint(
        f"before assembly the bare coil {worst.coil} would swing {show(swing, 'V', 3)} peak with drive code "
        f"{subject.estimates.readout.drive_code}, which is chosen for the assembled sensor",
        f"to test a bare board, use drive code {ldc1614.drive_code(worst.value)}",
        "readout",
        swing,
        ldc1614.limit("amplitude_max"),
        "V",
        Severity.NOTE,
    )


def _high_current_amplitude(subject: Subject) -> Iterator[Verdict]:
    """TI's texts disagree on the high-current drive: say which amplitudes they lead to, and judge what is certain."""
    low_current, high_current = ldc1614.high_current_range()
    values = [r for r in readings_of(subject, "parallel_resistance", True)]
    if not values:
        yield Undecided("no parallel resistance was estimated")
        return
    least = 4.0 * min(r.value for r in values) * low_current / math.pi
    most = 4.0 * max(r.value for r in values) * high_current / math.pi
    if least < ldc1614.limit("amplitude_optimum_min") or most > ldc1614.limit("amplitude_max"):
        yield Complaint(
            f"the high-current drive is {show(low_current, 'A')} or {show(high_current, 'A')}, as TI's texts disagree: "
            f"the amplitude lies between {show(least, 'V', 3)} and {show(most, 'V', 3)} peak",
            "measure the amplitude at the converter's pins before trusting a reading",
            "readout",
            least,
            ldc1614.limit("amplitude_optimum_min"),
            "V",
            Severity.WARNING,
            ldc1614.limits()["high_current_max"].source,
        )


def quality_factor(subject: Subject) -> Iterator[Verdict]:
    """The smallest Q over all coils and states."""
    yield from undecided(subject, "quality_factor")
    floor = ldc1614.limit("quality_factor_min")
    worst = worst_of(subject, "quality_factor", min)
    if worst is not None and worst.value < floor:
        yield Complaint(
            f"the quality factor of {where(worst)} is "
            f"{worst.value:.3g}{other_states(subject, worst, 'quality_factor', '')}; below {floor:g} (a rule of "
            "thumb, unverified) the frequency follows the losses as well as the inductance",
            f"a smaller capacitor (higher frequency), wider or thicker tracks, or more turns; "
            f"{_distance_advice(subject, worst)}",
            "coil.trace_width",
            worst.value,
            floor,
            None,
        )


def self_resonance(subject: Subject) -> Iterator[Verdict]:
    """The sensor frequency as a share of the coil's own resonance."""
    shares = [
        (r.value / coil.self_resonance, r, coil.self_resonance)
        for coil in subject.estimates.coils
        for r in readings_of(subject, "frequency")
        if r.coil == coil.name and coil.self_resonance and math.isfinite(coil.self_resonance)
    ]
    yield from failed_states(subject, "share of the self-resonance")
    if not shares:
        yield Undecided("no self-resonance was estimated")
        return
    share, worst, resonance = max(shares, key=lambda entry: entry[0])
    binding, strict = ldc1614.limit("self_resonance_fraction"), ldc1614.limit("self_resonance_fraction_strict")
    if share <= strict:
        return
    is_error = share > binding
    asked = binding if is_error else strict
    yield Complaint(
        f"the tank of {where(worst)} runs at {show(worst.value, 'Hz')}, {100.0 * share:.0f} % of the coil's own "
        f"resonance at {show(resonance, 'Hz')}; at most {100.0 * asked:.0f} % is asked",
        "a larger capacitor lowers the frequency; fewer layers or a thicker dielectric raise the resonance",
        "readout.capacitance",
        share,
        asked,
        None,
        Severity.ERROR if is_error else Severity.WARNING,
        ldc1614.limits()["self_resonance_fraction" if is_error else "self_resonance_fraction_strict"].source,
    )


def tank_capacitor(subject: Subject) -> Iterator[Verdict]:
    """The capacitor within the range of TI's reference designs."""
    value = subject.estimates.readout.capacitance
    low, high = ldc1614.limit("capacitor_min"), ldc1614.limit("capacitor_max")
    if not math.isfinite(value):
        yield Undecided("no capacitor was chosen: no state of the coils could be estimated")
        return
    if not low <= value <= high:
        yield Complaint(
            f"the tank capacitor is {show(value, 'F', 3)}; TI's reference coils work with {show(low, 'F')} to "
            f"{show(high, 'F')}",
            "below it, pins and cable decide the frequency; above it, C0G parts are large and their own loss counts",
            "readout.capacitance",
            value,
            low if value < low else high,
            "F",
        )


# -------------------------------------------------------------------------------------------------------------- advice


def _distance_advice(subject: Subject, worst: Reading) -> str:
    if worst.state == "free":
        return "a higher sensor frequency (smaller capacitor) raises it too"
    standoff = "a larger mount.standoff (board higher over the metal), a copper shield or"
    mount = standoff if subject.spec.mount is not None else "or"
    return f"{mount} a thicker elastomer takes less of it away"


def _other_code(code: int, how: str) -> str:
    return f"; drive code {code} is the next {how}" if 0 <= code <= 31 else f"; there is no {how} drive"


def _clamp_advice(code: int) -> str:
    if code == 0:
        return "even the weakest drive is too strong: put 100 kohm in parallel with the sensor (data sheet 8.1.5)"
    return f"use drive code {code - 1} or lower, or a coil whose R_P changes less between its states"


ELECTRICAL_RULES: tuple[Rule, ...] = (
    Rule(
        "SIT201", "inductance-floor", Severity.ERROR,
        "Every coil keeps at least 0.2 uH in every state: alone, at rest, and pressed (a note within two sigma of "
        "manufacture). A coil of which no state can be estimated is an error, too.",
        "Below that the tank cannot be brought under 10 MHz with a resistance that the converter can drive.",
        "More turns or layers, a larger coil, or more distance from target and jaw.",
        source_of_limit("inductance_min"), apply=inductance_floor,
    ),
    Rule(
        "SIT202", "frequency-ceiling", Severity.ERROR,
        "The tank's frequency lies within 1 kHz to 10 MHz in every state (a note where 10 MHz are kept by less than "
        "two sigma of manufacture).",
        "The converter does not follow faster tanks; metal near the coil raises the frequency.",
        "A larger capacitor, or more inductance.",
        source_of_limit("sensor_frequency_max"), apply=frequency_ceiling,
    ),
    Rule(
        "SIT203", "parallel-resistance", Severity.ERROR,
        "In every state the tank oscillates and its parallel resistance is at least 1.0 kohm: a note where that is "
        "kept by less than two sigma of manufacture, a warning below, an error below 0.60 kohm (0.25 kohm in the "
        "high-current mode) or where it is overdamped.",
        "R_P = (omega L)^2 / R is the load on the driver. Below 0.60 kohm no drive code reaches 1.2 V (0.25 kohm in "
        "the single-channel high-current mode); below 1.0 kohm TI does not specify the converter. A metal jaw and the "
        "target lower it: a coil that passes in free air can fail in the jaw.",
        "More layers or turns, a higher frequency, thicker copper, a larger standoff, a copper shield before a steel "
        "jaw.",
        source_of_limit("parallel_resistance_driveable") + "; " + source_of_limit("parallel_resistance_min"),
        apply=parallel_resistance,
    ),
    Rule(
        "SIT204", "drive-amplitude", Severity.ERROR,
        "With the chosen drive code the tank swings 1.2 to 1.8 V peak in every state in which the sensor works: an "
        "error above 1.8 V and below 0.6 V, a warning below 1.2 V, a note where a limit is kept by less than two "
        "sigma of manufacture. A warning, too, if a sensor made for the heat swings beyond 1.8 V when switched on at "
        "20 degC, and in the high-current mode where TI's figures for its current leave the window open.",
        "Above 1.8 V an input clamp shifts the frequency; below 1.2 V the noise grows; below 0.6 V oscillation may "
        "stop. The code is the highest that stays below 1.8 V with the target at its farthest. For an assembled sensor "
        "the bare coil is not a working state and earns a note only.",
        "A coil whose R_P changes less between rest and pressed; then the code that suits it.",
        source_of_limit("amplitude_optimum_min"), apply=drive_amplitude,
    ),
    Rule(
        "SIT205", "quality-factor", Severity.WARNING,
        "The tank's quality factor is at least 10 in every state.",
        "With a low Q the frequency depends on the losses too, and the settling and the noise get worse.",
        "A higher frequency, less resistance, or more distance from lossy metal.",
        source_of_limit("quality_factor_min"), apply=quality_factor,
    ),
    Rule(
        "SIT206", "self-resonance", Severity.ERROR,
        "The tank runs below 0.8 of the coil's own resonance (0.75 by the older note, a warning).",
        "Near its own resonance a coil's inductance is no longer its own, and drifts with the dielectric.",
        "A larger capacitor, fewer layers, or a thicker dielectric.",
        source_of_limit("self_resonance_fraction") + "; " + source_of_limit("self_resonance_fraction_strict"),
        apply=self_resonance,
    ),
    Rule(
        "SIT214", "tank-capacitor", Severity.WARNING,
        "The tank capacitor lies within 47 pF to 3.3 nF.",
        "With less, pins, tail and cable decide the frequency and drift with every touch; with more, the part's own "
        "loss counts.",
        "More turns allow a smaller capacitor, fewer a larger one.",
        source_of_limit("capacitor_min"), apply=tank_capacitor,
    ),
)  # fmt: skip
