"""Checks of STEP files in a spec: whether they can be read, and whether a jaw has its dimensions in the spec.

Estimates and rules use only the dimensions in the spec. The solids are built from the STEP file. Both must describe the
same part. Therefore, slices of the positioned solid are measured under the coils' middle and under both ends.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from sitscad.assembly.places.bodies import backing_of
from sitscad.assembly.places.fit import ClosedJawsSection, closed_section, jaw_back_distance
from sitscad.assembly.places.jaws import board_middle, jaw_range, jaw_section
from sitscad.assembly.solids.imported import DatumError, read_part
from sitscad.assembly.solids.pieces import jaw as placed_jaw
from sitscad.assembly.solids.proof import ProofValue, part_between
from sitscad.assembly.solids.solid import CHORD, MM, PartsError, import_extra, manifold, tessellate
from sitscad.basics.record import record
from sitscad.kernels.geometry.convex import Box
from sitscad.kernels.geometry.path import bounding_box
from sitscad.layout.board import Coil, Layout
from sitscad.layout.lanes import Ring
from sitscad.spec.coil import CoilSpec
from sitscad.spec.mount import Jaw, Mount
from sitscad.spec.yaml.source import SpecSource

STEP_FILE, JAW_FILE, JAW_METAL, FEW_METAL = "step file", "jaw file", "jaw metal", "few jaw metal"
BACK, ROOMY_BACK, ASSUMED_FACE = "jaw back", "jaw back with room", "assumed face"
HALF_SLICE = 1e-3
"""Half the length (m) of a slice along the jaw. Teeth of grasping faces are up to 2 mm apart."""
FACE_TOLERANCE = 20e-6
"""Largest accepted difference (m) between the height of the metal face in the STEP file and in the spec.

Both values are rounded to 10 um or finer. If the metal is 0.2 mm behind the coils, this distance changes their
inductance by about 1 %.
"""
SIZE_TOLERANCE = 0.1e-3
"""Largest accepted difference (m) between a dimension in the STEP file and in the spec, for small dimensions.

For large dimensions, `SIZE_SHARE` is decisive. Both are similar to the general tolerances of drawings (ISO 2768-1,
medium: 0.1 mm up to 6 mm, 0.2 mm up to 30 mm; from memory, unverified).
"""

SIZE_SHARE = 0.02
"""Largest accepted difference between a dimension in the STEP file and in the spec, divided by the spec's value."""
LEAST_OF_SIZE = 2 / 3
"""Smallest accepted width or height of a slice, divided by the spec's value.

Jaws taper towards their tip. The widest and the highest slice must have the dimensions in the spec.
"""
LEAST_OF_FACE = 0.75
"""Smallest accepted width of the face in the STEP file, divided by the spec's width.

Edges may be chamfered or round.
"""
EDGE = 0.1e-3
"""Depth (m) below the face at which the face's width is measured."""
TEETH = 0.5e-3
"""Depth (m) below the face up to which metal counts as part of the face: the depth of teeth."""
MOST_MISSING = 0.10
"""Largest accepted area of missing and excess metal under the coils, divided by the area of the jaw's face there.

Missing and excess are relative to the jaw in the spec. The jaw reduces a coil's inductance by up to a half. A tenth of
the metal changes the inductance by up to 5 %. Holes for pins and rivets are smaller.
"""

FAR_TOO_MUCH = 0.25
"""Area of missing and excess metal under the coils, divided by the area of the face, above which it is an error.

Below this ratio, it is a warning.
"""


def read_files(mount: Mount | None, source: SpecSource) -> tuple[ProofValue, ...]:
    """Check that each STEP file of a spec has one closed solid, and the datum (coordinate system) that the spec names.

    Raises `MissingExtra` without a CAD kernel.
    """
    measured = []
    if mount is None:
        return ()
    section = "mount" if mount.kind == "custom" else "mount.jaw"
    for part in filter(None, (mount.step, None if mount.jaw is None else mount.jaw.step)):
        why = at = ""
        try:
            read_part(source, part)
        except PartsError as error:
            why, at = str(error), f"{section}.{'datum' if isinstance(error, DatumError) else 'step'}"
        measured.append(ProofValue(STEP_FILE, part.file, "", 0.0, 0.0, "", not why, (0.0, 0.0, 0.0), why, key=at))
    return tuple(measured)


@record(eq=False)
class PlacedJaw:
    """Mesh of a jaw's STEP file in its position, and the jaw's dimensions in the spec.

    `body` is the mesh (mm), and `face` the height (m) of the face in the spec. `figures` are the dimensions in the
    spec. None if the spec has none. `middle` is x and y (m) of the jaw's middle. `coils` is the box (m) around all
    coils, `(x0, y0, x1, y1)`. `size` is the solid's size as text.
    """

    body: Any
    face: float
    figures: Jaw | None
    middle: tuple[float, float]
    coils: Box
    size: str

    @property
    def half_face(self) -> float:
        """Half the width (m) of the strip in which the face is measured.

        The strip is as wide as the coils, or as the face or the pocket in the spec if this is narrower.
        """
        coils = (self.coils[3] - self.coils[1]) / 2
        if self.figures is None:
            return coils
        return min(coils, _face_width(self.figures) / 2)

    def tolerance(self, size: float) -> float:
        """Return the largest accepted difference (m) of a dimension in the STEP file from `size` (m) in the spec."""
        return max(SIZE_TOLERANCE, SIZE_SHARE * size)


def _face_width(figures: Jaw) -> float:
    """Return the width (m) of the face, or of the pocket's floor, in the spec."""
    wide = jaw_section(figures).face
    return min(wide, figures.pocket[1]) if figures.pocket is not None and figures.recess else wide


def measured_jaw(layout: Layout) -> tuple[ProofValue, ...]:
    """Compare the solid in a jaw's STEP file with the jaw's dimensions in the spec.

    Empty if the jaw has no STEP file.
    """
    mount, seat = layout.spec.mount, backing_of(layout.spec).seat_heights
    figures = layout.spec.jaw
    is_filed = mount is not None and (mount.is_jaw_unmeasured or (figures is not None and figures.step is not None))
    solid = placed_jaw(layout) if is_filed else None
    if solid is None or seat is None:
        return ()
    body = manifold(tessellate(solid))
    x0, y0, z0, x1, y1, z1 = body.bounding_box()
    size = f"{x1 - x0:.4g} x {y1 - y0:.4g} x {z1 - z0:.4g} mm"
    rings = _rings(layout.coils, layout.spec.coil)
    coils = bounding_box(
        [ring.boundary.rotated(ring.placement.rotation).shifted(*ring.placement.centre) for ring in rings]
    )
    place = board_middle(layout.body)
    jaw = PlacedJaw(body, seat[0], figures, (place.x, place.y), coils, size)
    measured = [_compare_face_height(jaw)]
    if measured[0].unit:  # there is metal under the coils
        measured += _compare_metal_areas(layout.body, jaw)
    if measured[0].unit and figures is not None:
        measured += [*_compare_sizes(jaw, figures), *_compare_ends(jaw, figures, *jaw_range(layout.body, figures))]
        if all(each.is_kept or each.first == ASSUMED_FACE for each in measured):  # a misplaced back says nothing more
            pair = closed_section(layout)
            measured += [] if pair is None else _compare_back(pair, jaw_back_distance(layout, figures), jaw, figures)
    remark = f"the file's solid measures {size} along, across and high"
    return tuple(replace(each, condition=f"{each.condition}; {remark}".strip("; ")) for each in measured)


def _rings(coils: tuple[Coil, ...], spec_coil: CoilSpec) -> Iterator[Ring]:
    for coil in coils:
        yield Ring(spec_coil, coil.placement, 0.0)


def _stations(jaw: PlacedJaw) -> Iterator[tuple[str, float]]:
    """Yield (name, x in m) of the slices along the jaw."""
    x0, x1 = jaw.coils[0], jaw.coils[2]
    if jaw.figures is not None:
        low, high = jaw.middle[0] - jaw.figures.length / 2, jaw.middle[0] + jaw.figures.length / 2
        x0, x1 = max(x0, low), min(x1, high)
    inner = min(HALF_SLICE, (x1 - x0) / 2)
    yield "under the coils' middle", (x0 + x1) / 2
    yield "under the coils' end at the tip", x0 + inner
    yield "under the coils' end at the tail", x1 - inner


def _slices(jaw: PlacedJaw) -> Iterator[tuple[str, float, Any]]:
    for place, x in _stations(jaw):
        yield place, x, part_between(jaw.body, (x - HALF_SLICE) * MM, (x + HALF_SLICE) * MM)


def _part_near_middle(body: Any, y: float, half: float) -> Any:
    """Return the part of a mesh (mm) whose distance from y = `y` (m) is at most `half` (m)."""
    return body.trim_by_plane((0.0, 1.0, 0.0), (y - half) * MM).trim_by_plane((0.0, -1.0, 0.0), -(y + half) * MM)


def _part_near_face(body: Any, face: float, depth: float) -> Any:
    """Return the part of a mesh (mm) from `depth` (m) below `face` (height in m) to `FACE_TOLERANCE` above it."""
    return body.trim_by_plane((0.0, 0.0, 1.0), (face - depth) * MM).trim_by_plane(
        (0.0, 0.0, -1.0), -(face + FACE_TOLERANCE) * MM)


def _measure_jaw(
    jaw: PlacedJaw, key: str, name: str, value: float, limit: float, keeps: bool, x: float, when: str
) -> ProofValue:
    where = (x, jaw.middle[1], jaw.face)
    return ProofValue(JAW_FILE, name, "", value, limit, "m", keeps, where, when, key=f"mount.jaw.{key}")


def _compare_face_height(jaw: PlacedJaw) -> ProofValue:
    """Compare the height (m) of the metal's face with the spec, in the slice with the largest deviation."""
    heights = []
    for place, x, part in _slices(jaw):
        cut = _part_near_middle(part, jaw.middle[1], jaw.half_face)
        above = -math.inf if cut.is_empty() else float(cut.bounding_box()[5]) / MM - jaw.face
        heights.append((abs(above), above, x, place))
    _, above, x, place = max(heights)
    if math.isinf(above):
        return replace(_measure_jaw(jaw, "step", "no metal", 0.0, 0.0, False, x, place), unit="")
    keeps = abs(above) <= FACE_TOLERANCE
    return _measure_jaw(jaw, "datum", "face", above, math.copysign(FACE_TOLERANCE, above), keeps, x, place)


def _compare_sizes(jaw: PlacedJaw, figures: Jaw) -> Iterator[ProofValue]:
    """Yield comparisons of width, height, rim and sideways offset (m), each in the slice with the largest deviation."""
    boxes = [(place, x, part.bounding_box()) for place, x, part in _slices(jaw) if not part.is_empty()]
    if not boxes:
        return
    rims = figures.recess if figures.pocket is not None or figures.recess else 0.0
    sizes = (
        ("width", "width", figures.width, [(b[4] - b[1]) / MM for _, _, b in boxes]),
        ("height", "height", figures.height, [jaw.face - b[2] / MM for _, _, b in boxes]),
    )
    for key, name, written, values in sizes:
        most = max(range(len(values)), key=values.__getitem__)
        least = min(range(len(values)), key=values.__getitem__)
        room = jaw.tolerance(written)
        fits = abs(values[most] - written) <= room
        k = least if fits and values[least] < LEAST_OF_SIZE * written else most
        keeps = fits and k == most
        yield _measure_jaw(jaw, key, name, values[k], written, keeps, boxes[k][1], boxes[k][0])
    above = max((b[5] / MM - jaw.face, place, x) for place, x, b in boxes)
    yield _measure_jaw(jaw, "recess", "rim", above[0], rims, abs(above[0] - rims) <= jaw.tolerance(rims), above[2],
                       above[1])
    offset = max((abs((b[1] + b[4]) / 2 / MM - jaw.middle[1]), place, x) for place, x, b in boxes)
    (value, place, x), limit = offset, jaw.tolerance(figures.width)
    yield _measure_jaw(jaw, "datum", "distance from the middle", value, limit, value <= limit, x, place)
    yield from _compare_face_width(jaw, figures)


def _compare_face_width(jaw: PlacedJaw, figures: Jaw) -> Iterator[ProofValue]:
    """Yield the comparison of the largest width (m) of the face over all slices, measured `EDGE` below the face."""
    written, widest = _face_width(figures), (0.0, "", 0.0)
    for place, x, part in _slices(jaw):
        half = written / 2 if figures.pocket is not None and figures.recess else figures.width
        cut = _part_near_middle(_part_near_face(part, jaw.face, EDGE), jaw.middle[1], half)
        if not cut.is_empty():
            box = cut.bounding_box()
            widest = max(widest, ((box[4] - box[1]) / MM, place, x))
    wide, place, x = widest
    if place and figures.face is None and not figures.recess and wide > written + jaw.tolerance(written):
        yield _measure_jaw(jaw, "face", ASSUMED_FACE, wide, written, False, x, place)
    elif place:
        yield _measure_jaw(jaw, "up", "face's width", wide, written, wide >= LEAST_OF_FACE * written, x, place)


def _compare_back(pair: ClosedJawsSection, assumed: float, jaw: PlacedJaw, figures: Jaw) -> Iterator[ProofValue]:
    """Compare the largest distances (m) of the file's jaw and of the assumed cross-section from the closed jaws' axis.

    `assumed` (m) is the distance for the assumed cross-section. The distance of the file's jaw may be larger by the
    height's tolerance, if the closed jaws then pass through the port in the worst case.
    """
    axis_height = jaw.face + pair.height / 2 - figures.height
    reaches = []
    for place, x, part in _slices(jaw):
        points = np.asarray(part.to_mesh64().vert_properties)
        if len(points):
            distances = np.hypot(points[:, 1] / MM - jaw.middle[1], points[:, 2] / MM - axis_height)
            corner = points[int(distances.argmax()), :3] / MM
            reaches.append((float(distances.max()), place, (x, float(corner[1]), float(corner[2]))))
    reach, place, where = max(reaches)
    passes = reach + pair.worst_radius - pair.radius <= pair.port_radius + CHORD / MM
    is_kept = reach <= assumed + (jaw.tolerance(figures.height) if passes else CHORD / MM)
    yield ProofValue(ROOMY_BACK if passes else BACK, "back", "", reach, assumed, "m", is_kept, where, place,
                      key="mount.jaw.step")


def _compare_ends(jaw: PlacedJaw, figures: Jaw, tip: float, heel: float) -> Iterator[ProofValue]:
    """Compare the ends of the face in the file with the jaw's length in the spec, and yield missing lengths (m).

    `tip` and `heel` (m) are the ends in the spec. A tip may be round, and a shank may continue beyond the heel.
    """
    floor = _part_near_middle(_part_near_face(jaw.body, jaw.face, TEETH), jaw.middle[1], jaw.half_face)
    if floor.is_empty():
        return
    box, room = floor.bounding_box(), jaw.tolerance(figures.length)
    first, face, last = jaw.body.bounding_box()[0] / MM, box[0] / MM, box[3] / MM
    shortfall = first - tip if tip < first - room else face - tip if face + room < tip else 0.0
    yield _measure_jaw(jaw, "length", "tip", shortfall, room, not shortfall, tip, "at the tip")
    short = heel - last
    yield _measure_jaw(jaw, "length", "heel", short, room, short <= room, heel, "at the heel")


def _compare_metal_areas(body: Box, jaw: PlacedJaw) -> Iterator[ProofValue]:
    """Yield the area (m2) of metal under the coils, compared with the jaw's face in the spec without its window."""
    m3 = import_extra("manifold3d")
    x0, y0, x1, y1 = jaw.coils
    if jaw.figures is not None:
        half, (low, high) = _face_width(jaw.figures) / 2, jaw_range(body, jaw.figures)
        if jaw.figures.pocket is not None and jaw.figures.recess:
            half_length = jaw.figures.pocket[0] / 2
            low, high = max(low, jaw.middle[0] - half_length), min(high, jaw.middle[0] + half_length)
        x0, x1 = max(x0, low), min(x1, high)
        y0, y1 = max(y0, jaw.middle[1] - half), min(y1, jaw.middle[1] + half)
    region = _rectangle(m3, x0, y0, x1, y1)
    written = region
    if jaw.figures is not None and jaw.figures.fenestration is not None:
        (long, wide), (x, y) = jaw.figures.fenestration, jaw.middle
        written = region - _rectangle(m3, x - long / 2, y - wide / 2, x + long / 2, y + wide / 2)
    there = _part_near_face(jaw.body, jaw.face, TEETH).project() ^ region
    wrong = float(((there - written) + (written - there)).area()) / MM**2
    of, area = (float(each.area()) / MM**2 for each in (written, there))
    limit = MOST_MISSING * float(region.area()) / MM**2
    what = FEW_METAL if wrong > FAR_TOO_MUCH / MOST_MISSING * limit else JAW_METAL
    key = "step" if jaw.figures is None or jaw.figures.fenestration is None else "fenestration"
    yield ProofValue(what, "metal under the coils", "", area, of, "m2", wrong <= limit,
                      ((x0 + x1) / 2, (y0 + y1) / 2, jaw.face), key=f"mount.jaw.{key}")


def _rectangle(m3: Any, x0: float, y0: float, x1: float, y1: float) -> Any:
    return m3.CrossSection([[(x * MM, y * MM) for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]])
