"""SIT329 to SIT331, SIT334, SIT335: glue on silicone, distances of a bench plate's holes, tolerances against sizes of
parts, glue that sets too early, and glue on which a film does not cure.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from itertools import combinations

from sitscad.checks.assembly.fit import pad_of
from sitscad.checks.rules import ROUNDING, Rule, Verdict, Violation, own_limits, rule_of
from sitscad.design import Design
from sitscad.estimates.gluing import glued_plan, lying_time, may_set_first, open_adhesives, piece_press
from sitscad.finding import Severity
from sitscad.fixes.moves import each_read
from sitscad.scene.column import print_limit
from sitscad.scene.seating import BESIDE_HEAD, adapter_needed, beside_board
from sitscad.spec import presets
from sitscad.spec.mount import HolePattern, TolerancesDocument
from sitscad.spec.resolver.sensor import toleranced_sizes
from sitscad.units import show


def glue_on_silicone(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the adhesive of the pieces does not hold on silicone, of which the pad is made."""
    glue = design.spec.assembly.adhesive
    if glue is None or glue.bonds_silicone:
        return
    names = [name for name in presets.names("adhesive") if presets.adhesive(name).bonds_silicone]
    primers = (f"{name} with {p}" if (p := presets.adhesive(name).primer) else name for name in names)
    hint = f"assembly.adhesive: {' or '.join(primers)}"
    yield Violation(
        f"{glue.name} does not hold on silicone, and the {pad_of(design.spec).material.name} pad is glued with it on "
        "both faces", hint, "assembly.adhesive", source=glue.source,
        fixes=(lambda: each_read(design.spec, "assembly.adhesive", names),),
    )


def glue_open_times(design: Design) -> Iterator[Verdict]:
    """Yield a finding about the plate, elastomer or target, under which glue sets first, if there is one."""
    spec, glue = design.spec, design.spec.assembly.adhesive
    if glue is None or glue.open_time is None or not spec.assembly.glue_line:
        return
    for part in ("elastomer", "target"):
        if getattr(spec, part) is None or not may_set_first(spec, part):
            continue
        plan, force = glued_plan(spec, part), piece_press(spec, part).force
        takes = lying_time(glue, plan, force, spec.assembly.glue_line)
        if takes <= glue.open_time:
            continue
        others = [each.name for each in open_adhesives(plan, force, spec.elastomer is not None)]
        hint = f"assembly.adhesive: {' or '.join(others)}" if others else f"a smaller {part}"
        yield Violation(
            f"{glue.name} under the {part} flows for {glue.open_time:.3g} s and takes {takes:.2g} s to be spread and "
            f"to lie flat under {show(force, 'N', 2)}", hint, "assembly.adhesive", takes, glue.open_time, "s",
            source=glue.source, fixes=(partial(each_read, spec, "assembly.adhesive", others),),
        )
        return


def film_inhibitors(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the film may stay liquid on what the pieces are glued with."""
    film, glue = design.spec.encapsulation, design.spec.assembly.adhesive
    if film is None or glue is None or not glue.inhibitor or not presets.cures_by_platinum(film.material.name):
        return
    free = [each for each in map(presets.adhesive, presets.names("adhesive")) if not each.inhibitor]
    holds = [each.name for each in free if each.bonds_silicone or design.spec.elastomer is None]
    names = ", ".join(each.name for each in free)
    other = f"assembly.adhesive: {' or '.join(holds)} lets it cure" if holds else (
        f"no adhesive of the table that holds on silicone lets it cure ({names} does, and does not hold)")
    yield Violation(
        f"{film.material.name} cures by platinum, and of {glue.product}, {glue.inhibitor}: it may stay liquid there",
        f"let the glue cure fully, clean the faces and try a drop first; the assembly steps say how; {other}",
        "assembly.adhesive", source=glue.source,
        fixes=(partial(each_read, design.spec, "assembly.adhesive", holds),) if holds else (),
    )


def hole_places(design: Design) -> Iterator[Verdict]:
    """Yield a finding about the two holes of a bench plate that are closest, if they are too close."""
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
    """Yield a finding about the hole farthest under the board if it sends the written holes into a second piece."""
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
    """Yield a finding for each tolerance in the spec that is more than half of its size."""
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


RULES: tuple[Rule, ...] = (
    rule_of("SIT329", glue_on_silicone, "elastomer"),
    rule_of("SIT330", hole_places, "mount"),
    rule_of("SIT331", tolerance_shares),
    rule_of("SIT334", glue_open_times),
    rule_of("SIT335", film_inhibitors),
)
