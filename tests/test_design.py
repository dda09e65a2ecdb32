"""A design: what follows from a spec, each thing worked out when it is asked for, and once."""

from __future__ import annotations

import ast
import inspect
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

import sitscad
import sitscad.estimates
import sitscad.layout
from sitscad.checks.board.clearances import cached_copper
from sitscad.checks.judging import RULES, apply_rules
from sitscad.checks.performance import estimated_values
from sitscad.checks.rules import rule_outcomes
from sitscad.estimates import estimate_layout
from sitscad.estimates.design import ROOM_TEMPERATURE, Design
from sitscad.estimates.windings.losses import SCREENING
from sitscad.package.contents import incoming_tests

TEMPLATES = Path(__file__).parents[1] / "templates"
WORKED_EXAMPLE = "grasper_3p5mm"
"""The readme's: a design that is refused."""


@pytest.fixture
def made(monkeypatch):
    """How often designs are laid out and estimated."""
    count: Counter[str] = Counter()

    def counting(real):
        def counted(*values, **named):
            count[real.__name__] += 1
            return real(*values, **named)

        return counted

    arrange = counting(sitscad.layout.arrange)
    monkeypatch.setattr("sitscad.layout.arrange", arrange)
    monkeypatch.setattr("sitscad.estimates.design.arrange", arrange)
    monkeypatch.setattr("sitscad.estimates.design.estimate_layout", counting(sitscad.estimates.estimate_layout))
    return count


def template(name: str) -> Design:
    return Design(sitscad.load(TEMPLATES / f"{name}.yaml"))


def test_design_computes_nothing_before_first_access(made):
    design = template("single_coil")
    assert not made
    assert design.layout is design.layout and design.fit is design.fit
    assert made == {"arrange": 1}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["grasper_4layer", "three_axis_triangle"])
def test_check_of_passing_design_computes_layout_and_estimates_once(name, made):
    design = template(name)
    review = apply_rules(design, hints="none")
    assert review.ok and review.findings and review.signals
    assert design.spec.requirements.temperature == ROOM_TEMPERATURE
    assert design.estimates is design.bare.estimates
    assert made == {"arrange": 1, "estimate_layout": 1}


@pytest.mark.slow
def test_check_without_hints_of_failing_design_computes_layout_once(made):
    review = apply_rules(template(WORKED_EXAMPLE), hints="none")
    assert not review.ok and review.not_checked
    assert made == {"arrange": 1, "estimate_layout": 1}


def test_build_reuses_layout_and_estimates_of_checked_design(made, tmp_path):
    design = template("single_coil")
    assert apply_rules(design).ok
    assert sitscad.build(design, tmp_path, only=["firmware", "laser"]).written
    assert made == {"arrange": 1, "estimate_layout": 1}


def test_bare_design_shares_layout_and_has_no_source_text():
    design = template("single_coil")
    assert design.bare.spec.source.text == "" and design.bare.layout.traces is design.layout.traces
    assert design.bare.spec == design.bare.bare.spec


def test_rules_applied_to_design_equal_check_of_spec():
    spec = sitscad.load(TEMPLATES / "single_coil.yaml")
    assert apply_rules(sitscad.Design(spec)) == sitscad.check(spec)


@pytest.mark.slow
def test_designs_with_equal_board_share_copper_measurement():
    design = template("grasper_4layer")
    apply_rules(design, hints="none")
    spec, rules = design.spec, design.spec.fpc.rules
    thicker = design.drawn(replace(spec, elastomer=replace(spec.elastomer, thickness=1.5 * spec.elastomer.thickness)))
    assert cached_copper(thicker) is cached_copper(design)
    assert apply_rules(thicker, hints="none") == apply_rules(Design(thicker.spec), hints="none")
    coarse = replace(rules, trace_spacing=1.05 * spec.coil.trace_spacing)
    stricter = design.drawn(replace(spec, fpc=replace(spec.fpc, rules=coarse)))
    assert cached_copper(stricter) is not cached_copper(design)
    message = {finding.rule for finding in apply_rules(stricter, hints="none").findings}
    assert message > {finding.rule for finding in apply_rules(design, hints="none").findings}


def members_of(cls: ast.ClassDef) -> set[str]:
    """The names that a class defines in its body, apart from dunders."""
    targets = {node.target.id for node in cls.body if isinstance(node, ast.AnnAssign)}
    functions = {node.name for node in cls.body if isinstance(node, ast.FunctionDef)}
    return {name for name in targets | functions if not name.startswith("__")}


def test_design_has_at_most_fifteen_members():
    tree = ast.parse(Path(inspect.getfile(Design)).read_text(encoding="utf-8"))
    (cls,) = (node for node in tree.body if isinstance(node, ast.ClassDef) and node.name == "Design")
    assert 10 < len(members_of(cls)) <= 15


def test_results_cached_on_design_are_computed_once():
    design = template("single_coil")
    assert incoming_tests(design) is incoming_tests(design)
    assert incoming_tests(design).board is incoming_tests(design).board
    assert design.sensing is design.bare.sensing and design.solids is design.solids


@pytest.fixture(scope="module")
def felt():
    """A sensor whose forces are judged at the screen level, which takes a part of a second."""
    spec = sitscad.load(TEMPLATES / "bench_7mm.yaml")
    request = {"normal_resolution": "1 mN", "crosstalk": 0.01, "tilt": "1 deg", "tilt_error": "1 mN"}
    for key, value in request.items():
        spec = spec.replace(f"requirements.{key}", value)
    layout = sitscad.lay_out(spec)
    estimates = estimate_layout(layout, tolerance=SCREENING)
    return lambda: Design(spec, layout, estimates)


def said(rule, design):
    result, undecided = rule_outcomes(rule, design, least=None)
    return [replace(each.finding, hint=None) for each in result], undecided


def test_rule_findings_do_not_depend_on_order(felt):
    forwards, backwards = felt(), felt()
    rules = [rule for rule in RULES if rule.id.startswith("SIT4")]
    first = {rule.id: said(rule, forwards) for rule in rules}
    assert first == {rule.id: said(rule, backwards) for rule in reversed(rules)}
    assert first == {rule.id: said(rule, felt()) for rule in rules}
    assert sum(bool(findings) for findings, _ in first.values()) > 2


def test_requirement_values_equal_estimates_without_running_rules(felt):
    untouched, judged_before = felt(), felt()
    reached = apply_rules(judged_before, hints="none").reached
    assert estimated_values(untouched.cells) == reached
    assert {"normal_resolution", "crosstalk", "tilt_error"} <= {result.requirement for result in reached}
