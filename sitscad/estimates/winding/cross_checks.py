"""Published closed formulas beside the estimate, or why there is none."""

from __future__ import annotations

import math
from collections.abc import Sequence

from sitscad.estimates.values import CrossCheck
from sitscad.estimates.winding.methods import METHODS, WindingGeometry, tabulated
from sitscad.spec.coil import CoilSpec


def cross_checks(name: str, geometry: WindingGeometry, inductance: float) -> tuple[CrossCheck, ...]:
    """Every closed formula that knows the coil's shape, beside the winding's inductance (H)."""
    found = []
    for method in METHODS:
        if method.is_cross_check and method.serves(geometry.spec.outline):
            value = method.solve(geometry)
            if value is not None and math.isfinite(value):
                found.append(CrossCheck(name, method.name, value, value / inductance - 1.0, method.is_valid(geometry),
                                        method.validity))  # fmt: skip
    return tuple(found)


def no_cross_check(coil: CoilSpec, found: Sequence[CrossCheck]) -> str | None:
    """Why no closed formula stands beside the estimate; None where one does."""
    if found:
        return None
    if not tabulated(coil.outline):
        return (
            f"no published closed formula with a stated range is known to us for a {coil.shape}: Mohan (1999) has "
            "none, and TI (SNOA930C) gives none for elongated coils"
        )
    return "Mohan's formulas (1999) want one number of turns on all layers, one turn or more, and an open middle"
