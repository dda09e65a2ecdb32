"""One jaw of a grasper as far as its figures go: a flat face for the sensor, and a back as round as the port."""

from __future__ import annotations

from typing import Any

from sitscad.geometry.path import Point, rounded
from sitscad.layout.board import Layout
from sitscad.parts.extras import require
from sitscad.parts.prism import MM, box, one_solid, prism
from sitscad.parts.solid import Solid
from sitscad.scene.bodies import BodyRole, seat_heights, top_height
from sitscad.scene.jaws import axis, fitted_jaw, jaw_range, rim, section
from sitscad.spec.profiles.presets import metal_colour
from sitscad.spec.sensor import Jaw

TIP_ROUNDING = 0.5e-3


def jaw(layout: Layout) -> Solid | None:
    """The jaw's metal, its face at the standoff below the board, centred under the board's body."""
    fitted, seat = fitted_jaw(layout), seat_heights(layout.spec)
    if fitted is None or seat is None:
        return None
    shape = _pocketed(
        layout, fitted, _bar(layout, rim(fitted), seat[0] + (rim(fitted).height - fitted.height)), seat[0]
    )
    return Solid("jaw", shape, fitted.material.name, metal_colour(fitted.material.name), BodyRole.JAW)


def opposing(layout: Layout) -> tuple[Solid, ...]:
    """The other jaw of the closed pair, and its pad where it has one: face down, resting on the sensor's top."""
    fitted = fitted_jaw(layout)
    if fitted is None:
        return ()
    bd = require("build123d")
    pad, top = fitted.opposing_pad_thickness, top_height(layout.spec)
    (x0, x1), y = jaw_range(layout, fitted), axis(layout).y
    mirrored = _bar(layout, fitted, -(top + pad)).mirror(bd.Plane.XY)
    found = [
        Solid("opposing-jaw", mirrored, fitted.material.name, metal_colour(fitted.material.name), BodyRole.OPPOSING_JAW)
    ]
    if pad > 0.0:
        half = section(fitted).face / 2
        sheet = box(x0, y - half, top, x1, y + half, top + pad)
        found.append(Solid("opposing-pad", sheet, "pad", "#5f6b6d", BodyRole.OPPOSING_PAD))
    return tuple(found)


def _pocketed(layout: Layout, fitted: Jaw, bar: Any, floor: float) -> Any:
    """The bar with its pad pocket, as high as the floor (m), and the window through it."""
    (x0, x1), y = jaw_range(layout, fitted), axis(layout).y
    middle, low, high = (x0 + x1) / 2, floor - 2 * fitted.height, floor + fitted.recess + 1e-3
    for size, bottom in ((fitted.pocket if fitted.recess else None, floor), (fitted.fenestration, low)):
        if size is not None:
            along, across = size[0] / 2, size[1] / 2
            block = box(middle - along, y - across, bottom, middle + along, y + across, high)
            bar = one_solid(bar - block, "jaw")
    return bar


def _bar(layout: Layout, fitted: Jaw, height: float) -> Any:
    """The section drawn out along x with the corners of the tip rounded in plan, its face up at a height (m)."""
    bd = require("build123d")
    (x0, x1), y = jaw_range(layout, fitted), axis(layout).y
    upright = prism(section(fitted).outline, 0.0, x1 - x0)
    # the section's x becomes the jaw's y, its y the jaw's z, and the prism's height runs along x
    stand = bd.Location(bd.Plane((x0 * MM, y * MM, height * MM), x_dir=(0, 1, 0), z_dir=(1, 0, 0)))
    return one_solid(upright.moved(stand) & _plan(layout, fitted, height), "jaw")


def _plan(layout: Layout, fitted: Jaw, height: float) -> Any:
    """A block with the jaw's outline seen from above: the two corners of the tip are rounded."""
    (x0, x1), y, half = jaw_range(layout, fitted), axis(layout).y, fitted.width / 2
    cut = min(TIP_ROUNDING, fitted.width / 4)
    corners = [Point(x0, y - half), Point(x1, y - half), Point(x1, y + half), Point(x0, y + half)]
    return prism(rounded(corners, [cut, 0.0, 0.0, cut]), height - 2 * fitted.height, height + fitted.height)
