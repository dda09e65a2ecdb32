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

from sitscad.assembly.places.bodies import MOUNT_PIECES, seat_heights, seat_spans
from sitscad.assembly.places.column import PrintLimit, print_limit
from sitscad.assembly.places.fit import heads_above
from sitscad.assembly.places.jaws import PartsError, section, shield_that_fits
from sitscad.assembly.places.seating import (
    BESIDE_HEAD,
    adapter_needed,
    beside_board,
    joint_clearance,
    metal_below,
    neck,
    pin_places,
    retention,
    screw_spacing,
)
from sitscad.assembly.places.stack import BODY, HALF_OF_IT, MOST_OF_IT, support
from sitscad.basics.finding import Severity
from sitscad.basics.units import show
from sitscad.checks.assembly.fit import jaw_of, pad_of, unverified
from sitscad.checks.fixes.moves import each_read
from sitscad.checks.fixes.search import Family
from sitscad.checks.rules import ROUNDING, Rule, Undecided, Verdict, Violation, own_limits, rule_of
from sitscad.estimates.design import Design
from sitscad.estimates.loads.gluing import (
    HARD_HANDLING,
    MOST_PRESSURE,
    PIECE_HANDLING,
    board_force,
    board_plan,
    glued_plan,
    hard_adhesive,
    lying_time,
    may_set_first,
    open_adhesives,
    piece_press,
)
from sitscad.spec import presets
from sitscad.spec.materials import Shield
from sitscad.spec.mount import HolePattern, Jaw, Mount, Retention, TolerancesDocument
from sitscad.spec.resolver.sensor import toleranced_sizes
from sitscad.spec.sensor import SensorSpec


def mount_joint(design: Design) -> Iterator[Verdict]:
    """Yield findings on tongue or pins of a grasper's pad: their size, and the metal around them."""
    mount, jaw = design.spec.mount, jaw_of(design.spec.jaw)
    found = retention(design.layout.body, design.layout.spec.mount)
    assert mount is not None
    if jaw.fenestration is not None:
        # metal beside a window through the jaw's face and at its ends
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


def _too_little(limit: PrintLimit, have: float, what: str, hint: str, key: str, detail: str = "",
                fixes: tuple[Family, ...] = ()) -> Violation:
    """Return the violation for a length (m) below the smallest that a process makes or that must remain of metal."""
    return Violation(f"{what}: {show(limit.value, 'm', 3)} at least", hint, key, have, limit.value, "m",
                     source=limit.source, detail=detail, fixes=fixes)


def _stands_on_metal(spec: SensorSpec) -> bool:
    """Whether a printed piece lies on the jaw's metal."""
    try:
        shield_that_fits(spec)
    except PartsError:
        return True  # a shield without room has its own finding
    spans, seat = seat_spans(spec), seat_heights(spec.fpc.stackup, spec.mount)
    return bool(spans) and seat is not None and abs(spans[0][0] - seat[0]) < ROUNDING


def _dovetail(design: Design, process: str, jaw: Jaw, found: Retention) -> Iterator[Verdict]:
    """Yield findings on the tongue's neck, and on the metal that remains below its groove."""
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
        wide = _written(found.width + wall.value - narrow)
        yield _too_little(
            wall, narrow,
            f"the dovetail's tongue is {show(narrow, 'm', 3)} wide at its neck, which {process} does not make",
            f"mount.retention.width: {wide:.6g}, a smaller depth, or steeper flanks", "mount.retention.width",
            fixes=(partial(each_read, design.spec, "mount.retention.width", [wide]),),
        )
    left = metal_below(design.layout)
    if left is not None and left < metal.value - ROUNDING:
        room = joint_clearance(design.spec.assembly.glue_line, design.spec.mount)
        yield _too_little(
            metal, left,
            f"the dovetail's groove, with {show(room, 'm', 3)} of room for the tongue and its glue, leaves "
            f"{show(left, 'm', 3)} of the jaw's metal",
            "a narrower or shallower tongue (mount.retention.width, depth), pins, or glue alone",
            "mount.retention.depth", unverified(jaw),
        )


def _pins(design: Design, process: str, jaw: Jaw, found: Retention) -> Iterator[Verdict]:
    """Yield findings on the pins' diameter and length, and on the metal around their holes."""
    pin = print_limit(process, "pin")
    room = joint_clearance(design.layout.spec.assembly.glue_line, design.layout.spec.mount)
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
    if left < metal.value - ROUNDING and pin_places(design.layout.body, design.layout.spec.mount):
        yield _too_little(
            metal, left, f"{show(left, 'm', 3)} of the jaw's metal is left beside the holes for the pins",
            "thinner pins (mount.retention.diameter), or another mount.retention.spacing", "mount.retention.spacing",
            unverified(jaw),
        )


def mount_holes(mount: Mount | None) -> Iterator[Verdict]:
    """Yield findings on screw holes smaller than the mount's process makes."""
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
    """Yield findings on pieces of the mount that are too thin to be made.

    A bench plate's floor has its own minimum thickness. A custom mount is not checked.
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
            key = "shield.gap" if is_spacer else "mount.standoff"
            hint, lengths = _thicker(spec.shield, is_spacer, limit.value)
            yield _too_little(
                limit, upper - lower,
                f"the {name} is {show(upper - lower, 'm', 3)} thick, which {mount.process} does not make", hint, key,
                fixes=(partial(each_read, spec, key, lengths),),
            )


def _thicker(shield: Shield | None, is_spacer: bool, wall: float) -> tuple[str, list[float]]:
    """Return text and lengths (mm) of a key with which a piece is thick enough, or is left out."""
    thick = _written(wall)
    if shield is None:
        return (f"mount.standoff: {thick:.6g}, or 0: the board on the metal itself (SIT201 to SIT203 judge that)",
                [thick, 0.0])
    if is_spacer:
        return f"shield.gap: {thick:.6g} or more", [thick]
    on_metal, over_a_piece = (_written(shield.gap + shield.thickness + more) for more in (0.0, wall))
    return (f"mount.standoff: {on_metal:.6g} lays the shield on the metal, {over_a_piece:.6g} leaves room for a piece "
            "that can be made", [on_metal, over_a_piece])


def _written(length: float) -> float:
    """Return a length in mm, rounded up to the digits of a hint."""
    return round(math.ceil(length * 1e6 - 1e-3) * 1e-3, 3)


def carried(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the board is not supported under the pressed area, or elsewhere, by mount, shield or metal."""
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
    """Return advice to put support under the board."""
    if mount.kind == "fingertip":
        return "mount.standoff: plastic between the finger and the board carries all of it"
    if mount.jaw is not None and not mount.standoff:
        return "mount.standoff: a seat bridges the jaw's window, and carries what stands beside its face"
    return (
        "the seat is cut back to the port and the pad pocket: a lower stack (a thinner elastomer, a smaller "
        "mount.standoff), which lays the board nearer to the closed pair's middle, a narrower board, or a wider jaw"
    )


def glue_on_silicone(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the adhesive of the pieces does not hold on the silicone pad."""
    glue = design.spec.assembly.adhesive
    if glue is None or glue.bonds_silicone:
        return
    names = [name for name in presets.names("adhesive") if presets.adhesive(name).bonds_silicone]
    primers = (f"{name} with {p}" if (p := presets.adhesive(name).primer) else name for name in names)
    hint = f"assembly.adhesive: {' or '.join(primers)}"
    yield Violation(
        f"{glue.name} does not hold on silicone, and the {pad_of(design.spec.elastomer).material.name} pad is glued "
        "with it on both faces", hint, "assembly.adhesive", source=glue.source,
        fixes=(lambda: each_read(design.spec, "assembly.adhesive", names),),
    )


def glue_open_times(design: Design) -> Iterator[Verdict]:
    """Yield a finding on the first part under which the glue sets too early: board, elastomer or target."""
    spec, glue = design.spec, design.spec.assembly.adhesive
    if glue is None or not spec.assembly.glue_line:
        return
    if spec.mount is not None:
        plan, area = board_plan(design.layout)
        used, most = hard_adhesive(design.layout), MOST_PRESSURE * area
        if used is not None and used.open_time is not None and board_force(design.layout, used) > most:
            takes = lying_time(used, plan, most, spec.assembly.glue_line, HARD_HANDLING)
            yield Violation(
                f"{used.name} under the board flows for {used.open_time:.3g} s and takes {takes:.2g} s to be spread, "
                f"handled and pressed flat by {show(most, 'N', 2)}", "a thicker assembly.glue_line or a smaller board",
                "assembly.glue_line", takes, used.open_time, "s", source=used.source,
            )
            return
    if glue.open_time is None:
        return
    for part in ("elastomer", "target"):
        if getattr(spec, part) is None or not may_set_first(spec, part):
            continue
        plan, force = glued_plan(spec, part), piece_press(spec, part).force
        takes = lying_time(glue, plan, force, spec.assembly.glue_line, PIECE_HANDLING)
        if takes <= glue.open_time:
            continue
        others = [each.name for each in open_adhesives(plan, force, spec.elastomer is not None)]
        hint = f"assembly.adhesive: {' or '.join(others)}" if others else f"a smaller {part}"
        yield Violation(
            f"{glue.name} under the {part} flows for {glue.open_time:.3g} s and takes {takes:.2g} s to be spread, "
            f"handled and pressed flat by {show(force, 'N', 2)}", hint, "assembly.adhesive", takes, glue.open_time, "s",
            source=glue.source, fixes=(partial(each_read, spec, "assembly.adhesive", others),),
        )
        return


def film_inhibitors(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the glue of the pieces may keep the film from curing."""
    film, glue = design.spec.encapsulation, design.spec.assembly.adhesive
    if film is None or glue is None or not glue.inhibitor or not presets.cures_by_platinum(film.material.name):
        return
    free = [each for each in map(presets.adhesive, presets.names("adhesive")) if not each.inhibitor]
    holds = [each.name for each in free if each.bonds_silicone or design.spec.elastomer is None]
    other = f"or write assembly.adhesive: {' or '.join(holds)}, which lets it cure" if holds else (
        "where it stays sticky, a barrier coat of clear acrylic lacquer on the glue keeps them apart (unverified)")
    yield Violation(
        f"{film.material.name} cures by platinum, and of {glue.product}, {glue.inhibitor}: it may stay liquid there",
        f"let the glue cure fully, clean the faces and try a drop first; the assembly steps say how; {other}",
        "encapsulation.material", source=glue.source,
        fixes=(partial(each_read, design.spec, "assembly.adhesive", holds),) if holds else (),
    )


def hole_places(design: Design) -> Iterator[Verdict]:
    """Yield a finding on the two nearest holes of a bench plate, if they are too close."""
    mount = design.spec.mount
    pattern = mount.holes if mount is not None else None
    if mount is None or pattern is None or pattern.grid is not None or mount.kind != "bench-plate":
        return
    wall, worst = print_limit(mount.process, "wall"), (math.inf, 0, 0)
    for (i, one), (k, other) in combinations(enumerate(pattern.holes), 2):
        apart = math.dist(one.at, other.at)
        between = apart - 0.5 * (one.diameter + other.diameter) - wall.value
        heads = apart - 0.5 * (one.head + other.head)
        worst = min(worst, (min(between, heads), i, k))
    short, first, second = worst
    if short >= -ROUNDING:
        yield from _under_board(design, pattern)
        return
    one, other = pattern.holes[first], pattern.holes[second]
    apart = math.dist(one.at, other.at)
    yield Violation(
        f"holes {first + 1} and {second + 1} of the plate are {show(apart, 'm', 3)} apart, centre to centre; their "
        f"screw heads and a printable wall need {show(apart - short, 'm', 3)}",
        f"move mount.holes.{second}.at by {show(-short, 'm', 3)}, or remove one of the holes",
        _hole_key(pattern, second), apart, apart - short, "m", source=wall.source,
    )


def _under_board(design: Design, pattern: HolePattern) -> Iterator[Verdict]:
    """Yield a finding on the hole farthest under the board if its place requires a second piece for the given holes."""
    layout, holes = design.layout, adapter_needed(design.layout)
    if not holes or pattern.name != "written out":
        return
    room, k = min((beside_board(layout, hole) - hole.head / 2 - BESIDE_HEAD, k) for k, hole in enumerate(holes))
    needed = holes[k].head / 2 + BESIDE_HEAD
    yield Violation(
        f"hole {k + 1} of the plate is {show(needed + room, 'm', 3)} from the board, its tail or a plate on it; its "
        f"screw needs {show(needed, 'm', 3)}, so a second piece, mount-adapter, gets your holes",
        f"move hole {k + 1} by {show(-room, 'm', 3)}; or keep it, and screw mount-adapter on first",
        _hole_key(pattern, k), needed + room, needed, "m", severity=Severity.WARNING,
    )


def _hole_key(pattern: HolePattern, number: int) -> str:
    return f"mount.holes.{number}.at" if pattern.name == "written out" else "mount.holes"


def tolerance_shares(design: Design) -> Iterator[Verdict]:
    """Yield a finding for each tolerance that is more than half of its size."""
    limit, sizes = own_limits()["tolerance_share"], toleranced_sizes(design.spec)
    for part, tolerance in design.spec.assembly.tolerances:
        size = sizes.get(part)
        if size and tolerance > limit.value * size * (1 + 1e-9):
            yield Violation(
                f"{TolerancesDocument.keys[part].about} is {show(size, 'm')} +- {show(tolerance, 'm')}: "
                f"a tolerance of {100.0 * tolerance / size:.0f} %, maximum {100.0 * limit.value:.0f} %",
                "write half of the band in which your parts were measured",
                f"assembly.tolerances.{part}", tolerance, limit.value * size, "m", source=limit.source,
            )


def counted_metal(mount: Mount | None) -> Iterator[Verdict]:
    """Yield a note if metal behind a custom mount is not part of the spec, because estimates then omit it."""
    if mount is not None and mount.kind == "custom" and mount.metal is None and mount.step is None:
        yield Violation(
            "no metal behind the board is counted: a tube, a tool or a battery there takes signal, up to half of it "
            "where it is a few tenths of a millimetre away",
            "mount.metal_behind: {material: stainless-304, distance: 3, thickness: 1}, if metal lies behind; nothing, "
            "if none does", "mount", severity=Severity.NOTE,
        )


def screw_heads(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the heads of a plate's screws protrude above the sensor.

    A flat part then meets the heads first.
    """
    above = heads_above(design.layout)
    if above is None or above <= ROUNDING:
        return
    apart = screw_spacing(design.layout)
    room = "" if apart is None else f"; their middles are {show(apart[0], 'm')} x {show(apart[1], 'm')} apart"
    yield Violation(
        f"the heads of the plate's screws stand {show(above, 'm', 3)} above the sensor's top face{room}",
        "press with a part that goes between the heads, or take screws with lower heads, or a thicker elastomer",
        "mount.holes", above, 0.0, "m",
    )


RULES: tuple[Rule, ...] = (
    rule_of("SIT315", mount_joint, "jaw"), rule_of("SIT316", lambda design: mount_holes(design.spec.mount), "mount"),
    rule_of("SIT314", printed_wall, "mount"), rule_of("SIT319", carried, "mount"),
    rule_of("SIT329", glue_on_silicone, "elastomer"),
    rule_of("SIT330", hole_places, "mount"),
    rule_of("SIT331", tolerance_shares),
    rule_of("SIT334", glue_open_times),
    rule_of("SIT335", film_inhibitors),
    rule_of("SIT336", lambda design: counted_metal(design.spec.mount), "mount"),
    rule_of("SIT337", screw_heads, "mount"),
)
