"""SIT303: do the closed jaws, with the sensor between them, pass the port."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from sitscad.checks.assembly.fit import ROUNDING, jaw_of, unverified
from sitscad.checks.assembly.measures import JAW_SOURCE, measure_of, weight_of, with_tolerances
from sitscad.checks.cases import Case
from sitscad.checks.rules import Rule, Undecided, Verdict
from sitscad.design import Design
from sitscad.finding import Severity
from sitscad.measured import Measure
from sitscad.scene.column import GLUE, column, levels
from sitscad.scene.fit import CLOSED_PAIR, measures
from sitscad.scene.jaws import PartsError, shield_that_fits
from sitscad.spec.mount import Jaw
from sitscad.units import show

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
    yield from _sunk(design, jaw)
    severity = None if pair is None else weight_of(pair)
    if pair is None or severity is None:
        return
    over = _to_take_off(design, pair)
    yield PAIR_TOO_HIGH.found(
        "mount.standoff",
        pair.measured,
        jaw.port_diameter,
        "m",
        severity=severity,
        nominal=pair.nominal,
        beyond=with_tolerances(pair),
        decided_by=pair.decided_by,
        glue=_glue(pair),
        unverified=unverified(jaw),
        measured_ports=_measured_ports(pair),
        remedy=f"{show(over, 'm', 3)} too much: a narrower board, or less height: {_thinner(design)}"
        if "board" in pair.decided_by
        else f"take {show(over, 'm', 3)} off: {_thinner(design)}",
        widest=_widest(pair),
    )


def _sunk(design: Design, jaw: Jaw) -> Iterator[Verdict]:
    """The rims of pad pockets against what lies between the pockets' floors."""
    at = levels(column(design.layout))
    between = at["opposing-jaw"][0].nominal - at["jaw"][1].nominal
    rims = (jaw.recess if jaw.pocket else 0.0) + (jaw.opposing_recess if jaw.opposing_pocket else 0.0)
    if rims > between + ROUNDING:
        yield SUNK.found("mount.jaw.recess", rims, between, "m")


def _to_take_off(design: Design, pair: Measure) -> float:
    """What height (m) has to go until the pair passes as it failed: the circle shrinks by less than the stack does.
    Tried on the elastomer; where that is not thick enough, or there is none, that by which the circle is too wide.
    """
    spec, over = design.spec, pair.measured - pair.limit
    if spec.elastomer is None:
        return over
    tried = [step * over for step in (1.0, 1.2, 1.5, 2.0, 3.0) if step * over < spec.elastomer.thickness]
    high = next((height for height in tried if _with_less(design, height, pair) <= pair.limit), None)
    if high is None:
        return over
    low = 0.5 * over
    while high - low > LEAST_STEP:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _with_less(design, middle, pair) > pair.limit else (low, middle)
    return LEAST_STEP * math.ceil(high / LEAST_STEP)


LEAST_STEP = 1e-6
"""How fine (m) the height is found that has to go."""


def _with_less(design: Design, height: float, pair: Measure) -> float:
    """The circle (m) that the pair needs with an elastomer so much (m) thinner, counted as the failing one is."""
    spec = design.spec
    assert spec.elastomer is not None
    thinner = replace(spec, elastomer=replace(spec.elastomer, thickness=spec.elastomer.thickness - height))
    found = next(one for one in measures(replace(design.layout, spec=thinner)) if one.name == pair.name)
    return {pair.nominal: found.nominal, pair.worst: found.worst}.get(pair.measured, found.root_sum_square)


def _glue(pair: Measure) -> float:
    return math.fsum(share.nominal for share in pair.parts if share.part.startswith(GLUE))


def _measured_ports(pair: Measure) -> str:
    """Whether ports as they were measured would let it through."""
    wider = SMALLEST_MEASURED_PORT * pair.limit
    if pair.measured > wider + ROUNDING:
        return ""
    return f"it would pass {show(wider, 'm')}, the smallest measured port of that nominal size"


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
    "the closed jaws with the sensor glued between them need a circle of {nominal:m}{beyond}; the port's is {limit:m}",
    detail="the {decided_by} decides, and glue lines are {glue:m,3} of it; {unverified}; {measured_ports}",
    hint="{remedy}; or narrower tolerances: {widest}",
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

PAIR_IN_PORT_RULES: tuple[Rule, ...] = (
    Rule(
        "SIT303", "stack-height", Severity.ERROR,
        "The closed jaws, with the sensor's whole stack and every glue line between them, pass the port's circle: "
        "nominally and by root-sum-square of all tolerances (errors), and at worst (a warning). The stack is higher "
        "than the rims of the pockets that it lies in.",
        "Pieces are glued, and none is as thick as it is drawn. Ports are named by a nominal size, 5.0 mm taken "
        "strictly here; 5 mm ports measure 5.5 to 7.4 mm inside: write mount.jaw.port_diameter where yours is known. "
        "The pad is taken at rest: what it gives way in the port is not counted on.",
        "A thinner elastomer, standoff or target, narrower tolerances, or a jaw with more metal taken away.",
        "Limperg 2024 (JMIG, 10.1016/j.jmig.2024.01.008) for measured ports; tolerances: the report's table of fit; "
        + JAW_SOURCE, ("jaw",), stack_height,
    ),
)
