"""SIT317 and SIT318: do parts lie on the sheet that they are cut from, and the board on the finger that carries it."""

from __future__ import annotations

from collections.abc import Iterator

from sitscad.checks.assembly.fit import ROUNDING
from sitscad.checks.cases import Case
from sitscad.checks.rules import Rule, Verdict
from sitscad.design import Design
from sitscad.finding import Severity
from sitscad.layout.laser_sheet import CutPart, cut_parts, nests, sheet_needed
from sitscad.scene.jaws import PartsError
from sitscad.scene.stack import shield_part
from sitscad.spec.plates import Cutting


def laser_sheet(design: Design) -> Iterator[Verdict]:
    """Elastomer, target and shield, each with its kerf and the coupon beside it, on the sheet; and something between
    two copies that lie side by side.
    """
    spec = design.spec
    if (spec.fpc.boards or 1) == 1 and spec.cutting == Cutting():
        return  # one part is its own drawing, and nothing is said of sheets
    for plate in _cut(design):
        needed = sheet_needed(plate.size, plate.kerf)
        for needs, has in zip(needed, spec.cutting.sheet, strict=True):
            if needs > has + ROUNDING:
                wanted = [max(pair) * 1e3 for pair in zip(needed, spec.cutting.sheet, strict=True)]
                yield SHEET_TOO_SMALL.found("cutting.sheet", needs, has, "m", name=plate.part, x=wanted[0], y=wanted[1])
                break
        else:
            copies = nests(plate.size, plate.kerf, spec.cutting, spec.fpc.boards or 1)
            if copies[0].count > 1 and spec.cutting.gap <= plate.kerf + ROUNDING:
                yield CUTS_MEET.found("cutting.gap", spec.cutting.gap, plate.kerf, "m", name=plate.part)


def _cut(design: Design) -> tuple[CutPart, ...]:
    """What is cut out of sheets; without a shield that does not fit, which is said by another rule."""
    try:
        return (*cut_parts(design.spec), *shield_part(design.layout))
    except PartsError:
        return cut_parts(design.spec)


def finger_carries(design: Design) -> Iterator[Verdict]:
    """The board's body across the finger that a cap slips over."""
    mount = design.spec.mount
    finger = mount.finger if mount is not None else None
    width = design.layout.body_size[1]
    if finger is not None and width > finger.size[0] + ROUNDING:
        yield WIDER_THAN_FINGER.found("mount.finger.size", width, finger.size[0], "m",
                                      over=(width - finger.size[0]) / 2, thin=_metal(design))


def _metal(design: Design) -> str:
    """What the estimate makes of a metal finger narrower than the board."""
    mount = design.spec.mount
    if mount is None or mount.metal is None:
        return ""
    return ", and the estimate takes its metal as endless"


SHEET_TOO_SMALL = Case(
    "the {name} with its kerf and the coupon beside it take {measured:m,4} of a sheet that has {limit:m,4} there",
    "cutting.sheet: [{x:.6g}, {y:.6g}] or larger, the size of yours",
)

CUTS_MEET = Case(
    "copies of the {name} lie so near each other that their cuts are {measured:m} apart, and the beam takes {limit:m}: "
    "nothing stays between them, and an edge is cut twice",
    "leave sheet between them that holds: cutting.gap 1.5 or more",
)

WIDER_THAN_FINGER = Case(
    "the board's body is {measured:m,3} wide, the finger {limit:m,3}: the cap carries {over:m,3} of it on each side "
    "beyond the finger, where it bends under load{thin}", "a wider finger (mount.finger.size), or a narrower board",
)

SHEET_AND_FINGER_RULES: tuple[Rule, ...] = (
    Rule(
        "SIT317", "laser-sheet", Severity.ERROR,
        "Elastomer, target and shield, each with its kerf, the coupon and the margins, lie on the sheet that they are "
        "cut from, and copies so far apart that sheet stays between their cuts.",
        "A shop that is sent a drawing larger than its sheet sends it back; an edge that is cut twice burns, and its "
        "piece moves before the second cut.", "The size of your sheets, or smaller parts; more of `cutting.gap`.",
        "geometry: cutting.sheet, cutting.gap", apply=laser_sheet,
    ),
    Rule("SIT318", "finger-width", Severity.WARNING, "The finger that a cap slips over is as wide as the board's body.",
         "Plastic beside the finger gives way under a force that the sensor shall feel, and tilts its board.",
         "A wider finger, or a narrower board.", "geometry: mount.finger.size", ("mount",), finger_carries),
)
