"""The quick level: many designs at once, each figure with what it may be off by.

Nothing is led out (`layout.sketch`), estimates are those of a tolerance for screening, and what a sensor
feels comes from a chart of few points. Rules are asked that need no more than that: of all others, and of those whose
limit lies within what a figure may be off by, it is not known what they would say.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache

from sitscad.checks import CheckResult, all_rules
from sitscad.checks.assembly.fit import weight_of
from sitscad.checks.rules import NEEDS, Rule, Violation, apply_rule, located, named
from sitscad.data import rows
from sitscad.design import Design
from sitscad.estimates import Estimates, estimated
from sitscad.estimates.values import CoilEstimate, StateEstimate
from sitscad.estimates.winding.losses import SCREENING
from sitscad.finding import Finding, Severity
from sitscad.inspection import as_configured
from sitscad.layout import sketch
from sitscad.layout.routes import in_line
from sitscad.measured import RequirementResult
from sitscad.scene.fit import CLOSED_PAIR
from sitscad.scene.state import PRESSED, REST
from sitscad.spec.sensor import SensorSpec
from sitscad.study.evaluation import SCREEN, Evaluation
from sitscad.study.full import breaches, figures, judged
from sitscad.study.measures import MEASURES

BY_SPEC = ("SIT101", "SIT102", "SIT103", "SIT117", "SIT131", "SIT304", "SIT305", "SIT306", "SIT308", "SIT309", "SIT313",
           "SIT314", "SIT327")
"""Rules that ask for figures of the spec and of its parts alone."""

STACK_HEIGHT = "SIT303"

BY_BODY = ("SIT301", "SIT302", "SIT307", "SIT315")
"""Those that ask how large the board is, which is known of coils in line."""

BY_TANK = ("SIT201", "SIT202", "SIT203", "SIT204", "SIT205", "SIT206", "SIT207", "SIT208", "SIT209", "SIT210", "SIT211",
           "SIT213", "SIT214", "SIT215", "SIT217")
"""Those that ask for the electrical figures."""

BY_FEELING = ("SIT401", "SIT402")
"""Those that ask how finely forces are felt."""

IN_FULL = "it takes the full level"


def screened(specs: Sequence[SensorSpec], measures: Sequence[str]) -> list[Evaluation]:
    """What is said of every design, whatever the others are; ``unknown`` are rules that `check` may decide."""
    return [
        _screened(spec, measures) if can_screen(spec) else replace(judged(spec, measures, SCREEN), unknown=())
        for spec in specs
    ]


def can_screen(spec: SensorSpec) -> bool:
    """Whether the quick level has a model of a design: round coils, no window in the jaw, a target of a conductor."""
    jaw = spec.mount.jaw if spec.mount is not None else None
    is_whole = jaw is None or jaw.fenestration is None
    is_plain = spec.target is None or spec.target.material.relative_permeability < 1.1
    return spec.coil.outline.is_round and is_whole and is_plain


@cache
def screen_errors() -> Mapping[str, float]:
    """What a figure may be off by against the full level, relative, by the measure's name."""
    return {row["measure"]: float(row["error"]) for row in rows("screen_errors")}


def _screened(spec: SensorSpec, measures: Sequence[str]) -> Evaluation:
    layout = sketch(spec)
    design = Design(spec, layout, estimated(layout, tolerance=SCREENING))
    wanted = [name for name in measures if SCREEN in MEASURES[name].levels]
    values, absent = figures(design, wanted)
    absent |= {name: IN_FULL for name in measures if name not in wanted}
    if not in_line(spec):
        wide = {"fit.width", "fit.length", "fit.closed_pair", "fit.spare", "board.area"} & values.keys()
        absent |= dict.fromkeys(sorted(wide), IN_FULL)
        values = {name: pair for name, pair in values.items() if name not in wide}
    found, unknown = _judged(design)
    grave = tuple(one for one in found if one.severity is not Severity.NOTE)
    said = as_configured(spec, CheckResult(grave, ())).findings if grave else ()
    return Evaluation(
        {name: (value, max(error, screen_errors().get(name, 0.0) * abs(value)))
         for name, (value, error) in values.items()},
        absent, breaches(said, Severity.ERROR), breaches(said, Severity.WARNING),
        tuple(sorted(unknown)), SCREEN,
    )


def _judged(design: Design) -> tuple[list[Finding], set[str]]:
    """What the rules find that can be asked, and which others the design has needs for."""
    found: list[Finding] = []
    unknown: set[str] = set()
    corners = [Design(design.spec, design.layout, shifted(design.estimates, side)) for side in (-1.0, 1.0)]
    for rule in all_rules():
        if rule.apply is not None and all(NEEDS[need][0](design.spec) for need in rule.needs):
            said = _said(rule, design, corners)
            found += said or ()
            unknown |= {rule.id} if said is None else set()
    return found, unknown


def _said(rule: Rule, design: Design, corners: Sequence[Design]) -> list[Finding] | None:
    """What a rule finds; None where that is not known."""
    if rule.id == STACK_HEIGHT and in_line(design.spec):
        return _stack_height(rule, design)
    asked = {*BY_SPEC, *BY_TANK, *BY_FEELING, *(BY_BODY if in_line(design.spec) else ())}
    if rule.id not in asked:
        return None
    found, undecided = apply_rule(rule, design)
    if undecided or (rule.id in BY_FEELING and _is_near(rule, design)):
        return None
    if rule.id in BY_TANK and any(_grave(apply_rule(rule, corner)[0]) != _grave(found) for corner in corners):
        return None
    return found


def _stack_height(rule: Rule, design: Design) -> list[Finding] | None:
    """What the rule of that name finds, without looking for what would mend it."""
    pair = next((one for one in design.fit if one.name == CLOSED_PAIR), None)
    if pair is None:
        return None
    severity = weight_of(pair)
    if severity is None:
        return apply_rule(rule, design)[0]
    too_high = Violation("", measured=pair.measured, limit=pair.limit, unit="m", severity=severity)
    return [located(named(rule, too_high, design.converter), design.spec)]


def _grave(findings: Sequence[Finding]) -> list[Severity]:
    """Errors and warnings among them."""
    return sorted({one.severity for one in findings} - {Severity.NOTE})


def _is_near(rule: Rule, design: Design) -> bool:
    """Whether what is felt lies within its error of what is asked."""
    error = screen_errors()["resolution.normal"]
    asked = design.once("reached", dict[str, RequirementResult]).values()
    return any(one.limit and one.rule == rule.id and abs(one.measured / one.limit - 1.0) < error for one in asked)


def shifted(estimates: Estimates, side: float) -> Estimates:
    """The estimates where all that screening may be off by makes tanks better (1) or worse (-1)."""
    return replace(estimates, coils=tuple(_shifted(coil, side) for coil in estimates.coils))


def _shifted(coil: CoilEstimate, side: float) -> CoilEstimate:
    errors = screen_errors()
    by_l, by_f, by_r = 1.0 + side * errors["inductance"], 1.0 - side * errors["frequency"], 1.0 + side * errors["rp"]

    def state(one: StateEstimate) -> StateEstimate:
        """A state where the tank is so much better."""
        of_inductance = ("inductance", "apparent_inductance", "converter_inductance")
        more = {name: getattr(one, name) * by_l for name in of_inductance if getattr(one, name) is not None}
        more |= {name: getattr(one, name) * by_r for name in ("parallel_resistance", "quality_factor", "amplitude")}
        return replace(one, frequency=one.frequency * by_f, resistance=one.resistance / by_r, **more)

    states = {name: state(one) for name, one in coil.states.items()}
    if REST in states and PRESSED in states:
        states[PRESSED] = _farther(states[REST], states[PRESSED], 1.0 + side * errors["signal.normal"])
    return replace(
        coil, states=states,
        terminal_inductance=coil.terminal_inductance * by_l, sensor_frequency=coil.sensor_frequency * by_f,
        parallel_resistance=coil.parallel_resistance * by_r, quality_factor=coil.quality_factor * by_r,
    )


def _farther(rest: StateEstimate, pressed: StateEstimate, part: float) -> StateEstimate:
    """The state pressed with so much of its change from rest."""
    names = ("inductance", "frequency", "converter_inductance")
    pairs = {name: (getattr(rest, name), getattr(pressed, name)) for name in names}
    changed = {name: before + part * (after - before) for name, (before, after) in pairs.items()
               if before is not None and after is not None}
    return replace(pressed, **changed)
