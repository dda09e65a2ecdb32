"""Coil readings of a design at poses, loads and load cases that a user requests."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from sitscad.assembly.places.motions import USUAL_ROTATION, Motions, is_held
from sitscad.basics.arguments import checked_arguments
from sitscad.basics.arrays import Array
from sitscad.estimates.design import Design
from sitscad.estimates.response.cases import join_responses, respond_to_cases, with_derivatives
from sitscad.estimates.response.response_arrays import Response
from sitscad.estimates.states.placed import require_possible
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
    require_possible(model.spec, flat)
    return model.respond(flat, frequency, tolerance)


def respond_to(
    design: Design,
    motions: Motions,
    frequency: float | None = None,
    tolerance: float | None = None,
    progress: Callable[[int, int], None] | None = None,
    derivatives: bool = False,
) -> Response:
    """Return one response for all poses, loads and load cases of `motions`, in this order.

    `derivatives` adds the derivatives of the frequencies by pose. `progress` is called with the number of finished and
    of all points.
    """
    model, parts = design.response, []
    if len(motions.poses):
        require_possible(model.spec, motions.poses)
        parts.append(model.respond(motions.poses, frequency, tolerance, progress))
    if len(motions.loads):
        parts.append(model.respond_to_loads(motions.loads, motions.held, frequency, tolerance, progress))
    if motions.cases:
        parts.append(respond_to_cases(model, motions.cases, frequency, tolerance, progress))
    if not derivatives:
        return join_responses(parts)
    return join_responses([with_derivatives(model, part) for part in parts])
