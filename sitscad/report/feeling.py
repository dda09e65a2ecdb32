"""What a sensor feels, in rows: of the documents that JSON has of it, so that a page can show what a file says."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from sitscad.estimates.performance.values import largest_lasting
from sitscad.report.quantities import NONE
from sitscad.units import show

Document = Mapping[str, Any]

FELT_TITLE = (
    "What the sensor feels, after a tare at rest, its target kept level; error: by the largest single cause that "
    "neither tare nor calibration takes away"
)

FELT_HEAD = ("load", "axis", "range N", "ended by", "noise mN", "nonlinear %", "crosstalk %", "error mN", "mostly by",
             "condition")  # fmt: skip


def felt_rows(felt: Sequence[Document]) -> Iterator[list[str]]:
    """The rows of what the sensor feels, one a working point and axis."""
    for point in felt:
        for name, axis in point["axes"].items():
            error, cause = largest_lasting(axis["errors_N"])
            cross = max(point["crosstalk"][name].values(), default=0.0)
            yield [
                point["at"], name, f"{axis['range_N']:.3g}", axis["limited_by"], _milli(axis["resolution_N"]),
                _hundredths(axis["nonlinearity"]), _hundredths(cross), _milli(error), cause,
                f"{point['condition_number']:.2g}",
            ]  # fmt: skip


def _milli(force: float | None) -> str:
    """A force (N) in mN; of an axis that no reading tells there is none."""
    return "untold" if force is None or math.isinf(force) else f"{1e3 * force:.3g}"


def _hundredths(share: float) -> str:
    return f"{100.0 * share:.0f}" if share >= 0.1 else f"{100.0 * share:.2g}"


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
    free = full["free_overload_N"]
    yield ["overload" if free is None else "overload, target kept level", show(full["overload_N"], "N", 3)]
    if free is not None:
        yield ["overload, target free to tilt: the pad gives way sideways", show(free, "N", 3)]
    yield ["one load to a reading", "yes" if full["invertible"] else "NO"]
