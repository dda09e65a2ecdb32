"""A study's page: whole without scripts, small, the same every time; pointed at and read in a browser."""

from __future__ import annotations

import json
import random
import re
from dataclasses import replace
from html import escape

import pytest
from browser import Browser

import sitscad
from sitscad.apps.study.answer import Binding, KeptDesign, changed_keys
from sitscad.apps.study.answer_text import (
    WITH,
    answer_json,
    answer_text,
    design_table,
    refusal_table,
    sigma_table,
    yield_table,
)
from sitscad.apps.study.evaluation import Breach, Evaluation
from sitscad.apps.study.page import MOST_OTHERS, MOST_PAGE, StudyPage, board_sketch, study_page
from sitscad.apps.study.running import StudyResults, sobol_set
from sitscad.assembly.places.bodies import plates_of
from sitscad.layout import sketch
from sitscad.spec import templates

STUDY = """\
sitscad_study: 1
base: coil.yaml
vary: {coil.turns: [11, 12, 13], coil.trace_width: {from: 100 um, to: 130 um, step: 10 um}}
same: {coil.trace_spacing: coil.trace_width}
goals: [maximize: rp, minimize: inductance]
accept: all
keep: 2
"""


@pytest.fixture(scope="module")
def answer(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    (folder / "coil.yaml").write_text(templates.read("single_coil"))
    (folder / "<b>study.yaml").write_text(STUDY)
    return sitscad.Study.load(folder / "<b>study.yaml").run(draws=2)


@pytest.fixture(scope="module")
def html(answer):
    return study_page(answer)


@pytest.mark.more
@pytest.mark.slow
def test_study_page_has_ordered_sections_and_no_external_resources(answer, html):
    titles = re.findall("<h2>(.*?)</h2>", html)
    assert titles[:4] == ["Designs", "Yield", "The front", "Why designs were refused"]
    assert titles[-1] == "How it goes on"
    assert html == study_page(answer) and len(html) < MOST_PAGE
    assert "&lt;b&gt;study" in html and "<b>study" not in html
    assert not re.search(r"(src|href)=['\"](?!#)|url\(|@import", html)


@pytest.mark.slow
def test_study_page_tables_contain_front_and_kept_designs(answer, html):
    front = html[html.index("The front as a table") :]
    assert front[: front.index("</details>")].count("<tr>") == len(answer.front) + 1
    assert all(f"id='kept-{k}'" in html for k in range(1, len(answer.kept) + 1))


def test_answer_text_page_and_json_have_equal_rows(answer):
    """Each was put together by itself, and one had rows that the others did not."""
    breach = Binding("SIT203", 0.5, 0.25, Breach(500.0, 600.0, "ohm"), answer.front[0])
    answer = replace(answer, bindings=(breach,))
    text, page, values = answer_text(answer), study_page(answer), json.loads(answer_json(answer))
    designs = design_table(answer)
    for table in (refusal_table(answer), designs, yield_table(designs), sigma_table(designs)):
        lines = table.text_table(without=(WITH,))
        assert lines.rows
        for cell in (cell for row in lines.rows for cell in row):
            assert cell in text and escape(cell) in page
    assert values["kept"] == json.loads(json.dumps(designs.rows[1:]))
    assert values["bindings"] == json.loads(json.dumps(refusal_table(answer).rows))


def test_chart_of_small_front_includes_neighbouring_designs(answer, monkeypatch):
    """Where one design alone is not beaten, axes hold the better four fifths of the others, too."""
    def within(few):
        monkeypatch.setattr("sitscad.apps.study.page.FEW", few)
        page = StudyPage(answer)
        page.marks[1:] = [replace(mark, kind="refused") for mark in page.marks[1:]]
        axes = page.axes
        return sum(all(axes[name].low <= values[name] <= axes[name].high for name in axes) for values in page.figures)

    assert 2 * within(0) < within(2) <= len(answer.results.screened)


def test_number_of_other_designs_in_chart_is_limited(answer):
    point = answer.front[0]
    more = {(*point[:-1], 10_000 + k): answer.results.evaluation(point) for k in range(MOST_OTHERS + 500)}
    answer.results.screened.update(more)
    try:
        shown = StudyPage(answer).points
    finally:
        for each in more:
            del answer.results.screened[each]
    assert len(shown) == len(set(shown)) and set(answer.front) <= set(shown)
    assert len(shown) == MOST_OTHERS + len({*answer.front, *(item.point for item in answer.kept)})


WIDE = {
    "base": "grasper_4layer.yaml", "accept": "all", "keep": 8,
    "vary": {
        "coil.outer_diameter": {"from": 3.9, "to": 4.0}, "coil.turns": {"from": 6, "to": 7, "step": 0.25},
        "coil.trace_width": {"from": "75 um", "to": "100 um"}, "coil.trace_spacing": {"from": "75 um", "to": "100 um"},
        "array.pitch": {"from": 4.4, "to": 5}, "elastomer.thickness": {"from": 0.4, "to": 0.8},
        "target.thickness": {"from": 0.1, "to": 0.4}, "target.rotation": {"from": "0 deg", "to": "5 deg"},
        "target.offset": [[0, 0], [0.1, 0]], "fpc.tail.length": {"from": 25, "to": 40}, "name": ["a", "b"],
        "fpc.rules": ["generic-fine", "generic-flex"], "readout.capacitance": ["100 pF", "120 pF", "150 pF"],
        "requirements.normal_force": {"from": "4 N", "to": "8 N"}, "revision": ["A", "B", "C"],
        "requirements.shear_force": {"from": "0.5 N", "to": "1 N"}},
    "goals": [{"minimize": "resolution.normal"}, {"minimize": "resolution.shear_x"}, {"minimize": "fit.closed_pair"}],
    "require": {"rp": ">= 1 ohm", "q": ">= 0.1", "inductance": ">= 1 nH", "frequency": "<= 1000 MHz",
                "amplitude": ">= 1 mV", "fit.spare": ">= -1 mm", "board.area": "<= 9999 mm2", "rate": ">= 1 Hz",
                "supply_current": "<= 99 mA"}}


@pytest.mark.more
@pytest.mark.slow
def test_page_of_large_study_is_limited_and_contains_whole_front(answer, tmp_path):
    """Of sixteen keys, twelve measures and a front of 256 it had more than three megabytes."""
    (tmp_path / "grasper_4layer.yaml").write_text(templates.read("grasper_4layer"))
    asked = sitscad.Study.from_mapping(WIDE, tmp_path).request
    points, chance = sobol_set(asked.space, 2500, 1), random.Random(1)
    looked = {point: Evaluation({name: (1.0 + chance.random(), 0.0) for name in asked.measures}, {})
              for point in points}
    looked[asked.base_point] = looked[points[0]]
    found = StudyResults(asked, "sobol", looked, {point: looked[point] for point in points[:256]})
    stored = (KeptDesign(asked.base_point, changed_keys(asked, asked.base_point), looked[points[0]], None),) * 8
    said = replace(answer, request=asked, base=looked[points[0]], results=found, bindings=(), front=tuple(points[:256]),
                   kept=stored, spec_texts=())
    html = study_page(said)
    assert 2_000_000 < len(html) <= MOST_PAGE
    front = html[html.index("The front as a table") :]
    assert front[: front.index("</details>")].count("<tr>") == 257


@pytest.mark.parametrize("name, targets, arcs", [("round_button_12mm", 1, 200.0), ("skin_strip_6", 6, None)])
def test_board_thumbnail_shows_body_outline_and_all_targets(name, targets, arcs):
    """A round body of 12 mm is drawn 400 px wide."""
    layout = sketch(sitscad.load_text(templates.read(name)))
    plates = [item.outline() for item in plates_of(layout.spec).targets]
    drawn = board_sketch(layout.body, layout.outline, [], 1e-4, plates)
    assert drawn.count("#0072b2") == targets and (arcs is None or f"A{arcs:g} {arcs:g} " in drawn)


@pytest.mark.clients("chromium")
def test_study_page_in_browser_shows_tooltip_and_selects_design(html, tmp_path):
    path = tmp_path / "study.html"
    path.write_text(html, encoding="utf-8")
    with Browser() as browser:
        browser.size(390, 800)
        browser.open(path)
        assert browser.exceptions == [] and browser.requests == [path.as_uri()]
        assert browser.run("document.documentElement.scrollWidth") <= 390
        data = json.loads(browser.run("document.getElementById('study-data').textContent"))
        browser.run("(() => { const list = document.querySelector('#chosen select'); list.value = '1';"
                    " list.dispatchEvent(new Event('change')); })()")
        text = browser.run("document.querySelector('#chosen tbody').innerText")
        assert data["keys"][0]["values"][data["points"][1][0][0]] in text and data["keys"][0]["base"] in text
        assert browser.run("document.querySelectorAll('#chosen svg path').length") > 1
        mark = browser.run("(() => { const e = document.querySelector('.fields .design.kept'); e.scrollIntoView();"
                           " const b = e.getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; })()")
        browser.call("Input.dispatchMouseEvent", type="mouseMoved", x=mark[0], y=mark[1])
        assert "design 1" in browser.run("document.querySelector('.tip').textContent")
