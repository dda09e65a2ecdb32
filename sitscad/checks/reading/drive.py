"""SIT204: the amplitude that the drive current gives every coil, against the window in which it is read well."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from sitscad.checks.reading.readings import (
    Reading,
    in_sigmas,
    more_distance,
    near_limit,
    readings_of,
    sigmas_between,
    undecided,
    where,
    worst_of,
)
from sitscad.checks.rules import Case, Rule, Undecided, Verdict, Violation, rule_of
from sitscad.design import Design
from sitscad.finding import Severity
from sitscad.units import show

CODE_KEY = "readout.drive_code"
"""Where a finding points that another drive code mends; where the code is chosen and too weak, it points at the turns,
which decide R_P.
"""


def drive_amplitude(design: Design) -> Iterator[Verdict]:
    """The amplitude with the chosen drive code, in the states in which the sensor works."""
    readout = design.estimates.readout
    if readout.high_current:
        yield from _high_current_amplitude(design)
        return
    yield from undecided(design, "amplitude")
    if readout.drive_code is None:
        return
    near: list[Violation] = []
    yield from _too_strong(design, worst_of(design, "amplitude", max, True), near)
    yield from _too_weak(design, worst_of(design, "amplitude", min, True), near)
    # what is to be known of one drive code beside its errors, as one finding: apart, one would ask for a weaker
    # code and another for a stronger one. Place and figures are those of the gravest
    near = [*near, *_copper_ends(design)]
    if not near:
        return
    gravest = min(near, key=lambda aside: list(Severity).index(aside.severity or Severity.NOTE))
    yield replace(gravest, message="; ".join(dict.fromkeys(aside.message for aside in near)),
                  detail="; ".join(aside.detail for aside in near if aside.detail),
                  hint="; ".join([MEASURE_FIRST, *(aside.hint for aside in near)]))


def _copper_ends(design: Design) -> Iterator[Violation]:
    """The amplitude with the thinnest and the thickest copper that is delivered, where one of them leaves the window
    although the board as drawn keeps it: no test of the bare board tells such copper from any other.
    """
    low, high = design.converter.limit("amplitude_optimum_min"), design.converter.limit("amplitude_max")
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
        yield THICK_COPPER.found(CODE_KEY, thick[0] + thick[1], high, "V", where=where(thick[2]),
                                 code=_code(design, thick[2]))
    if thin is not None and thin[0] - thin[1] < low <= thin[0]:
        yield THIN_COPPER.found(CODE_KEY, thin[0] - thin[1], low, "V", where=where(thin[2]),
                                code=_code(design, thin[2]))


def _too_strong(design: Design, largest: Reading | None, near: list[Violation]) -> Iterator[Verdict]:
    """The largest amplitude against what clamps; what keeps it by little goes to `near`."""
    high = design.converter.limit("amplitude_max")
    if largest is not None and largest.value > high * (1.0 + 1e-9):
        yield CLAMPED.found(CODE_KEY, largest.value, high, "V",
                            hint=_clamp_advice(_code(design, largest), design.spec.readout.drive_code is not None),
                            source=design.converter.limits["amplitude_max"].source, sigma=sigmas_between(largest, high),
                            code=_code(design, largest), where=where(largest), in_sigmas=in_sigmas(largest, high, "V"))
        return
    if largest is not None:
        near += near_limit(largest, high, "V", "amplitude", _other_code(_code(design, largest) - 1, "weaker"), CODE_KEY)
    yield from _cold_amplitude(design)


def _too_weak(design: Design, smallest: Reading | None, near: list[Violation]) -> Iterator[Verdict]:
    """The smallest amplitude against the low-noise window and what lets the tank stop; as `_too_strong`."""
    if smallest is None:
        return
    optimum, stable = design.converter.limit("amplitude_optimum_min"), design.converter.limit("amplitude_stable_min")
    if smallest.value >= optimum:
        near += near_limit(smallest, optimum, "V", "amplitude", _other_code(_code(design, smallest) + 1, "stronger"),
                           CODE_KEY)
        return
    below = smallest.value < stable
    asked = stable if below else optimum
    yield (MAY_STOP if below else TOO_WEAK).found(
        "coil.turns" if design.spec.readout.drive_code is None else CODE_KEY, smallest.value, asked, "V",
        hint=_weak_advice(design, smallest),
        source=design.converter.limits["amplitude_stable_min" if below else "amplitude_optimum_min"].source,
        sigma=sigmas_between(smallest, asked), code=_code(design, smallest), where=where(smallest),
        high=design.converter.limit("amplitude_max"), in_sigmas=in_sigmas(smallest, asked, "V"),
    )


def _cold_amplitude(design: Design) -> Iterator[Verdict]:
    """The same drive code when the sensor is switched on at room temperature."""
    cold, high = design.at_room_temperature, design.converter.limit("amplitude_max")
    if cold is design:
        return
    largest, swing = _widest(design, readings_of(cold, "parallel_resistance", True))
    if largest is not None and swing > high:
        yield CLAMPED_WHEN_COLD.found("requirements.temperature", swing, high, "V",
                                      source=design.converter.limits["amplitude_max"].source, where=where(largest),
                                      code=_code(design, largest), temperature=design.estimates.temperature,
                                      careful_code=design.converter.drive_code(largest.value + (largest.sigma or 0.0)))


def _code(design: Design, reading: Reading) -> int:
    """The drive code of a reading's coil."""
    names = [coil.name for coil in design.estimates.coils]
    code = design.estimates.readout.code_of(names.index(reading.coil))
    assert code is not None
    return code


def _widest(design: Design, resistances: list[Reading]) -> tuple[Reading | None, float]:
    """Of some parallel resistances the one that swings widest with its coil's drive code, and that amplitude (V)."""
    swings = [(design.converter.amplitude(r.value, _code(design, r)), r) for r in resistances]
    swing, found = max(swings, key=lambda pair: pair[0], default=(0.0, None))
    return found, swing


def _high_current_amplitude(design: Design) -> Iterator[Verdict]:
    """TI's texts disagree on the high-current drive: say which amplitudes they lead to, and judge what is certain."""
    low_current, high_current = design.converter.high_current_range
    values = [r for r in readings_of(design, "parallel_resistance", True)]
    if not values:
        yield Undecided("no parallel resistance was estimated")
        return
    least = design.converter.amplitude_at(min(r.value for r in values), low_current)
    most = design.converter.amplitude_at(max(r.value for r in values), high_current)
    too_weak = least < design.converter.limit("amplitude_optimum_min")
    if too_weak or most > design.converter.limit("amplitude_max"):
        yield UNSURE_DRIVE.found("coil.turns", least if too_weak else most,
                                 design.converter.limit("amplitude_optimum_min" if too_weak else "amplitude_max"), "V",
                                 source=design.converter.limits["high_current_max"].source, low_current=low_current,
                                 high_current=high_current, least=least, most=most)


# -------------------------------------------------------------------------------------------------------------- advice


def _other_code(code: int, how: str) -> str:
    """Which drive code lies next to one, or that there is none."""
    return f"drive code {code} is the next {how}" if 0 <= code <= 31 else f"there is no {how} drive"


def _weak_advice(design: Design, smallest: Reading) -> str:
    """Why a coil swings too little: its own states differ, the coils do, or its R_P is low for any drive."""
    if design.spec.readout.drive_code is not None:
        return "the spec sets this drive code; leave readout.drive_code out, and the code is chosen"
    away = more_distance(design)
    distance = f"{away}, or more turns" if away else "more turns"
    values = readings_of(design, "parallel_resistance", True)
    own = [r.value for r in values if r.coil == smallest.coil]
    most = max(values, key=lambda r: r.value)
    if _code(design, smallest) == 31:
        return f"R_P, {show(min(own), 'ohm', 3)}, is too low even for the strongest drive: {distance}"
    within, between = max(own) / min(own), most.value / max(own)
    if between <= within:
        return (
            f"R_P of coil {smallest.coil} changes too much between its states ({show(max(own), 'ohm', 3)} to "
            f"{show(min(own), 'ohm', 3)}): {distance}"
        )
    return (
        f"the coils differ: R_P is {show(most.value, 'ohm', 3)} in coil {most.coil} and at most "
        f"{show(max(own), 'ohm', 3)} in {smallest.coil}, and a drive code for each channel does not bring all of them "
        f"into the window either; place the coils alike under the target, or {distance}"
    )


def _clamp_advice(code: int, is_wanted: bool) -> str:
    if is_wanted:
        return "the spec sets this drive code; leave readout.drive_code out, and the code is chosen"
    if code == 0:
        return "even the weakest drive is too strong: put 100 kohm in parallel with the sensor (data sheet 8.1.5)"
    return f"use drive code {code - 1} or lower, or a coil whose R_P changes less between its states"


MEASURE_FIRST = "measure the amplitude of the first boards"
"""The hint for every amplitude that keeps a limit by little."""

CLAMPED = Case(
    "with drive code {code} the tank of {where} swings {measured:V,3} peak; above {limit:V} the input clamps and "
    "shifts the frequency", detail="{in_sigmas}",
)

TOO_WEAK = Case(
    "with drive code {code} the tank of {where} swings only {measured:V,3} peak; {limit:V} to {high:V} is the "
    "low-noise window", detail="{in_sigmas}", severity=Severity.WARNING,
)

MAY_STOP = Case(
    "with drive code {code} the tank of {where} swings only {measured:V,3} peak; below {limit:V} the oscillation may "
    "stop", detail="{in_sigmas}",
)

THICK_COPPER = Case(
    "with the thickest copper that is delivered (foil and plating both at their ends) the tank of {where} would swing "
    "{measured:V,3} peak with drive code {code}, beyond {limit:V}",
    hint="leave readout.drive_code out, and one is chosen that does for such copper", severity=Severity.WARNING,
)

THIN_COPPER = Case(
    "with the thinnest copper that is delivered the tank of {where} would swing {measured:V,3} peak with drive code "
    "{code}, below the low-noise window from {limit:V} on: no code serves both ends of the copper",
    hint="choose the code by the amplitude that the boards of a batch show: they have one foil and one plating",
    severity=Severity.NOTE,
)

CLAMPED_WHEN_COLD = Case(
    "switched on at 20 degC, the tank of {where} swings {measured:V,3} peak with drive code {code}, which is chosen "
    "for {temperature:g} degC; above {limit:V} the input clamps and shifts the frequency",
    hint="begin with drive code {careful_code}, and change when the sensor is warm", severity=Severity.WARNING,
)

UNSURE_DRIVE = Case(
    "the high-current drive is {low_current:A} or {high_current:A}, as TI's texts disagree: the amplitude lies between "
    "{least:V,3} and {most:V,3} peak", hint="measure the amplitude at the converter's pins before trusting a reading",
    severity=Severity.WARNING,
)


RULES: tuple[Rule, ...] = (
    rule_of("SIT204", drive_amplitude),
)
