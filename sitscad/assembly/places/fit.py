"""Fit of the sensor, computed from dimensions: closed jaws in their port, and the board on the jaw's face.

Each dimension is computed nominally, by root-sum-square and in the worst case, with all glue lines and tolerances. The
result is exact in the plane across the jaw and needs no CAD kernel. `sitscad.assembly.solids.solid` measures the solids
instead.

The module also covers the jaws' hinge: its pin, the gap between tail and pin, the tube behind the jaws, and the closing
motion.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from sitscad.assembly.places.bodies import (
    MOUNT_PIECES,
    PartsError,
    backing_of,
    board_heights,
    film_thickness,
    plates_of,
    top_height,
)
from sitscad.assembly.places.column import (
    Levels,
    Toleranced,
    column,
    jaw_tolerance,
    layer_heights,
    layers_on_board,
    layers_on_seat,
    mount_tolerance,
    outline_tolerance,
    placement_tolerance,
    plate_tolerance,
)
from sitscad.assembly.places.jaws import (
    FILM_ROUNDING,
    board_middle,
    closed_span,
    jaw_range,
    jaw_section,
    jaw_with_rims,
    pivot_along,
    seat_half_width,
)
from sitscad.assembly.places.seating import adapter_holes, side_ledges
from sitscad.assembly.places.tail_path import tail_path
from sitscad.basics.check_results import Closing, Measure, Share
from sitscad.basics.record import record
from sitscad.basics.units import in_mm, parse_quantity
from sitscad.data import cited, rows
from sitscad.kernels.geometry.path import Point
from sitscad.layout.bending import tail_thickness
from sitscad.layout.board import Layout
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.mount import Assembly, Jaw

CLOSED_PAIR, OVERHANG, LENGTH = "closed pair", "board beside the jaw's face", "board along the jaw"


@record
class Corner:
    """A corner of a part in the cross-section of the closed jaws.

    `y` (m) is its distance from the jaw's middle, and `z` (m) its height above the middle of the closed jaws.
    `rounding` (m) is the radius of a rounded edge whose centre is this point.
    """

    part: str
    y: Toleranced
    z: Toleranced
    rounding: Toleranced = Toleranced(0.0)

    @property
    def reach(self) -> tuple[float, float, float]:
        """Distance (m) of the corner from the closed jaws' axis: nominal, by root-sum-square, in the worst case.

        The worst case combines the largest deviations of `y`, `z` and `rounding`. It is exact if each cause changes
        only one of these. The root-sum-square uses derivatives of the distance by each cause at nominal.
        """
        y, z, rounding = self.y, self.z, self.rounding
        distance = math.hypot(y.nominal, z.nominal)
        cosine, sine = (y.nominal / distance, z.nominal / distance) if distance else (0.0, 1.0)
        radius, moved = distance + rounding.nominal, dict[str, float]()
        for length, part in ((y, cosine), (z, sine), (rounding, 1.0)):
            for cause, change in length.terms:
                moved[cause] = moved.get(cause, 0.0) + part * change
        worst = math.hypot(abs(y.nominal) + y.spread, abs(z.nominal) + z.spread) + rounding.nominal + rounding.spread
        return radius, radius + math.hypot(*moved.values()), worst


@record
class ClosedJawsSection:
    """Cross-section of the closed jaws with the glued sensor (m).

    `height` is the distance between the backs. `axis` is the height of the middle between the backs above the board's
    top face. `radius` is the nominal radius of the smallest circle about the axis that encloses the section.
    `likely_radius` is this radius by root-sum-square, and `worst_radius` is this radius with all tolerances in the
    worst case. `decided_by` is the part that touches the circle. `port_radius` is the radius of the port.
    """

    height: float
    axis: float
    radius: float
    decided_by: str
    port_radius: float
    likely_radius: float
    worst_radius: float

    @property
    def fits(self) -> bool:
        """Whether the closed jaws nominally pass through their port. Contact is permitted."""
        return self.radius <= self.port_radius + 1e-9


def fit(layout: Layout) -> tuple[Measure, ...]:
    """Return the comparisons of sizes with their limits for a sensor in a jaw.

    Empty if there is no jaw. Raises `PartsError` if the shield does not fit.
    """
    jaw, pair = layout.spec.jaw, closed_section(layout)
    if jaw is None or pair is None:
        return ()
    # the circle that the closed pair needs, with the shares of all its parts
    spec, layers = layout.spec, column(layout)
    outline, offset = outline_tolerance(spec.assembly, spec.fpc.rules), placement_tolerance(spec.assembly)
    parts = [Share(e.part, e.thickness.nominal, e.thickness.spread, e.source) for e in layers]
    parts.append(Share("board across", layout.body_size[1], outline.band, outline.source))
    parts.append(Share("each piece beside its place", 0.0, offset.band, offset.source))
    widths = (2.0 * pair.radius, 2.0 * pair.likely_radius, 2.0 * pair.worst_radius, 2.0 * pair.port_radius)
    square = square_jaws_radius(layout)
    unread = "" if square is None else (
        "if its back is as round as the port: mount.jaw.step is read by build alone, and a square back takes up to "
        f"{in_mm(2.0 * square, 3)} mm"
    )
    closed = Measure(CLOSED_PAIR, *widths, pair.decided_by, tuple(parts), unread)
    seat = math.fsum(layer.thickness.nominal for layer in layers if layer.part in MOUNT_PIECES)
    return (
        closed, _compare_overhang(layout.body_size[1], spec.assembly, spec.fpc.rules, jaw, seat),
        _compare_length(layout.body_size[0], spec.assembly, spec.fpc.rules, jaw),
    )


def measures(layout: Layout) -> tuple[Measure, ...]:
    """Return the comparisons of `fit`.

    Empty if the dimensions of shield and standoff contradict each other, because a separate finding reports this.
    """
    try:
        return fit(layout)
    except PartsError:
        return ()


def closed_section(layout: Layout) -> ClosedJawsSection | None:
    """Return the cross-section of the closed jaws with all glue lines, from the spec's dimensions.

    None if there is no jaw. Only corners and the ends of rounded edges can be farthest from the axis. Raises
    `PartsError` if the shield does not fit.
    """
    jaw, span = layout.spec.jaw, closed_span(backing_of(layout.spec), top_height(layout.spec))
    backing_of(layout.spec).shield_that_fits()
    if jaw is None or span is None:
        return None
    layers = column(layout)
    at = layer_heights(layers)
    height = at["opposing-jaw"][1]
    reaches = [(*corner.reach, corner.part) for corner in _corners(layout, jaw, at, height * 0.5)]
    radius, _, _, part = max(reaches, key=lambda entry: (entry[0], entry[3]))
    likely, worst = max(entry[1] for entry in reaches), max(entry[2] for entry in reaches)
    above = 0.5 * height.nominal - at["board"][1].nominal
    return ClosedJawsSection(height.nominal, above, radius, part, jaw.port_diameter / 2, likely, worst)


def square_jaws_radius(layout: Layout) -> float | None:
    """Return the worst-case radius (m) of the closed jaws if each jaw filled a box of its width and height in the spec.

    None if the jaw has no STEP file. Raises `PartsError` if the shield does not fit.
    """
    jaw, pair = layout.spec.jaw, closed_section(layout)
    if jaw is None or jaw.step is None or pair is None:
        return None
    at = layer_heights(column(layout))
    half = Toleranced.of(jaw.width / 2, 0.5 * jaw_tolerance(layout.spec.assembly, jaw.width).band, "jaw across")
    return max(pair.worst_radius, Corner("jaw", half, at["opposing-jaw"][1] * 0.5).reach[2])


def jaw_back_distance(layout: Layout, jaw: Jaw) -> float:
    """Return the largest nominal distance (m) of the jaw's assumed cross-section from the axis of the closed jaws."""
    at = layer_heights(column(layout))
    corners = _corners(layout, jaw, at, at["opposing-jaw"][1] * 0.5)
    return max(corner.reach[0] for corner in corners if corner.part == "jaw")


def _compare_overhang(width: float, assembly: Assembly, rules: DesignRules, jaw: Jaw, seat: float) -> Measure:
    """Compare the board's overhang beyond the sides of the jaw's face with its limit.

    `width` (m) is the width of the board's body. `seat` (m) is the thickness of the seat below the board, and the limit
    of the overhang, because a seat supports an overhang up to its thickness (45 degrees).
    """
    face = jaw_section(jaw_with_rims(jaw)).face
    outline, metal = outline_tolerance(assembly, rules), jaw_tolerance(assembly, face)
    offset = placement_tolerance(assembly)
    parts = (
        Share("board across", width, outline.band, outline.source),
        Share("jaw's face across", face, metal.band, metal.source),
        Share("board beside its place", 0.0, offset.band, offset.source),
    )
    over = (Toleranced.of(width, outline.band, "board") - Toleranced.of(face, metal.band, "jaw")) * 0.5
    over = over + Toleranced.of(0.0, offset.band, "placement")
    return _measure(OVERHANG, over, seat, "board", parts)


def _compare_length(length: float, assembly: Assembly, rules: DesignRules, jaw: Jaw) -> Measure:
    """Compare the length (m) of the board's body with the length of the jaw."""
    outline, metal = outline_tolerance(assembly, rules), jaw_tolerance(assembly, jaw.length)
    parts = (
        Share("board along", length, outline.band, outline.source),
        Share("jaw along", jaw.length, metal.band, metal.source),
    )
    size = Toleranced.of(length, outline.band, "board") + Toleranced.of(0.0, metal.band, "jaw")
    return _measure(LENGTH, size, jaw.length, "board", parts)


def _measure(name: str, size: Toleranced, limit: float, decided_by: str, parts: tuple[Share, ...]) -> Measure:
    nominal = size.nominal
    return Measure(name, nominal, nominal + size.root_sum_square, nominal + size.spread, limit, decided_by, parts)


def _corners(layout: Layout, jaw: Jaw, at: Levels, middle: Toleranced) -> Iterator[Corner]:
    # Lowest point, side and face edge of both jaws
    profile = jaw_section(jaw)
    half = Toleranced.of(profile.face / 2, 0.5 * jaw_tolerance(layout.spec.assembly, profile.face).band, "jaw across")
    side = Toleranced(profile.side)
    for name, back, inner, inward in (("jaw", 0, 1, -1.0), ("opposing jaw", 1, 0, 1.0)):
        faces = at[name.replace(" ", "-")]
        yield Corner(name, Toleranced(0.0), faces[back] - middle)
        for depth in (side, Toleranced(0.0)):
            yield Corner(name, half, faces[inner] + depth * inward - middle)
    # Edges of the rims beside pad pockets
    for name, pocket, recess, floor, inward in (
        ("opposing jaw", jaw.opposing_pocket, jaw.opposing_recess, at["opposing-jaw"][0], -1.0),
        ("jaw", jaw.pocket, jaw.recess, at["jaw"][1], 1.0),
    ):
        if pocket is not None and recess:
            tall = jaw_section(replace(jaw, height=jaw.height + recess))
            edge = Toleranced.of(tall.face / 2, 0.5 * jaw_tolerance(layout.spec.assembly, tall.face).band, "jaw across")
            for below in (0.0, tall.side):
                yield Corner(name, edge, floor + Toleranced(inward * (recess - below)) - middle)
    yield from _seat_corners(layout, at, middle)
    yield from _sensor_corners(layout, at, middle)


def _seat_corners(layout: Layout, at: Levels, middle: Toleranced) -> Iterator[Corner]:
    """Yield the lower corner of the seat and both corners of the shield. Both parts are made to fit into the port."""
    spec = layout.spec
    metal = board_heights(spec.fpc.stackup)[0] - (spec.mount.standoff if spec.mount else 0.0)
    sheet = backing_of(spec).shield_heights
    printed, offset = mount_tolerance(spec.assembly, spec.mount), _sideways_deviation(spec.assembly, "mount")
    lowest = at["jaw"][1]
    yield Corner(
        "mount", Toleranced.of(seat_half_width(layout, metal), 0.5 * printed.band, "mount across") + offset,
        lowest - middle,
    )
    if sheet:
        half = Toleranced(seat_half_width(layout, sheet[0])) + _sideways_deviation(spec.assembly, "shield")
        for level in at["shield"]:
            yield Corner("shield", half, level - middle)
    ledges = side_ledges(layout)
    if ledges is not None and "mount" in at:
        y = Toleranced.of(ledges[1], 0.5 * printed.band, "mount across") + offset
        foot = at["mount"][0]
        height = Toleranced.of(board_heights(spec.fpc.stackup)[1] - metal, printed.band, "ledge")
        for level in (foot, foot + height):
            yield Corner("mount", y, level - middle)


def _sensor_corners(layout: Layout, at: Levels, middle: Toleranced) -> Iterator[Corner]:
    """Yield all outer corners of board, pad, target and encapsulation."""
    spec = layout.spec
    outline = outline_tolerance(spec.assembly, spec.fpc.rules)
    half = Toleranced.of(layout.body_size[1] / 2, 0.5 * outline.band,
                         "board across") + _sideways_deviation(spec.assembly, "board")
    for level in at["board"]:
        yield Corner("board body", half, level - middle)
    film = at["encapsulation"][1] - at["encapsulation"][0] if "encapsulation" in at else None
    if film is not None:
        yield Corner("encapsulation", half, at["board"][1] + film - middle)
    for body in plates_of(spec).all:
        part, (_, low, _, high) = body.role.value, body.footprint.box
        half_size = max(high - board_middle(layout.body).y, board_middle(layout.body).y - low)
        size = plate_tolerance(spec.assembly, part, high - low)
        across = Toleranced.of(half_size, 0.5 * size.band, f"{part} across") + _sideways_deviation(spec.assembly, part)
        lower, upper = at[part]
        for level in (lower, upper):
            yield Corner(part, across, level - middle)
        if film is not None:  # round the plate: rounded above, square below
            square, foot, board = film * (1.0 - FILM_ROUNDING), lower - film, at["board"][1]
            yield Corner("encapsulation", across + square, upper + square - middle, film * FILM_ROUNDING)
            yield Corner("encapsulation", across + film, (foot if foot.nominal > board.nominal else board) - middle)


def _sideways_deviation(assembly: Assembly, part: str) -> Toleranced:
    """Return the sideways deviation (m) of a glued part. All parts are pushed against the same ledges."""
    return Toleranced.of(0.0, placement_tolerance(assembly).band, f"{part} beside its place")


@record
class Shaft:
    """Sizes of the tube behind the jaw.

    `bore` (m) is the tube's inner diameter. `pin` (m) is the diameter of the hinge's pin. `source` names the sources of
    both values.
    """

    bore: float
    pin: float
    source: str


def shaft(assembly: Assembly, jaw: Jaw | None) -> Shaft | None:
    """Return the tube and the hinge's pin behind the spec's jaw. None if there is no jaw.

    Values that the spec does not state come from a table by the diameter of the jaw's port.
    """
    if jaw is None:
        return None
    table, port = rows("shafts"), jaw.port_diameter
    row = next((row for row in table if port <= parse_quantity(row["up_to_port"], "length")), table[-1])
    bore = parse_quantity(row["bore"], "length") if assembly.shaft_bore is None else assembly.shaft_bore
    pin = parse_quantity(row["pin"], "length") if assembly.hinge_pin is None else assembly.hinge_pin
    if assembly.shaft_bore is not None and assembly.hinge_pin is not None:
        return Shaft(bore, pin, "the spec (assembly.shaft_bore, assembly.hinge_pin)")
    return Shaft(bore, pin, cited(row))


def tail_section_size(layout: Layout) -> tuple[float, float]:
    """Return the width and the largest thickness (m) of the tail behind the jaw.

    The width is 0 if no part of the board is behind the jaw. Both are 0 if there is no jaw. The tail is thickest
    between its contacts and the stiffener's edge, where coverlay, copper and stiffener overlap.
    """
    jaw = layout.spec.jaw
    if jaw is None:
        return 0.0, 0.0
    heel = jaw_range(layout.body, jaw)[1]
    ys = [point.y for point in layout.outline.flattened(1e-5) if point.x > heel]
    plate = layout.stiffener.thickness if layout.stiffener is not None else 0.0
    return (max(ys) - min(ys) if ys else 0.0), tail_thickness(layout.spec.fpc) + plate


def hinge_pivot(layout: Layout) -> Point | None:
    """Return the pivot of the jaws' hinge in the plane along the jaw (x, z; m). None if the spec states no hinge.

    Raises `PartsError` if the shield does not fit into the standoff.
    """
    jaw, pair, x = layout.spec.jaw, closed_section(layout), pivot_along(layout.body, layout.spec.jaw)
    return None if jaw is None or pair is None or x is None else Point(x, pair.axis - jaw.pivot_offset)


@record
class PinGap:
    """Gap between the tail and the hinge's pin.

    `when` describes the state of the jaws, and `angle` (rad) is the angle of the sensor's jaw in this state. `away` (m)
    is the distance of the tail's nearest face from the pivot. `pin` (m) is the pin's radius, and `source` the source of
    this value.
    """

    when: str
    away: float
    pin: float
    angle: float
    source: str

    @property
    def is_free(self) -> bool:
        """Whether the tail does not touch the pin."""
        return self.away >= self.pin


def pin_gaps(layout: Layout) -> tuple[PinGap, ...]:
    """Return the gaps between tail and pin with the jaws closed and fully open.

    Empty if there is no hinge, or if the tail has no bends. Raises `PartsError` if the shield does not fit into the
    standoff.
    """
    jaw, behind, pivot = layout.spec.jaw, shaft(layout.spec.assembly, layout.spec.jaw), hinge_pivot(layout)
    closed = tail_path(layout)
    if jaw is None or behind is None or pivot is None or closed is None or closed.radius is None:
        return ()
    half = (jaw.opening or 0.0) / 2
    paths = [("closed", 0.0, closed), (f"open by {math.degrees(2 * half):.3g} deg", half, tail_path(layout, half))]
    thick = tail_thickness(layout.spec.fpc)
    return tuple(
        PinGap(when, (path or closed).distance(*pivot) - thick / 2, behind.pin / 2, angle, behind.source)
        for when, angle, path in paths
    )


def closing_motion(layout: Layout) -> Closing | None:
    """Return the closing motion of the sensor's jaws.

    None if there is no jaw. Raises `PartsError` if the shield does not fit. The backs of the jaws are parallel if the
    distance between them equals the port's diameter. Tissue can fill the difference between this diameter and the
    height of the closed jaws with the sensor.
    """
    jaw, pair = layout.spec.jaw, closed_section(layout)
    if jaw is None or pair is None:
        return None
    x = pivot_along(layout.body, jaw)
    reach = None if x is None else x - board_middle(layout.body).x
    return Closing(jaw.port_diameter - pair.height, reach, jaw.opening, jaw.pivot_offset)


def screw_head_height(layout: Layout) -> float | None:
    """Return the height (m) of a bench plate's screw heads above the sensor's top face.

    Negative if the heads are lower. The heads' height equals the thread diameter (ISO 4762). None if there is no plate,
    or if its threads are in inches.
    """
    mount = layout.spec.mount
    if mount is None or mount.kind != "bench-plate" or mount.holes is None:
        return None
    is_own = mount.holes.name == "corners-m2" or adapter_holes(layout)
    thread = "M2" if is_own else mount.holes.thread
    if not thread.startswith("M"):
        return None
    # the board stands out of the plate by its own glue line
    layers = (*layers_on_board(layout)[1:], *(layer for layer in layers_on_seat(layout) if layer.is_glue))
    top = math.fsum(layer.thickness.nominal for layer in layers) + film_thickness(layout.spec.encapsulation)
    return 1e-3 * float(thread.removeprefix("M")) - top
