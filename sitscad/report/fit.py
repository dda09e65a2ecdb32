"""How the sensor fits its jaw, in words, rows and JSON: nominally, with tolerances, and what is to spare."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from sitscad.units import show

if TYPE_CHECKING:
    from sitscad.scene.fit import Measure

FIT_TITLE = "Fit in the jaw, as glued together"
FIT_HEAD = ("measure", "nominal", "root-sum-square", "at worst", "limit", "to spare at worst", "decided by")
PARTS_TITLE = "What the closed pair is made of"
PARTS_HEAD = ("part", "size", "tolerance", "where that comes from")


def headline(fit: Sequence[Measure]) -> str:
    """All measures in one line."""
    return f"({CASES}): " + "; ".join(f"{m.name} {_cases(m)} of {_mm(m.limit)} mm, {_spare(m)}" for m in fit)


CASES = "nominal / root-sum-square / worst case"


def _cases(measure: Measure) -> str:
    return " / ".join(_mm(value) for value in (measure.nominal, measure.root_sum_square, measure.worst))


def _mm(value: float) -> str:
    return f"{value * 1e3:.3f}".rstrip("0").rstrip(".")


def _spare(measure: Measure) -> str:
    if measure.margin >= 0.0:
        return f"{_length(measure.margin, 3)} to spare at worst"
    return f"{_length(-measure.margin, 3)} short at worst" + (
        "" if measure.likely_margin >= 0.0 else f", {_length(-measure.likely_margin, 3)} by root-sum-square"
    )


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


def fit_json(measure: Measure) -> dict[str, Any]:
    """One measure as plain values for JSON."""
    return {
        "name": measure.name,
        "nominal_m": measure.nominal,
        "root_sum_square_m": measure.root_sum_square,
        "worst_m": measure.worst,
        "limit_m": measure.limit,
        "margin_m": measure.margin,
        "decided_by": measure.decided_by,
        "parts": [
            {"part": s.part, "nominal_m": s.nominal, "tolerance_m": s.tolerance, "source": s.source}
            for s in measure.parts
        ],
    }


def _length(value: float, digits: int = 4) -> str:
    return show(round(value, 9) + 0.0, "m", digits)
