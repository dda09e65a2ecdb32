"""The fabrication files of every template: read back, and compared with the layout that they come from."""

from __future__ import annotations

import re
import subprocess

import pytest
from gerber_shapes import area_of, function_of, image, net_of, read
from gerbonara import ExcellonFile
from gerbonara.ipc356 import Netlist
from layouts import order_set
from shapely.geometry import LineString, Point, Polygon, box
from shapely.ops import unary_union
from tolerance import approx

from sitscad.files.documents import order_notes as fabrication_notes
from sitscad.files.formats import gerber, ipc356
from sitscad.layout import lay_out
from sitscad.layout.panel import plan
from sitscad.spec.load import load

MM = 1e-3


@pytest.fixture(scope="module")
def laid_out():
    """Layouts by the spec's path, each made once."""
    made = {}

    def of(path):
        if path not in made:
            made[path] = lay_out(load(str(path)))
        return made[path]

    return of


def copper(layout) -> dict[int, object]:
    """The copper files as gerbonara reads them, by layer."""
    files = [read(text) for path, text in gerber.render(layout).items() if path.endswith("_Cu.gbr")]
    return {int(file.file_attrs[".FileFunction"][1][1:]): file for file in files}


@pytest.mark.slow
def test_gerber_copper_area_of_template_agrees_with_layout(template, laid_out):
    layout = laid_out(template)
    for layer, file in copper(layout).items():
        shapes = [
            LineString([(p.x / MM, p.y / MM) for p in trace.path.flattened(2e-8)]).buffer(trace.width / MM / 2, 32)
            for trace in layout.on_layer(layer)
        ]
        shapes += [Point(v.centre.x / MM, v.centre.y / MM).buffer(v.pad / MM / 2, 32) for v in layout.vias_on(layer)]
        for pad in (pad for pad in layout.pads if pad.layer == layer):
            (x, y), (w, h) = pad.centre, pad.size
            shapes.append(box(*(c / MM for c in (x - w / 2, y - h / 2, x + w / 2, y + h / 2))))
        drops = [drop.outline for drop in layout.teardrops if drop.layer == layer]
        shapes += [Polygon([(p.x / MM, p.y / MM) for p in outline.flattened(1e-8)]) for outline in drops]
        expected = unary_union(shapes)
        shown = image(file)
        assert shown.area == approx(expected.area, rel=5e-4)
        assert shown.symmetric_difference(expected).area < 1e-3 * expected.area


@pytest.mark.slow
def test_template_arcs_keep_one_radius_and_nets_keep_distance(template, laid_out):
    layout = laid_out(template)
    for file in copper(layout).values():
        arcs = [item for item in file.objects if hasattr(item, "clockwise")]
        assert all(arc.numeric_error() < 1e-6 for arc in arcs)
        shapes = [unary_union([area_of(i) for i in file.objects if net_of(i) == net]) for net in layout.nets]
        for i, each in enumerate(shapes):
            assert all(each.is_empty or other.is_empty or each.distance(other) > 0.05 for other in shapes[i + 1 :])


def test_circular_windings_are_drawn_with_arcs(template, laid_out):
    layout = laid_out(template)
    if layout.spec.coil.shape == "circle":
        for layer in layout.spec.coil.layers:
            assert any(hasattr(item, "clockwise") for item in copper(layout)[layer].objects)


def test_drill_holes_match_via_pads_of_each_layer(template, laid_out):
    layout = laid_out(template)
    reached: dict[int, set[tuple[float, float]]] = {layer: set() for layer in range(1, layout.copper_layers + 1)}
    for path, drill in gerber.render_drills(layout).items():
        last = int(re.search(rb"FileFunction,Plated,1,(\d+)", drill)[1])
        for hole in ExcellonFile.from_string(drill.decode("ascii"), filename=path).drills():
            for layer in range(1, last + 1):
                reached[layer].add((hole.x, hole.y))
    for layer, file in copper(layout).items():
        assert {(pad.x, pad.y) for pad in file.objects if function_of(pad) == ("ViaPad",)} == reached[layer]


def test_netlist_has_two_contacts_per_coil(template, laid_out):
    layout = laid_out(template)
    (text,) = ipc356.render(layout).values()
    records = Netlist.from_string(text.decode("ascii"), "board.d356").test_records
    for coil in layout.coils:
        assert len([r for r in records if r.net_name == coil.net and r.ref_des == "J1"]) == 2


def test_order_readme_reports_no_contact_out_of_tolerance(template, laid_out):
    text = fabrication_notes.order_readme(laid_out(template))
    assert "OUT OF TOLERANCE" not in text and "DO NOT ORDER" not in text


@pytest.mark.clients("gerbv")
def test_gerbv_renders_template_set_without_warning(template, laid_out, tmp_path):
    layout, files = laid_out(template), []
    for render in (gerber.render, gerber.render_drills):
        for path, text in render(layout).items():
            files.append(tmp_path / path.rpartition("/")[2])
            files[-1].write_bytes(text)
    command = ["gerbv", "-x", "png", "-D", "300", "-a", "-o", tmp_path / "set.png", *files]
    run = subprocess.run(command, capture_output=True, text=True, timeout=60)
    lines = [line for line in run.stderr.splitlines() if re.search("CRITICAL|WARNING", line)]
    assert [line for line in lines if not re.search(r"extension found %T[FAOD]%", line)] == []
    assert (tmp_path / "set.png").stat().st_size > 1000


def test_order_set_is_byte_identical_when_repeated(template, laid_out):
    layout, again = laid_out(template), lay_out(load(str(template)))
    assert order_set(layout, plan(layout)) == order_set(again, plan(again))
