"""Does it fit: clearances between solids, and the closed pair of jaws against its port's circle.

From the meshes of the very solids that are built; `sitscad.scene.fit.closed_section` says the same of the spec's
figures alone, by an independent way that needs no CAD kernel.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from sitscad.parts.mesh import manifold, tessellate
from sitscad.parts.solid import Solid
from sitscad.record import record
from sitscad.scene.bodies import BodyRole

SEARCH = 20.0  # mm, the distance beyond which two solids simply are far apart


@record
class Clearance:
    """Two solids and the shortest distance between them (m, 0 where they touch); at most `SEARCH` is looked for."""

    first: str
    second: str
    gap: float


@record
class Interference:
    """Two solids and the volume (m3) that both claim."""

    first: str
    second: str
    volume: float


def envelope_radius(solids: tuple[Solid, ...], within: tuple[float, float] | None = None) -> float:
    """Radius (m) of the smallest circle about the closed pair's axis, in the y-z plane, that holds the solids.

    Takes what `sitscad.parts.assembly.closed_pair` returns: the axis lies half way between the backs of jaw and
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


def clearances(solids: tuple[Solid, ...]) -> tuple[Clearance, ...]:
    """The shortest distance between every two solids, from their meshes (manifold3d's min_gap)."""
    bodies = [(solid.name, manifold(tessellate(solid))) for solid in solids]
    return tuple(
        Clearance(first, second, float(a.min_gap(b, SEARCH)) * 1e-3)
        for (first, a), (second, b) in combinations(bodies, 2)
    )


def interferences(solids: tuple[Solid, ...], tolerance: float = 1e-15) -> tuple[Interference, ...]:
    """Every two solids that share more than `tolerance` (m3): faces that touch share nothing.

    The meshes find the pairs (manifold3d); since two chord meshes of one touching round face overlap by slivers, what
    they find is then settled on the exact shapes (OpenCASCADE).
    """
    bodies = [(solid, manifold(tessellate(solid))) for solid in solids]
    found = []
    for (first, a), (second, b) in combinations(bodies, 2):
        if float((a ^ b).volume()) * 1e-9 > tolerance:
            volume = shared_volume(first, second)
            if volume > tolerance:
                found.append(Interference(first.name, second.name, volume))
    return tuple(found)


def shared_volume(first: Solid, second: Solid) -> float:
    """Exact volume (m3) that two solids share."""
    shared = first.shape & second.shape
    return 1e-9 * sum(float(part.volume) for part in shared.solids()) if shared else 0.0
