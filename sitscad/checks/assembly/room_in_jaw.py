"""SIT301 to SIT303: does the board, with what lies on it, fit the jaw and its port, and do the closed jaws pass it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import islice

from sitscad.checks.assembly.fit import (
    GRAIN,
    JAW_SOURCE,
    ROUNDING,
    jaw_of,
    measure_of,
    unverified,
    weight_of,
    with_tolerances,
)
from sitscad.checks.rules import Advice, Case, Rule, Undecided, Verdict, rule_of
from sitscad.design import Design
from sitscad.finding import Severity
from sitscad.geometry.path import bounding_box
from sitscad.layout.board import Layout
from sitscad.layout.lanes import coils_breadth
from sitscad.measured import Measure
from sitscad.remedy.moves import narrower, other_ends
from sitscad.remedy.search import Fix, Left, first_or_vain, named, setting, tried, ways
from sitscad.scene.bodies import Body, above_board
from sitscad.scene.column import GLUE, column, levels
from sitscad.scene.fit import CLOSED_PAIR, LENGTH, OVERHANG, measures
from sitscad.scene.jaws import POCKET_CLEARANCE, PartsError, rim, section, shield_that_fits
from sitscad.scene.stack import width_under
from sitscad.spec.mount import Jaw
from sitscad.spec.sensor import SensorSpec
from sitscad.units import show


def sensor_width(design: Design) -> Iterator[Verdict]:
    """Board, elastomer and target across the jaw, whose middle lies under the body's."""
    jaw = jaw_of(design)
    for slab in above_board(design.spec):
        yield from _across_jaw(design, jaw, slab)
    yield from _overhang(design, jaw)
    yield from _in_pocket(design, jaw, design.layout.body_size[1])
    yield from _through_port(design)


def _across_jaw(design: Design, jaw: Jaw, slab: Body) -> Iterator[Verdict]:
    """Elastomer or target across the jaw, each where it stands, beyond both the jaw and the board that carries it."""
    (_, low, _, high), (_, y0, _, y1) = slab.footprint.box, design.layout.body
    middle, width = (y0 + y1) / 2, high - low
    needed, carried = 2.0 * max(high - middle, middle - low), min(y1 - y0, jaw.port_diameter)
    room = max(jaw.width, carried)
    if needed <= room + ROUNDING:
        return
    aside = needed - width > ROUNDING
    beside = f" and its middle {show((needed - width) / 2, 'm', 3)} beside the jaw's" if aside else ""
    yield PLATE_TOO_WIDE.found(f"{slab.name}.{'offset' if aside else 'size'}", needed, room, "m", name=slab.name,
                               width=width, beside=beside, carrier="jaw" if room == jaw.width else "board in its port",
                               unverified=unverified(jaw), excess=(needed - room) / 2, side="that" if aside else "each",
                               middle=", one that stands in the middle" if aside else "")


def _shares(design: Design) -> str:
    """What the body's width is made of, where leads or vias beside the coils take a part of it."""
    spec, width = design.spec, design.layout.body_size[1]
    coils = 2.0 * coils_breadth(spec).half
    edges = 2.0 * spec.fpc.rules.copper_to_edge
    margin = 2.0 * spec.fpc.margin[1]
    beside = width - coils - edges - margin
    parts = [f"coils {show(coils, 'm')}", f"board's edges {show(edges, 'm')}"]
    if margin:
        parts.append(f"fpc.margin {show(margin, 'm')}")
    if beside > ROUNDING:
        parts.append(f"and {show(beside, 'm')} for leads and vias that pass beside the coils")
    return f" ({', '.join(parts)})" if len(parts) > 2 else ""


def _less_margin(spec: SensorSpec, axis: int, excess: float) -> Fix | None:
    """The margin with which the body is so much (m) smaller along an axis; none where it has too little."""
    x, y = spec.fpc.margin
    less = GRAIN * math.floor(((x, y)[axis] - 0.5 * excess + ROUNDING) / GRAIN)
    margin = (less, y) if axis == 0 else (x, less)
    written = f"[{margin[0] * 1e3:.6g}, {margin[1] * 1e3:.6g}]"
    return setting(spec, "fpc.margin", margin, written) if less >= 0.0 else None


def _advice(less: Fix | None, before: str = "", after: str = "") -> Advice | None:
    """A hint with less of the margin, and what became of it when it was tried; none where there is none to take."""
    return None if less is None else lambda left: f"{before}{less.words}{tried(less, left)}{after}"


def _narrower_body(design: Design, excess: float, left: Left) -> str:
    """Ends of the layers whose leads leave elsewhere, or smaller coils: the first of each that fits."""
    found = ways((islice(_led_otherwise(design, OVERHANG, left), 1), narrower(design.spec, excess)), left)
    if found:
        return f"{show(excess, 'm')} too much: {named(found)} fits (it was tried); or {OTHER_SEAT}"
    return f"{show(excess, 'm')} too much: {NARROWER}, or {OTHER_SEAT}"


def _led_otherwise(design: Design, name: str, left: Left) -> Iterator[Fix]:
    """Other ends of the layers whose leads leave the body so narrow that a measure is an error no more, or no warning
    where it is one now; as far as the budget goes.
    """
    now = measure_of(design, name)
    for fix in other_ends(design.spec):
        layout = left.drawn(fix.spec)
        if now is None or layout is None:
            return
        then = measure_of(Design(fix.spec, layout), name)
        if then is not None and weight_of(then) not in (Severity.ERROR, weight_of(now)):
            yield fix


def _through_port(design: Design) -> Iterator[Verdict]:
    """A warning where the whole board, laid flat, is wider than the port."""
    jaw, (_, low, _, high) = jaw_of(design), bounding_box((design.layout.outline,))
    across = high - low
    is_body = across <= design.layout.body_size[1] + ROUNDING
    if across > jaw.port_diameter + ROUNDING:
        at_tail = "a straight tail, fewer contacts, a finer connector"
        yield WIDER_THAN_PORT.found("coil.outer_diameter" if is_body else "fpc.tail", across, jaw.port_diameter, "m",
                                    unverified=unverified(jaw),
                                    remedy="the body decides, make it narrower" if is_body else at_tail)


def _in_pocket(design: Design, jaw: Jaw, body: float) -> Iterator[Verdict]:
    """A board below the rims of a pad pocket has to go into it."""
    mount = design.spec.mount
    if jaw.pocket is None or mount is None:
        return
    length = jaw.pocket[0] - 2.0 * POCKET_CLEARANCE
    if design.layout.body_size[0] > length + ROUNDING:
        long = design.layout.body_size[0]
        yield LONGER_THAN_POCKET.found(design.distance_key, long, length, "m", unverified=unverified(jaw))
    if mount.standoff > jaw.recess - ROUNDING:
        return
    room = jaw.pocket[1] - 2.0 * POCKET_CLEARANCE
    if body > room + ROUNDING:
        yield WIDER_THAN_POCKET.found("mount.standoff", body, room, "m", below=jaw.recess - mount.standoff,
                                      unverified=unverified(jaw), over=jaw.recess * 1e3)


def _overhang(design: Design, jaw: Jaw) -> Iterator[Verdict]:
    """The board beside the jaw's true face: how far it stands over it, against what the seat below holds."""
    over = measure_of(design, OVERHANG)
    if over is None or over.worst <= ROUNDING:
        return
    severity = weight_of(over)
    if severity is None and over.nominal <= ROUNDING:
        return
    excess = 2.0 * (over.worst - over.limit)
    less = _less_margin(design.spec, 1, excess) if severity is not None else None
    wide = width_under(design.layout)
    cut = (
        f", which the port leaves {show(wide, 'm')} wide there"
        if wide is not None and wide < design.layout.body_size[1] - ROUNDING
        else ""
    )
    carried = f"the {show(over.limit, 'm', 3)} of plastic under it{cut}" if over.limit else "nothing under it"
    is_coils = severity is Severity.ERROR and not less
    yield (HELD_BY_PLASTIC if severity is None else BODY_OVER_FACE).found(
        "fpc.margin" if less else "coil.outer_diameter", over.measured, over.limit, "m", severity=severity,
        advice=(lambda left: _narrower_body(design, excess, left)) if is_coils
        else _advice(less, after=f", or {OTHER_SEAT}"), body=design.layout.body_size[1],
        shares="" if severity is None else _shares(design), over=max(0.0, over.nominal), face=section(rim(jaw)).face,
        unverified=unverified(jaw), beyond=with_tolerances(over), carried=carried,
        remedy=f"{less.words if less else 'a narrower board'}, or {OTHER_SEAT}",
    )


OTHER_SEAT = "a thicker seat (mount.standoff), or a jaw with a wider face"


def sensor_length(design: Design) -> Iterator[Verdict]:
    """The board's body along the jaw."""
    jaw, measure = jaw_of(design), measure_of(design, LENGTH)
    severity = None if measure is None else weight_of(measure)
    if measure is None or severity is None:
        return
    excess = measure.worst - jaw.length
    less = _less_margin(design.spec, 0, excess)
    many = len(design.spec.array.placements) > 1
    yield BODY_TOO_LONG.found(
        "fpc.margin" if less else design.distance_key, measure.measured, jaw.length, "m", severity=severity,
        nominal=measure.nominal, beyond=with_tolerances(measure), unverified=unverified(jaw), excess=excess,
        advice=_advice(less, f"{show(excess, 'm')} too much at worst: "),
        remedy=less.words if less else f"fewer or smaller coils{', or a smaller pitch' if many else ''}",
    )


PLATE_TOO_WIDE = Case(
    "the {name} is {width:m} wide{beside}, the {carrier} {limit:m}",
    hint="{excess:m} too much on {side} side: a smaller part{middle}, or a wider jaw", detail="{unverified}",
)

WIDER_THAN_PORT = Case(
    "the whole board is {measured:m} wide where it is laid flat, its tail and contacts included; the port leaves "
    "{limit:m}", hint="it goes through the port rolled or from behind only: {remedy}", severity=Severity.WARNING,
    detail="{unverified}",
)

LONGER_THAN_POCKET = Case(
    "the board's body is {measured:m} long, and what lies under it has {limit:m} in the jaw's pocket",
    "a shorter board (fewer or smaller coils), or a jaw with a longer pocket", detail="{unverified}",
)

WIDER_THAN_POCKET = Case(
    "the board's body is {measured:m} wide and lies {below:m,3} below the rims of the jaw's pocket, which leaves "
    "{limit:m}", "mount.standoff: {over:.6g} or more lays it over the rims, or a narrower board", detail="{unverified}",
)

_BODY_OVER_FACE = (
    "the board's body, {body:m} wide{shares}, stands {over:m,3} over each side of the jaw's face, which is {face:m} "
    "wide{beyond}; "
)

BODY_OVER_FACE = Case(_BODY_OVER_FACE + "it is to be held by {carried}", "{remedy}", detail="{unverified}")

HELD_BY_PLASTIC = Case(
    _BODY_OVER_FACE + "held by {carried}",
    "nothing has to be changed for that: the mount is cut back to the port's circle; a narrower board would lie on "
    "metal altogether", Severity.NOTE, detail="{unverified}",
)

BODY_TOO_LONG = Case(
    "the board's body is {nominal:m} long{beyond}, the jaw {limit:m}", hint="{excess:m} too much at worst: {remedy}",
    detail="{unverified}",
)

SMALLEST_MEASURED_PORT = 1.1
"""5 mm trocars measure 5.5 mm inside at the least (Limperg 2024): that much more than the nominal port."""


def stack_height(design: Design) -> Iterator[Verdict]:
    """The closed pair of jaws with the whole stack between them, glue and tolerances included, inside the port."""
    try:
        shield_that_fits(design.spec)
    except PartsError as error:
        yield Undecided(str(error))
        return
    pair, jaw = measure_of(design, CLOSED_PAIR), jaw_of(design)
    if jaw.face is None and jaw.width > jaw.port_diameter + ROUNDING:
        yield JAW_TOO_WIDE.found("mount.jaw.width", jaw.width, jaw.port_diameter, "m", unverified=unverified(jaw))
    # the rims of pad pockets against what lies between the pockets' floors
    at = levels(column(design.layout))
    between = at["opposing-jaw"][0].nominal - at["jaw"][1].nominal
    rims = (jaw.recess if jaw.pocket else 0.0) + (jaw.opposing_recess if jaw.opposing_pocket else 0.0)
    if rims > between + ROUNDING:
        yield SUNK.found("mount.jaw.recess", rims, between, "m")
    severity = None if pair is None else weight_of(pair)
    if pair is None or severity is None:
        return
    wider = SMALLEST_MEASURED_PORT * pair.limit
    passes = f"it would pass {show(wider, 'm')}, the smallest measured port of that nominal size"
    less = f"take {show(_height_to_take_off(design, pair), 'm', 3)} off: {_thinner(design)}"
    narrower_by = _width_to_take_off(design, pair) if pair.decided_by == BOARD else None
    otherwise = f"{less}; or narrower tolerances: {_widest(pair)}"
    plates = "a narrower target, and elastomer, or " if pair.decided_by in PLATES else ""
    yield PAIR_TOO_HIGH.found(
        "mount.standoff", pair.measured, jaw.port_diameter, "m", severity=severity, nominal=pair.nominal,
        beyond=with_tolerances(pair), decided_by=pair.decided_by, unverified=unverified(jaw),
        glue=math.fsum(share.nominal for share in pair.parts if share.part.startswith(GLUE)),
        measured_ports="" if pair.measured > wider + ROUNDING else passes,
        remedy=f"{_narrower_by(narrower_by)} {NARROWER}; or {otherwise}" if narrower_by else plates + otherwise,
        advice=(lambda left: _narrower_in_port(design, narrower_by, otherwise, left)) if narrower_by else None,
    )


BOARD = "board body"
"""The closed pair's piece that a smaller coil or margin makes narrower."""

PLATES = ("target", "elastomer", "encapsulation")
"""Its pieces that are as wide as the spec says, and the film on them."""


NARROWER = "smaller coils, narrower leads and gaps (fpc.rules)"


def _narrower_by(width: float) -> str:
    return f"a board narrower by {show(width, 'm', 3)}:"


def _narrower_in_port(design: Design, by: float, otherwise: str, left: Left) -> str:
    """Less margin, other ends of the layers, or smaller coils, with which the board's edges leave the pair its port."""
    margin = _less_margin(design.spec, 1, by)
    led = islice(_led_otherwise(design, CLOSED_PAIR, left), 1)
    fixes = [margin] if margin else [*led, *narrower(design.spec, by)]
    found = first_or_vain(fixes, left, ("", otherwise, f"{NARROWER}; or {otherwise}"))
    return f"{_narrower_by(by)} {found}" if found else ""


def _width_to_take_off(design: Design, pair: Measure) -> float | None:
    """By how much (m) the board is to be narrower until the pair passes at worst; None where that is not enough."""
    x0, y0, x1, y1 = design.layout.body

    def passes(less: float) -> bool:
        return _pair(replace(design.layout, body=(x0, y0 + 0.5 * less, x1, y1 - 0.5 * less))).margin >= 0.0

    return _least_that(passes, -pair.margin, y1 - y0)


def _pair(layout: Layout) -> Measure:
    """The closed pair's measure of a layout in a jaw that its shield fits."""
    return next(one for one in measures(layout) if one.name == CLOSED_PAIR)


def _height_to_take_off(design: Design, pair: Measure) -> float:
    """What height (m) has to go until the pair passes as it failed: the circle shrinks by less than the stack does.
    Tried on the elastomer; where that is not thick enough, or there is none, that by which the circle is too wide.
    """
    spec, over = design.spec, pair.measured - pair.limit
    if spec.elastomer is None:
        return over
    pad = spec.elastomer
    counted = {pair.nominal: "nominal", pair.worst: "worst"}.get(pair.measured, "root_sum_square")

    def passes(less: float) -> bool:
        thinner = replace(spec, elastomer=replace(pad, thickness=pad.thickness - less))
        return float(getattr(_pair(replace(design.layout, spec=thinner)), counted)) <= pair.limit

    return _least_that(passes, over, pad.thickness) or over


def _least_that(passes: Callable[[float], bool], over: float, most: float) -> float | None:
    """The least length (m) that is enough, of some between half of what is too much and three times that; None where
    none below `most` is.
    """
    tried_ones = [step * over for step in (1.0, 1.2, 1.5, 2.0, 3.0) if step * over < most]
    high = next((length for length in tried_ones if passes(length)), None)
    if high is None:
        return None
    low = 0.5 * over
    while high - low > LEAST_STEP:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if passes(middle) else (middle, high)
    return LEAST_STEP * math.ceil(high / LEAST_STEP)


LEAST_STEP = 1e-6
"""How fine (m) a length is found that has to go."""


def _widest(pair: Measure) -> str:
    """The parts that tolerances change most, and the key that narrows them where yours are better."""
    found = sorted(pair.parts, key=lambda share: (-share.tolerance, share.part))[:3]
    named_parts = ", ".join(f"{share.part} +-{show(share.tolerance, 'm', 3)}" for share in found)
    return f"{named_parts} (assembly.tolerances, where yours are measured)"


def _thinner(design: Design) -> str:
    """The soft or empty heights that can give, largest first."""
    spec = design.spec
    standoff = "mount.standoff (from the metal's face up to the board's bottom face)"
    heights = [(standoff, spec.mount.standoff if spec.mount else 0.0)]
    if spec.elastomer is not None:
        heights.append(("elastomer.thickness", spec.elastomer.thickness))
    if spec.target is not None:
        heights.append(("target.thickness", spec.target.thickness))
    heights = [entry for entry in sorted(heights, key=lambda e: (-e[1], e[0])) if entry[1] > 0.0]
    return ", ".join(f"{key} is {show(height, 'm', 3)}" for key, height in heights)


PAIR_TOO_HIGH = Case(
    "the closed jaws with the sensor glued between them need a circle of {nominal:m}{beyond}, which the {decided_by} "
    "decides; the port's is {limit:m}", detail="glue lines are {glue:m,3} of it; {unverified}; {measured_ports}",
    hint="{remedy}",
)


JAW_TOO_WIDE = Case(
    "the jaw alone is {measured:m} wide, the port {limit:m}: its back was taken as round as the port, and so narrower "
    "than the jaw", hint="mount.jaw.port_diameter: that of the port that this jaw passes", detail="{unverified}",
)

SUNK = Case(
    "the rims of the pad pockets are {measured:m,3} high together, and {limit:m,3} lie between the pockets' floors: "
    "they meet before anything touches the sensor, which feels nothing",
    hint="a higher stack (mount.standoff), or mount.jaw.recess as it is measured",
)


RULES: tuple[Rule, ...] = (
    rule_of("SIT301", sensor_width, "jaw", jaw_source=JAW_SOURCE),
    rule_of("SIT302", sensor_length, "jaw", jaw_source=JAW_SOURCE),
    rule_of("SIT303", stack_height, "jaw", jaw_source=JAW_SOURCE),
)
