"""The pad under the required force: how far it gives way, and by how much that scatters."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field, replace

from sitscad.mechanics.elastomer import Compression, Face, press
from sitscad.record import record
from sitscad.spec.sensor import SensorSpec

MODULUS, PAD, PAD_SIZE, PART = "elastomer modulus", "elastomer thickness", "elastomer size", "part of the pad loaded"
"""What scatters the gap. The last is no scatter of manufacture: by how much the careful strain may be too large."""

LEAST = 0.05
"""Share of its modulus and of its thickness that a pad has at least, however large one sigma is."""

SIGMAS_APART = 2.0
"""One sigma of a cause is half of the difference between its two cases."""


@record
class PressingScatter:
    """One standard deviation of strain, thickness left (m) and apparent modulus (Pa) of the pressed pad.

    `cause` is what the strain's owes most to; `shares` are the standard deviations of the strain by cause.
    """

    strain: float
    gap: float
    apparent_modulus: float
    cause: str
    shares: Mapping[str, float] = field(default_factory=dict)


def pressed(spec: SensorSpec, modulus: float = 1.0, thicker: float = 0.0, wider: float = 0.0) -> Compression:
    """The pad under the required normal force, carried by the target where there is one.

    For scatter: the shear modulus times a factor, the pad thicker and wider by so much (m).
    """
    pad, target = spec.elastomer, spec.target
    assert pad is not None
    face = Face(*pad.size, pad.shape == "circle").grown(wider)
    over = Face(*target.size, target.shape == "circle") if target is not None else None
    thickness = max(LEAST * pad.thickness, pad.thickness + thicker)
    stiffness = max(LEAST, modulus) * pad.material.shear_modulus
    return press(face, over, thickness, stiffness, pad.material.bulk_modulus, spec.requirements.normal_force or 0.0)


def pressed_cases(spec: SensorSpec, sigmas: Mapping[str, float]) -> dict[str, tuple[Compression, Compression]]:
    """The pressed pad one sigma to either side, by cause; of PART from the stated strain to two sigma less."""
    assert spec.elastomer is not None
    modulus = spec.elastomer.material.shear_modulus_sigma
    found = {MODULUS: (pressed(spec, modulus=1.0 - modulus), pressed(spec, modulus=1.0 + modulus))}
    if sigmas.get(PAD):
        found[PAD] = pressed(spec, thicker=-sigmas[PAD]), pressed(spec, thicker=sigmas[PAD])
    if sigmas.get(PAD_SIZE):
        found[PAD_SIZE] = pressed(spec, wider=-sigmas[PAD_SIZE]), pressed(spec, wider=sigmas[PAD_SIZE])
    stated = pressed(spec)
    if stated.doubt > 0.0:
        found[PART] = stated, _stiffer(stated, spec.elastomer.thickness)
    return found


def pressing_scatter(spec: SensorSpec, sigmas: Mapping[str, float]) -> PressingScatter | None:
    """The scatter of the pressed pad, causes being independent; None without a pad or a force."""
    if spec.elastomer is None or not spec.requirements.normal_force:
        return None
    cases = pressed_cases(spec, sigmas)
    strain = {cause: abs(a.strain - b.strain) / SIGMAS_APART for cause, (a, b) in cases.items()}
    return PressingScatter(
        strain=math.hypot(*strain.values()),
        gap=math.hypot(*(abs(a.gap - b.gap) / SIGMAS_APART for a, b in cases.values())),
        apparent_modulus=math.hypot(
            *(abs(a.apparent_modulus - b.apparent_modulus) / SIGMAS_APART for a, b in cases.values())
        ),
        cause=max(strain, key=lambda cause: strain[cause]),
        shares=strain,
    )


def _stiffer(stated: Compression, thickness: float) -> Compression:
    """A pad that gives way by two sigma of the doubt less; the modulus remains that of the loaded part alone."""
    strain = max(stated.strain - SIGMAS_APART * stated.doubt, LEAST * stated.strain)
    return replace(stated, strain=strain, gap=thickness * (1.0 - strain))
