"""The report as a browser shows it: nothing thrown, nothing fetched; pushed sensor, 3-D, board and findings work."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path

import numpy as np
import pytest
from browser import Browser
from tolerance import approx

import sitscad
from sitscad.calibration.inverse_map import map_of
from sitscad.estimates.design import Design
from sitscad.package.building import build

pytestmark = [pytest.mark.clients("chromium"), pytest.mark.cad]

TEMPLATE = Path(__file__).parents[2] / "templates" / "grasper_4layer.yaml"
AXE = Path("/usr/local/share/axe-core/axe.min.js")


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Path:
    shown = ("datasheet", "calibration", "assembly", "report")
    return build(sitscad.load(TEMPLATE), tmp_path_factory.mktemp("report"), only=shown).directory


@pytest.fixture(scope="module")
def page(package):
    with Browser() as browser:
        browser.size(1280, 1000)
        browser.open(package / "report.html")
        yield browser


@pytest.mark.slow
def test_states_and_pushed_sensor_have_equal_rest_frequency(package):
    """Files of one package had two frequencies at rest, 0.01 % apart."""
    coils = json.loads((package / "estimate.json").read_text())["coils"]
    states = [coil["states"]["rest"]["frequency_Hz"] for coil in coils]
    pushed = json.loads((package / "datasheet.json").read_text())["pushed"]
    assert pushed["rest_Hz"] == approx(states, rel=1e-6, abs=0.0)


def _put(page: Browser, name: str, value: float | str) -> None:
    page.run(f"(() => {{ const input = document.querySelector('[data-in={name}]'); input.value = {json.dumps(value)};"
             " input.dispatchEvent(new Event('input')); })()")


def _out(page: Browser, name: str) -> str:
    return str(page.run(f"document.querySelector('[data-out=\"{name}\"]').textContent"))


def _drawn(page: Browser) -> bytes:
    """What the 3-D view shows now."""
    page.run("document.querySelector('.stage').scrollIntoView()")
    page.run("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    box = page.run("(() => { const b = document.querySelector('.stage').getBoundingClientRect();"
                   " return [b.x + scrollX, b.y + scrollY, b.width, b.height]; })()")
    clip = dict(zip(("x", "y", "width", "height"), box, strict=True)) | {"scale": 1}
    return base64.b64decode(page.call("Page.captureScreenshot", clip=clip)["data"])


def test_page_loads_without_exceptions_or_requests(page, package):
    assert page.run("document.documentElement.dataset.sitscadError") is None and page.exceptions == []
    assert page.requests == [(package / "report.html").as_uri()]
    assert (package / "report.html").stat().st_size < 3e6
    assert page.run("document.querySelector('#solids').hidden || document.querySelector('#pushed').hidden") is False


@pytest.mark.more
@pytest.mark.slow
def test_pushed_sensor_agrees_with_response_and_map(page, package):
    """Within 2 % of the span; what is read back of its counts is what the library's map makes of them."""
    model = Design(sitscad.load(TEMPLATE)).response
    known = map_of(package / "calibration" / "calibration.json")
    tare = [float(_out(page, f"counts.{coil}")) for coil in ("C1", "C2")]
    generator = np.random.default_rng(4)
    table = json.loads(page.run("document.getElementById('pushed-data').textContent"))["table"]
    scale = table["full_scale_N"]
    loads = generator.random((6, 3)) * [scale["normal"], 0.7 * scale["shear"], 0.7 * scale["shear"]]
    span, tops = np.ptp(model.respond_to_loads(np.vstack([np.zeros(3), loads])).frequency, axis=0), []
    for load in loads:
        request = list[float]()
        for name, force in zip(("normal_N", "shear_x_N", "shear_y_N"), load, strict=True):
            _put(page, name, force)
            request.append(float(page.run(f"document.querySelector('[data-in={name}]').value")))
        frequency = model.respond_to_loads(np.array([request])).frequency[0]  # a slider has steps
        text = [float(_out(page, f"frequency_Hz.{coil}")) for coil in ("C1", "C2")]
        tops.append(np.abs(text - frequency) / span)
        counts = [float(_out(page, f"counts.{coil}")) for coil in ("C1", "C2")]
        read = [float(_out(page, "force_N.normal")), float(_out(page, "force_N.shear_x"))]
        assert read == approx(known(counts, tare)[0], abs=6e-4)  # the page shows three decimals
    assert np.max(tops) < 0.02
    assert _out(page, "range") == ""
    _put(page, "normal_N", 1.15 * scale["normal"])
    assert "Beyond the working range: normal force" in _out(page, "range")
    page.run("[...document.querySelectorAll('#pushed button')].at(-1).click()")
    assert float(_out(page, "change_Hz.C1")) == 0.0 and float(_out(page, "force_N.normal")) == 0.0


def test_each_view_control_changes_assembly_picture(page):
    seen = [_drawn(page)]
    for act in ("open=1", "apart=0.5", "cut=y", "at=0.2"):
        _put(page, *act.split("="))
        seen.append(_drawn(page))
    page.run("document.querySelector('.parts input').click()")
    seen.append(_drawn(page))
    page.run("document.querySelector('canvas').focus()")
    page.press("ArrowLeft")
    seen.append(_drawn(page))
    assert len(set(seen)) == len(seen)


def test_distance_between_equal_marked_points_is_zero(page):
    page.run("[...document.querySelectorAll('.views button')].find(b => b.textContent === 'top').click()")
    for name, value in (("cut", "none"), ("apart", 0), ("open", 0)):
        _put(page, name, value)
    page.run("document.querySelector('[data-in=measure]').click(); document.querySelector('canvas').focus()")
    page.press("m")
    page.run("[...document.querySelectorAll('.views button')].find(b => b.textContent === 'nearer').click()")
    page.press("m")
    message = _out(page, "measured")
    assert re.search(r"; 0\.000 mm apart: x -?0\.000, y -?0\.000, z -?0\.000$", message), message


def test_finding_and_board_mark_link_to_each_other(page):
    page.run("document.querySelector('[data-place] a').click()")
    shown = "document.querySelector('figure.board svg svg').getAttribute('viewBox')"
    assert float(page.run(shown).split()[2]) < 1000.0
    page.run("document.querySelector('[data-place]').open = false; document.getElementById('board-finding-1')"
             ".dispatchEvent(new Event('click'))")
    assert page.run("document.querySelector('[data-place]').open && document.activeElement.tagName") == "SUMMARY"


def test_board_layers_and_nets_can_be_hidden(page):
    hidden = "[...document.querySelectorAll('figure.board g.copper-1')].every(g => g.style.display === 'none')"
    assert page.run(hidden) is False
    page.run("document.querySelector('figure.board .bar input').click()")
    assert page.run(hidden) is True
    page.run("(() => { const s = document.querySelector('figure.board select'); s.value = 'C2';"
             " s.dispatchEvent(new Event('change')); })()")
    assert page.run("document.querySelector('figure.board g.net-C1').style.opacity") == "0.12"


def test_all_controls_are_reachable_by_keyboard(page):
    wanted = page.run("[...document.querySelectorAll('input, select, button, summary, canvas, a[href]')]"
                      ".filter(e => e.getClientRects().length).length")
    page.run("window.scrollTo(0, 0); document.activeElement.blur(); window.reached = new Set()")
    for _ in range(wanted + 20):
        page.press("Tab")
        page.run("window.reached.add(document.activeElement)")
    reached = page.run("[...document.querySelectorAll('input, select, button, summary, canvas, a[href]')]"
                       ".filter(e => e.getClientRects().length && !window.reached.has(e)).map(e => e.outerHTML)")
    assert reached == []


def test_page_fits_phone_width(page):
    page.size(375, 800)
    try:
        assert page.run("document.documentElement.scrollWidth") <= 375
    finally:
        page.size(1280, 1000)


def test_page_without_webgl_shows_message(package):
    with Browser("--disable-3d-apis") as browser:
        browser.open(package / "report.html")
        assert browser.run("document.querySelector('#solids').hidden") is True
        assert "WebGL 2" in browser.run("document.querySelector('[data-without=solids]').textContent")
        assert browser.run("document.querySelector('[data-without=solids]').hidden") is False
        assert browser.exceptions == []


def test_printed_page_has_at_most_eleven_sheets(page):
    document = base64.b64decode(page.call("Page.printToPDF", preferCSSPageSize=True)["data"])
    assert 1 <= len(re.findall(rb"/Type ?/Page\b", document)) <= 11


@pytest.mark.slow
@pytest.mark.skipif(not AXE.exists(), reason="axe-core is not installed")
def test_axe_reports_no_serious_violations(page):
    page.run(AXE.read_text(encoding="utf-8"))
    result = page.run("axe.run({resultTypes: ['violations']}).then(r => r.violations.map(v => [v.id, v.impact,"
                     " v.nodes.length, v.nodes[0].html.slice(0, 200)]))")
    assert [item for item in result if item[1] in ("serious", "critical")] == []


@pytest.mark.slow
def test_sensor_without_target_has_no_canvas(tmp_path):
    spec = sitscad.load_text("sitscad: 1\nname: bare\ncoil: {shape: circle, outer_diameter: 8, turns: 12, layers: 2, "
                             "trace_width: 100 um, trace_spacing: 100 um}\n")
    with Browser() as browser:
        browser.open(build(spec, tmp_path).directory / "report.html")
        assert browser.exceptions == [] and browser.run("document.querySelector('canvas')") is None


@pytest.mark.slow
@pytest.mark.more
def test_selected_cell_shows_forces_and_neighbour_change(tmp_path):
    """Two cells joined by a web: either is pushed, and the other one's coil says what it changes at most."""
    text = (TEMPLATE.parent / "skin_strip_6.yaml").read_text(encoding="utf-8").replace("count: 6", "count: 2")
    text = text.replace("coils: 1 ", "coils: 1\n  web: 2 mm\n")
    stages = "datasheet", "calibration", "report"
    package = build(sitscad.load_text(text, "cells.yaml"), tmp_path, only=stages).directory
    sheet = json.loads((package / "datasheet.json").read_text())
    rest = {coil["name"]: coil["states"]["rest"]["frequency_Hz"]
            for coil in json.loads((package / "estimate.json").read_text())["coils"]}
    page = (package / "report.html").read_text()
    coarsest = max(sheet["cells"]["each"], key=lambda one: one["resolution_N"]["normal"])["cell"]
    assert f"normal force told apart, one sigma, cell {coarsest} (worst)" in page or "cell 1, 2 (worst)" in page
    with Browser() as browser:
        browser.open(package / "report.html")
        full = browser.run("JSON.parse(document.getElementById('pushed-data').textContent).table.full_scale_N.normal")
        for cell, own, beside in ((0, "C1", "C2"), (1, "C2", "C1")):
            _put(browser, "cell", cell)
            _put(browser, "normal_N", full)
            change = float(_out(browser, f"change_Hz.{own}"))
            most = float(_out(browser, f"most_Hz.{beside}").removeprefix("at most \u00b1"))
            assert 0.0 < most < 0.02 * change
            # one frequency at rest: the estimate's
            assert float(_out(browser, f"frequency_Hz.{own}")) - change == approx(rest[own], abs=1.1)
            hidden = browser.run("document.querySelectorAll('#pushed tbody')[1].parentNode.hidden")
            assert hidden is (cell + 1 != sheet["cells"]["pushed_of"])
            assert ("No forces are read back of cell" in _out(browser, "unsolved")) is hidden
            assert hidden or float(_out(browser, "force_N.normal")) == approx(full, rel=5e-3)
        assert browser.exceptions == []


@pytest.mark.slow
@pytest.mark.more
def test_moments_on_free_target_are_read_back(tmp_path):
    """Nothing could put moments on, and shear was that of a level target beside a map of a free one."""
    spec = sitscad.load(TEMPLATE.parent / "fingertip_cell.yaml")
    package = build(spec, tmp_path, only=("datasheet", "calibration", "report")).directory
    design, known = Design(spec), map_of(package / "calibration" / "calibration.json")
    with Browser() as browser:
        browser.open(package / "report.html")
        assert "free to tilt" in _out(browser, "rotation")
        assert browser.run("document.querySelector('[data-in=rx_deg]')") is None
        for load in ((8.0, 0.0, 0.0, 2e-3, -3e-3), (4.0, 0.0, 0.0, 0.0, 3e-3), (8.0, 1.0, 0.0, 0.0, 0.0)):
            shown = [*load[:3], *(1e3 * moment for moment in load[3:])]
            names = ("normal_N", "shear_x_N", "shear_y_N", "moment_x_Nmm", "moment_y_Nmm")
            for name, value in zip(names, shown, strict=True):
                _put(browser, name, value)
            frequency = sitscad.respond(design, loads=[[0.0] * 5, load], rotation="free").frequency
            read = known(frequency[1:], frequency[0])[0]
            for axis, force, full in zip(known.axes, read, known.full_scale, strict=True):
                scale = 1e3 if axis.startswith("moment") else 1.0
                assert float(_out(browser, f"force_N.{axis}")) == approx(scale * force, abs=0.03 * scale * full)
            assert float(_out(browser, "load_N.moment_y")) == approx(shown[4], abs=0.03)
        _put(browser, "moment_x_Nmm", 4.5)
        assert "moments beyond" in _out(browser, "range")
        assert browser.exceptions == []
