"""Does it fit: clearances between solids, and the closed pair of jaws against its port's circle.

From the meshes of the very solids that are built; `sitscad.scene.fit.closed_section` says the same of the spec's
figures alone, by an independent way that needs no CAD kernel.
"""

from __future__ import annotations

from itertools import combinations

from sitscad.parts.mesh import manifold, tessellate
from sitscad.parts.solid import Solid
from sitscad.record import record

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
