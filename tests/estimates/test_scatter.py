"""What differs from unit to unit: one list, with sources, that follows the spec."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest
from tolerance import approx

import sitscad
from sitscad import Design
from sitscad.estimates import uncertainty
from sitscad.estimates.performance import manufacture as scatter
from sitscad.estimates.uncertainty import CAPACITOR

TEMPLATES = Path(__file__).parents[2] / "templates"


@pytest.fixture(scope="module")
def grasper():
    return Design(sitscad.load(TEMPLATES / "grasper_4layer.yaml"))


def _sigmas(design):
    return {one.name: one.sigma for one in design.scatter}


def test_every_cause_has_a_unit_a_source_and_a_name_of_its_own(grasper):
    names = [one.name for one in grasper.scatter]
    assert len(set(names)) == len(names)
    for one in grasper.scatter:
        assert one.sigma > 0.0
        assert one.unit in ("m", "rad", "1")
        assert one.per in (scatter.UNIT, scatter.COIL)
        assert one.source


def test_it_holds_what_the_spec_says(grasper):
    """The template asks 50 um of pad and placement; a band that is evenly filled has its half over the root of 3."""
    found = _sigmas(grasper)
    assert found[scatter.THICKNESS] == approx(50e-6 / math.sqrt(3.0), rel=1e-6)
    assert found[scatter.OFFSET_X] == found[scatter.OFFSET_Y] == approx(50e-6 / math.sqrt(3.0), rel=1e-6)
    assert found[scatter.YAW] == approx(2.0 * 50e-6 / 4.1e-3 / math.sqrt(3.0), rel=1e-6)
    assert found[scatter.MODULUS] == grasper.spec.elastomer.material.shear_modulus_sigma
    assert found[CAPACITOR] == approx(0.05 / math.sqrt(3.0), rel=1e-6)


def test_coils_scatter_as_the_estimate_says(grasper):
    free = [coil.states["free"] for coil in grasper.estimates.coils]
    assert _sigmas(grasper)[scatter.INDUCTANCE] == max(one.spread.inductance / one.inductance for one in free)
    assert 1e-3 < _sigmas(grasper)[scatter.INDUCTANCE] < 2e-2, "23 measured coils scattered by 0.31 %"


def test_it_follows_the_spec(grasper):
    looser = Design(replace(grasper.spec, assembly=replace(grasper.spec.assembly, tolerances=())), grasper.layout,
                    grasper.estimates)
    assert _sigmas(looser)[scatter.OFFSET_X] == approx(2.0 * _sigmas(grasper)[scatter.OFFSET_X], rel=1e-6)
    assert _sigmas(looser)[scatter.THICKNESS] == approx(3.0 * _sigmas(grasper)[scatter.THICKNESS], rel=1e-6)


def test_a_coil_alone_has_no_target_and_no_pad():
    names = {one.name for one in Design(sitscad.load(TEMPLATES / "single_coil.yaml")).scatter}
    assert names == {scatter.INDUCTANCE, CAPACITOR, scatter.CLOCK}


def test_the_states_gaps_scatter_by_the_glue_as_performance_has_it(grasper):
    """They had the pad alone: 29 um where performance and calibration had 33."""
    found, estimates = _sigmas(grasper), grasper.estimates
    glue = found[scatter.GLUE]
    assert glue == uncertainty.sigmas(grasper.spec)[scatter.GLUE] > 0.0
    assert estimates.gap_sigmas["rest"] == approx(math.hypot(found[scatter.THICKNESS], glue), rel=1e-6)
    assert estimates.gap_sigmas["pressed"] == approx(math.hypot(estimates.compression_scatter.gap, glue), rel=1e-6)
    for coil in estimates.coils:
        for state in ("rest", "pressed"):
            by_glue, by_pad = (coil.states[state].spread.shifts[one][0] for one in (scatter.GLUE, scatter.THICKNESS))
            assert by_glue < 0.0, "from thick to thin: nearer metal takes inductance away"
            if state == "rest":  # an unloaded pad and glue are heights alike
                assert by_glue / by_pad == approx(glue / found[scatter.THICKNESS], rel=0.05)


def test_a_target_without_a_pad_has_one_line_of_glue(grasper):
    bare = replace(grasper.spec, elastomer=None)
    two, one = (uncertainty.sigmas(spec)[scatter.GLUE] for spec in (grasper.spec, bare))
    assert one == approx(two / math.sqrt(2.0), rel=1e-6)
    assert uncertainty.sigmas(replace(bare, target=None))[scatter.GLUE] == 0.0


@pytest.mark.parametrize("band", ["20 um", "200 um"])
def test_the_states_and_the_pad_take_the_spec_s_own_tolerance(band):
    """They took the table's 150 um whatever the spec wrote: a third too much scatter of the signal for 50."""
    spec = sitscad.load(TEMPLATES / "grasper_4layer.yaml")
    tolerances = (("elastomer", 1e-6 * float(band.split()[0])), ("elastomer_size", 0.1e-3))
    design = Design(replace(spec, assembly=replace(spec.assembly, tolerances=tolerances)))
    found = _sigmas(design)
    assert found[scatter.THICKNESS] == approx(tolerances[0][1] / math.sqrt(3.0), rel=1e-6)
    assert design.estimates.gap_sigmas["rest"] == approx(
        math.hypot(found[scatter.THICKNESS], found[scatter.GLUE]), rel=1e-6
    )
    assert uncertainty.sigmas(design.spec)[scatter.SIZE] == found[scatter.SIZE]
    assert not any("elastomer size" in note for note in design.estimates.notes)
