"""SIT219 and SIT328: what cells read of each other, and whether their plates stand apart."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations

from sitscad.checks.rules import Case, Rule, Undecided, Verdict, own_limits, rule_of
from sitscad.design import Design
from sitscad.finding import Severity
from sitscad.geometry.convex import Footprint
from sitscad.scene.bodies import elastomers, targets
from sitscad.scene.column import print_limit


def crosstalk(design: Design) -> Iterator[Verdict]:
    """What neighbouring cells change of a cell's reading, in parts of its full signal: stated, and held to a limit."""
    if design.spec.cells is None:
        return
    found, limit = design.crosstalk, own_limits()["cell_crosstalk"]
    if found is None:
        yield Undecided("no cell has a signal of its own to hold its neighbours' against")
        return
    if design.spec.encapsulation is not None:
        yield Undecided("what the film over all cells carries from one to the next is not computed")
    yield CROSSTALK.found(
        design.distance_key, found.total, limit.value, None, is_grave=found.total > limit.value, source=limit.source,
        target=found.target, targets=found.targets, coils=found.coils, keeps_limit=found.total <= limit.value,
    )


def plates_apart(design: Design) -> Iterator[Verdict]:
    """The gap between neighbouring cells' plates: more than the jig's wall between them needs, and than pads bulge."""
    spec = design.spec
    if spec.cells is None:
        return
    from sitscad.estimates.states.pressing import pressed  # loaded by the estimates

    process = spec.mount.process if spec.mount is not None else "resin"
    wall = print_limit(process, "wall").value + 2.0 * print_limit(process, "clearance").value
    bulge = 0.0
    if spec.requirements.normal_force and spec.elastomer is not None:
        x, y = spec.elastomer.size
        bulge = 1.5 * pressed(spec).strain * x * y / (2.0 * (x + y))
    for bodies, least in ((elastomers(spec), max(wall, 2.0 * bulge)), (targets(spec), wall)):
        pairs = combinations(bodies, 2)
        gap, one, other = min((_gap(a.footprint, b.footprint), a.cell, b.cell) for a, b in pairs)
        what = bodies[0].role.value
        if gap <= 0.0:
            yield OVERLAP.found(design.distance_key, gap, 0.0, "m", what=what, one=one, other=other, over=-gap)
        elif gap < least:
            yield CLOSE.found(design.distance_key, gap, least, "m", what=what, one=one, other=other, bulge=2.0 * bulge,
                              wall=wall)


def _gap(one: Footprint, other: Footprint) -> float:
    """Between two alike plates, neither turned against the other (m); negative where they overlap."""
    if one.is_round:
        return one.centre.distance(other.centre) - one.size[0]
    x, y = (abs(way) - size for way, size in zip(one.place_of(other.centre), one.size, strict=True))
    return math.hypot(max(x, 0.0), max(y, 0.0)) or max(x, y)


CROSSTALK = Case(
    "cells read each other: with all around it pressed, a cell changes by at most {measured:%.2g} % of its own full "
    "signal",
    detail="through the targets of all neighbours at most {targets:%.2g} % (of one {target:%.2g} %), as if the cell "
    "had no target of its own to hold that off; through coils that wait grounded at most {coils:%.2g} %; pads stand "
    "apart",
    hint="cells farther apart (array.pitch), or smaller targets", severity=Severity.NOTE, grave=Severity.WARNING,
)

OVERLAP = Case("the {what}s of cells {one} and {other} overlap by {over:m,3}", severity=Severity.ERROR)

CLOSE = Case(
    "the {what}s of cells {one} and {other} stand {measured:m,3} apart; {limit:m,3} are wanted",
    detail="the jig's wall between them and its clearances take {wall:m,3}; both pads pressed bulge by {bulge:m,3}",
    severity=Severity.WARNING,
)

RULES: tuple[Rule, ...] = (
    rule_of("SIT219", crosstalk, limit=100.0 * own_limits()["cell_crosstalk"].value),
    rule_of("SIT328", plates_apart),
)
