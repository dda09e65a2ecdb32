"""Pictures of parts that intersect (clashes), and the supported area of the board, from the solids.

A picture shows the parts in their positions, cut open at the clash, and the volume that both occupy. The supported area
is measured for any mount, also from a STEP file. `sitscad.assembly.places.stack` computes it from dimensions alone.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sitscad.assembly.places.bodies import BodyRole, board_heights, plates_of, target_gap
from sitscad.assembly.places.fit import PinGap, closed_section
from sitscad.assembly.places.jaws import board_middle, jaw_range
from sitscad.assembly.places.stack import BODY, LEAST_GLUABLE_SHARE, LEAST_PRESSED_SHARE, pressed_piece, tail_heights
from sitscad.assembly.places.tail_path import ROD, bends
from sitscad.assembly.solids.proof import (
    BEND,
    BULGE,
    INTERFERENCE,
    NO_SUPPORT,
    OPENING,
    PORT,
    SUPPORT,
    TRAVEL,
    PadLoad,
    Proof,
    ProofValue,
    bulged_pad,
    moved_with_target,
    part_between,
    pivot_of,
    turned_about_pivot,
)
from sitscad.assembly.solids.solid import MM, Solid, display_meshes, import_extra, manifold, tessellate
from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.basics.units import show
from sitscad.kernels.geometry.path import Path
from sitscad.layout.board import Layout

RED = "#d00000"
"""Colour of the volume that two clashing parts share, or that is outside the port."""
PIN_COLOUR, BOARD_COLOUR = "#7b8794", "#c07f1f"
BOARD = "board"
BEFORE, BEHIND = 11.0, 4.0  # Drawn length of the tail before and behind the pin (mm)
"""Lengths (mm) of tail in a picture of the hinge's pin: on the side of the body, and beyond the pin."""
MOVING = (BodyRole.OPPOSING_JAW, BodyRole.OPPOSING_PAD)
MOST = 4  # Largest number of drawn clashes per sensor: the worst of each pair
"""Largest number of pictures of clashes for each sensor: the worst of each pair of parts."""
ACROSS, ALONG = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)  # Normals of the cuts: across the jaw, and along it
"""Normal vectors of cutting planes: across the jaw, and along the jaw."""


@record(eq=False)
class ColouredMesh:
    """A closed mesh of a part, for a picture of a clash.

    `vertices` (n, 3) are in mm, and `triangles` (m, 3) are indices of vertices. `clashes` is True if the part is one of
    the clashing parts.
    """

    name: str
    vertices: Array
    triangles: NDArray[np.int64]
    colour: str
    clashes: bool = False


@record(eq=False)
class Clash:
    """A picture of a clash: `title`, meshes to draw (`bodies`), and the amount of the clash as text (`excess_text`).

    The meshes are cut open along a plane with the `normal`. If the port is too narrow, `port` is its circle (x, y, z of
    the centre and radius in mm).
    """

    title: str
    bodies: tuple[ColouredMesh, ...]
    normal: tuple[float, float, float]
    port: tuple[float, float, float, float] | None = None
    excess_text: str = ""


@record(eq=False)
class MeshedPiece:
    """A part, or several board layers together, and its mesh (mm) in its position at the clash."""

    name: str
    role: BodyRole
    colour: str
    body: Any


def clashes(layout: Layout, whole: tuple[Solid, ...], proof: Proof, loads: tuple[PadLoad, ...]) -> tuple[Clash, ...]:
    """Return pictures of the faults in `proof`, at most `MOST`: the first of each kind and pair of parts.

    `whole` are the solids of the glued assembly, and `loads` the loads that were measured. Empty if the sensor fits.
    """
    worst: dict[tuple[str, str, str], ProofValue] = {}
    for each in proof.faults:
        worst.setdefault((each.what, each.first, each.second), each)
    return tuple(_clash(layout, whole, each, loads) for each in list(worst.values())[:MOST])


def hinge_pin_clash(layout: Layout, whole: tuple[Solid, ...], gap: PinGap) -> Clash:
    """Return a picture of the tail at the hinge's pin with the jaws closed, and the volume that both share."""
    jaw, (x, y, z) = layout.spec.jaw, pivot_of(layout)
    assert jaw is not None
    across = 0.5 * jaw.width * MM
    m3 = import_extra("manifold3d")
    pin = m3.Manifold.cylinder(2 * across, gap.pin * MM, -1.0, 48, True).rotate((90.0, 0.0, 0.0)).translate((x, y, z))
    near = [replace(piece, body=part_between(piece.body, x - BEFORE, x + BEHIND))
            for piece in _meshed_pieces(whole, set())]
    shared = next(piece.body for piece in near if piece.name == BOARD) ^ pin
    shown = _visible_meshes(near, {BOARD}, shared, ALONG, y)
    pin = (pin - shared).trim_by_plane(ALONG, y)
    figure = f"the tail's face is {show(gap.away, 'm', 3)} from the pivot; the pin takes {show(gap.pin, 'm', 3)}"
    bodies = (*shown, _as_coloured("pin", pin, PIN_COLOUR, True))
    return Clash(f"{gap.when}: the tail and the hinge's pin", bodies, ALONG, excess_text=figure)


def _meshed_pieces(whole: tuple[Solid, ...], named: set[str]) -> list[MeshedPiece]:
    """Return the meshes of the solids.

    Glue and board layers in `named` are separate. Other glue is left out, and the other board layers are joined to one
    mesh.
    """
    meshes = list(zip(whole, display_meshes(whole), strict=True))
    films = [(s, mesh) for s, mesh in meshes if s.role in (BodyRole.BOARD, BodyRole.COPPER) and s.name not in named]
    pieces = [
        MeshedPiece(solid.name, solid.role, solid.colour, manifold(mesh))
        for solid, mesh in meshes
        if (solid.role is not BodyRole.GLUE or solid.name in named) and (solid, mesh) not in films
    ]
    if films:
        m3 = import_extra("manifold3d")
        body = m3.Manifold.batch_boolean([manifold(mesh) for _, mesh in films], m3.OpType.Add)
        pieces.append(MeshedPiece(BOARD, BodyRole.BOARD, BOARD_COLOUR, body))
    return pieces


def _clash(layout: Layout, whole: tuple[Solid, ...], fault: ProofValue, loads: tuple[PadLoad, ...]) -> Clash:
    pieces = _meshed_pieces(whole, {fault.first, fault.second})
    if fault.what == OPENING:
        pivot = pivot_of(layout)
        there = [replace(p, body=turned_about_pivot(pivot, p.body, fault.angle)) if p.role in MOVING else p
                 for p in pieces]
    elif fault.what in (INTERFERENCE, PORT):
        there = pieces
    else:
        load, gap = next(each for each in loads if each.name == fault.condition), target_gap(layout.spec)
        there = [replace(piece, body=_loaded_mesh(piece, fault.what, load, gap)) for piece in pieces]
    if fault.what == PORT:
        # What of the closed pair, between tip and heel, lies beyond the port's circle
        jaw, pair = layout.spec.jaw, closed_section(layout)
        assert jaw is not None and pair is not None
        x0, x1 = (x * MM for x in jaw_range(layout.body, jaw))
        y, z, radius = board_middle(layout.body).y * MM, pair.axis * MM, fault.limit * MM
        m3 = import_extra("manifold3d")
        port = (
            m3.Manifold.cylinder(x1 - x0 + 2.0, radius, -1.0, 180).rotate((0.0, 90.0, 0.0)).translate((x0 - 1.0, y, z))
        )
        outside = [part_between(piece.body, x0, x1) - port for piece in there]
        names = {p.name for p, out in zip(there, outside, strict=True) if float(out.volume()) > 1e-4}
        red = m3.Manifold.compose([body for body in outside if not body.is_empty()])
        x = _middle(red) if not red.is_empty() else fault.where[0] * MM
        reach, room = (show(length, "m", 4) for length in (fault.value, fault.limit))
        beyond = show(fault.value - fault.limit, "m", 3)
        figure = f"{fault.first} reaches {reach} from the axis, {beyond} farther than the port ({room})"
        shown = _visible_meshes(there, names, red, ACROSS, x)
        return Clash("the closed pair and its port", shown, ACROSS, (x, y, z, radius), figure)
    bodies = {piece.name: piece.body for piece in there}
    shared = bodies[fault.first] ^ bodies[fault.second]
    x = _middle(shared if not shared.is_empty() else bodies[fault.first])
    when = f", {fault.condition}" if fault.condition else ""
    return Clash(
        f"{fault.first} and {fault.second}{when}", _visible_meshes(there, {fault.first, fault.second}, shared, ACROSS,
                                                                   x),
        ACROSS, excess_text=_excess_text(fault, shared),
    )


def _excess_text(fault: ProofValue, shared: Any) -> str:
    """Return the volume of `shared`, the intersection of two parts, or the gap between the parts, as text."""
    volume = f"both take {float(shared.volume()):.3g} mm3"
    if fault.unit == "m":  # a gap that has to be left
        return f"{volume}: no gap is left" if not shared.is_empty() else f"the gap is {show(fault.value, 'm', 3)}"
    return volume


def _loaded_mesh(piece: MeshedPiece, what: str, load: PadLoad, gap: float | None) -> Any:
    """Return a part's mesh under load: pads bulge and the target moves.

    Other moving parts move only if the measurement `what` is `BULGE` or `TRAVEL`. `gap` (m) is the target's gap at
    rest.
    """
    if piece.role is BodyRole.ELASTOMER:
        return bulged_pad(piece.body, load)
    if piece.role is BodyRole.TARGET:
        return moved_with_target(gap, piece.body, load.pose)
    if piece.role in MOVING and what in (BULGE, TRAVEL):
        return piece.body.translate((0.0, 0.0, load.pose.z * MM))
    return piece.body


def _visible_meshes(
    pieces: list[MeshedPiece], names: set[str], red: Any, normal: tuple[float, float, float], at: float
) -> tuple[ColouredMesh, ...]:
    """Return all parts and the shared volume, without the material before the cutting plane.

    `red` is the shared volume, and `at` the position (mm) of the plane along its `normal`. `names` are the clashing
    parts.
    """
    direction = (-1.0, 0.0, 0.0) if normal == ACROSS else normal
    offset = -at if normal == ACROSS else at
    bodies = []
    for piece in pieces:
        clashes = piece.name in names
        body = (piece.body - red if clashes and not red.is_empty() else piece.body).trim_by_plane(direction, offset)
        if not body.is_empty():
            bodies.append(_as_coloured(piece.name, body, piece.colour, clashes))
    red_part = red.trim_by_plane(direction, offset)
    return (*bodies, *([] if red_part.is_empty() else [_as_coloured("too much", red_part, RED, True)]))


def _as_coloured(name: str, body: Any, colour: str, clashes: bool) -> ColouredMesh:
    mesh = body.to_mesh64()
    points = np.round(np.asarray(mesh.vert_properties)[:, :3], 6) + 0.0
    return ColouredMesh(name, points, np.asarray(mesh.tri_verts).astype(np.int64), colour, clashes)


def _middle(body: Any) -> float:
    """Return the x (mm) of the middle of a mesh along the jaw."""
    box = body.bounding_box()
    return float(box[0] + box[3]) / 2


CARRIERS = (BodyRole.JAW, BodyRole.MOUNT, BodyRole.SHIELD)
HOLLOW = 0.1  # How far (mm) below a carrier's face glue still fills a groove or a dent
"""Depth (mm) below a support's face to which glue fills grooves and dents."""
BELOW = 5e-3
"""Depth (mm) of a cut below a face, so that it does not lie in the face's own plane.

Meshes of flat faces are exact. Meshes of round faces have errors up to 5 um.
"""
CARRIER = "what carries the board"


def support_areas(layout: Layout, whole: tuple[Solid, ...]) -> tuple[ProofValue, ...]:
    """Return the supported area under the pressed part and under the board's whole body, compared with their limits.

    Supported is the area above a part's face that is one glue line below the board. Empty if no such part is a solid:
    without a mount, or on a finger itself. Also empty on a custom mount without a STEP file, which also fills the gap
    over a shield.
    """
    mount, solids = layout.spec.mount, [solid for solid in whole if solid.role in CARRIERS]
    is_drawn = any(solid.role is not BodyRole.SHIELD for solid in solids)
    if mount is None or not is_drawn or (mount.finger is not None and not mount.standoff):
        return ()
    under = board_heights(layout.spec.fpc.stackup)[0] * MM
    # What of the carriers lies below a plane (mm), as a section from above
    height = under - layout.spec.assembly.glue_line * MM
    m3 = import_extra("manifold3d")
    faces = m3.CrossSection()
    for solid in solids:
        body = manifold(tessellate(solid))
        for level in (height - BELOW, height - HOLLOW - BELOW):
            faces = faces + body.slice(level)
    middle = board_middle(layout.body)
    name, path = pressed_piece(plates_of(layout.spec), layout.body, layout.body_outline)
    where = (middle.x, middle.y, under / MM)
    measured = [_area_measurement(name, path, faces, where, LEAST_PRESSED_SHARE)]
    if name != BODY:
        measured.append(_area_measurement(BODY, layout.body_outline, faces, where, LEAST_GLUABLE_SHARE))
    return tuple(measured)


def bending_rod_overlap(layout: Layout, whole: tuple[Solid, ...]) -> tuple[ProofValue, ...]:
    """Return the volume (m3) that the mount of a STEP file shares with the rod about which the tail is bent.

    `whole` are the solids of the glued assembly. Empty if there is no file or no rod.
    """
    mount, down = layout.spec.mount, [bend for bend in bends(layout) if bend.direction == "down" and bend.radius]
    if mount is None or mount.step is None or mount.kind != "custom" or not down:
        return ()
    first = min(down, key=lambda bend: bend.start)
    rod, (low, high) = (first.radius or 0.0) + ROD, layout.reach_at(first.start)
    where = first.start, (low + high) / 2, tail_heights(layout.spec.fpc)[0] - rod
    across = import_extra("manifold3d").Manifold.cylinder((high - low) * MM, rod * MM, rod * MM, center=True)
    bar = across.rotate((90.0, 0.0, 0.0)).translate(tuple(value * MM for value in where))
    shared = sum(
        float((manifold(tessellate(solid)) ^ bar).volume()) for solid in whole if solid.role is BodyRole.MOUNT) / MM**3
    return (ProofValue(BEND, "mount", "tail", shared, 0.0, "m3", shared <= LEAST_SHARED, where),)


LEAST_SHARED = 1e-11
"""Largest volume (m3) that mount and rod may share. Up to 0.01 mm3 is a rounding error of the meshes."""


def _area_measurement(
    name: str, path: Path, faces: Any, where: tuple[float, float, float], share: float
) -> ProofValue:
    """Compare the supported area (m2) of a part with its limit: the part's area times `share`.

    `path` is the part's outline, `faces` the support from above (a manifold3d cross-section), and `where` (m) its
    place.
    """
    points = path.flattened(1e-6)[:-1]
    region = import_extra("manifold3d").CrossSection([[(p.x * MM, p.y * MM) for p in points]])
    of, area = (float(each.area()) / MM**2 for each in (region, region ^ faces))
    what = SUPPORT if area >= LEAST_GLUABLE_SHARE * of else NO_SUPPORT
    return ProofValue(what, name, CARRIER, area, share * of, "m2", area >= share * of, where)
