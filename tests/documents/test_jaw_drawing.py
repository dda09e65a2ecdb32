"""The jaw drawing: to scale, with the figures that the fit is judged by, and the jaws about their pivot."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import handmade
import pytest
from legibility import assert_legible
from tolerance import approx

import sitscad
from sitscad.assembly.places.fit import closed_section, closing_motion
from sitscad.assembly.places.jaws import jaw_range
from sitscad.assembly.places.tail_path import tail_path
from sitscad.files.documents.drawings.jaw import jaw_sheet, render
from sitscad.files.drawing.sheet import Group, Label, Sheet, flat_items
from sitscad.kernels.geometry.path import bounding_box
from sitscad.spec import templates


def shapes(sheet: Sheet) -> dict[str, tuple[float, float, float, float]]:
    """The boxes (mm on paper) of what has a name."""
    result: dict[str, list] = {}
    for item in flat_items(sheet.items):
        if getattr(item, "name", ""):
            result.setdefault(item.name, []).extend(item.paths)
    return {name: bounding_box(paths) for name, paths in result.items()}


def words(sheet: Sheet) -> str:
    return " ".join(item.text for item in flat_items(sheet.items) if isinstance(item, Label))


def in_jaw(**changes):
    layout = handmade.jaw_sensor()
    jaw = replace(layout.spec.jaw, **changes)
    return replace(layout, spec=replace(layout.spec, mount=replace(layout.spec.mount, jaw=jaw)))


def test_jaw_section_is_drawn_to_scale_about_port_circle():
    layout = in_jaw()
    at, pair, jaw = shapes(jaw_sheet(layout)), closed_section(layout), layout.spec.jaw
    port = at["jaw-port"]
    scale = (port[2] - port[0]) / jaw.port_diameter
    lower, upper = at["jaw-section-jaw"], at["jaw-section-opposing-jaw"]
    assert upper[3] - lower[1] == approx(pair.height * scale, rel=1e-6)
    assert (upper[3] + lower[1]) / 2 == approx((port[1] + port[3]) / 2, rel=1e-6)
    assert upper[3] - upper[1] == approx(jaw.height * scale, rel=1e-6), "the back is mirrored, not turned inside out"
    board, target = at["jaw-section-board"], at["jaw-section-target"]
    assert board[2] - board[0] == approx(layout.body_size[1] * scale, rel=1e-6)
    assert target[3] - target[1] == approx(layout.spec.target.thickness * scale, rel=1e-6)
    assert upper[1] >= target[3] > board[3] > lower[3]


def test_opened_jaws_are_drawn_at_their_angle():
    layout = in_jaw(hinge=8e-3, opening=math.radians(60.0))
    sheet, closes = jaw_sheet(layout), closing_motion(layout)
    assert "open by 60 deg" in words(sheet) and f"{closes.most * 1e3:.3g} mm between the faces" in words(sheet)
    (sides,) = [item for item in sheet.items if isinstance(item, Group) and item.name == "jaw-sides"]
    boxes = [bounding_box(item.paths) for item in flat_items(sides.items) if getattr(item, "fill", None) == "#a8adb5"]
    closed, opened = boxes
    assert opened[3] - opened[1] > 2 * (closed[3] - closed[1]), "the opened jaw is tilted"
    assert opened[1] < 112.0 - 5.0, "and its tip goes down"


def test_never_parallel_jaws_are_drawn_tilted():
    """They were, above the words that they never are."""
    layout = in_jaw(hinge=8e-3, opening=math.radians(60.0), port_diameter=closed_section(in_jaw()).height - 1e-3)
    sheet, closes = jaw_sheet(layout), closing_motion(layout)
    assert closes.parallel_at < 0.0 and "too thick for the faces ever to be parallel" in words(sheet)
    assert "closed until the sensor touches at the heel" in words(sheet)
    (sides,) = [item for item in sheet.items if isinstance(item, Group) and item.name == "jaw-sides"]
    closed = next(item for item in flat_items(sides.items) if getattr(item, "fill", None) == "#a8adb5")
    corners = [segment.start for path in closed.paths for segment in path.segments]
    assert min(abs(a.y - b.y) for a, b in pairwise(corners)) > 0.1, "no side of it lies level"


def test_jaw_without_stated_hinge_is_not_drawn_open():
    text = words(jaw_sheet(in_jaw(hinge=None, opening=None)))
    assert "mount.jaw.hinge" in text and "open by" not in text


@pytest.mark.parametrize("sizes", [{"length": 10e-3}, {"length": 6e-3, "port_diameter": 12e-3}])
def test_short_jaw_without_hinge_is_drawn_inside_frame(sizes):
    sheet = jaw_sheet(in_jaw(hinge=None, opening=None, **sizes))
    assert_legible(replace(sheet, items=list(flat_items(sheet.items))))
    assert all(item.at.y < 200.0 for item in flat_items(sheet.items) if isinstance(item, Label))


def test_pockets_of_both_jaws_are_drawn_to_scale():
    plain = jaw_sheet(in_jaw(opposing_pad_thickness=0.3e-3))
    sunk = jaw_sheet(
        in_jaw(
            opposing_pad_thickness=0.3e-3, opposing_recess=0.2e-3, opposing_pocket=(14e-3, 2e-3),
            recess=0.3e-3, pocket=(16e-3, 3e-3),
        )
    )
    was, here = shapes(plain), shapes(sunk)
    scale = (here["jaw-port"][2] - here["jaw-port"][0]) / 5e-3
    assert here["jaw-section-opposing-pad"][2] - here["jaw-section-opposing-pad"][0] == approx(1.8e-3 * scale, rel=1e-6)
    pad, jaw = here["jaw-section-opposing-pad"], here["jaw-section-opposing-jaw"]
    assert pad[3] - jaw[1] == approx(0.2e-3 * scale, rel=1e-6), "the rims reach down beside the pad"
    assert here["jaw-section-jaw"][3] - was["jaw-section-jaw"][3] == approx(0.3e-3 * scale, rel=1e-6)


def test_side_view_shows_film_around_pad_and_target():
    sheet = jaw_sheet(in_jaw())
    (sides,) = [item for item in sheet.items if isinstance(item, Group) and item.name == "jaw-sides"]
    fills = [getattr(item, "fill", None) for item in flat_items(sides.items)]
    assert "#9fc5e8" in fills


def test_sensor_without_jaw_has_no_drawing_and_forced_one_is_stamped():
    bench = handmade.layout("bench")
    assert jaw_sheet(bench) is None and render(bench, "") == {}
    made = render(in_jaw(), "forced")
    assert sorted(made) == ["mount/hand-made-jaw-drawing.pdf", "mount/hand-made-jaw-drawing.svg"]
    assert all(b"IN SPITE OF ERRORS" in content for content in made.values())
    assert render(in_jaw(), "") == render(in_jaw(), "")


@pytest.mark.parametrize("name", [name for name in templates.names() if "jaw" in name or "grasper" in name])
def test_every_template_with_jaw_has_legible_drawing(name):
    layout = sitscad.lay_out(sitscad.load_text(templates.read(name)))
    sheet = jaw_sheet(layout)
    assert sheet is not None
    assert_legible(replace(sheet, items=list(flat_items(sheet.items))))
    assert f"{closed_section(layout).height * 1e3:.3f}"[:4] in words(sheet)


def test_side_view_shows_tail_lowered_to_face_and_pivot():
    """The views had it level at the body's height, and past the pin it runs 0.8 mm lower."""
    layout = sitscad.lay_out(sitscad.load_text(templates.read("grasper_4layer")))
    way = tail_path(layout)
    tails = [i for i in flat_items(jaw_sheet(layout).items) if getattr(i, "name", "") == "jaw-side-tail"]
    closed, opened = (bounding_box(tail.paths) for tail in tails)
    jaw, scale = layout.spec.jaw, 2.0
    pivot = layout.spec.mount.jaw.hinge + jaw_range(layout.body, jaw)[1]
    assert closed[2] - closed[0] == approx(scale * 1e3 * (pivot - layout.body[2]), abs=0.2)
    assert closed[3] - closed[1] == approx(scale * 1e3 * (way.start.z - way.at(way.length).z), abs=1e-3)
    assert opened[3] - opened[1] > closed[3] - closed[1]
