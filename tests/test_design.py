"""A design: what follows from a spec, each thing worked out when it is asked for, and once."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

import sitscad
import sitscad.estimates
import sitscad.layout
from sitscad.checks.board.clearances import copper_in
from sitscad.checks.judging import judged
from sitscad.estimates.design import ROOM_TEMPERATURE, Design

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
    monkeypatch.setattr("sitscad.layout.arrange", arrange)
    monkeypatch.setattr(sitscad.estimates, "estimated", counting(sitscad.estimates.estimated))
    return count


def template(name: str) -> Design:
    return Design(sitscad.load(TEMPLATES / f"{name}.yaml"))


def test_nothing_is_made_before_it_is_asked_for(made):
    design = template("single_coil")
    assert not made
    assert design.layout is design.layout and design.scene is design.scene
    assert made == {"arrange": 1}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["grasper_4layer", "three_axis_triangle"])
def test_a_design_that_passes_is_laid_out_and_estimated_once(name, made):
    design = template(name)
    review = judged(design, hints="none")
    assert review.ok and review.findings and review.signals
    assert design.spec.requirements.temperature == ROOM_TEMPERATURE
    assert design.estimates is design.bare.estimates
    assert made == {"arrange": 1, "estimated": 1}


@pytest.mark.slow
def test_a_design_that_is_refused_is_laid_out_and_estimated_once_where_no_hint_is_asked_for(made):
    review = judged(template(WORKED_EXAMPLE), hints="none")
    assert not review.ok and review.not_checked
    assert made == {"arrange": 1, "estimated": 1}


def test_a_build_takes_the_design_that_was_reviewed(made, tmp_path):
    design = template("single_coil")
    assert judged(design).ok
    assert sitscad.build(design, tmp_path, only=["firmware", "laser"]).written
    assert made == {"arrange": 1, "estimated": 1}


def test_a_bare_design_is_the_same_without_its_text():
    design = template("single_coil")
    assert design.bare.spec.source.text == "" and design.bare.layout.traces is design.layout.traces
    assert design.bare.spec == design.bare.bare.spec


def test_a_design_that_is_judged_says_what_check_says():
    spec = sitscad.load(TEMPLATES / "single_coil.yaml")
    assert judged(sitscad.Design(spec)) == sitscad.check(spec)


@pytest.mark.slow
def test_designs_with_one_board_measure_its_copper_once_and_are_judged_as_ever():
    design = template("grasper_4layer")
    judged(design, hints="none")
    spec, rules = design.spec, design.spec.fpc.rules
    thicker = design.drawn(replace(spec, elastomer=replace(spec.elastomer, thickness=1.5 * spec.elastomer.thickness)))
    assert copper_in(thicker) is copper_in(design)
    assert judged(thicker, hints="none") == judged(Design(thicker.spec), hints="none")
    coarse = replace(rules, trace_spacing=1.05 * spec.coil.trace_spacing)
    stricter = design.drawn(replace(spec, fpc=replace(spec.fpc, rules=coarse)))
    assert copper_in(stricter) is not copper_in(design)
    said = {finding.rule for finding in judged(stricter, hints="none").findings}
    assert said > {finding.rule for finding in judged(design, hints="none").findings}
