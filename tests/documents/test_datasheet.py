"""The data sheet: says what the numbers say, looks the same wherever it is made, and is made where forces are felt."""

from __future__ import annotations

import html
import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from template_designs import template_design
from tolerance import approx

import sitscad
from sitscad import Design
from sitscad.basics.units import show
from sitscad.calibration.calibration import plan_calibration
from sitscad.estimates.loads.pad import soft_pad
from sitscad.estimates.loads.working_range import validated_shear
from sitscad.estimates.performance.tables import (
    FROM_UNIT_TO_UNIT,
    MapFigures,
    PerformanceReport,
    axis_table,
    error_table,
)
from sitscad.estimates.performance_values import lasts_after_tare
from sitscad.files.documents import PAPERS
from sitscad.files.documents.datasheet import (
    TARED_AFTER_A_GRASP,
    TARES,
    _converter_text,
    acceptance_rows,
    notes,
    render,
    sensor_summary_rows,
)
from sitscad.files.documents.datasheet_plots import (
    BEYOND,
    BEYOND_LINES,
    NARROW,
    WIDE,
    coil_difference,
    sensor_plots,
)
from sitscad.files.drawing.pdf import pdf
from sitscad.files.drawing.sheet import Label, Sheet, draw_figure, flat_items
from sitscad.files.drawing.svg import svg
from sitscad.files.report.page import _performance_html
from sitscad.package.contents import incoming_tests, nominal_calibration
from sitscad.spec import presets

TEMPLATES = Path(__file__).parents[2] / "templates"
(WRITER,) = (writer for writer in PAPERS if writer.name == "data sheet")


@pytest.fixture(scope="module")
def bench():
    return template_design("bench_7mm")


@pytest.fixture(scope="module")
def files(bench):
    return render(bench.layout, bench.estimates, bench.response, bench.performance, bench.sensing.curves, "",
                  incoming_tests(bench).board)


def _axes(design, found=None):
    """The rows of what every axis can do."""
    reached = None if found is None else MapFigures(found.map.end, found.crosstalk)
    return axis_table(PerformanceReport(design.performance, design.spec, reached)).rows


@pytest.fixture(scope="module")
def drawn(bench):
    return bench.sensing.curves


@pytest.mark.slow
def test_report_and_data_sheet_have_equal_rows(bench, files):
    """Each named and rounded them by itself."""
    sheet = json.loads(files["datasheet.json"])
    page, paper = _performance_html(sheet), files["datasheet.html"].decode()
    tables = PerformanceReport(bench.performance, bench.spec).tables()
    assert len(tables) == len(sheet["in_words"]) == 4
    for table in tables:
        for row in table.rows:
            assert all(html.escape(cell) in text for cell in row for text in (page, paper)), row


@pytest.mark.more
@pytest.mark.slow
def test_extrapolated_shear_note_appears_once():
    design = Design(sitscad.load(TEMPLATES / "three_axis_triangle.yaml"))
    result = list(notes(design.performance, plan_calibration(design.response, is_held=True)))
    assert sum("is extrapolated" in note for note in result) == 1


@pytest.mark.more
@pytest.mark.slow
def test_data_sheet_contains_values_of_performance(bench, files):
    page, full = files["datasheet.html"].decode(), bench.performance[-1]
    for axis in full.axes.values():
        assert show(axis.resolution, "N", 3) in page and show(axis.range, "N", 3) in page
        for cause, error in axis.errors.items():
            assert cause in FROM_UNIT_TO_UNIT or show(error, "N", 3) in page
    assert show(full.overload, "N", 3) in page
    assert "C1.A" in page and "each reading means one load" in page


@pytest.mark.slow
def test_unit_errors_equal_calibration_errors(bench, files):
    """Three papers had three errors of manufacture, of different definitions."""
    made = nominal_calibration(bench)
    stated = json.loads(made["calibration/calibration.json"])
    sheet = json.loads(files["datasheet.json"])["unit_to_unit"]
    assert sheet["rotation"] == stated["rotation"] == "held", "the target is kept level in both"
    assert [item["of"] for item in sheet["unit_errors"]] == [item["of"] for item in stated["unit_errors"]]
    for item, other in zip(sheet["unit_errors"], stated["unit_errors"], strict=True):
        assert item["error_N"] == approx(other["error_N"], rel=1e-5)
    assert [item["points"] for item in sheet["unit_errors"]] == [None, 0, 3, 5, 8]
    errors = np.array([list(item["error_N"].values()) for item in stated["unit_errors"]])
    assert np.all(np.diff(errors, axis=0) <= 0.0), "a tare and every point take something away"
    assert stated["unit_errors"][1]["error_N"] == stated["error_N"], "one figure for a unit that is tared alone"
    page, other = files["datasheet.html"].decode(), made["calibration/calibration.html"].decode()
    for row in plan_calibration(bench.response, is_held=True).error_rows:
        for cell in row:
            assert cell in page and cell in other
    assert "before calibration" not in page


def test_data_sheet_crosstalk_equals_crosstalk_of_delivered_map(bench, files):
    """The sheet had 0.09 % by a polynomial in exact readings alone, where the map in calibration/ left 0.9 %."""
    text = json.loads(files["datasheet.json"])["map_crosstalk"]["normal"]["shear_x"]
    result = plan_calibration(bench.response, is_held=True)
    full, shear = result.map.full_scale
    loads = [[0.0, 0.0, 0.0], *([0.5 * full, share * shear, 0.0] for share in (0.0, -1.0, -0.5, 0.5, 1.0))]
    tare, *frequency = sitscad.respond(bench, loads=loads, rotation="held").frequency
    normal = result.map(frequency, tare)[:, 0]
    assert text == approx(np.abs(normal - normal[0]).max() / full, rel=0.05)
    assert bench.performance[1].crosstalk["normal"]["shear_x"] < text < 0.01
    assert "crosstalk, map to newtons, design as drawn, half load" in files["datasheet.html"].decode()


def test_plots_have_two_fixed_widths(files):
    """Narrow ones were drawn as wide as the page, with letters of twice the size."""
    curves = files["datasheet.html"].decode().partition("<h2>Curves</h2>")[2].partition("</section>")[0]
    wide, _, narrow = curves.partition("<div class='narrow'>")
    sizes = {part: re.findall(r"<svg [^>]*viewBox='0 0 ([0-9.]+)", result)
             for part, result in (("wide", wide), ("narrow", narrow))}
    assert sizes["wide"] and set(sizes["wide"]) == {f"{WIDE[0]:g}"}
    assert sizes["narrow"] and set(sizes["narrow"]) == {f"{NARROW[0]:g}"}


def test_crosstalk_rows_name_load_and_show_worst_value(bench):
    """Crosstalk and nonlinearity were those at half load and did not say so; SIT403 judged full load, and more."""
    result = plan_calibration(bench.response, is_held=True)
    rows = {row[0]: row[1:] for row in _axes(bench, result)}
    named = [name for name in rows if name.startswith(("crosstalk", "nonlinearity"))]
    assert len(named) == 4 and all("load" in name for name in named)
    worst = max(point.crosstalk["normal"]["shear_x"] for point in bench.performance)
    share = f"{100.0 * worst:.2g} %" if worst >= 1e-4 else "below"
    assert rows["crosstalk, best polynomial, design as drawn, worst load"][0].startswith(share)


def test_data_sheet_json_has_values_of_performance(bench, files):
    felt = json.loads(files["datasheet.json"])["performance"]
    assert [point["at"] for point in felt] == ["rest", "half", "full"]
    for point, known in zip(felt, bench.performance, strict=True):
        assert point["axes"]["normal"]["resolution_N"] == approx(known.axes["normal"].resolution, rel=1e-5)


def test_bandwidth_is_half_scan_rate_below_mechanical_resonance(bench, files):
    """A copper square of 8 x 8 x 0.2 mm and a third of the pad under it, on the pad's own stiffness."""
    full, spec = bench.performance[-1], bench.spec
    layers = 8960.0 * spec.target.thickness + spec.elastomer.material.density * spec.elastomer.thickness / 3.0
    mass = spec.target.size[0] * spec.target.size[1] * layers
    stiffness = soft_pad(spec).stiffness(np.zeros((1, 6)))[0, 2, 2]
    alone = np.sqrt(stiffness / mass) / (2.0 * np.pi)
    assert bench.performance[0].resonance["normal"] == approx(alone, rel=1e-6)
    assert full.resonance["normal"] > full.resonance["shear_x"] > full.bandwidth
    assert full.bandwidth == approx(0.5 * spec.readout.scan_rate, rel=1e-3)
    assert full.bandwidth_by == "half the scan rate"
    page = files["datasheet.html"].decode()
    assert "resonance of target and pad at rest" in page
    assert f"{show(bench.performance[0].resonance['normal'], 'Hz', 2)} normal" in page  # not that of full load


def test_data_sheet_page_loads_no_external_files(files):
    page = files["datasheet.html"].decode()
    assert page.count("<svg") == 5  # the drawing, four plots
    assert not re.search(r"(src|href)\s*=\s*[\"']?(http|//)", page)
    assert "nan" not in re.sub(r"<[^>]*>", " ", page).lower().split()


def test_data_sheet_pdf_has_five_pages_without_creation_date(files):
    text = files["datasheet.pdf"].decode("latin-1")
    assert text.count("/Type /Page ") == 5
    assert "CreationDate" not in text and "matplotlib" not in text.lower()


@pytest.mark.more
@pytest.mark.slow
def test_data_sheet_is_reproducible_in_other_process(tmp_path):
    """Both as the command has it: one thread for linear algebra."""
    code = (
        "import sitscad, sys; from sitscad import Design; from sitscad.files.documents.datasheet import render; "
        "from sitscad.package.contents import incoming_tests; "
        "d = Design(sitscad.load(sys.argv[1])); "
        "[open(sys.argv[2] + n, 'wb').write(b) for n, b in "
        "render(d.layout, d.estimates, d.response, d.performance, d.sensing.curves, '', "
        "incoming_tests(d).board).items()]"
    )
    source = str(Path(sitscad.__file__).parents[1])
    for seed in ("1", "7"):
        (tmp_path / seed).mkdir()
        spec = str(TEMPLATES / "bench_7mm.yaml")
        subprocess.run([sys.executable, "-c", code, spec, f"{tmp_path / seed}/"], check=True,
                       env={"PYTHONPATH": source, "PYTHONHASHSEED": seed, "HOME": str(tmp_path),
                            "OPENBLAS_NUM_THREADS": "1"})
    names = sorted(path.name for path in (tmp_path / "1").iterdir())
    assert names == ["datasheet.html", "datasheet.json", "datasheet.pdf"]
    for name in names:
        assert (tmp_path / "1" / name).read_bytes() == (tmp_path / "7" / name).read_bytes()


@pytest.mark.slow
def test_forced_data_sheet_is_marked(bench):
    made = render(bench.layout, bench.estimates, bench.response, bench.performance, bench.sensing.curves, "why",
                  incoming_tests(bench).board)
    page = made["datasheet.html"].decode()
    assert "does not meet its own checks" in page


def test_data_sheet_curves_equal_response(bench, drawn):
    loads = np.zeros((1, 3))
    loads[0, 0] = drawn.normal.forces[-1]
    last = bench.response.respond_to_loads(loads, np.ones(1, dtype=bool))
    rest = bench.response.respond(np.zeros((1, 6)))
    ratio = drawn.normal.inductance[-1] / drawn.normal.inductance[0]
    assert ratio == approx((rest.frequency[0] / last.frequency[0]) ** 2, rel=2e-4)
    assert np.all(drawn.normal.sigma[0] < 1e-12), "after the tare nothing is off at rest"
    assert np.all(drawn.normal.sigma[-1] > 0.0)


def test_shear_difference_of_two_coils_is_l1_minus_l2(drawn):
    words, weights = coil_difference(drawn, "shear_x")
    assert words == "L1 - L2" and list(weights) == [1.0, -1.0]


@pytest.mark.more
@pytest.mark.slow
@pytest.mark.parametrize("name", [
    "three_axis_triangle", "fingertip_foil",
    *(pytest.param(name, marks=pytest.mark.more) for name in ("three_axis_grid", "grasper_4layer")),
])
def test_data_sheet_of_each_array_pattern_is_rendered(name):
    design = template_design(name)
    made = render(design.layout, design.estimates, design.response, design.performance, design.sensing.curves, "",
                  incoming_tests(design).board)
    assert set(made) == {"datasheet.html", "datasheet.json", "datasheet.pdf"}
    # one coil has one curve, neither a sum of several nor a shear
    assert made["datasheet.html"].decode().count("<svg") == (3 if name == "fingertip_foil" else 5)


def test_sensor_without_target_has_no_data_sheet(bench):
    assert WRITER.applies(bench.spec)
    assert not WRITER.applies(sitscad.load(TEMPLATES / "single_coil.yaml"))
    assert render(bench.layout, bench.estimates, bench.response, (), None, "", incoming_tests(bench).board) == {}


def test_curves_beyond_validated_shear_are_marked_extrapolated(bench, drawn):
    """Curves ran on to the pad's thickness as if they were as good there as at half of it."""
    most = max(float(np.abs(curve.forces).max()) for curve in drawn.shears)
    for held, is_marked in ((0.6 * most, True), (1.1 * most, False)):
        plots, texts, captions = sensor_plots(replace(drawn, validated_shear=held), bench.performance), [], ""
        for each in plots[:2]:
            sheet = Sheet("plot", each.size)
            draw_figure(sheet, (0.0, 0.0, *each.size), each.draw)
            texts.append({item.text for item in flat_items(sheet.items) if isinstance(item, Label)})
        captions = " ".join(each.caption for each in plots)
        assert [("extrapolated" in result) for result in texts] == [is_marked] * 2
        assert (BEYOND in captions) is is_marked and (BEYOND_LINES in captions) is is_marked


def test_combined_error_is_root_sum_square_after_tare(bench):
    """Drift, hysteresis, creep, tilt and noise stood side by side, and nothing said what they come to."""
    rows = dict((row[0], row[1:]) for row in _axes(bench))
    for name, shown in zip(bench.performance[-1].axes, rows["errors together, full load, a tare before each grasp"],
                           strict=True):
        errors = bench.performance[-1].axes[name].errors
        counted = {"noise", "hysteresis", "creep", "curved map", "drift with a tare before each grasp, 10 K",
                   "tilt of 1 degree", "twist of 1 degree", "contact 0.1 mm beside the middle"}
        assert counted < set(errors)
        assert shown == show(np.sqrt(sum(errors[cause] ** 2 for cause in counted)), "N", 3)
        assert {cause for cause in errors if lasts_after_tare(cause)} == counted


def test_every_drift_row_names_its_tare(bench):
    rows = [row[0] for row in (*_axes(bench), *error_table(bench.performance).rows)
            if re.search(r"drift.* 10 K", row[0])]
    assert len(rows) == 5
    for row in rows:
        assert row.endswith("after the calibration" if "with a tare" in row else "after the one tare")
    assert {TARES, TARED_AFTER_A_GRASP} < set(notes(bench.performance))


@pytest.mark.parametrize(("coils", "number"), [(1, 1), (4, 1), (5, 2), (6, 2), (9, 3)])
def test_data_sheet_states_required_number_of_converters(coils, number):
    """Six channels were said of one LDC1614, which has four."""
    message = _converter_text(presets.converter("ldc1614"), coils)
    assert int(re.match(r"(\d+) x |", message)[1] or 1) == number and f"{coils} channel" in message


def test_acceptance_limits_are_three_sigma_around_expected_values(bench):
    """L up to 1.408 uH was asked for with no frequency. A meter of 100 kHz reads 1.397 +- 0.008 uH of sound coils."""
    board = incoming_tests(bench).board
    head, *rows = acceptance_rows(board.coils, board.metered, board.temperature)
    assert sum("100 kHz" in column for column in head) == 2
    for row, coil, read in zip(rows, board.coils, board.metered, strict=True):
        result = dict(zip(head, row, strict=True))
        free = coil.states["free"]
        wanted = {"f": (free.frequency, free.spread.frequency), "L": (read.inductance, read.inductance_sigma),
                  "R, LCR": (read.resistance, read.resistance_sigma), "R, ohm": (read.direct, read.direct_sigma)}
        for start, (value, sigma) in wanted.items():
            (text,) = (cell for column, cell in result.items() if column.startswith(start))
            low, high, unit = re.fullmatch(r"([\d.]+) to ([\d.]+) (.+)", text).groups()
            scale = {"MHz": 1e6, "uH": 1e-6, "nH": 1e-9, "ohm": 1.0, "mohm": 1e-3}[unit]
            assert float(low) * scale == approx(value - 3.0 * sigma, abs=0, rel=1e-3)
            assert float(high) * scale == approx(value + 3.0 * sigma, abs=0, rel=1e-3)


def test_axis_table_states_limit_of_validated_shear(bench):
    rows = dict((row[0], row[1:]) for row in _axes(bench))
    assert rows["extrapolated by the pad's law beyond"][-1] == show(validated_shear(bench.spec), "N", 3)
    assert rows["extrapolated by the pad's law beyond"][0] == "-"


LONG = """
sitscad: 1
name: long
coil: {shape: circle, outer_diameter: 7, turns: 12, layers: 2, trace_width: 0.1, trace_spacing: 0.1}
array: {count: 2, pitch: 13}
target: {shape: rectangle, size: [26, 7.5], thickness: 0.2}
elastomer: {size: [26, 7.5], thickness: 1, material: ecoflex-00-30}
mount: {kind: bench-plate, standoff: 3}
requirements: {normal_force: 5 N, shear_force: 1 N}
"""


@pytest.mark.slow
def test_overload_of_unstable_pad_equals_its_range(bench):
    """It stood with an overload of 207 N beside a range that ends by instability at 155 N."""
    design = Design(sitscad.load_text(LONG))
    full = design.performance[-1]
    assert full.axes["normal"].limited_by == "instability"
    assert full.overload == full.axes["normal"].range
    rows = dict((row[0], row[1:]) for row in sensor_summary_rows(design.performance, design.layout, design.estimates))
    assert rows["overload, kept level (the pad gives way sideways)"] == (show(full.overload, "N", 3),)
    usual = dict((row[0], row[1:]) for row in sensor_summary_rows(bench.performance, bench.layout, bench.estimates))
    assert "overload (30 % strain of the pad)" in usual


@pytest.mark.slow
def test_lower_overload_of_free_target_is_stated(bench):
    """Overload and range are a level target's: a free one was lost at 57 % of the 155 N that stood there."""
    design = Design(sitscad.load_text(LONG))
    full, pad = design.performance[-1], soft_pad(design.spec)
    assert full.free_overload < 0.6 * full.overload
    near = np.array([[share * full.free_overload, 0.0, 0.0] for share in (0.3, 0.7, 0.999, 1.001, 1.2, 1.6)])
    assert list(np.isnan(pad.pose(near)[:, 0])) == [False] * 3 + [True] * 3
    assert not np.isnan(pad.pose(near, is_held=True)).any()
    rows = dict((row[0], row[1:]) for row in sensor_summary_rows(design.performance, design.layout, design.estimates))
    said = show(full.free_overload, "N", 3)
    assert rows["overload, free to tilt (the pad gives way sideways)"] == (said,)
    (note,) = (note for note in full.notes if "kept level" in note)
    assert f"free to tilt the pad gives way sideways at {said}" in note
    assert full.document()["free_overload_N"] == full.free_overload
    assert bench.performance[-1].free_overload is None
    assert not any("gives way" in note for note in bench.performance[-1].notes)
    assert not np.isnan(soft_pad(bench.spec).pose(np.array([[bench.performance[-1].overload, 0.0, 0.0]]))).any()


@pytest.mark.more
@pytest.mark.slow
def test_two_shear_axes_share_one_calibrated_limit(bench):
    """3 N and 3 N stood as full scales; of both together the map in calibration/ read 2.67 N normal for 0.2."""
    design = Design(sitscad.load(TEMPLATES / "three_axis_pad.yaml"))
    result = plan_calibration(design.response, is_held=True)
    sensors, limit = result.sensors, result.sensors.range.shear
    message = f"{limit:.3g} N in any direction"
    rows = dict((row[0], row[1:]) for row in _axes(design))
    words = f"{show(limit, 'N', 3)} ({show(limit / 2**0.5, 'N', 3)} each)"
    assert rows["calibrated for a resultant shear up to"] == ("-", words, words)
    assert sum(message in note for note in notes(design.performance, result)) == 1
    made = nominal_calibration(design)
    assert message in made["calibration/calibration.h"].decode() and message in made["calibration/plan.txt"].decode()
    # it is so: on the circle all is read, at the square's corner the normal force is lost
    loads = np.array([[0.0, 0.0, 0.0], *([0.2, share * limit, -share * limit] for share in (0.7, 1.0))])
    frequency = sensors.frequencies_under(np.zeros(len(sensors.unknowns)), loads, exact=True)
    off = np.abs(result.map(frequency[1:], frequency[0]) - loads[1:])
    assert np.all(off[0] < 0.01 * limit) and off[1][0] > 0.3 * limit
    rows = dict((row[0], row[1:]) for row in _axes(bench))
    assert "calibrated for a resultant shear up to" not in rows
    calibration = plan_calibration(bench.response, is_held=True)
    assert not any("any direction" in note for note in notes(bench.performance, calibration))


def test_every_error_table_names_its_loads(bench):
    """Capacitors, without a tare, at full load stood beside a smaller error of a unit without a tare, over all."""
    result = plan_calibration(bench.response, is_held=True)
    assert result.error_rows[0][0] == "error over all loads, of" and "over all loads" in result.errors_are
    assert "at full load" in error_table(bench.performance).head[0]


def test_curves_of_cell_name_cell_and_show_coil_once(bench, drawn):
    """The same curve stood twice, once as a sum of coils and a difference over shear that there is none of."""
    normal = drawn.normal
    alone = replace(drawn, coils=("C5",), places=drawn.places[:1], shears=(), ranges=(), normal=replace(
        normal, inductance=normal.inductance[:, :1], sigma=normal.sigma[:, :1]))
    curve, errors_of = sensor_plots(alone, bench.performance, "cell 5")
    assert curve.caption.startswith("Cell 5") and "shear" not in curve.caption and "worst" in errors_of.caption
    sheet = Sheet("plot", curve.size)
    draw_figure(sheet, (0.0, 0.0, *curve.size), curve.draw)
    assert "cell 5, L5" in [item.text for item in flat_items(sheet.items) if isinstance(item, Label)]
    plots = sensor_plots(drawn, bench.performance)
    assert not any(word in each.caption for each in plots for word in ("Cell", "worst"))


def test_axis_table_states_end_of_map(bench):
    """121 N stood as range beside a map that reads no more than 9."""
    found = plan_calibration(bench.response, is_held=True)
    loads = np.array([[share * found.map.full_scale[0], 0.0, 0.0] for share in (0.0, 1.0, 1.5)])
    frequency = sitscad.respond(bench, loads=loads, rotation="held").frequency
    read = found.map(frequency[1:], frequency[0])[:, 0]
    assert read[0] < found.map.end < loads[2, 0] and read[1] == approx(found.map.end, rel=1e-3)
    rows = dict((row[0], row[1:]) for row in _axes(bench, found))
    assert rows["calibrated range: the map to newtons ends at"][0] == f"{show(found.map.end, 'N', 3)}, pressed alone"


def test_round_target_row_states_diameter(bench):
    """It stood as 9 x 9 mm beside a drawing that said a diameter of 9 mm."""
    spec = bench.spec
    plates = replace(spec.target, shape="circle", size=(9e-3, 9e-3)), replace(spec.elastomer, size=(9.5e-3, 9e-3))
    layout = replace(bench.layout, spec=replace(spec, target=plates[0], elastomer=plates[1]))
    rows = dict((row[0], row[1:]) for row in sensor_summary_rows(bench.performance, layout, bench.estimates))
    assert ", diameter 9 mm, " in rows["target"][0]
    assert ", 9.5 x 9 mm, " in rows["elastomer"][0]


def test_plot_consists_of_sheet_shapes_and_labels():
    sheet = Sheet("plot", (80.0, 50.0))

    def line(figure):
        axes = figure.subplots()
        axes.plot([0.0, 1.0, 2.0], [0.0, 1.0, 5.0], label="curve")
        axes.set(xlabel="force", ylim=(0.0, 2.0))
        axes.legend()

    draw_figure(sheet, (0.0, 0.0, 80.0, 50.0), line)
    texts = [item.text for item in flat_items(sheet.items) if isinstance(item, Label)]
    assert {"force", "curve", "2.0"} <= set(texts)
    for item in flat_items(sheet.items):
        if not isinstance(item, Label):
            for path in item.paths:
                for piece in path.segments:
                    assert -0.5 < piece.start.x < 80.5 and -0.5 < piece.start.y < 50.5
    assert svg(sheet) == svg(sheet) and pdf([sheet])


def test_many_rows_on_first_sheet_stay_above_frame(bench, monkeypatch):
    """The note at the foot of skin_strip_6's data sheet ran over the frame."""
    sheets = []
    monkeypatch.setattr("sitscad.files.documents.datasheet.pdf", lambda made: sheets.extend(made) or b"")
    more = [("row", "-", "-")] * 12
    def longer(report):
        result = axis_table(report)
        return result._replace(rows=[*result.rows, *more])

    monkeypatch.setattr("sitscad.files.documents.datasheet.axis_table", longer)
    render(bench.layout, bench.estimates, bench.response, bench.performance, bench.sensing.curves, "",
           incoming_tests(bench).board)
    assert min(item.at.y for item in sheets[0].items if isinstance(item, Label)) > 9.0
