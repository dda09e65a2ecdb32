"""The closed pair's envelope measured on meshes: what `closed_section` says of the spec's figures alone."""

from __future__ import annotations

import numpy as np

from sitscad.assembly.places.bodies import BodyRole
from sitscad.assembly.solids.pieces import assemble, opposing_jaw
from sitscad.assembly.solids.solid import Solid, manifold, tessellate
from sitscad.layout.board import Layout


def closed_pair(layout: Layout) -> tuple[Solid, ...]:
    """The sensor in its jaw and the opposing jaw closed on it without force; empty without a jaw in the spec."""
    other = opposing_jaw(layout)
    return (*assemble(layout), *other) if other else ()


def envelope_radius(solids: tuple[Solid, ...], within: tuple[float, float] | None = None) -> float:
    """Radius (m) of the smallest circle about the closed pair's axis, in the y-z plane, that holds the solids.

    Takes what `closed_pair` returns: the axis lies half way between the backs of jaw and
    opposing jaw. Only what lies between the jaws' tip and heel counts (or `within`, a range of x in metres): the tail
    leaves the port inside the shaft. Raises ValueError without both jaws.
    """
    bodies = {solid: manifold(tessellate(solid)) for solid in solids}
    jaws = [bodies[s].bounding_box() for s in solids if s.role in (BodyRole.JAW, BodyRole.OPPOSING_JAW)]
    if len(jaws) != 2:
        raise ValueError("the envelope needs a jaw and its opposing jaw: pass closed_pair(layout)")
    x0, x1 = (x * 1e3 for x in within) if within else (min(b[0] for b in jaws), max(b[3] for b in jaws))
    y = (jaws[0][1] + jaws[0][4]) / 2
    z = (min(b[2] for b in jaws) + max(b[5] for b in jaws)) / 2
    radius = 0.0
    for body in bodies.values():
        part = body.trim_by_plane((1.0, 0.0, 0.0), x0).trim_by_plane((-1.0, 0.0, 0.0), -x1)
        points = np.asarray(part.to_mesh64().vert_properties)
        if len(points):
            radius = max(radius, float(np.hypot(points[:, 1] - y, points[:, 2] - z).max()))
    return radius * 1e-3
