"""Quantities that belong to the sensor as a whole, as rows of texts, pages and data sheets."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from sitscad.estimates.performance.values import AXIS_WORDS, INSTABILITY
from sitscad.units import NONE, show

SIDEWAYS = "the pad gives way sideways"  # Ends a normal force before the pad is strained too far


def sensor_rows(points: Sequence[Mapping[str, Any]]) -> Iterator[tuple[str, str]]:
    """Yield name and value of the quantities that belong to the sensor as a whole.

    `points` are documents of `Performance`, from rest to full load.
    """
    first, full = points[0], points[-1]
    ends = SIDEWAYS if full["axes"]["normal"]["limited_by"] == INSTABILITY else "30 % strain of the pad"
    free = full["free_overload_N"]
    yield f"overload{', kept level' if free is not None else ''} ({ends})", show(full["overload_N"], "N", 3)
    if free is not None:
        yield f"overload, free to tilt ({SIDEWAYS})", show(free, "N", 3)
    for point in (first, full):
        yield f"stiffness against a tilt, {point['at']}", _stiffness_text(point)
    friction = full["friction_error"]
    ratio = NONE if friction is None else f"+-{friction:.2g} (one sigma)"
    yield "error of the ratio of shear to normal force, full load", ratio
    slowest = min(points, key=lambda point: float(point["bandwidth_Hz"]))
    yield f"bandwidth ({slowest['bandwidth_by']})", show(slowest["bandwidth_Hz"], "Hz", 3)
    resonances = (f"{show(value, 'Hz', 2)} {AXIS_WORDS[name]}" for name, value in first["resonance_Hz"].items())
    yield "resonance of target and pad at rest, nothing on it", ", ".join(resonances) or NONE
    yield ("condition number, rest to full load",
           f"{first['condition_number']:.2g} to {full['condition_number']:.2g}")
    yield "each reading means one load", "yes" if full["invertible"] else "NO: see the notes"


def _stiffness_text(point: Mapping[str, Any]) -> str:
    """Return the stiffness against a moment on the target's outermost face, with one sigma by the pad's law."""
    texts = []
    for turn, value in point["tilt_stiffness_Nm_per_rad"].items():
        error = point["tilt_stiffness_error"][turn]
        known = value is not None and error is not None and error < 1.0
        texts.append(f"{turn} {show(value, 'N m', 3)}/rad +- {100.0 * error:.0f} %" if known else f"{turn}: not known")
    return ", ".join(dict.fromkeys(texts))
