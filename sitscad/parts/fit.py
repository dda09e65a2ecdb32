"""Does it fit: clearances between solids, and the closed pair of jaws against its port's circle.

Twice, by independent ways: `closed_section` from the spec's figures alone (no CAD kernel, cheap enough for `check`),
and `envelope_radius`, `clearances` and `interferences` from the meshes of the very solids that are built.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations

import numpy as np

from sitscad.layout.board import Layout
from sitscad.parts.jaw import section
from sitscad.parts.mesh import manifold, tessellate
from sitscad.parts.solid import Solid, SolidRole
from sitscad.record import record
from sitscad.scene.slabs import slabs
from sitscad.scene.stack import FILM_ROUNDING, closed_span, fitted_jaw, half_width, stack
from sitscad.spec.sensor import Jaw

Corner = tuple[str, float, float, float]
"""A part, the distance y from the jaw's middle, the height z, and the rounding radius about that point (m)."""

SEARCH = 20.0  # mm, the distance beyond which two solids simply are far apart


@record
class ClosedSection:
    """The closed pair across its axis: height back to back (m), the axis' height above the board's top face (m),
    the radius (m) of the smallest circle about the axis that holds everything, and which part decides it.
    """

    height: float
    axis: float
    radius: float
    decided_by: str
    port_radius: float

    @property
    def fits(self) -> bool:
        """Whether the pair passes its port, touching allowed."""
        return self.radius <= self.port_radius + 1e-9


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


def closed_section(layout: Layout) -> ClosedSection | None:
    """The closed pair from the spec's figures; None without a jaw.

    Corners and the ends of rounded edges are the only points that can be farthest from the axis.
    """
    jaw, span = fitted_jaw(layout), closed_span(layout)
    if jaw is None or span is None:
        return None
    axis = (span[0] + span[1]) / 2
    corners = (*_jaw_corners(layout, jaw, span), *_sensor_corners(layout))
    radius, part = max((math.hypot(y, z - axis) + r, part) for part, y, z, r in corners)
    return ClosedSection(span[1] - span[0], axis, radius, part, jaw.port_diameter / 2)


def _jaw_corners(layout: Layout, jaw: Jaw, span: tuple[float, float]) -> Iterator[Corner]:
    """Lowest point, side and face edge of both jaws, and the edge of the seat on the lower one."""
    profile = section(jaw)
    for y, depth in ((0.0, jaw.height), (profile.face / 2, profile.side), (profile.face / 2, 0.0)):
        yield "jaw", y, span[0] + jaw.height - depth, 0.0
        yield "opposing jaw", y, span[1] - jaw.height + depth, 0.0
    metal = span[0] + jaw.height
    yield "mount", half_width(layout, metal), metal, 0.0


def _sensor_corners(layout: Layout) -> Iterator[Corner]:
    """Every outer corner of board, shield, pad, target and film."""
    levels, spec, half = stack(layout), layout.spec, layout.body_size[1] / 2
    for z in levels.board:
        yield "board body", half, z, 0.0
    if levels.shield:
        for z in levels.shield:
            yield "shield", half_width(layout, levels.shield[0]), z, 0.0
    if spec.encapsulation:
        yield "encapsulation", half, levels.film, 0.0
    for slab in slabs(spec):
        _, low, _, high = slab.footprint.box
        aside = max(high - levels.axis[1], levels.axis[1] - low)
        yield from _plate_corners(slab.name, aside, slab.heights, levels.film)


def _plate_corners(part: str, y: float, heights: tuple[float, float], film: float) -> Iterator[Corner]:
    """A plate's lower and upper edge, and the film's round it (rounded above, square below)."""
    for z in heights:
        yield part, y, z, 0.0
    if film > 0.0:
        r = FILM_ROUNDING * film
        yield "encapsulation", y + film - r, heights[1] + film - r, r
        yield "encapsulation", y + film, max(0.0, heights[0] - film), 0.0


def envelope_radius(solids: tuple[Solid, ...], within: tuple[float, float] | None = None) -> float:
    """Radius (m) of the smallest circle about the closed pair's axis, in the y-z plane, that holds the solids.

    Takes what `sitscad.parts.assembly.closed_pair` returns: the axis lies half way between the backs of jaw and
    opposing jaw. Only what lies between the jaws' tip and heel counts (or `within`, a range of x in metres): the tail
    leaves the port inside the shaft. Raises ValueError without both jaws.
    """
    bodies = {solid: manifold(tessellate(solid)) for solid in solids}
    jaws = [bodies[s].bounding_box() for s in solids if s.role in (SolidRole.JAW, SolidRole.OPPOSING_JAW)]
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
            volume = _shared_volume(first, second)
            if volume > tolerance:
                found.append(Interference(first.name, second.name, volume))
    return tuple(found)


def _shared_volume(first: Solid, second: Solid) -> float:
    """Exact volume (m3) that two solids share."""
    shared = first.shape & second.shape
    return 1e-9 * sum(float(part.volume) for part in shared.solids()) if shared else 0.0
