"""Meshes of the closed pair where they go: the other jaw about its hinge, the target and the pad under a load."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sitscad.layout.board import Layout
from sitscad.parts.extras import require
from sitscad.parts.prism import MM
from sitscad.record import record
from sitscad.scene.bodies import target_gap
from sitscad.scene.fit import closed_section
from sitscad.scene.jaws import axis, fitted_jaw, jaw_range
from sitscad.scene.state import Pose


@record
class Load:
    """The pad under the forces that the spec asks it to bear: in words, where the target has gone, and how far the
    elastomer's sides bulge (m).
    """

    name: str
    pose: Pose
    bulge: float


def turned(layout: Layout, body: Any, angle: float) -> Any:
    """A mesh (mm) turned about the hinge's pivot by an angle (rad), so that its tip goes up."""
    jaw, plane = fitted_jaw(layout), closed_section(layout)
    assert jaw is not None and jaw.hinge is not None and plane is not None
    x, z = (jaw_range(layout, jaw)[1] + jaw.hinge) * MM, (plane.axis - jaw.pivot_offset) * MM
    y = axis(layout).y * MM
    return body.translate((-x, -y, -z)).rotate((0.0, math.degrees(angle), 0.0)).translate((x, y, z))


def posed(layout: Layout, body: Any, pose: Pose) -> Any:
    """A mesh (mm) moved as the target is: turned about its near face's centre, then displaced."""
    bounds = body.bounding_box()
    gap = target_gap(layout.spec)
    assert gap is not None
    centre = np.array([(bounds[0] + bounds[3]) / 2, (bounds[1] + bounds[4]) / 2, gap * MM])
    turn = np.array(pose.rotation)
    shift = centre - turn @ centre + np.array([pose.x, pose.y, pose.z]) * MM
    return body.transform(np.column_stack([turn, shift]))


def bulged(body: Any, load: Load) -> Any:
    """The pad (mm) lower by the press and wider by its bulge, its upper half drawn along with the target."""
    x0, y0, z0, x1, y1, z1 = body.bounding_box()
    grow, m3 = load.bulge * MM, require("manifold3d")
    size = (x1 - x0 + 2 * grow, y1 - y0 + 2 * grow, max(1e-6, z1 - z0 + load.pose.z * MM))
    drawn = (load.pose.x * MM / 2, load.pose.y * MM / 2)
    return m3.Manifold.cube(size).translate((x0 - grow + drawn[0], y0 - grow + drawn[1], z0))
