"""SIT219 and SIT328: what cells read of each other, and whether their plates stand apart."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations

from sitscad.checks.rules import Rule, Undecided, Verdict, Violation, own_limits, rule_of
from sitscad.data import rows
from sitscad.design import Design
from sitscad.finding import Severity
from sitscad.geometry.convex import Footprint
from sitscad.scene.bodies import elastomers, joints, targets
from sitscad.scene.column import print_limit
from sitscad.units import parse_quantity, show


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
    names = ("total", "targets", "target", "coils", "webs")
    total, targets, target, coils, webs = (show(100.0 * getattr(found, name), "%", 2) for name in names)
    each = "; ".join(
        f"{one.words} by {show(100.0 * one.stiffer, '%', 2)}, pressed by {show(100.0 * one.strain, '%', 3)}"
        for one in design.alike_cells)
    yield Violation(
        f"cells read each other: with all around it pressed, a cell changes by at most {total} of its own full signal",
        f"cells farther apart (array.pitch), {'narrower webs (cells.web), ' if found.webs else ''}or smaller targets",
        design.distance_key, found.total, limit.value,
        severity=Severity.WARNING if found.total > limit.value else Severity.NOTE,
        source=limit.source, keeps_limit=found.total <= limit.value,
        detail=f"through the targets of all neighbours at most {targets} (of one {target}), as if the cell had no "
        f"target of its own to hold that off; through coils that wait grounded at most {coils}; "
        + (f"through webs at most {webs}. Webs make pads stiffer, to a fifth of it: of {each} under full force. "
           "Forces, maps and the signal of each cell count its own webs, states those of a mean pad"
           if found.webs else "pads stand apart"),
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
    beside = 2.0 * bulge if joints(spec) else max(wall, 2.0 * bulge)  # one piece has one well in the jig
    finest = max((parse_quantity(row["least"], "length") for row in rows("laser_cutting")
                  if row["material"] == "silicone" and row["least"]), default=0.0)
    if joints(spec) and spec.cells.web is not None and spec.cells.web < finest:
        yield Violation(
            f"webs {show(spec.cells.web, 'm', 3)} wide are narrower than the {show(finest, 'm')} that lasers leave of "
            "silicone (unverified)", f"cells.web: {show(finest, 'm')} or more; or cast the pads", "cells.web",
            spec.cells.web, finest, "m", severity=Severity.WARNING, source="data/laser_cutting.csv",
        )
    for bodies, least in ((elastomers(spec), beside), (targets(spec), wall)):
        pairs = combinations(bodies, 2)
        gap, one, other = min((_gap(a.footprint, b.footprint), a.cell, b.cell) for a, b in pairs)
        what = bodies[0].role.value
        kerf = spec.elastomer.kerf if spec.elastomer is not None and what == "elastomer" else 0.0
        if gap <= 0.0:
            how = f"overlap by {show(-gap, 'm', 3)}" if gap < -1e-9 else "touch"
            yield Violation(
                f"the {what}s of cells {one} and {other} {how}", "", design.distance_key, gap,
                0.0, "m", severity=Severity.ERROR,
            )
        elif gap <= kerf and joints(spec):
            yield Violation(
                f"the {what}s of cells {one} and {other} stand {show(gap, 'm', 3)} apart, where a beam of "
                f"{show(kerf, 'm', 3)} does not pass: joined by webs they would be cut as one plate",
                "", design.distance_key, gap, kerf, "m", severity=Severity.ERROR,
            )
        elif gap < least:
            yield Violation(
                f"the {what}s of cells {one} and {other} stand {show(gap, 'm', 3)} apart; {show(least, 'm', 3)} are "
                "wanted", "", design.distance_key, gap, least, "m", severity=Severity.WARNING,
                detail=f"the jig's wall between them and its clearances take {show(wall, 'm', 3)} (nearer, one well "
                "takes both and places neither against the other); both pads pressed bulge by "
                f"{show(2.0 * bulge, 'm', 3)}",
            )


def _gap(one: Footprint, other: Footprint) -> float:
    """Between two alike plates, neither turned against the other (m); negative where they overlap."""
    if one.is_round:
        return one.centre.distance(other.centre) - one.size[0]
    x, y = (abs(way) - size for way, size in zip(one.place_of(other.centre), one.size, strict=True))
    return math.hypot(max(x, 0.0), max(y, 0.0)) or max(x, y)


RULES: tuple[Rule, ...] = (
    rule_of("SIT219", crosstalk, limit=100.0 * own_limits()["cell_crosstalk"].value),
    rule_of("SIT328", plates_apart),
)
