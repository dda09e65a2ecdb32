"""The load cases that a spec names: each a force on the target, or a face that turns it, and the pose that follows; and
how frequencies change with pose and load, by central differences.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.estimates.loads.pad import GIVES_WAY, TOO_SOFT, NoResponse, compliance, slopes, soft_pad, straight
from sitscad.estimates.response.model import ResponseModel
from sitscad.estimates.response.response_arrays import Response, joined
from sitscad.spec.sensor import LoadCase, SensorSpec

Progress = Callable[[int, int], None]

ALL = "all"  # What stands for every load case of a spec


@record(eq=False)
class Push:
    """A load case in numbers: the force (N; x, y, z in board axes) on the outermost face, where on it (m; x, y from its
    middle), and the turn (rad) that a face holds the target at, None where it tilts as it likes; `is_stuck` where that
    face keeps it from moving along x and y; `note` says it.
    """

    force: Array
    at: Array
    turn: Array | None
    is_stuck: bool
    note: str


def load_cases(loads: tuple[LoadCase, ...], names: Sequence[str]) -> tuple[LoadCase, ...]:
    """The spec's load cases of these names, every one for `all`; raises NoResponse for a name that it does not have."""
    known = {case.name: case for case in loads}
    wanted = [one for name in names for one in (known if name == ALL else [name])]
    for name in wanted:
        if name not in known:
            near = difflib.get_close_matches(name, known, 1)
            meant = f", did you mean {near[0]}?" if near else ""
            has = f"it has {', '.join(known)}" if known else "its section `loads` names none"
            raise NoResponse(f"the spec has no load case {name!r}{meant or ': ' + has}")
    if not wanted:
        raise NoResponse("the spec's section `loads` names no load case")
    return tuple(known[name] for name in wanted)


def tip_force(tension: float, lever_angle: float, lever: float, link: float, reach: float) -> float:
    """Force (N) that each jaw exerts, square to its face, `reach` (m) from the pivot, under a pull on the shaft (N),
    without friction: F_IN LA sin(theta + theta0 + beta) / (2 L_j cos beta), beta being `link_angle`.

    Each jaw turns about a common pivot on the shaft's axis and ends, behind the pivot, in lever A; links B join both
    levers to a pin that the shaft pulls along the axis. By virtual work the pin's travel times the pull is the work of
    both jaws; docs/mechanism.md derives it and says why it is not what is printed as equation 3.1 of Jones's thesis.
    Raises ValueError where link B does not
    reach the axis, or for a reach that is not positive.
    """
    if not reach > 0.0:
        raise ValueError("a jaw presses at a positive distance from its pivot")
    beta = link_angle(lever_angle, lever, link)
    return tension * lever * math.sin(lever_angle + beta) / (2.0 * reach * math.cos(beta))


def link_angle(lever_angle: float, lever: float, link: float) -> float:
    """Angle (rad) of link B to the axis, of the angle (rad) of lever A to it: asin(LA sin(theta + theta0) / LB), the
    law of sines. Raises ValueError where link B does not reach the axis.
    """
    sine = lever * math.sin(lever_angle) / link
    if not abs(sine) < 1.0:
        raise ValueError("link B does not reach the axis")
    return math.asin(sine)


def push_of(case: LoadCase) -> Push:
    """What a load case does to the target."""
    normal, said = case.normal or 0.0, ""
    if case.mechanism is not None:
        lever = case.mechanism
        angle = lever.theta + lever.theta0
        normal = tip_force(lever.shaft_tension, angle, lever.lever, lever.link, lever.reach) * math.cos(case.opening)
        said = f", from {lever.shaft_tension:.3g} N on the shaft"
    # an inclined face that slides pushes along its own normal, away from where it is nearest
    slide = 0.0 if case.is_stuck else -normal * math.tan(case.opening)
    force = np.array([case.shear[0] + slide, case.shear[1], -normal])
    words = [f"load case {case.name}: {normal:.3g} N towards the board{said}"]
    if any(force[:2]):
        words.append(f"{force[0]:.3g} and {force[1]:.3g} N along x and y")
    if case.opening:
        way = "sticks" if case.is_stuck else "slides"
        words.append(f"the target flush with a face inclined by {math.degrees(case.opening):.3g} degrees that {way}")
    if any(case.offset):
        words.append(f"{1e3 * case.offset[0]:.3g}, {1e3 * case.offset[1]:.3g} mm from the middle of the face")
    turn = np.array([0.0, case.opening, 0.0]) if case.is_held else None
    return Push(force, np.array(case.offset), turn, case.is_stuck, ", ".join(words))


def posed(spec: SensorSpec, case: LoadCase) -> tuple[Array, tuple[str, ...]]:
    """The pose (6,; m, rad) of the target in a load case, and what there is to say of it.

    A target that gives way sideways is posed as one that is held level, or straight on where even that has no
    equilibrium. Raises NoResponse where no pad carries it.
    """
    pad, push = soft_pad(spec), push_of(case)
    wrench = np.concatenate([push.force, np.zeros(3)])[None, :]
    turns = None if push.turn is None else push.turn[None, :]
    found = pad.pose(wrench, at=push.at[None, :], turns=turns, is_stuck=push.is_stuck)[0]
    if np.all(np.isfinite(found)):
        return found, (push.note,)
    level = np.zeros((1, 3)) if turns is None else turns
    found = pad.pose(wrench, at=push.at[None, :], turns=level)[0]
    if np.all(np.isfinite(found)):
        return found, (push.note, GIVES_WAY)
    found = straight(pad, np.array([[-push.force[2], *push.force[:2]]]))[0]
    found[3:] = level[0]
    return found, (push.note, TOO_SOFT)


def in_cases(
    model: ResponseModel, names: Sequence[str], frequency: float | None = None, tolerance: float | None = None,
    progress: Progress | None = None,
) -> Response:
    """What the coils read in load cases of the spec, in the order of `names`; force and moment are what holds the
    target's pose. Raises NoResponse as `load_cases` and `posed` do.
    """
    cases = load_cases(model.spec.loads, names)
    poses, notes = zip(*(posed(model.spec, case) for case in cases), strict=True)
    found = model.respond(np.array(poses), frequency, tolerance, progress)
    said = tuple((*own, *more) for own, more in zip(notes, found.notes, strict=True))
    return replace(found, notes=said, cases=tuple(case.name for case in cases))


def with_cases(parts: Sequence[Response]) -> Response:
    """Several responses as one, points without a load case having an empty name where any has one."""
    if not any(part.cases for part in parts):
        return joined(parts)
    return joined([replace(part, cases=part.cases or ("",) * len(part)) for part in parts])


def with_derivatives(model: ResponseModel, response: Response) -> Response:
    """The response with `by_pose` and `by_load`, the target keeping its turn: the latter NaN where the pad is shut, and
    None without a pad.
    """
    by_pose = slopes(lambda poses: model.respond(poses, within=response.poses).frequency, response.poses)
    by_load = None
    if response.force is not None:
        by_load = np.einsum("ncp,npl->ncl", by_pose, compliance(soft_pad(model.spec), response.poses))
    return replace(response, by_pose=by_pose, by_load=by_load)
