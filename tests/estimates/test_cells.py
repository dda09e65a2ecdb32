"""Cells: each is the sensor of its coils alone, and what it reads of its neighbours is within what is stated."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from one_rule import findings_of
from tolerance import approx

import sitscad
from sitscad.assembly.places.bodies import target_gap
from sitscad.estimates.design import Design
from sitscad.estimates.loads.pad import loaded_poses, soft_pad
from sitscad.estimates.loads.pressing import formula_sigma, pressed_pad
from sitscad.estimates.loads.working_range import normal_for_strain
from sitscad.estimates.performance.tables import PerformanceReport
from sitscad.estimates.requested_response import respond
from sitscad.estimates.states.cells import cell_signals, web_crosstalk
from sitscad.estimates.targets.finite_target import equivalent_rings
from sitscad.files.documents.datasheet import figures_for_programs
from tests.hardware.conftest import TEMPLATES
from tests.validation.two_targets import change

TWO = """
sitscad: 1
name: two-cells
coil: {{shape: circle, outer_diameter: 7, turns: 7.75, layers: 4, trace_width: 153 um, trace_spacing: 153 um}}
array: {array}
fpc: {{margin: [1, 2], tail: {{length: 20}}}}
{cells}
target: {{size: {size}, thickness: 0.2, material: copper}}
elastomer: {{size: {size}, thickness: 1.5}}
readout: {{capacitance: 100 pF, drive_code: 20}}
requirements: {{normal_force: 8 N}}
"""


def design(array: str, cells: str = "cells: {coils: 1}", size: float = 10) -> Design:
    return Design(sitscad.load_text(TWO.format(array=array, cells=cells, size=size)))


@pytest.fixture(scope="module")
def two() -> Design:
    return design("{pattern: line, count: 2, pitch: 12}")


@pytest.mark.slow
def test_cell_has_target_change_of_same_sensor_alone(two):
    """In the states and under a load: what its target changes, to within what it reads of the other cell."""
    alone = design("{pattern: single}", "")
    for coil in two.estimates.coils:
        for state, own in alone.estimates.coils[0].states.items():
            if state != "free":
                assert coil.states[state].target_change == approx(own.target_change, rel=two.cells.skin.crosstalk.total)
    load = [[4.0, 0.0, 0.0]]
    result, own = (respond(item, loads=load, rotation="held") for item in (two.cells.by_number(2), alone))
    assert result.coils == ("C2",) and np.array_equal(result.poses, own.poses)
    assert result.target_change == approx(own.target_change, rel=two.cells.skin.crosstalk.total)


@pytest.mark.slow
@pytest.mark.more
@pytest.mark.parametrize("template", ["skin_strip_6", "skin_grid_3x3"])
def test_cell_of_skin_template_responds_like_same_sensor_alone(template):
    """At one frequency, for leads of other lengths shift it: under loads, and in the coil's own states."""
    skin = Design(sitscad.load(TEMPLATES / f"{template}.yaml"))
    array = replace(skin.spec.array, pattern="single", placements=skin.spec.array.placements[:1], pitch=None)
    alone = Design(replace(skin.spec, cells=None, array=array, readout=replace(skin.spec.readout, capacitance=100e-12)))
    loads, most = [[8.0, 0.0, 0.0], [4.0, 0.5, 0.0]], skin.cells.skin.crosstalk.total
    own = respond(alone, loads=loads, rotation="held", frequency=7.5e6).target_change
    for cell in map(skin.cells.by_number, (1, 5, 9)):
        result = respond(cell, loads=loads, rotation="held", frequency=7.5e6).target_change
        assert result == approx(own, rel=most)
    assert most < 2e-4


@pytest.mark.parametrize("pitch", [12.0, 16.0])
def test_target_crosstalk_agrees_with_loop_boxes_and_is_upper_bound(two, pitch):
    """Of the other target alone within a tenth; with both there, as they are, less than half of it."""
    cells = two if pitch == 12.0 else design(f"{{pattern: line, count: 2, pitch: {pitch}}}")
    spec, coil = cells.spec, cells.layout.coils[0]
    rings = equivalent_rings(spec.coil, tuple(winding.z for winding in coil.windings))
    gap, press = target_gap(spec), next(s.pose.z for s in cells.estimates.states if s.name == "pressed")
    turns = np.round(rings.turns).astype(bool)  # box_of_loops has whole turns
    places = {"radii": rings.radii[turns], "heights": rings.heights[turns], "size": (10e-3, 10e-3), "thickness": 0.2e-3}

    def step(*still: tuple[float, float], x: float) -> float:
        before, after = (change([*still, (x, z)], **places) for z in (gap, gap + press))
        return after - before

    own, other, both = step(x=0.0), step(x=1e-3 * pitch), step((0.0, gap), x=1e-3 * pitch)
    assert cells.cells.skin.crosstalk.target == approx(other / own, rel=0.1)
    assert abs(both) < 0.5 * abs(other)


def test_web_crosstalk_decays_exponentially_with_web_length(two):
    """A coil in the middle feels the target's way, a group its tilt as well; a cell with two webs twice as much."""
    def found(count: int, pitch: float, coils: int = 1) -> float:
        array = f"{{pattern: line, count: {count}, pitch: {pitch}}}"
        return web_crosstalk(design(array, f"cells: {{coils: {coils}, web: 2 mm}}").spec).sum(axis=1).max()

    near, far, row, pair = found(2, 12), found(2, 16), found(3, 12), found(4, 12, 2)
    assert near == approx(0.25 * 0.2 * math.exp(-0.95 * 2.0 / 1.5), rel=1e-9)
    assert far == approx(near * math.exp(-0.95 * 4.0 / 1.5), rel=1e-9)
    assert row == approx(2.0 * near, rel=1e-9)
    assert pair == approx(1.2 * 0.2 * math.exp(-0.95 * 14.0 / 1.5), rel=1e-9)
    assert not web_crosstalk(two.spec).any()
    webs = design("{pattern: line, count: 2, pitch: 12}", "cells: {web: 2 mm}")
    (message,) = findings_of("SIT219", webs.spec)
    assert "cell-crosstalk-webs" in message.cases and "1.4 %" in message.detail and message.severity.value == "warning"
    assert "2.9 %" in message.detail


@pytest.mark.slow
def test_webs_stiffen_pad_of_middle_cell_most():
    """Of a row of three the middle one gives least way, and is the one that figures are of; elements say 5.9 and 3 %
    (tests/validation/web_figures.csv). States are those of a mean pad, and their scatter knows that.
    """
    array = "{pattern: line, count: 3, pitch: 12}"
    webs, apart = design(array, "cells: {web: 2 mm}"), design(array)
    bare = soft_pad(apart.cells.by_number(1).spec)
    ways = [loaded_poses(webs.cells.by_number(k).spec, [[0.1, 0.0, 0.0]], np.array([True]))[0][0, 2] for k in (1, 2, 3)]
    free = bare.pose(np.array([[0.1, 0.0, 0.0]]), is_held=True)[0, 2]
    assert [free / way - 1.0 for way in ways] == approx([0.03, 0.059, 0.03], rel=0.05)
    assert list(webs.cells.extremes) == [2, 1] and len(apart.cells.extremes) == 1
    # how far a pad is pressed is judged of the cell with the least webs: of the other one it passed
    thin = sitscad.check(webs.spec.replace("cells.web", "0.3 mm"), hints="none").findings
    assert any(result.rule == "SIT328" and result.key == "cells.web" for result in thin)  # the laser's notes refused it
    far = webs.spec.replace("requirements.normal_force", "100 N")
    (strained,) = findings_of("SIT304", far)
    assert strained.message.startswith("cell 1: ")
    stated, middle, end = pressed_pad(webs.spec).strain, *(pressed_pad(webs.cells.by_number(k).spec).strain
                                                           for k in (2, 1))
    assert middle < stated < end < pressed_pad(apart.spec).strain
    assert formula_sigma(webs.spec) > formula_sigma(webs.cells.by_number(2).spec) > formula_sigma(apart.spec)
    most, least = (normal_for_strain(soft_pad(item.cells.by_number(2).spec), 0.3) for item in (webs, apart))
    assert most / least == approx(1.059, rel=1e-3)


@pytest.fixture(scope="module")
def row() -> Design:
    """Three cells joined by webs, of which the middle one has two."""
    return design("{pattern: line, count: 3, pitch: 12}", "cells: {web: 2 mm}")


@pytest.mark.more
@pytest.mark.slow
def test_performance_uses_worst_cell_for_each_value(row):
    """Figures of the cell with the least signal alone had more range and less error by tilt than its neighbours."""
    ends, middle = row.cells.skin.table.groups
    assert (ends.numbers, middle.numbers, middle.coils) == ((1, 3), (2,), ("C2",))
    full, each = row.performance[-1], [row.cells.by_number(k).performance[-1] for k in (1, 2, 3)]
    assert full.overload == full.axes["normal"].range == min(item.overload for item in each) < each[1].overload
    assert full.axes["normal"].resolution == each[1].axes["normal"].resolution > each[0].axes["normal"].resolution
    tilts = [item.tilt_error["normal"]["ry"] for item in each]
    assert full.tilt_error["normal"]["ry"] == max(tilts) > 1.2 * tilts[1]
    text = json.loads(figures_for_programs(
        PerformanceReport(row.performance, row.spec), None, cells=row.cells.skin.table.document()
    ))
    assert [item["cell"] for item in text["cells"]["each"]] == [1, 2, 3] and text["cells"]["pushed_of"] == 2
    for cell, own in zip(text["cells"]["each"], each, strict=True):
        assert cell["overload_N"] == cell["range_N"]["normal"] == approx(own.overload, rel=1e-5)
    _, first, second = text["cells"]["in_words"]
    assert first[0] == "cells 1, 3" and first[4].endswith(" (worst)") and "worst" not in second[4]
    assert second[0] == "cell 2" and second[5].endswith(" (worst)") and "worst" not in first[5]


@pytest.mark.slow
def test_production_limits_of_skin_cover_every_coil_at_every_load():
    """Half and full load had only the coils of the two cells that were solved, of three alike ones."""
    skin = design("{pattern: line, count: 3, pitch: 12}")
    assert len(skin.cells.skin.groups) == 1
    assert [set(point.production) for point in skin.performance] == 3 * [{"C1", "C2", "C3"}]


@pytest.mark.slow
def test_findings_name_worst_cell_computed_with_its_webs(row):
    """The signal was that of a mean pad; the error by tilt that of the cell that tilts least."""
    ends, middle, _ = row.estimates.signals
    loads = [[0.0, 0.0, 0.0], [8.0, 0.0, 0.0]]
    results = [respond(row.cells.by_number(k), loads=loads, rotation="held").frequency[:, 0] for k in (1, 2)]
    item, other = (after / before - 1.0 for before, after in results)
    assert ends.frequency_share / middle.frequency_share == approx(item / other, rel=2e-3) and item > 1.02 * other
    request = row.spec.replace("requirements.normal_force", "1 N").replace("requirements.tilt", "1 deg")
    cells = Design(request).cells
    wanted = [cells.by_number(k).sensing.analysis.points[-1].tilt_errors(math.radians(1.0)).max() for k in (1, 2)]
    assert wanted[0] > 1.1 * wanted[1]
    request = request.replace("requirements.tilt_error", f"{0.5 * sum(wanted):.5f} N")
    result = sitscad.check(request, hints="none")
    message = {finding.rule: finding.message for finding in result.findings}
    assert message["SIT217"].startswith("cell 2: ") and message["SIT404"][:7] in ("cell 1:", "cell 3:")
    (tilt,) = (item for item in result.reached if item.requirement == "tilt_error")
    assert tilt.at.endswith(message["SIT404"][:6])


def test_signals_of_other_cells_are_proportional_to_solved_cell(row):
    """Each solved by itself, with its own webs, within 2 % of the change; what it reads of its neighbours adds up."""
    signals, load = cell_signals(row.spec, row.estimates.coils), [[6.0, 0.0, 0.0]]
    result = [respond(row.cells.by_number(k), loads=[[0.0, 0.0, 0.0], *load], rotation="held").frequency[:, 0]
             for k in (1, 2)]
    item, other = (math.log(after / before) for before, after in result)
    assert item / other == approx(signals[0] / signals[1], rel=0.02) and item > other
    assert [(a, b) for a, b, _ in row.cells.skin.crosstalk.pairs] == [(1, 2), (2, 1), (2, 3), (3, 2)]
    of_middle = math.fsum(part for a, _, part in row.cells.skin.crosstalk.pairs if a == 2)
    assert of_middle == approx(row.cells.skin.crosstalk.total, rel=1e-2)


@pytest.mark.slow
def test_overlapping_or_close_cells_give_error_or_warning():
    def said(size: float) -> list[str]:
        wanted = design("{pattern: line, count: 2, pitch: 12}", size=size)
        return [f.severity.value for f in findings_of("SIT328", wanted.spec)]

    assert said(12.5) == ["error", "error"] and said(11.8) == ["warning", "warning"] and said(10) == []
    assert said(12) == ["error", "error"], "plates that touch are one"


def test_web_pads_closer_than_laser_kerf_give_error():
    """They were cut as one plate, and the notes spoke of webs."""
    webs = design("{pattern: line, count: 2, pitch: 10.3}", "cells: {web: 2 mm}")
    wide = replace(webs.spec, elastomer=replace(webs.spec.elastomer, kerf=0.4e-3))
    message = [[f.severity.value for f in sitscad.check(spec, hints="none").findings if f.limit in (0.2e-3, 0.4e-3)]
            for spec in (webs.spec, wide)]
    assert message == [[], ["error"]]


@pytest.mark.parametrize(("array", "cells", "rule"), [
    ("{pattern: line, count: 3, pitch: 12}", "cells: {coils: 2}", "SIT009"),
    ("{pattern: line, count: 2, pitch: 12}", "cells: {coils: 2}", "SIT009"),
    ("{centres: [[0, 0], [12, 0], [0, 12], [13, 12]]}", "cells: {coils: 2}", "SIT009"),
    ("{pattern: line, count: 2, pitch: 12}", "cells: {coils: 5}", "SIT006"),
    ("{pattern: line, count: 2, pitch: 12}", "cells: {web: 10 mm}", "SIT009"),
    ("{centres: [[0, 0], [12, 0]]}", "cells: {web: 2 mm}", "SIT009"),
    ("{pattern: line, count: 2, pitch: 12}", "cells: {web: 2 mm}\nencapsulation: {thickness: 0.2}", "SIT009"),
])
def test_coils_that_form_no_equal_cells_give_spec_error(array, cells, rule):
    with pytest.raises(sitscad.SpecError) as caught:
        design(array, cells)
    assert {finding.rule for finding in caught.value.findings} == {rule}


@pytest.mark.parametrize("target", ["shape: circle, ", "offset: [0.5, 0], ", "rotation: 10 deg, "])
def test_webs_under_unsupported_target_give_spec_error(target):
    """Under targets that do not stand on their pads as these do; a film over webs and round pads are, too."""
    text = TWO.format(array="{pattern: line, count: 2, pitch: 14}", cells="cells: {web: 2 mm}", size=8)
    text = text.replace("elastomer: {size: 8", "elastomer: {size: 9")
    with pytest.raises(sitscad.SpecError) as caught:
        sitscad.load_text(text.replace("target: {", f"target: {{{target}"))
    assert [f.key for f in caught.value.findings] == ["cells.web"]
    assert sitscad.load_text(text).cells is not None


def test_response_without_cell_number_gives_no_response_error(two):
    with pytest.raises(sitscad.NoResponse, match="2 cells"):
        respond(two, loads=[[1.0, 0.0, 0.0]])
    with pytest.raises(ValueError, match="no cell 3"):
        two.cells.by_number(3)


@pytest.mark.slow
def test_closed_pair_of_cells_equals_closed_pair_of_one_plate():
    """Their pieces have numbers, which levels of the closed pair have not: it was a KeyError."""
    jaw = "mount: {kind: grasper-pad, jaw: robotic-12mm, standoff: 1}"

    def closed(array: str, cells: str) -> dict[str, float]:
        spec = design(array, f"{cells}\n{jaw}", 7).spec
        parts = sitscad.check(spec, hints="none").fit[0].parts
        return {item.part: item.nominal for item in parts if item.part != "board across"}

    cells = closed("{pattern: line, count: 2, pitch: 9}", "cells: {web: 1 mm}")
    assert cells == closed("{pattern: single}", "") and cells["target"] > 0.0


@pytest.mark.slow
def test_every_cell_has_calibration_files_for_its_coils(two):
    from sitscad.package.contents import nominal_calibration

    files = nominal_calibration(two)
    assert {name.split("/")[1] for name in files} == {"cell-1", "cell-2", "readme.txt"}
    headers = [files[f"calibration/cell-{k}/calibration.h"].decode("ascii") for k in (1, 2)]
    assert all(f"#define SITSCAD_CELL{k}_COILS 1\n" in header for k, header in enumerate(headers, 1))
    assert b"`sitscad calibrate SPEC plan.csv --cell 2`" in files["calibration/cell-2/plan.txt"]
    with pytest.raises(sitscad.NoResponse, match="ask for one, --cell 1"):  # where only missing columns were named
        sitscad.calibrate(two, "cell-2/plan.csv")
