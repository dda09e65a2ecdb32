"""The report: self-contained, escaped, and with everything in it that a person needs to decide."""

from __future__ import annotations

import dataclasses
import html
import re
from html.parser import HTMLParser
from pathlib import Path

import pytest
from tolerance import approx

import sitscad
from sitscad.basics.finding import Finding, NotChecked, Place, Severity
from sitscad.basics.units import quantity, show
from sitscad.checks.findings import CheckedSpec, checked_spec, numbered_places
from sitscad.checks.findings.measures import NO_SIGNAL, OTHERS_MEANING, OTHERS_TITLE, signal_lines, signal_table
from sitscad.estimates.design import Design
from sitscad.files.report import numbers
from sitscad.files.report.page import findings_html, render
from sitscad.layout.tail.tracks import contact_rows, contacts
from sitscad.package.contents import incoming_tests
from sitscad.spec import templates
from sitscad.spec.presets import unverified_figures

SPEC = """\
sitscad: 1
name: the-sensor
coil: {shape: circle, outer_diameter: 8, turns: 12, layers: 2, trace_width: 100 um, trace_spacing: 100 um}
array: {pattern: line, count: 2, pitch: 9}
target: {shape: square, size: 9, thickness: 0.2, material: copper}
elastomer: {material: ecoflex-00-30, shape: square, size: 9, thickness: 2}
mount: {kind: bench-plate, standoff: 4}
requirements: {normal_force: 1 N}
"""
PICTURES = {"A caption & more": "<svg xmlns='http://www.w3.org/2000/svg'><title>board</title></svg>"}
VOID = {"meta", "link", "img", "br", "hr", "input", "rect", "path", "circle"}


@pytest.fixture(scope="module")
def design():
    spec = sitscad.load_text(SPEC, "folder/the.yaml")
    layout = sitscad.lay_out(spec)
    estimates = sitscad.estimate(layout)
    result = sitscad.check(spec, layout, estimates)
    return spec, estimates, checked_spec(spec.name, spec.source, result.findings, result.not_checked)


def _page(design, checked: CheckedSpec | None = None, pictures=PICTURES) -> str:
    spec, estimates, result = design
    return render(checked or result, spec, estimates, pictures, {"fpc/board.gbr": 12345})


class _Reader(HTMLParser):
    """Collects tags, attributes and text, and sees to it that every tag is closed in order."""

    def __init__(self) -> None:
        super().__init__()
        self.stack: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text: list[str] = []

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID or "svg" in self.stack:
            self.stack.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.stack, f"</{tag}> closes nothing"
        assert self.stack.pop() == tag

    def handle_data(self, data):
        if not {"style", "script"} & set(self.stack):
            self.text.append(data)


def _read(page: str) -> _Reader:
    reader = _Reader()
    reader.feed(page)
    reader.close()
    assert reader.stack == []
    return reader


def test_page_is_well_formed_and_loads_no_external_files(design):
    page = _page(design)
    reader = _read(page)
    assert not {"link", "iframe", "img", "object", "embed"} & {tag for tag, _ in reader.tags}
    for _, attributes in reader.tags:
        assert not {"src", "href", "xlink:href", "srcset"} & set(attributes)
        assert not [name for name in attributes if name.startswith("on")]
    assert not re.search(r"url\(|@import|https?://(?!www\.w3\.org/2000/svg)", page)


def test_page_contains_all_sections_findings_and_defaults(design):
    _, estimates, checked = design
    text = " ".join(_read(_page(design)).text)
    for heading in ("Findings", "Layout", "Electrical numbers", "Readout settings", "Stack", "Cross-checks"):
        assert heading in text
    for coil in estimates.coils:
        assert coil.name in text
        assert set(coil.states) == {"free", "rest", "pressed"}
    states = ("free (coil alone)", "at rest (assembled)", "pressed (required force)")
    for word in (*states, "fpc/board.gbr", "A caption & more"):
        assert word in text
    for finding in checked.findings:
        assert finding.rule in text
        assert finding.message in text
    for skipped in checked.not_checked:
        assert skipped.reason in text
    for default in design[0].source.defaults:
        assert default in text
    assert "folder/" not in text


def test_incomplete_layout_note_precedes_values(design):
    spec, estimates, checked = design
    missing = "INCOMPLETE LAYOUT: C1 & C2"
    lacking = dataclasses.replace(estimates, incomplete=missing, notes=(missing, *estimates.notes))
    text = " ".join(_read(_page((spec, lacking, checked))).text)
    assert text.count(missing) == 1 and text.index(missing) < text.index("sensor frequency")


def test_spec_text_is_escaped_in_page(design):
    evil = "</pre><script>alert('x')</script>&\"'"
    spec, estimates, _ = design
    finding = Finding("SIT999", evil, Severity.ERROR, evil, evil, "coil", 1, 1, 1.0, 2.0, evil, evil)
    checked = CheckedSpec(evil, evil, (finding,), (NotChecked("SIT998", evil),))
    named = dataclasses.replace(spec, source=dataclasses.replace(spec.source, defaults=(evil,)))
    noted = dataclasses.replace(estimates, notes=(evil,))
    page = render(checked, named, noted, {evil: "<svg></svg>"}, {evil: 1})
    reader = _read(page)
    assert [tag for tag, _ in reader.tags].count("script") == 1  # the page's own, without a document
    assert "".join(reader.text).count("alert('x')") >= 8


def test_page_verdict_and_banner_follow_severity_of_findings(design):
    error = Finding("SIT201", "x", Severity.ERROR, "too weak")
    warning = Finding("SIT202", "x", Severity.WARNING, "rather weak")
    bad = _page(design, CheckedSpec("s.yaml", "", (error,)))
    fair = _page(design, CheckedSpec("s.yaml", "", (warning,)))
    assert "1 error: do not order this" in bad
    assert "built with --force" in bad
    assert "verdict warned'>No errors found, but 1 warning to settle<" in fair
    assert "--force" not in fair
    small = Finding("SIT217", "small-signal", Severity.WARNING, "rather small")
    assert "No errors found, but the signal is small; 2 warnings to settle" in _page(
        design, CheckedSpec("s.yaml", "", (warning, small))
    )
    note = Finding("SIT204", "x", Severity.NOTE, "by the way")
    assert "verdict good'>No errors found<" in _page(design, CheckedSpec("s.yaml", "", (note,)))


def test_signal_line_follows_verdict(design):
    _, estimates, _ = design
    page = _page(design)
    felt = estimates.signals
    assert len(felt) == 2 and felt[0].per_newton < 0.0
    line = re.search(r"<p class='signal'>(.*?)</p>", page).group(1)
    assert line == html.escape(f"Signal: {'; '.join(signal_lines(felt))}")
    assert page.index("class='verdict") < page.index("class='signal") < page.index("class='tiles")
    share = felt[0].per_newton * felt[0].force / felt[0].rest  # of what the change per newton is of
    assert f"{show(100.0 * share, '%', 3)} of the inductance at the contacts over 1 N" in line


def test_inductance_tables_state_their_use(design):
    _, estimates, checked = design
    text = numbers.estimate_text("a.yaml", estimates, checked)
    titles = [line for line in text.splitlines() if line and not line.startswith(" ")]
    assert titles[1].startswith("Signal from rest") and titles[2].startswith("At the contacts")
    others = numbers.title_with_temperature(OTHERS_TITLE, estimates.temperature)
    assert titles.index(others) > titles.index("Coils, at 20 degC")
    assert all(words in text for words in OTHERS_MEANING)
    (state,) = [s for s in estimates.coils[1].states.values() if s.state == "pressed"]
    others = numbers.reading_table(estimates.coils, estimates.temperature, estimates.normal_force).rows
    (row,) = [row for row in others if row[:2] == ["C2", "pressed (required force)"]]
    assert row[2:] == [quantity(state.apparent_inductance, "H"), quantity(state.converter_inductance, "H")]


def test_sensor_without_signal_gives_reason_in_table():
    spec = sitscad.load_text(SPEC.replace("requirements: {normal_force: 1 N}\n", ""), "no.yaml")
    estimates = sitscad.estimate(sitscad.lay_out(spec))
    assert estimates.signals == () and "class='signal'" not in _page((spec, estimates, CheckedSpec("s", "", ())))
    assert signal_table((), estimates.coils, estimates.readout.drive_code).rows == [["change per newton", NO_SIGNAL]]


def test_headline_shows_amplitude_of_working_states():
    """5.5 V stood there without a word, which the coil alone has on the bench; assembled it is held below 1.8 V."""
    spec = sitscad.load(Path(__file__).parents[2] / "templates" / "grasper_4layer.yaml")
    estimates = sitscad.estimate(sitscad.lay_out(spec))
    page = _page((spec, estimates, CheckedSpec("s", "", ())))
    (tile,) = re.findall(r"<b>([^<]*)</b><span>amplitude", page)
    (note,) = re.findall(r"<p class='soft'>(Ranges [^<]*)</p>", page)
    volts = {name: [coil.states[name].amplitude for coil in estimates.coils] for name in ("free", "rest", "pressed")}
    low, high = min(*volts["rest"], *volts["pressed"]), max(*volts["rest"], *volts["pressed"])
    assert tile == f"{low:.2f} to {high:.2f} V" and high < 1.8 < min(volts["free"])
    assert note.startswith("Ranges run over all coils, at rest and pressed; free, as a bare board on the bench")
    assert f"{min(volts['free']):.2f}" in note


def test_missing_values_are_shown_as_dashes(design):
    spec, estimates, checked = design
    coil = estimates.coils[0]
    states = {
        name: dataclasses.replace(state, amplitude=float("nan"), frequency=float("inf"))
        for name, state in coil.states.items()
    }
    coils = tuple(dataclasses.replace(coil, states=states, self_resonance=float("nan")) for coil in estimates.coils)
    page = render(checked, spec, dataclasses.replace(estimates, coils=coils), {}, {})
    assert not re.search(r"\b(nan|inf|None)\b", " ".join(_read(page).text))


def test_report_page_is_reproducible(design):
    assert _page(design) == _page(design)


def test_placed_findings_are_numbered_errors_first():
    """Errors first; a finding without a place has no number, and the page says where each number stands."""
    warning = Finding("SIT120", "acute-angle", Severity.WARNING, "sharp", place=Place(2e-3, -1e-3, 2, ("C1", "C2")))
    plain = Finding("SIT201", "low", Severity.ERROR, "nowhere")
    error = Finding("SIT108", "copper-spacing", Severity.ERROR, "near", place=Place(1.5e-3, 0.25e-3))
    findings = (warning, plain, error)
    assert numbered_places(findings) == [(1, error), (2, warning)]
    text = findings_html(CheckedSpec("a.yaml", "", findings))
    plain_text = re.sub(r'<a href="#board-finding-([12])">(Place \1)</a>', r"\2", text)
    assert plain_text.count("<a ") == 0 and text.count("<a ") == 2
    assert "<b>Place 1</b> in the pictures: x = 1.500 mm, y = 0.250 mm</p>" in plain_text
    assert "<b>Place 2</b> in the pictures: x = 2.000 mm, y = -1.000 mm, layer 2, nets C1, C2</p>" in plain_text
    assert text.count("in the pictures") == 2 and text.index("near") < text.index("sharp")


def test_page_lists_contacts_and_unverified_values(design):
    spec, estimates, result = design
    wiring = contacts(sitscad.lay_out(spec))
    page = render(result, spec, estimates, {}, {}, contact_rows(sitscad.lay_out(spec)))
    assert [contact.pin for contact in wiring] == ["C1.A", "C1.B", "C2.A", "C2.B"]
    assert all(f">{contact.pin}<" in page and f">{contact.converter_pin}<" in page for contact in wiring)
    figures = unverified_figures(spec)
    assert all(html.escape(figure.what) in page for figure in figures)
    assert {"generic-flex hole_to_hole", "generic-flex drill_to_copper"} <= {figure.what for figure in figures}
    grasper = unverified_figures(sitscad.load_text(templates.read("grasper_4layer"), "spec.yaml"))
    assert {"jaw generic-5mm width", "connector zif-0.5mm contact_width"} <= {figure.what for figure in grasper}


def test_unverified_metal_is_listed_with_assumed_values():
    """The row of a metal had no value: who read it did not see that a permeability of 95 was assumed."""
    text = templates.read("grasper_4layer").replace(
        "jaw: generic-5mm ", "jaw: {based_on: generic-5mm, material: stainless-17-4ph} "
    )
    figures = {figure.what: figure.value for figure in unverified_figures(sitscad.load_text(text, "spec.yaml"))}
    assert figures["conductor stainless-17-4ph"] == "1.3 MS/m, relative permeability 95"


def test_single_coil_period_equals_inverse_scan_rate():
    """The time on one coil contained the settling, which a single channel has once only; 1 over it was no scan rate."""
    spec = sitscad.load_text(
        "sitscad: 1\nname: one\ncoil: {shape: circle, outer_diameter: 8, turns: 12, layers: 2, trace_width: 0.1, "
        "trace_spacing: 0.1}\nreadout: {scan_rate: 3 kHz}\n"
    )
    result = sitscad.estimate(sitscad.lay_out(spec))
    rows = {row[0]: row[1] for row in numbers.readout_table(result.coils, result.readout).rows}
    value, unit = rows["from one result of the coil to the next"].split()
    period = float(value) * {"us": 1e-6, "ms": 1e-3}[unit]
    assert 1.0 / period == approx(result.readout.scan_rate, rel=2e-3)
    assert 1.0 / result.readout.dwell_time < 0.993 * result.readout.scan_rate
    assert "settling, once, before the first conversion" in rows
    assert not {"- settling", "time on one coil, of every scan"} & rows.keys()


def test_page_head_gives_turns_per_layer(design):
    """12 turns on 2 layers could be six on each."""
    assert "12 turns on each of 2 layers" in _page(design)


def test_printed_times_and_capacitances_add_up(design):
    """The conversion was rounded to a digit less than the sum, and the capacitance of leads and tail was left out."""
    factors = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "pF": 1.0}

    def shown(row):
        number, unit = row[1].split()
        return float(number) * factors[unit]

    rows = {row[0]: row for row in numbers.readout_table(design[1].coils, design[1].readout).rows}
    parts = [shown(rows[f"- {name}"]) for name in ("settling", "conversion", "switching to the next coil")]
    assert sum(parts) == approx(shown(rows["time on one coil, of every scan"]), abs=1.1e-6)
    rows = {row[0]: row for row in numbers.coil_table(design[1].coils, design[1].temperature).rows}
    own = shown(rows["of that, the coil's own, with leads and tail"])
    assert shown(rows["- between its layers and turns"]) + shown(rows["- of leads and tail"]) == approx(own, rel=1e-3)


def test_racetrack_size_shows_both_sides():
    """It gave the short side as the coil's size."""
    text = SPEC.replace("circle, outer_diameter: 8, turns: 12", "racetrack, outer_diameter: [12, 8], turns: 9")
    spec = sitscad.load_text(text.replace("pitch: 9", "pitch: 13"), "long.yaml")
    page = render(checked_spec(spec.name, spec.source, (), ()), spec, sitscad.estimate(sitscad.lay_out(spec)), {}, {})
    assert "2 racetrack coils of 12 mm x 8 mm, 9 turns" in page


def test_incoming_test_states_meter_values_and_bare_board_drive_code(design):
    spec, estimates, result = design
    whole = Design(spec)
    page = render(result, spec, estimates, {}, {}, bench=incoming_tests(whole).board)
    part = page[page.index("Incoming test") :].partition("</section>")[0]
    for read, coil in zip(incoming_tests(whole).board.metered, estimates.coils, strict=True):
        # at 100 kHz less crowds than at the tank's frequency, and the coil's own capacitance counts for nothing
        free = coil.states["free"]
        assert free.inductance < read.inductance < 1.03 * free.inductance < free.apparent_inductance * 1.03
        assert read.direct <= read.resistance < 1.01 * read.direct < free.resistance
        assert read.direct == approx(coil.terminal_resistance_dc, rel=1e-12)
        assert f"{quantity(read.inductance, 'H')} +- {quantity(read.inductance_sigma, 'H', 2)}" in part
    (code,) = re.findall(r"use drive code (\d+) for the bare board", part)
    device = whole.spec.readout.device
    swing = max(device.amplitude(coil.states["free"].parallel_resistance, int(code)) for coil in estimates.coils)
    assert "100 kHz" in part and 1.2 < swing < device.limit("amplitude_max")
    assert "Incoming test" not in render(result, spec, estimates, {}, {})


def test_print_style_has_dense_columns(design):
    """Printed, the report of grasper_4layer was 22 pages, and is 10 (chromium --headless --print-to-pdf, pdfinfo)."""
    page = _page(design)
    style = page[page.index("@media print") : page.index("</style>")]
    assert "size: A4" in style and ".scroll { overflow: visible; }" in style and ".columns { columns: 2;" in style
    assert page.count("class='columns'") >= 3
