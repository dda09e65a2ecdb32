"""SIT314 to SIT316 and SIT319: can the mount's pieces, its joint with the jaw and its holes be made, does the jaw bear
being cut, and does what is left carry the board.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from sitscad.checks.assembly.fit import ROUNDING, unverified
from sitscad.checks.rules import Case, Rule, Undecided, Verdict, rule_of
from sitscad.design import Design
from sitscad.finding import Severity
from sitscad.scene.bodies import MOUNT_PIECES, board_heights, seat_spans
from sitscad.scene.column import print_limit
from sitscad.scene.jaws import PartsError, fitted_jaw, section, shield_that_fits
from sitscad.scene.seating import joint_clearance, metal_below, neck, pin_places, retention
from sitscad.scene.stack import BODY, HALF_OF_IT, MOST_OF_IT, Support, support
from sitscad.spec.mount import Jaw, Mount, Retention
from sitscad.spec.sensor import SensorSpec


def mount_joint(design: Design) -> Iterator[Verdict]:
    """Tongue or pins of a grasper's pad: made by the mount's process, and with metal enough round them."""
    mount, found = design.spec.mount, retention(design.layout)
    assert mount is not None and mount.jaw is not None
    if mount.jaw.fenestration is not None:
        # what a window through the jaw's face leaves beside it and at its ends
        (long, wide), wall = mount.jaw.fenestration, print_limit("machined", "wall")
        left = min((section(mount.jaw).face - wide) / 2, (mount.jaw.length - long) / 2)
        if left < wall.value - ROUNDING:
            yield THIN_BESIDE_WINDOW.found("mount.jaw.fenestration", left, wall.value, "m", source=wall.source,
                                           unverified=unverified(mount.jaw), long=long, wide=wide)
    if found is None:
        return
    if not _stands_on_metal(design):
        yield NOTHING_ON_METAL.found("mount.retention", kind=found.kind)
        return
    yield from _dovetail(design, mount, found) if found.kind == "dovetail" else _pins(design, mount, mount.jaw, found)


def _stands_on_metal(design: Design) -> bool:
    """Whether a printed piece lies on the jaw's metal."""
    spec = design.spec
    assert spec.mount is not None
    bottom = board_heights(spec)[0]
    try:
        spans = seat_spans(bottom, spec.mount.standoff, shield_that_fits(spec))
    except PartsError:
        return True  # which is a finding of its own
    return bool(spans) and abs(spans[0][0] - (bottom - spec.mount.standoff)) < ROUNDING


def _dovetail(design: Design, mount: Mount, found: Retention) -> Iterator[Verdict]:
    """The tongue's neck, and the metal that its groove leaves."""
    wall, metal = print_limit(mount.process, "wall"), print_limit("machined", "wall")
    if neck(found) <= 0.0:
        across = 0.5 * found.width * math.tan(found.angle)
        yield FLANKS_CROSS.found("mount.retention.depth", found.depth, across, "m", width=found.width)
    elif neck(found) < wall.value - ROUNDING:
        yield THIN_NECK.found("mount.retention.width", neck(found), wall.value, "m", source=wall.source,
                              process=mount.process, wider=(found.width + wall.value - neck(found)) * 1e3)
    left = metal_below(design.layout)
    if left is not None and left < metal.value - ROUNDING:
        jaw = mount.jaw
        assert jaw is not None
        yield THIN_METAL.found("mount.retention.depth", left, metal.value, "m", source=metal.source,
                               unverified=unverified(jaw), room=joint_clearance(design.layout))


def _pins(design: Design, mount: Mount, jaw: Jaw, found: Retention) -> Iterator[Verdict]:
    """The pins' diameter and length, and the metal round their holes."""
    pin, room = print_limit(mount.process, "pin"), joint_clearance(design.layout)
    if found.diameter < pin.value - ROUNDING:
        yield THIN_PIN.found("mount.retention.diameter", found.diameter, pin.value, "m", source=pin.source,
                             process=mount.process)
    if found.depth > jaw.height - ROUNDING:
        yield LONG_PIN.found("mount.retention.depth", found.depth, jaw.height, "m", unverified=unverified(jaw))
    radius, metal = found.diameter / 2 + room, print_limit("machined", "wall")
    beside = section(jaw).face / 2 - radius
    assert found.spacing is not None
    ends = min(jaw.length, (jaw.pocket or (jaw.length, 0.0))[0]) / 2 - found.spacing / 2 - radius
    across = (jaw.fenestration or (0.0, 0.0))[1] / 2
    window = found.spacing / 2 - radius - (jaw.fenestration or (0.0, 0.0))[0] / 2 if across else beside
    left = min(beside, ends, window)
    if left < metal.value - ROUNDING and pin_places(design.layout):
        yield THIN_ROUND_PIN.found("mount.retention.spacing", left, metal.value, "m", source=metal.source,
                                   unverified=unverified(jaw))


def mount_holes(design: Design) -> Iterator[Verdict]:
    """Holes for screws: as large as the mount's process makes them."""
    mount = design.spec.mount
    assert mount is not None
    limit = print_limit(mount.process, "hole")
    for hole in mount.holes.holes if mount.holes is not None else ():
        if hole.diameter < limit.value - ROUNDING:
            yield SMALL_HOLE.found("mount.holes", hole.diameter, limit.value, "m", source=limit.source,
                                   process=mount.process)
            return
    if mount.step is not None and mount.kind == "custom":
        yield Undecided("a mount out of a STEP file: its walls and holes are not looked at")


NOTHING_ON_METAL = Case(
    "the {kind} has nothing to stand on: no printed piece lies on the jaw's metal",
    "a larger mount.standoff, a shield nearer to the board (shield.gap), or retention: glue",
)

THIN_NECK = Case(
    "the dovetail's tongue is {measured:m,3} wide at its neck, which {process} does not make: {limit:m,3} at least",
    "mount.retention.width: {wider:.6g}, a smaller depth, or steeper flanks",
)

FLANKS_CROSS = Case(
    "the dovetail is {measured:m,3} deep, and its flanks, {width:m,3} apart at its bottom, meet after {limit:m,3}: "
    "there is no tongue", "a smaller mount.retention.depth, a larger width, or steeper flanks",
)

THIN_METAL = Case(
    "the dovetail's groove, with {room:m,3} of room for the tongue and its glue, leaves {measured:m,3} of the jaw's "
    "metal: {limit:m,3} at least", "a narrower or shallower tongue (mount.retention.width, depth), pins, or glue alone",
    detail="{unverified}",
)

THIN_PIN = Case(
    "the pins are {measured:m,3} thick, which {process} does not make: {limit:m,3} at least",
    "mount.retention.diameter, or another mount.process",
)

LONG_PIN = Case(
    "the pins are {measured:m,3} long, the jaw {limit:m,3} high: they would stand out of its back",
    "mount.retention.depth: less than the jaw's height", detail="{unverified}",
)

THIN_ROUND_PIN = Case(
    "{measured:m,3} of the jaw's metal is left beside the holes for the pins: {limit:m,3} at least",
    "thinner pins (mount.retention.diameter), or another mount.retention.spacing", detail="{unverified}",
)

THIN_BESIDE_WINDOW = Case(
    "a window of {long:m} x {wide:m} leaves {measured:m,3} of the jaw's face beside it: {limit:m,3} at least",
    "mount.jaw.fenestration: a smaller window, or the jaw's true sizes", detail="{unverified}",
)

SMALL_HOLE = Case(
    "holes of {measured:m,3} are wanted, and {process} makes them of {limit:m,3} at least",
    "drill them after printing, or take larger screws (mount.holes)", Severity.WARNING,
)


def printed_wall(design: Design) -> Iterator[Verdict]:
    """The mount's pieces are thick enough to be made."""
    mount = design.spec.mount
    assert mount is not None
    limit = print_limit(mount.process, "wall")
    for name, thickness, is_spacer in _pieces(design.spec, mount):
        if thickness < limit.value - ROUNDING:
            yield TOO_THIN_TO_PRINT.found("shield.gap" if is_spacer else "mount.standoff", thickness, limit.value, "m",
                                          hint=_thicker(design.spec, is_spacer, limit.value), source=limit.source,
                                          name=name, process=mount.process)


def _pieces(spec: SensorSpec, mount: Mount) -> list[tuple[str, float, bool]]:
    """The printed pieces under the board, each with its thickness, and whether it lies between shield and board; a
    bench plate's floor has a least thickness of its own, and a mount of one's own is as it is.
    """
    try:
        sheet = shield_that_fits(spec)
    except PartsError:
        return []
    spans = seat_spans(board_heights(spec)[0], mount.standoff, sheet)
    found = [(name, upper - lower, sheet is not None and lower > sheet[0])
             for name, (lower, upper) in zip(MOUNT_PIECES, spans, strict=False)]
    if mount.kind == "custom":
        return []
    return [piece for piece in found if mount.kind != "bench-plate" or piece[2]]


def _thicker(spec: SensorSpec, is_spacer: bool, wall: float) -> str:
    """How the piece is made thick enough, or left out."""
    if spec.shield is None:
        return f"mount.standoff: {wall * 1e3:.6g}, or 0: the board on the metal itself (SIT201 to SIT203 judge that)"
    on_metal = spec.shield.gap + spec.shield.thickness
    if is_spacer:
        return f"shield.gap: {wall * 1e3:.6g} or more"
    return (
        f"mount.standoff: {on_metal * 1e3:.6g} lays the shield on the metal, {(on_metal + wall) * 1e3:.6g} leaves room "
        "for a piece that can be made"
    )


def carried(design: Design) -> Iterator[Verdict]:
    """The board's body under what is pressed on lies on the mount, the shield or the metal."""
    mount = design.spec.mount
    assert mount is not None
    if mount.kind == "custom" and mount.step is None:
        yield Undecided("the mount is not part of the spec: nothing says what the board lies on")
        return
    try:
        found = support(design.layout)
    except PartsError:
        yield Undecided("the shield does not fit into the standoff")
        return
    if found is None:
        yield Undecided("a mount or a jaw that is a STEP file: SIT326 measures it on the solids")
    else:
        yield from _uncarried(found, _what_carries(design, mount))


def _uncarried(found: Support, hint: str) -> Iterator[Verdict]:
    """What of the board has nothing under it: where it is pressed on, else of all of it."""
    is_all = found.carried >= HALF_OF_IT * found.pressed and found.body_carried < HALF_OF_IT * found.body
    area, of = (found.body_carried, found.body) if is_all else (found.carried, found.pressed)
    if area >= MOST_OF_IT * of - ROUNDING**2 and not is_all:
        return
    whole = f" (of the whole body, on {found.body_carried * 1e6:.3g} of {found.body * 1e6:.3g} mm2)"
    yield NOT_CARRIED.found(
        "mount.standoff", area, (HALF_OF_IT if is_all else MOST_OF_IT) * of, "m2", hint=hint,
        is_grave=area < HALF_OF_IT * of, carried=area * 1e6, whole=of * 1e6,
        under=f"the {BODY}" if is_all or found.name == BODY else f"the board under the {found.name}",
        besides="" if is_all or found.pressed == found.body else whole,
    )


def _what_carries(design: Design, mount: Mount) -> str:
    """What would put something under the board."""
    if mount.kind == "fingertip":
        return "mount.standoff: plastic between the finger and the board carries all of it"
    jaw = fitted_jaw(design.layout)
    if jaw is not None and not mount.standoff:
        return "mount.standoff: a seat bridges the jaw's window, and carries what stands beside its face"
    return (
        "the seat is cut back to the port and the pad pocket: a lower stack (a thinner elastomer, a smaller "
        "mount.standoff), which lays the board nearer to the closed pair's middle, a narrower board, or a wider jaw"
    )


NOT_CARRIED = Case(
    "{under} is carried on {carried:.3g} of its {whole:.3g} mm2{besides}; the rest has nothing under it",
    severity=Severity.WARNING, grave=Severity.ERROR,
)

TOO_THIN_TO_PRINT = Case("the {name} is {measured:m,3} thick, which {process} does not make: {limit:m,3} at least")


RULES: tuple[Rule, ...] = (
    rule_of("SIT315", mount_joint, "jaw"),
    rule_of("SIT316", mount_holes, "mount"),
    rule_of("SIT314", printed_wall, "mount"),
    rule_of("SIT319", carried, "mount"),
)
