"""The design's measures in its jaw, as rules judge them: nominally, by root-sum-square of tolerances, at worst."""

from __future__ import annotations

from sitscad.checks.assembly.fit import ROUNDING
from sitscad.design import Design
from sitscad.finding import Severity
from sitscad.measured import Measure
from sitscad.units import show

JAW_SOURCE = "the jaw's figures (mount.jaw); thesis of Jones 2.5: jaw about 5 mm wide, sensing body 5 x 10 mm"


def measure_of(design: Design, name: str) -> Measure | None:
    """One of the design's measures; None where it was not taken."""
    return next((measure for measure in design.fit if measure.name == name), None)


def weight_of(measure: Measure) -> Severity | None:
    """An error where it is too much nominally or by root-sum-square, a warning where it is at worst."""
    if max(measure.nominal, measure.root_sum_square) > measure.limit + ROUNDING:
        return Severity.ERROR
    return Severity.WARNING if measure.worst > measure.limit + ROUNDING else None


def with_tolerances(measure: Measure) -> str:
    """What tolerances make of a size, in words."""
    likely, worst = (show(value, "m", 4) for value in (measure.root_sum_square, measure.worst))
    return f" ({likely} by root-sum-square of all tolerances, {worst} at worst)"
