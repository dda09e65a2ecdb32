"""SIT314 to SIT316 and SIT319: can the mount's pieces, its joint with the jaw and its holes be made, does the jaw bear
being cut, and does what is left carry the board.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from sitscad.checks.assembly.fit import jaw_of, unverified
from sitscad.checks.rules import ROUNDING, Rule, Undecided, Verdict, Violation, rule_of
from sitscad.design import Design
from sitscad.finding import Severity
from sitscad.scene.bodies import MOUNT_PIECES, seat_heights, seat_spans
from sitscad.scene.column import PrintLimit, print_limit
from sitscad.scene.jaws import PartsError, section, shield_that_fits
from sitscad.scene.seating import joint_clearance, metal_below, neck, pin_places, retention
from sitscad.scene.stack import BODY, HALF_OF_IT, MOST_OF_IT, support
from sitscad.spec.materials import Shield
from sitscad.spec.mount import Jaw, Mount, Retention
from sitscad.spec.sensor import SensorSpec
from sitscad.units import show


def mount_joint(design: Design) -> Iterator[Verdict]:
    """Tongue or pins of a grasper's pad: made by the mount's process, and with metal enough round them."""
    mount, jaw, found = design.spec.mount, jaw_of(design.spec), retention(design.layout)
    assert mount is not None
    if jaw.fenestration is not None:
        # what a window through the jaw's face leaves beside it and at its ends
        (long, wide), wall = jaw.fenestration, print_limit("machined", "wall")
        left = min((section(jaw).face - wide) / 2, (jaw.length - long) / 2)
        if left < wall.value - ROUNDING:
            yield _too_little(
                wall, left, f"a window of {show(long, 'm')} x {show(wide, 'm')} leaves {show(left, 'm', 3)} of the "
                "jaw's face beside it", "mount.jaw.fenestration: a smaller window, or the jaw's true sizes",
                "mount.jaw.fenestration", unverified(jaw),
            )
    if found is not None and not _stands_on_metal(design.spec):
        yield Violation(
            f"the {found.kind} has nothing to stand on: no printed piece lies on the jaw's metal",
            "a larger mount.standoff, a shield nearer to the board (shield.gap), or retention: glue", "mount.retention",
        )
    elif found is not None:
        yield from (_dovetail if found.kind == "dovetail" else _pins)(design, mount.process, jaw, found)


def _too_little(limit: PrintLimit, have: float, what: str, hint: str, key: str, detail: str = "") -> Violation:
    """The complaint about a length (m), in words, below the least that a process makes or that is left of metal."""
    return Violation(f"{what}: {show(limit.value, 'm', 3)} at least", hint, key, have, limit.value, "m",
                     source=limit.source, detail=detail)


def _stands_on_metal(spec: SensorSpec) -> bool:
    """Whether a printed piece lies on the jaw's metal."""
    try:
        shield_that_fits(spec)
    except PartsError:
        return True  # which is a finding of its own
    spans, seat = seat_spans(spec), seat_heights(spec)
    return bool(spans) and seat is not None and abs(spans[0][0] - seat[0]) < ROUNDING


def _dovetail(design: Design, process: str, jaw: Jaw, found: Retention) -> Iterator[Verdict]:
    """The tongue's neck, and the metal that its groove leaves."""
    wall, metal, narrow = print_limit(process, "wall"), print_limit("machined", "wall"), neck(found)
    if narrow <= 0.0:
        across = 0.5 * found.width * math.tan(found.angle)
        yield Violation(
            f"the dovetail is {show(found.depth, 'm', 3)} deep, and its flanks, {show(found.width, 'm', 3)} apart at "
            f"its bottom, meet after {show(across, 'm', 3)}: there is no tongue",
            "a smaller mount.retention.depth, a larger width, or steeper flanks", "mount.retention.depth", found.depth,
            across, "m",
        )
    elif narrow < wall.value - ROUNDING:
        yield _too_little(
            wall, narrow,
            f"the dovetail's tongue is {show(narrow, 'm', 3)} wide at its neck, which {process} does not make",
            f"mount.retention.width: {(found.width + wall.value - narrow) * 1e3:.6g}, a smaller depth, or steeper "
            "flanks", "mount.retention.width",
        )
    left = metal_below(design.layout)
    if left is not None and left < metal.value - ROUNDING:
        yield _too_little(
            metal, left, f"the dovetail's groove, with {show(joint_clearance(design.spec), 'm', 3)} of room for the "
            f"tongue and its glue, leaves {show(left, 'm', 3)} of the jaw's metal",
            "a narrower or shallower tongue (mount.retention.width, depth), pins, or glue alone",
            "mount.retention.depth", unverified(jaw),
        )


def _pins(design: Design, process: str, jaw: Jaw, found: Retention) -> Iterator[Verdict]:
    """The pins' diameter and length, and the metal round their holes."""
    pin, room = print_limit(process, "pin"), joint_clearance(design.layout.spec)
    if found.diameter < pin.value - ROUNDING:
        yield _too_little(
            pin, found.diameter, f"the pins are {show(found.diameter, 'm', 3)} thick, which {process} does not make",
            "mount.retention.diameter, or another mount.process", "mount.retention.diameter",
        )
    if found.depth > jaw.height - ROUNDING:
        yield Violation(
            f"the pins are {show(found.depth, 'm', 3)} long, the jaw {show(jaw.height, 'm', 3)} high: they would "
            "stand out of its back", "mount.retention.depth: less than the jaw's height", "mount.retention.depth",
            found.depth, jaw.height, "m", detail=unverified(jaw),
        )
    radius, metal = found.diameter / 2 + room, print_limit("machined", "wall")
    assert found.spacing is not None
    left = min(section(jaw).face, min(jaw.length, jaw.pocket[0] if jaw.pocket else jaw.length) - found.spacing,
               found.spacing - jaw.fenestration[0] if jaw.fenestration else math.inf) / 2 - radius
    if left < metal.value - ROUNDING and pin_places(design.layout):
        yield _too_little(
            metal, left, f"{show(left, 'm', 3)} of the jaw's metal is left beside the holes for the pins",
            "thinner pins (mount.retention.diameter), or another mount.retention.spacing", "mount.retention.spacing",
            unverified(jaw),
        )


def mount_holes(design: Design) -> Iterator[Verdict]:
    """Holes for screws: as large as the mount's process makes them."""
    mount = design.spec.mount
    assert mount is not None
    limit = print_limit(mount.process, "hole")
    for hole in mount.holes.holes if mount.holes is not None else ():
        if hole.diameter < limit.value - ROUNDING:
            yield Violation(
                f"holes of {show(hole.diameter, 'm', 3)} are wanted, and {mount.process} makes them of "
                f"{show(limit.value, 'm', 3)} at least",
                "drill them after printing, or take larger screws (mount.holes)", "mount.holes", hole.diameter,
                limit.value, "m", severity=Severity.WARNING, source=limit.source,
            )
            return
    if mount.step is not None and mount.kind == "custom":
        yield Undecided("a mount out of a STEP file: its walls and holes are not looked at")


def printed_wall(design: Design) -> Iterator[Verdict]:
    """The mount's pieces are thick enough to be made; a bench plate's floor has a least thickness of its own, and a
    mount of one's own is as it is.
    """
    spec, mount = design.spec, design.spec.mount
    assert mount is not None
    limit = print_limit(mount.process, "wall")
    try:
        sheet = shield_that_fits(spec)
    except PartsError:
        return
    spans = seat_spans(spec) if mount.kind != "custom" else []
    for name, (lower, upper) in zip(MOUNT_PIECES, spans, strict=False):
        is_spacer = sheet is not None and lower > sheet[0]
        if upper - lower < limit.value - ROUNDING and (is_spacer or mount.kind != "bench-plate"):
            yield _too_little(
                limit, upper - lower,
                f"the {name} is {show(upper - lower, 'm', 3)} thick, which {mount.process} does not make",
                _thicker(spec.shield, is_spacer, limit.value), "shield.gap" if is_spacer else "mount.standoff",
            )


def _thicker(shield: Shield | None, is_spacer: bool, wall: float) -> str:
    """How the piece is made thick enough, or left out."""
    if shield is None:
        return f"mount.standoff: {wall * 1e3:.6g}, or 0: the board on the metal itself (SIT201 to SIT203 judge that)"
    if is_spacer:
        return f"shield.gap: {wall * 1e3:.6g} or more"
    on_metal = shield.gap + shield.thickness
    return (
        f"mount.standoff: {on_metal * 1e3:.6g} lays the shield on the metal, {(on_metal + wall) * 1e3:.6g} leaves room "
        "for a piece that can be made"
    )


def carried(design: Design) -> Iterator[Verdict]:
    """The board's body under what is pressed on lies on the mount, the shield or the metal: where it is pressed on,
    else all of it.
    """
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
        return
    is_all = found.carried >= HALF_OF_IT * found.pressed and found.body_carried < HALF_OF_IT * found.body
    area, of = (found.body_carried, found.body) if is_all else (found.carried, found.pressed)
    if area < MOST_OF_IT * of - ROUNDING**2 or is_all:
        whole = f" (of the whole body, on {found.body_carried * 1e6:.3g} of {found.body * 1e6:.3g} mm2)"
        under = f"the {BODY}" if is_all or found.name == BODY else f"the board under the {found.name}"
        besides = "" if is_all or found.pressed == found.body else whole
        yield Violation(
            f"{under} is carried on {area * 1e6:.3g} of its {of * 1e6:.3g} mm2{besides}; the rest has nothing under it",
            _what_carries(mount), "mount.standoff", area, (HALF_OF_IT if is_all else MOST_OF_IT) * of, "m2",
            severity=Severity.ERROR if area < HALF_OF_IT * of else Severity.WARNING,
        )


def _what_carries(mount: Mount) -> str:
    """What would put something under the board."""
    if mount.kind == "fingertip":
        return "mount.standoff: plastic between the finger and the board carries all of it"
    if mount.jaw is not None and not mount.standoff:
        return "mount.standoff: a seat bridges the jaw's window, and carries what stands beside its face"
    return (
        "the seat is cut back to the port and the pad pocket: a lower stack (a thinner elastomer, a smaller "
        "mount.standoff), which lays the board nearer to the closed pair's middle, a narrower board, or a wider jaw"
    )


RULES: tuple[Rule, ...] = (
    rule_of("SIT315", mount_joint, "jaw"), rule_of("SIT316", mount_holes, "mount"),
    rule_of("SIT314", printed_wall, "mount"), rule_of("SIT319", carried, "mount"),
)
