"""SIT314 to SIT316, SIT319, SIT329 to SIT331, SIT334, SIT335: mount, joint with the jaw, holes, tolerances and glue.

The rules check that the mount's pieces, joint and holes can be made, that enough metal of the jaw remains, and that the
board is supported. They check the distances of a bench plate's holes, and tolerances against the sizes of parts. Three
rules check glue: on silicone, glue that sets too early, and glue that keeps a film from curing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from itertools import combinations
from typing import Any

from sitscad.assembly.places.bodies import MOUNT_PIECES, Backing, PartsError, backing_of
from sitscad.assembly.places.column import PrintLimit, print_limit
from sitscad.assembly.places.fit import screw_head_height
from sitscad.assembly.places.jaws import jaw_section
from sitscad.assembly.places.seating import (
    BESIDE_HEAD,
    adapter_holes,
    board_boxes,
    distance_beside_board,
    joint_clearance,
    metal_below,
    pin_places,
    plate_holes,
    retention,
    screw_spacing,
    tongue_neck,
)
from sitscad.assembly.places.stack import BODY, LEAST_GLUABLE_SHARE, LEAST_PRESSED_SHARE, support
from sitscad.basics.finding import Severity
from sitscad.checks.assembly.fit import require_jaw, require_pad, unmeasured_jaw_case
from sitscad.checks.fixes.moves import reread_changes
from sitscad.checks.fixes.search import Family
from sitscad.checks.rules import ROUNDING, Rule, Verdict, Violation, constant_limits, not_checked, rule_of, violation_of
from sitscad.estimates.design import Design
from sitscad.estimates.loads.gluing import (
    HARD_HANDLING,
    MOST_PRESSURE,
    PIECE_HANDLING,
    board_force,
    board_plan,
    glued_footprint,
    hard_adhesive,
    has_too_fast_glue,
    open_adhesives,
    piece_press,
    spreading_time,
)
from sitscad.kernels.geometry.convex import Box
from sitscad.spec import presets
from sitscad.spec.mount import Hole, HolePattern, Jaw, Mount, Retention, TolerancesDocument
from sitscad.spec.resolver.sensor import toleranced_sizes
from sitscad.spec.sensor import SensorSpec


def mount_joint(design: Design) -> Iterator[Verdict]:
    """Yield findings on the joint between mount and jaw: the size of tongue or pins, and the metal around them.

    Further findings are on the metal around a window in the jaw, and on a joint of a piece that does not lie on metal.
    """
    mount, jaw = design.spec.mount, require_jaw(design.spec.jaw)
    joint = retention(design.layout.body, design.layout.spec.mount)
    assert mount is not None
    if jaw.fenestration is not None:
        # metal beside a window through the jaw's face and at its ends
        (long, wide), wall = jaw.fenestration, print_limit("machined", "wall")
        rest = min((jaw_section(jaw).face - wide) / 2, (jaw.length - long) / 2)
        if rest < wall.value - ROUNDING:
            yield _too_little_metal("window-wall", wall, rest, "mount.jaw.fenestration",
                                    details=unmeasured_jaw_case(jaw), long=long, wide=wide)
    if joint is not None and not _stands_on_metal(backing_of(design.spec)):
        yield violation_of("joint-on-nothing", "mount.retention", kind=joint.kind)
    elif joint is not None and joint.kind == "dovetail":
        clearance = joint_clearance(design.spec.assembly.glue_line, design.spec.mount)
        remaining = metal_below(design.layout.body, mount, design.spec.assembly.glue_line)
        yield from _dovetail_findings(design.spec, mount.process, jaw, joint, remaining, clearance)
    elif joint is not None:
        clearance = joint_clearance(design.spec.assembly.glue_line, design.spec.mount)
        places = pin_places(design.layout.body, design.spec.mount)
        yield from _pin_findings(mount.process, jaw, joint, clearance, bool(places))


def _too_little_metal(
    case: str, limit: PrintLimit, have: float, key: str, *, details: tuple[str, ...] = (),
    fixes: tuple[Family, ...] = (), **values: Any,
) -> Violation:
    """Return the violation for a length `have` (m) smaller than `limit`.

    The limit is the smallest size that the printing or cutting process makes, or the least thickness of metal that must
    remain. `case` is the key of the texts in ``data/messages.csv``, and `key` the key of the spec to which the finding
    points. The other arguments are as in `violation_of`.
    """
    return violation_of(case, key, have, limit.value, "m", source=limit.source, details=details, fixes=fixes, **values)


def _stands_on_metal(backing: Backing) -> bool:
    """Whether a printed piece lies on the jaw's metal."""
    try:
        backing.shield_that_fits()
    except PartsError:
        return True  # a shield without room has its own finding
    spans, seat = backing.spans, backing.seat_heights
    return bool(spans) and seat is not None and abs(spans[0][0] - seat[0]) < ROUNDING


def _dovetail_findings(
    spec: SensorSpec, process: str, jaw: Jaw, tongue: Retention, remaining: float | None, clearance: float
) -> Iterator[Verdict]:
    """Yield findings on the neck of the mount's tongue, and on the metal that remains below the tongue's groove.

    `process` is the printing process of the mount, and `tongue` the joint. `remaining` (m) is the thickness of the
    metal below the groove, None if it is not computed. `clearance` (m) is the gap between tongue and groove.
    """
    wall, metal, narrow = print_limit(process, "wall"), print_limit("machined", "wall"), tongue_neck(tongue)
    if narrow <= 0.0:
        yield violation_of("tongue-none", "mount.retention.depth", tongue.depth,
                           0.5 * tongue.width * math.tan(tongue.angle), "m", width=tongue.width)
    elif narrow < wall.value - ROUNDING:
        wide = _rounded_up_mm(tongue.width + wall.value - narrow)
        yield _too_little_metal("tongue-neck", wall, narrow, "mount.retention.width", width=f"{wide:.6g}",
                                process=process,
                                fixes=(partial(reread_changes, spec, "mount.retention.width", [wide]),))
    if remaining is not None and remaining < metal.value - ROUNDING:
        yield _too_little_metal("groove-metal", metal, remaining, "mount.retention.depth",
                                details=unmeasured_jaw_case(jaw), clearance=clearance)


def _pin_findings(
    process: str, jaw: Jaw, pins: Retention, clearance: float, has_places: bool
) -> Iterator[Verdict]:
    """Yield findings on the diameter and length of the mount's pins, and on the metal around the holes for the pins.

    `process` is the printing process of the mount. `clearance` (m) is the gap between pin and hole. `has_places` is
    True if the mount has room for the pins.
    """
    pin = print_limit(process, "pin")
    if pins.diameter < pin.value - ROUNDING:
        yield _too_little_metal("pin-diameter", pin, pins.diameter, "mount.retention.diameter", process=process)
    if pins.depth > jaw.height - ROUNDING:
        yield violation_of("pin-length", "mount.retention.depth", pins.depth, jaw.height, "m",
                           details=unmeasured_jaw_case(jaw))
    radius, metal = pins.diameter / 2 + clearance, print_limit("machined", "wall")
    assert pins.spacing is not None
    remaining = min(jaw_section(jaw).face, min(jaw.length, jaw.pocket[0] if jaw.pocket else jaw.length) - pins.spacing,
                    pins.spacing - jaw.fenestration[0] if jaw.fenestration else math.inf) / 2 - radius
    if remaining < metal.value - ROUNDING and has_places:
        yield _too_little_metal("pin-metal", metal, remaining, "mount.retention.spacing",
                                details=unmeasured_jaw_case(jaw))


def mount_holes(mount: Mount | None) -> Iterator[Verdict]:
    """Yield findings on screw holes smaller than the smallest hole that the mount's manufacturing process makes."""
    assert mount is not None
    limit = print_limit(mount.process, "hole")
    for hole in mount.holes.holes if mount.holes is not None else ():
        if hole.diameter < limit.value - ROUNDING:
            yield violation_of("screw-holes", "mount.holes", hole.diameter, limit.value, "m", severity=Severity.WARNING,
                               source=limit.source, process=mount.process)
            return
    if mount.step is not None and mount.kind == "custom":
        yield not_checked("step-mount")


def printed_wall(design: Design) -> Iterator[Verdict]:
    """Yield findings on pieces of the mount that are too thin to be made.

    A bench plate's floor has its own minimum thickness. A custom mount is not checked.
    """
    spec, mount = design.spec, design.spec.mount
    assert mount is not None
    limit = print_limit(mount.process, "wall")
    try:
        sheet = backing_of(spec).shield_that_fits()
    except PartsError:
        return
    spans = backing_of(spec).spans if mount.kind != "custom" else []
    for name, (lower, upper) in zip(MOUNT_PIECES, spans, strict=False):
        is_spacer = sheet is not None and lower > sheet[0]
        if upper - lower < limit.value - ROUNDING and (is_spacer or mount.kind != "bench-plate"):
            wall = _rounded_up_mm(limit.value)
            sunk = (spec.shield.gap + spec.shield.thickness) if spec.shield is not None else 0.0
            on_metal, over_piece = _rounded_up_mm(sunk), _rounded_up_mm(sunk + limit.value)
            if spec.shield is None:
                hint, key, lengths = "wall-standoff", "mount.standoff", [wall, 0.0]
            elif is_spacer:
                hint, key, lengths = "wall-spacer", "shield.gap", [wall]
            else:
                hint, key, lengths = "wall-shield", "mount.standoff", [on_metal, over_piece]
            yield violation_of(
                "piece-wall", key, upper - lower, limit.value, "m", hint=hint, source=limit.source, piece=name,
                process=mount.process, wall=f"{wall:.6g}", on_metal=f"{on_metal:.6g}", over_piece=f"{over_piece:.6g}",
                fixes=(partial(reread_changes, spec, key, lengths),),
            )


def _rounded_up_mm(length: float) -> float:
    """Return a length in millimetres from a `length` in metres, rounded up to whole micrometres, for hints."""
    return round(math.ceil(length * 1e6 - 1e-3) * 1e-3, 3)


def unsupported_board(design: Design) -> Iterator[Verdict]:
    """Yield a finding if mount, shield or metal do not support the board under the pressed area, or elsewhere."""
    mount = design.spec.mount
    assert mount is not None
    if mount.kind == "custom" and mount.step is None:
        yield not_checked("custom-mount")
        return
    try:
        areas = support(design.layout)
    except PartsError:
        yield not_checked("shield-unfit")
        return
    if areas is None:
        yield not_checked("step-support")
        return
    least = LEAST_GLUABLE_SHARE
    is_all = areas.carried >= least * areas.pressed and areas.body_carried < least * areas.body
    area, of = (areas.body_carried, areas.body) if is_all else (areas.carried, areas.pressed)
    if area < LEAST_PRESSED_SHARE * of - ROUNDING**2 or is_all:
        name = BODY if is_all else areas.name
        details = () if is_all or areas.pressed == areas.body else ("carried-whole",)
        if mount.kind == "fingertip":
            hint = "carried-finger"
        else:
            hint = "carried-window" if mount.jaw is not None and not mount.standoff else "carried-jaw"
        yield violation_of(
            "carried-body" if name == BODY else "carried", "mount.standoff", area,
            (LEAST_GLUABLE_SHARE if is_all else LEAST_PRESSED_SHARE) * of, "m2", hint=hint, details=details,
            severity=Severity.ERROR if area < LEAST_GLUABLE_SHARE * of else Severity.WARNING, part=name, area=of,
            body=areas.body, body_carried=areas.body_carried,
        )


def glue_on_silicone(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the adhesive of the sensor's parts does not bond to the silicone pad."""
    glue = design.spec.assembly.adhesive
    if glue is None or glue.bonds_silicone:
        return
    names = [name for name in presets.names("adhesive") if presets.adhesive(name).bonds_silicone]
    primed = [f"{name} with {p}" if (p := presets.adhesive(name).primer) else name for name in names]
    yield violation_of("glue-silicone", "assembly.adhesive", source=glue.source, glue=glue.name, glues=primed,
                       rubber=require_pad(design.spec.elastomer).material.name,
                       fixes=(lambda: reread_changes(design.spec, "assembly.adhesive", names),))


def glue_open_times(design: Design) -> Iterator[Verdict]:
    """Yield a finding on the first part under which the glue does not spread to its layer thickness in its open time.

    The parts are board, elastomer and target, in this order. The time to spread follows from the part's size, the
    permitted force, and the thickness of the glue line.
    """
    spec, glue = design.spec, design.spec.assembly.adhesive
    if glue is None or not spec.assembly.glue_line:
        return
    if spec.mount is not None:
        plan, area = board_plan(design.layout)
        used, most = hard_adhesive(design.layout), MOST_PRESSURE * area
        if used is not None and used.open_time is not None and board_force(design.layout, used) > most:
            takes = spreading_time(used, plan, most, spec.assembly.glue_line, HARD_HANDLING)
            yield violation_of("glue-board", "assembly.glue_line", takes, used.open_time, "s", source=used.source,
                               glue=used.name, force=most)
            return
    if glue.open_time is None:
        return
    for part in ("elastomer", "target"):
        if getattr(spec, part) is None or not has_too_fast_glue(spec, part):
            continue
        plan, force = glued_footprint(spec, part), piece_press(spec, part).force
        takes = spreading_time(glue, plan, force, spec.assembly.glue_line, PIECE_HANDLING)
        if takes <= glue.open_time:
            continue
        adhesives = [each.name for each in open_adhesives(plan, force, spec.elastomer is not None)]
        yield violation_of("glue-part", "assembly.adhesive", takes, glue.open_time, "s", source=glue.source,
                           hint="" if adhesives else "glue-part-smaller", glue=glue.name, part=part, force=force,
                           others=adhesives, fixes=(partial(reread_changes, spec, "assembly.adhesive", adhesives),))
        return


def film_inhibitors(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the glue of the sensor's parts may prevent the film from curing."""
    film, glue = design.spec.encapsulation, design.spec.assembly.adhesive
    if film is None or glue is None or not glue.inhibitor or not presets.cures_by_platinum(film.material.name):
        return
    free = [each for each in map(presets.adhesive, presets.names("adhesive")) if not each.inhibitor]
    holds = [each.name for each in free if each.bonds_silicone or design.spec.elastomer is None]
    yield violation_of("film-inhibited", "encapsulation.material", source=glue.source,
                       hint="" if holds else "film-barrier", film=film.material.name, glue=glue.product,
                       inhibitor=glue.inhibitor, others=holds,
                       fixes=(partial(reread_changes, design.spec, "assembly.adhesive", holds),) if holds else ())


def hole_places(design: Design) -> Iterator[Verdict]:
    """Yield a finding on the two holes of a bench plate with the least room between them, if this room is too small.

    The wall between the holes must have the minimum thickness, and the heads of their screws must not overlap. If all
    holes have room, there may be a warning for a hole too near to the board.
    """
    mount = design.spec.mount
    pattern = mount.holes if mount is not None else None
    if mount is None or pattern is None or pattern.grid is not None or mount.kind != "bench-plate":
        return
    wall, worst = print_limit(mount.process, "wall"), (math.inf, 0, 0)
    for (i, hole), (k, next_hole) in combinations(enumerate(pattern.holes), 2):
        apart = math.dist(hole.at, next_hole.at)
        between = apart - 0.5 * (hole.diameter + next_hole.diameter) - wall.value
        heads = apart - 0.5 * (hole.head + next_hole.head)
        worst = min(worst, (min(between, heads), i, k))
    short, first, second = worst
    if short >= -ROUNDING:
        yield from _hole_under_board_findings(pattern, adapter_holes(design.layout), board_boxes(design.layout))
        return
    apart = math.dist(pattern.holes[first].at, pattern.holes[second].at)
    yield violation_of("plate-holes", _hole_key(pattern, second), apart, apart - short, "m", source=wall.source,
                       holes=(first + 1, second + 1), moved=f"mount.holes.{second}.at", missing=-short)


def _hole_under_board_findings(pattern: HolePattern, holes: tuple[Hole, ...], boxes: list[Box]) -> Iterator[Verdict]:
    """Yield a warning for the hole nearest to the board, if the head of its screw has no room beside the board.

    `holes` are the holes of the mount's second piece, which is needed if a hole lies under board or tail. `boxes` are
    the rectangles of the board, its tail and its plates. There is no warning without a second piece, or if the spec
    does not list the places of the holes in `pattern`.
    """
    if not holes or pattern.name != "written out":
        return
    room, k = min((distance_beside_board(boxes, hole) - hole.head / 2 - BESIDE_HEAD, k) for k, hole in enumerate(holes))
    needed = holes[k].head / 2 + BESIDE_HEAD
    yield violation_of("hole-under-board", _hole_key(pattern, k), needed + room, needed, "m", severity=Severity.WARNING,
                       hole=k + 1, missing=-room)


def _hole_key(pattern: HolePattern, number: int) -> str:
    return f"mount.holes.{number}.at" if pattern.name == "written out" else "mount.holes"


def tolerance_shares(design: Design) -> Iterator[Verdict]:
    """Yield a finding for each tolerance that exceeds the permitted fraction of the part's size.

    The fraction is the limit `tolerance_share` of ``data/own_limits.csv``.
    """
    limit, sizes = constant_limits()["tolerance_share"], toleranced_sizes(design.spec)
    for part, tolerance in design.spec.assembly.tolerances:
        size = sizes.get(part)
        if size and tolerance > limit.value * size * (1 + 1e-9):
            yield violation_of(
                "tolerance", f"assembly.tolerances.{part}", tolerance, limit.value * size, "m", source=limit.source,
                part=TolerancesDocument.keys[part].about, size=size, ratio=tolerance / size, most=limit.value,
            )


def missing_metal_note(mount: Mount | None) -> Iterator[Verdict]:
    """Yield a note for a custom mount if the spec describes no metal behind it. Estimates then assume no metal."""
    if mount is not None and mount.kind == "custom" and mount.metal is None and mount.step is None:
        yield violation_of("metal-behind", "mount", severity=Severity.NOTE)


def screw_heads(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the screw heads of a bench plate are higher than the sensor.

    A flat object then touches the screw heads before the sensor.
    """
    above = screw_head_height(design.layout)
    if above is None or above <= ROUNDING:
        return
    apart = screw_spacing(plate_holes(design.layout))
    yield violation_of("screw-heads", "mount.holes", above, 0.0, "m",
                       details=() if apart is None else ("screw-heads-apart",), apart=apart)


RULES: tuple[Rule, ...] = (
    rule_of("SIT315", mount_joint, "jaw"), rule_of("SIT316", lambda design: mount_holes(design.spec.mount), "mount"),
    rule_of("SIT314", printed_wall, "mount"), rule_of("SIT319", unsupported_board, "mount"),
    rule_of("SIT329", glue_on_silicone, "elastomer"),
    rule_of("SIT330", hole_places, "mount"),
    rule_of("SIT331", tolerance_shares),
    rule_of("SIT334", glue_open_times),
    rule_of("SIT335", film_inhibitors),
    rule_of("SIT336", lambda design: missing_metal_note(design.spec.mount), "mount"),
    rule_of("SIT337", screw_heads, "mount"),
)
