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
from sitscad.fabrication.notes import build_text
from sitscad.finding import Edit, Place, Severity
from sitscad.layout.bending import least_bend_radius
from sitscad.layout.lanes import Ring
from sitscad.layout.thickness import has_tail_coverlay, step_height, tail_copper, tail_thickness
from sitscad.remedy.fix import Fix
from sitscad.remedy.search import Left, tried
from sitscad.spec.stackup import Plating, Stackup

GRAIN = 0.05e-3
"""Margins are named in steps of this (m)."""


def special_build(design: Design) -> Iterator[Verdict]:
    """What is special about a tail of fewer layers than the body, or about buttons; what the plain build would cost."""
    layout, spec = design.layout, design.spec
    last, count, tail = tail_copper(layout), layout.copper_layers, spec.fpc.tail
    stackup = spec.fpc.stackup.built(spec.fpc.stackup.plating, 0)
    if tail is None or last == count:
        if layout.vias and stackup.plating is Plating.BUTTONS:
            panel = _copper(stackup.built(Plating.PANEL, 0))
            yield BUTTONS.found("fpc.plated", copper=_copper(stackup), panel=panel)
        return
    plain = replace(spec, fpc=replace(spec.fpc, stackup=stackup, tail=replace(tail, layers=count)))
    radii = [least_bend_radius(each) for each in (spec, plain)]
    bent = f" and bends to {um(radii[1])} instead of {um(radii[0])}" if radii[0] and radii[1] else ""
    yield SPECIAL.found("fpc.tail.layers", float(last), float(count), last=last, s="s" * (last > 1), count=count,
                        build=build_text(layout), copper=_copper(spec.fpc.stackup), plain_copper=_copper(stackup),
                        plain=tail_thickness(plain), thin=tail_thickness(spec), bent=bent)


def _copper(stackup: Stackup) -> str:
    """Finished copper from the top, like 30/18/18/30 um."""
    return "/".join(f"{layer.thickness * 1e6:.4g}" for layer in stackup.copper) + " um"


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

    return case.found("fpc.tail.layers", gap, asked, "m", source=source_of(design, field), place=place, advice=advice,
                      missing=missing, longer=fix.words, other=other, **values)


LONGER_BODY = "{missing:m} are missing: {longer} makes the body longer, {other}"

HOLE_NEAR_STEP = Case(
    "a hole of {net} stands {measured:m} from the body's end, where copper {ending} and what is below it end; {house} "
    "asks {limit:m}", LONGER_BODY,
)

TURNS_NEAR_STEP = Case(
    "the turns of {coil} begin {measured:m} from the body's end, into which the tail's own coverlay laps {lap:m}, laid "
    "within {registration:m}: layers lie farther apart there", LONGER_BODY,
)


SPECIAL = Case(
    "a tail of {last} copper layer{s} on a body of {count} is a special build; finished copper {copper}",
    "a house makes the plain build without being asked (leave fpc.tail.layers out: one lamination, through holes only, "
    "finished copper {plain_copper}); its tail is {plain:m} thick instead of {thin:m}{bent}. For this one, have the "
    "steps confirmed with the quotation", detail="{build}",
)


BUTTONS = Case(
    "holes and their pads alone are plated (buttons), so that the tracks stay {copper} of foil: a build to ask for",
    "a house plates the whole panel without being asked, which finishes the copper at {panel} (fpc.plated: panel; the "
    "preset flex-2l-30um is such a board): have the buttons confirmed with the quotation",
)


STEP_RULES: tuple[Rule, ...] = (
    Rule(
        "SIT130", "step", Severity.WARNING,
        "Holes and turns keep their distance from the step where a tail of fewer layers leaves the body.",
        "Resin is drawn away from the step, and barrels near it crack when the tail is bent; the tail's own coverlay "
        "lies between the body's layers there.", "Make the body longer (fpc.margin), or run all layers down the tail.",
        FABRICATOR, ("tail",), step,
    ),
    Rule(
        "SIT132", "build", Severity.NOTE,
        "A tail of fewer copper layers than the body is told: the order of its steps, its own coverlay, two "
        "laminations, what is plated; so are holes and pads that alone are plated.",
        "Holes of the tail are plated before the rest is laminated on, which a service for prototypes does not do "
        "unasked; copper that is plated twice is thicker, has another resistance and wants wider lines.",
        "Leave fpc.tail.layers out where the tail need not bend tightly.", "the build that fpc/readme.txt orders", (),
        special_build,
    ),
)
