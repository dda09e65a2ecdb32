"""Distances and shared volumes of all pairs of solids, from their meshes and exact shapes."""

from __future__ import annotations

from itertools import combinations

from sitscad.assembly.solids import Solid
from sitscad.assembly.solids.solid import SEARCH, Clearance, manifold, overlaps, tessellate


def clearances(solids: tuple[Solid, ...]) -> tuple[Clearance, ...]:
    """The shortest distance between every two solids, from their meshes (manifold3d's min_gap)."""
    bodies = [(solid.name, manifold(tessellate(solid))) for solid in solids]
    return tuple(
        Clearance(first, second, float(a.min_gap(b, SEARCH)) * 1e-3)
        for (first, a), (second, b) in combinations(bodies, 2)
    )


def interferences(solids: tuple[Solid, ...]) -> tuple[tuple[str, str, float], ...]:
    """The names of every two solids that share a volume, and that volume (m3)."""
    result = overlaps([(solid, manifold(tessellate(solid))) for solid in solids])
    return tuple((first.name, second.name, volume) for first, second, _, volume in result)
