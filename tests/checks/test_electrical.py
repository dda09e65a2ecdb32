"""Every electrical rule fires on a design that breaks it, with the right numbers, and is silent on others."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import pytest
from tolerance import approx

import sitscad
from sitscad.basics.finding import Severity
from sitscad.basics.units import parse_quantity
from sitscad.checks.assembly.transduction import STRAIN_ERROR
from sitscad.checks.fixes.moves import LONGER, longer_coils
from sitscad.checks.judging import RULES, check
from sitscad.estimates.circuits.tank import preferred_values
from sitscad.estimates.coil_estimates import StateSigmas
from sitscad.kernels.converters.reference_counter import ReferenceCounter
from sitscad.kernels.mechanics.elastomer import VALID_STRAIN
from sitscad.spec import presets
from sitscad.spec.reading import RULE_TEXTS

LDC1614 = presets.converter("ldc1614")


@pytest.mark.parametrize("rule", [f"SIT2{n:02d}" for n in range(1, 15)])
def test_valid_design_has_no_electrical_finding(rule: str, judge, design, estimates) -> None:
    spec = design()
    result = [f for f in judge(rule, spec, None, estimates(spec)) if f.severity is not Severity.NOTE]
    assert result == []


def test_too_low_inductance_gives_error_with_hint_without_numbers(judge, design, estimates) -> None:
    spec = design()
    weak = {"free": 300.0, "rest": 250.0}
    (result,) = judge("SIT201", spec, None, estimates(spec, inductance=0.14e-6, resistances=weak))
    assert (result.severity, result.measured, result.limit, result.unit) == (Severity.ERROR, 0.14e-6, 0.2e-6, "H")
    assert not re.search(r"\d", result.hint)
    assert result.key == "coil.turns" and spec.source.line(result.line).strip().startswith('"turns"')
    assert judge("SIT201", spec, None, estimates(spec, inductance=0.2e-6)) == []


@pytest.mark.parametrize(
    ("how", "severity"),
    [
        ({}, Severity.WARNING),
        ({"frequency": 10.5e6}, Severity.ERROR),
        ({"resistances": {"free": 590.0}}, Severity.ERROR),
        ({"resistances": {"free": 290.0}, "high_current": True}, Severity.WARNING),
    ],
)
def test_low_inductance_is_error_only_if_tank_breaks_limits(how, severity, judge, design, estimates) -> None:
    spec = design(array=None)
    (result,) = judge("SIT201", spec, None, estimates(spec, inductance=0.14e-6, **how))
    assert result.severity is severity


def test_large_single_turn_loop_gives_only_warning() -> None:
    """185 nH at 9.4 MHz with an R_P that the high-current drive sustains: only the rule of thumb refused it."""
    result = sitscad.check(sitscad.load_text(LOOP, "loop.yaml"), hints="none")
    assert [(f.rule, f.severity) for f in result.findings if f.rule == "SIT201"] == [("SIT201", Severity.WARNING)]
    assert result.ok


LOOP = """\
sitscad: 1
name: loop
coil: {shape: circle, outer_diameter: 70, turns: 1, layers: 1, trace_width: 2, trace_spacing: 0.5}
fpc: {stackup: [{coverlay: 27.5 um}, {copper: 35 um}, {dielectric: 25 um}, {copper: 35 um}, {coverlay: 27.5 um}]}
"""


def test_missing_coil_estimate_leaves_rule_not_checked(design, estimates, verdicts) -> None:
    spec = design()
    found, undecided = verdicts("SIT203", spec, None, estimates(spec, resistances={"free": math.nan, "rest": 1300.0}))
    assert found == []
    assert [(u.rule, u.case) for u in undecided] == [("SIT203", "no-coil-estimate")] * 2


@pytest.mark.slow
def test_too_high_frequency_gets_capacitor_of_preferred_series(judge, design, estimates) -> None:
    spec = design(readout__capacitance="82 pF")
    (result,) = judge("SIT202", spec, None, estimates(spec, frequency=12e6))
    assert (result.severity, result.limit) == (Severity.ERROR, 10e6)
    (result,) = (f for f in check(spec).findings if f.rule == "SIT202")
    value = parse_quantity(result.fixes[0].edits[0].new.strip('"'), "capacitance")
    assert any(value == approx(each, rel=1e-6) for each in preferred_values(LDC1614))
    spec = design()
    assert judge("SIT202", spec, None, estimates(spec, frequency=10e6)) == []
    assert judge("SIT202", spec, None, estimates(spec, frequency=900.0))[0].limit == 1e3


@pytest.mark.parametrize(
    ("pressed", "severity", "limit"),
    [
        (590.0, Severity.ERROR, 600.0),
        (600.0, Severity.WARNING, 1000.0),
        (999.0, Severity.WARNING, 1000.0),
        (1000.0, None, 0),
    ],
)
def test_low_parallel_resistance_gives_warning_or_error(
    pressed: float, severity: Severity | None, limit: float, judge, design, estimates
) -> None:
    spec = design()
    result = judge(
        "SIT203", spec, None, estimates(spec, resistances={"free": 2200.0, "rest": 1300.0, "pressed": pressed})
    )
    if severity is None:
        assert result == []
        return
    assert [(f.severity, f.measured, f.limit) for f in result] == [(severity, pressed, limit)]


@pytest.mark.more
@pytest.mark.slow
def test_low_resistance_of_two_layer_miniature_gets_four_layer_fix(judge, design, estimates) -> None:
    spec = design(coil__layers=2, fpc__stackup="flex-2l-35um", coil__turns=6.5, coil__outer_diameter=3.5)
    (result,) = judge("SIT203", spec, None, estimates(spec, resistances={"free": 270.0}))
    assert result.severity is Severity.ERROR and not re.search(r"\d layers", result.hint)
    (result,) = (f for f in check(spec, hints="full").findings if f.rule == "SIT203")
    edits = [[(edit.key, edit.new.strip('"')) for edit in fix.edits] for fix in result.fixes]  # as quoted as the text
    assert [("coil.layers", "4"), ("fpc.stackup", "flex-4l")] in edits


@pytest.mark.parametrize(("value", "severity"), [(240.0, Severity.ERROR), (260.0, Severity.WARNING), (1001.0, None)])
def test_high_current_mode_lowers_resistance_limit_for_single_coil_only(
    value: float, severity: Severity | None, judge, design, estimates
) -> None:
    alone = design(array=None)
    numbers = estimates(alone, resistances={"free": value}, high_current=True)
    assert [f.severity for f in judge("SIT203", alone, None, numbers)] == ([severity] if severity else [])
    two = design()
    numbers = estimates(two, resistances={"free": 260.0}, high_current=True)
    assert [f.severity for f in judge("SIT203", two, None, numbers)] == [Severity.ERROR]


def test_amplitude_outside_range_gives_error_or_warning(judge, design, estimates) -> None:
    spec = design()
    numbers = estimates(spec, drive_code=30)
    high = judge("SIT204", spec, None, numbers)
    assert (high[0].severity, high[0].limit) == (Severity.ERROR, 1.8)
    assert high[0].measured == numbers.coils[0].states["rest"].amplitude
    (low,) = judge(
        "SIT204", spec, None, estimates(spec, resistances={"free": 1350.0, "rest": 1300.0, "pressed": 880.0})
    )
    assert (low.severity, low.limit) == (Severity.WARNING, 1.2)
    (stops,) = judge(
        "SIT204", spec, None, estimates(spec, resistances={"free": 1350.0, "rest": 1300.0, "pressed": 400.0})
    )
    assert (stops.severity, stops.limit) == (Severity.ERROR, 0.6)


@pytest.mark.parametrize(("weaker", "volts", "severity", "limit"), [
    (0, 1.79, None, None), (0, 1.95, Severity.WARNING, 1.8), (2, 1.1, Severity.NOTE, 1.2),
])
def test_copper_tolerance_beyond_amplitude_limit_gives_finding(
    weaker, volts, severity, limit, judge, design, estimates
) -> None:
    """One state whose R_P the thickest copper (or, with the sign turned, the thinnest) takes to an amplitude."""
    spec = design()
    code = LDC1614.drive_code(1300.0) - weaker
    numbers = estimates(spec, resistances={"free": 1350.0, "rest": 1300.0, "pressed": 1290.0}, drive_code=code)
    amplitude = numbers.coils[0].states["rest"].amplitude
    assert 1.2 < amplitude < 1.8
    change = 1300.0 * abs(volts / amplitude - 1.0)
    spread = StateSigmas(0.0, 0.0, 0.0, 0.0, 0.0, thickest_copper=change)
    coils = tuple(
        replace(coil, states=coil.states | {"rest": replace(coil.states["rest"], spread=spread)})
        for coil in numbers.coils
    )
    result = judge("SIT204", spec, None, replace(numbers, coils=coils))
    assert [(f.severity, f.limit) for f in result] == ([(severity, limit)] if severity else [])
    assert [f.measured for f in result] == ([approx(volts, rel=1e-9)] if severity else [])


@pytest.mark.parametrize("readout", [None, {"device": "ldc1614"}])
def test_amplitude_finding_points_to_drive_code_or_turns(readout, judge, design, estimates) -> None:
    """At the turns where no drive is strong enough; else at the section that takes a code, or the end, and names it."""
    spec = design(readout=readout)
    lines = spec.source.text.splitlines()
    clamps = judge("SIT204", spec, None, estimates(spec, drive_code=30))[0]
    assert clamps.key == "readout.drive_code"
    assert clamps.line == (len(lines) if readout is None else spec.source.keys["readout"][0])
    weak = {"free": 550.0, "rest": 500.0, "pressed": 300.0}
    (stops,) = judge("SIT204", spec, None, estimates(spec, resistances=weak))
    assert stops.key == "coil.turns" and "turns" in lines[stops.line - 1]


def test_free_state_amplitude_is_checked_only_if_sole_state(judge, design, estimates) -> None:
    """What comes with every assembled sensor is no finding: the report and assembly.txt have a bare board's code."""
    spec = design()
    assert judge("SIT204", spec, None, estimates(spec)) == []
    bare = judge("SIT204", spec, None, estimates(spec, resistances={"free": 2200.0}, drive_code=30))
    assert [f.severity for f in bare] == [Severity.ERROR]


def test_high_current_amplitude_above_limit_gives_warning(judge, design, estimates) -> None:
    spec = design(array=None)
    (result,) = judge("SIT204", spec, None, estimates(spec, resistances={"free": 300.0}, high_current=True))
    assert result.severity is Severity.WARNING
    assert (result.measured, result.limit) == (approx(4.0 / math.pi * 300.0 * 6e-3, rel=1e-9), 1.8)


def test_quality_factor_below_ten_gives_warning(judge, design, estimates) -> None:
    spec = design()
    (result,) = judge("SIT205", spec, None, estimates(spec, quality=9.5))
    assert (result.severity, result.measured) == (Severity.WARNING, 9.5)
    assert judge("SIT205", spec, None, estimates(spec, quality=10.0)) == []


@pytest.mark.parametrize(
    ("resonance", "severity"), [(6.6e6 / 0.81, Severity.ERROR), (6.6e6 / 0.78, Severity.WARNING), (6.6e6 / 0.74, None)]
)
def test_low_self_resonance_gives_warning_or_error(
    resonance: float, severity: Severity | None, judge, design, estimates
) -> None:
    spec = design()
    result = judge("SIT206", spec, None, estimates(spec, self_resonance=resonance))
    assert [f.severity for f in result] == ([severity] if severity else [])


def test_input_frequency_above_clock_limit_gives_finding(judge, design, estimates) -> None:
    spec = design()
    assert judge("SIT207", spec, None, estimates(spec, frequency=8.74e6)) == []
    (result,) = judge("SIT207", spec, None, estimates(spec, frequency=8.75e6))
    assert (result.measured, result.limit, result.hint) == (8.75e6, 8.75e6, RULE_TEXTS["SIT207"]["mend"])
    slow = ReferenceCounter(spec.readout.device, 2, 2e6, 1, 15, 2400, 8)
    (result,) = judge("SIT207", spec, None, estimates(spec, frequency=9e6, clock=2e6, conversion=slow))
    assert (result.key, result.measured, result.limit) == ("readout.clock", 9e6, 7.5e6)
    assert "2.4 MHz" in result.hint


def test_reached_scan_rate_below_stated_rate_gives_finding(judge, design, estimates) -> None:
    spec = design()
    (result,) = judge("SIT208", spec, None, estimates(spec, scan_rate=480.0))
    assert (result.measured, result.limit) == (480.0, 500.0)
    assert judge("SIT208", spec, None, estimates(spec, scan_rate=500.1)) == []


@pytest.mark.parametrize(
    ("rate", "severity"), [("2000 Hz", None), ("2500 Hz", Severity.WARNING), ("3 kHz", Severity.ERROR)]
)
def test_scan_rate_beyond_bus_speed_gives_warning_or_error(rate: str, severity: Severity | None, judge, design) -> None:
    """Error and warning named two rates of one converter, in "kHz times a second"."""
    result = judge("SIT209", design(readout__scan_rate=rate))
    assert [f.severity for f in result] == ([severity] if severity else [])
    for item in result:
        assert item.limit == approx(400e3 / 196.0, rel=1e-6)  # two coils of two registers of 49 bits
        assert (item.key, item.measured) == ("readout.scan_rate", 2500.0 if severity is Severity.WARNING else 3000.0)


@pytest.mark.slow
def test_bandwidth_fix_gives_lowest_sufficient_scan_rate(design) -> None:
    """Every further scan takes time from conversions: with 500 Hz a signal of 3.6 steps had 1.4."""
    (findings,) = (f for f in check(design(requirements__bandwidth="251 Hz")).findings if f.rule == "SIT210")
    assert [edit.new for fix in findings.fixes for edit in fix.edits] == ['"502 Hz"']


def test_bandwidth_above_half_scan_rate_gives_finding(judge, design, verdicts) -> None:
    (result,) = judge("SIT210", design(requirements__bandwidth="251 Hz"))
    assert (result.measured, result.limit) == (500.0, 502.0)
    assert judge("SIT210", design(requirements__bandwidth="250 Hz")) == []
    assert verdicts("SIT210", design(requirements__bandwidth=None))[1][0].case == "no-requirement"


def test_more_coils_than_channels_gives_error(judge, design) -> None:
    (result,) = judge("SIT211", design(array__count=9))
    assert (result.severity, result.measured, result.limit) == (Severity.ERROR, 9.0, 8.0)
    assert "channels-second-bus" in result.cases
    assert judge("SIT211", design(array__count=9, readout__buses=2))[0].severity is not Severity.ERROR
    (result,) = judge("SIT211", design(array__count=17, readout__buses=2))
    assert (result.measured, result.limit) == (17.0, 16.0) and "channels-second-bus" not in result.cases
    assert judge("SIT211", design(array__count=4)) == []


def test_channel_error_points_to_centres_or_count_of_array(judge, design) -> None:
    centres = [[4.5 * k - 18.0, 0.0] for k in range(9)]
    explicit = design(array={"pattern": "explicit", "centres": centres})
    grid = design(array={"pattern": "grid", "count": [3, 3], "pitch": 4.5})
    for spec, key in ((explicit, "array.centres"), (grid, "array.count")):
        (result,) = judge("SIT211", spec)
        assert (result.key, result.measured, result.limit) == (key, 9.0, 8.0)


@pytest.mark.parametrize(("coupling", "severity"), [(1.9e-3, Severity.NOTE), (2.1e-3, Severity.WARNING)])
def test_coupling_across_converters_gives_note_or_warning(judge, design, estimates, coupling, severity) -> None:
    spec = design(array__count=5)
    matrix = [[2.5e-6 if i == j else 0.3e-6 if (i < 3) == (j < 3) else 1e-10 for j in range(5)] for i in range(5)]
    matrix[2][4] = matrix[4][2] = -coupling * 2.5e-6
    (result,) = judge("SIT211", spec, None, estimates(spec, matrix=matrix))
    assert (result.severity, result.measured) == (severity, approx(coupling, rel=1e-6))
    assert {"0x2A", "0x2B"} == set(re.findall("0x2[AB]", result.detail))
    assert {"C3", "C5"} <= set(re.findall(r"C\d", result.message))


@pytest.mark.parametrize(("coupling", "severity"), [(0.03, None), (0.1, Severity.NOTE), (0.3, Severity.WARNING)])
def test_coupling_to_idle_coil_gives_note_or_warning(
    coupling: float, severity: Severity | None, judge, design, estimates
) -> None:
    spec = design()
    matrix = ((2.5e-6, -coupling * 2.5e-6), (-coupling * 2.5e-6, 2.5e-6))
    result = judge("SIT212", spec, None, estimates(spec, matrix=matrix))
    assert [f.severity for f in result] == ([severity] if severity else [])
    assert all(f.measured == approx(coupling**2, rel=1e-6) for f in result)


def test_coil_of_other_converter_is_not_idle_neighbour(judge, design, estimates) -> None:
    """Only the converter that reads a coil grounds the others; across two converters SIT211 judges."""
    spec = design(array__count=5)
    matrix = [[2.5e-6 if i == j else 0.0 for j in range(5)] for i in range(5)]
    matrix[2][3] = matrix[3][2] = 0.3 * 2.5e-6
    assert judge("SIT212", spec, None, estimates(spec, matrix=matrix)) == []
    (result,) = judge("SIT211", spec, None, estimates(spec, matrix=matrix))
    assert result.measured == approx(0.3, rel=1e-9)


def test_clock_outside_converter_range_gives_finding(judge, design) -> None:
    assert judge("SIT213", design(readout__clock="44 MHz"))[0].limit == 40e6
    assert judge("SIT213", design(readout__clock="1 MHz"))[0].limit == 2e6
    assert judge("SIT213", design(readout__clock="2 MHz")) == []


@pytest.mark.parametrize(("value", "limit"), [(33e-12, 47e-12), (4.7e-9, 3.3e-9), (47e-12, None)])
def test_tank_capacitor_outside_range_gives_finding(
    value: float, limit: float | None, judge, design, estimates
) -> None:
    spec = design()
    result = judge("SIT214", spec, None, estimates(spec, capacitance=value))
    assert [f.limit for f in result] == ([limit] if limit else [])


def scattered(numbers, **sigma):
    """The estimates with the same standard deviations in every state."""
    values = {"inductance": 1e-9, "resistance": 0.1, "frequency": 1e3, "parallel_resistance": 1.0, "amplitude": 1e-3}
    spread = StateSigmas(**(values | sigma), causes=dict.fromkeys(values, "trace width"))
    coils = [
        replace(coil, states={name: replace(state, spread=spread) for name, state in coil.states.items()})
        for coil in numbers.coils
    ]
    return replace(numbers, coils=tuple(coils))


@pytest.mark.parametrize(
    ("rule", "how", "sigma", "limit", "count"),
    [
        ("SIT201", {"inductance": 0.212e-6}, {"inductance": 10e-9}, 0.2e-6, 1.2),
        ("SIT202", {"frequency": 9.9e6}, {"frequency": 0.2e6}, 10e6, 0.5),
        ("SIT203", {}, {"parallel_resistance": 80.0}, 1000.0, 1.25),
    ],
)
def test_value_within_few_sigma_of_limit_gives_note_or_warning(
    rule, how, sigma, limit, count, judge, design, estimates
):
    spec = design()
    (result,) = judge(rule, spec, None, scattered(estimates(spec, **how), **sigma))
    # by less than one sigma more than one board of six is beyond it
    assert (result.severity, result.limit) == (Severity.WARNING if count < 0.9 else Severity.NOTE, limit)
    assert result.sigma == approx(count, rel=1e-6)
    assert {"sigma-below", "sigma-above"} & set(result.cases) and "sigma-cause" in result.cases
    assert f"{count:.1f} standard deviations" in result.whole_message and "trace width" in result.whole_message
    assert judge(rule, spec, None, scattered(estimates(spec, **how))) == []


@pytest.mark.parametrize(
    ("rule", "how", "sigma", "count"),
    [
        ("SIT201", {"inductance": 0.19e-6}, {"inductance": 10e-9}, 1.0),
        ("SIT202", {"frequency": 10.5e6}, {"frequency": 0.2e6}, 2.5),
        ("SIT203", {"resistances": {"free": 2200.0, "rest": 900.0}}, {"parallel_resistance": 50.0}, 2.0),
    ],
)
def test_value_beyond_limit_gives_excess_in_sigma(rule, how, sigma, count, judge, design, estimates) -> None:
    spec = design()
    result = judge(rule, spec, None, scattered(estimates(spec, **how), **sigma))[0]
    assert result.severity is not Severity.NOTE
    assert result.sigma == approx(count, rel=1e-6)
    assert f"{count:.1f} standard deviations" in result.whole_message


def test_amplitude_within_sigma_of_limits_gives_warning(judge, design, estimates) -> None:
    spec = design()
    numbers = scattered(estimates(spec), amplitude=0.15)
    (note,) = judge("SIT204", spec, None, numbers)
    assert note.cases[0] == "near-amplitude" and "amplitude-others" in note.cases
    assert note.severity is Severity.WARNING
    assert note.keeps_limit and 0.0 < note.sigma < 1.0
    assert note.detail.count("trace width") == 2 and "code-near-none" in note.cases


def test_amplitude_near_both_limits_names_both_limits(judge, design, estimates) -> None:
    spec = design()
    numbers = scattered(estimates(spec), amplitude=0.2)
    equal = replace(numbers.coils[0].states["rest"], amplitude=1.5)
    numbers = replace(numbers, coils=(replace(numbers.coils[0], states={"rest": equal}),))
    (note,) = judge("SIT204", spec, None, numbers)
    assert "1.8 V" in note.whole_message and "1.2 V" in note.whole_message
    assert not {"code-near", "code-serves", "code-serves-margin"} & set(note.cases)


@pytest.mark.parametrize(("amplitude", "sigma"), [(1.75, 0.05), (1.25, 0.05), (1.75, 0.12), (1.25, 0.12), (1.5, 0.3)])
def test_suggested_drive_code_meets_both_amplitude_limits_if_any_does(amplitude, sigma, judge, design, estimates):
    """The next weaker code was named for an amplitude near the upper limit, and it was below the lower limit."""
    spec = design()
    numbers = scattered(estimates(spec), amplitude=sigma)
    coil = numbers.coils[0]
    numbers = replace(numbers, coils=(replace(coil, states={
        "rest": replace(coil.states["rest"], amplitude=amplitude)}),))
    (note,) = judge("SIT204", spec, None, numbers)
    now, currents = numbers.readout.drive_code, spec.readout.device.drive_currents
    stored = [code for code, current in enumerate(currents)
            if all(1.2 <= (amplitude + side * 2.0 * sigma) * current / currents[now] <= 1.8 for side in (-1, 1))]
    named = re.search(r"drive code (\d+), which keeps", note.hint)
    assert (named is None) == (not stored) and (named is None or int(named[1]) in stored)


def test_failed_state_leaves_rules_not_checked(design, estimates, verdicts) -> None:
    spec = design()
    numbers = estimates(spec, resistances={"free": 2200.0, "rest": 1300.0})
    failed = {"pressed": "the half-space model fails there"}
    numbers = replace(numbers, coils=tuple(replace(coil, failed_states=failed) for coil in numbers.coils))
    for rule in ("SIT201", "SIT202", "SIT203", "SIT204", "SIT205", "SIT206"):
        _, undecided = verdicts(rule, spec, None, numbers)
        assert any(skipped.case == "state-failed" and "pressed" in skipped.reason for skipped in undecided), rule


@pytest.mark.slow
def test_drive_code_for_hot_sensor_gives_amplitude_warning_at_20_degrees(design) -> None:
    """The drive code suits 150 degC; copper, jaw and target lose less when it is switched on at 20."""
    spec = design(requirements__temperature="150 degC")
    result = sitscad.check(spec)
    (findings,) = [f for f in result.findings if f.rule == "SIT204" and f.key == "requirements.temperature"]
    hot, cold = (sitscad.estimate(sitscad.lay_out(spec), temperature=t) for t in (150.0, 20.0))
    assert hot.readout.drive_code > cold.readout.drive_code
    most = max(coil.states[state].parallel_resistance for coil in cold.coils for state in ("rest", "pressed"))
    assert findings.severity is Severity.WARNING
    assert findings.measured == approx(4.0 / math.pi * most * hot.readout.drive_current, rel=1e-6)
    assert str(cold.readout.drive_code) in re.findall(r"\d+", findings.hint)


def test_rule_texts_state_limits_of_converter() -> None:
    kilohms = [LDC1614.limit(f"parallel_resistance_{name}") / 1e3 for name in ("min", "driveable", "high_current")]
    volts = [LDC1614.limit(f"amplitude_{name}") for name in ("max", "optimum_min", "stable_min")]
    words = {
        "SIT201": [f"{LDC1614.limit('inductance_min') * 1e6:g} uH"],
        "SIT202": ["1 kHz to 10 MHz" if LDC1614.limit("sensor_frequency_max") == 10e6 else "?"],
        "SIT203": [f"{kilohms[0]:.1f} kohm", f"{kilohms[1]:.2f} kohm", f"{kilohms[2]:.2f} kohm"],
        "SIT204": [f"{volts[1]:g} to {volts[0]:g} V peak", f"oscillation stable ({volts[2]:g} V)"],
        "SIT205": [f"at least {LDC1614.limit('quality_factor_min'):g}"],
        "SIT206": [
            f"{LDC1614.limit('self_resonance_fraction'):g}",
            f"{LDC1614.limit('self_resonance_fraction_strict'):g}",
        ],
        "SIT207": [f"{LDC1614.limit('input_divider_2_from') / 1e6:g} MHz"],
        "SIT213": [f"{LDC1614.limit('clock_min') / 1e6:g} to {LDC1614.limit('clock_max') / 1e6:g} MHz"],
        "SIT214": [f"{LDC1614.limit('capacitor_min') * 1e12:g} pF", f"{LDC1614.limit('capacitor_max') * 1e9:g} nF"],
        "SIT304": [f"{100 * VALID_STRAIN:.0f} %", f"{100 * STRAIN_ERROR:.0f} %"],
    }
    text = {rule.id: f"{rule.summary} {rule.severities} {rule.why}" for rule in RULES}
    for rule, expected in words.items():
        for word in expected:
            assert word in text[rule], (rule, word)


def test_low_amplitude_hint_depends_on_states_coils_or_drive(judge, design, estimates) -> None:
    """That R_P changes too much between rest and pressed was said of coils that differed from each other."""
    spec = design()
    numbers = estimates(spec, resistances={"free": 2000.0, "rest": 1500.0, "pressed": 1480.0}, drive_code=26)
    first, second = numbers.coils
    weaker = {
        name: replace(state, parallel_resistance=0.7 * state.parallel_resistance, amplitude=0.7 * state.amplitude)
        for name, state in second.states.items()
    }
    unlike = replace(numbers, coils=(first, replace(second, states=weaker)))
    (result,) = (f for f in judge("SIT204", spec, None, unlike) if f.severity is Severity.WARNING)
    assert "weak-coils" in result.cases and "1.5 kohm" in result.hint and "C1" in result.hint
    wide = estimates(spec, resistances={"free": 2000.0, "rest": 1500.0, "pressed": 1000.0}, drive_code=26)
    (result,) = (f for f in judge("SIT204", spec, None, wide) if f.severity is Severity.WARNING)
    assert "weak-states" in result.cases
    poor = estimates(spec, resistances={"free": 600.0, "rest": 550.0, "pressed": 540.0}, drive_code=31)
    (result,) = (f for f in judge("SIT204", spec, None, poor) if f.severity is Severity.WARNING)
    assert "weak-drive" in result.cases


def test_low_resistance_hint_proposes_shield_only_if_absent(judge, design, estimates) -> None:
    """The hint named a copper shield where there was one."""
    numbers = {"resistances": {"free": 2200.0, "rest": 400.0}}
    for more, message in (
        ({"shield": None}, ["a copper shield", "a larger mount.standoff", "a thicker elastomer"]),
        ({"shield": {"material": "copper", "thickness": 0.1, "gap": 0.3}}, ["a larger shield.gap"]),
        ({"shield": {"material": "ferrite", "thickness": 0.1, "gap": 0.3}}, ["a larger mount.standoff"]),
    ):
        spec = design(**more)
        (result,) = judge("SIT203", spec, None, estimates(spec, **numbers))
        assert all(words in result.hint for words in message), result.hint
        assert ("a copper shield" in result.hint) is (spec.shield is None)
        assert ("shield.gap" in result.hint) is ("a larger shield.gap" in message)


def test_longer_coil_fix_also_lengthens_target_of_coil_length(design):
    """Rp of a strip grows with its length, and only turns and layers were tried."""
    strip = sitscad.load_text(STRIP, "strip.yaml")
    long = [fix.spec for fix in longer_coils(strip, 2.0)]
    assert [spec.coil.size[0] > 2.0 * strip.coil.size[0] for spec in long] == [True] * len(LONGER)
    by = long[0].coil.size[0] - strip.coil.size[0]
    assert long[0].target.size == approx((12e-3 + by, 2.2e-3), rel=1e-9) and long[0].elastomer.size[0] == 6e-3
    assert long[0].coil.size[1] == strip.coil.size[1]
    assert not list(longer_coils(design(), 2.0)) and not list(longer_coils(strip.replace("array.count", 2), 2.0))


STRIP = """
sitscad: 1
name: strip
coil: {shape: racetrack, outer_diameter: [12, 2.2], turns: 4, layers: 2, trace_width: 0.076, trace_spacing: 0.076}
fpc: {rules: generic-fine, tail: {length: 20}}
target: {shape: rectangle, size: [12, 2.2], thickness: 0.5}
elastomer: {shape: rectangle, size: [6, 2.2], thickness: 1}
"""


@pytest.mark.slow
def test_longer_coil_fix_clears_low_resistance_finding():
    spec = sitscad.load_text(STRIP.partition("target:")[0], "strip.yaml")
    (findings,) = (f for f in check(spec, hints="full").findings if f.rule == "SIT203")
    longer = [edit.new for remedy in findings.fixes for edit in remedy.edits if edit.key == "coil.outer_diameter"]
    assert longer
    mended = spec.source.text.replace("[12, 2.2]", longer[0])
    assert not [f for f in check(sitscad.load_text(mended), hints="none").findings
                if f.rule == "SIT203" and f.severity is not Severity.NOTE]


@pytest.mark.parametrize(("free", "is_named"), [(413.0, False), (900.0, True)])
def test_distance_hint_appears_only_if_free_coil_meets_limit(free, is_named, judge, design, estimates):
    """A thicker pad was named to a coil that has too little Rp in free air."""
    spec = design(shield=None)
    numbers = estimates(spec, resistances={"free": free, "rest": 330.0, "pressed": 314.0}, drive_code=31)
    for rule in ("SIT203", "SIT204"):
        (result,) = (f for f in judge(rule, spec, None, numbers) if f.severity is not Severity.NOTE)
        words = ("a thicker elastomer", "mount.standoff", "more distance from the")
        assert any(each in result.hint for each in words) is is_named, result.hint


@pytest.mark.parametrize("rule", ["SIT201", "SIT203", "SIT204"])
def test_hints_mention_only_metal_parts_of_spec(rule, judge, design, estimates) -> None:
    """They spoke of a jaw to a coil on the bench, and of a target to one without."""
    poor = {"inductance": 0.1e-6} if rule == "SIT201" else {}
    numbers = {"resistances": {"free": 450.0, "rest": 400.0}, "drive_code": 31, **poor}
    for more, there in (
        ({}, {"target", "shield"}),
        ({"shield": None}, {"target", "jaw"}),
        ({"shield": None, "mount": {"kind": "bench-plate", "standoff": 0.7}}, {"target"}),
        ({"shield": None, "mount": None, "target": None, "elastomer": None, "requirements": None}, set()),
    ):
        spec = design(**more)
        for result in judge(rule, spec, None, estimates(spec, **numbers)):
            message = {word for word in ("target", "jaw", "shield") if f"the {word}" in result.hint}
            assert message <= there, result.hint
            assert "over the metal" not in result.hint or spec.mount.metal is not None, result.hint
