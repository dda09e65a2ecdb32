"""One jaw of a grasper as far as its figures go: a flat face for the sensor, and a back as round as the port."""

from __future__ import annotations

import math
from typing import Any

from sitscad.geometry.path import Arc, Line, Path, Point, rounded
from sitscad.layout.board import Layout
from sitscad.parts.extras import require
from sitscad.parts.prism import MM, box, one_solid, prism
from sitscad.parts.solid import Solid, SolidRole
from sitscad.record import record
from sitscad.scene.stack import fitted_jaw, stack
from sitscad.spec.profiles.presets import metal_colour
from sitscad.spec.sensor import Jaw

TIP_ROUNDING = 0.5e-3


@record
class JawSection:
    """A jaw across its axis, face up at height 0: width of its face, height, radius of its back (m).

    ``side`` is how far straight sides reach down from the face before the round back begins.
    """

    face: float
    height: float
    radius: float
    side: float

    @property
    def outline(self) -> Path:
        """The closed section, counter-clockwise, y as the path's x and z as its y."""
        half, centre = self.face / 2, Point(0.0, self.radius - self.height)
        back = Arc(Point(-half, -self.side), Point(half, -self.side), centre)
        if self.side <= 0.0:
            return Path((back, Line(back.end, back.start)))
        right, left = Point(half, 0.0), Point(-half, 0.0)
        return Path((back, Line(back.end, right), Line(right, left), Line(left, back.start)))


def section(jaw: Jaw) -> JawSection:
    """The section of a jaw that passes its port on its own: a bar of its width, rounded behind to the port's radius.

    The back is an arc of that radius, its lowest point ``height`` below the face. A flat jaw (one milled down to
    carry a sensor) has no straight sides left, and its face is the chord there, narrower than the jaw's width.
    """
    half, radius, height = jaw.width / 2, jaw.port_diameter / 2, jaw.height
    chord = math.sqrt(max(0.0, height * (2 * radius - height))) if height < radius else radius
    if chord <= half:
        return JawSection(2 * chord, height, radius, max(0.0, height - radius))
    sagitta = radius - math.sqrt(radius**2 - half**2)
    return JawSection(jaw.width, height, radius, height - sagitta)


def jaw(layout: Layout) -> Solid | None:
    """The jaw's metal, its face at the standoff below the board, centred under the board's body."""
    fitted, seat = fitted_jaw(layout), stack(layout).seat
    if fitted is None or seat is None:
        return None
    shape = _bar(layout, fitted, seat[0])
    return Solid("jaw", shape, fitted.material.name, metal_colour(fitted.material.name), SolidRole.JAW)


def opposing(layout: Layout) -> tuple[Solid, ...]:
    """The other jaw of the closed pair, and its pad where it has one: face down, resting on the sensor's top."""
    fitted, levels = fitted_jaw(layout), stack(layout)
    if fitted is None:
        return ()
    bd = require("build123d")
    pad, top = fitted.opposing_pad_thickness, levels.top
    (x0, x1), y = jaw_range(layout, fitted), levels.axis[1]
    mirrored = _bar(layout, fitted, -(top + pad)).mirror(bd.Plane.XY)
    found = [
        Solid(
            "opposing-jaw", mirrored, fitted.material.name, metal_colour(fitted.material.name), SolidRole.OPPOSING_JAW
        )
    ]
    if pad > 0.0:
        half = section(fitted).face / 2
        sheet = box(x0, y - half, top, x1, y + half, top + pad)
        found.append(Solid("opposing-pad", sheet, "pad", "#5f6b6d", SolidRole.OPPOSING_PAD))
    return tuple(found)


def jaw_range(layout: Layout, fitted: Jaw) -> tuple[float, float]:
    """Where the jaw begins (its tip) and ends along x (m): its length, centred under the board's body."""
    middle = stack(layout).axis[0]
    return middle - fitted.length / 2, middle + fitted.length / 2


def _bar(layout: Layout, fitted: Jaw, height: float) -> Any:
    """The section drawn out along x with the corners of the tip rounded in plan, its face up at a height (m)."""
    bd = require("build123d")
    (x0, x1), y = jaw_range(layout, fitted), stack(layout).axis[1]
    upright = prism(section(fitted).outline, 0.0, x1 - x0)
    # the section's x becomes the jaw's y, its y the jaw's z, and the prism's height runs along x
    stand = bd.Location(bd.Plane((x0 * MM, y * MM, height * MM), x_dir=(0, 1, 0), z_dir=(1, 0, 0)))
    return one_solid(upright.moved(stand) & _plan(layout, fitted, height), "jaw")


def _plan(layout: Layout, fitted: Jaw, height: float) -> Any:
    """A block with the jaw's outline seen from above: the two corners of the tip are rounded."""
    (x0, x1), y, half = jaw_range(layout, fitted), stack(layout).axis[1], fitted.width / 2
    cut = min(TIP_ROUNDING, fitted.width / 4)
    corners = [Point(x0, y - half), Point(x1, y - half), Point(x1, y + half), Point(x0, y + half)]
    return prism(rounded(corners, [cut, 0.0, 0.0, cut]), height - 2 * fitted.height, height + fitted.height)
