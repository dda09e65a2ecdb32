"""The file of a study: its keys, their validation, and the text of a first study for a spec.

All faults are reported at once, each with its position in the file.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from functools import cached_property
from typing import Any, ClassVar

from sitscad.apps.study.evaluating import can_screen, evaluate_design
from sitscad.apps.study.measures import MEASURES, similar_measures_text
from sitscad.apps.study.space import (
    Base,
    Point,
    RangeError,
    Space,
    Variable,
    comparable_value,
    require_key,
    values_by_step,
)
from sitscad.apps.study.spreads import SPREADS
from sitscad.basics.record import record
from sitscad.basics.units import UNITS, fixed_decimals, in_mm
from sitscad.spec.circuit import BodySpec
from sitscad.spec.coil import INNER, TURNS, CoilSpec
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.format.kinds import Number, Special, Text, describe, refuse
from sitscad.spec.format.section import Section, key, schema_of
from sitscad.spec.load import is_overlapping
from sitscad.spec.materials import ElastomerPad
from sitscad.spec.mount import Jaw
from sitscad.spec.reading import Remarks, SpecError
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.yaml.source import dotted

VERSION = 1
MOST_KEYS, MOST_GOALS, MOST_KEPT, MOST_GRID = 16, 3, 8, 1_000_000
METHODS = ("auto", "grid", "sobol", "nsga2", "de")
ALL = "all"


def _version(value: Any) -> int:
    if isinstance(value, bool) or value != VERSION or not isinstance(value, int):
        refuse("SIT008", f"{describe(value)} is no version of studies that is known here",
               f"write sitscad_study: {VERSION}")
    return VERSION


def _mapping(value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        refuse("SIT004", f"{describe(value)}, where a section of keys and values is wanted", "")
    return dict(value)


def _list(value: Any) -> list[Any]:
    if not isinstance(value, list) or not value:
        refuse("SIT004", f"{describe(value)}, where a list is wanted", "write it like [one, other]")
    return list(value)


def _accepted_rules(value: Any) -> tuple[str, ...]:
    if value == ALL:
        return (ALL,)
    if not isinstance(value, list) or not all(isinstance(each, str) for each in value):
        refuse("SIT004", f"{describe(value)}, where a list of rules is wanted, or `all`", "like [SIT103]")
    return tuple(value)


_VALUE = {"anyOf": [{"type": "number"}, {"type": "string"}]}
_RANGE = {"type": "object", "additionalProperties": False, "required": ["from", "to"],
          "properties": {"from": _VALUE, "to": _VALUE, "step": _VALUE}}
_VARY = Special(_mapping, {"type": "object", "minProperties": 1, "maxProperties": MOST_KEYS,
                           "additionalProperties": {"anyOf": [_RANGE, {"type": "array", "minItems": 1}]}})
_SAME = Special(_mapping, {"type": "object", "additionalProperties": {"type": "string"}})
_WITH = Special(_mapping, {"type": "object", "additionalProperties": {
    "type": "object", "additionalProperties": {"type": "object"}}})
_GOAL = {"type": "object", "additionalProperties": False, "minProperties": 1, "maxProperties": 1,
         "properties": {word: {"enum": list(MEASURES)} for word in ("minimize", "maximize")}}
_GOALS = Special(_list, {"type": "array", "minItems": 1, "maxItems": MOST_GOALS, "items": _GOAL})
_REQUIRE = Special(_mapping, {"type": "object", "additionalProperties": False, "properties": {
    name: {"type": "string", "pattern": "^(>=|<=)", "description": row.meaning} for name, row in MEASURES.items()}})
_ACCEPT = Special(_accepted_rules, {"anyOf": [{"const": ALL}, {"type": "array", "items": {"type": "string"}}]})
_SPREAD = Special(_mapping, {"type": "object", "additionalProperties": _VALUE})
_SEARCH = Special(_mapping, {"type": "object", "additionalProperties": False, "properties": {
    "method": {"enum": list(METHODS)}, "evaluations": {"type": "integer", "minimum": 1},
    "seed": {"type": "integer", "minimum": 0}}})


class StudyDocument(Section):
    """A study: the keys of a base spec that vary, the goals and requirements, and the size of the search."""

    is_whole: ClassVar[bool] = False

    sitscad_study: int = key(Special(_version, {"const": VERSION}), "version of this format")
    base: str = key(Text(1000), "path of the spec that is varied, from this file's folder. All its requirements apply")
    vary: dict[str, Any] = key(_VARY, "keys of the spec that vary, each with {from, to, step} or a list of values")
    same: dict[str, Any] = key(_SAME, "keys that take the value of a varied key", {})
    with_: dict[str, Any] = key(_WITH, "further keys that are set by a value of a varied key", {}, "with")
    goals: list[Any] = key(_GOALS, "one to three measures to minimize or maximize, the most important first")
    require: dict[str, Any] = key(_REQUIRE, "further limits of measures, like {rp: '>= 1.2 kohm'}", {})
    accept: tuple[str, ...] = key(_ACCEPT, "rules whose warnings are accepted, or all", [])
    spread: dict[str, Any] = key(
        _SPREAD, "scatter of keys (one sigma) in place of the tables' values, like {elastomer.modulus: 30 %}", {})
    search: dict[str, Any] = key(_SEARCH, "search method, number of evaluations, and seed", {})
    keep: int = key(Number(1, MOST_KEPT, whole=True), "largest number of designs that are kept", 5)


@record
class Goal:
    """A measure to minimize (`is_less_better`) or to maximize."""

    measure: str
    is_less_better: bool = True

    def cost(self, value: float) -> float:
        """Return a measure's value as a cost: smaller is better."""
        return value if self.is_less_better else -value

    @property
    def written(self) -> str:
        """Text of the goal as in the file, like "minimize rp"."""
        return f"{'minimize' if self.is_less_better else 'maximize'} {self.measure}"


@record
class Requirement:
    """A requirement of a study on one measure.

    `limit` (SI unit) is the smallest permitted value if `is_floor`, else the largest. `written` is its text in the
    file.
    """

    measure: str
    is_floor: bool
    limit: float
    written: str

    def holds(self, value: float) -> bool:
        """Whether a value meets the limit."""
        return value >= self.limit if self.is_floor else value <= self.limit


@record(eq=False)
class StudyRequest:
    """Contents of a study's file: base spec, possible designs, goals, requirements, and parameters of the search.

    `accept` lists rules whose warnings are accepted. `spread` are standard deviations of manufacturing errors that
    replace the usual ones. `keep` is the largest number of designs to keep.
    """

    base: Base
    space: Space
    goals: tuple[Goal, ...]
    require: tuple[Requirement, ...]
    accept: tuple[str, ...]
    spread: Mapping[str, float]
    method: str = "auto"
    evaluations: int = 1000
    seed: int = 1
    keep: int = 5

    @property
    def measures(self) -> tuple[str, ...]:
        """Measures to compute for each design: goals, requirements, and their standard deviations if known."""
        return (*self._requested_measures, *(f"sigma.{name}" for name in self.measures_with_sigma))

    @property
    def measures_with_sigma(self) -> tuple[str, ...]:
        """Goals and requirements whose standard deviation between manufactured sensors is computed."""
        return tuple(name for name in self._requested_measures if f"sigma.{name}" in MEASURES)

    @property
    def _requested_measures(self) -> Iterable[str]:
        names = [*(goal.measure for goal in self.goals), *(each.measure for each in self.require)]
        return dict.fromkeys(name for name in names if name != "yield")

    @cached_property
    def base_point(self) -> Point:
        """First design that the study evaluates: the design of the search space nearest to the base spec.

        It equals the base if the search space contains the base.
        """
        return self.space.nearest(self.base.changed_values(()))

    @property
    def least_yield(self) -> float | None:
        """Required yield. None if no yield is required."""
        return next((each.limit for each in self.require if each.measure == "yield"), None)


def study_request(document: StudyDocument, base: Base, remarks: Remarks) -> StudyRequest:
    """Return the contents of a study's file for a base spec. Faults are added to `remarks`."""
    variables = tuple(_variables(document, base, remarks))
    space = Space(variables, _linked_keys(document, base, remarks), _implied_keys(document, base, variables, remarks))
    _check_conflicts(document, remarks)
    goals = tuple(_goals(document, remarks))
    require = tuple(_requirements(document, remarks))
    search = {**{"method": "auto", "evaluations": 1000, "seed": 1}, **_search_parameters(document, remarks)}
    if not remarks.flaws:
        _check_measures(base, goals, require, space, remarks)
        if search["method"] == "grid" and space.size > MOST_GRID:
            remarks.flaw("SIT010", "search.method", f"the grid has {space.size:.3g} designs, allowed {MOST_GRID}",
                         "use larger steps, fewer keys, or method: auto")
        if search["method"] == "de" and len(goals) > 1:
            remarks.flaw("SIT009", "search.method", "differential evolution takes one goal",
                         "keep one goal, or write method: nsga2")
    return StudyRequest(base, space, goals, require, document.accept, dict(_error_sigmas(document, remarks)),
                        keep=document.keep, **search)


def _variables(document: StudyDocument, base: Base, remarks: Remarks) -> Iterator[Variable]:
    """Yield the varied keys with their values. Faults are added to `remarks`."""
    if not 1 <= len(document.vary) <= MOST_KEYS:
        remarks.flaw("SIT006", "vary", f"{len(document.vary)} varied keys, allowed 1 to {MOST_KEYS}")
    for name, written in document.vary.items():
        place = dotted("vary", name)
        try:
            if isinstance(written, list) and written:
                values, is_ordered = tuple(written), False
            elif isinstance(written, dict) and {"from", "to"} <= written.keys() <= {"from", "to", "step"}:
                values, is_ordered = values_by_step(written["from"], written["to"], written.get("step")), True
            else:
                raise RangeError(f"{describe(written)} is no range", "{from: 6, to: 12, step: 0.5}, or a list [2, 4]")
        except RangeError as error:
            remarks.flaw("SIT006", place, str(error), error.hint)
            continue
        if not is_ordered:
            _check_duplicates(place, values, remarks)
        if _is_usable(base, name, values, place, remarks):
            yield Variable(name, values, is_ordered)


def _check_duplicates(place: str, values: tuple[Any, ...], remarks: Remarks) -> None:
    """Add a remark for each value that occurs twice in a list, even with different units. `place` is the list's key."""
    first: dict[Any, Any] = {}
    for k, value in enumerate(values):
        if (figure := comparable_value(value)) in first:
            message = f"{describe(value)} is {describe(first[figure])}, which is in the list already"
            remarks.flaw("SIT009", dotted(place, k), message,
                         "write each value once")
        first.setdefault(figure, value)


def _is_usable(base: Base, name: str, values: tuple[Any, ...], place: str, remarks: Remarks) -> bool:
    """Return whether the spec has the key and permits the values. Faults are added to `remarks`."""
    try:
        require_key(base, name, values)
    except SpecError as error:
        for finding in error.findings[:1]:
            remarks.flaw(finding.rule, place, finding.message, finding.hint)
        return False
    return True


def _linked_keys(document: StudyDocument, base: Base, remarks: Remarks) -> dict[str, str]:
    followers = {}
    for name, other in document.same.items():
        place = dotted("same", name)
        if not isinstance(other, str) or other not in document.vary:
            varied = ", ".join(document.vary)
            remarks.flaw("SIT007", place, f"{describe(other)} is not varied", f"one of {varied}")
            continue
        written = document.vary[other]
        first = [each for each in written[:1] if each is not None] if isinstance(written, list) else []
        first = [written.get("from")] if isinstance(written, dict) else first
        if first and _is_usable(base, name, tuple(first), place, remarks):
            followers[name] = other
    return followers


def _implied_keys(
    document: StudyDocument, base: Base, variables: Iterable[Variable], remarks: Remarks
) -> dict[str, dict[str, dict[str, Any]]]:
    """Return further keys that values of varied keys set.

    The result maps varied key, text of its value and further key to the further key's value.
    """
    implied: dict[str, dict[str, dict[str, Any]]] = {}
    by_key = {variable.key: variable for variable in variables}
    for name, choices in document.with_.items():
        place, variable = dotted("with", name), by_key.get(name)
        if not isinstance(choices, dict) or not all(isinstance(each, dict) for each in choices.values()):
            remarks.flaw("SIT004", place, "a section of values, each with what it brings, is wanted",
                         "coil.layers: {2: {fpc.stackup: flex-2l}}")
            continue
        if name not in document.vary:
            remarks.flaw("SIT007", place, f"{name} is not varied", f"one of {', '.join(document.vary)}")
            continue
        allowed = [str(value) for value in variable.values] if variable is not None else list(choices)
        for choice, brings in choices.items():
            if variable is not None and choice not in allowed:
                near = f"the nearest is {allowed[variable.nearest(choice)]}"
                remarks.flaw("SIT007", dotted(place, choice), f"{choice} is no value of {name}",
                             near if variable.is_ordered else f"one of {', '.join(allowed)}")
            for other, value in brings.items():
                _is_usable(base, other, (value,), dotted(dotted(place, choice), other), remarks)
        implied[name] = {choice: dict(brings) for choice, brings in choices.items()}
    return implied


def _check_conflicts(document: StudyDocument, remarks: Remarks) -> None:
    """Add a remark for each key that would get two values, directly or as part of a section.

    The values can come from the sections ``vary``, ``same`` and ``with``, or from two varied keys.
    """
    settled: dict[str, str] = {}
    for name, by, place in _keys_by_section(document):
        for other, of_other in settled.items():
            if is_overlapping(name, other) and (by != of_other or not by.startswith("with.")):
                whose = of_other if name == other else f"{other} under {of_other}"
                remarks.flaw("SIT009", place, f"{name} is decided by {whose}, too", "keep one of them")
        settled.setdefault(name, by)


def _keys_by_section(document: StudyDocument) -> Iterator[tuple[str, str, str]]:
    """Yield (key, section that sets it, position in the file) for each key that a study sets."""
    for name in document.vary:
        yield name, "vary", dotted("vary", name)
    for name in document.same:
        yield name, "same", dotted("same", name)
    for name, choices in document.with_.items():
        for choice, brings in choices.items() if isinstance(choices, dict) else ():
            for other in brings if isinstance(brings, dict) else ():
                yield other, f"with.{name}", dotted(dotted(dotted("with", name), choice), other)


def _goals(document: StudyDocument, remarks: Remarks) -> Iterator[Goal]:
    if len(document.goals) > MOST_GOALS:
        remarks.flaw("SIT006", "goals", f"{len(document.goals)} goals; allowed {MOST_GOALS}",
                     "write the others under require")
    measures = set[str]()
    for k, written in enumerate(document.goals):
        place = dotted("goals", k)
        keys = list(written) if isinstance(written, dict) else []
        if len(keys) != 1 or keys[0] not in ("minimize", "maximize"):
            remarks.flaw("SIT004", place, f"{describe(written)} is no goal", "minimize: MEASURE, or maximize: MEASURE")
        elif _is_measure(name := written[keys[0]], dotted(place, keys[0]), remarks):
            if name == "yield":
                remarks.flaw("SIT009", dotted(place, keys[0]), "yield is computed only for the designs that are kept",
                             'require it: {yield: ">= 95 %"}')
            if name in measures:
                remarks.flaw("SIT009", dotted(place, keys[0]), f"{name} is a goal already",
                             "write one goal for each measure")
            measures.add(name)
            yield Goal(name, keys[0] == "minimize")


def _is_measure(name: Any, place: str, remarks: Remarks) -> bool:
    if isinstance(name, str) and name in MEASURES:
        return True
    remarks.flaw("SIT007", place, f"there is no measure {describe(name)}", similar_measures_text(str(name)))
    return False


EXAMPLES = {
    "H": ">= 1 uH", "ohm": ">= 1.2 kohm", "Hz": ">= 500 Hz", "N": "<= 20 mN", "m": "<= 5 mm", "m2": "<= 120 mm2",
    "V": ">= 1.2 V", "A": "<= 5 mA", "": ">= 95 %",
}
"""Example of a limit, by the measure's unit."""

_LIMIT = re.compile(r"\s*(>=|<=)\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?)\s*(\S*)\s*")


def _requirements(document: StudyDocument, remarks: Remarks) -> Iterator[Requirement]:
    for name, written in document.require.items():
        place = dotted("require", name)
        if not _is_measure(name, place, remarks):
            continue
        match, unit = _LIMIT.fullmatch(str(written)), MEASURES[name].unit
        factor = _factors(unit).get(match[3]) if match else None
        if match is None or factor is None:
            remarks.flaw("SIT005" if match else "SIT004", place, f"{describe(written)} is no limit of {name}",
                         f"like {EXAMPLES[unit]!r}; units: {', '.join(each or 'none' for each in _factors(unit))}")
            continue
        if name == "yield" and not (match[1] == ">=" and 0.0 < float(match[2]) * factor < 1.0):
            remarks.flaw("SIT006", place, f"{describe(written)} is no yield that can be required",
                         "write it like >= 95 %")
            continue
        yield Requirement(name, match[1] == ">=", float(match[2]) * factor, str(written).strip())


def _factors(unit: str) -> dict[str, float]:
    """Return the units in which a limit of a measure may be written, with their factors to SI."""
    if unit == "":
        return {"": 1.0, "%": 0.01}
    if unit == "m2":
        return {"mm2": 1e-6, "cm2": 1e-4, "m2": 1.0}
    if unit in ("V", "A"):
        return {f"{prefix}{unit}": factor for prefix, factor in (("u", 1e-6), ("m", 1e-3), ("", 1.0))}
    return next({name: float(factor) for name, factor in units.items()} for units in UNITS.values() if unit in units)


def _search_parameters(document: StudyDocument, remarks: Remarks) -> dict[str, Any]:
    checks: dict[str, tuple[Callable[[Any], bool], str]] = {
        "method": (lambda value: value in METHODS, f"one of {', '.join(METHODS)}"),
        "evaluations": (lambda value: _is_whole(value, 1, MOST_GRID), f"a number from 1 to {MOST_GRID}"),
        "seed": (lambda value: _is_whole(value, 0, 2**32 - 1), "a whole number from 0"),
    }
    parameters = {}
    for name, value in document.search.items():
        place = dotted("search", name)
        if name not in checks:
            remarks.flaw("SIT002", place, f"{describe(name)} is no key in search", f"allowed: {', '.join(checks)}")
        elif not checks[name][0](value):
            remarks.flaw("SIT006", place, f"{describe(value)} is no {name}", checks[name][1])
        else:
            parameters[name] = value
    return parameters


def _is_whole(value: Any, low: int, high: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and low <= value <= high


def _error_sigmas(document: StudyDocument, remarks: Remarks) -> Iterator[tuple[str, float]]:
    """Yield (key, relative standard deviation) for each manufacturing error with a value in the study."""
    for name, written in document.spread.items():
        place, match = dotted("spread", name), re.fullmatch(r"\s*(\d+\.?\d*|\.\d+)\s*%\s*", str(written))
        if name not in SPREADS:
            remarks.flaw("SIT007", place, f"no scattering figure has the name {describe(name)}",
                         f"one of {', '.join(SPREADS)}")
        elif SPREADS[name].unit != "1":
            remarks.flaw("SIT009", place, f"{name} scatters by a length or an angle, not by a fraction of itself",
                         "write its tolerance in section assembly of the spec")
        elif match is None or not 0.0 <= float(match[1]) <= 100.0:
            hint = "write one sigma relative to the figure, like 30 %"
            remarks.flaw("SIT006", place, f"{describe(written)} is no sigma", hint)
        else:
            yield name, 0.01 * float(match[1])


def _check_measures(
    base: Base, goals: tuple[Goal, ...], require: tuple[Requirement, ...], space: Space, remarks: Remarks
) -> None:
    """Add remarks for goals that no varied key changes, and for measures that no design can have.

    No design has a measure if the base lacks a part that the measure needs, and no varied key adds this part.
    """
    places = [(goal.measure, dotted(dotted("goals", k), goal.written.partition(" ")[0]))
              for k, goal in enumerate(goals)]
    for goal, (_, place) in zip(goals, places, strict=True):
        keys = MEASURES[goal.measure].decided_by
        if keys and not space.is_varied(keys):
            remarks.flaw("SIT009", place, f"{goal.measure} depends only on {' and '.join(keys)}, which the "
                         "study does not vary", "vary it, or choose another goal")

    places += [(each.measure, dotted("require", each.measure)) for each in require]
    for name, place in places:
        for need in MEASURES[name].needs:
            if not need.is_present(base.spec) and not space.is_varied(need.keys):
                remarks.flaw("SIT009", place, f"{name} needs {need.name}, which the base lacks and the study does "
                             "not add", "add it to the base, or choose another measure")
                break


FIRST_STUDY_TEMPLATE = """\
# Which design around {name} is best? A study, for `sitscad design`.

sitscad_study: 1
base: {base}{room}# any spec beside this file: every rule and all its requirements hold for every design

# One to sixteen keys of the base. A range without a step has at least fifty round values; a list is a choice.
vary:
{vary}
{same}
# What a value brings along, where it needs other keys, too:
# with: {{coil.layers: {{2: {{fpc.stackup: flex-2l-18um}}, 4: {{fpc.stackup: flex-4l}}}}}}

# One to three measures (sitscad measures). Of several, designs are kept that none beats in all of them.
goals:
{goals}

# Beyond what the base asks, like {{rp: ">= 1.1 kohm"}}. A yield is that of units over the spreads of manufacture.
require: {{yield: ">= 95 %"}}

# Rules whose warnings may stay, or all; every other one is gone from a kept design.{own}
accept: [{accept}]
# spread: {{elastomer.modulus: 16 %}}    # one sigma, in place of the tables'

search: {{method: auto, evaluations: {evaluations}, seed: 1}}   # auto, grid, sobol, de, nsga2 (extra [design])
keep: 4
"""


def first_study_text(spec: SensorSpec, base: str) -> str:
    """Return the text of a first study for a spec. `base` is the path of the spec.

    Dimensions in the spec are varied around their values. The goals follow from the spec's purpose. Warnings of the
    spec are accepted.
    """
    is_tactile = spec.target is not None and spec.elastomer is not None
    goals = _usual_goals(is_tactile, spec.requirements.shear_force, spec.jaw, spec.fpc.body)
    pitch = spec.array.pitch if spec.cells is None else None
    ranges = _ranges_around_spec(spec.coil, spec.fpc.rules, spec.source.keys, pitch, spec.elastomer)
    accept = [rule for rule in evaluate_design(spec, ()).warned if not rule.startswith("SIT0")]
    coil, widths = spec.coil, {"coil.trace_width", "coil.trace_spacing"}
    is_free = INNER not in spec.source.keys or widths <= spec.source.keys.keys()
    return FIRST_STUDY_TEMPLATE.format(
        name=spec.name, base=base, room=" " * max(2, 26 - len(base)), vary="\n".join(ranges),
        same="\nsame: {coil.trace_spacing: coil.trace_width}         # keys that follow a varied one\n"
             if coil.trace_spacing == coil.trace_width and is_free else "",
        goals="\n".join(f"  - {goal}" for goal in goals), accept=", ".join(accept),
        own=" The base has these itself." if accept else "",
        evaluations=1000 if can_screen(spec) else 200,
    )


def _ranges_around_spec(
    coil: CoilSpec, rules: DesignRules, written: Collection[str], pitch: float | None, pad: ElastomerPad | None
) -> Iterator[str]:
    """Yield lines with a key of the spec and a range around its value.

    `written` are the keys in the spec's text. `pitch` (m) is the distance of coils, if it may vary.
    """
    if coil.size[0] == coil.size[1]:  # else the size is a pair, which has no range
        yield f"  coil.outer_diameter: {_length_range(0.9 * coil.size[0], 1.05 * coil.size[0])}"
    if INNER in written:
        yield f"  {INNER}: {_length_range(0.8 * coil.inner_diameter, 1.2 * coil.inner_diameter)}"
    if isinstance(turns := coil.turns, float) and (TURNS in written or INNER not in written):
        step = next(part for part in (0.25, 0.5, 1.0) if coil.outline.is_whole(part))
        low, high = max(2.0, step * round(0.75 * turns / step)), step * round(1.1 * turns / step)
        yield f"  coil.turns: {{from: {fixed_decimals(low)}, to: {fixed_decimals(high)}, step: {step}}}"
    least = min(coil.trace_width, max(0.85 * coil.trace_width, rules.trace_width, rules.trace_spacing))
    first, last = 5 * math.ceil(least * 2e5 - 1e-6), 5 * round(1.25 * coil.trace_width * 2e5)
    if "coil.trace_width" in written or INNER not in written:
        yield f"  coil.trace_width: {{from: {first} um, to: {last} um, step: 5 um}}"
    if pitch is not None:
        yield f"  array.pitch: {_length_range(pitch, 1.1 * pitch)}"
    if pad is not None:
        yield f"  elastomer.thickness: {_length_range(0.7 * pad.thickness, 1.3 * pad.thickness)}"


def _length_range(low: float, high: float) -> str:
    """Return a range between two lengths (m) as in a study, in millimetres."""
    return f"{{from: {in_mm(low, 2)}, to: {in_mm(high, 2)}}}"


def _usual_goals(is_tactile: bool, shear_force: float | None, jaw: Jaw | None, body: BodySpec | None) -> Iterator[str]:
    """Yield two usual goals for a sensor. `is_tactile` is True if it has a target on a pad."""
    yield "minimize: resolution.normal" if is_tactile else "maximize: rp"
    if jaw is not None:
        yield "minimize: fit.closed_pair"
    elif is_tactile and shear_force:
        yield "minimize: resolution.shear_x"
    elif body is None:
        yield "minimize: board.area"


def study_schema() -> dict[str, Any]:
    """Return the JSON Schema of a study's file."""
    return schema_of(StudyDocument, "sitscad study", "urn:sitscad:study:1", "*.study.yaml")
