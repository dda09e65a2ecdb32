"""Measurements on the solids, which prove that the sensor fits and can be made.

Meshes of the parts are measured glued together, with jaws closed and opened about their hinge, and with the pad under
load. `sitscad.assembly.places.fit` computes the same from dimensions. The two methods share only the spec.
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
from sitscad.assembly.places.jaws import board_middle, jaw_range
from sitscad.assembly.places.state import Pose, Vector
from sitscad.assembly.solids.solid import (
    CHORD,
    MM,
    Clearance,
    Solid,
    box_gap,
    import_extra,
    manifold,
    overlaps,
    tessellate,
)
from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.kernels.geometry.convex import Box
from sitscad.layout.board import Layout
from sitscad.spec.mount import Jaw, Mount

TIP_STEP = 0.5e-3  # Step (m) of the opposing jaw's tip between two tested positions
"""Distance (m) by which the opposing jaw's tip moves between two tested positions."""
SEARCH = 2.0  # Largest gap (mm) that is measured: larger gaps are reported with this value
"""Largest gap (mm) that is measured. Larger gaps are reported with this value."""
SLIVER = 1e-12
"""Largest volume (m3) that two meshes may share without a fault: 10 um by 0.3 mm by 0.3 mm.

Round faces that touch overlap by such volumes, because their meshes consist of chords.
"""

INTERFERENCE, PORT, OPENING, TRAVEL, BULGE = "interference", "port", "opening", "travel", "bulge"
SUPPORT, NO_SUPPORT, BEND = "support", "no support", "bend"  # Kinds of measurements

GROUPS = {BodyRole.BOARD: "board", BodyRole.COPPER: "board", BodyRole.STIFFENER: "board", BodyRole.GLUE: "glue"}
"""Name under which parts of a role are reported together in the table of gaps. Other parts have their own names."""


@record
class ProofValue:
    """A measurement on the solids.

    `what` is its kind (`INTERFERENCE`, `PORT`, ...), and `first` and `second` are the parts. `value` is compared with
    `limit`, both in `unit` (m, m2 or m3). `is_kept` is True if the limit is met. `where` (m) is the decisive point.
    `condition` is the angle, load or place as text. `angle` (rad) is the opening of the jaws. `key` is the key of the
    spec that contradicts the measurement. It is empty if the kind determines the key.
    """

    what: str
    first: str
    second: str
    value: float
    limit: float
    unit: str
    is_kept: bool
    where: tuple[float, float, float]
    condition: str = ""
    angle: float = 0.0
    key: str = ""


@record
class Proof:
    """Measurements of the closed jaws with the glued sensor.

    `radius` (m) is the radius of the circle about the axis that encloses the meshes. `plane_radius` (m) is this radius
    by `sitscad.assembly.places.fit`, and `port_radius` (m) the port's radius. `measured` are all measurements.
    `clearances` are the smallest gaps (m) between all pairs of groups of parts. `opened` (rad) is the largest opening
    of the jaws. None if the hinge is not known.
    """

    radius: float
    plane_radius: float
    port_radius: float
    measured: tuple[ProofValue, ...]
    clearances: tuple[Clearance, ...]
    opened: float | None

    @property
    def faults(self) -> tuple[ProofValue, ...]:
        """Measurements that do not meet their limits."""
        return tuple(each for each in self.measured if not each.is_kept)

    @property
    def fits(self) -> bool:
        """Whether the closed jaws pass their port, within the meshes' chord error, and no two parts intersect."""
        return not self.faults


@record(eq=False)
class MeshedSolid:
    """A solid and its mesh (mm) as a manifold."""

    solid: Solid
    body: Any

    @property
    def group(self) -> str:
        """Name under which the part's gaps are reported."""
        return GROUPS.get(self.solid.role, self.solid.name)


def measure_solids(layout: Layout, whole: tuple[Solid, ...], loads: tuple[PadLoad, ...] = ()) -> Proof | None:
    """Return the measurements of the solids from `sitscad.assembly.solids.whole.whole`. None if there is no jaw.

    `loads` are the loads for which gaps are measured. Raises `MissingExtra` or `PartsError`.
    """
    jaw, plane = layout.spec.jaw, closed_section(layout)
    if jaw is None or plane is None:
        return None
    meshed = tuple(MeshedSolid(solid, manifold(tessellate(solid))) for solid in whole)
    opened = jaw.opening if jaw.hinge is not None else None
    port = _measure_in_port(layout.body, layout.spec.jaw, meshed, jaw.port_diameter / 2)
    measured = [*_interferences(meshed), port]
    if opened is not None:
        measured += _opening_overlaps(jaw, pivot_of(layout), meshed, opened)
    gap = target_gap(layout.spec)
    for load in loads:
        measured += _gaps_under_load(gap, meshed, load)
    return Proof(port.value, plane.radius, jaw.port_diameter / 2, tuple(measured), _gaps(meshed), opened)


def _interferences(meshed: Sequence[MeshedSolid]) -> list[ProofValue]:
    """Return the volumes that pairs of parts share, as measurements.

    For each pair of groups (`GROUPS`), only the two parts with the largest shared volume are returned. If no parts
    share a volume, a single measurement states this.
    """
    group = {each.solid.name: each.group for each in meshed}
    worst: dict[tuple[str, str], ProofValue] = {}
    for first, second, shared, volume in overlaps([(each.solid, each.body) for each in meshed]):
        key = group[first.name], group[second.name]
        if key not in worst or volume > worst[key].value:
            worst[key] = ProofValue(INTERFERENCE, first.name, second.name, volume, 0.0, "m3", False, _middle(shared))
    return list(worst.values()) or [ProofValue(INTERFERENCE, "all pieces", "", 0.0, 0.0, "m3", True, (0.0, 0.0, 0.0))]


def step_file_overlaps(mount: Mount | None, whole: tuple[Solid, ...]) -> tuple[ProofValue, ...]:
    """Return the volumes that parts share with a mount or jaw from a STEP file. Empty for other mounts.

    The opposing jaw is left out. It is the mirror image of the file, which does not define the start of its shank.
    """
    if mount is None or mount.step is None:
        return ()
    pieces = [solid for solid in whole if solid.role is not BodyRole.OPPOSING_JAW]
    return tuple(_interferences([MeshedSolid(solid, manifold(tessellate(solid))) for solid in pieces]))


def _measure_in_port(body: Box, jaw: Jaw | None, meshed: tuple[MeshedSolid, ...], radius: float ) -> ProofValue:
    """Measure the largest distance (m) of the meshes from the axis of the closed jaws, between tip and heel of the jaw.

    The port is a cylinder about this axis with a radius (m).
    """
    assert jaw is not None
    x0, x1 = (x * MM for x in jaw_range(body, jaw))
    jaws = [part_between(m.body, x0, x1).bounding_box() for m in meshed
            if m.solid.role in (BodyRole.JAW, BodyRole.OPPOSING_JAW)]
    y, z = board_middle(body).y * MM, (min(b[2] for b in jaws) + max(b[5] for b in jaws)) / 2
    reaches = []
    for each in meshed:
        part = part_between(each.body, x0, x1)
        points = np.asarray(part.to_mesh64().vert_properties)
        if len(points):
            reach = np.hypot(points[:, 1] - y, points[:, 2] - z)
            worst = int(reach.argmax())
            at = tuple(float(value) / MM for value in points[worst, :3])
            reaches.append((float(reach[worst]) / MM, each.solid.name, at))
    value, name, where = max(reaches)
    is_kept = value <= radius + CHORD / MM
    return ProofValue(PORT, name, "port", value, radius, "m", is_kept, (where[0], where[1], where[2]))


def _opening_overlaps(jaw: Jaw, pivot: Vector, meshed: tuple[MeshedSolid, ...], opening: float) -> list[ProofValue]:
    """Return the volumes that parts share with the opposing jaw while it opens about the hinge up to `opening` (rad).

    Its tip moves in steps of `TIP_STEP`, so that any part thicker than a step is detected.
    """
    moving = [m for m in meshed if m.solid.role in (BodyRole.OPPOSING_JAW, BodyRole.OPPOSING_PAD)]
    still = [m for m in meshed if m not in moving]
    assert jaw.hinge is not None
    steps = max(1, math.ceil(opening * (jaw.length + jaw.hinge) / TIP_STEP))
    worst: dict[tuple[str, str], ProofValue] = {}
    for step in range(1, steps + 1):
        angle = opening * step / steps
        for moved in moving:
            there = turned_about_pivot(pivot, moved.body, angle)
            when = f"open by {math.degrees(angle):.3g} deg"
            for fixed in (fixed for fixed in still if box_gap(there, fixed.body) < 0.0):
                shared, key = there ^ fixed.body, (fixed.group, moved.group)
                names = fixed.solid.name, moved.solid.name
                volume = float(shared.volume()) * 1e-9  # shared by both
                if volume > SLIVER and (key not in worst or volume > worst[key].value):
                    worst[key] = ProofValue(OPENING, *names, volume, 0.0, "m3", False, _middle(shared), when, angle)
    if worst:
        return [worst[key] for key in sorted(worst)]
    when = f"in {steps} steps to {math.degrees(opening):.3g} deg"
    return [ProofValue(OPENING, "all pieces", "opposing-jaw", 0.0, 0.0, "m3", True, (0.0, 0.0, 0.0), when)]


def _gaps_under_load(gap: float | None, meshed: tuple[MeshedSolid, ...], load: PadLoad) -> list[ProofValue]:
    """Return the gaps between moved parts and rigid parts under load. `gap` (m) is the target's gap at rest.

    Moved parts are the target, the pad with bulged sides, and the opposing jaw, which follows the target if nothing is
    grasped.
    """
    rigid = [m for m in meshed if m.solid.role in (BodyRole.JAW, BodyRole.MOUNT, BodyRole.SHIELD)]
    gaps = []
    for each in meshed:
        if each.solid.role is BodyRole.TARGET:
            moved = moved_with_target(gap, each.body, load.pose)
            gaps.append(_smallest_gap(TRAVEL, each.solid.name, moved, rigid, load.name))
        if each.solid.role is BodyRole.ELASTOMER:
            gaps.append(_smallest_gap(BULGE, each.solid.name, bulged_pad(each.body, load), rigid, load.name))
        if each.solid.role in (BodyRole.OPPOSING_JAW, BodyRole.OPPOSING_PAD):
            closer = each.body.translate((0.0, 0.0, load.pose.z * MM))
            gaps.append(_smallest_gap(TRAVEL, each.solid.name, closer, rigid, load.name))
    return [each for each in gaps if each is not None]


def _smallest_gap(what: str, name: str, moved: Any, rigid: list[MeshedSolid], when: str) -> ProofValue | None:
    """Return the smallest gap between a moved part and the rigid parts. None if there are no rigid parts.

    `what` is the kind of measurement, `name` the moved part, and `when` the load as text.
    """
    gaps = [(float(moved.min_gap(other.body, SEARCH)) / MM, other) for other in rigid]
    if not gaps:
        return None
    gap, other = min(gaps, key=lambda entry: (entry[0], entry[1].solid.name))
    return ProofValue(what, name, other.solid.name, gap, 0.0, "m", gap > 0.0, _middle(moved), when)


def _gaps(meshed: tuple[MeshedSolid, ...]) -> tuple[Clearance, ...]:
    """Return the smallest gap (m) between each pair of groups of parts, without glue."""
    groups: dict[str, list[Any]] = {}
    for each in meshed:
        if each.group != GROUPS[BodyRole.GLUE]:
            groups.setdefault(each.group, []).append(each.body)
    return tuple(Clearance(first, second, _gap(bodies, other_bodies) / MM)
                 for (first, bodies), (second, other_bodies) in combinations(groups.items(), 2))


def _gap(first: list[Any], second: list[Any]) -> float:
    """Return the smallest gap (mm) between two groups of meshes, at most `SEARCH`.

    Only meshes with nearby bounding boxes are compared.
    """
    pairs = [(box_gap(*pair), k, *pair) for k, pair in enumerate(product(first, second))]
    least = SEARCH
    for apart, _, body, neighbour in sorted(pairs):
        if apart >= least:
            break
        least = min(least, float(body.min_gap(neighbour, least)))
    return least


def _middle(body: Any) -> tuple[float, float, float]:
    """Return the middle (m) of a mesh's bounding box, rounded to a micrometre."""
    x0, y0, z0, x1, y1, z1 = body.bounding_box()
    x, y, z = (round((low + high) / 2 / MM, 6) + 0.0 for low, high in ((x0, x1), (y0, y1), (z0, z1)))
    return x, y, z


@record
class PadLoad:
    """The pad under the load `name`.

    `pose` is the pose of the target. `bulge` (m) is the bulge of each side of the pad.
    """

    name: str
    pose: Pose
    bulge: float


def part_between(body: Any, x0: float, x1: float) -> Any:
    """Return the part of a mesh between two x (mm) along the jaw."""
    return body.trim_by_plane((1.0, 0.0, 0.0), x0).trim_by_plane((-1.0, 0.0, 0.0), -x1)


def pivot_of(layout: Layout) -> Vector:
    """Return the position (mm) of the hinge's pivot. The hinge must be known."""
    pivot = hinge_pivot(layout)
    assert pivot is not None
    return pivot.x * MM, board_middle(layout.body).y * MM, pivot.y * MM


def turned_about_pivot(pivot: Vector, body: Any, angle: float) -> Any:
    """Return a mesh (mm) rotated about the hinge's pivot (mm) by an angle (rad). Positive angles move the tip up."""
    x, y, z = pivot
    return body.translate((-x, -y, -z)).rotate((0.0, math.degrees(angle), 0.0)).translate((x, y, z))


def moved_with_target(gap: float | None, body: Any, pose: Pose) -> Any:
    """Return a mesh (mm) moved like the target: rotated about the centre of the target's lower face, then displaced.

    `gap` (m) is the distance from the board to this face at rest.
    """
    bounds = body.bounding_box()
    assert gap is not None, "a load moves a target"
    centre = np.array([(bounds[0] + bounds[3]) / 2, (bounds[1] + bounds[4]) / 2, gap * MM])
    turn = np.array(pose.rotation)
    shift = centre - turn @ centre + np.array([pose.x, pose.y, pose.z]) * MM
    return body.transform(np.column_stack([turn, shift]))


def bulged_pad(body: Any, load: PadLoad) -> Any:
    """Return the pad's mesh (mm) under load: lower, wider by its bulge, and moved by half the target's travel."""
    x0, y0, z0, x1, y1, z1 = body.bounding_box()
    grow, m3 = load.bulge * MM, import_extra("manifold3d")
    size = (x1 - x0 + 2 * grow, y1 - y0 + 2 * grow, max(1e-6, z1 - z0 + load.pose.z * MM))
    shift = (load.pose.x * MM / 2, load.pose.y * MM / 2)
    return m3.Manifold.cube(size).translate((x0 - grow + shift[0], y0 - grow + shift[1], z0))


COARSE = (0.05, 0.5)
"""Largest chord error (mm) and angle (rad) of meshes for wall measurements. Walls are flat, or nearly flat."""

FACING = 0.9  # Cosine between two faces from which on they are the two sides of one wall
"""Cosine of the angle between two faces above which they count as the two sides of one wall."""
SUPPORTED = math.cos(math.radians(45.0))  # Faces that look down more steeply than this want support: 45 degrees
"""Cosine of the steepest overhang that needs no support structure: 45 degrees."""
GRAIN = 2e-6  # Shortfalls below this (m) do not count
"""Size differences (m) below this are ignored."""

BEDS: dict[str, tuple[int, float]] = {
    f"{sign}{axis}": (i, s) for i, axis in enumerate("xyz") for sign, s in (("-", -1.0), ("+", 1.0))
}
"""Sides on which a part may lie on the print bed: axis and sign of the side's outward normal."""


@record
class Unprintable:
    """A feature that the process cannot make.

    `what` is its name. `measured` and `limit` are its size and the limit (m, or m3 for hollows). `fix` is the change
    that helps.
    """

    what: str
    measured: float
    limit: float
    fix: str


@record
class PrintedPiece:
    """Measurements of a manufactured part: size (m), volume of material (m3), thinnest wall and smallest hole (m).

    Wall and hole are None if the part has none. `bed` is the side on the print bed, and `unsupported` the area (m2)
    that then needs support. `faults` are features that the process cannot make.
    """

    name: str
    size: tuple[float, float, float]
    volume: float
    wall: float | None
    hole: float | None
    bed: str
    unsupported: float
    faults: tuple[Unprintable, ...]


def check_print(solid: Solid, process: str) -> PrintedPiece:
    """Return measurements of one part, and the features that a process (``resin``, ``powder``, ...) cannot make."""
    mesh = tessellate(solid, *COARSE)
    corners = mesh.vertices[mesh.triangles]
    # Outward unit normals (n, 3) of triangles (n, 3, 3)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.asarray(cross / np.maximum(np.linalg.norm(cross, axis=1, keepdims=True), 1e-300))
    # The diameter (m) of the smallest round hole; None without one
    tools = import_extra("OCP.BRepTools").BRepTools
    diameters = []
    for face in solid.shape.faces():
        if face.geom_type.name == "CYLINDER":
            u0, u1, _, _ = tools.UVBounds_s(face.wrapped)
            if u1 - u0 > 1.9 * math.pi and _opens_inwards(face):
                diameters.append(2e-3 * float(face.radius))
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
    wall, hole = (best * 1e-3 if math.isfinite(best) else None), min(diameters, default=None)
    # The volume (m3) of hollows that nothing leads out of
    shells, hollow = solid.shape.shells(), 0.0
    if len(shells) > 1:
        volumes = [abs(float(import_extra("build123d").Solid(shell).volume)) for shell in shells]
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
    return PrintedPiece(solid.name, size, solid.volume, wall, hole, bed, unsupported, tuple(faults))


CHUNK = 128  # Rays that are traced at once: each meets every triangle that is near
"""Number of rays that are traced at once. Each ray is compared with all nearby triangles."""

CELL = 8.0  # Rays are traced by squares of so many millimetres, so that those of a chunk lie near each other
"""Side (mm) of the squares by which rays are sorted, so that rays traced at once are close together."""


def _first_hits(origins: Array, directions: Array, corners: Array) -> tuple[Array, NDArray[np.int64]]:
    """Return the distance along each ray to the first triangle, and the triangle's number (Moeller and Trumbore 1997).

    `origins` and `directions` (rays, 3) are the rays, and `corners` (triangles, 3, 3) the triangles. Triple products
    are computed as matrix products. Positions are relative to a point near the rays.
    """
    middle = origins.mean(axis=0)
    origins, first = origins - middle, corners[:, 0] - middle
    first_edge, second_edge = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal, moment = np.cross(first_edge, second_edge), np.cross(origins, directions)
    with np.errstate(divide="ignore", invalid="ignore"):
        determinant = -directions @ normal.T
        inverse = np.where(np.abs(determinant) > 1e-12, 1.0 / determinant, np.nan)
        u = (moment @ second_edge.T - directions @ np.cross(second_edge, first).T) * inverse
        v = (directions @ np.cross(first_edge, first).T - moment @ first_edge.T) * inverse
        t = (origins @ normal.T - np.einsum("nj,nj->n", first, normal)) * inverse
        inside = (u >= -EDGE) & (v >= -EDGE) & (u + v <= 1.0 + EDGE) & (t > 1e-5)
    distances = np.where(inside, t, np.inf)
    hit = distances.argmin(axis=1)
    return distances[np.arange(len(hit)), hit], hit


EDGE = 1e-7  # Part of a triangle beside its edge that counts to it: no ray goes through between two
"""Width of a margin around each triangle, relative to the triangle, in which rays also hit it."""


def _opens_inwards(face: Any) -> bool:
    """Whether the outward normal of a cylinder face points at the cylinder's axis: True for holes, False for pins."""
    axis = import_extra("OCP.BRepAdaptor").BRepAdaptor_Surface(face.wrapped).Cylinder().Axis()
    at, direction = axis.Location(), axis.Direction()
    point, normal = face.position_at(0.5, 0.5), face.normal_at(0.5, 0.5)
    offset = np.array([point.X - at.X(), point.Y - at.Y(), point.Z - at.Z()])
    straight = np.array([direction.X(), direction.Y(), direction.Z()])
    offset -= straight * float(offset @ straight)
    return float(offset @ np.array([normal.X, normal.Y, normal.Z])) < 0.0


def _bed(corners: Array, normals: Array) -> tuple[str, float]:
    """Return the side on the print bed that needs the least support, and the area (m2) that needs support.

    `corners` (triangles, 3, 3; mm) and `normals` (triangles, 3) describe the part's mesh. Among equal sides, it is the
    side with the largest area on the bed.
    """
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


def as_json(piece: PrintedPiece, process: str) -> dict[str, Any]:
    """Return the measurements of a part that `process` makes, as JSON values. Lengths (m) are rounded to 0.1 um."""
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
