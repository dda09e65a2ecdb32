"""A study's page: whole without scripts, small, the same every time; pointed at, brushed and read in a browser."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import pytest
from browser import Browser

import sitscad
from sitscad.layout import sketch
from sitscad.scene import bodies
from sitscad.spec import templates
from sitscad.study.charts import board_sketch
from sitscad.study.page import MOST_OTHERS, StudyPage, study_page

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


def test_the_answer_stands_in_its_order_and_loads_nothing(answer, html):
    titles = re.findall("<h2>(.*?)</h2>", html)
    assert titles[:4] == ["Designs", "Yield", "The front", "All keys and goals"] and titles[-1] == "How it goes on"
    assert html == study_page(answer) and len(html) < 3_000_000
    assert "&lt;b&gt;study" in html and "<b>study" not in html
    assert not re.search(r"(src|href)=['\"](?!#)|url\(|@import", html)


def test_tables_hold_the_front_and_every_kept_design(answer, html):
    front = html[html.index("The front as a table") :]
    assert front[: front.index("</details>")].count("<tr>") == len(answer.front) + 1
    assert all(f"id='kept-{k}'" in html for k in range(1, len(answer.kept) + 1))
    assert len(answer.slices) == 2 and html.count("Along coil.") == 2


def test_a_picture_of_few_shows_what_is_around_them(answer, monkeypatch):
    """Where one design alone is not beaten, axes hold the better four fifths of the others, too."""
    def within(few):
        monkeypatch.setattr("sitscad.study.page.FEW", few)
        page = StudyPage(answer)
        page.marks[1:] = [replace(mark, kind="refused") for mark in page.marks[1:]]
        axes = page.axes
        return sum(all(axes[name].low <= values[name] <= axes[name].high for name in axes) for values in page.figures)

    assert 2 * within(0) < within(2) <= len(answer.found.screened)


def test_of_others_so_many_are_shown_and_no_more(answer):
    point = answer.front[0]
    more = {(*point[:-1], 10_000 + k): answer.found.of(point) for k in range(MOST_OTHERS + 500)}
    answer.found.screened.update(more)
    try:
        shown = StudyPage(answer).points
    finally:
        for each in more:
            del answer.found.screened[each]
    assert len(shown) == len(set(shown)) and set(answer.front) <= set(shown)
    assert len(shown) == MOST_OTHERS + len({*answer.front, *(one.point for one in answer.kept)})


@pytest.mark.parametrize("name, targets, arcs", [("round_button_12mm", 1, 200.0), ("skin_strip_6", 6, None)])
def test_a_small_drawing_has_the_outline_of_the_body_and_all_targets(name, targets, arcs):
    """A round body of 12 mm is drawn 400 px wide."""
    layout = sketch(sitscad.load_text(templates.read(name)))
    plates = [one.outline() for one in bodies.targets(layout.spec)]
    drawn = board_sketch(layout.body, layout.outline, [], 1e-4, plates)
    assert drawn.count("#0072b2") == targets and (arcs is None or f"A{arcs:g} {arcs:g} " in drawn)


@pytest.mark.clients("chromium")
def test_a_browser_points_at_designs_chooses_one_and_brushes_an_axis(html, tmp_path):
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
        told = browser.run("document.querySelector('#chosen tbody').innerText")
        assert data["keys"][0]["values"][data["points"][1][0][0]] in told and data["keys"][0]["base"] in told
        assert browser.run("document.querySelectorAll('#chosen svg path').length") > 1
        browser.run("document.querySelector('#lines .grip').focus()")
        for _ in range(8):
            browser.press("ArrowUp")  # the lower end goes up: what is below fades
        low = {k for k, point in enumerate(data["points"]) if point[0][0] == 0}
        faded = set(browser.run("[...document.querySelectorAll('#lines .off')].map(e => +e.id.split('-').pop())"))
        assert low and low <= faded and len(faded) < len(data["points"])
        mark = browser.run("(() => { const e = document.querySelector('.fields .design.kept'); e.scrollIntoView();"
                           " const b = e.getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; })()")
        browser.call("Input.dispatchMouseEvent", type="mouseMoved", x=mark[0], y=mark[1])
        assert "design 1" in browser.run("document.querySelector('.tip').textContent")
