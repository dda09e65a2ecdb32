"""How the sensor fits its jaw, in words, rows and JSON: nominally, with tolerances, and what is to spare."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from sitscad.units import show

if TYPE_CHECKING:
    from sitscad.measured import Closing, Measure

FIT_TITLE = "Fit in the jaw, as glued together"
FIT_HEAD = ("measure", "nominal", "root-sum-square", "at worst", "limit", "to spare at worst", "decided by")
PARTS_TITLE = "What the closed pair is made of"
PARTS_HEAD = ("part", "size", "tolerance", "where that comes from")


def fit_words(fit: Sequence[Measure], whole: bool = False) -> list[str]:
    """A line a measure: at worst, or in all three cases."""
    if not whole:
        return [f"{m.name} at worst {_mm(m.worst)} of {_mm(m.limit)} mm{_side(m)}, {_spare(m)}" for m in fit]
    return [f"{m.name} {_cases(m)} of {_mm(m.limit)} mm{_side(m)}, {_spare(m)}" for m in fit]


def _side(measure: Measure) -> str:
    """What a figure below zero means: only the board beside the face has such."""
    return " (below zero: back from the face's edge)" if measure.nominal < 0.0 else ""


def _cases(measure: Measure) -> str:
    nominal, likely, worst = map(_mm, (measure.nominal, measure.root_sum_square, measure.worst))
    return f"{nominal}, by root-sum-square {likely}, at worst {worst}"


def _mm(value: float) -> str:
    return f"{value * 1e3:.3f}".rstrip("0").rstrip(".")


def _spare(measure: Measure) -> str:
    if measure.margin >= 0.0:
        return f"{_length(measure.margin, 3)} to spare"
    likely = "" if measure.likely_margin >= 0.0 else f" ({_length(-measure.likely_margin, 3)} by root-sum-square)"
    return f"{_length(-measure.margin, 3)} short{likely}"


def fit_rows(fit: Sequence[Measure]) -> list[list[str]]:
    """One row a measure."""
    return [
        [
            m.name,
            *(_length(value) for value in (m.nominal, m.root_sum_square, m.worst, m.limit, m.margin)),
            m.decided_by,
        ]
        for m in fit
    ]


def part_rows(fit: Sequence[Measure]) -> list[list[str]]:
    """What the first measure, the closed pair, is made of, from the jaw upwards."""
    return [
        [share.part, _length(share.nominal) if share.nominal else "", f"+-{_length(share.tolerance)}", share.source]
        for measure in fit[:1]
        for share in measure.parts
    ]


MEASURE = {
    "name": "name",
    "nominal_m": "nominal",
    "root_sum_square_m": "root_sum_square",
    "worst_m": "worst",
    "limit_m": "limit",
    "margin_m": "margin",
    "decided_by": "decided_by",
}
"""What JSON says of a measure beside its parts, and the fields of `Measure` that it stands for (the margin follows)."""

SHARE = {"part": "part", "nominal_m": "nominal", "tolerance_m": "tolerance", "source": "source"}
"""The same of a part and `Share`."""


def fit_json(measure: Measure) -> dict[str, Any]:
    """One measure as plain values for JSON."""
    told = {key: getattr(measure, field) for key, field in MEASURE.items()}
    return told | {"parts": [{key: getattr(s, field) for key, field in SHARE.items()} for s in measure.parts]}


CLOSING_TITLE = "The jaws about their hinge, on tissue between them at the sensor's middle"
CLOSING_HEAD = ("tissue", "angle between the faces", "touches first", "faces slide until parallel")
_TISSUE = (0.0, 0.5e-3, 1e-3, 2e-3, 3e-3, 5e-3)


def closing_words(closing: Closing) -> str:
    """At which grasped thickness the faces are parallel, and how much they tilt on thicker tissue, in one line."""
    tilt = closing.tilt(closing.parallel_at + 1e-3)
    leans = "" if tilt is None else f"; every millimetre more tilts them by {math.degrees(tilt):.1f} deg"
    if closing.parallel_at < 0.0:
        return f"the sensor is {_length(-closing.parallel_at, 3)} too thick for faces that are ever parallel{leans}"
    return f"the faces are parallel on {_length(closing.parallel_at, 3)} of tissue{leans}"


def closing_rows(closing: Closing | None) -> list[list[str]]:
    """Thicknesses of tissue, and how the faces stand on them; nothing without a jaw or its hinge."""
    if closing is None:
        return []
    at = sorted({*_TISSUE, *([closing.parallel_at] if closing.parallel_at > 0.0 else [])})
    most = closing.most
    angles = [(t, closing.tilt(t)) for t in at if most is None or t <= most]
    return [
        [_length(t, 3), f"{math.degrees(angle) + 0.0:.1f} deg", _first(angle), _length(abs(closing.slide(t) or 0.0), 3)]
        for t, angle in angles
        if angle is not None
    ]


def _first(angle: float) -> str:
    if abs(angle) < 1e-6:
        return "the whole face"
    return "the heel" if angle > 0.0 else "the tip"


def closing_json(closing: Closing) -> dict[str, Any]:
    """How the jaws close, as plain values for JSON."""
    return {
        "parallel_at_m": closing.parallel_at,
        "reach_m": closing.reach,
        "opening_rad": closing.opening,
        "most_m": closing.most,
        "pivot_offset_m": closing.offset,
        "tilt": [{"thickness_m": t, "tilt_rad": closing.tilt(t), "slide_m": closing.slide(t)} for t in _TISSUE],
    }


def _length(value: float, digits: int = 4) -> str:
    return show(round(value, 9) + 0.0, "m", digits)
