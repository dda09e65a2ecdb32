"""How much of the board lies on something, measured on the solids of any mount, a STEP file's among them.

`sitscad.scene.support` says the same of the figures alone.
"""

from __future__ import annotations

from typing import Any

from sitscad.geometry.path import Path
from sitscad.layout.board import Layout
from sitscad.parts.extras import require
from sitscad.parts.mesh import manifold, tessellate
from sitscad.parts.prism import MM
from sitscad.parts.proof.prove import NO_SUPPORT, SUPPORT, Measured
from sitscad.parts.solid import Solid
from sitscad.scene.bodies import BodyRole, board_heights
from sitscad.scene.jaws import axis
from sitscad.scene.stack import ground
from sitscad.scene.support import BODY, HALF_OF_IT, MOST_OF_IT, pressed_on

CARRIERS = (BodyRole.JAW, BodyRole.MOUNT, BodyRole.SHIELD)
HOLLOW = 0.1
"""How far (mm) below a carrier's face glue still fills a groove or a dent."""
BELOW = 5e-3
"""How far (mm) below a face it is cut, so that its own plane is not: flat faces are exact, round ones within 5 um."""
CARRIER = "what carries the board"


def carried(layout: Layout, whole: tuple[Solid, ...]) -> tuple[Measured, ...]:
    """The area under what is pressed on, and under the whole body, that has a carrier's face a glue line below the
    board; nothing where the carrier is no solid: without a mount, or on a finger itself.
    """
    mount, solids = layout.spec.mount, [solid for solid in whole if solid.role in CARRIERS]
    if mount is None or not solids or (mount.finger is not None and not mount.standoff):
        return ()
    under = board_heights(layout.spec)[0] * MM
    faces = _under(solids, under - (layout.spec.assembly.glue_line * MM if mount.jaw is not None else 0.0))
    (name, path), middle = pressed_on(layout), axis(layout)
    where = (middle.x, middle.y, under / MM)
    found = [_measured(name, path, faces, where, MOST_OF_IT)]
    if name != BODY:
        found.append(_measured(BODY, ground(layout), faces, where, HALF_OF_IT))
    return tuple(found)


def _measured(name: str, path: Path, faces: Any, where: tuple[float, float, float], share: float) -> Measured:
    """The area (m2) of what lies above the carriers, against the share of it that has to."""
    points = path.flattened(1e-6)[:-1]
    region = require("manifold3d").CrossSection([[(p.x * MM, p.y * MM) for p in points]])
    of, area = (float(each.area()) / MM**2 for each in (region, region ^ faces))
    what = SUPPORT if area >= HALF_OF_IT * of else NO_SUPPORT
    return Measured(what, name, CARRIER, area, share * of, "m2", area >= share * of, where)


def _under(solids: list[Solid], height: float) -> Any:
    """What of the carriers lies below a plane (mm), as a section from above."""
    m3 = require("manifold3d")
    found = m3.CrossSection()
    for solid in solids:
        body = manifold(tessellate(solid))
        for level in (height - BELOW, height - HOLLOW - BELOW):
            found = found + body.slice(level)
    return found
