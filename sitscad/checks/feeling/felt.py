"""What the rules of this room look at: the sensor's performance by the quick method, worked out once a design."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import wraps
from typing import TYPE_CHECKING

import numpy as np

from sitscad.checks.rules import Advice, Undecided, Verdict
from sitscad.design import Design
from sitscad.measured import Reached
from sitscad.readout.converter import source_in_all
from sitscad.record import record
from sitscad.remedy.feeling import other_metals, other_silicones, other_thicknesses, slower_scans
from sitscad.remedy.search import first_tried
from sitscad.spec.sensor import Requirements, SensorSpec

if TYPE_CHECKING:
    from sitscad.estimates.performance.quick import QuickPerformance

NOTHING_FELT = Undecided(
    "nothing of what the sensor feels was estimated: it takes a target on its pad and tanks that oscillate at rest"
)

GIVES_WAY = (
    "the pad gives way sideways {where} (SIT304 and SIT312 judge that): nothing can be said of what is felt there"
)

NOISE_STEPS_SOURCE = (
    f"noise by {source_in_all('noise_law')}, slopes as in the states and SIT218, pad by its law; within a few per cent "
    "of `response --performance`, tilts 10 %"
)


def note_reached(design: Design, reached: Reached) -> None:
    """Keep what is felt beside what is asked, met or not."""
    design.once("reached", dict[str, Reached])[reached.requirement] = reached


def noted(design: Design) -> tuple[Reached, ...]:
    """What was kept, in the order of the rules; where something was, also what warmth after the tare makes of nothing
    at all, asked or not: it is most of what many sensors are off by.
    """
    kept = sorted(design.once("reached", dict[str, Reached]).values(), key=lambda each: each.rule)
    found, needs = design.felt if kept else None, design.spec.requirements
    if found is None or not found.held[0]:
        return tuple(kept)
    end = farthest(needs)
    drift = abs(end - needs.temperature) * found.warmed[0].temperature
    k = int(np.argmax(drift / found.bench.full_scales))
    at = f"between {needs.temperature:.3g} and {end:.3g} degC"
    return (*kept, Reached("zero_drift", "SIT406", float(drift[k]), None, "N", _along(found.bench.names[k]), at))


def farthest(needs: Requirements) -> float:
    """The temperature (degrees Celsius) of the required range that is farthest from the tare's; `WARMER` where none is
    required, as in the budget of errors.
    """
    from sitscad.estimates.performance.causes import WARMER  # loaded by whatever feels

    ends = needs.temperature_range or (needs.temperature + WARMER,)
    return max(ends, key=lambda end: abs(end - needs.temperature))


def _along(axis: str) -> str:
    return axis.replace("_", " along ")


def where_felt(rule: Callable[[QuickPerformance, Design], Iterator[Verdict]],) -> Callable[[Design], Iterator[Verdict]]:
    """A rule about what the sensor feels at working points, as a rule about a design: undecided where there is nothing
    to feel, and of points at which the pad gives way.
    """

    @wraps(rule)
    def apply(design: Design) -> Iterator[Verdict]:
        found = design.felt
        if found is None:
            yield NOTHING_FELT
        else:
            yield from rule(found, design)
            lost = [at for at, is_held in zip(POINTS, found.held, strict=True) if not is_held]
            if lost:
                yield Undecided(GIVES_WAY.format(where=lost[0]))

    return apply


def where_held(
    rule: Callable[[QuickPerformance, Design], Iterator[Verdict]],
) -> Callable[[QuickPerformance, Design], Iterator[Verdict]]:
    """A rule about the whole working range: nothing where the pad gives way within it, and so undecided."""

    @wraps(rule)
    def apply(found: QuickPerformance, design: Design) -> Iterator[Verdict]:
        if found.is_range_held:
            yield from rule(found, design)
        elif all(found.held):
            yield Undecided(GIVES_WAY.format(where="under full shear"))

    return apply


POINTS = ("at rest", "at half load", "at full load")
"""The working points, in words."""


@record
class Worst:
    """The largest of some figures, and where it is."""

    value: float
    axis: str
    at: str


def worst(found: QuickPerformance, axes: Iterable[str], of: Callable[[int, int], float]) -> Worst | None:
    """The largest of what `of` gives for a working point and an axis by their numbers, where the pad holds the target;
    None without such axes.
    """
    names = found.bench.names
    each = [Worst(of(point, names.index(axis)), _along(axis), where) for point,
            where in enumerate(POINTS) if found.held[point] for axis in axes if axis in names]
    return max(each, key=lambda one: one.value, default=None)


def more_signal(spec: SensorSpec, factor: float | None = None) -> Advice:
    """A hint with metals and pads that feel more per newton; with a factor, first as many times fewer scans."""
    slower = [list(slower_scans(spec, factor))] if factor is not None else []
    pads = [list(other_silicones(spec, is_softer=True)), list(other_thicknesses(spec))]
    return first_tried([*slower, list(other_metals(spec)), *pads])


def less_travel(spec: SensorSpec) -> Advice:
    """A hint with pads on which the target moves less."""
    return first_tried([list(other_silicones(spec, is_softer=False)), list(other_thicknesses(spec))])
