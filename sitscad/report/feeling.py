"""What a sensor feels, in rows: of the documents that JSON has of it, so that a page can show what a file says."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from sitscad.estimates.performance.values import largest_lasting
from sitscad.report.quantities import NONE
from sitscad.units import show

Document = Mapping[str, Any]

FELT_TITLE = "What the sensor feels, after a tare at rest; error: the largest that a calibration leaves"

FELT_HEAD = ("load", "axis", "range N", "ended by", "noise mN", "nonlinear %", "crosstalk %", "error mN", "mostly by",
             "condition")  # fmt: skip


def felt_rows(felt: Sequence[Document]) -> Iterator[list[str]]:
    """The rows of what the sensor feels, one a working point and axis."""
    for point in felt:
        for name, axis in point["axes"].items():
            error, cause = largest_lasting(axis["errors_N"])
            cross = max(point["crosstalk"][name].values(), default=0.0)
            yield [
                point["at"], name, f"{axis['range_N']:.3g}", axis["limited_by"], f"{1e3 * axis['resolution_N']:.3g}",
                f"{100.0 * axis['nonlinearity']:.2g}", f"{100.0 * cross:.2g}", f"{1e3 * error:.3g}", cause,
                f"{point['condition_number']:.2g}",
            ]  # fmt: skip


def unit_rows(unit_to_unit: Document) -> tuple[list[str], list[list[str]]]:
    """Head and rows of what forces are off by from unit to unit, as the data sheet has it; nothing without one."""
    errors = unit_to_unit.get("unit_errors", ())
    if not errors:
        return [], []
    axes = list(errors[0]["error_N"])
    return (["error of the force of", *axes],
            [[one["of"], *(show(one["error_N"][axis], "N", 2) for axis in axes)] for one in errors])  # fmt: skip


def whole_rows(felt: Sequence[Document]) -> Iterator[list[str]]:
    """What belongs to the sensor as a whole, at full load."""
    if not felt:
        return
    full = felt[-1]
    friction = full["friction_error"]
    yield ["error of shear over normal, one sigma", NONE if friction is None else f"+-{friction:.2g}"]
    degrees = f"{math.degrees(full['tilt_rad']):.3g}"
    degrees += " degree" if degrees == "1" else " degrees"
    for name, row in full["tilt_error_N"].items():
        words = ", ".join(f"{show(value, 'N', 3)} by {angle}" for angle, value in row.items())
        yield [f"a contact tilted by {degrees} is misread as {name}", words]
    yield ["bandwidth", f"{show(full['bandwidth_Hz'], 'Hz', 3)}, {full['bandwidth_by']}"]
    for name, frequency in full["resonance_Hz"].items():
        yield [f"resonance of target and pad along {name}, nothing on it", show(frequency, "Hz", 3)]
    yield ["overload", show(full["overload_N"], "N", 3)]
    yield ["one load to a reading", "yes" if full["invertible"] else "NO"]
