"""What hints may cost: the verdict comes first and is the same with every choice, and all findings share one budget."""

import json
from dataclasses import replace

import pytest

import sitscad
from sitscad.checks import HINTS, RULES, check, mended
from sitscad.checks.rules import outcomes
from sitscad.checks.trials import NOT_FURTHER, Trials
from sitscad.design import Design
from sitscad.finding import Severity
from sitscad.fixes import search as budget
from sitscad.fixes.search import Budget
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


@pytest.fixture
def spent(monkeypatch):
    """Every amount that was taken of a budget."""
    taken = []
    spend = Budget.spend

    def counted(self, units):
        granted = spend(self, units)
        taken.append(units if granted else 0.0)
        return granted

    monkeypatch.setattr(Budget, "spend", counted)
    return taken


def test_the_verdict_does_not_depend_on_what_is_tried_for_hints():
    spec = spec_of(readout=REFUSED)
    found = {hints: check(spec, hints=hints) for hints in HINTS}
    assert verdict(found["none"]) == verdict(found["decisive"]) == verdict(found["full"])
    assert not found["none"].ok and len({f.rule for f in found["none"].findings if f.severity is Severity.ERROR}) > 1


def test_without_hints_nothing_is_tried_and_every_hint_says_so(monkeypatch):
    spec = spec_of(readout=REFUSED)
    layout = lay_out(spec)
    monkeypatch.setattr("sitscad.layout.arrange", lambda *_: pytest.fail("another board was laid out"))
    errors = [f for f in check(spec, layout, hints="none").findings if f.severity is Severity.ERROR]
    assert errors and all(NOT_FURTHER in finding.hint and "tried" not in finding.hint for finding in errors)


def test_decisive_hints_take_no_more_than_their_budget(spent):
    spec = spec_of("octagon", turns=9.125, layers=4, size=9.0, readout=REFUSED)
    check(spec)
    assert 0.0 < sum(spent) <= Budget.of("decisive", spec).left


def test_the_budget_goes_to_errors_before_warnings():
    """Two tracks at the fabricator's minimum for coils only warn; the tank that is too fast decides."""
    spec = spec_of(width=100, turns=12, size=6.0, readout=REFUSED)
    found = check(spec).findings
    (error,) = [f for f in found if f.rule == "SIT202"]
    assert error.severity is Severity.ERROR and "(it was tried)" in error.hint


def test_a_design_that_passes_is_not_held_up_by_hints_for_its_warnings():
    assert Budget(900.0).for_warnings().left == budget.LEAST
    assert Budget(100.0).for_warnings().left == 100.0
    assert Budget(budget.FULL).for_warnings().left == budget.FULL


@pytest.mark.parametrize("hints", ["", "all", "FULL"])
def test_another_choice_of_hints_is_an_error(hints):
    with pytest.raises(ValueError, match="hints are one of none, decisive, full"):
        check(spec_of(), hints=hints)


def test_the_whole_of_a_check_is_bounded_however_large_the_design():
    for turns in (3, 10, 30):
        for layers in (1, 2, 4, 8):
            for shape in ("circle", "octagon"):
                spec = spec_of(shape, turns, layers, size=40.0)
                hints = Budget.of("decisive", spec).left
                assert hints <= max(budget.LEAST, budget.check_work(spec))
                assert hints == budget.LEAST or hints + budget.check_work(spec) <= budget.WHOLE


def test_what_was_not_tried_is_named_as_such():
    """A budget that reaches for no trial at all: the changes that the formulas give stand in the hints, not tried."""
    spec = spec_of("octagon", turns=4, layers=2, size=5.0, readout=REFUSED)
    subject = Design(spec)
    said = [outcome for rule in RULES for outcome in outcomes(rule, subject)[0]]
    hints = {f.rule: f.hint for f in Trials(subject, RULES, said, (), Budget(1.0)).advised()}
    assert "perhaps readout.capacitance: " in hints["SIT202"] and "(not tried)" in hints["SIT202"]
    assert "perhaps coil.trace_width: 100 um" in hints["SIT101"] and NOT_FURTHER in hints["SIT101"]


def test_what_a_look_at_the_layout_refuses_is_not_named_untried():
    """Six layers were named, "not tried"; their vias have no room inside (SIT112), as the long search knew."""
    spec = spec_of("circle", turns=4.5, layers=2, width=100, size=3.0)
    hints = {found.rule: found.hint for found in sitscad.check(spec).findings}
    six = spec_of("circle", turns=4.5, layers=6, width=100, size=3.0, fpc={"stackup": "flex-6l"})
    assert "SIT112" in {found.rule for found in sitscad.check(six, hints="none").findings}
    assert NOT_FURTHER in hints["SIT201"] and "coil.layers: 6" not in hints["SIT201"] + hints["SIT203"]


def test_refused_specs_are_searched_within_the_budget_too():
    with pytest.raises(sitscad.SpecError) as raised:
        spec_of(turns=40, size=6.0)
    error = raised.value
    assert all(NOT_FURTHER in finding.hint for finding in mended(error, "none"))
    assert all("it was tried" in finding.hint for finding in mended(error, "full"))


def test_what_stands_around_a_board_changes_and_its_windings_are_not_solved_again(monkeypatch):
    layout = lay_out(spec_of("square", turns=5))
    first = sitscad.estimate(layout)
    for name in ("winding_losses", "choose_method", "inductance_matrix"):
        monkeypatch.setattr(f"sitscad.estimates.winding.solved.{name}", lambda *_: pytest.fail("solved again"))
    other = replace(layout.spec, readout=replace(layout.spec.readout, capacitance=1e-9))
    again = sitscad.estimate(replace(layout, spec=other))
    assert again.coils[0].winding_inductance == first.coils[0].winding_inductance
    assert again.coils[0].sensor_frequency < first.coils[0].sensor_frequency


def test_the_command_takes_the_choice(tmp_path, capsys):
    from sitscad.cli import run

    path = tmp_path / "spec.yaml"
    path.write_text("sitscad: 1\nname: few\ncoil: {shape: circle, outer_diameter: 3, turns: 3, layers: 2, "
                    "trace_width: 100 um, trace_spacing: 100 um}\n", encoding="utf-8")
    assert run(["check", "--hints", "none", str(path)]) == 1
    assert NOT_FURTHER in capsys.readouterr().out
    assert run(["check", "--hints", "more", str(path)]) == 2
    assert "'more' is not one of none, decisive, full" in capsys.readouterr().err
