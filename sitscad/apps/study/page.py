"""HTML page of a study's answer: a single file that loads nothing else.

Without scripts, it still has all tables and pictures. The module also makes the page and the numbers of a search in
progress. Each design in a chart has the id ``CHART-design-NUMBER`` for the script.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from html import escape
from importlib.resources import files
from itertools import combinations
from typing import Any

import numpy as np

from sitscad.apps.study.answer import Agreement, binding_limits, passing_designs, smallest_relaxation, unbeaten_designs
from sitscad.apps.study.answer_text import (
    AnswerTable,
    answer_json,
    base_value,
    design_table,
    front_csv,
    front_table,
    keys_text,
    low_yield_lines,
    next_step_lines,
    refusal_lines,
    refusal_table,
    sigma_table,
    trust_lines,
    verdict_lines,
    yield_table,
)
from sitscad.apps.study.evaluating import Workers, screen_designs
from sitscad.apps.study.evaluation import SCREEN, Evaluation
from sitscad.apps.study.running import StudyResults, first_set, violations
from sitscad.apps.study.space import Point as DesignPoint
from sitscad.apps.study.study import Study, StudyAnswer
from sitscad.apps.study.sweeping import chart_scale, measure_title, value_text
from sitscad.assembly.places.bodies import plates_of
from sitscad.basics.record import record
from sitscad.basics.units import count_text
from sitscad.files.drawing.pictures.layout_picture import layout_svg
from sitscad.files.drawing.sheet import COLOURS, Pen, Sheet
from sitscad.files.drawing.svg import svg
from sitscad.files.drawing.web_page import html_figure, html_page, html_section
from sitscad.files.report.moving import json_script
from sitscad.files.report.numbers import page_tables
from sitscad.kernels.geometry.path import Path, Point, bounding_box, box_around, circle
from sitscad.layout import sketch
from sitscad.spec.reading import SpecError

INK, SOFT, LINE = "#1c2126", "#5c6670", "#d9dee3"
REFUSED, PASSES, FRONT, KEPT = "#b9c1c9", "#7fa8d6", COLOURS[0], COLOURS[1]
LETTERS = 12.0
TICKS = 4  # Largest number of steps of an axis
"""Largest number of intervals between ticks on an axis."""


@record
class ChartAxis:
    """An axis of a chart, with the range from `low` to `high`.

    `ticks` are pairs of value and label.
    """

    title: str
    low: float
    high: float
    ticks: tuple[tuple[float, str], ...]

    def at(self, value: float) -> float:
        """Return the position of a value on the axis: 0 at or below the low end, 1 at or above the high end."""
        return min(1.0, max(0.0, (value - self.low) / (self.high - self.low)))

    def has(self, value: float | None) -> bool:
        """Whether a value lies within the axis's range. False for None."""
        return value is not None and self.low <= value <= self.high


def value_axis(title: str, values: Iterable[float]) -> ChartAxis:
    """Return an axis that contains all finite values with a margin at both ends. Its ticks are at round numbers."""
    finite = [value for value in values if math.isfinite(value)] or [0.0]
    low, high = min(finite), max(finite)
    room = 0.06 * (high - low) or 0.05 * abs(high) or 1.0
    low, high = low - room, high + room
    power = 10.0 ** math.floor(math.log10((high - low) / TICKS))
    step = next(k * power for k in (1, 2, 5, 10) if k * power * TICKS >= high - low)
    first = math.ceil(low / step - 1e-9)
    ticks = [k * step for k in range(first, math.floor(high / step + 1e-9) + 1)]
    return ChartAxis(title, low, high, tuple((value, f"{value:.6g}") for value in ticks))


@record
class DesignMark:
    """A design in a chart.

    ``number`` is its place in `StudyPage.points`, and ``kind`` is a key of `MARKS`. ``kept`` is its number among the
    kept designs from 1, or 0.
    """

    number: int
    kind: str
    kept: int = 0


MARKS = {
    "refused": (2.2, REFUSED), "passes": (2.6, PASSES), "front": (4.0, FRONT), "nearest": (7.0, KEPT),
    "kept": (8.0, KEPT),
}
"""Radius (px) and colour of each kind of design, in the order of drawing.

If several kinds apply to a design, the last of these is used.
"""


def scatter_chart(
    name: str, axes: tuple[ChartAxis, ChartAxis], marks: Iterable[DesignMark],
    place: Callable[[DesignMark], tuple[float, float] | None], base: tuple[float, float] | None,
) -> str:
    """Return a chart of designs by two measures, or by a key and a measure. Designs outside the axes are left out.

    `place` returns the two values of a design, and `base` are the values of the base.
    """
    size, (start, low, right, top) = (620.0, 430.0), (66.0, 52.0, 606.0, 400.0)
    sheet, (across, up) = Sheet(f"{axes[1].title} against {axes[0].title}", size, unit="", decimals=1), axes
    for value, label in across.ticks:
        x = start + across.at(value) * (right - start)
        sheet.line(x, low, x, top, Pen(1.0, LINE))
        sheet.text(x, low - 16.0, label, 11.0, "middle", colour=SOFT)
    for value, label in up.ticks:
        y = low + up.at(value) * (top - low)
        sheet.line(start, y, right, y, Pen(1.0, LINE))
        sheet.text(start - 6.0, y - 4.0, label, 11.0, "end", colour=SOFT)
    sheet.text((start + right) / 2, 12.0, across.title, LETTERS, "middle", colour=INK)
    sheet.text(start - 46.0, top + 14.0, up.title, LETTERS, colour=INK)

    def point(at: tuple[float, float]) -> Point:
        return Point(start + across.at(at[0]) * (right - start), low + up.at(at[1]) * (top - low))

    for mark in sorted(marks, key=lambda mark: list(MARKS).index(mark.kind)):  # lesser kinds lie below
        at = place(mark)
        if at is None or not (across.has(at[0]) and up.has(at[1])):
            continue
        radius, colour = MARKS[mark.kind]
        with sheet.group(f"{name}-design-{mark.number}", kind=f"design {mark.kind}"):
            sheet.draw(circle(point(at), radius), None, colour)
            if mark.kept:
                sheet.text(point(at).x, point(at).y - 4.0, str(mark.kept), 11.0, "middle", colour="#ffffff", bold=True)
    if base is not None and across.has(base[0]) and up.has(base[1]):
        at = point(base)
        sheet.draw(circle(at, 6.0), Pen(2.0, INK))
        sheet.text(at.x + 9.0, at.y - 4.0, "base", 11.0, colour=INK, halo=3.0)
    return svg(sheet)


def board_sketch(
    body: tuple[float, float, float, float], outline: Path, windings: Sequence[Path], width: float,
    targets: Sequence[Path],
) -> str:
    """Return a drawing of a board without leads, from the top. Lengths are in metres.

    `body` is the box of the board's body. The drawing shows the outline, cut off behind the body, the `windings` of one
    layer with a track `width`, and the targets.
    """
    x0, y0, x1, y1 = box_around([body, *(bounding_box([path]) for path in targets)])
    scale = 400.0 / (x1 - x0)
    wide, high = 420.0, (y1 - y0) * scale + 20.0

    def placed(path: Path) -> Path:
        return path.mapped(lambda p: Point(10.0 + (p.x - x0) * scale, 10.0 + (p.y - y0) * scale))

    sheet = Sheet("The coils from the top", (wide, high), unit="", decimals=1)
    with sheet.group("sketch", window=(0.0, 0.0, wide, high)):
        sheet.draw(placed(outline), Pen(1.5, "#222222"), "#f1e8d2")
        for path in windings:
            sheet.draw(placed(path), Pen(width * scale, "#d55e00"))
        for path in targets:
            sheet.draw(placed(path), Pen(1.5, "#0072b2", (6.0, 4.0)))
    return svg(sheet)


MOST_OTHERS = 2000
"""Largest number of designs on the page in addition to the Pareto front."""

FEW = 5
"""Number of designs on the front below which the axes of the chart also cover other designs."""

MOST_SKETCHES = 1_000_000
"""Largest total number of characters of the small board drawings on the page. Further designs have no drawing."""

MOST_PAGE = 3_000_000
"""Largest number of characters of the page.

If the page is longer, `MOST_OTHERS` and `MOST_SKETCHES` are halved until it fits.
"""

Values = Mapping[str, float]


class StudyPage:
    """The page of an answer. `share` is the fraction of the limits `MOST_OTHERS` and `MOST_SKETCHES` that it uses."""

    def __init__(self, answer: StudyAnswer, share: float = 1.0) -> None:
        self.answer, self.request, self.share = answer, answer.request, share
        self.names = [name for name in answer.request.measures if not name.startswith("sigma.")]
        self.numbers = {design.point: k for k, design in enumerate(answer.kept, 1)}
        self.nearest = None if answer.kept or answer.relaxation is None else answer.relaxation.point
        self.points = self._points()

    def _points(self) -> list[DesignPoint]:
        """Return all designs of the front, and an even selection of the other evaluated designs up to a limit."""
        nearest = [] if self.nearest is None else [self.nearest]
        front = [*dict.fromkeys((*self.numbers, *nearest, *self.answer.front))]
        beaten = [point for point in self.answer.results.screened if point not in set(front)]
        count = min(len(beaten), int(self.share * MOST_OTHERS))
        return front + [beaten[k * len(beaten) // count] for k in range(count)]

    @cached_property
    def scales(self) -> dict[str, tuple[float, str]]:
        """Factor and unit of each measure in charts, chosen by the median value of the front, or of all designs."""
        scales = {}
        for name in self.names:
            values = [evaluation.values[name][0] for point in (self.answer.front or self.points)
                      if name in (evaluation := self.answer.results.evaluation(point)).values]
            scales[name] = chart_scale(name, np.array(sorted(values)[len(values) // 2 :][:1] or [0.0]))
        return scales

    def scaled(self, evaluation: Evaluation) -> dict[str, float]:
        """Return the values of an evaluation in the units of the charts."""
        values = evaluation.values
        return {name: values[name][0] * self.scales[name][0] for name in self.names if name in values}

    @cached_property
    def figures(self) -> list[dict[str, float]]:
        """Values of the measures, in the units of the charts, for each design of `points`."""
        return [self.scaled(self.answer.results.evaluation(point)) for point in self.points]

    @cached_property
    def marks(self) -> list[DesignMark]:
        """Marks in charts, one for each design of `points`."""
        return [DesignMark(k, self._kind(point), self.numbers.get(point, 0)) for k, point in enumerate(self.points)]

    def _kind(self, point: DesignPoint) -> str:
        if point in self.numbers:
            return "kept"
        if point == self.nearest:
            return "nearest"
        if point in self.answer.front:
            return "front"
        return "refused" if violations(self.request, self.answer.results.evaluation(point)) else "passes"

    @cached_property
    def axes(self) -> dict[str, ChartAxis]:
        """Axis of each measure. It covers the front, or if the front is small, the better 80 % of all designs."""
        axes = {}
        shown_marks = [k for k, mark in enumerate(self.marks) if mark.kind in ("kept", "front")]
        is_few = len(shown_marks) < FEW
        better = {goal.measure: goal.is_less_better for goal in self.request.goals}
        for name in self.names:
            values = sorted(values[name] for k, values in enumerate(self.figures)
                            if name in values and (k in shown_marks or is_few))
            if is_few:
                most = 4 * len(values) // 5
                values = values[: most + 1] if better.get(name, True) else values[len(values) - most :]
                values += [self.figures[k][name] for k in shown_marks if name in self.figures[k]]
            low, high = (min(values), max(values)) if values else (0.0, 1.0)
            base = self.scaled(self.answer.base).get(name)
            near = base is not None and low - 2.0 * (high - low) <= base <= high + 2.0 * (high - low)
            axes[name] = value_axis(self.measure_title_in_charts(name), [low, high, *([base] if near and base else [])])
        return axes

    def measure_title_in_charts(self, name: str) -> str:
        """Return the name of a measure with its unit in charts."""
        return measure_title(name, self.scales[name][1])

    def html(self) -> str:
        """Return the HTML of the whole page."""
        goals = [goal.written for goal in self.request.goals]
        verdict = ("good", "It can be met") if self.answer.is_met else ("bad", "No design keeps everything")
        if self.answer.lacks_yield:
            verdict = "good", "It can be met but for the yield, which is not known"
        script = (files("sitscad.files.report") / "assets" / "study.js").read_text(encoding="utf-8")
        parts = [
            f"<style>{STYLE}</style>",
            self.head_part(goals, verdict, verdict_lines(self.answer)),
            html_section("What stands in the way", self.obstacles_part()) if not self.answer.is_met else "",
            html_section("Designs", self.designs_part()),
            html_section("Yield", self.yields_part()),
            html_section("The front" if self.answer.front else "What was found", self.front_part()),
            html_section("Why designs were refused", self.obstacles_part()) if self.answer.is_met else "",
            html_section("How far the figures can be trusted", "".join(_paragraphs(trust_lines(self.answer)))),
            html_section("How it goes on", self.next_steps_part()),
            json_script("study-data", self.script_data()),
            f"<script>{script}</script>",
        ]
        file_name = self.request.base.path.replace("\\", "/").rpartition("/")[2]
        return html_page(f"{self.answer.name}: study", parts, f" \u00b7 base {escape(file_name)}, SHA-256 "
                         f"{self.request.base.spec.source.sha256}")

    def progress_html(self, of: int) -> str:
        """Return the page of a search in progress with `of` designs: screen-level results without kept designs."""
        answer, good = self.answer, sum(mark.kind != "refused" for mark in self.marks)
        verdict = f"{len(answer.results.screened)} of {of} designs looked at by the screen, {good} keep everything"
        head = self.head_part([goal.written for goal in self.request.goals], ("good" if good else "bad", verdict), ())
        return html_page(f"{answer.name}: sweep", [
            head.replace("<header>", f"<header><style>{STYLE}</style>", 1),
            html_section("The front so far", self.front_part(), "front"),
            html_section("Why designs were refused", self.obstacles_part(), "refused"),
        ])

    def head_part(self, goals: Sequence[str], verdict: tuple[str, str], lines: Iterable[str]) -> str:
        """Return the head of the page: name, verdict, and the best value of each goal beside the base's value.

        Paragraphs with the `lines` follow.
        """
        answer, (kind, verdict_text) = self.answer, verdict
        asks = [f"{each.measure} {each.written}" for each in self.request.require]
        tiles = []
        for goal in self.request.goals:
            every = (answer.results.evaluation(point).values for point in answer.front)
            values = [values[goal.measure][0] for values in every if goal.measure in values]
            if values:
                base = answer.base.values.get(goal.measure)
                beside = f"; the base has {value_text(goal.measure, base[0])}" if base else ""
                best = value_text(goal.measure, min(values, key=goal.cost))
                words_of = escape(f"best {goal.measure}{beside}")
                tiles.append(f"<div class='tile'><b>{escape(best)}</b><span>{words_of}</span></div>")
        return (
            f"<header><h1>{escape(answer.name)}</h1><p class='soft'>{escape(', '.join(goals))}"
            f"{escape('; require ' + ', '.join(asks) if asks else '')}</p><p class='verdict {kind}'>{verdict_text}</p>"
            f"{''.join(_paragraphs(lines))}</header>"
            + (f"<div class='tiles'>{''.join(tiles)}</div>" if tiles else "")
        )

    def obstacles_part(self) -> str:
        """Return the part with rules and requirements that refuse designs, and the smallest sufficient relaxation."""
        table = _table(refusal_table(self.answer)) or "<p>Nothing refused a design.</p>"
        return "".join(_paragraphs(refusal_lines(self.answer))) + table

    def designs_part(self) -> str:
        """Return the part with the base and the kept designs: a table, then a drawing of each kept design."""
        articles = ""
        for number, layout in enumerate(self.answer.layouts, 1):
            x0, y0, x1, y1 = layout.body
            board = layout_svg(layout, window=(x0, y0, x1 + 1e-3, y1), name=f"design-{number}")
            caption = f"Design {number} from the top, its tail cut off: designs/{number}.yaml"
            articles += f"<article id='kept-{number}'>{html_figure(board, caption)}</article>"
        return _table(design_table(self.answer)) + articles

    def yields_part(self) -> str:
        """Return the part with yields of kept designs, decisive manufacturing errors, and standard deviations."""
        is_unknown = self.answer.kept and all(each.units is None for each in self.answer.kept)
        designs = design_table(self.answer)
        tables = "".join(_paragraphs(low_yield_lines(self.answer))) + _table(yield_table(designs))
        return "<p>Not worked out.</p>" if is_unknown else tables + _table(sigma_table(designs))

    def front_part(self) -> str:
        """Return the part with charts of designs by each pair of goals, the chosen design, and a table of the front."""
        goals = [goal.measure for goal in self.request.goals]
        pairs = [*combinations(goals, 2)] if len(goals) > 1 else [(self.request.space.variables[0].key, goals[0])]
        fields, base = "", self.scaled(self.answer.base)
        for k, (across, up) in enumerate(pairs):
            axes = self._key_axis(across) if across not in self.axes else self.axes[across], self.axes[up]

            def place(mark: DesignMark, across: str = across, up: str = up) -> tuple[float, float] | None:
                keys = zip((v.key for v in self.request.space.variables), self.points[mark.number], strict=True)
                figures = self.figures[mark.number] | {key: float(k) for key, k in keys}
                return (figures[across], figures[up]) if across in figures and up in figures else None

            figures = (base[across], base[up]) if across in base and up in base else None
            places = [place(mark) for mark in self.marks]
            beyond = sum(1 for at in places if at is None or not (axes[0].has(at[0]) and axes[1].has(at[1])))
            fields += html_figure(scatter_chart(f"field-{k}", axes, self.marks, place, figures), CAPTION + (
                f" {count_text(beyond, 'design')} beyond the picture, or without these figures." if beyond else ""))
        summary = f"The front as a table: {count_text(len(self.answer.front), 'design')}"
        table = _table(front_table(self.answer))
        whole = f"<details class='front'><summary>{summary}</summary>{table}</details>" if table else ""
        return f"<div class='fields'>{fields}</div>{CHOSEN if self.answer.results.full else ''}{whole}"

    def _key_axis(self, key: str) -> ChartAxis:
        """Return the axis of a varied key by the numbers of its values.

        The first, middle and last value have labels.
        """
        values = next(v.values for v in self.request.space.variables if v.key == key)
        last = len(values) - 1
        ticks = tuple((float(k), str(values[k])) for k in sorted({0, last // 2, last}))
        return ChartAxis(key, -0.25, last + 0.25, ticks)

    def next_steps_part(self) -> str:
        """Return the part with the next commands and the places of the files."""
        lines = [line.replace("./designs", "designs") for line in next_step_lines(self.answer, ".")]
        return f"{''.join(_paragraphs(lines))}<p class='soft'>{FILES}</p>"

    def script_data(self) -> dict[str, Any]:
        """Return the data for the page's script: keys, measures, designs, and small drawings of the front."""
        before, space = self.request.base.changed_values(()), self.request.space
        base = self.scaled(self.answer.base)
        return {
            "keys": [{"name": v.key, "values": list(map(str, v.values)), "base": base_value(before, v.key)}
                     for v in space.variables],
            "measures": [{"name": name, "unit": self.scales[name][1], "base": _rounded(base.get(name))}
                         for name in self.names],
            "points": [[list(point), [_rounded(values.get(name)) for name in self.names], mark.kind, mark.kept,
                        sorted(violations(self.request, self.answer.results.evaluation(point)))]
                       for point, values, mark in zip(self.points, self.figures, self.marks, strict=True)],
            "sketches": dict(self._sketches()),
        }

    def _sketches(self) -> Iterator[tuple[str, str]]:
        """Yield (number of the design, small drawing) for designs of the front, up to the limit of characters."""
        room = int(self.share * MOST_SKETCHES)
        for mark in self.marks:
            if mark.kind not in BEST:
                return
            try:
                layout = sketch(self.request.base.changed_spec(self.request.space.changes(self.points[mark.number])))
            except SpecError:
                continue
            plates = [target.outline() for target in plates_of(layout.spec).targets]
            windings = [coil.windings[0].path.shifted(*coil.centre) for coil in layout.coils]
            board = board_sketch(layout.body, layout.outline, windings, layout.spec.coil.trace_width, plates)
            room -= len(board)
            if room < 0:
                return
            yield str(mark.number), board


FILES = ("front.csv has the front, study.json the whole answer, archive.jsonl every design that was looked at: the "
         "same command goes on from there.")

CAPTION = ("Grey: refused; light blue: keeps everything, by the screen; blue: not beaten by another; orange: "
           "kept, or the nearest where none is; ring: the base.")

BEST = ("kept", "nearest", "front")
"""Kinds of designs for which the page has a small board drawing."""

CHOSEN = """
<div id="chosen" hidden><div class="bar"><label>design <select></select></label></div>
<div class="pair"><div class="paper"></div><div class="scroll"><table><thead><tr><th></th><th class="number">base</th>
<th class="number">here</th></tr></thead><tbody></tbody></table></div></div></div>
<p data-without="study">With scripts, a design of the front can be pointed at here, and shows its drawing and its
difference to the base; the table has all of them.</p>
"""

STYLE = """
.fields { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 27rem), 1fr)); gap: 1rem; }
.bar label, .bar select { min-width: 0; max-width: 100%; }
.fields > figure:only-child { max-width: 44rem; }
figure > .paper { overflow-x: auto; }
figure > .paper > svg { min-width: 24rem; }
.pair { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 20rem), 1fr)); gap: 1rem;
  align-items: start; }
.pair .paper { padding: .6rem; }
.design { cursor: pointer; transition: opacity .1s; }
.design.on { filter: drop-shadow(0 0 2px #000); }
.tip { position: fixed; z-index: 2; pointer-events: none; max-width: 22rem; padding: .4rem .6rem; font-size: .8rem;
  background: var(--card); color: var(--ink); border: 1px solid var(--soft); border-radius: .3rem;
  white-space: pre-line; }
details.front > summary { cursor: pointer; margin: 1rem 0; }
article .paper { max-width: 44rem; }
"""


def _table(table: AnswerTable) -> str:
    return page_tables([table.text_table()])


def _paragraphs(lines: Iterable[str]) -> Iterator[str]:
    return (f"<p>{escape(line)}</p>" for line in lines)


def _rounded(value: float | None) -> float | None:
    """Return a value rounded to five significant digits, for drawing."""
    return None if value is None else float(f"{value:.5g}")


def study_page(answer: StudyAnswer) -> str:
    """Return the page of an answer as HTML text. Text from the study or its base is escaped."""
    share = 1.0
    while len(text := StudyPage(answer, share).html()) > MOST_PAGE and share > 0.01:
        share *= 0.5  # the page has many keys, many measures or large boards
    return text


def progress_page(study: Study, results: StudyResults, of: int) -> str:
    """Return the page of a search in progress, with the screen-level `results` of some of its `of` designs."""
    request, results = study.request, replace(results, full={})
    nothing = Agreement(0, 0, 0, {})
    base = screen_designs([request.base.spec], request.measures)[0]
    front = tuple(unbeaten_designs(request, results.screened))
    answer = StudyAnswer(study.name, request, base, results, tuple(binding_limits(request, results)),
                         None if front else smallest_relaxation(request, results), nothing, (), front, (), ())
    return StudyPage(answer).progress_html(of)


def answer_files(answer: StudyAnswer) -> dict[str, bytes]:
    """Return the files of a study's folder except its archive, and the files that the kept designs read."""
    request = answer.request
    specs = (request.base.changed_spec(request.space.changes(design.point)) for design in answer.kept)
    files = {f"designs/{name}": content for spec in specs for name, content in spec.source.files.items()}
    files |= {f"designs/{k}.yaml": text.encode("utf-8") for k, text in enumerate(answer.spec_texts, 1)}
    whole = {"front.csv": front_csv(answer), "study.json": answer_json(answer), "study.html": study_page(answer)}
    return files | {name: text.encode("utf-8") for name, text in whole.items()}


PAUSE = 1.0
"""Time (s) between two reports of a search in progress."""


def search_progress(
    study: Study, evaluated: dict[str, Evaluation], serves: bool
) -> Iterator[tuple[dict[str, Any], bytes]]:
    """Evaluate the first set of designs of a search at the screen level, and report progress.

    After each pause, yield the counts and the best values so far (`progress_numbers`), and the HTML page (empty unless
    `serves`). Valid evaluations of earlier saves in `evaluated` are reused.
    """
    request = study.request
    points = first_set(request.space, request.evaluations, request.seed, [request.base_point])
    results = StudyResults(request, SCREEN)
    last = 0.0
    with Workers(request.base, 1) as workers:
        for k, point in enumerate(points, 1):
            changes = request.space.changes(point)
            key = f"{request.base.key(changes, SCREEN)} {request.measures}"
            if key not in evaluated:
                evaluated[key] = next(workers.evaluations([changes], request.measures, SCREEN))
            results.screened[point] = evaluated[key]
            if time.perf_counter() - last > PAUSE or k == len(points):
                page = progress_page(study, results, len(points)).encode() if serves else b""
                yield progress_numbers(results, len(points)), page
                last = time.perf_counter()


def progress_numbers(results: StudyResults, of: int) -> dict[str, Any]:
    """Return the numbers of evaluated designs and of designs that pass the screen level, and each goal's best value."""
    request, good = results.request, passing_designs(results.request, results.screened)
    texts = {"designs": f"{len(results.screened)} of {of}", "keep everything": str(len(good))}
    for goal in request.goals:
        points = (point for point in good if goal.measure in results.screened[point].values)
        values = {point: results.screened[point].values[goal.measure][0] for point in points}
        if values:
            best = min(values, key=lambda point: goal.cost(values[point]))
            keys = keys_text(request.space.varied_values(best))
        texts[goal.written] = f"{value_text(goal.measure, values[best])} with {keys}"
    return texts
