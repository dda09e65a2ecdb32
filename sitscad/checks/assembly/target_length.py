"""Signals of two coils in a line under the spec's target, compared with a target as long as the coils' distance."""

from __future__ import annotations

from dataclasses import replace

from sitscad.design import Design
from sitscad.fixes.moves import carrying
from sitscad.geometry.shapes import LONG_PLATE
from sitscad.record import record
from sitscad.spec.places import footprint
from sitscad.spec.sensor import SensorSpec

FREQUENCY = 5e6
"""Frequency (Hz) of the comparison. The ratios of signals hardly depend on it."""

SHEAR_SHARE = 0.25
"""Shear force, as a fraction of the normal force, if the spec states no shear force."""


@record
class LengthGain:
    """Signals of normal and of shear force under another target, each divided by the signal under the spec's target."""

    normal: float
    shear: float


def gain_at_length(design: Design, length: float, shear: float) -> LengthGain | None:
    """Return the gain of a target with another `length` (m) along the line of coils.

    None if a pad gives way sideways, or if a signal is zero.

    Notes
    -----
    The pad becomes as large as it must be to carry the other target. A signal is the change of inductance under half of
    the normal force, or under the shear force. The pad's force law gives the travel, and the model of a finite plate
    gives the change. The coils' noise is the same under both targets, so the ratio of signals is also the ratio of
    resolutions. On two templates the ratios differed by 1 to 15 % from those of `Felt`, for targets of 0.7
    to 1.9 times the distance.
    """
    target, pad = design.spec.target, design.spec.elastomer
    assert target is not None and pad is not None
    middle = (0.0, 0.0)  # an offset is a finding of its own
    target, pad = replace(target, offset=middle), replace(pad, offset=middle)
    spec = replace(design.spec, target=target, elastomer=pad)
    other = replace(target, shape=LONG_PLATE, size=(length, max(target.size[1], spec.coil.size[1])), rotation=0.0)
    wide = replace(pad, shape=LONG_PLATE, size=other.size)
    if pad.size != target.size:
        size = carrying(footprint(spec, pad), footprint(spec, other))
        wide = replace(pad, shape=pad.shape if pad.outline.is_disc else LONG_PLATE, size=size)
    now, then = (_signals(design, one, shear) for one in (spec, replace(spec, target=other, elastomer=wide)))
    if now is None or then is None or not all((*now, *then)):
        return None
    return LengthGain(then[0] / now[0], then[1] / now[1])


def _signals(design: Design, spec: SensorSpec, shear: float) -> tuple[float, float] | None:
    """Return the change (H) of the coils' sum by half of the normal force, and of their difference by the shear force.

    None if the pad gives way sideways under a force.
    """
    import numpy as np

    from sitscad.estimates.response.pad import pushed
    from sitscad.estimates.response.working_range import full_normal
    from sitscad.estimates.states.moved_target import target_effects

    force = design.spec.requirements.normal_force or full_normal(design.spec)
    poses, notes = pushed(spec, np.array([(0.0, shear or SHEAR_SHARE * force, 0.0), (0.5 * force, 0.0, 0.0)]))
    if any(notes) or not np.isfinite(poses).all():
        return None
    moves, heights = [(0.0, 0.0), (float(poses[0, 0]), 0.0)], [0.0, float(poses[1, 2])]
    found = target_effects(replace(design.layout, spec=spec), moves, heights, FREQUENCY)
    moved = found[0, 1] - found[0, 0]
    return float(abs((found[1, 0] - found[0, 0]).sum())), float(abs(moved[0] - moved[1]))
