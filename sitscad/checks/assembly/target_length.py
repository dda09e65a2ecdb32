"""How finely two coils in a line tell forces under a target as it is, beside one as long as they stand apart."""

from __future__ import annotations

from dataclasses import replace

from sitscad.design import Design
from sitscad.fixes.moves import carrying
from sitscad.geometry.shapes import LONG_PLATE
from sitscad.record import record
from sitscad.spec.places import footprint
from sitscad.spec.sensor import SensorSpec

FREQUENCY = 5e6
"""Hz: the ratios of signals under two targets hardly depend on it."""

SHEAR_SHARE = 0.25
"""Shear force over normal force for a sensor that states none."""


@record
class LengthGain:
    """Signals of normal force and of shear under the other target, each over the signal under the target as it is."""

    normal: float
    shear: float


def gain_at_length(design: Design, length: float, shear: float) -> LengthGain | None:
    """Gain of a target of a `length` (m) along the line, on a pad that carries it; None if a pad gives way.

    Notes
    -----
    A signal is the change of inductance under half of the normal force and under the shear force: the pad's law gives
    the travel, and the finite plate's share gives the change. The noise of the coils is the same under both targets, so
    signals are as far apart as resolutions. Beside the quick method of `Felt` the ratios were off by 1 to 15 % on two
    templates, for targets of 0.7 to 1.9 times the distance.
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
        wide = replace(pad, shape=pad.shape if pad.outline.is_round else LONG_PLATE, size=size)
    now, then = (_signals(design, one, shear) for one in (spec, replace(spec, target=other, elastomer=wide)))
    if now is None or then is None or not all((*now, *then)):
        return None
    return LengthGain(then[0] / now[0], then[1] / now[1])


def _signals(design: Design, spec: SensorSpec, shear: float) -> tuple[float, float] | None:
    """Changes (H) of the sum by half of the normal force and of the difference by the shear; None on a lost pad."""
    import numpy as np

    from sitscad.estimates.response.pad import pushed
    from sitscad.estimates.response.working_range import full_normal
    from sitscad.estimates.states.moved_target import target_effects

    force = design.spec.requirements.normal_force or full_normal(design.spec)
    poses, notes = pushed(spec, np.array([(0.0, shear or SHEAR_SHARE * force, 0.0), (0.5 * force, 0.0, 0.0)]))
    if any(notes) or not np.isfinite(poses).all():
        return None
    moves, heights = [(0.0, 0.0), (float(poses[0, 0]), 0.0)], [0.0, float(poses[1, 2])]
    found = target_effects(replace(design.layout, spec=spec), moves, heights, FREQUENCY, is_rough=True).real
    moved = found[0, 1] - found[0, 0]
    return float(abs((found[1, 0] - found[0, 0]).sum())), float(abs(moved[0] - moved[1]))
