"""The end of the tail that is plugged in: contacts that the connector has, bare over its whole width, held behind."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest
from one_rule import findings_of
from tolerance import approx

import sitscad
from sitscad.basics.units import show
from sitscad.files.documents.order_notes import order_readme
from sitscad.files.formats import gerber
from sitscad.kernels.geometry.path import Point, bounding_box, closed_polygon
from sitscad.layout.bending import Where, finished_thickness
from sitscad.layout.board import Role, Trace
from sitscad.spec import presets
from sitscad.spec.circuit import LayerKind

MM = 1e-3
UM = 1e-6
PLUGS = ("zif-0.3mm", "zif-0.5mm")


def board(coils: int, connector: str, tail: str = "", fpc: str = ""):
    """Coils of 5 mm in a line, or in two rows where they are many."""
    array = f"{{pattern: line, count: {coils}, pitch: 7}}" if coils < 5 else "{pattern: grid, count: [4, 2], pitch: 7}"
    array = "{pattern: single}" if coils == 1 else array
    return sitscad.lay_out(
        sitscad.load_text(
            "sitscad: 1\nname: plug\n"
            "coil: {shape: circle, outer_diameter: 5, turns: 5, layers: 2, trace_width: 0.1, trace_spacing: 0.1}\n"
            f"array: {array}\nfpc: {{tail: {{length: 40, connector: {connector}{tail}}}{fpc}}}\n",
            "plug.yaml",
        )
    )


@pytest.fixture(scope="module", params=[(n, c) for c in PLUGS for n in (1, 2, 3, 4, 8)], ids=lambda p: f"{p[0]} {p[1]}")
def plugged(request):
    layout = board(*request.param)
    assert not layout.shortfalls
    return layout


def test_tail_has_contact_count_of_existing_connector(plugged):
    connector = plugged.spec.fpc.tail.connector
    assert len(plugged.pads) in connector.positions and [p.number for p in plugged.pads] == [
        *range(1, len(plugged.pads) + 1)
    ]
    used = [pad.number for pad in plugged.pads if not pad.is_unused]
    assert len(used) == 2 * len(plugged.coils) and used == [*range(used[0], used[0] + len(used))]
    assert (len(plugged.pads) - used[-1]) - (used[0] - 1) in (0, 1)
    _, edge = plugged.reach_at(plugged.pads[0].centre.x)
    assert 2 * edge == approx(connector.width(len(plugged.pads)), rel=1e-6)
    steps = {round(a.centre.y - b.centre.y, 9) for a, b in zip(plugged.pads, plugged.pads[1:], strict=False)}
    assert steps == {round(connector.pitch, 9)}


def test_plug_opening_covers_fingers_and_passes_tip(plugged):
    rules, connector = plugged.spec.fpc.rules, plugged.spec.fpc.tail.connector
    x0, y0, x1, y1 = bounding_box([plugged.top_openings[0].outline])
    _, edge = plugged.reach_at(plugged.pads[0].centre.x)
    tip = bounding_box([plugged.outline])[2]
    both = rules.coverlay_registration + rules.outline_tolerance
    assert y1 == approx(edge + both, rel=1e-6) and y0 == approx(-edge - both, rel=1e-6)
    assert x1 == approx(tip + both, rel=1e-6)
    for pad in plugged.pads:
        begin, end = pad.centre.x - pad.size[0] / 2, pad.centre.x + pad.size[0] / 2
        assert end - x0 == approx(connector.contact_length + rules.coverlay_registration, rel=1e-6)
        assert x0 - begin == approx(rules.finger_lap, rel=1e-6)  # so far the finger goes on under the coverlay


@pytest.mark.slow
def test_plug_tail_has_only_expected_notes(plugged):
    findings = [f for f in sitscad.check(plugged.spec, plugged, hints="none").findings if f.rule.startswith("SIT1")]
    kinds = {f.rule for f in findings if f.rule != "SIT103"}
    assert kinds <= {"SIT116", "SIT123", "SIT124", "SIT127"}, [f.message for f in findings]
    assert all(f.severity.value == "note" for f in findings if f.rule in ("SIT124", "SIT127"))
    assert ("SIT127" in kinds) == any(pad.is_unused for pad in plugged.pads)
    assert ("SIT124" in kinds) == (plugged.spec.fpc.tail.connector.name == "zif-0.3mm"), "+-50 um for a band of +-30 um"


def test_order_readme_asks_to_confirm_width_and_thickness_of_plug(plugged):
    """Width and thickness closer than the fabricator's: the notes of every check, and now of the order alone."""
    rules, connector = plugged.spec.fpc.rules, plugged.spec.fpc.tail.connector
    text = " ".join(order_readme(plugged).split())
    width = show(connector.width(len(plugged.pads)), "m")
    assert f"tail {width} +/- {show(connector.width_tolerance, 'm')} wide there" in text
    assert f"closer than the outline's +/- {show(rules.outline_tolerance, 'm')}: cut by laser" in text
    assert f"as {connector.name} takes it: closer than {rules.name} keeps" in text
    assert text.count("to be confirmed") >= 2 and "measured" in text


def test_outline_tolerance_too_wide_for_connector_yields_finding():
    layout = board(2, "zif-0.5mm", fpc=", rules: {outline_tolerance: 250 um}")  # a knife
    (findings,) = findings_of("SIT126", layout.spec, layout)
    assert (findings.measured, findings.limit) == approx((250e-6, 70e-6), rel=1e-9)


def copper_at_contacts(layout):
    """Numbers of the copper layers whose finished Gerber file has copper beyond the coverlay's edge at the contacts."""
    edge, count = bounding_box([layout.top_openings[0].outline])[0], layout.copper_layers
    files = gerber.render(layout)
    texts = {n: next(text for path, text in files.items() if path.endswith(f"-{name}_Cu.gbr"))
             for n in range(1, count + 1)
             for name in ["F" if n == 1 else "B" if n == count else f"In{n - 1}"]}
    result = {n: [int(x) * 1e-9 for x in re.findall(r"X(-?[0-9]+)Y", text.decode())] for n, text in texts.items()}
    return {n for n, xs in result.items() if max(xs, default=0.0) > edge}


def assert_contacts_are_as_thick_as_their_layers(layout):
    stackup, copper = layout.spec.fpc.stackup, copper_at_contacts(layout)
    assert 1 in copper
    films = [layer for layer in layout.spec.fpc.tail_layers[1:] if layer.kind is not LayerKind.COPPER]
    there = [*films, *(each for each in stackup.copper if each.number in copper)]
    made = finished_thickness(layout, Where.CONTACT).nominal
    assert made == approx(sum(each.thickness for each in there) + layout.stiffener.thickness, rel=1e-6)
    return made


def test_contact_thickness_equals_sum_of_layers_in_files(plugged):
    assert_contacts_are_as_thick_as_their_layers(plugged)


@pytest.mark.parametrize("name", ["round_button_12mm", "grasper_4layer", "bench_7mm"])
def test_template_contact_thickness_is_within_half_stiffener_step_of_connector(name):
    """Copper that ends before the contacts was counted: boards of four layers came out 50 um thinner than stated."""
    layout = sitscad.lay_out(sitscad.load(f"templates/{name}.yaml"))
    made, wanted = assert_contacts_are_as_thick_as_their_layers(layout), layout.spec.fpc.tail.connector
    assert abs(made - wanted.insertion_thickness) <= 12.5 * UM
    text = " ".join(order_readme(layout).split())
    assert f"gives {show(made, 'm')}" in text and "this total governs" in text


def test_copper_under_contacts_adds_to_contact_thickness():
    layout = board(1, "zif-0.5mm")
    pad = layout.pads[0]
    under = Trace(closed_polygon([pad.centre.shifted(dx * MM, dy * MM) for dx, dy in ((-1, 0), (1, 0), (1, 0.1))]),
                  0.1 * MM, 2, "C1", Role.TAIL)
    more = replace(layout, traces=(*layout.traces, under))
    thick = layout.spec.fpc.stackup.copper[1].thickness
    at = [finished_thickness(each, Where.CONTACT).nominal for each in (layout, more)]
    assert at[1] - at[0] == approx(thick, rel=1e-6)


def test_written_contact_count_is_used_or_refused():
    layout = board(1, "zif-0.3mm", ", contacts: 6")
    assert [pad.number for pad in layout.pads if not pad.is_unused] == [3, 4] and len(layout.pads) == 6
    (findings,) = [f for f in sitscad.check(layout.spec, layout).findings if f.rule == "SIT127"]
    assert findings.severity.value == "warning" and findings.measured == 6.0 and "zif-0.5mm" in findings.hint
    with pytest.raises(sitscad.SpecError, match="the coils need 4 contacts"):
        board(2, "zif-0.3mm", ", contacts: 3")
    with pytest.raises(sitscad.SpecError, match="has the contacts that the coils need"):
        board(2, "solder-pads", ", contacts: 6")


def test_contact_count_beyond_connectors_is_error():
    layout = board(2, "zif-0.5mm")
    connector = presets.connector("zif-0.5mm")
    few = replace(connector, positions=(2, 3))
    tail = replace(layout.spec.fpc.tail, connector=few)
    spec = replace(layout.spec, fpc=replace(layout.spec.fpc, tail=tail))
    (findings,) = findings_of("SIT127", spec, sitscad.lay_out(spec))
    assert findings.severity.value == "error" and (findings.measured, findings.limit) == (4.0, 3.0)


def test_coverlay_covers_solder_pad_rims():
    for tail in ("", ", turn: left"):
        layout = board(2, "solder-pads", tail)
        lap = layout.spec.fpc.rules.pad_lap
        assert len(layout.top_openings) == len(layout.pads) == 4
        for pad, opening in zip(layout.pads, layout.top_openings, strict=True):
            x0, y0, x1, y1 = bounding_box([opening.outline])
            (w, h), (x, y) = pad.size, pad.centre
            rims = (x0 - (x - w / 2), x + w / 2 - x1, y0 - (y - h / 2), y + h / 2 - y1)
            assert rims == approx((lap,) * 4, rel=1e-6)


@pytest.mark.parametrize("lap", [0.15, 0.25, 1.0])
def test_coverlay_covers_at_most_half_of_small_solder_pads_with_finding(lap):
    layout = board(1, "solder-pads", fpc=f", rules: {{pad_lap: {lap}}}")
    for pad, opening in zip(layout.pads, layout.top_openings, strict=True):
        x0, y0, x1, y1 = bounding_box([opening.outline])
        assert (x1 - x0) * (y1 - y0) >= 0.5 * pad.size[0] * pad.size[1]
    x0, *_ = bounding_box([layout.top_openings[0].outline])
    drawn = x0 - (layout.pads[0].centre.x - layout.pads[0].size[0] / 2)
    findings = findings_of("SIT115", layout.spec, layout)
    if lap == 0.15:
        assert drawn == approx(lap * MM, rel=1e-6) and not findings
    else:
        assert 0.9 * 0.16 * MM < drawn < lap * MM
        assert [(f.measured, f.limit) for f in findings] == [(approx(drawn, rel=1e-6), approx(lap * MM, rel=1e-6))]


def test_tight_outline_tolerance_has_no_width_finding():
    layout = board(2, "zif-0.5mm", fpc=", rules: {outline_tolerance: 50 um}")
    assert findings_of("SIT126", layout.spec, layout) == []


@pytest.mark.parametrize("connector", [*PLUGS, "solder-pads"])
def test_hard_gold_finish_yields_plating_bar_finding(connector):
    layout = board(2, connector, fpc=", finish: hard-gold")
    findings = [f for f in sitscad.check(layout.spec, layout).findings if f.rule == "SIT128"]
    (bars,) = [f for f in findings if "plating-bars" in f.cases]
    assert f"{len(layout.pads)} contacts" in bars.message and bars.severity.value == "warning"
    assert bars.key == "fpc.finish" and "finish: enig" in bars.hint
    assert bool(len(findings) - 1) == (connector == "solder-pads")  # so much gold and solder
    (notes,) = {text for path, text in _papers(layout).items() if path.endswith("readme.txt")}
    assert f"plating bars from the tips of all {len(layout.pads)} contacts" in " ".join(notes.decode().split())
    longer = replace(
        layout, outline=layout.outline.mapped(lambda p: Point(p.x + 2 * MM if p.x > 20 * MM else p.x, p.y))
    )
    (far,) = [f for f in sitscad.check(layout.spec, longer).findings if "plating-bars" in f.cases]
    assert far.severity.value == "error"


@pytest.mark.slow
def test_other_finishes_yield_no_plating_bar_finding():
    for finish, connector, count in (("enig", "zif-0.5mm", 0), ("osp", "zif-0.5mm", 1), ("osp", "solder-pads", 0)):
        layout = board(1, connector, fpc=f", finish: {finish}")
        findings = [f.message for f in sitscad.check(layout.spec, layout, hints="none").findings if f.rule == "SIT128"]
        assert len(findings) == count and all("wears off" in message for message in findings)
        (notes,) = {text for path, text in _papers(layout).items() if path.endswith("readme.txt")}
        assert b"plating bars" not in notes


def _papers(layout):
    from sitscad.files.documents import order_notes as fabrication_notes

    return fabrication_notes.render(layout)


STACKUPS = ("flex-2l-18um", "flex-2l-35um", "flex-4l", "flex-6l", "flex-8l")


@pytest.mark.parametrize("connector", PLUGS)
@pytest.mark.parametrize("stackup", STACKUPS)
def test_stiffener_is_nearest_stock_film(stackup, connector):
    """A film and an adhesive of the list, as near to what the connector takes as they come."""
    layout = board(1, connector, ", layers: 2", f", stackup: {stackup}")
    plate, wanted = layout.stiffener, presets.connector(connector)
    stock = [film + glue for film, glue in presets.stock_stiffeners()]
    assert plate.thickness == approx(min(stock, key=lambda t: abs(t - plate.thickness)), rel=1e-6)
    assert plate.adhesive in {glue for _, glue in presets.stock_stiffeners()}
    have = finished_thickness(layout, Where.CONTACT).nominal
    assert all(
        abs(have - wanted.insertion_thickness) <= abs(have - plate.thickness + t - wanted.insertion_thickness) + 1e-9
        for t in stock
    )
    findings = {f.rule for f in sitscad.check(layout.spec, layout, hints="none").findings}
    assert not findings & {"SIT117", "SIT129"}
    text = " ".join(next(iter(_papers(layout).values())).decode().split())
    assert f"{plate.adhesive * 1e6:g} um adhesive" in text


@pytest.mark.parametrize(
    ("stackup", "connector"),
    [("flex-6l", "zif-0.3mm"), ("flex-8l", "zif-0.3mm")],
)
def test_thick_tail_without_stiffener_is_refused(stackup, connector):
    """Where tail.layers is left out all layers run down it, and no stiffener makes that thinner."""
    layout = board(1, connector, fpc=f", stackup: {stackup}")
    (findings,) = findings_of("SIT117", layout.spec, layout)
    assert layout.stiffener is None and findings.severity.value == "error"
    assert findings.measured > presets.connector(connector).insertion_thickness
    assert "insertion-bare" in findings.cases


@pytest.mark.slow
def test_stiffener_outside_stock_yields_question():
    layout = board(1, "zif-0.5mm", ", stiffener: 200 um")
    assert layout.stiffener.thickness == 200e-6 and layout.stiffener.adhesive > 0.0
    assert findings_of("SIT129", layout.spec, layout) == []
    layout = board(2, "zif-0.5mm", ", stiffener: 190 um")
    (asked,) = findings_of("SIT129", layout.spec, layout)
    assert asked.severity.value == "note" and asked.key == "fpc.tail.stiffener" and layout.stiffener.thickness == 190e-6
    thick = replace(presets.connector("zif-0.5mm"), insertion_thickness=0.6 * MM)
    tail = replace(layout.spec.fpc.tail, connector=thick, stiffener=None)
    spec = replace(layout.spec, fpc=replace(layout.spec.fpc, tail=tail))
    made = sitscad.lay_out(spec)
    (asked,) = findings_of("SIT129", spec, made)
    assert asked.severity.value == "warning" and "stiffener-stock" in asked.cases
    assert finished_thickness(made, Where.CONTACT).nominal == approx(0.6 * MM, rel=1e-6)
    assert b"tell us the nearest that you have" in b" ".join(next(iter(_papers(made).values())).split())


@pytest.mark.slow
@pytest.mark.parametrize(("fpc", "key"), [
    ("stackup: rigid-2l-1.6mm, tail: {length: 30}", "fpc.tail.connector: solder-pads"),
    ("stackup: rigid-4l-1.6mm, tail: {length: 30}", "fpc.tail.connector: solder-pads"),
    ("stackup: flex-2l-18um, tail: {length: 30, stiffener: 0.05}", "fpc.tail.stiffener: 0.2295 (tried)"),
])
def test_finding_of_too_thick_tail_suggests_key(fpc, key):
    coil = "shape: circle, outer_diameter: 8, turns: 6, layers: 2, trace_width: 0.25, trace_spacing: 0.25"
    text = f"sitscad: 1\nname: thick\ncoil: {{{coil}}}\nfpc: {{rules: generic-fine, {fpc}}}\n"
    findings = sitscad.check(sitscad.load_text(text, "thick.yaml"), hints="full").findings
    (hint,) = [each.hint for each in findings if each.rule == "SIT117"]
    assert key in hint
