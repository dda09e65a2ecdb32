"""SIT130: where a tail has fewer layers than the body: what lies near the step at the body's end."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from sitscad.checks.board.fabrication import FABRICATOR, ROUNDING, house, source_of, um
from sitscad.checks.cases import Case
from sitscad.checks.rules import Complaint, Rule, Verdict
from sitscad.design import Design
from sitscad.finding import Edit, Place, Severity
from sitscad.layout.routing.ring import Ring
from sitscad.layout.tail.thickness import has_tail_coverlay, step_height, tail_copper
from sitscad.remedy.fix import Fix
from sitscad.remedy.search import Left, tried

GRAIN = 0.05e-3
"""Margins are named in steps of this (m)."""


def step(design: Design) -> Iterator[Verdict]:
    """Holes and turns beside the place where the lower layers end and the tail's own coverlay laps in between."""
    layout, rules = design.layout, design.spec.fpc.rules
    if tail_copper(layout) == layout.copper_layers:
        return
    end = layout.body[2]
    through = [via for via in layout.vias if via.lowest is None]
    near = max(through, key=lambda via: via.centre.x + via.drill / 2.0, default=None)
    gap = math.inf if near is None else end - near.centre.x - near.drill / 2.0
    if near is not None and gap < rules.hole_to_step - ROUNDING:
        values = {"net": near.net, "ending": tail_copper(layout) + 1, "house": house(design, "hole_to_step")}
        place = Place(*near.centre, nets=(near.net,))
        yield _too_near(design, HOLE_NEAR_STEP, gap, rules.hole_to_step, "hole_to_step", place, values)
    asked = rules.coverlay_lap + rules.registration
    reach = {p.name: Ring(design.spec.coil, p, 0.0).half_size[0] for p in design.spec.array.placements}
    coil = max(layout.coils, key=lambda coil: coil.centre.x + reach[coil.name])
    gap = end - coil.centre.x - reach[coil.name]
    if has_tail_coverlay(layout) and gap < asked - ROUNDING:
        values = {"coil": coil.name, "lap": rules.coverlay_lap, "registration": rules.registration}
        place = Place(*coil.centre, nets=(coil.net,))
        yield _too_near(design, TURNS_NEAR_STEP, gap, asked, "coverlay_lap", place, values)


def _too_near(
    design: Design, case: Case, gap: float, asked: float, field: str, place: Place, values: dict[str, Any]
) -> Complaint:
    """The complaint for something too near to the step in thickness, and a longer body as the way out."""
    missing, margin = asked - gap, design.spec.fpc.margin
    longer = GRAIN * math.ceil((margin[0] + missing) / GRAIN - 1e-6)
    other = f"or as many layers in the tail (the step is {um(step_height(design.layout))} high)"

    changed = replace(design.spec, fpc=replace(design.spec.fpc, margin=(longer, margin[1])))
    fix = Fix((Edit("fpc.margin", f"[{longer * 1e3:g}, {margin[1] * 1e3:g}]"),), changed)

    def advice(left: Left) -> str:
        return f"{um(missing)} are missing: {fix.words} makes the body longer{tried(fix, left)}, {other}"

    return case.found(
        "fpc.tail.layers",
        gap,
        asked,
        "m",
        source=source_of(design, field),
        place=place,
        advice=advice,
        missing=missing,
        longer=fix.words,
        other=other,
        **values,
    )


LONGER_BODY = "{missing:m} are missing: {longer} makes the body longer, {other}"

HOLE_NEAR_STEP = Case(
    "a hole of {net} stands {measured:m} from the body's end, where copper {ending} and what is below it end; {house} "
    "asks {limit:m}",
    LONGER_BODY,
)

TURNS_NEAR_STEP = Case(
    "the turns of {coil} begin {measured:m} from the body's end, into which the tail's own coverlay laps {lap:m}, laid "
    "within {registration:m}: layers lie farther apart there",
    LONGER_BODY,
)


STEP_RULES: tuple[Rule, ...] = (
    Rule(
        "SIT130", "step", Severity.WARNING,
        "Holes and turns keep their distance from the step where a tail of fewer layers leaves the body.",
        "Resin is drawn away from the step, and barrels near it crack when the tail is bent; the tail's own coverlay "
        "lies between the body's layers there.",
        "Make the body longer (fpc.margin), or run all layers down the tail.",
        FABRICATOR, ("tail",), step,
    ),
)  # fmt: skip
