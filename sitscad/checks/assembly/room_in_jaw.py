"""SIT301 to SIT303: whether the board with its plates fits the jaw, and whether the closed jaws pass through the port.

Sizes are compared with their limits in three ways: nominally, with the root-sum-square of tolerances, and in the worst
case.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache, partial
from itertools import islice

from sitscad.assembly.places.bodies import Body, PartsError, backing_of, plates_of
from sitscad.assembly.places.column import GLUE, column, layer_heights
from sitscad.assembly.places.fit import CLOSED_PAIR, LENGTH, OVERHANG, measures, square_jaws_radius
from sitscad.assembly.places.jaws import POCKET_CLEARANCE, jaw_section, jaw_with_rims
from sitscad.assembly.places.stack import support_width
from sitscad.basics.check_results import Measure
from sitscad.basics.finding import Severity
from sitscad.basics.units import show
from sitscad.checks.assembly.fit import GRAIN, require_jaw, unmeasured_jaw_case
from sitscad.checks.assembly.plates import pair_text as in_brackets
from sitscad.checks.fixes.moves import moved_layer_ends, narrower_coils, reread_change, reread_changes
from sitscad.checks.fixes.references import smaller_references
from sitscad.checks.fixes.search import Family, Fix, with_value
from sitscad.checks.rules import ROUNDING, Rule, Verdict, Violation, not_checked, rule_of, violation_of
from sitscad.estimates.design import Design
from sitscad.kernels.geometry.convex import Box
from sitscad.layout.lanes import coils_breadth
from sitscad.spec.mount import Jaw
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.thermistor import BOARD as ON_BODY
from sitscad.spec.thermistor import TAIL

JAW_SOURCE = "the jaw's figures (mount.jaw); thesis of Jones 2.5: jaw about 5 mm wide, sensing body 5 x 10 mm"

SMALLEST_MEASURED_PORT = 1.1
"""Smallest measured inner diameter of a port, divided by its nominal diameter.

5 mm trocars measure at least 5.5 mm inside (Limperg 2024).
"""

BOARD = "board body"
"""Name of the board's body among the parts of the closed jaws. Smaller coils or margins make it narrower."""

PLATES = ("target", "elastomer", "encapsulation")
"""Names of the parts between the closed jaws whose width is a key of the spec, and of the film that covers them."""

LEAST_STEP = 1e-6
"""Step (m) to which the length by which a part must shrink is rounded up. The bisection for it has this error."""


def sensor_width(design: Design) -> Iterator[Verdict]:
    """Yield findings on parts that are wider than the jaw, its pocket, or the port.

    Elastomer and target are compared with the jaw's width, and the board with the jaw's face and pocket. The flat
    board, with its tail, is compared with the port's diameter. The centre lines of jaw and body lie over each other.
    """
    jaw, across = require_jaw(design.spec.jaw), design.layout.size[1]
    for slab in plates_of(design.spec).all:
        yield from _plate_width_findings(design.layout.body, jaw, slab)
    yield from _face_overhang_findings(design, jaw)
    if design.spec.mount is not None:
        lower = partial(reread_changes, design.spec, "mount.standoff", [jaw.recess * 1e3])
        yield from _pocket_findings(jaw, design.spec.mount.standoff, design.layout.body_size,
                                    design.spec.array.distance_key, (lower,))
    if across > jaw.port_diameter + ROUNDING:
        is_body = across <= design.layout.body_size[1] + ROUNDING
        yield violation_of(
            "flat-body" if is_body else "flat-tail", "coil.outer_diameter" if is_body else "fpc.tail", across,
            jaw.port_diameter, "m", severity=Severity.WARNING, details=unmeasured_jaw_case(jaw),
        )


def _plate_width_findings(body: Box, jaw: Jaw, slab: Body) -> Iterator[Verdict]:
    """Yield a finding if the plate `slab` (elastomer or target) extends sideways beyond both jaw and board.

    `body` is the box of the board's body, whose centre line lies over the centre line of the jaw.
    """
    (_, low, _, high), (_, y0, _, y1) = slab.footprint.box, body
    middle, width = (y0 + y1) / 2, high - low
    needed, room = 2.0 * max(high - middle, middle - low), max(jaw.width, min(y1 - y0, jaw.port_diameter))
    if needed > room + ROUNDING:
        is_aside = needed - width > ROUNDING
        yield violation_of(
            "plate-aside" if is_aside else "plate-wide", f"{slab.role.value}.{'offset' if is_aside else 'size'}",
            needed, room, "m", details=unmeasured_jaw_case(jaw), plate=slab.name, width=width,
            aside=(needed - width) / 2,
            carrier="jaw" if room == jaw.width else "board in its port", excess=(needed - room) / 2,
        )


def _smaller_margin(spec: SensorSpec, axis: int, excess: float) -> Fix | None:
    """Return the change to a smaller ``fpc.margin`` that makes the body shorter by `excess` (m) along `axis`.

    `axis` is 0 for x, 1 for y. The margin is on both sides of the coils, so it is reduced by half of `excess`. None if
    the margin would be negative.
    """
    x, y = spec.fpc.margin
    less = GRAIN * math.floor(((x, y)[axis] - 0.5 * excess + ROUNDING) / GRAIN)
    margin = (less, y) if axis == 0 else (x, less)
    return with_value(spec, "fpc.margin", margin, in_brackets(margin)) if less >= 0.0 else None


def _smaller_margins(spec: SensorSpec, axis: int, excess: float) -> Iterator[Fix]:
    """Yield changes to smaller margins that make the body shorter along `axis` (0: x, 1: y) by `excess` (m) or more.

    The lengths `WIDER_GAPS` are added to `excess` one after the other, because leads may need wider gaps in the smaller
    body.
    """
    for more in WIDER_GAPS:
        if (fix := _smaller_margin(spec, axis, excess + more)) is not None:
            yield fix


WIDER_GAPS = (0.0, 0.02e-3, 0.05e-3, 0.1e-3, 0.2e-3)
"""Lengths (m) that are added to the required shortening of the body, in the order of trial.

A shorter body can need wider gaps between leads, and these gaps take up part of the shortening.
"""

MOST_ENDS = 6
"""Largest number of designs with other end angles of the coil's layers that are tried for a narrower board.

Other end angles move the leads.
"""


def _narrower_boards(spec: SensorSpec, by: float) -> tuple[Family, ...]:
    """Return two families of changes that may make a board narrower by the length `by` (m).

    The first moves the ends of the coil's layers, so that the leads need less width. The second makes the coils
    narrower.
    """
    return lambda: islice(moved_layer_ends(spec), MOST_ENDS), partial(narrower_coils, spec, by)


def _pocket_findings(
    jaw: Jaw, standoff: float, body_size: tuple[float, float], distance_key: str, fixes: tuple[Family, ...]
) -> Iterator[Verdict]:
    """Yield findings on a board that does not fit into the pocket of the jaw.

    `standoff` (m) is the height of the mount under the board, and `body_size` the length and width (m) of the board's
    body. `distance_key` is the spec key that sets the distance of the coils. `fixes` are families of changes for a
    board that lies below the pocket's rim.
    """
    if jaw.pocket is None:
        return
    long, wide = body_size
    length, room = (side - 2.0 * POCKET_CLEARANCE for side in jaw.pocket)
    if long > length + ROUNDING:
        yield violation_of("pocket-long", distance_key, long, length, "m", details=unmeasured_jaw_case(jaw))
    if standoff <= jaw.recess - ROUNDING and wide > room + ROUNDING:
        yield violation_of(
            "pocket-wide", "mount.standoff", wide, room, "m", details=unmeasured_jaw_case(jaw),
            depth=jaw.recess - standoff, standoff=f"{jaw.recess * 1e3:.6g}", fixes=fixes,
        )


def _face_overhang_findings(design: Design, jaw: Jaw) -> Iterator[Verdict]:
    """Yield a finding on a board's body that extends beyond the jaw's face by more than the plastic below it supports.

    If the plastic of the mount supports the whole overhang, the finding is a note.
    """
    over, body = _find_measure(design.fit, OVERHANG), design.layout.body_size[1]
    severity = None if over is None else _severity_of(over)
    if over is None or over.worst <= ROUNDING or (severity is None and over.nominal <= ROUNDING):
        return
    spec, wide = design.spec, support_width(design.layout)
    coils = 2.0 * coils_breadth(spec.all_placements, spec.coil).half
    edges, margin = 2.0 * spec.fpc.rules.copper_to_edge, 2.0 * spec.fpc.margin[1]
    leads, excess = body - coils - edges - margin, 2.0 * (over.worst - over.limit)
    less = None if severity is None else _smaller_margin(spec, 1, excess)
    is_cut = bool(over.limit) and wide is not None and wide < body - ROUNDING
    key, hint, fixes = "coil.outer_diameter", "face-narrower", tuple[Family, ...]()
    if severity is None:
        hint = "face-held"
    elif less is not None:
        key, hint, fixes = "fpc.margin", "face-margin", (lambda: _smaller_margins(spec, 1, excess),)
    elif severity is Severity.ERROR:
        fixes = _narrower_boards(spec, excess)
    has_shares = severity is not None and bool(margin or leads > ROUNDING)
    details = (*["width-shares"] * has_shares, *["width-margin"] * (has_shares and margin > 0.0),
               *["width-leads"] * (has_shares and leads > ROUNDING), "with-tolerances", *["face-cut"] * is_cut,
               *unmeasured_jaw_case(jaw))
    yield violation_of(
        "face-overhang" if over.limit else "face-overhang-bare", key, over.measured, over.limit, "m", hint=hint,
        details=details, severity=severity or Severity.NOTE, fixes=fixes, body=body, overhang=max(0.0, over.nominal),
        face=jaw_section(jaw_with_rims(jaw)).face, excess=excess, coils=coils, edges=edges, margin=margin, leads=leads,
        cut=wide, likely=over.root_sum_square, worst=over.worst,
    )


def sensor_length(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the board's body is longer than the jaw.

    The lengths are compared nominally, with the root-sum-square of tolerances, and in the worst case.
    """
    jaw, measure = require_jaw(design.spec.jaw), _find_measure(design.fit, LENGTH)
    severity = None if measure is None else _severity_of(measure)
    if measure is None or severity is None:
        return
    excess = measure.worst - jaw.length
    less = _smaller_margin(design.spec, 0, excess)
    hint = "length-pitch" if len(design.spec.array.placements) > 1 else "length-coils"
    hint = hint if design.spec.array.reference is None else "length-reference"
    sensor, fixes = design.spec.soldered_thermistor, list[Family]()
    if sensor is not None and sensor.at == ON_BODY:
        hint, fixes = "length-thermistor", [partial(reread_change, design.spec, "readout.thermistor.at", TAIL)]
    yield violation_of(
        "body-length", "fpc.margin" if less else design.spec.array.distance_key, measure.measured, jaw.length, "m",
        hint="length-margin" if less else hint, details=("with-tolerances", *unmeasured_jaw_case(jaw)),
        severity=severity,
        fixes=(*[lambda: _smaller_margins(design.spec, 0, excess)] * bool(less),
               *[partial(smaller_references, design.spec)] * (design.spec.array.reference is not None), *fixes),
        length=measure.nominal, excess=excess,
        likely=measure.root_sum_square, worst=measure.worst,
    )


def stack_height(design: Design) -> Iterator[Verdict]:
    """Yield findings if the closed jaws with the sensor between them do not pass through the port.

    Further findings are on a jaw wider than the port, and on pocket rims that meet before the jaws are closed. For a
    jaw with a STEP file, a note states that jaws with square backs would not pass. Heights include the glue lines. The
    diameter is compared nominally, with the root-sum-square of tolerances, and in the worst case.
    """
    try:
        backing_of(design.spec).shield_that_fits()
    except PartsError as error:
        yield not_checked("stack-unfit", reason=str(error))
        return
    pair, jaw = _find_measure(design.fit, CLOSED_PAIR), require_jaw(design.spec.jaw)
    if jaw.face is None and jaw.width > jaw.port_diameter + ROUNDING:
        yield violation_of("jaw-wide", "mount.jaw.width", jaw.width, jaw.port_diameter, "m",
                           details=unmeasured_jaw_case(jaw))
    # height of the pad pockets' rims, against the distance between the pockets' floors
    at = layer_heights(column(design.layout))
    between = at["opposing-jaw"][0].nominal - at["jaw"][1].nominal
    rims = (jaw.recess if jaw.pocket else 0.0) + (jaw.opposing_recess if jaw.opposing_pocket else 0.0)
    if rims > between + ROUNDING:
        yield violation_of("rims-meet", "mount.jaw.recess", rims, between, "m")
    if pair is not None and _severity_of(pair) is not None:
        yield _stack_height_violation(design, jaw, pair)
    square = square_jaws_radius(design.layout)
    if square is not None and 2.0 * square > jaw.port_diameter + ROUNDING:
        yield violation_of("square-back", "mount.jaw.step", 2.0 * square, jaw.port_diameter, "m",
                           severity=Severity.NOTE)


def _stack_height_violation(design: Design, jaw: Jaw, pair: Measure) -> Violation:
    # The violation for a closed pair that does not pass its port, with the reducible heights, largest first, and
    # the largest tolerances.
    spec, wider = design.spec, SMALLEST_MEASURED_PORT * pair.limit
    heights = [("mount.standoff", spec.mount.standoff if spec.mount else 0.0)]
    heights += [("elastomer.thickness", spec.elastomer.thickness)] if spec.elastomer else []
    heights += [("target.thickness", spec.target.thickness)] if spec.target else []
    heights = sorted(((key, height) for key, height in heights if height > 0.0), key=lambda e: (-e[1], e[0]))
    widest = sorted(pair.parts, key=lambda share: (-share.tolerance, share.part))[:3]

    @cache
    def less_height() -> float:
        return _height_to_take_off(design, pair)

    @cache
    def narrower_by() -> float:
        x0, y0, x1, y1 = design.layout.body

        def passes(less: float) -> bool:
            narrow = replace(design.layout, body=(x0, y0 + 0.5 * less, x1, y1 - 0.5 * less))
            return _pair_measure(measures(narrow)).margin >= 0.0

        # 0 if no narrower board suffices
        return (_least_sufficient_length(passes, -pair.margin, y1 - y0) if pair.decided_by == BOARD else None) or 0.0

    def hint() -> str:
        return "pair-board" if narrower_by() else "pair-plates" if pair.decided_by in PLATES else "pair-height"

    def fixes() -> Iterator[Fix]:
        # less margin, other ends of the layers, or smaller coils, with which the pair passes its port
        by = narrower_by()
        if by and _smaller_margin(spec, 1, by) is not None:
            yield from _smaller_margins(spec, 1, by)
        elif by:
            yield from (fix for family in _narrower_boards(spec, by) for fix in family())

    glue = math.fsum(share.nominal for share in pair.parts if share.part.startswith(GLUE))
    passes_measured = pair.measured <= wider + ROUNDING
    return violation_of(
        "closed-pair", "mount.standoff", pair.measured, jaw.port_diameter, "m", hint=hint, severity=_severity_of(pair),
        details=("with-tolerances", *unmeasured_jaw_case(jaw), *["pair-measured-port"] * passes_measured),
        fixes=(fixes,) if pair.decided_by == BOARD else (), nominal=pair.nominal, part=pair.decided_by, glue=glue,
        heights=[f"{key} {show(height, 'm', 3)}" for key, height in heights], keys=[key for key, _ in heights],
        loose=[f"{share.part} +-{show(share.tolerance, 'm', 3)}" for share in widest], wider=wider, less=less_height,
        by=narrower_by, likely=pair.root_sum_square, worst=pair.worst,
    )


def _pair_measure(fit: tuple[Measure, ...]) -> Measure:
    """Return the measured diameter of the closed jaws with the sensor, compared with the port.

    `fit` must be the fit of a layout in a jaw, with a shield that fits under the board.
    """
    return next(measure for measure in fit if measure.name == CLOSED_PAIR)


def _height_to_take_off(design: Design, pair: Measure) -> float:
    # Height (m) to take off until the pair passes in the case that failed: the circle shrinks by less than the stack.
    # Tried on the elastomer. If the elastomer is missing or too thin, the excess of the circle.
    spec, over = design.spec, pair.measured - pair.limit
    if spec.elastomer is None:
        return over
    pad = spec.elastomer
    counted = {pair.nominal: "nominal", pair.worst: "worst"}.get(pair.measured, "root_sum_square")

    def passes(less: float) -> bool:
        thinner = replace(spec, elastomer=replace(pad, thickness=pad.thickness - less))
        return float(getattr(_pair_measure(measures(replace(design.layout, spec=thinner))), counted)) <= pair.limit

    return _least_sufficient_length(passes, over, pad.thickness) or over


def _least_sufficient_length(passes: Callable[[float], bool], over: float, most: float) -> float | None:
    # The smallest sufficient length (m) between 0.5 and 3 times the excess. None if no such length below `most`
    # suffices.
    steps = (step * over for step in (1.0, 1.2, 1.5, 2.0, 3.0) if step * over < most)
    high = next((length for length in steps if passes(length)), None)
    if high is None:
        return None
    low = 0.5 * over
    while high - low > LEAST_STEP:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if passes(middle) else (middle, high)
    return LEAST_STEP * math.ceil(high / LEAST_STEP)


def _find_measure(fit: tuple[Measure, ...], name: str) -> Measure | None:
    """Return the comparison in `fit` with this name. None if there is no such comparison."""
    return next((measure for measure in fit if measure.name == name), None)


def _severity_of(measure: Measure) -> Severity | None:
    """Return the severity of the finding on a size that exceeds its limit. None if the limit is met.

    It is an error if the nominal or the root-sum-square size exceeds the limit, and a warning if only the worst case
    does.
    """
    if max(measure.nominal, measure.root_sum_square) > measure.limit + ROUNDING:
        return Severity.ERROR
    return Severity.WARNING if measure.worst > measure.limit + ROUNDING else None


RULES: tuple[Rule, ...] = (
    rule_of("SIT301", sensor_width, "jaw", jaw_source=JAW_SOURCE),
    rule_of("SIT302", sensor_length, "jaw", jaw_source=JAW_SOURCE),
    rule_of("SIT303", stack_height, "jaw", jaw_source=JAW_SOURCE),
)
