"""What differs from unit to unit: one list, with sources, that follows the spec."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from template_designs import template_design
from tolerance import approx

import sitscad
from sitscad import Design
from sitscad.assembly.places import bodies
from sitscad.assembly.places.bodies import backing_of
from sitscad.calibration.calibration import plan_calibration, simulated_sensors
from sitscad.estimates.circuits import uncertainty
from sitscad.estimates.loads.pressing import GLUE, MODULUS, PAD, PAD_SIZE
from sitscad.estimates.performance.unit_errors import perturbed_readings, root_sum_of_mean_squares
from sitscad.estimates.tolerances import scatter
from sitscad.estimates.tolerances.scatter import CAPACITOR, manufacturing_scatter
from sitscad.estimates.tolerances.units_made import as_made
from tests.validation import scatter_of_units

TEMPLATES = Path(__file__).parents[2] / "templates"


@pytest.fixture(scope="module")
def grasper():
    return template_design("grasper_4layer")


def _sigmas(design):
    return {item.name: item.sigma for item in manufacturing_scatter(design.spec, design.estimates.coils)}


def test_every_scatter_cause_has_unit_source_and_unique_name(grasper):
    names = [item.name for item in manufacturing_scatter(grasper.spec, grasper.estimates.coils)]
    assert len(set(names)) == len(names)
    for item in manufacturing_scatter(grasper.spec, grasper.estimates.coils):
        assert item.sigma > 0.0
        assert item.unit in ("m", "rad", "1")
        assert item.per in (scatter.UNIT, scatter.COIL)
        assert item.source


def test_scatter_sigmas_follow_stated_tolerances(grasper):
    """The template asks 50 um of pad and placement; a band that is evenly filled has its half over the root of 3."""
    result = _sigmas(grasper)
    assert result[PAD] == approx(50e-6 / math.sqrt(3.0), rel=1e-6)
    assert result[scatter.OFFSET_X] == result[scatter.OFFSET_Y] == approx(50e-6 / math.sqrt(3.0), rel=1e-6)
    assert result[scatter.YAW] == approx(2.0 * 50e-6 / 4.1e-3 / math.sqrt(3.0), rel=1e-6)
    assert result[MODULUS] == grasper.spec.elastomer.material.shear_modulus_sigma
    assert result[CAPACITOR] == approx(0.05 / math.sqrt(3.0), rel=1e-6)


def test_inductance_scatter_equals_estimate_of_coils(grasper):
    free = [coil.states["free"] for coil in grasper.estimates.coils]
    assert _sigmas(grasper)[scatter.INDUCTANCE] == max(item.spread.inductance / item.inductance for item in free)
    assert 1e-3 < _sigmas(grasper)[scatter.INDUCTANCE] < 2e-2, "23 measured coils scattered by 0.31 %"


def test_default_tolerances_give_larger_scatter(grasper):
    looser = Design(replace(grasper.spec, assembly=replace(grasper.spec.assembly, tolerances=())), grasper.layout,
                    grasper.estimates)
    assert _sigmas(looser)[scatter.OFFSET_X] == approx(2.0 * _sigmas(grasper)[scatter.OFFSET_X], rel=1e-6)
    assert _sigmas(looser)[PAD] == approx(3.0 * _sigmas(grasper)[PAD], rel=1e-6)


def test_coil_only_spec_has_three_scatter_causes():
    names = set(_sigmas(Design(sitscad.load(TEMPLATES / "single_coil.yaml"))))
    assert names == {scatter.INDUCTANCE, CAPACITOR, scatter.CLOCK}


def test_gap_scatter_includes_glue_and_pad(grasper):
    """They had the pad alone: 29 um where performance and calibration had 33."""
    result, estimates = _sigmas(grasper), grasper.estimates
    glue = result[GLUE]
    assert glue == uncertainty.tolerance_sigmas(grasper.spec)[GLUE] > 0.0
    assert estimates.gap_sigmas["rest"] == approx(math.hypot(result[PAD], glue), rel=1e-6)
    assert estimates.gap_sigmas["pressed"] == approx(math.hypot(estimates.compression_scatter.gap, glue), rel=1e-6)
    for coil in estimates.coils:
        for state in ("rest", "pressed"):
            by_glue, by_pad = (coil.states[state].spread.shifts[item][0] for item in (GLUE, PAD))
            assert by_glue < 0.0, "from thick to thin: nearer metal takes inductance away"
            if state == "rest":  # an unloaded pad and glue are heights alike
                assert by_glue / by_pad == approx(glue / result[PAD], rel=0.05)


def test_target_without_pad_has_one_glue_line(grasper):
    bare = replace(grasper.spec, elastomer=None)
    two, item = (uncertainty.tolerance_sigmas(spec)[GLUE] for spec in (grasper.spec, bare))
    assert item == approx(two / math.sqrt(2.0), rel=1e-6)
    assert uncertainty.tolerance_sigmas(replace(bare, target=None))[GLUE] == 0.0


@pytest.mark.parametrize("band", ["20 um", "200 um"])
def test_pad_tolerance_of_spec_sets_gap_scatter(band):
    """They took the table's 150 um whatever the spec wrote: a third too much scatter of the signal for 50."""
    spec = sitscad.load(TEMPLATES / "grasper_4layer.yaml")
    tolerances = (("elastomer", 1e-6 * float(band.split()[0])), ("elastomer_size", 0.1e-3))
    design = Design(replace(spec, assembly=replace(spec.assembly, tolerances=tolerances)))
    result = _sigmas(design)
    assert result[PAD] == approx(tolerances[0][1] / math.sqrt(3.0), rel=1e-6)
    assert design.estimates.gap_sigmas["rest"] == approx(
        math.hypot(result[PAD], result[GLUE]), rel=1e-6
    )
    assert uncertainty.tolerance_sigmas(design.spec)[PAD_SIZE] == result[PAD_SIZE]
    assert not any("elastomer size" in note for note in design.estimates.notes)


KNOWN_AS = {PAD: "gap", GLUE: "glue", MODULUS: "modulus", scatter.OFFSET_X: "offset_x", scatter.OFFSET_Y: "offset_y",
            scatter.YAW: "twist"}
"""What a calibration calls the causes that it shares with studies."""


def _changed_by(design, cause, loads):
    """Change of the readings since the tare by one sigma of a cause, on the three levels of simulated units."""
    sensors, sigma = simulated_sensors(design.response), cause.sigma(design.spec)
    drawn = _readings(design.sensing.solved.bench, loads)
    (item,) = perturbed_readings(design.sensing.solved.bench, scatter.scatter_by_cause(design.spec)[cause.name], loads)
    yield item[0] - drawn
    errors = np.array([sigma if item.name == KNOWN_AS[cause.name] else 0.0 for item in sensors.unknowns])
    read = [np.log(sensors.frequencies_under(off, np.vstack([np.zeros((1, 3)), loads])))
            for off in (errors, 0.0 * errors)]
    yield (read[0][1:] - read[0][0]) - (read[1][1:] - read[1][0])
    capacitor = design.estimates.readout.capacitance
    spec = cause.moved(replace(design.spec, readout=replace(design.spec.readout, capacitance=capacitor)), sigma)
    yield _readings(Design(spec, replace(design.layout, spec=spec)).sensing.solved.bench, loads) - drawn


def _readings(bench, loads):
    return bench.readings(bench.poses(loads))


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("name", ["bench_7mm", "three_axis_triangle"])
def test_three_models_of_simulated_units_agree(name):
    """One sigma of each cause, by the response, by a calibration's chart, and of a design that
    is worked out anew, of what all causes together do.
    """
    design = template_design(name)
    full, shear = design.sensing.solved.bench.range.normal, design.sensing.solved.bench.range.shear
    loads = np.array([[0.5 * full, 0.0, 0.0], [full, 0.0, 0.0], [0.5 * full, 0.5 * shear, 0.0], [full, -shear, 0.0]])
    result = {cause.name: list(_changed_by(design, cause, loads))
             for cause in scatter.CAUSES if cause.name in KNOWN_AS}
    together = [np.sqrt(np.mean(np.sum(np.square(levels), axis=0))) for levels in zip(*result.values(), strict=True)]
    assert together[:-1] == approx(2 * [together[-1]], rel=0.01)
    for cause, levels in result.items():  # the part of the pad that a turned target loads is not as drawn
        off = [float(np.sqrt(np.mean((level - levels[-1]) ** 2))) / together[-1] for level in levels[:-1]]
        assert max(off) < 0.1, (cause, off)


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("name", ["bench_7mm", pytest.param("three_axis_triangle", marks=pytest.mark.slow)])
def test_errors_by_cause_add_up_to_error_of_simulated_units(name):
    """What one map reads of units after their tare, over one range: to first order, and of 24 that are drawn."""
    design = template_design(name)
    result = plan_calibration(design.response, is_held=True)
    scope, bench = result.sensors.range, design.sensing.analysis.bench
    loads, square = scope.evenly_spread_loads(40), 0.0
    for cause in manufacturing_scatter(design.spec, design.estimates.coils):
        ways = [[result.map(np.exp(item), np.ones(item.shape[1])) - loads[:, scope.columns] for item in each]
                for each in perturbed_readings(bench, cause, loads)]
        square += root_sum_of_mean_squares(ways) ** 2 if ways else 0.0
    assert np.sqrt(np.mean(square, axis=0)) == approx(result.map.error, rel=0.25)


def _metal_behind(**parts):
    """grasper_4layer with parts of its assembly changed."""
    spec = sitscad.load(TEMPLATES / "grasper_4layer.yaml")
    return replace(spec, **{name: replace(getattr(spec, name), **values) for name, values in parts.items()})


def test_height_over_shield_scatters_by_mount_and_glue():
    """The fit check knew both, and no number moved by them."""
    spec = _metal_behind()
    glue, mount = spec.assembly.glue_tolerance, dict(spec.assembly.tolerances)["mount"]
    assert _sigma(spec, scatter.HEIGHT) == approx(math.hypot(mount, math.sqrt(2.0) * glue) / math.sqrt(3.0), rel=1e-9)
    assert _sigma(spec, scatter.UNDER_SHIELD) == approx(glue / math.sqrt(3.0), rel=1e-9), "nothing is printed there"
    lower = _metal_behind(mount={"standoff": 1e-3})
    assert _sigma(lower, scatter.UNDER_SHIELD) == approx(
        math.hypot(mount, math.sqrt(2.0) * glue) / math.sqrt(3.0), rel=1e-9)
    bare = replace(spec, shield=None)
    assert _sigma(bare, scatter.HEIGHT) == approx(math.hypot(mount, math.sqrt(2.0) * glue) / math.sqrt(3.0), rel=1e-9)
    assert _sigma(bare, scatter.UNDER_SHIELD) == _sigma(bare, scatter.SHIELD) == 0.0
    assert _sigma(replace(bare, mount=None), scatter.HEIGHT) == 0.0


def _sigma(spec, name):
    (cause,) = (item for item in scatter.CAUSES if item.name == name)
    return cause.sigma(spec)


@pytest.mark.parametrize("standoff", [0.6e-3, 1e-3])
def test_moved_unit_has_shifted_shield_metal_or_target(standoff):
    """Heights of one unit add to glue and pieces, and glue below the target moves nothing behind the board."""
    spec = _metal_behind(mount={"standoff": standoff})
    shield, metal, gap = backing_of(spec).shield_span, backing_of(spec).metal_face, bodies.target_gap(spec)
    for name, moved in ((scatter.HEIGHT, (-1.0, -1.0, 0.0)), (scatter.UNDER_SHIELD, (0.0, -1.0, 0.0)),
                        (GLUE, (0.0, 0.0, 1.0))):
        for off in (-10e-6, 10e-6):
            unit = scatter.MOVED[name](spec, off)
            result = (backing_of(unit).shield_span[1] - shield[1], backing_of(unit).metal_face - metal,
                     bodies.target_gap(unit) - gap)
            assert result == approx(tuple(off * way for way in moved), rel=1e-6, abs=1e-12), (name, off)
    for off in (-10e-6, 10e-6):  # a shield grows downwards
        unit = scatter.MOVED[scatter.SHIELD](spec, off)
        assert backing_of(unit).shield_span == approx((shield[0] - off, shield[1]), rel=1e-9)
        assert backing_of(unit).metal_face == approx(metal - off, rel=1e-9)


def test_every_assembly_tolerance_increases_a_scatter_cause():
    """All of `assembly.tolerances` but those of the board's outline and of the other jaw, which no coil sees."""
    film = {"material": sitscad.load(TEMPLATES / "bench_7mm.yaml").elastomer.material}
    spec = _metal_behind()
    spec = spec if spec.encapsulation is None else replace(spec, encapsulation=replace(spec.encapsulation, **film))
    for name in ("elastomer", "elastomer_size", "target", "target_size", "encapsulation", "shield", "mount", "jaw",
                 "placement"):
        none, wide = (
            replace(spec, assembly=replace(spec.assembly, tolerances=((name, band),))) for band in (0.0, 1e-3))
        moved = [cause.name for cause in scatter.CAUSES if cause.sigma(wide) > cause.sigma(none)]
        assert moved, name


def test_unit_as_made_has_changed_copper_and_tracks(grasper):
    """Studies moved the stack-up and left the windings as thick and as far apart as they were drawn."""
    spec = grasper.spec
    thick = as_made(grasper.layout, scatter.MOVED[scatter.FOIL](spec, 0.1))
    first, drawn = thick.coils[0].windings, grasper.layout.coils[0].windings
    assert [w.thickness for w in first] == approx([1.1 * w.thickness for w in drawn], rel=1e-9)
    assert first[-1].z < drawn[-1].z
    wide = as_made(grasper.layout, scatter.MOVED[scatter.WIDTH](spec, 0.1))
    assert [t.width for t in wide.traces] == approx([1.1 * t.width for t in grasper.layout.traces], rel=1e-9)
    assert wide.coils[0].windings[0].path == drawn[0].path, "centre lines stay"
    radius = (wide.spec.coil.outer_diameter - wide.spec.coil.trace_width) / 2
    assert radius == approx((spec.coil.outer_diameter - spec.coil.trace_width) / 2, rel=1e-9)
    same = as_made(grasper.layout, spec)
    assert same.coils[0].windings == drawn


LARGEST = (
    scatter.WIDTH, scatter.FOIL, scatter.PLATING, scatter.DISTANCE, CAPACITOR, PAD, GLUE, MODULUS, scatter.HEIGHT)


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("name", ["grasper_3p5mm", "single_coil",
                                  pytest.param("fingertip_foil", marks=pytest.mark.slow),
                                  pytest.param("racetrack_jaw", marks=pytest.mark.slow),
                                  pytest.param("jaw_5x20", marks=pytest.mark.slow),
                                  pytest.param("grasper_4layer", marks=pytest.mark.slow)])
def test_stated_state_sigma_agrees_with_recomputed_units(name):
    """In a jaw half of the inductance's sigma and a tenth of R_P's were missing, and of tracks seven skin depths wide a
    fifth of R's. Both sides count the same causes: the modulus was left out of the units, not of what is stated.
    """
    design = scatter_of_units.drawn(name)
    for state, causes in scatter_of_units.by_causes(design, LARGEST).items():
        true = np.sqrt(np.sum(np.square(list(causes.values())), axis=0))
        over = scatter_of_units.stated(design, state, causes) / true
        assert np.all((over > 0.92) & (over < 1.1)), (state, over)
        for cause, stated, own in scatter_of_units.of_each(design, state, causes):
            assert np.all(np.abs(stated - own)[[0, 3]] < 0.1 * true[[0, 3]]), (state, cause)


@pytest.mark.slow
def test_pad_thickness_sigma_includes_change_of_target_ratio():
    """The share was held: of pads with targets as wide as the coil, a sixth of the inductance's sigma was missing."""
    design = scatter_of_units.drawn("fingertip_cell")
    for state, causes in scatter_of_units.by_causes(design, (PAD,)).items():
        (_, stated, own), = scatter_of_units.of_each(design, state, causes)
        assert stated[[0, 3]] == approx(own[[0, 3]], rel=0.05, abs=0.0 if state != "free" else 1e-15), state


@pytest.mark.slow
def test_calibration_scatter_includes_height_over_shield(grasper):
    """What a calibration takes sensors of a jaw to differ by has the height over the shield in it."""
    known = {item.name: item.sigma for item in simulated_sensors(grasper.response).unknowns}
    rest = grasper.estimates.coils[0].states["rest"]
    by_height = abs(rest.spread.shifts[scatter.HEIGHT][0]) / rest.inductance
    assert by_height > 0.01
    assert known["inductance"] > by_height
    assert 0.0 < abs(scatter.signal_share(grasper.estimates.coils[0], scatter.HEIGHT)) < 0.1
