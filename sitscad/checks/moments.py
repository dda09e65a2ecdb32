"""SIT411 and SIT413: required moments against the moments that array and pad can measure."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sitscad.basics.finding import Severity
from sitscad.basics.units import show
from sitscad.checks.performance import MOMENTS, axis_text
from sitscad.checks.rules import Rule, Verdict, not_checked, rule_of, violation_of
from sitscad.estimates.design import Design
from sitscad.estimates.loads.pressing import rests_on_pad
from sitscad.kernels.mechanics.elastomer import HELD_TILT


def unmeasurable_moments(design: Design) -> Iterator[Verdict]:
    """Yield a finding for each required moment that the array cannot measure.

    The array needs coils on both sides of the moment's axis. It cannot measure a moment and a shear force that change
    the readings in equal ratios. A spec must not require both.
    """
    spec, requirements = design.spec, design.spec.requirements
    if not any(requirements.moments):
        keys = [key for key in ("moment_resolution", "moment_error") if getattr(requirements, key) is not None]
        keys += [f"tilt_error.{name}" for name in MOMENTS if name in requirements.tilt_limits()]
        unrequired = keys[0] if keys else ""
        if unrequired:
            yield violation_of("moment-unrequired", f"requirements.{unrequired}", requirement=unrequired)
        return
    from sitscad.estimates.loads.working_range import INSTEAD, axes_felt  # loaded by the estimates

    axes, count = axes_felt(spec.cell_placements[0], requirements), len(spec.array.placements)
    for name, value in zip(MOMENTS, requirements.moments, strict=True):
        across = "y" if name == "moment_x" else "x"
        if value and name not in axes:
            yield violation_of(
                "moment-line" if count > 1 else "moment-coil", f"requirements.{name}", value, None, "N m",
                hint="moment-line" if count > 1 else "moment-coil", moment=axis_text(name), across=across,
            )
        elif value and requirements.is_shear_told:
            shear = next(shear_axis for shear_axis, other in INSTEAD.items() if other == name)
            yield violation_of("moment-and-shear", f"requirements.{name}", value, None, "N m", hint="moment-or-shear",
                               moment=axis_text(name), shear=axis_text(shear))


def moment_range(design: Design) -> Iterator[Verdict]:
    """Yield a finding for each required moment that tilts the target beyond the valid range of the pad's law."""
    from sitscad.estimates.loads.pad import soft_pad  # loaded by the estimates
    from sitscad.estimates.loads.working_range import FARTHER, full_normal, moment_at

    if not any(design.spec.requirements.moments):
        return
    if not rests_on_pad(design.spec):
        yield not_checked("beside-pad")
        return
    most = moment_at(soft_pad(design.spec), full_normal(design.spec), HELD_TILT)
    for name, value in zip(MOMENTS, design.spec.requirements.moments, strict=True):
        if value > most[name]:
            yield violation_of(
                "moment-range", f"requirements.{name}", value, most[name], "N m", moment=axis_text(name),
                tilt=HELD_TILT, name=name, borne=show(0.95 * most[name], "N m", 2),
                severity=Severity.ERROR if value > FARTHER * most[name] else Severity.WARNING,
            )


RULES: tuple[Rule, ...] = (
    rule_of("SIT411", unmeasurable_moments, "target", "elastomer"),
    rule_of("SIT413", moment_range, "target", "elastomer", tilt=f"{np.degrees(HELD_TILT):.2g}"),
)
