"""Coil readings of a design at poses, loads and load cases that a user requests."""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from sitscad.assembly.places.motions import USUAL_ROTATION, Motions, is_held
from sitscad.basics.arguments import checked_arguments
from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.estimates.design import Design
from sitscad.estimates.loads.pad import (
    PAD_INSTABILITY,
    TOO_SOFT,
    NoResponse,
    linear_poses,
    pose_slopes,
    reading_slopes,
    soft_pad,
)
from sitscad.estimates.response.model import ResponseModel
from sitscad.estimates.response.response_arrays import Response, concatenate_responses
from sitscad.estimates.states.placed import require_possible_poses
from sitscad.kernels.mechanics.pad import BondedPad
from sitscad.spec.load_cases import LoadCase
from sitscad.spec.sensor import SensorSpec


@checked_arguments
def respond(
    design: Design | SensorSpec,
    poses: ArrayLike | None = None,
    *,
    loads: ArrayLike | None = None,
    case: str | Sequence[str] | None = None,
    rotation: str | None = None,
    frequency: float | None = None,
    tolerance: float | None = None,
) -> Response:
    """Return the coil readings at target poses, under loads, or in named load cases.

    A `Design` caches its solutions.

    Parameters
    ----------
    design
        A design or a spec.
    poses
        Poses (n, 6) relative to rest: x, y, z (m), rx, ry, rz (rad). Axes are as in
        `sitscad.assembly.places.state.Pose`.
    loads
        Loads (n, 3; N): normal towards the board, shear along +x and +y. Or (n, 5), with moments (N m) about x
        and y on the middle of the outermost face.
    case
        A load case, or several, by their names in the spec's section `loads`. "all" selects every case.
    rotation
        For `loads` alone: "free" lets the target tilt (default); "held" keeps it level by a flat face, as in
        data sheets and calibrations. A case sets its own rotation.
    frequency
        Frequency (Hz) of inductances and resistances. If None, it is each coil's own tank frequency.
    tolerance
        Largest error of interpolation between many poses.

    Returns
    -------
    Response
        Inductance, resistance, frequency and counts of every coil at each point.

    Raises
    ------
    ValueError
        For other shapes or values, for none or several of poses, loads and case, for a rotation without loads,
        or for an unknown rotation.
    NoResponse
        If the design has no target, no elastomer for a load, no tank that oscillates, or no load case of this name.
        Also for an impossible pose: more than a metre away, turned over, or with the whole target inside the board.
        It is a ValueError.

    Examples
    --------
    >>> import sitscad
    >>> spec = sitscad.SensorSpec.from_mapping(
    ...     name="press", coil={"shape": "circle", "outer_diameter": 8, "turns": 14, "layers": 2,
    ...                         "trace_width": "100 um", "trace_spacing": "100 um"},
    ...     target={"thickness": 0.2}, elastomer={"material": "ecoflex-00-30", "thickness": 1})
    >>> response = sitscad.respond(spec, poses=[[0, 0, 0, 0, 0, 0], [0, 0, -0.1e-3, 0, 0, 0]])
    >>> bool(response.frequency[1, 0] > response.frequency[0, 0])
    True
    """
    if sum(argument is not None for argument in (poses, loads, case)) != 1:
        raise ValueError("give either poses or loads or a case")
    if rotation is not None and loads is None:
        raise ValueError("rotation says how loads are put on: poses and cases have their own")
    model = (design if isinstance(design, Design) else Design(design)).response
    if case is not None:
        return respond_to_cases(model, (case,) if isinstance(case, str) else tuple(case), frequency, tolerance)
    rows = np.asarray(loads if poses is None else poses, dtype=float)
    widths = (3, 5) if poses is None else (6,)
    if rows.ndim == 0 or rows.shape[-1] not in widths:
        counts = " or ".join(map(str, widths))
        raise ValueError(f"rows of {counts} numbers are wanted, not an array of shape {rows.shape}")
    flat: Array = rows.reshape(-1, rows.shape[-1])
    if poses is None:
        level = np.full(len(flat), is_held(rotation or USUAL_ROTATION))
        if level.any() and np.any(flat[:, 3:]):
            raise ValueError("a face that keeps the target level takes any moment: rotation free")
        return model.respond_to_loads(flat, level, frequency, tolerance)
    require_possible_poses(model.spec, flat)
    return model.respond(flat, frequency, tolerance)


def respond_to(
    model: ResponseModel,
    motions: Motions,
    frequency: float | None = None,
    tolerance: float | None = None,
    progress: Callable[[int, int], None] | None = None,
    derivatives: bool = False,
) -> Response:
    """Return one response for all poses, loads and load cases of `motions`, in this order.

    `derivatives` adds the derivatives of the frequencies with respect to pose and load. `progress` is called with the
    numbers of finished and of all points.
    """
    parts = []
    if len(motions.poses):
        require_possible_poses(model.spec, motions.poses)
        parts.append(model.respond(motions.poses, frequency, tolerance, progress))
    if len(motions.loads):
        parts.append(model.respond_to_loads(motions.loads, motions.held, frequency, tolerance, progress))
    if motions.cases:
        parts.append(respond_to_cases(model, motions.cases, frequency, tolerance, progress))
    if not derivatives:
        return join_responses(parts)
    return join_responses([with_derivatives(model, part) for part in parts])


Progress = Callable[[int, int], None]
"""Function that is called with the number of finished poses and the number of all poses."""

ALL = "all"  # Name that selects every load case of a spec


@record(eq=False)
class AppliedLoad:
    """Force and tilt with which a load case acts on the target.

    `force` (N; x, y, z in board axes) acts on the outermost face, at a place on the face (`at`, m; x, y from the
    middle). `turn` (rad) is the tilt of a face that holds the target. None if the target is free to tilt. `is_stuck` is
    True if this face keeps the target from moving along x and y. `note` describes the load case in words.
    """

    force: Array
    at: Array
    turn: Array | None
    is_stuck: bool
    note: str


def load_cases(loads: tuple[LoadCase, ...], names: Sequence[str]) -> tuple[LoadCase, ...]:
    """Return load cases of a spec by their names; the name "all" selects all. Raises NoResponse for an unknown name."""
    by_name = {case.name: case for case in loads}
    chosen = [key for name in names for key in (by_name if name == ALL else [name])]
    for name in chosen:
        if name not in by_name:
            near = difflib.get_close_matches(name, by_name, 1)
            suggestion = f", did you mean {near[0]}?" if near else ""
            has = f"it has {', '.join(by_name)}" if by_name else "its section `loads` names none"
            raise NoResponse(f"the spec has no load case {name!r}{suggestion or ': ' + has}")
    if not chosen:
        raise NoResponse("the spec's section `loads` names no load case")
    return tuple(by_name[name] for name in chosen)


def tip_force(tension: float, lever_angle: float, lever: float, link: float, reach: float) -> float:
    """Return the force (N) of each jaw, square to its face, `reach` (m) from the pivot, without friction.

    The pull on the shaft is `tension` (N). The `lever_angle` (rad) is theta + theta0, `lever` (m) is the length LA of
    lever A, and `link` (m) the length LB of link B. The force is F_IN LA sin(theta + theta0 + beta) / (2 L_j cos beta),
    where beta is `link_angle`. Each jaw turns about a common pivot on the shaft's axis and ends, behind the pivot, in
    lever A. Links B join both levers to a pin that the shaft pulls along the axis. By virtual work, the pin's travel
    times the pull is the work of both jaws. docs/mechanism.md derives this. It also has the reason for the difference
    from the printed equation 3.1 of Jones's thesis.

    Raises ValueError if link B does not reach the axis, or for a reach that is not positive.
    """
    if not reach > 0.0:
        raise ValueError("a jaw presses at a positive distance from its pivot")
    beta = link_angle(lever_angle, lever, link)
    return tension * lever * math.sin(lever_angle + beta) / (2.0 * reach * math.cos(beta))


def link_angle(lever_angle: float, lever: float, link: float) -> float:
    """Return the angle (rad) of link B to the axis, from the angle (rad) of lever A.

    `lever` (m) is the length LA of lever A, `link` (m) the length LB of link B. The angle is asin(LA sin(theta +
    theta0) / LB), the law of sines. Raises ValueError if link B does not reach the axis.
    """
    sine = lever * math.sin(lever_angle) / link
    if not abs(sine) < 1.0:
        raise ValueError("link B does not reach the axis")
    return math.asin(sine)


def applied_load(case: LoadCase) -> AppliedLoad:
    """Return the force and the tilt with which a load case acts on the target."""
    normal, tension = case.normal or 0.0, ""
    if case.mechanism is not None:
        lever = case.mechanism
        angle = lever.theta + lever.theta0
        normal = tip_force(lever.shaft_tension, angle, lever.lever, lever.link, lever.reach) * math.cos(case.opening)
        tension = f", from {lever.shaft_tension:.3g} N on the shaft"
    # an inclined face that slides pushes along its own normal, away from its nearest edge
    slide = 0.0 if case.is_stuck else -normal * math.tan(case.opening)
    force = np.array([case.shear[0] + slide, case.shear[1], -normal])
    parts = [f"load case {case.name}: {normal:.3g} N towards the board{tension}"]
    if any(force[:2]):
        parts.append(f"{force[0]:.3g} and {force[1]:.3g} N along x and y")
    if case.opening:
        way = "sticks" if case.is_stuck else "slides"
        parts.append(f"the target flush with a face inclined by {math.degrees(case.opening):.3g} degrees that {way}")
    if any(case.offset):
        parts.append(f"{1e3 * case.offset[0]:.3g}, {1e3 * case.offset[1]:.3g} mm from the middle of the face")
    turn = np.array([0.0, case.opening, 0.0]) if case.is_held else None
    return AppliedLoad(force, np.array(case.offset), turn, case.is_stuck, ", ".join(parts))


def case_pose(pad: BondedPad, case: LoadCase) -> tuple[Array, tuple[str, ...]]:
    """Return the pose (6; m, rad) of the target on a pad in a load case, and notes about it.

    If the pad buckles under a free target, the pose is for a level target. If a level target has no equilibrium either,
    the pose is a linear estimate.
    """
    push = applied_load(case)
    wrench = np.concatenate([push.force, np.zeros(3)])[None, :]
    turns = None if push.turn is None else push.turn[None, :]
    pose = pad.pose(wrench, at=push.at[None, :], turns=turns, is_stuck=push.is_stuck)[0]
    if np.all(np.isfinite(pose)):
        return pose, (push.note,)
    level = np.zeros((1, 3)) if turns is None else turns
    pose = pad.pose(wrench, at=push.at[None, :], turns=level)[0]
    if np.all(np.isfinite(pose)):
        return pose, (push.note, PAD_INSTABILITY)
    pose = linear_poses(pad, np.array([[-push.force[2], *push.force[:2]]]))[0]
    pose[3:] = level[0]
    return pose, (push.note, TOO_SOFT)


def respond_to_cases(
    model: ResponseModel, names: Sequence[str], frequency: float | None = None, tolerance: float | None = None,
    progress: Progress | None = None,
) -> Response:
    """Return the coil readings in load cases of the spec, in the order of `names`.

    The response's force and moment are the loads that hold the target in its pose. Raises NoResponse under the
    conditions of `load_cases` and `soft_pad`.
    """
    cases = load_cases(model.spec.loads, names)
    pad = soft_pad(model.spec)
    poses, notes = zip(*(case_pose(pad, case) for case in cases), strict=True)
    response = model.respond(np.array(poses), frequency, tolerance, progress)
    all_notes = tuple((*case_notes, *more) for case_notes, more in zip(notes, response.notes, strict=True))
    return replace(response, notes=all_notes, cases=tuple(case.name for case in cases))


def join_responses(parts: Sequence[Response]) -> Response:
    """Join several responses to one.

    If any response has load cases, points without a load case get an empty name. `parts` are the responses, all of the
    same coils.
    """
    if not any(part.cases for part in parts):
        return concatenate_responses(parts)
    return concatenate_responses([replace(part, cases=part.cases or ("",) * len(part)) for part in parts])


def with_derivatives(model: ResponseModel, response: Response) -> Response:
    """Return the response with derivatives of the frequencies with respect to pose (`by_pose`) and load (`by_load`).

    The target keeps its rotation. `by_load` is NaN if the pad is fully compressed, and None if there is no pad.
    """
    by_pose = reading_slopes(lambda poses: model.respond(poses, within=response.poses).frequency, response.poses)
    by_load = None
    if response.force is not None:
        by_load = np.einsum("ncp,npl->ncl", by_pose, pose_slopes(soft_pad(model.spec), response.poses))
    return replace(response, by_pose=by_pose, by_load=by_load)
