"""Tools for the assembly of the sensor: moulds for pad and skin, the gluing jig, and the board's press.

The pad's mould is for pads that are not cut from sheet. It is an open tray with cavities of the pad's outline, as deep
as the pad is thick. Their walls are inclined by the draft angle, so that the cured pad comes out. A groove around each
cavity takes the excess. A lid that is drawn across from one side leaves the face flat, and its vents let air out. The
pad has its nominal size at half its height.

The jig aligns board, pad and target while their glue cures. Its base has a recess of the board's outline, flush with
the board's top face, with holes to push the board out. Two pins of different size guide the frames, so that no frame
can be put on in a wrong orientation. Pad and target each have a frame with a well of their outline. The well's corners
are drilled out for glue, and because printers do not make sharp inner corners. A frame never touches the pad or the
parts on it, at any thickness within tolerance. A press has a foot of the part's outline, which the well guides, and a
peg for washers. Its weight alone presses the part, without a stop: the glue line determines the part's height.

The board's press holds the board on its mount while the glue cures. It is a block a little smaller than the board, so
that it fits into a pocket and between the films that hold the board. It stands on the board's rim. A hollow surrounds
the parts on the board, and its roof presses them through soft foam, at any height of the parts.

The skin's mould is an open cup that casts the encapsulation around pad and target, with the board on it. The jig's pins
determine the cup's orientation on the base. The cup is filled while open, and the air is removed. The base with the
finished sensor is then put on it face down. The excess flows out through grooves in the parting face, so that the
sensing surface has no mark. The cup's walls are inclined by the draft angle. At their upper end, the skin has the
spec's thickness.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any

from sitscad.assembly.places.bodies import (
    Body,
    BodyRole,
    Plates,
    board_heights,
    plates_of,
    top_height,
)
from sitscad.assembly.places.column import (
    Toleranced,
    layer_heights,
    layers_on_board,
    mount_tolerance,
    print_limit,
    print_process,
)
from sitscad.assembly.places.seating import plate_plan, process_clearance
from sitscad.assembly.places.stack import has_round_body
from sitscad.assembly.solids.plates import grown_outline, over_body
from sitscad.assembly.solids.solid import (
    MM,
    Solid,
    box,
    extrude_face,
    import_extra,
    one_solid,
    prism,
    subtract,
    tapered_solid,
)
from sitscad.basics.record import record
from sitscad.kernels.geometry.convex import Box, Footprint, clip_to_box, signed_distance
from sitscad.kernels.geometry.path import Line, Path, Point, Region, bounding_box, box_around, circle, rectangle
from sitscad.layout.board import Layout, SolderedThermistor
from sitscad.spec.mount import Mount
from sitscad.spec.thermistor import BOARD as ON_BODY
from sitscad.spec.thermistor import Thermistor

MATERIAL, COLOUR = "printed resin", "#c9b8a9"
DRAFT = math.radians(3.0)
"""Angle (rad) of a mould's walls to the vertical."""
FLOOR, BORDER, LID = 2.0e-3, 4.0e-3, 2.0e-3
GROOVE, RIM = 1.0e-3, 1.0e-3
VENT = 1.0e-3
CAVITIES = 4  # With four pads per casting, a bad pad costs no extra casting
"""Number of pads in one casting. With four, a faulty pad needs no further casting."""
SPILL = 1.3  # Mixed volume over the cavities' volume: the rest stays on cup and stirrer or runs over (from memory)
"""Volume of silicone to mix, divided by the cavities' volume. The rest stays in the cup or runs over (from memory)."""

LEAST_MIX = 5e-6
"""Smallest volume (m3) of a two-part silicone that can be weighed accurately on a laboratory balance (from memory)."""


@record
class SiliconeMix:
    """Silicone for one casting: number of pads, volume of one pad (m3), and volume to mix for all pads (m3)."""

    pads: int
    pad: float
    mixed: float


def silicone_to_mix(plates: Plates) -> SiliconeMix | None:
    """Return the silicone to mix for one casting of pads. None if there is no pad."""
    if plates.elastomer is None:
        return None
    pieces = (*plates.elastomers, *plates.webs) if plates.webs else (plates.elastomer,)
    volume, cavities = sum(_area(piece, 0.0) * piece.thickness for piece in pieces), _cavities(plates)
    return SiliconeMix(cavities, volume, SPILL * cavities * volume)


def _cavities(plates: Plates) -> int:
    """Return the number of pads in one casting. Pads joined by webs count as a single part."""
    return 1 if plates.webs else CAVITIES


def mould(layout: Layout) -> tuple[Solid, ...]:
    """Return the tray and the lid of the pad's mould, each as it is printed. Empty if there is no pad."""
    plates = plates_of(layout.spec)
    pad, cavities = plates.joined or plates.elastomer, _cavities(plates)
    if pad is None:
        return ()
    tray, cuts = prism(_plan(pad, cavities), -pad.thickness - FLOOR, 0.0), []
    for centre in _centres(pad, cavities):
        # The pad with leaning walls: narrowest at the floor, and of its nominal size at half its height
        lean = math.tan(DRAFT) * pad.thickness / 2
        for piece, at in _pieces(plates, pad, centre):
            cuts.append(tapered_solid(_outline(piece, at, -lean), _outline(piece, at, lean), -pad.thickness, 0.0))
        # A ditch round the cavity, half as deep, behind a rim
        inner, outer = _outline(pad, centre, RIM), _outline(pad, centre, RIM + GROOVE)
        cuts.append(prism(Region(outer, (inner,)), -max(pad.thickness / 2, 0.5e-3), 1e-3))
    # A flat plate with vents over the grooves, where they leave no mark on a pad: as small as its process makes holes
    size = max(VENT, print_limit(print_process(layout.spec.mount), "hole").value)
    beside = pad.footprint.size[1] / 2 + RIM + GROOVE / 2
    vents = (circle(Point(centre.x, centre.y + side * beside), size / 2)
             for centre in _centres(pad, cavities) for side in (-1.0, 1.0))
    lid = subtract(prism(_plan(pad, cavities), 0.0, LID), (prism(vent, -1e-3, LID + 1e-3) for vent in vents), "mould")
    pieces = (("mould-tray", subtract(tray, cuts, "mould")), ("mould-lid", lid))
    return tuple(Solid(name, shape, MATERIAL, COLOUR, BodyRole.MOULD) for name, shape in pieces)


def _pieces(plates: Plates, pad: Body, centre: Point) -> Iterator[tuple[Body, Point]]:
    """Yield (part, its centre) for the parts of one cavity whose centre is at a point.

    They are the pad alone, or all pads with the webs that join them.
    """
    if not plates.webs:
        yield pad, centre
        return
    here = pad.footprint.centre
    for body in plates.elastomers:
        yield body, centre.shifted(body.footprint.centre.x - here.x, body.footprint.centre.y - here.y)
    for body in plates.webs:
        (x, y), (middle_x, middle_y) = body.footprint.size, body.footprint.centre
        pad_size = plates.elastomers[0].footprint.size
        is_row = any(abs(each.footprint.centre.y - middle_y) < 1e-9 for each in plates.elastomers)
        longer = (x + pad_size[0], y) if is_row else (x, y + pad_size[1])
        web = replace(body, plan=replace(body.footprint, size=longer))
        yield web, centre.shifted(middle_x - here.x, middle_y - here.y)


def _pitch(pad: Body) -> float:
    return pad.footprint.size[0] + 2 * (RIM + GROOVE) + RIM


def _centres(pad: Body, cavities: int) -> list[Point]:
    return [Point((i - (cavities - 1) / 2) * _pitch(pad), 0.0) for i in range(cavities)]


def _plan(pad: Body, cavities: int) -> Path:
    half_x = cavities * _pitch(pad) / 2 + BORDER
    half_y = pad.footprint.size[1] / 2 + RIM + GROOVE + BORDER
    return rectangle(-half_x, -half_y, half_x, half_y, 2e-3)


def _outline(pad: Body, centre: Point, room: float) -> Path:
    """Return the pad's outline about a point, enlarged by `room` (m) on each side."""
    x, y = (side / 2 + room for side in pad.footprint.size)
    if pad.footprint.is_round:
        return circle(centre, x)
    return rectangle(centre.x - x, centre.y - y, centre.x + x, centre.y + y)


JIG_COLOUR = "#b8c9a9"
JIG_FLOOR = 2.0e-3
PINS = (3.0e-3, 2.0e-3)
PIN_INSET = 3.0e-3
PIN_HEIGHT = 1.8e-3
PUSH_HOLES = (2.5e-3, 5.0e-3)
"""Diameters (m) of the push holes under a board whose shorter side is below `WIDE_BOARD`, or at least `WIDE_BOARD`."""
WIDE_BOARD = 12.0e-3
PUSH_PITCH = 16.0e-3
"""Largest distance (m) between two push holes. A film that holds the board must yield at each hole."""
CORNER_RELIEF = 0.5e-3
ROOM_ROUND_PAD = 1.0e-3
OVER_PAD = 0.1e-3
"""Air gap (m) between a pad with the largest thickness and the frame of the part on it."""
WELL = 2.5e-3
"""Depth (m) of a well above the highest part. It guides the press, and makes frames higher than the pins."""
COLLAR = 4.0e-3
LIFT = 1.0e-3
"""Air gap (m) between the frame and the press's collar, in addition to the tolerance of the part's height."""
PEG = (8.0e-3, 15.0e-3)
"""Diameter and height (m) of the peg. M8 washers have a hole of 8.4 mm (ISO 7093)."""


@record
class JigFrame:
    """Geometry of a frame of the jig.

    `kind` and `pieces` are the parts glued in the frame. Heights are above the board's top face: `height` (m) of the
    frame's upper face, `face` (m) of the glued part's upper face. `cuts` are cutouts: (outline, lower height, upper
    height in m). `walls` are outlines of walls between wells that are too thin to be made.
    """

    kind: str
    pieces: tuple[Body, ...]
    height: float
    face: Toleranced
    cuts: tuple[tuple[Path, float, float], ...]
    walls: tuple[Path, ...]

    @property
    def collar(self) -> float:
        """Height (m) of the lower face of the press's collar, for a part of nominal thickness."""
        return self.height + LIFT + self.face.spread


ROOM_ROUND_CHIP, OVER_CHIP = 0.5e-3, 0.2e-3
"""Air gaps (m) of tools beside the pads of a soldered thermistor, and above its largest height."""


def thermistor_pocket(soldered: SolderedThermistor | None, sensor: Thermistor | None) -> tuple[Path, float] | None:
    """Return outline and height (m above the board) of the pocket of tools for a thermistor on the body.

    `soldered` is the thermistor of the layout and `sensor` that thermistor's spec. None if no thermistor lies on the
    body.
    """
    if soldered is None or sensor is None or sensor.at != ON_BODY:
        return None
    (x0, y0, x1, y1), room = soldered.box, ROOM_ROUND_CHIP
    return rectangle(x0 - room, y0 - room, x1 + room, y1 + room), sensor.part.height + OVER_CHIP


def jig_frames(layout: Layout) -> tuple[JigFrame, ...]:
    """Return the frames in the order of gluing. Empty for a sensor without parts on its board."""
    rows = [row for part in ("elastomer", "target") if (row := plates_of(layout.spec).glued(part))]
    at, gap, frames = layer_heights(layers_on_board(layout)), process_clearance(layout.spec.mount), []
    under: tuple[Body, ...] = ()
    for row in rows:
        kind = row[0].role.value
        face = at[kind][1] - at["board"][1]
        height, clear = face.nominal + face.spread + WELL, 0.0
        if under:  # what is glued already may be thick, and must not be touched
            pad = at[under[0].role.value][1] - at["board"][1]
            clear = pad.nominal + pad.spread + OVER_PAD
        walls, relief = _walls_between_wells(layout.spec.mount, row)
        cuts = [(body.outline(gap), 0.0, height) for body in row]
        cuts += [(body.outline(ROOM_ROUND_PAD), 0.0, clear) for body in under]
        if (pocket := thermistor_pocket(layout.thermistor, layout.spec.soldered_thermistor)) is not None:
            cuts.append((pocket[0], 0.0, min(pocket[1], height)))
        for body in row:
            cuts += [(circle(side.start, relief), 0.0, height) for side in body.outline() if isinstance(side, Line)]
        frames.append(JigFrame(kind, row, height, face, tuple(cuts), tuple(walls)))
        under = row
    return tuple(frames)


def jig(layout: Layout) -> tuple[Solid, ...]:
    """Return the parts of the jig in their positions of use. Empty for a sensor without parts on its board."""
    frames = jig_frames(layout)
    if not frames:
        return ()
    plan, gap = plate_plan(layout, 0.0), process_clearance(layout.spec.mount)
    shapes = [("jig-base", _base(layout, plan))]
    for frame in frames:
        through = (*frame.walls, *(circle(at, size / 2 + gap) for at, size in pins(plan)))
        tools = [prism(outline, -1e-3, frame.height + 1e-3) for outline in through]
        for outline, low, high in frame.cuts:
            low, high = (low if low > 0.0 else -1e-3), (high if high < frame.height else frame.height + 1e-3)
            tools.append(prism(outline, low, high))
        block = prism(rectangle(*plan, 2e-3), 0.0, frame.height)
        shapes += [(f"jig-{frame.kind}", subtract(block, tools, "jig")), (f"jig-{frame.kind}-press", _press(frame))]
    if pockets := foot_pockets(layout):
        shapes.append((BOARD_PRESS, _board_press(layout, pockets)))
    return tuple(Solid(name, shape, MATERIAL, JIG_COLOUR, BodyRole.JIG) for name, shape in shapes)


BOARD_PRESS = "jig-board-press"


def _press(frame: JigFrame) -> Any:
    """Return the press of a frame, with its foot on the frame's first part."""
    body, start = frame.pieces[0], frame.collar
    foot = prism(body.outline(), frame.face.nominal, start)
    slope = tapered_solid(body.outline(1e-5), body.outline(COLLAR), start, start + COLLAR)  # prints without support
    plate = prism(body.outline(COLLAR), start + COLLAR, start + COLLAR + FLOOR)
    (diameter, height), top = PEG, start + COLLAR + FLOOR
    peg = prism(circle(body.footprint.centre, diameter / 2), top, top + height)
    return one_solid(foot + slope + plate + peg, "press")


FOAM = 5.0e-3
"""Thickness (m) of the soft foam between the parts and the roof of the board's press."""

FOAM_STRAIN = 0.3
"""Compression of the foam, divided by its thickness.

Soft polyurethane foam then presses with a few kilopascals. This pressure hardly rises over a further tenth of a
millimetre. From memory, not verified.
"""

FOOT_INSET = 0.1e-3
"""Distance (m) of the board's press from the board's edge, because films beside the board are higher."""

FOOT_ROOM = (0.2e-3, 0.5e-3)
"""Smallest and usual air gap (m) between the parts and the feet of the board's press, which is positioned by eye."""


def foot_pockets(layout: Layout) -> tuple[Path, ...]:
    """Return the outlines of the hollows in the board's press.

    Empty if there are no parts, or if the board's rim is too narrow for the feet.
    """
    pads, (x0, y0, x1, y1) = plates_of(layout.spec).glued("elastomer"), layout.body
    bodies = (*pads, *plates_of(layout.spec).of("target"))
    if not bodies:
        return ()
    wall, film = print_limit(print_process(layout.spec.mount), "free_wall").value, layout.spec.encapsulation
    # a skin that is cast already stands round the pieces, its walls leaning by the draft
    skin = film.thickness + math.tan(DRAFT) * top_height(layout.spec) if film is not None and is_cast(layout) else 0.0
    if has_round_body(layout.spec.fpc.body):
        centre = Point((x0 + x1) / 2, (y0 + y1) / 2)
        reach = max(each.centre.distance(centre) + (each.size[0] if each.is_round else math.hypot(*each.size)) / 2
                    for each in (body.footprint for body in bodies))
        spare = (x1 - x0) / 2 - FOOT_INSET - wall - skin - reach
        if spare < FOOT_ROOM[0]:
            return ()
        return (circle(centre, (x1 - x0) / 2 - FOOT_INSET - wall - spare + min(spare, FOOT_ROOM[1])),)
    boxes = [body.footprint.box for body in bodies]
    cells = [(box[0] - skin, box[1] - skin, box[2] + skin, box[3] + skin) for box in boxes]
    if len(bodies) == 2 * len(pads):
        cells = [box_around(pair) for pair in zip(cells[: len(pads)], cells[len(pads) :], strict=True)]
    apart = min((max(first[0] - second[2], second[0] - first[2], first[1] - second[3], second[1] - first[3])
                 for first, second in combinations(cells, 2)), default=math.inf)
    between = min(FOOT_ROOM[1], (apart - wall) / 2)
    if between < FOOT_ROOM[0]:
        cells, between = [box_around(cells)], FOOT_ROOM[0]
    u0, v0, u1, v1 = box_around(cells)
    rooms = [min(rim - FOOT_INSET - wall, FOOT_ROOM[1]) for rim in (u0 - x0, v0 - y0, x1 - u1, y1 - v1)]
    rooms = [room if room >= FOOT_ROOM[0] else math.inf for room in rooms]
    if math.inf in rooms[::2] and math.inf in rooms[1::2]:
        return ()
    pockets = []
    for cell in cells:
        sides = []
        for k, (side, end) in enumerate(zip(cell, (u0, v0, u1, v1), strict=True)):
            room = rooms[k] if abs(side - end) < 1e-9 else between
            limit = layout.body[k] if math.isinf(room) else side
            sides.append(limit + (-1.0 if k < 2 else 1.0) * (1e-3 if math.isinf(room) else room))
        pockets.append(rectangle(sides[0], sides[1], sides[2], sides[3]))
    return tuple(pockets)


def _board_press(layout: Layout, pockets: Sequence[Path]) -> Any:
    """Return the board's press: feet on the board's rim, hollows over the parts, and a plate with a peg.

    `pockets` are the outlines of the hollows.
    """
    bd, (x0, y0, x1, y1) = import_extra("build123d"), layout.body
    film = layout.spec.encapsulation
    base = film.thickness if film is not None and is_cast(layout) else 0.0
    roof = max(frame.face.nominal for frame in jig_frames(layout)) + base + (1.0 - FOAM_STRAIN) * FOAM
    foot = over_body(layout.outline, layout.body, layout.spec.body_outline, 0.0, FLOOR).faces().sort_by(bd.Axis.Z)[0]
    plan = bd.offset(foot, -FOOT_INSET * MM, kind=bd.Kind.ARC).faces()[0]
    start = roof + FLOOR
    block = one_solid(extrude_face(plan, base, start), "press")
    hollows = [(pocket, roof) for pocket in pockets]
    if (over_chip := thermistor_pocket(layout.thermistor, layout.spec.soldered_thermistor)) is not None:
        hollows.append((over_chip[0], base + over_chip[1]))
    block = subtract(block, (prism(pocket, base - 1e-3, top) for pocket, top in hollows), "press")
    low, high = (_plate(layout.body, has_round_body(layout.spec.fpc.body), wider) for wider in (-FOOT_INSET, COLLAR))
    middle, (diameter, height) = Point((x0 + x1) / 2, (y0 + y1) / 2), PEG
    top = start + COLLAR + FLOOR
    collar = tapered_solid(low, high, start, start + COLLAR) + prism(high, start + COLLAR, top)
    return one_solid(block + collar + prism(circle(middle, diameter / 2), top, top + height), "press")


def _plate(body: Box, is_round: bool, wider: float) -> Path:
    """Return the disc or the rectangle of the board's body, enlarged by `wider` (m) on each side."""
    x0, y0, x1, y1 = body
    if is_round:
        return circle(Point((x0 + x1) / 2, (y0 + y1) / 2), (x1 - x0) / 2 + wider)
    return rectangle(x0 - wider, y0 - wider, x1 + wider, y1 + wider)


def push_places(body: Box, body_outline: Path) -> tuple[tuple[Point, ...], float]:
    """Return the centres (m) of the push holes in the jig's base, and their diameter (m)."""
    x0, y0, x1, y1 = body
    columns, rows = (max(1, math.ceil(side / PUSH_PITCH - 1e-9)) for side in (x1 - x0, y1 - y0))
    size = PUSH_HOLES[min(x1 - x0, y1 - y0) >= WIDE_BOARD]
    places = [Point(x0 + (i + 0.5) * (x1 - x0) / columns, y0 + (k + 0.5) * (y1 - y0) / rows)
              for i in range(columns) for k in range(rows)]
    inside = tuple(at for at in places if signed_distance(body_outline, at) <= -size / 2)
    return inside or (Point((x0 + x1) / 2, (y0 + y1) / 2),), size


def _walls_between_wells(mount: Mount | None, row: Sequence[Body]) -> tuple[list[Path], float]:
    """Return the walls between wells that are too thin to be made, and the radius (m) of the wells' drilled corners.

    `row` are the parts that lie in the wells of a frame. Thin walls are left out, which joins the wells. The radius is
    small enough that the other walls stay connected with the frame.
    """
    wall, gap = print_limit(print_process(mount), "wall").value, process_clearance(mount)
    walls, relief = [], CORNER_RELIEF
    for first, second in combinations(row, 2):
        (x0, y0, x1, y1), (u0, v0, u1, v1) = first.footprint.box, second.footprint.box
        apart = max(u0 - x1, x0 - u1), max(v0 - y1, y0 - v1)
        if first.footprint.is_round or first.footprint.rotation or min(apart) > -gap:
            continue
        if max(apart) >= wall + 2.0 * gap:
            relief = min(relief, 0.5 * (max(apart) - wall))
        elif apart[0] > apart[1]:
            walls.append(rectangle(min(x1, u1) - gap, max(y0, v0) - gap, max(x0, u0) + gap, min(y1, v1) + gap))
        else:
            walls.append(rectangle(max(x0, u0) - gap, min(y1, v1) - gap, min(x1, u1) + gap, max(y0, v0) + gap))
    return walls, relief


def _base(layout: Layout, plan: Box) -> Any:
    """Return the jig's base: a block with a recess of the board's outline, push holes and pins."""
    under = board_heights(layout.spec.fpc.stackup)[0]
    body = prism(rectangle(*plan, 2e-3), under - JIG_FLOOR, 0.0)
    near = clip_to_box(layout.outline, (plan[0] - 5e-3, plan[1] - 5e-3, plan[2] + 5e-3, plan[3] + 5e-3))
    if near is not None:  # a longer tail makes the same jig, to the last digit
        layout = replace(layout, outline=near.mapped(lambda p: Point(round(p.x, 12), round(p.y, 12))))
    body = one_solid(body - extrude_face(grown_outline(layout.outline, layout.spec.mount), under, 1e-3), "jig")
    plate, gap = layout.stiffener, process_clearance(layout.spec.mount)
    if plate is not None:
        x0, y0, x1, y1 = bounding_box([plate.outline.outline])
        if x0 - gap < plan[2]:  # it lies over the base
            room = rectangle(x0 - gap, y0 - gap, x1 + gap, y1 + gap)
            body = one_solid(body.cut(prism(room, under - plate.thickness - gap, 1e-3)), "jig")
    places, across = push_places(layout.body, layout.body_outline)
    body = subtract(body, (prism(circle(at, across / 2), under - JIG_FLOOR - 1e-3, 1e-3) for at in places), "jig")
    for at, size in pins(plan):
        body = one_solid(body + prism(circle(at, size / 2), -JIG_FLOOR / 2, PIN_HEIGHT), "jig")
    return body


def pins(plan: Box) -> tuple[tuple[Point, float], tuple[Point, float]]:
    """Return (position, diameter in m) of the two pins: in opposite corners, clear of board and tail."""
    low = Point(plan[0] + PIN_INSET, plan[1] + PIN_INSET)
    high = Point(plan[2] - PIN_INSET, plan[3] - PIN_INSET)
    return (low, PINS[0]), (high, PINS[1])


ROOF = 2.5e-3  # Plastic over the highest point of the skin (m)
"""Thickness (m) of plastic over the highest point of the skin."""
SKIN_VENT = (1.0e-3, 0.5e-3)  # Width and depth of the grooves that let air and silicone out (m)
"""Width and depth (m) of the grooves through which air and silicone flow out."""

LEAST_OVER_TOLERANCE = 2.0
"""Smallest thickness of a cast skin, divided by the tolerance of the printed cup. A thinner skin would have holes."""


def skin_mould(layout: Layout) -> Solid | None:
    """Return the skin's mould as it is printed, open side up.

    None if there is no skin, or if it is too thin to be cast.
    """
    if not is_cast(layout):
        return None
    plan, film = plate_plan(layout, 0.0), layout.spec.encapsulation
    assert film is not None
    height = max(top_height(layout.spec), PIN_HEIGHT) + ROOF
    cup = prism(rectangle(*plan, 2e-3), 0.0, height)
    body = over_body(layout.outline, layout.body, layout.spec.body_outline, -1e-3, film.thickness)
    cup = one_solid(cup - body, "mould")
    blocks: dict[Footprint, Body] = {}  # one where the other piece is as large
    for body in plates_of(layout.spec).all:
        blocks.setdefault(body.footprint, body)
    for body in blocks.values():
        # What a piece with its skin takes out of the cup: narrowest at the top, wider at the parting face by the draft
        top = top_height(layout.spec)
        room = math.tan(DRAFT) * top + math.tan(DRAFT) * 1e-3
        lower, upper = body.outline(film.thickness + room), body.outline(film.thickness)
        cup = one_solid(cup - tapered_solid(lower, upper, -1e-3, top), "mould")
    if (pocket := thermistor_pocket(layout.thermistor, layout.spec.soldered_thermistor)) is not None:
        cup = one_solid(cup - prism(pocket[0], -1e-3, pocket[1] + film.thickness), "mould")
    # Grooves in the parting face from the cavity's corners out over the cup's sides, away from the pins
    (width, depth), (x0, y0, x1, y1) = SKIN_VENT, layout.body
    points, corners = layout.body_outline.flattened(1e-5), (x0 + width / 2, x1 - width / 2)
    is_written = layout.spec.fpc.body is not None  # it may have no corners: from where it reaches farthest across
    vents = []
    for x in (min(points, key=lambda p: p.y).x,) if is_written else corners:
        vents.append(box(x - width / 2, plan[1] - 1e-3, -1e-3, x + width / 2, y0 + 0.5e-3, depth))
    for x in (max(points, key=lambda p: p.y).x,) if is_written else corners:
        vents.append(box(x - width / 2, y1 - 0.5e-3, -1e-3, x + width / 2, plan[3] + 1e-3, depth))
    cup = subtract(cup, vents, "mould")
    gap = process_clearance(layout.spec.mount)
    for at, size in pins(plan):
        cup = one_solid(cup - prism(circle(at, size / 2 + gap), -1e-3, PIN_HEIGHT + gap), "mould")
    turned = one_solid(cup.rotate(import_extra("build123d").Axis.X, 180.0), "mould")
    return Solid("mould-skin", turned, MATERIAL, COLOUR, BodyRole.MOULD)


def is_cast(layout: Layout) -> bool:
    """Whether the encapsulation is cast in a mould: it is thick enough for the process and covers no contacts."""
    film = layout.spec.encapsulation
    if film is None or not plates_of(layout.spec).all:
        return False
    body_end = layout.body[2]
    has_contacts = any(
        point.x < body_end - 1e-9
        for opening in layout.top_openings
        for segment in opening.outline
        for point in (segment.start, segment.end)
    )
    return film.thickness >= LEAST_OVER_TOLERANCE * mount_tolerance(layout.spec.assembly,
                                                                    layout.spec.mount).band - 1e-12 and not has_contacts


def skin_silicone(layout: Layout) -> SiliconeMix | None:
    """Return the silicone of the skin and the volume to mix (m3). None if the skin is not cast."""
    film = layout.spec.encapsulation
    if film is None or not is_cast(layout):
        return None
    thick, top = film.thickness, top_height(layout.spec)
    inside = sum(_area(body, 0.0) * body.thickness for body in plates_of(layout.spec).all)
    room = thick + math.tan(DRAFT) * top / 2
    plates = plates_of(layout.spec)
    blocks = max(math.fsum(_area(body, room) for body in row) for row in (plates.elastomers, plates.targets))
    flange = max(0.0, Region(layout.body_outline).area - blocks) * thick
    volume = flange + blocks * top - inside
    return SiliconeMix(1, volume, SPILL * volume)


def _area(body: Body, room: float) -> float:
    """Return a part's area (m2) from above, enlarged by `room` (m) on each side with corners of this radius."""
    x, y = body.footprint.size
    if body.footprint.is_round:
        return math.pi * (x / 2 + room) ** 2
    return (x + 2.0 * room) * (y + 2.0 * room) - (4.0 - math.pi) * room**2
