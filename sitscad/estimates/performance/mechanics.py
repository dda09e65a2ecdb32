"""What the pad itself follows: its resonance with the target on it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sitscad.data import rows
from sitscad.estimates.performance.bench import Bench
from sitscad.estimates.performance.values import AXES
from sitscad.scene.bodies import film_thickness
from sitscad.spec.sensor import SensorSpec

Array = NDArray[np.float64]

MOVING = 1.0 / 3.0
"""Share of the pad's mass that moves with the target: its lower face stands still (Rayleigh)."""


def moving_mass(spec: SensorSpec) -> float | None:
    """Mass (kg) of target, film over it and a third of the pad under it; None where a density is not known."""
    target, pad, skin = spec.target, spec.elastomer, spec.encapsulation
    assert target is not None and pad is not None
    known = {row["material"]: float(row["density"]) for row in rows("densities")}
    metal = known.get(target.material.name)
    if metal is None or pad.material.density is None:
        return None
    area = math.prod(target.size) * target.outline.area
    mass = area * (metal * target.thickness + MOVING * pad.material.density * pad.thickness)
    if skin is not None and skin.material.density is not None:
        mass += area * skin.material.density * film_thickness(spec)
    return mass


def resonances(bench: Bench, pose: Array) -> dict[str, float]:
    """Frequency (Hz) at which target and pad swing by themselves along every axis told apart, at a pose (6,) of a level
    target with nothing on it: sqrt(k / m) / (2 pi), without damping. Nothing where a density is not known.
    """
    mass = moving_mass(bench.spec)
    if mass is None:
        return {}
    stiffness = np.diag(bench.pad.stiffness(pose[None])[0])[[2, 0, 1]]
    return {name: math.sqrt(max(float(stiffness[AXES.index(name)]), 0.0) / mass) / (2.0 * math.pi)
            for name in bench.names}  # fmt: skip
