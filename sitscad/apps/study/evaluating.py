"""Evaluation of designs at two levels, in parallel processes.

Designs are grouped into chunks of about a second of computing. Worker processes, or any object with `submit`, evaluate
the chunks. Results are returned in the order of the requests.

The full level evaluates a design like `check` without hints. The screen level is faster, and each value has an error
bound. It does not route leads (`layout.sketch`), computes estimates with a larger tolerance, and computes the sensing
performance from a surrogate with few points. Only rules that need no more than this are applied. All other rules are
undecided. A rule is also undecided if its limit is within the error bound of the value.
"""

from __future__ import annotations

import gc
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor
from functools import cache
from itertools import islice
from typing import Any, Protocol, TypeVar

from sitscad.apps.study.evaluation import FULL, SCREEN, Breach, Evaluation
from sitscad.apps.study.measures import MEASURES, AbsentError
from sitscad.apps.study.space import Base, Changes, code_version
from sitscad.assembly.places.state import FREE, REST
from sitscad.assembly.solids import MissingExtra
from sitscad.basics.finding import Finding, Severity
from sitscad.basics.record import record, replace
from sitscad.checks.judging import CheckResult, all_rules
from sitscad.checks.judging import apply_rules as checked
from sitscad.checks.opening import nearest_policy_of_spec, usable_processors
from sitscad.checks.performance import requirement_results
from sitscad.checks.policy import Policy
from sitscad.checks.pool import process_pool
from sitscad.checks.rules import NEEDS, Rule, apply_rule
from sitscad.data import rows
from sitscad.estimates import estimate_layout
from sitscad.estimates.coil_estimates import CoilEstimate, StateEstimate
from sitscad.estimates.design import Cells, Design
from sitscad.estimates.windings.losses import SCREENING
from sitscad.kernels.geometry.convex import Box
from sitscad.layout import sketch
from sitscad.package.inspection import as_configured
from sitscad.spec.coil import ArraySpec, CoilPlacement, CoilSpec
from sitscad.spec.places import footprint
from sitscad.spec.reading import SpecError
from sitscad.spec.sensor import SensorSpec

NO_NEED = frozenset(("on-solids", *(case for _, case in NEEDS.values())))
"""Cases of `NotChecked` for rules on a part that the spec does not have, and for rules that only a build can check.

Such rules do not count as undecided.
"""


def evaluate_design(spec: SensorSpec, measures: Sequence[str], level: str = FULL) -> Evaluation:
    """Return the evaluation of a design: the results of all rules, and the values of `measures`.

    Configuration and comments that suppress rules apply as in `check`.
    """
    design = Design(spec)
    result = as_configured(spec, checked(design, "none", None))
    values, absent = measure_values(design, measures)
    undecided = tuple(sorted({each.rule for each in result.not_checked if each.case not in NO_NEED}))
    return Evaluation(values, absent, breaches_by_rule(result.findings, Severity.ERROR),
                      breaches_by_rule(result.findings, Severity.WARNING), undecided, level)


def measure_values(design: Design, measures: Sequence[str]) -> tuple[dict[str, tuple[float, float]], dict[str, str]]:
    """Return the values of measures of a design, and the reasons for missing values, both by measure.

    Each value is (value, error bound), in the measure's SI unit.
    """
    values, absent = {}, {}
    for name in measures:
        try:
            value, error = MEASURES[name].read(design)
            values[name] = (float(value), float(error))
        except AbsentError as why:
            absent[name] = str(why)
    return values, absent


def breaches_by_rule(findings: Iterable[Finding], severity: Severity) -> Mapping[str, Breach]:
    """Return the rules with findings of a severity, each with its largest breach, in the order of the rules."""
    by_rule: dict[str, Breach] = {}
    for finding in sorted(findings, key=lambda breach: breach.rule):
        if finding.severity is severity:
            sigma = finding.sigma if finding.keeps_limit else None
            breach = Breach(finding.measured, finding.limit, finding.unit or "", sigma)
            by_rule[finding.rule] = max(by_rule.get(finding.rule, breach), breach, key=lambda each: each.size)
    return by_rule


BY_SPEC = ("SIT101", "SIT102", "SIT103", "SIT117", "SIT131", "SIT137", "SIT138", "SIT220", "SIT304", "SIT305", "SIT306",
           "SIT308", "SIT309", "SIT313", "SIT314", "SIT327", "SIT329", "SIT330", "SIT331", "SIT334", "SIT335", "SIT410")
"""Rules that use only values of the spec and of its parts."""

BY_BODY = ("SIT301", "SIT302", "SIT303", "SIT307", "SIT315")
"""Rules that use the size of the board.

At the screen level, this size is known for a single coil and for two coils in line.
"""

BY_TANK = ("SIT201", "SIT202", "SIT203", "SIT204", "SIT205", "SIT206", "SIT207", "SIT208", "SIT209", "SIT210", "SIT211",
           "SIT213", "SIT214", "SIT215", "SIT217")
"""Rules that use electrical values of the tank (the coil with its capacitor)."""

RESOLUTION_RULES = ("SIT401", "SIT402")
"""Rules that use the force resolution."""

ASKED = frozenset((*BY_SPEC, *BY_TANK, *RESOLUTION_RULES))

IN_FULL = "it takes the full level"


def screen_designs(specs: Sequence[SensorSpec], measures: Sequence[str]) -> list[Evaluation]:
    """Return the evaluation of each design at the screen level, independent of the other designs.

    ``unknown`` lists the rules that the screen level cannot decide. Designs that cannot be screened are evaluated at
    the full level. ``level`` states the level that was used.
    """
    policies = {path: nearest_policy_of_spec(path) for path in {spec.source.path for spec in specs}}
    return [
        _screen_design(spec, measures, policies[spec.source.path])
        if can_screen(spec) else evaluate_design(spec, measures)
        for spec in specs
    ]


LEAST_CONDUCTIVITY = 5e6
"""Least conductivity (S/m) of targets and shields at the screen level, which models a plate as a thin sheet.

Brass (16 MS/m) is accurate. The resolution differed from the full level by up to 25 % for stainless steel (1.4 MS/m),
and by 46 % for titanium (0.6 MS/m).
"""

RIMS = (-0.3, 1.2)
"""Valid range at the screen level: distance from a coil's centre to the target's nearest edge, in coil radii.

The distance is positive if the target covers the centre. Above the range, all coils have nearly equal readings, and
shear appears only in small differences: the resolution was wrong by a factor of seven. Below the range, the target
hardly covers the coil: the resolution was wrong by half.
"""

NO_SCREEN = ("the screen has models of round coils, targets of a good conductor that end over the coils which share "
             "them, jaws without a window, shields of a good conductor before a jaw alone, and no moments")
"""Reason for evaluating a design at the full level instead of the screen level."""


def can_screen(spec: SensorSpec) -> bool:
    """Whether the screen level has a model of a design.

    It has models of round coils, jaws without a window, and targets and shields of a good conductor. The edges of a
    target that coils share must lie over the coils, and moments must not be required.
    """
    jaw = spec.jaw
    is_whole = jaw is None or jaw.fenestration is None
    sheets = [sheet.material for sheet in (spec.target, spec.shield) if sheet is not None]
    is_plain = all(metal.relative_permeability < 1.1 and metal.conductivity > LEAST_CONDUCTIVITY for metal in sheets)
    is_level = not any(spec.requirements.moments)
    is_backed = spec.shield is None or (jaw is not None and spec.cells is None)
    is_modelled = spec.coil.outline.is_round and is_whole and is_plain and is_backed and is_level
    if not is_modelled or spec.target is None:
        return is_modelled
    return _ends_over_coils(footprint(spec, spec.target).box, spec.cell_placements[0], spec.coil)


def _ends_over_coils(target: Box, placements: tuple[CoilPlacement, ...], coil: CoilSpec) -> bool:
    """Whether the nearest edge of a target that several coils share lies in the valid range `RIMS`.

    `target` is the target's bounding box.
    """
    places = {place.centre for place in placements}
    if len(places) < 2:
        return True
    west, low, right, high = target
    nearest = min(min(x - west, right - x, y - low, high - y) for x, y in places)
    return RIMS[0] < nearest / (0.5 * min(coil.size)) < RIMS[1]


@cache
def screen_errors(has_body: bool = False) -> Mapping[str, float]:
    """Return the relative error of values at the screen level, compared with the full level, by measure.

    Some errors are larger if the spec states the body's outline (`has_body`), because leads are then routed inside it.
    """
    errors = {row["measure"]: float(row["error"]) for row in rows("screen_errors")}
    wider = {name.removesuffix(".body"): error for name, error in errors.items() if name.endswith(".body")}
    return errors | wider if has_body else errors


def _screen_design(spec: SensorSpec, measures: Sequence[str], policy: Policy) -> Evaluation:
    layout = sketch(spec)
    design = Design(spec, layout, estimate_layout(layout, tolerance=SCREENING))
    screened = [name for name in measures if SCREEN in MEASURES[name].levels]
    values, absent = measure_values(design, screened)
    absent |= {name: IN_FULL for name in measures if name not in screened}
    wide = [name for name in OF_BOARD if name in values]
    if not _has_known_board_size(spec.array):
        absent |= dict.fromkeys(sorted(wide), IN_FULL)
        values = {name: pair for name, pair in values.items() if name not in wide}
    elif wide:  # leads may need a wider board
        wider, _ = measure_values(Design(spec, sketch(spec, WIDER), design.estimates), wide)
        values |= {name: (values[name][0], abs(value - values[name][0])) for name, (value, _) in wider.items()}
    findings, unknown = _screened_findings(design)
    grave = tuple(each for each in findings if each.severity is not Severity.NOTE)
    errors = screen_errors(spec.fpc.body is not None)
    judged_findings = as_configured(spec, CheckResult(grave, ()), policy).findings if grave else ()
    return Evaluation(
        {name: (value, max(error, errors.get(name, 0.0) * abs(value)))
         for name, (value, error) in values.items()},
        absent, breaches_by_rule(judged_findings, Severity.ERROR), breaches_by_rule(judged_findings, Severity.WARNING),
        tuple(sorted(unknown)), SCREEN,
    )


OF_BOARD = ("fit.width", "fit.length", "fit.closed_pair", "fit.spare", "board.area")
"""Measures that follow from the size of the board."""

WIDER = 2  # Steps by which a board may be wider than its sketch. At most one was needed in 360 routed designs
"""Number of steps by which a routed board may be wider than its sketch.

At most one was needed in 360 routed designs.
"""


def _has_known_board_size(array: ArraySpec) -> bool:
    """Whether the size of the board is known without routing leads: for a single coil, and for two coils in line.

    The leads of six coils in line widened the board by 4 %.
    """
    return array.is_in_line and len(array.placements) <= 2


def _screened_findings(design: Design) -> tuple[list[Finding], set[str]]:
    """Return the findings of rules that the screen level can decide, and the ids of rules that it cannot decide."""
    findings: list[Finding] = []
    unknown: set[str] = set()
    errors = screen_errors(design.spec.fpc.body is not None)
    numbers, is_sized = design.estimates, _has_known_board_size(design.spec.array)
    corners = [
        Design(design.spec, design.layout,
               replace(numbers, coils=tuple(_shift_estimates(coil, side, errors) for coil in numbers.coils)))
        for side in (-1.0, 1.0)  # all coils better or worse by the errors of the screen
    ]
    wider = Design(design.spec, sketch(design.spec, WIDER), numbers) if is_sized else design
    for rule in all_rules():
        if rule.apply is not None and all(NEEDS[need][0](design.spec) for need in rule.needs):
            variants = corners if rule.id in BY_TANK else [wider] if rule.id in BY_BODY else []
            of_rule = _rule_findings(rule, design, variants)
            findings += of_rule or ()
            unknown |= {rule.id} if of_rule is None else set()
    return findings, unknown


def _rule_findings(rule: Rule, design: Design, variants: Sequence[Design]) -> list[Finding] | None:
    """Return a rule's findings on a design. None if the screen level cannot decide the rule.

    `variants` are copies of the design whose values are shifted by the errors of the screen level. The rule is
    undecided if a variant has findings of other severities.
    """
    if rule.id not in ASKED and not (rule.id in BY_BODY and _has_known_board_size(design.spec.array)):
        return None
    findings, undecided = apply_rule(rule, design, least=None)
    if undecided or (rule.id in RESOLUTION_RULES and _is_undecided_by_screen(rule, design.cells)):
        return None
    if any(_serious_severities(apply_rule(rule, other, least=None)[0]) != _serious_severities(findings)
           for other in variants):
        return None
    return findings


def _serious_severities(findings: Sequence[Finding]) -> list[Severity]:
    """Return the distinct severities of the findings, without notes."""
    return sorted({each.severity for each in findings} - {Severity.NOTE})


def _is_undecided_by_screen(rule: Rule, cells: Cells) -> bool:
    """Whether a sensing value differs from its required value by less than its relative error at the screen level."""
    error = screen_errors()["resolution.normal"]
    results = (each for cell in cells.extremes.values() for each in requirement_results(rule, cell))
    return any(each.limit and abs(each.measured / each.limit - 1.0) < error for each in results)


def _shift_estimates(coil: CoilEstimate, side: float, errors: Mapping[str, float]) -> CoilEstimate:
    by_l, by_f, by_r = 1.0 + side * errors["inductance"], 1.0 - side * errors["frequency"], 1.0 + side * errors["rp"]

    def state(estimate: StateEstimate) -> StateEstimate:
        """Return a state whose inductance, frequency, Rp and dependent values are multiplied by their factors."""
        of_inductance = ("inductance", "apparent_inductance", "converter_inductance")
        more = {name: getattr(estimate, name) * by_l for name in of_inductance if getattr(estimate, name) is not None}
        of_resistance = ("parallel_resistance", "quality_factor", "amplitude")
        more |= {name: getattr(estimate, name) * by_r for name in of_resistance}
        return replace(estimate, frequency=estimate.frequency * by_f, resistance=estimate.resistance / by_r, **more)

    states = {name: state(estimate) for name, estimate in coil.states.items()}
    for pressed in [name for name in states if name not in (FREE, REST) and REST in states]:
        part = 1.0 + side * errors["signal.normal"]  # factor of the change from rest
        pairs = {name: (getattr(states[REST], name), getattr(states[pressed], name))
                 for name in ("inductance", "frequency", "converter_inductance")}
        states[pressed] = replace(states[pressed], **{
            name: before + part * (after - before) for name, (before, after) in pairs.items()
            if before is not None and after is not None})
    return replace(
        coil, states=states,
        terminal_inductance=coil.terminal_inductance * by_l, sensor_frequency=coil.sensor_frequency * by_f,
        parallel_resistance=coil.parallel_resistance * by_r, quality_factor=coil.quality_factor * by_r,
    )


SECONDS = 1.0
"""Intended computing time (s) of a chunk of designs."""

MOST_IN_CHUNK = 500
DEATHS = 3
"""Number of attempts to evaluate a chunk. If the worker process ends unexpectedly each time, an error is raised."""

NOT_COMPUTED = "not-computed"
"""Rule name in the evaluation of a design whose computation failed."""


Made = TypeVar("Made")
Task = tuple[Callable[..., Any], tuple[Any, ...]]
"""A function and its arguments."""


class Executor(Protocol):
    """Interface of an object that computes elsewhere: `concurrent.futures`, or a Dask client."""

    def submit(self, work: Any, /, *arguments: Any) -> Any:
        """Start `work` with these arguments, and return an object whose `result` returns the result."""


@record
class Chunk:
    """Designs for one worker, with the requested measures and level."""

    designs: tuple[Changes, ...]
    measures: tuple[str, ...]
    level: str


def evaluate_chunk(base: Base, chunk: Chunk) -> tuple[list[Evaluation], float]:
    """Return the evaluations of a chunk's designs in their order, and the computing time (s)."""
    started = time.perf_counter()
    evaluations: list[Evaluation | None] = []
    specs: list[SensorSpec] = []
    for changes in chunk.designs:
        try:
            specs.append(base.changed_spec(changes))
            evaluations.append(None)
        except SpecError as error:
            absent = dict.fromkeys(chunk.measures, "the spec is refused")
            evaluations.append(
                Evaluation({}, absent, breaches_by_rule(error.findings, Severity.ERROR), level=chunk.level))
    gc.freeze()  # existing objects outlive the chunk: leave them out of garbage collection
    try:
        computed = iter(_evaluate_specs(specs, chunk))
    finally:
        gc.unfreeze()
    return [next(computed) if each is None else each for each in evaluations], time.perf_counter() - started


def free_results(results: Iterable[Made]) -> Iterator[Made]:
    """Yield the results, and free the memory of each before computing the next.

    A design consists of reference cycles with few objects that hold tens of megabytes. Python's garbage collector
    counts objects, and would free these cycles too late.
    """
    for each in results:
        yield each
        del each
        gc.collect()


def _evaluate_specs(specs: Sequence[SensorSpec], chunk: Chunk) -> list[Evaluation]:
    """Return the evaluations of specs. If a computation fails, only its design is refused."""
    try:
        if chunk.level != FULL:
            return screen_designs(specs, chunk.measures)
        return list(free_results(evaluate_design(spec, chunk.measures) for spec in specs))
    except Exception as error:
        if len(specs) > 1:
            return [each for spec in specs for each in _evaluate_specs([spec], chunk)]
        why = f"a computation failed: {type(error).__name__}: {error}"
        return [Evaluation({}, dict.fromkeys(chunk.measures, why), {NOT_COMPUTED: Breach()}, level=chunk.level)]


class Workers:
    """Evaluation of designs: in this process if `jobs` is 1, else in other processes, or by an executor."""

    def __init__(self, base: Base, jobs: int | None = None, executor: Executor | None = None) -> None:
        self._base, self._given = base, executor
        self._jobs = jobs or usable_processors()
        self._pool: Any = executor
        self._speed: dict[str, float] = {}

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if self._given is None and self._pool is not None:
            # processes ignore Ctrl-C: end them, or the program waits for their chunks
            for each in list((self._pool._processes or {}).values()) if kind else ():
                each.terminate()
            # without a failure all work is done: a pool still open at the program's end prints a traceback
            self._pool.shutdown(wait=kind is None, cancel_futures=True)

    def evaluations(self, designs: Sequence[Changes], measures: Sequence[str], level: str) -> Iterator[Evaluation]:
        """Yield the evaluations of all designs at a level, in their order, with the values of `measures`."""
        waiting = deque(designs)

        def chunks() -> Iterator[Task]:
            while waiting:
                size = min(self._chunk_size(level), -(-len(waiting) // self._jobs))
                chunk = Chunk(tuple(waiting.popleft() for _ in range(size)), tuple(measures), level)
                yield evaluate_chunk, (self._base, chunk)

        for evaluated, seconds in self._results_in_order(chunks()):
            self._speed[level] = len(evaluated) / max(seconds, 1e-3)
            yield from evaluated

    def call_results(self, work: Callable[..., Made], calls: Sequence[tuple[Any, ...]]) -> Iterator[Made]:
        """Yield the results of `work` for each tuple of arguments in `calls`, in their order."""
        yield from self._results_in_order((work, arguments) for arguments in calls)

    def _chunk_size(self, level: str) -> int:
        if self._is_this_process:
            return 1
        return max(1, min(MOST_IN_CHUNK, round(SECONDS * self._speed.get(level, 1.0))))

    @property
    def _is_this_process(self) -> bool:
        return self._given is None and self._jobs == 1

    def _results_in_order(self, tasks: Iterator[Task]) -> Iterator[Any]:
        """Yield the results of tasks in order. At most two tasks per worker are started at a time."""
        if self._is_this_process:
            yield from (work(*arguments) for work, arguments in tasks)
            return
        running = deque[tuple[Task, Any]]()
        while True:
            for task in islice(tasks, 2 * self._jobs - len(running)):
                running.append((task, self._submit(task)))
            if not running:
                return
            yield self._first_result(running)

    def _submit(self, task: Task) -> Any:
        if self._pool is None:
            self._pool = process_pool(self._jobs, undisturbed=True)
        return self._pool.submit(task[0], *task[1])

    def _first_result(self, running: deque[tuple[Task, Any]]) -> Any:
        """Return the result of the first running task.

        If a process ended unexpectedly, all running tasks are started again.
        """
        for _ in range(DEATHS):
            try:
                result = running[0][1].result()
                running.popleft()
                return result
            except BrokenExecutor:
                if self._given is not None:
                    raise
                self._pool = None
                tasks = [task for task, _ in running]
                running.clear()
                running.extend((task, self._submit(task)) for task in tasks)
        raise BrokenExecutor("processes ended without a word, again and again: too little memory, or ended by somebody")


def dask_cluster(address: str) -> tuple[Executor, int]:
    """Return a client of the Dask scheduler at an address, and the number of designs that it evaluates at a time.

    If a worker fails, its work goes to other workers.

    Raises
    ------
    MissingExtra
        if Dask is not installed
    OSError
        if the scheduler does not answer
    ValueError
        if the address is invalid, or workers have another version of sitscad
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise MissingExtra(f"--scheduler needs dask ({error}): pip install 'sitscad[cluster]'") from error
    try:
        client = Client(address, timeout=SCHEDULER_TIMEOUT)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{address!r} is no scheduler's address ({error}): like tcp://host:8786") from error
    ours, theirs_by_worker = code_version(), client.run(code_version, on_error="return")
    if apart := [f"{worker} has {theirs!s}" for worker, theirs in sorted(theirs_by_worker.items()) if theirs != ours]:
        client.close()
        raise ValueError(f"workers have another program than {ours}, and could judge otherwise: {', '.join(apart)}")
    return client, max(1, sum(client.nthreads().values()))


SCHEDULER_TIMEOUT = 10
"""Longest wait (s) for a scheduler's answer."""
