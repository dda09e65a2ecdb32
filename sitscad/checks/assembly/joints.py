"""SIT315 and SIT316: can the mount's joint with the jaw and its holes be made, and does the jaw bear being cut."""

from __future__ import annotations

import math
from collections.abc import Iterator

from sitscad.checks.assembly.fit import ROUNDING, unverified
from sitscad.checks.cases import Case
from sitscad.checks.rules import Rule, Undecided, Verdict
from sitscad.design import Design
from sitscad.finding import Severity
from sitscad.scene.bodies import board_heights, seat_spans
from sitscad.scene.column import print_limit
from sitscad.scene.jaws import PartsError, section, shield_that_fits
from sitscad.scene.seating import joint_clearance, metal_below, neck, pin_places, retention
from sitscad.spec.mount import Jaw, Mount, Retention


def mount_joint(design: Design) -> Iterator[Verdict]:
    """Tongue or pins of a grasper's pad: made by the mount's process, and with metal enough round them."""
    mount, found = design.spec.mount, retention(design.layout)
    assert mount is not None and mount.jaw is not None
    yield from _window(mount.jaw)
    if found is None:
        return
    if not _stands_on_metal(design):
        yield NOTHING_ON_METAL.found("mount.retention", kind=found.kind)
        return
    yield from _dovetail(design, mount, found) if found.kind == "dovetail" else _pins(design, mount, mount.jaw, found)


def _window(jaw: Jaw) -> Iterator[Verdict]:
    """What a window through the jaw's face leaves of that beside it and at its ends."""
    if jaw.fenestration is None:
        return
    (long, wide), wall = jaw.fenestration, print_limit("machined", "wall")
    left = min((section(jaw).face - wide) / 2, (jaw.length - long) / 2)
    if left < wall.value - ROUNDING:
        yield THIN_BESIDE_WINDOW.found("mount.jaw.fenestration", left, wall.value, "m", source=wall.source,
                                       unverified=unverified(jaw), long=long, wide=wide)


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

JOINT_RULES: tuple[Rule, ...] = (
    Rule(
        "SIT315", "mount-joint", Severity.ERROR,
        "A dovetail's tongue or the pins by which a mount is held can be made by its process, and the jaw has metal "
        "enough left beside and below what is cut for them, and round its window.",
        "A tongue thinner than a process makes breaks off; a jaw that is cut too deep bends or breaks in the patient.",
        "Other sizes in mount.retention, or glue alone.", "sitscad/data/print_limits.csv (metal: machined)", ("jaw",),
        mount_joint,
    ),
    Rule("SIT316", "printed-hole", Severity.WARNING, "Holes for screws are as large as the mount's process makes them.",
         "Smaller holes close while they are printed.", "Drill them after printing, or take larger screws.",
         "sitscad/data/print_limits.csv", ("mount",), mount_holes),
)
