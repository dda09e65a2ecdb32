"""Effect of the other jaw's metal, in front of the target, on the coils' inductances.

A closed jaw comes to less than a millimetre of the target. The part of the coils' field that the target does not shield
reaches the metal of this jaw. A sensor that was tared with open jaws then reads a false force. The metal is modelled as
an infinite plate, as thick as the jaw and parallel to the target. Windows, pockets and rims in the jaw are left out.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from sitscad.assembly.places.bodies import film_thickness
from sitscad.assembly.places.state import REST
from sitscad.basics.arrays import Array
from sitscad.basics.record import replace
from sitscad.estimates.circuits.solved_winding import SolvedWindings, spectrum_near_metal
from sitscad.estimates.circuits.uncertainty import tolerance_sigmas
from sitscad.estimates.coil_estimates import CoilEstimate
from sitscad.estimates.states.placed import TargetPoses, target_centre_at_rest
from sitscad.estimates.states.plate import make_target_plate
from sitscad.estimates.targets.assembly import (
    LEAST_CONDUCTIVITY,
    assemble,
    metal_behind,
    metal_sheet,
    spec_at_temperature,
)
from sitscad.kernels.electromagnetics.metal.half_spaces import MetalLayer, Reflector, reflected_inductances
from sitscad.layout.board import Layout
from sitscad.spec.materials import Encapsulation
from sitscad.spec.mount import Jaw

GRASPED = (0.0, 1e-3, 2e-3)
"""Thicknesses (m) of the grasped object between sensor and other jaw for which the effect is stated.

0 is no object, 1 mm a thin object and 2 mm a usual object (an assumption).
"""

ERROR, LEAST_ERROR = 0.05, 2e-4
"""Stated relative error of the inductance change by the other jaw, and least error relative to the target's change.

Discs of finite elements differ by 2 % of the change by the jaw, and by 1e-4 of the target's change
(tests/validation/test_front_metal.py).
"""


def front_plate(jaw: Jaw | None) -> MetalLayer | None:
    """Return the other jaw's metal as an infinite plate. None if the spec has no jaw, or if it does not conduct."""
    if jaw is None or jaw.material.conductivity <= LEAST_CONDUCTIVITY:
        return None
    return metal_sheet(jaw.material, jaw.height)


def distance_to_other_jaw(film: Encapsulation | None, jaw: Jaw | None) -> float:
    """Return the distance (m) from the target's outer face to the other jaw's metal if the jaws are closed and empty.

    It is the thickness of the encapsulating film and of the pad on the other jaw.
    """
    assert jaw is not None
    return film_thickness(film) + jaw.opposing_pad_thickness


def other_jaw_changes(
    windings: SolvedWindings, frequency: float, heights: Sequence[float], grasped: Sequence[float]
) -> Array:
    """Return each coil's inductance change (heights, grasped, coils; H) by the other jaw's metal.

    `frequency` is in Hz. The target is level and displaced by `heights` (m) from rest. `grasped` (m) are the
    thicknesses of an object between the sensor's top and the other jaw. The coils' field that induces the target's
    eddy currents includes its reflection by the other jaw. The eddy currents have images in the metal behind the board
    and in the other jaw.
    """
    spec, coils = windings.spec, windings.layout.coils
    plate, spectrum, behind = front_plate(spec.jaw), windings.winding.spectrum, metal_behind(spec)
    assert plate is not None and spec.target is not None and spectrum is not None
    at, changes = np.array([frequency]), np.zeros((len(heights), len(grasped), len(coils)))
    for row, height in enumerate(heights):
        target_poses = TargetPoses.from_rest(
            spec.target, target_centre_at_rest(spec), np.array([[0.0, 0.0, height, 0.0, 0.0, 0.0]]))
        cover = replace(target_poses.pose_range(spec.target, spec.coil, coils, spec.array.middle),
                        lowest=float(target_poses.lowest[0]))
        top = cover.lowest + spec.target.thickness + distance_to_other_jaw(spec.encapsulation, spec.jaw)
        each = []
        for front in (None, *(Reflector(top + between, (plate,)) for between in grasped)):
            whole = make_target_plate(spec.target, spec.coil, coils, (frequency,), behind, cover, front=front)
            target = np.einsum("cc->c", whole.changes(target_poses.turns, target_poses.places, True)[0][0, 0])
            each.append((target + reflected_inductances(spectrum, at, front, behind, (0.0,))[0, 0]).real)
        changes[row] = np.array(each[1:]) - each[0]
    return changes


def reference_change(
    layout: Layout, reference: CoilEstimate | None, temperature: float, grasped: float
) -> float | None:
    """Return the inductance change (H) of the reference coil by the other jaw's metal.

    `temperature` (degrees Celsius) is of copper and metals. `grasped` (m) is the thickness of an object between the
    sensor's top and the other jaw. None if the sensor has no jaw of metal, no target or no reference coil at rest.
    """
    spec = spec_at_temperature(layout.spec, temperature)
    plate, behind, target = front_plate(spec.jaw), metal_behind(spec), spec.target
    state = None if reference is None else reference.states.get(REST)
    if plate is None or target is None or state is None or not math.isfinite(state.frequency):
        return None
    spectrum = spectrum_near_metal(spec.reference_coil, layout.coils[-1], assemble(spec, tolerance_sigmas(spec)))
    assert spectrum is not None
    outer_face = float(target_centre_at_rest(spec)[2]) + target.thickness
    face = outer_face + distance_to_other_jaw(spec.encapsulation, spec.jaw) + grasped
    none, with_jaw = (
        float(reflected_inductances(spectrum, np.array([state.frequency]), front, behind, (0.0,))[0, 0].real)
        for front in (None, Reflector(face, (plate,))))
    return with_jaw - none


def estimate_other_jaw_changes(
    layout: Layout, coils: Sequence[CoilEstimate], temperature: float, grasped: float
) -> Mapping[str, float]:
    """Return a rough inductance change (H) of each coil at rest by the other jaw's metal.

    The change of a coil without a target is multiplied by 1 - r. r is the target's effect divided by an infinite
    plate's. For targets that cover the coils, the result is up to 1.5 times the field solution in empty jaws, and up
    to 2 times with an object of 1 mm. Otherwise it is within 25 % (jaw templates). Empty if the jaw has no metal, or if
    there is no target. `grasped` (m) is the thickness of an object between the sensor's top and the other jaw.
    """
    spec = spec_at_temperature(layout.spec, temperature)
    plate, behind, target = front_plate(spec.jaw), metal_behind(spec), spec.target
    if plate is None or target is None:
        return {}
    spectrum = spectrum_near_metal(spec.coil, layout.coils[0], assemble(spec, tolerance_sigmas(spec)))
    assert spectrum is not None
    height, changes = float(target_centre_at_rest(spec)[2]), {}
    for coil in coils:
        state = coil.states.get(REST)
        if state is None or not state.target_change or not math.isfinite(state.frequency):
            continue
        at = np.array([state.frequency])
        face = height + target.thickness + distance_to_other_jaw(spec.encapsulation, spec.jaw) + grasped
        fronts = None, Reflector(height, (metal_sheet(target.material, target.thickness),)), Reflector(face, (plate,))
        none, endless, with_jaw = (
            float(reflected_inductances(spectrum, at, front, behind, (0.0,))[0, 0].real) for front in fronts)
        share = min(max(state.target_change / (endless - none), 0.0), 1.0)
        changes[coil.name] = (1.0 - share) * (with_jaw - none)
    return changes
