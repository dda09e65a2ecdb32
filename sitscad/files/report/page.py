"""The report page: one self-contained HTML file with the verdict, the pictures and all numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

from sitscad.assembly.places.bodies import (
    MOUNT_PIECES,
    backing_of,
    board_heights,
    film_thickness,
    plates_of,
    top_height,
)
from sitscad.assembly.places.state import FREE, state_text, working_states
from sitscad.basics.check_results import Signal
from sitscad.basics.finding import Finding, Severity
from sitscad.basics.quantities import Table
from sitscad.basics.record import record
from sitscad.basics.units import DASH, count_text, quantity, show
from sitscad.checks.findings import CheckedSpec, excerpt, measures, numbered_places, sorted_by_severity
from sitscad.estimates.circuits.settings import bare_board_code
from sitscad.estimates.coil_estimates import CoilEstimate, ReadoutEstimate
from sitscad.files.drawing.sheet import Pen, Sheet
from sitscad.files.drawing.svg import svg
from sitscad.files.drawing.web_page import html_figure, html_list, html_page, html_section, soft_paragraph
from sitscad.files.report import numbers
from sitscad.files.report.moving import json_script, script_text
from sitscad.files.report.numbers import Document
from sitscad.files.report.numbers import html_table as _table
from sitscad.kernels.geometry.path import Point, polyline, rectangle
from sitscad.spec.circuit import LayerKind, Stackup
from sitscad.spec.places import cell_specs
from sitscad.spec.presets import is_rigid, metal_colour, unverified_figures
from sitscad.spec.sensor import SensorSpec

if TYPE_CHECKING:
    from sitscad.estimates import Estimates

ORDER = (Severity.ERROR, Severity.WARNING, Severity.NOTE)
FORCED = "This package was built with --force in spite of errors. It is known not to meet its own checks."
REFUSED = "This design does not meet its own checks: sitscad build refuses it."


def render(
    checked: CheckedSpec, spec: SensorSpec, estimates: Estimates, pictures: Mapping[str, str], files: Mapping[str, int],
    wiring: Sequence[Sequence[str]] = (), sheet: Document | None = None, bench: Estimates | None = None,
    moving: Mapping[str, Mapping[str, Any]] | None = None, is_built: bool = True,
) -> str:
    """Return the page as HTML text.

    All text from the spec is escaped. The page loads nothing from outside.

    Parameters
    ----------
    checked : CheckedSpec
        Findings and fit of the design.
    spec : SensorSpec
        The design.
    estimates : Estimates
        The design's estimates.
    pictures : mapping
        SVG drawings by caption, in the order of display.
    files : mapping
        Sizes (bytes) of the package's other files by path.
    wiring : sequence
        Table of the contacts' connections, its head first.
    sheet : mapping, optional
        Sensing performance, as in JSON.
    bench : Estimates, optional
        Estimates at 20 degrees Celsius, by which boards are tested.
    moving : mapping, optional
        Documents of `sitscad.files.report.moving` by view, ``solids`` and ``pushed``.
    is_built : bool
        Whether the page belongs to a package. False for a design that is watched.
    """
    cross_checks = numbers.cross_check_table(estimates.cross_checks, estimates.no_cross_check)
    title = "Seen from the top; both contacts of a coil are one net"
    rows = [[name, f"{size:,} bytes".replace(",", "\u202f")] for name, size in sorted(files.items())]
    unverified = [[each.what, each.value, each.source] for each in unverified_figures(spec)]
    skipped = [[each.rule, each.reason] for each in checked.not_checked]
    not_checked = _columns_html(_table(["rule", "why it was not checked"], skipped, ""))
    parts = [
        _head_html(checked, spec, estimates.signals, FORCED if is_built else REFUSED),
        _tiles_html(checked, estimates.all_coils, estimates.incomplete, estimates.readout.scan_rate, sheet or {}),
        html_section("Findings", findings_html(checked), "findings"),
        html_section("Push it", _view_html("pushed", PUSHED, moving), "feeling"),
        html_section("In three dimensions", _view_html("solids", SOLIDS, moving), "solids"),
        html_section("Layout", "".join(_picture_html(svg, caption) for caption, svg in pictures.items()), "board"),
        html_section("Contacts", _table(*numbers.head_and_rows(wiring), title)),
        html_section("Incoming test", _incoming_html(estimates.readout, bench)),
        html_section("Electrical numbers", _electrical_html(estimates)),
        html_section("What it feels", _performance_html(sheet or {})),
        html_section("Readout settings", numbers.page_tables(
            [numbers.readout_table(estimates.all_coils, estimates.readout)])),
        html_section("Stack", _stack_html(spec.fpc.stackup, stack_section_svg(section_layers(spec)),
                                          numbers.stack_tables(estimates))),
        html_section("Fit", _fit_html(checked)),
        html_section("Cross-checks", numbers.page_tables([cross_checks])),
        html_section("Defaults assumed", html_list(spec.source.defaults)),
        html_section(
            "Figures that nobody has verified",
            _table(["figure", "taken as", "why it is unverified, and what to do"], unverified, ""),
        ),
        html_section("Not checked", not_checked or "<p>Every rule was checked.</p>"),
        html_section("Files", _columns_html(_table(["file", "size"], rows, ""))),
    ]
    file_name = checked.path.replace("\\", "/").rpartition("/")[2]
    digest = f"spec {escape(file_name)}, SHA-256 {spec.source.sha256}"
    return html_page(f"{spec.name}: report", [*parts, f"<script>{script_text()}</script>"], f" \u00b7 {digest}")


PUSHED = """
<div id="pushed" hidden><p>Move the sliders, or drag the target in a section: to the side for shear, down for normal
force. <span data-out="rotation"></span> Forces read back are what the map of calibration/ makes of the
counts after a tare at rest, and one sigma from unit to unit, not calibrated.</p>
<div class="inputs"></div><div class="cuts"></div><p class="warned" data-out="range" role="status"></p>
<div class="scroll"><table><thead><tr><th>coil</th><th class="number">frequency (Hz)</th>
<th class="number">from rest (Hz)</th><th class="number">counts</th></tr></thead><tbody></tbody></table></div>
<div class="scroll"><table><thead><tr><th>force</th><th class="number">put on (N)</th>
<th class="number">read back (N)</th><th class="number">+- N, over all loads</th></tr></thead><tbody></tbody></table>
</div><p class="soft" data-out="unsolved" role="status"></p></div>
<p data-without="pushed">Here a reader's browser shows the sensor pushed; it needs scripts. The curves are in the data
sheet, and <code>sitscad response</code> gives every number.</p>
"""

SOLIDS = """
<div id="solids" hidden><div class="bar views"></div>
<div class="stage"><canvas tabindex="0" aria-label="the assembly: drag or arrow keys turn it, with shift they move it,
plus and minus make it larger and smaller, m marks the point in the middle"></canvas><div class="marks"></div></div>
<div class="bar"><label>section <select data-in="cut"><option value="none">none</option>
<option value="y">along x</option><option value="x">across</option></select></label>
<label>at <input type="range" data-in="at" min="0" max="1" step="0.005"></label>
<label>exploded <input type="range" data-in="apart" min="0" max="1" step="0.01"></label>OPEN
<button type="button" data-in="measure" aria-pressed="false">measure</button><output data-out="measured"></output></div>
<fieldset class="bar parts"></fieldset></div>
<p data-without="solids">Here a reader's browser shows mount/assembly.glb; it needs scripts and WebGL 2. The pictures
below show it still.</p>
"""

OPEN = '<label>jaws open <input type="range" data-in="open" min="0" max="1" step="0.01"></label>'


def _view_html(name: str, frame: str, moving: Mapping[str, Mapping[str, Any]] | None) -> str:
    """Return a view that scripts fill, with its data; empty without data."""
    document = (moving or {}).get(name)
    if document is None:
        return ""
    return frame.replace("OPEN", OPEN if document.get("hinge") else "") + json_script(f"{name}-data", document)


def _picture_html(drawing: str, caption: str) -> str:
    """Return a picture of the layout; scripts switch the layers and nets of the whole board's picture."""
    shown = html_figure(drawing, caption)
    return shown.replace("<figure>", '<figure class="board">', 1) if "id='board'" in drawing else shown


def _verdict_html(checked: CheckedSpec) -> str:
    """Return the verdict as HTML. It is green only if there are no errors, silenced errors or warnings."""
    errors, warnings = (checked.count(severity) for severity in (Severity.ERROR, Severity.WARNING))
    if checked.silenced:
        kind, text = "bad", f"{count_text(len(checked.silenced), 'error')} silenced: do not order this"
    elif errors:
        kind, text = "bad", f"{count_text(errors, 'error')}: do not order this"
    elif warnings:
        weak = "the signal is small; " if any(f.name == SMALL_SIGNAL for f in checked.findings) else ""
        kind, text = "warned", f"No errors found, but {weak}{count_text(warnings, 'warning')} to settle"
    else:
        kind, text = "good", "No errors found"
    return f"<p class='verdict {kind}'>{text}</p>"


SMALL_SIGNAL = "small-signal"  # Rule whose warning is stated in the verdict


def _head_html(checked: CheckedSpec, spec: SensorSpec, signals: Sequence[Signal], failed: str) -> str:
    """Return the top of the page: name, verdict and signal. `failed` is the banner of a design with errors."""
    counts = [count_text(checked.count(severity), severity.value) for severity in ORDER if checked.count(severity)]
    headline = "; ".join(measures.signal_lines(signals))
    coil = spec.coil
    each = "each of " if len(coil.layers) > 1 and not coil.has_unequal_turns else ""
    turns = f"{coil.turns_in_words} turns on {each}{count_text(len(coil.layers), 'layer')}"
    coils = count_text(len(spec.array.placements), f"{coil.outline.adjective} coil")
    what = (
        f"{coils} of {' x '.join(show(side, 'm') for side in dict.fromkeys(coil.size))}, {turns}, "
        f"{show(coil.inner_diameter, 'm', 4)} between inner copper edges, "
        f"traces {show(coil.trace_width, 'm')} wide and {show(coil.trace_spacing, 'm')} apart"
        + (f"; drawn by the user in {coil.drawn}, with the board" if coil.drawn else "")
    )
    banner = "" if checked.is_orderable else f"<p class='banner'>{failed}</p>"
    skipped = len(checked.not_checked)
    reasons_below = f"{count_text(skipped, 'rule')} not checked, for reasons listed below"
    not_made = reasons_below if skipped else "every rule checked"
    return (
        f"<header><h1>{escape(spec.name)}</h1>{soft_paragraph(spec.issue.words)}{soft_paragraph(what)}"
        f"{_verdict_html(checked)}"
        + (f"<p class='signal'>Signal: {escape(headline)}</p>" if headline else "")
        + f"<p class='soft'>{', '.join(counts) or 'no findings'}; {not_made}</p></header>{banner}"
    )


def _tiles_html(
    checked: CheckedSpec, coils: tuple[CoilEstimate, ...], incomplete: str | None, scan_rate: float, sheet: Document
) -> str:
    """Return the key numbers: resolution and drift or inductance, the tank's state, and the least margin of fit."""
    states = [coil.states[name] for coil in coils for name in working_states(coil.states)]
    alone = [coil.states[FREE] for coil in coils if FREE in coil.states]
    if not states:
        return _incomplete_banner(incomplete)
    points = sheet.get("performance", ())
    resolutions = [points[-1]["axes"]["normal"]["resolution_N"]] if points else []
    errors = points[-1]["axes"]["normal"]["errors_N"] if points else {}
    tight = min(checked.fit, key=lambda measure: measure.margin, default=None)
    rows = [
        (f"normal force told apart, one sigma of noise{_worst_cell_names(sheet)}", _range_text(resolutions, "N"))
        if resolutions else
        ("inductance at the contacts", _range_text([s.inductance for s in states], "H")),
        *((f"normal force: {cause}", _range_text([error], "N")) for cause, error in errors.items() if "drift" in cause),
        ("sensor frequency", _range_text([s.frequency for s in states], "Hz")),
        ("parallel resistance", _range_text([s.parallel_resistance for s in states], "ohm")),
        ("amplitude (peak)", _range_text([s.amplitude for s in states], "V")),
        ("scans of all coils", _range_text([scan_rate], "Hz")) if tight is None else
        (f"{tight.name}, to spare at worst", show(tight.margin, "m", 3)),
    ]
    tiles = (f"<div class='tile'><b>{value}</b><span>{escape(name)}</span></div>" for name, value in rows)
    note = f"Ranges run over all coils, {' and '.join(dict.fromkeys(state_text(s.state) for s in states))}"
    if alone and states != alone:
        swing, runs = _range_text([s.amplitude for s in alone], "V"), _range_text([s.frequency for s in alone], "Hz")
        note += f"; free, as a bare board on the bench, the amplitude is {swing} at {runs}"
    return f"{_incomplete_banner(incomplete)}<div class='tiles'>{''.join(tiles)}</div><p class='soft'>{note}.</p>"


def _worst_cell_names(sheet: Document) -> str:
    """Return the names of the cells with the coarsest resolution.

    Empty without cells, or if any resolution is unknown.
    """
    each = sheet.get("cells", {}).get("each", ())
    if not each or any(cell["resolution_N"]["normal"] is None for cell in each):
        return ""
    worst = max(each, key=lambda cell: cell["resolution_N"]["normal"])
    return f", cell {', '.join(map(str, worst['alike']))} (worst)"


def _incomplete_banner(incomplete: str | None) -> str:
    """Return a banner with the reason why the estimates are incomplete; empty if the layout is complete."""
    return f"<p class='banner'>{escape(incomplete)}</p>" if incomplete else ""


def findings_html(checked: CheckedSpec) -> str:
    """Return all findings, most severe first, with place numbers as in the pictures, then ignored findings."""
    places = {id(finding): number for number, finding in numbered_places(checked.findings)}
    articles = (_finding_html(checked, finding, places.get(id(finding)))
                for finding in sorted_by_severity(checked.findings))
    # findings that the user ignores, with the reasons
    rows = [[each.finding.rule, each.finding.whole_message, f"{each.reason} ({each.by})"] for each in checked.ignored]
    ignored = _table(["ignored", "what was found", "why it is ignored, and by what"], rows, "")
    return ("".join(articles) or "<p>Nothing was found.</p>") + ignored


def _finding_html(checked: CheckedSpec, finding: Finding, number: int | None) -> str:
    """Return a finding as a collapsible HTML element (<details>); errors start expanded.

    `number` links the finding to its place in the pictures; None if it has no place.
    """
    line = checked.line(finding.line, finding.file)
    shown = "" if line is None else excerpt(line, finding.column or 1)[0]
    quoted = f"<pre>{finding.line:>4} | {escape(shown)}</pre>" if line is not None else ""
    hint = f"<p><b>To mend it:</b> {escape(finding.hint)}</p>" if finding.hint else ""
    unit = finding.unit or ""
    figures = [
        f"{word} {escape(quantity(value, unit))}"
        for word, value in (("measured", finding.measured), ("limit", finding.limit))
        if value is not None
    ]
    tail = [*figures, *([f"source: {escape(finding.source)}"] if finding.source else [])]
    opened = " open" if finding.severity is Severity.ERROR else ""
    place_attribute = f' data-place="{number}"' if number is not None else ""
    return (
        f'<details class="finding {finding.severity.value}"{place_attribute}{opened}><summary>'
        f"<span class='kind'>{finding.severity.value} {escape(finding.rule)}</span> "
        f"<span class='soft'>{escape(finding.name)}</span> {escape(finding.whole_message)}</summary>"
        f"{_place_text(finding, number)}{quoted}{hint}"
        + (f"<p class='soft'>{'; '.join(tail)}</p>" if tail else "")
        + "</details>"
    )


def _place_text(finding: Finding, number: int | None) -> str:
    """Return a finding's place on the board, with its number in the pictures; empty without a place."""
    place = finding.place
    if place is None or number is None:
        return ""
    parts = [f"x = {place.x * 1e3:.3f} mm, y = {place.y * 1e3:.3f} mm"]
    parts += [f"layer {place.layer}"] if place.layer is not None else []
    parts += [f"net{'s' if len(place.nets) > 1 else ''} {', '.join(place.nets)}"] if place.nets else []
    place_name = f'<a href="#board-finding-{number}">Place {number}</a>'
    return f"<p><b>{place_name}</b> in the pictures: {escape(', '.join(parts))}</p>"


def _electrical_html(estimates: Estimates) -> str:
    if not estimates.coils:
        return "<p>No coil could be estimated.</p>"
    notes = (note for note in estimates.notes if note != estimates.incomplete)
    return numbers.page_tables(numbers.estimate_tables(estimates)) + html_list(notes)


def _incoming_html(readout: ReadoutEstimate, bench: Estimates | None) -> str:
    """Return the expected readings of delivered bare boards, and the converter's drive code for them."""
    if bench is None:
        return ""
    code = bare_board_code(bench.all_coils, bench.readout.device)
    used = ", ".join(map(str, readout.drive_codes or (readout.drive_code,)))
    drive = (
        f"<p>With {escape(readout.device.part)} use drive code {code} for the bare board; the assembled sensor has "
        f"{used}.</p>"
        if code is not None and readout.drive_code is not None and not readout.high_current
        else ""
    )
    return numbers.page_tables(numbers.incoming_tables(bench.all_coils, bench.metered)) + drive


def _performance_html(sheet: Document) -> str:
    """Return the tables of the data sheet, and errors from unit to unit. Empty in a package without a data sheet."""
    between, cells = sheet.get("unit_to_unit", {}), sheet.get("cells", {})
    by_cell = f"Cell by cell. Elsewhere {cells['figures_are']}." if cells else ""
    tables = [Table(*numbers.head_and_rows(cells.get("in_words", ())), by_cell)]
    tables += [Table(*numbers.head_and_rows(lines)) for lines in sheet.get("in_words", ())]
    tables.append(Table(*numbers.head_and_rows(between.get("in_words", ())), between.get("errors_are", "")))
    return numbers.page_tables(tables)


def _stack_html(stackup: Stackup, section: str, tables: list[Table]) -> str:
    caption = "Section through all that lies on each other; heights to scale, widths not."
    figure = f"<figure>{section}<figcaption>{caption}</figcaption></figure>"
    condition = "" if is_rigid(stackup) else " without stiffener"
    total = f"The board is {show(stackup.thickness, 'm')} thick{condition} ({escape(stackup.name)})."
    return f"{figure}<p>{total}</p>{numbers.page_tables(tables)}"


def _fit_html(checked: CheckedSpec) -> str:
    closing = [] if checked.closing is None else [measures.closing_table(checked.closing)]
    return numbers.page_tables([*measures.fit_tables(checked.fit), *closing])


def _columns_html(body: str) -> str:
    return f"<div class='columns'>{body}</div>" if body else ""


def _range_text(values: Iterable[float | None], unit: str) -> str:
    """Return the smallest and the largest of the values as text. Values that are None or infinite do not count.

    Each value has its own unit prefix if the prefixes differ.
    """
    finite = [value for value in values if value is not None and math.isfinite(value)]
    if not finite:
        return DASH
    low, high = show(min(finite), unit, 3), show(max(finite), unit, 3)
    if low == high:
        return low
    (a, _, unit_low), (b, _, other) = low.partition(" "), high.partition(" ")
    return f"{a} to {b} {other}".strip() if unit_low == other else f"{low} to {high}"


WIDTH, LEFT, RIGHT, LABEL = 900.0, 20.0, 470.0, 520.0
HEIGHT, ROW, LETTERS = 380.0, 22.0, 13.0
OUTLINE = Pen(0.6, round_ends=False, round_corners=False)
"""Outline of layers and leaders; its colour comes from the page's style, as do the texts' colours."""

COLOURS = {
    "standoff": "#dfe5ea", LayerKind.COVERLAY: "#d9a441", LayerKind.COPPER: "#c46a2b", LayerKind.DIELECTRIC: "#f0dfb0",
    "elastomer": "#a9cfe0", "film": "#cfe3cf", "gap": "#f7f9fa",
}
METAL_SHOWN = 0.6e-3
"""Largest drawn thickness (m) of a jaw, a finger or metal behind the board; thicker metal is cut off."""


@record
class SectionLayer:
    """One layer of the section: heights (m) above the board's top face, colour and label."""

    bottom: float
    top: float
    colour: str
    label: str
    inset: float = 0.0


def stack_section_svg(layers: Iterable[SectionLayer]) -> str:
    """Return the section as an inline SVG, whose text colours come from the page."""
    slices = list(layers)
    low, high = min(s.bottom for s in slices), max(s.top for s in slices)
    scale = HEIGHT / (high - low)
    # Rows (top down) for the labels, near their layers and at least one row apart
    rows: list[float] = []
    for y in [HEIGHT - ((s.bottom + s.top) / 2 - low) * scale for s in slices]:
        rows.append(max(y, rows[-1] + ROW) if rows else max(y, 4.0))
    excess = rows[-1] - max(HEIGHT, (len(rows) - 1) * ROW + 4.0)
    for i in range(len(rows) - 1, -1, -1):
        if excess <= 0:
            break
        limit = rows[i + 1] - ROW if i + 1 < len(rows) else rows[i] - excess
        rows[i] = min(rows[i], limit)
    height = max(HEIGHT, rows[-1] + ROW) + 20.0
    sheet = Sheet("Section of the sensor", (WIDTH, height), unit="", decimals=2, ground=None, kind="section")
    for piece, row in zip(slices, rows, strict=True):
        top, bottom = (height - 10.0 - (high - z) * scale for z in (piece.top, piece.bottom))
        edge, middle, line = RIGHT - piece.inset, (top + bottom) / 2, height - 10.0 - row
        sheet.draw(rectangle(LEFT + piece.inset, bottom, edge, top), OUTLINE, piece.colour, kind="layer")
        knees = [(edge, middle), (RIGHT + 10.0, middle), (LABEL - 12.0, line), (LABEL - 4.0, line)]
        sheet.draw(polyline([Point(*knee) for knee in knees]), OUTLINE, kind="leader")
        sheet.text(LABEL, line - 4.5, piece.label, LETTERS)
    return svg(sheet)


def section_layers(spec: SensorSpec) -> Iterator[SectionLayer]:
    """Yield the layers of the sensor's section, from the target down to the metal behind the board."""
    above: list[SectionLayer] = []
    for body in plates_of(cell_specs(spec)[0]).all:
        label = f"{body.name}, {body.material}, {show(body.thickness, 'm')}"
        colour = metal_colour(body.material) if body.name == "target" else COLOURS[body.name]
        above.append(SectionLayer(*body.heights, colour, label, 40.0))
    if spec.encapsulation is not None:
        label = f"encapsulation, {spec.encapsulation.material.name}, {show(spec.encapsulation.thickness, 'm')}"
        top = top_height(spec)
        above.append(SectionLayer(top - film_thickness(spec.encapsulation), top, COLOURS["film"], label, 20.0))
    yield from reversed(above)
    # The layers of the board from the top down
    depth, copper = 0.0, 0
    for layer in spec.fpc.stackup.layers:
        copper += layer.kind is LayerKind.COPPER
        name = f"copper {copper}" if layer.kind is LayerKind.COPPER else layer.kind.value
        material = f", {layer.material}" if layer.material not in ("", "copper") else ""
        label = f"{name}{material}, {show(layer.thickness, 'm')}"
        yield SectionLayer(-depth - layer.thickness, -depth, COLOURS[layer.kind], label)
        depth += layer.thickness
    # Mount, shield and jaw under the board, named as in the drawing; without a mount, the gap to the shield
    here = board_heights(spec.fpc.stackup)[0]
    shield, mount = spec.shield, spec.mount
    levels, seat = backing_of(spec).shield_heights, backing_of(spec).seat_heights
    if shield is not None and levels is not None:
        below = seat is not None and levels[0] - seat[0] > 1e-9
        what = "gap" if mount is None else MOUNT_PIECES[1 if below else 0]
        yield SectionLayer(levels[1], here, COLOURS["standoff"], f"{what} to the shield, {show(shield.gap, 'm')}")
        label = f"shield, {shield.material.name}, {show(shield.thickness, 'm')}"
        yield SectionLayer(*levels, metal_colour(shield.material.name), label)
        here = levels[0]
    if mount is None or seat is None:
        return
    face = seat[0]
    if here - face > 1e-9:
        yield SectionLayer(face, here, COLOURS["standoff"], f"{MOUNT_PIECES[0]}, {show(here - face, 'm')}")
    if mount.metal is None:
        return
    name, thickness, upper = "jaw" if mount.finger is None else "finger", mount.metal_thickness, face
    if mount.metal_behind is not None:
        name, upper = "metal behind", board_heights(spec.fpc.stackup)[0] - mount.metal_behind.distance
        if face - upper > 1e-9:
            yield SectionLayer(upper, face, COLOURS["gap"], f"gap to the metal behind, {show(face - upper, 'm')}")
    shown = METAL_SHOWN if thickness is None else min(METAL_SHOWN, thickness)
    size = "" if thickness is None else f", {show(thickness, 'm')} thick"
    cut = "" if thickness == shown else ", cut off here"
    yield SectionLayer(upper - shown, upper, metal_colour(mount.metal.name), f"{name}, {mount.metal.name}{size}{cut}")
