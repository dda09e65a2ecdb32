"""The assembly's picture: well-formed, to scale, small and repeatable."""

from __future__ import annotations

import re
from functools import cache
from xml.etree import ElementTree

import handmade
import pytest
from tolerance import approx

from sitscad.assembly import solids as parts
from sitscad.assembly.places.bodies import BodyRole
from sitscad.assembly.solids.solid import Solid, one_solid, prism
from sitscad.files.drawing.pictures.rendered import assembly_svg, draw_exploded
from sitscad.files.drawing.sheet import Shape, Sheet, flat_items
from sitscad.kernels.geometry.path import enclosed_area, rectangle

pytestmark = pytest.mark.cad
SVG = "{http://www.w3.org/2000/svg}"


@cache
def picture(sensor: str) -> str:
    return assembly_svg(handmade.solids(sensor), handmade.layout(sensor).spec)


def port(root: ElementTree.Element) -> tuple[float, float]:
    """The height of the port's centre and its radius, in the section's own coordinates."""
    (path,) = [element for element in root.iter(f"{SVG}path") if element.get("id") == "section-port"]
    _, y, radius, *_ = (float(n) for n in re.findall(r"-?\d+\.?\d*", path.get("d")))
    return y, radius


def extent(path: str) -> tuple[float, float, float, float]:
    numbers = [float(n) for n in re.findall(r"-?\d+\.?\d*", path)]
    return min(numbers[::2]), min(numbers[1::2]), max(numbers[::2]), max(numbers[1::2])


@pytest.mark.more
@pytest.mark.slow
@pytest.mark.parametrize("sensor", handmade.SENSORS)
def test_assembly_picture_contains_every_solid_and_is_small(sensor):
    text = picture(sensor)
    ids = {element.get("id") for element in ElementTree.fromstring(text).iter()}
    cut_away = {"stiffener"} if sensor != "bare" else set()
    for solid in handmade.solids(sensor):
        assert f"exploded-{solid.name}" in ids or solid.name in cut_away, solid.name
    assert len(text) < 150_000
    assert "nan" not in text and "inf" not in text


@pytest.mark.slow
def test_assembly_section_is_to_scale():
    root = ElementTree.fromstring(picture("jaw"))
    paths = {element.get("id"): element.get("d") for element in root.iter(f"{SVG}path") if element.get("id")}
    centre, radius = port(root)
    scale = radius / 2.5
    board = extent(paths["section-board"])
    assert (board[2] - board[0]) / scale == approx(4.4, abs=0.01)
    assert (board[3] - board[1]) / scale == approx(0.2, abs=0.01)
    target = extent(paths["section-target"])
    assert (board[1] - target[3]) / scale == approx(1.0, abs=0.01)
    jaws = [extent(paths[name]) for name in ("section-opposing-jaw", "section-jaw")]
    assert centre == approx((jaws[0][1] + jaws[1][3]) / 2, abs=0.1)


@pytest.mark.slow
def test_section_of_jaws_larger_than_port_is_not_cropped():
    layout = handmade.jaw_sensor(mount=handmade.Mount("grasper-pad", handmade.jaw(height=2e-3), 1e-3))
    root = ElementTree.fromstring(assembly_svg(parts.solids(layout), layout.spec))
    paths = {element.get("id"): element.get("d") for element in root.iter(f"{SVG}path") if element.get("id")}
    top, bottom = extent(paths["section-opposing-jaw"])[1], extent(paths["section-jaw"])[3]
    (group,) = [element for element in root.iter(f"{SVG}g") if element.get("id") == "section"]
    down = float(re.findall(r"-?\d+\.?\d*", group.get("transform"))[1])
    centre, radius = port(root)
    assert top + down >= 0.0 and top < centre - radius
    assert bottom > centre + radius


@pytest.mark.slow
def test_assembly_section_labels_parts_and_port():
    text = picture("jaw")
    assert "target: copper, 0.2 mm" in text
    assert "encapsulation: pdms, 0.1 mm" in text
    assert "dashed: 5 mm port, jaws closed" in text
    assert "port" not in picture("bench")


@pytest.mark.slow
def test_assembly_picture_is_repeatable():
    assert picture("jaw") == picture.__wrapped__("jaw")


@pytest.mark.slow
def test_hidden_faces_of_a_solid_are_not_drawn():
    """A hollow block with a recess in its upper face: the walls of a cap's bore shone through its top."""
    outer = prism(rectangle(-8e-3, -8e-3, 8e-3, 8e-3), -10e-3, 0.0)
    bored = one_solid(outer - prism(rectangle(-6e-3, -6e-3, 6e-3, 6e-3), -9e-3, -1e-3), "cap")
    sunk = one_solid(bored - prism(rectangle(-3e-3, -3e-3, 9e-3, 3e-3), -0.2e-3, 1e-3), "cap")
    solids = [Solid("mount", shape, "printed resin", "#dfe6e9", BodyRole.MOUNT) for shape in (outer, sunk)]
    whole, hollow = (painted(solid) for solid in solids)
    assert hollow == approx(whole, rel=0.01)


def painted(solid: Solid) -> float:
    """The area of the sheet that is painted where a solid is drawn alone: faces that hide others count twice."""
    sheet = Sheet("", unit="")
    draw_exploded(sheet, (solid,), 300.0, 300.0)
    shapes = (shape for shape in flat_items(sheet.items) if isinstance(shape, Shape) and shape.fill)
    return sum(abs(sum(enclosed_area(path) for path in shape.paths)) for shape in shapes)
