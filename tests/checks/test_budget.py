"""What hints may cost: the verdict comes first and is the same with every choice, and all findings share one budget."""

import json
from dataclasses import replace

import pytest

import sitscad
from sitscad.basics.finding import Severity
from sitscad.checks.fixes.search import LEVELS, MORE_TRIALS, Budget, CostlyFamily, FamilyByAmount, search
from sitscad.checks.judging import HINTS, RULES, check, mended
from sitscad.checks.rules import rule_outcomes
from sitscad.checks.trials import Trials
from sitscad.estimates import estimate_layout
from sitscad.estimates.design import Design
from sitscad.layout import lay_out
from sitscad.spec.load import load_text


def spec_of(shape="circle", turns=6, layers=2, width=80, size=7.0, **more):
    coil = {"shape": shape, "outer_diameter": size, "turns": turns, "layers": layers}
    coil |= {"trace_width": f"{width} um", "trace_spacing": f"{width} um"}
    document = {"sitscad": 1, "name": "budget", "coil": coil, "fpc": {"rules": "generic-flex"}, **more}
    return load_text(json.dumps(document), "spec.yaml")


REFUSED = {"capacitance": "47 pF"}


def verdict(result):
    return [(f.rule, f.severity, f.line) for f in result.findings]


def test_findings_are_equal_for_every_hint_level():
    spec = spec_of(readout=REFUSED)
    found = {hints: check(spec, hints=hints) for hints in HINTS}
    assert verdict(found["none"]) == verdict(found["decisive"]) == verdict(found["full"])
    assert not found["none"].ok and len({f.rule for f in found["none"].findings if f.severity is Severity.ERROR}) > 1


def test_hint_level_none_lays_out_no_trial_board(monkeypatch):
    spec = spec_of(readout=REFUSED)
    layout = lay_out(spec)
    monkeypatch.setattr("sitscad.estimates.design.arrange", lambda *_: pytest.fail("another board was laid out"))
    errors = [f for f in check(spec, layout, hints="none").findings if f.severity is Severity.ERROR]
    assert errors and all(MORE_TRIALS in finding.hint and not finding.fixes for finding in errors)


def test_decisive_hint_level_estimates_within_its_budget(monkeypatch):
    spec, made = spec_of("octagon", turns=9.125, layers=4, size=9.0, readout=REFUSED), []
    monkeypatch.setattr("sitscad.estimates.design.estimate_layout",
                        lambda *given, **named: made.append(1) or estimate_layout(*given, **named))
    check(spec)
    assert 1 < len(made) <= 1 + LEVELS["decisive"][1]


def test_trial_budget_is_spent_on_errors_before_warnings():
    """Two tracks at the fabricator's minimum for coils only warn; the tank that is too fast decides."""
    spec = spec_of(width=100, turns=12, size=6.0, readout=REFUSED)
    findings = check(spec).findings
    (error,) = [f for f in findings if f.rule == "SIT202"]
    assert error.severity is Severity.ERROR and error.fixes


@pytest.mark.parametrize("hints", ["", "all", "FULL"])
def test_unknown_hint_level_gives_value_error(hints):
    with pytest.raises(ValueError, match="hints are one of none, decisive, full"):
        check(spec_of(), hints=hints)


def test_exhausted_hint_budget_gives_no_fix():
    spec = spec_of("octagon", turns=4, layers=2, size=5.0, readout=REFUSED)
    subject = Design(spec)
    message = [outcome for rule in RULES for outcome in rule_outcomes(rule, subject)[0]]
    result = {f.rule: f for f in Trials(subject, RULES, message, (), Budget(0, 0, 0)).advised()}
    assert all(MORE_TRIALS in result[rule].hint and not result[rule].fixes for rule in ("SIT101", "SIT202"))


@pytest.mark.parametrize("family", [
    CostlyFamily(lambda: pytest.fail("it was asked")),
    FamilyByAmount(lambda amount: pytest.fail("it was asked"), 1e-3, is_costly=True),
], ids=["costly", "growing"])
def test_exhausted_budget_calls_no_costly_fix_family(family):
    result = search((family,), lambda fix: None, Budget(0, 0, 0))
    assert result.is_cut_short and not result.mending and not result.ineffective


def test_exhausted_layout_budget_winds_no_coils_for_hints(monkeypatch):
    """Seven turns too many of fine tracks: room for the vias inside was looked for after the last trial."""
    spec = spec_of(turns=20, layers=4, size=7.0, width=80)
    subject = Design(spec)
    message = [outcome for rule in RULES for outcome in rule_outcomes(rule, subject)[0]]
    assert "SIT112" in {outcome.finding.rule for outcome in message}
    budget, tried = Budget(1, 1, 0), []
    trials = Trials(subject, RULES, message, (), budget)
    trials._tried.append((spec, None))  # something was tried, and nothing is left
    budget.layouts = 0
    monkeypatch.setattr("sitscad.checks.fixes.moves.wind_all", lambda *_: tried.append(1) or pytest.fail("wound"))
    result = {f.rule: f for f in trials.advised()}
    assert MORE_TRIALS in result["SIT112"].hint and not tried


def test_change_that_fixes_two_findings_is_tried_once(monkeypatch):
    """Track and gap are too narrow: the same wider ones mend both."""
    spec, drawn = spec_of(turns=6, width=80, size=8.0), []
    made = Design.drawn
    monkeypatch.setattr(Design, "drawn", lambda own, changed, *more: drawn.append(changed) or made(own, changed, *more))
    findings = {f.rule: [fix.edits for fix in f.fixes] for f in check(spec).findings if f.rule in ("SIT101", "SIT102")}
    assert findings["SIT101"] == findings["SIT102"] != []
    assert all(item != other for k, item in enumerate(drawn) for other in drawn[:k])


def test_refused_spec_gets_fixes_only_within_hint_budget():
    with pytest.raises(sitscad.SpecError) as raised:
        spec_of(turns=40, size=6.0)
    error = raised.value
    assert all(MORE_TRIALS in finding.hint for finding in mended(error, "none"))
    assert all(finding.fixes for finding in mended(error, "full"))


def test_changed_capacitance_reuses_solved_windings(monkeypatch):
    layout = lay_out(spec_of("square", turns=5))
    first = sitscad.estimate(layout)
    for name in ("winding_losses", "choose_method", "inductance_matrix"):
        monkeypatch.setattr(f"sitscad.estimates.circuits.solved_winding.{name}", lambda *_: pytest.fail("solved again"))
    other = replace(layout.spec, readout=replace(layout.spec.readout, capacitance=1e-9))
    again = sitscad.estimate(replace(layout, spec=other))
    assert again.coils[0].winding_inductance == first.coils[0].winding_inductance
    assert again.coils[0].sensor_frequency < first.coils[0].sensor_frequency


def test_check_command_accepts_hint_level_and_refuses_unknown_one(tmp_path, capsys):
    from sitscad.cli import run

    path = tmp_path / "spec.yaml"
    path.write_text("sitscad: 1\nname: few\ncoil: {shape: circle, outer_diameter: 3, turns: 3, layers: 2, "
                    "trace_width: 100 um, trace_spacing: 100 um}\n", encoding="utf-8")
    assert run(["check", "--hints", "none", str(path)]) == 1
    assert MORE_TRIALS in capsys.readouterr().out
    assert run(["check", "--hints", "more", str(path)]) == 2
    assert "'more' is not one of none, decisive, full" in capsys.readouterr().err
