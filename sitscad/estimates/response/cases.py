"""Load cases of a spec: forces on the target, or faces that tilt it, and the target's poses.

The module also computes derivatives of the frequencies by pose and load, by central differences.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
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
from sitscad.estimates.response.response_arrays import Response, joined
from sitscad.spec.sensor import LoadCase, SensorSpec

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


def case_pose(spec: SensorSpec, case: LoadCase) -> tuple[Array, tuple[str, ...]]:
    """Return the pose (6; m, rad) of the target in a load case, and notes about it.

    If the pad buckles under a free target, the pose is for a level target. If a level target has no equilibrium either,
    the pose is a linear estimate. Raises NoResponse if no pad carries the target.
    """
    pad, push = soft_pad(spec), applied_load(case)
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
    conditions of `load_cases` and `case_pose`.
    """
    cases = load_cases(model.spec.loads, names)
    poses, notes = zip(*(case_pose(model.spec, case) for case in cases), strict=True)
    response = model.respond(np.array(poses), frequency, tolerance, progress)
    all_notes = tuple((*case_notes, *more) for case_notes, more in zip(notes, response.notes, strict=True))
    return replace(response, notes=all_notes, cases=tuple(case.name for case in cases))


def join_responses(parts: Sequence[Response]) -> Response:
    """Join several responses to one.

    If any response has load cases, points without a load case get an empty name. `parts` are the responses, all of the
    same coils.
    """
    if not any(part.cases for part in parts):
        return joined(parts)
    return joined([replace(part, cases=part.cases or ("",) * len(part)) for part in parts])


def with_derivatives(model: ResponseModel, response: Response) -> Response:
    """Return the response with derivatives of the frequencies by pose and by load (`by_pose`, `by_load`).

    The target keeps its rotation. `by_load` is NaN if the pad is fully compressed, and None if there is no pad.
    """
    by_pose = reading_slopes(lambda poses: model.respond(poses, within=response.poses).frequency, response.poses)
    by_load = None
    if response.force is not None:
        by_load = np.einsum("ncp,npl->ncl", by_pose, pose_slopes(soft_pad(model.spec), response.poses))
    return replace(response, by_pose=by_pose, by_load=by_load)
