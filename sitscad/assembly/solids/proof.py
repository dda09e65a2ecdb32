"""The proof that it fits and can be made, on the solids themselves: what the plane tier says of figures, measured on
meshes of the pieces as they are glued together, closed, opened about their hinge, and with the pad under its load. The
two know nothing of each other but the spec: `sitscad.assembly.places.fit` adds figures up, this measures triangles.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sitscad.assembly.places.bodies import BodyRole, target_gap
from sitscad.assembly.places.column import print_limit
from sitscad.assembly.places.fit import closed_section, hinge_pivot
from sitscad.assembly.places.jaws import axis, jaw_range
from sitscad.assembly.places.state import Pose
from sitscad.assembly.solids.solid import CHORD, MM, Clearance, Solid, box_gap, manifold, overlaps, require, tessellate
from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.layout.board import Layout
from sitscad.spec.mount import Jaw, Mount
from sitscad.spec.sensor import SensorSpec

TIP_STEP = 0.5e-3  # How far (m) the other jaw's tip goes between two positions that it is tried in
SEARCH = 2.0  # Gaps (mm) are looked for up to here: what is farther apart is said to be this far
SLIVER = 1e-12
"""Volumes (m3) below this are where two chord meshes of one touching round face overlap: 10 um by 0.3 mm by 0.3 mm."""

INTERFERENCE, PORT, OPENING, TRAVEL, BULGE = "interference", "port", "opening", "travel", "bulge"
SUPPORT, NO_SUPPORT, BEND = "support", "no support", "bend"  # What is measured

GROUPS = {BodyRole.BOARD: "board", BodyRole.COPPER: "board", BodyRole.STIFFENER: "board", BodyRole.GLUE: "glue"}
"""Pieces that gaps are told of together; all others go by their names."""


@record
class Measured:
    """One measurement of the solids: which of the kinds above, of which pieces, the value and its limit (m, or m3 of
    shared volume) and whether it is kept; ``where`` is the place (m) that decides it, ``when`` the angle, the load or
    the place in words, ``angle`` how far (rad) the jaws are open then. ``key`` is the spec's key that says otherwise,
    empty if the kind alone decides it.
    """

    what: str
    first: str
    second: str
    value: float
    limit: float
    unit: str
    is_kept: bool
    where: tuple[float, float, float]
    when: str = ""
    angle: float = 0.0
    key: str = ""


@record
class Proof:
    """What was measured of the closed pair as it is glued: the radius (m) of the circle about its axis that holds it,
    by meshes and by the plane tier, the port's; all measurements; the least gap (m) of every two pieces or groups of
    pieces; how far (rad) the jaws were opened (None: the hinge is not known).
    """

    radius: float
    plane_radius: float
    port_radius: float
    measured: tuple[Measured, ...]
    clearances: tuple[Clearance, ...]
    opened: float | None

    @property
    def faults(self) -> tuple[Measured, ...]:
        """What is not kept."""
        return tuple(each for each in self.measured if not each.is_kept)

    @property
    def fits(self) -> bool:
        """Whether the pair passes its port, within the meshes' chord error, and nothing stands in anything."""
        return not self.faults


@record(eq=False)
class Meshed:
    """A solid and its mesh as a manifold (mm)."""

    solid: Solid
    body: Any

    @property
    def group(self) -> str:
        """What its gaps are told of."""
        return GROUPS.get(self.solid.role, self.solid.name)


def prove(layout: Layout, whole: tuple[Solid, ...], loads: tuple[PadLoad, ...] = ()) -> Proof | None:
    """Measure the solids of `sitscad.assembly.solids.whole.whole`; None without a jaw. Raises `MissingExtra`,
    `PartsError`.
    """
    jaw, plane = layout.spec.jaw, closed_section(layout)
    if jaw is None or plane is None:
        return None
    meshed = tuple(Meshed(solid, manifold(tessellate(solid))) for solid in whole)
    opened = jaw.opening if jaw.hinge is not None else None
    port = _in_port(layout.body, layout.spec.jaw, meshed, jaw.port_diameter / 2)
    found = [*_interferences(meshed), port]
    if opened is not None:
        found += _while_opening(layout, meshed, opened)
    for load in loads:
        found += _under_load(layout.spec, meshed, load)
    return Proof(port.value, plane.radius, jaw.port_diameter / 2, tuple(found), _gaps(meshed), opened)


def _interferences(meshed: Sequence[Meshed]) -> list[Measured]:
    """Every two pieces that share a volume, of the board's films the one that shares most; if there are none, one
    measurement that says so.
    """
    group = {each.solid.name: each.group for each in meshed}
    worst: dict[tuple[str, str], Measured] = {}
    for one, other, shared, volume in overlaps([(each.solid, each.body) for each in meshed]):
        key = group[one.name], group[other.name]
        if key not in worst or volume > worst[key].value:
            worst[key] = Measured(INTERFERENCE, one.name, other.name, volume, 0.0, "m3", False, _middle(shared))
    return list(worst.values()) or [Measured(INTERFERENCE, "all pieces", "", 0.0, 0.0, "m3", True, (0.0, 0.0, 0.0))]


def in_file(mount: Mount | None, whole: tuple[Solid, ...]) -> tuple[Measured, ...]:
    """The interferences with a mount or a jaw that only a STEP file describes; empty for all others.

    The opposing jaw is left out. It is the mirror image of the file, and nothing tells where the file's shank begins.
    """
    if mount is None or mount.step is None:
        return ()
    pieces = [solid for solid in whole if solid.role is not BodyRole.OPPOSING_JAW]
    return tuple(_interferences([Meshed(solid, manifold(tessellate(solid))) for solid in pieces]))


def _in_port(
    body: tuple[float, float, float, float], jaw: Jaw | None, meshed: tuple[Meshed, ...], radius: float
) -> Measured:
    """How far anything between tip and heel reaches from the closed pair's axis, the port swept along it."""
    assert jaw is not None
    x0, x1 = (x * MM for x in jaw_range(body, jaw))
    jaws = [between(m.body, x0, x1).bounding_box() for m in meshed
            if m.solid.role in (BodyRole.JAW, BodyRole.OPPOSING_JAW)]
    y, z = axis(body).y * MM, (min(b[2] for b in jaws) + max(b[5] for b in jaws)) / 2
    reaches = []
    for each in meshed:
        part = between(each.body, x0, x1)
        points = np.asarray(part.to_mesh64().vert_properties)
        if len(points):
            reach = np.hypot(points[:, 1] - y, points[:, 2] - z)
            worst = int(reach.argmax())
            at = tuple(float(value) / MM for value in points[worst, :3])
            reaches.append((float(reach[worst]) / MM, each.solid.name, at))
    value, name, where = max(reaches)
    is_kept = value <= radius + CHORD / MM
    return Measured(PORT, name, "port", value, radius, "m", is_kept, (where[0], where[1], where[2]))


def _while_opening(layout: Layout, meshed: tuple[Meshed, ...], opening: float) -> list[Measured]:
    """What the other jaw, turned about the hinge up to `opening` (rad) against this one, runs into: in steps of
    `TIP_STEP` at its tip, so that nothing thicker can lie between two of them.
    """
    moving = [m for m in meshed if m.solid.role in (BodyRole.OPPOSING_JAW, BodyRole.OPPOSING_PAD)]
    still = [m for m in meshed if m not in moving]
    # From the pivot to the jaw's tip (m)
    jaw = layout.spec.jaw
    assert jaw is not None and jaw.hinge is not None
    steps = max(1, math.ceil(opening * (jaw.length + jaw.hinge) / TIP_STEP))
    worst: dict[tuple[str, str], Measured] = {}
    for step in range(1, steps + 1):
        angle = opening * step / steps
        for one in moving:
            there = turned(layout, one.body, angle)
            when = f"open by {math.degrees(angle):.3g} deg"
            for other in (other for other in still if box_gap(there, other.body) < 0.0):
                shared, key, names = there ^ other.body, (other.group, one.group), (other.solid.name, one.solid.name)
                volume = float(shared.volume()) * 1e-9  # that both take
                if volume > SLIVER and (key not in worst or volume > worst[key].value):
                    worst[key] = Measured(OPENING, *names, volume, 0.0, "m3", False, _middle(shared), when, angle)
    if worst:
        return [worst[key] for key in sorted(worst)]
    when = f"in {steps} steps to {math.degrees(opening):.3g} deg"
    return [Measured(OPENING, "all pieces", "opposing-jaw", 0.0, 0.0, "m3", True, (0.0, 0.0, 0.0), when)]


def _under_load(spec: SensorSpec, meshed: tuple[Meshed, ...], load: PadLoad) -> list[Measured]:
    """The gap that is left to what does not give way: of the loaded target, of the pad with its sides bulged, and of
    the other jaw, which comes down with the target where nothing is grasped.
    """
    rigid = [m for m in meshed if m.solid.role in (BodyRole.JAW, BodyRole.MOUNT, BodyRole.SHIELD)]
    found = []
    for each in meshed:
        if each.solid.role is BodyRole.TARGET:
            moved = posed(spec, each.body, load.pose)
            found.append(_nearest(TRAVEL, each.solid.name, moved, rigid, load.name))
        if each.solid.role is BodyRole.ELASTOMER:
            found.append(_nearest(BULGE, each.solid.name, bulged(each.body, load), rigid, load.name))
        if each.solid.role in (BodyRole.OPPOSING_JAW, BodyRole.OPPOSING_PAD):
            closer = each.body.translate((0.0, 0.0, load.pose.z * MM))
            found.append(_nearest(TRAVEL, each.solid.name, closer, rigid, load.name))
    return [each for each in found if each is not None]


def _nearest(what: str, name: str, moved: Any, rigid: list[Meshed], when: str) -> Measured | None:
    """The least gap between a moved piece and rigid ones; None where there are none."""
    gaps = [(float(moved.min_gap(other.body, SEARCH)) / MM, other) for other in rigid]
    if not gaps:
        return None
    gap, other = min(gaps, key=lambda entry: (entry[0], entry[1].solid.name))
    return Measured(what, name, other.solid.name, gap, 0.0, "m", gap > 0.0, _middle(moved), when)


def _gaps(meshed: tuple[Meshed, ...]) -> tuple[Clearance, ...]:
    """The least gap of every two groups of pieces, glue left out."""
    groups: dict[str, list[Any]] = {}
    for each in meshed:
        if each.group != GROUPS[BodyRole.GLUE]:
            groups.setdefault(each.group, []).append(each.body)
    return tuple(Clearance(one, other, _gap(own, beside) / MM)
                 for (one, own), (other, beside) in combinations(groups.items(), 2))


def _gap(some: list[Any], others: list[Any]) -> float:
    """The least gap (mm) of two groups of meshes, `SEARCH` at most; only of those whose boxes are nearer than it."""
    pairs = [(box_gap(one, other), k, one, other) for k, (one, other) in enumerate(product(some, others))]
    least = SEARCH
    for apart, _, one, other in sorted(pairs):
        if apart >= least:
            break
        least = min(least, float(one.min_gap(other, least)))
    return least


def _middle(body: Any) -> tuple[float, float, float]:
    """The middle (m) of a mesh's box, to a micrometre."""
    x0, y0, z0, x1, y1, z1 = body.bounding_box()
    x, y, z = (round((low + high) / 2 / MM, 6) + 0.0 for low, high in ((x0, x1), (y0, y1), (z0, z1)))
    return x, y, z


@record
class PadLoad:
    """The pad under forces that it has to bear: in words, where the target is, how far its sides bulge (m)."""

    name: str
    pose: Pose
    bulge: float


def between(body: Any, x0: float, x1: float) -> Any:
    """What of a mesh lies between two places along the jaw (mm)."""
    return body.trim_by_plane((1.0, 0.0, 0.0), x0).trim_by_plane((-1.0, 0.0, 0.0), -x1)


def turned(layout: Layout, body: Any, angle: float) -> Any:
    """A mesh (mm) turned about the hinge's pivot by an angle (rad), so that its tip goes up."""
    pivot = hinge_pivot(layout)
    assert pivot is not None
    x, y, z = pivot.x * MM, axis(layout.body).y * MM, pivot.y * MM
    return body.translate((-x, -y, -z)).rotate((0.0, math.degrees(angle), 0.0)).translate((x, y, z))


def posed(spec: SensorSpec, body: Any, pose: Pose) -> Any:
    """A mesh (mm) moved as the target is: turned about its near face's centre, then displaced."""
    bounds = body.bounding_box()
    gap = target_gap(spec)
    assert gap is not None
    centre = np.array([(bounds[0] + bounds[3]) / 2, (bounds[1] + bounds[4]) / 2, gap * MM])
    turn = np.array(pose.rotation)
    shift = centre - turn @ centre + np.array([pose.x, pose.y, pose.z]) * MM
    return body.transform(np.column_stack([turn, shift]))


def bulged(body: Any, load: PadLoad) -> Any:
    """The pad (mm) lower by the press and wider by its bulge, its upper half drawn along with the target."""
    x0, y0, z0, x1, y1, z1 = body.bounding_box()
    grow, m3 = load.bulge * MM, require("manifold3d")
    size = (x1 - x0 + 2 * grow, y1 - y0 + 2 * grow, max(1e-6, z1 - z0 + load.pose.z * MM))
    drawn = (load.pose.x * MM / 2, load.pose.y * MM / 2)
    return m3.Manifold.cube(size).translate((x0 - grow + drawn[0], y0 - grow + drawn[1], z0))


COARSE = (0.05, 0.5)
"""Chord (mm) and turn (rad) of the triangles that walls are measured on: they are flat, or nearly."""

FACING = 0.9  # Cosine between two faces from which on they are the two sides of one wall
SUPPORTED = math.cos(math.radians(45.0))  # Faces that look down more steeply than this want support: 45 degrees
GRAIN = 2e-6  # What is thinner than a limit by less than this (m) is not

BEDS: dict[str, tuple[int, float]] = {
    f"{sign}{axis}": (i, s) for i, axis in enumerate("xyz") for sign, s in (("-", -1.0), ("+", 1.0))
}
"""Directions that a piece may lie on the bed with: axis and sign of the outward normal there."""


@record
class Unprintable:
    """Something of a piece that its process does not make: what, its size and the least (m; m3 of hollows)."""

    what: str
    measured: float
    limit: float
    fix: str


@record
class Printable:
    """A piece as it is made: its size (m), the volume of its material (m3), its thinnest wall and smallest hole (m;
    None where it has none), which of its sides lies on the bed, and the area (m2) that then wants support.
    """

    name: str
    size: tuple[float, float, float]
    volume: float
    wall: float | None
    hole: float | None
    bed: str
    unsupported: float
    faults: tuple[Unprintable, ...]


def printable(solid: Solid, process: str) -> Printable:
    """What is measured of one piece, and what a process (``resin``, ``powder``, ...) does not make of it."""
    mesh = tessellate(solid, *COARSE)
    corners = mesh.vertices[mesh.triangles]
    # Outward unit normals (n, 3) of triangles (n, 3, 3)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.asarray(cross / np.maximum(np.linalg.norm(cross, axis=1, keepdims=True), 1e-300))
    # The diameter (m) of the smallest round hole; None without one
    tools = require("OCP.BRepTools").BRepTools
    found = []
    for face in solid.shape.faces():
        if face.geom_type.name == "CYLINDER":
            u0, u1, _, _ = tools.UVBounds_s(face.wrapped)
            if u1 - u0 > 1.9 * math.pi and _opens_inwards(face):
                found.append(2e-3 * float(face.radius))
    # The shortest way (m) through the piece between two faces that look away from each other
    middles = corners.mean(axis=1) - 1e-6 * normals
    best, low, high = math.inf, corners.min(axis=1), corners.max(axis=1)
    order = np.lexsort((middles[:, 2], *(np.floor(middles[:, k] / CELL) for k in (1, 0))))
    for start in range(0, len(order), CHUNK):
        chosen = order[start : start + CHUNK]
        # what is farther from all these rays than the shortest way so far makes none that is shorter
        reach = best + 1e-3
        ahead, behind = middles[chosen].max(axis=0) + reach, middles[chosen].min(axis=0) - reach
        near = np.flatnonzero(np.all((low <= ahead) & (high >= behind), axis=1))
        distance, hit = _first_hits(middles[chosen], -normals[chosen], corners[near])
        faces = np.einsum("ij,ij->i", normals[chosen], normals[near[hit]])
        through = distance[faces < -FACING]
        best = min(best, float(through.min(initial=math.inf)))
    wall, hole = (best * 1e-3 if math.isfinite(best) else None), min(found, default=None)
    # The volume (m3) of hollows that nothing leads out of
    shells, hollow = solid.shape.shells(), 0.0
    if len(shells) > 1:
        volumes = [abs(float(require("build123d").Solid(shell).volume)) for shell in shells]
        hollow = 1e-9 * (sum(volumes) - max(volumes))
    bed, unsupported = _bed(corners, normals)
    x, y, z = (mesh.vertices.max(axis=0) - mesh.vertices.min(axis=0)) * 1e-3
    size = float(x), float(y), float(z)
    # What the process cannot make of walls (m), holes (m) and trapped volume (m3)
    faults = []
    for what, measured, fix in (
        ("wall", wall, "a larger standoff, a thicker piece, or another mount.process"),
        ("hole", hole, "drill it after printing, or another mount.process"),
    ):
        limit = print_limit(process, what).value
        if measured is not None and measured < limit - GRAIN:
            faults.append(Unprintable(what, measured, limit, fix))
    if hollow > 0.0:
        fix = "open it by two holes (sitscad/data/print_limits.csv: escape)"
        faults.append(Unprintable("trapped volume", hollow, 0.0, fix))
    return Printable(solid.name, size, solid.volume, wall, hole, bed, unsupported, tuple(faults))


CHUNK = 128  # Rays that are traced at once: each meets every triangle that is near

CELL = 8.0  # Rays are traced by squares of so many millimetres, so that those of a chunk lie near each other


def _first_hits(origins: Array, directions: Array, corners: Array) -> tuple[Array, NDArray[np.int64]]:
    """Distance along each ray to the first triangle, and which that is (Moeller and Trumbore 1997), their triple
    products taken apart so that each is a product of matrices; lengths from about the rays' own places.
    """
    middle = origins.mean(axis=0)
    origins, first = origins - middle, corners[:, 0] - middle
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal, moment = np.cross(one, two), np.cross(origins, directions)
    with np.errstate(divide="ignore", invalid="ignore"):
        determinant = -directions @ normal.T
        inverse = np.where(np.abs(determinant) > 1e-12, 1.0 / determinant, np.nan)
        u = (moment @ two.T - directions @ np.cross(two, first).T) * inverse
        v = (directions @ np.cross(one, first).T - moment @ one.T) * inverse
        t = (origins @ normal.T - np.einsum("nj,nj->n", first, normal)) * inverse
        inside = (u >= -EDGE) & (v >= -EDGE) & (u + v <= 1.0 + EDGE) & (t > 1e-5)
    far = np.where(inside, t, np.inf)
    hit = far.argmin(axis=1)
    return far[np.arange(len(hit)), hit], hit


EDGE = 1e-7  # Part of a triangle beside its edge that counts to it: no ray goes through between two


def _opens_inwards(face: Any) -> bool:
    """Whether a cylinder's outward normal points at its axis: a hole, and no pin."""
    axis = require("OCP.BRepAdaptor").BRepAdaptor_Surface(face.wrapped).Cylinder().Axis()
    at, along = axis.Location(), axis.Direction()
    point, normal = face.position_at(0.5, 0.5), face.normal_at(0.5, 0.5)
    away = np.array([point.X - at.X(), point.Y - at.Y(), point.Z - at.Z()])
    straight = np.array([along.X(), along.Y(), along.Z()])
    away -= straight * float(away @ straight)
    return float(away @ np.array([normal.X, normal.Y, normal.Z])) < 0.0


def _bed(corners: Array, normals: Array) -> tuple[str, float]:
    """The side to lie on: the one that wants least support, of those alike the one with most on the bed."""
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    ranked: list[tuple[float, float, str]] = []
    for name, (upright, sign) in BEDS.items():
        height = sign * corners[:, :, upright]
        on_bed = height.min(axis=1) > height.max() - 1e-3
        down = sign * normals[:, upright] > SUPPORTED
        unsupported = float(areas[down & ~on_bed].sum())
        ranked.append((round(unsupported, 3), -round(float(areas[on_bed & down].sum()), 3), name))
    unsupported, _, name = min(ranked)
    return name, unsupported * 1e-6


def as_json(piece: Printable, process: str) -> dict[str, Any]:
    """One piece as plain values, lengths in metres to a tenth of a micrometre."""
    return {
        "piece": piece.name,
        "process": process,
        "size_m": [_rounded(side) for side in piece.size],
        "volume_m3": round(piece.volume, 14),
        "least_wall_m": None if piece.wall is None else _rounded(piece.wall),
        "least_hole_m": None if piece.hole is None else _rounded(piece.hole),
        "lies_on": piece.bed,
        "unsupported_m2": round(piece.unsupported, 9),
        "faults": [
            {"what": f.what, "measured": _rounded(f.measured), "limit": f.limit, "fix": f.fix} for f in piece.faults
        ],
    }


def _rounded(length: float) -> float:
    return round(length, 7) + 0.0
