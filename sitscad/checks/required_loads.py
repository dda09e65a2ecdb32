"""SIT410: requirements that contradict each other. SIT411 and SIT413: required moments beyond array and pad."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from sitscad.basics.finding import Severity
from sitscad.basics.units import show
from sitscad.checks.fixes.moves import reread_changes
from sitscad.checks.performance import MOMENTS, axis_text
from sitscad.checks.rules import Rule, Verdict, not_checked, rule_of, violation_of
from sitscad.estimates.design import Design
from sitscad.estimates.loads.pad import soft_pad
from sitscad.estimates.loads.pressing import rests_on_pad
from sitscad.estimates.loads.working_range import FARTHER, INSTEAD, full_normal_force, largest_moments, measured_axes
from sitscad.kernels.mechanics.elastomer import HELD_TILT


def unmeasurable_moments(design: Design) -> Iterator[Verdict]:
    """Yield a finding for each required moment that the array cannot measure.

    The array needs coils on both sides of the moment's axis. If a shear force changes the readings in the same ratios
    as the moment, a spec must not require both. Further findings are on a required resolution or error of a moment that
    the spec does not require.
    """
    spec, requirements = design.spec, design.spec.requirements
    if not any(requirements.moments):
        keys = [key for key in ("moment_resolution", "moment_error") if getattr(requirements, key) is not None]
        keys += [f"tilt_error.{name}" for name in MOMENTS if name in requirements.tilt_limits()]
        unrequired = keys[0] if keys else ""
        if unrequired:
            yield violation_of("moment-unrequired", f"requirements.{unrequired}", requirement=unrequired)
        return
    axes, count = measured_axes(spec.cell_placements[0], requirements), len(spec.array.placements)
    for name, value in zip(MOMENTS, requirements.moments, strict=True):
        across = "y" if name == "moment_x" else "x"
        if value and name not in axes:
            yield violation_of(
                "moment-line" if count > 1 else "moment-coil", f"requirements.{name}", value, None, "N m",
                hint="moment-line" if count > 1 else "moment-coil", moment=axis_text(name), across=across,
            )
        elif value and requirements.is_shear_accuracy_required:
            shear = next(shear_axis for shear_axis, other in INSTEAD.items() if other == name)
            yield violation_of("moment-and-shear", f"requirements.{name}", value, None, "N m", hint="moment-or-shear",
                               moment=axis_text(name), shear=axis_text(shear))


def moment_range(design: Design) -> Iterator[Verdict]:
    """Yield a finding for each required moment that tilts the target beyond the valid range of the pad's force law."""
    if not any(design.spec.requirements.moments):
        return
    if not rests_on_pad(design.spec):
        yield not_checked("beside-pad")
        return
    most = largest_moments(soft_pad(design.spec), full_normal_force(design.spec))
    for name, value in zip(MOMENTS, design.spec.requirements.moments, strict=True):
        if value > most[name]:
            yield violation_of(
                "moment-range", f"requirements.{name}", value, most[name], "N m", moment=axis_text(name),
                tilt=HELD_TILT, name=name, borne=show(0.95 * most[name], "N m", 2),
                severity=Severity.ERROR if value > FARTHER * most[name] else Severity.WARNING,
            )


def requirements_agree(design: Design) -> Iterator[Verdict]:
    """Yield findings on a temperature outside ``temperature_range``, and on load cases beyond the required forces."""
    requirements, written = design.spec.requirements, design.spec.source.keys
    if requirements.temperature_range is not None:
        low, high = requirements.temperature_range
        if not low <= requirements.temperature <= high:
            is_written = not written or "requirements.temperature" in written
            nearest = low if requirements.temperature < low else high
            yield violation_of(
                "temperature-range", "requirements.temperature" if is_written else "requirements.temperature_range",
                requirements.temperature, nearest, "degC", details=() if is_written else ("temperature-default",),
                severity=None if is_written else Severity.NOTE, low=low, high=high, nearest=f"{nearest:g} degC",
                fixes=(partial(reread_changes, design.spec, "requirements.temperature", [f"{nearest:g} degC"]),),
            )
    for load in design.spec.loads:
        shear = max(map(abs, load.shear))
        for force, most, name in ((load.normal, requirements.normal_force, "normal"),
                                  (shear, requirements.shear_force, "shear")):
            if force and most is not None and force > most * (1 + 1e-9):
                yield violation_of("load-beyond", f"loads.{load.name}", force, most, "N", severity=Severity.WARNING,
                                   load=load.name, kind=name)


RULES: tuple[Rule, ...] = (
    rule_of("SIT410", requirements_agree),
    rule_of("SIT411", unmeasurable_moments, "target", "elastomer"),
    rule_of("SIT413", moment_range, "target", "elastomer", tilt=f"{np.degrees(HELD_TILT):.2g}"),
)
