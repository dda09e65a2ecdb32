"""SIT218: whether the array feels the required shear force, by which the target's edges move over the coils, and not a
slight tilt as more than that.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from sitscad.checks.cases import Case
from sitscad.checks.reading.response import FEWEST_STEPS, LEAST_SHARE, responses
from sitscad.checks.rules import Advice, Rule, Undecided, Verdict
from sitscad.design import Design
from sitscad.finding import Severity
from sitscad.geometry.path import Point
from sitscad.remedy.arrays import smaller_targets, wider_arrays
from sitscad.remedy.search import first_tried
from sitscad.scene.state import REST
from sitscad.spec.places import footprint, shared_middles
from sitscad.spec.sensor import SensorSpec
from sitscad.units import show

AXES = ("x", "y")


def shear_response(design: Design) -> Iterator[Verdict]:
    """What tells the coils apart along each axis of the array, with the target where the required shear moves it."""
    import numpy as np

    from sitscad.estimates.response.pad import pushed
    from sitscad.estimates.states.moved_target import moved_changes
    from sitscad.estimates.states.pressing import BESIDE_PAD, rests_on_pad

    spec, force = design.spec, design.spec.requirements.shear_force
    assert force is not None
    axes = _axes(spec)
    if not axes:
        yield Undecided("one coil alone cannot tell shear from normal force, so the force is taken as one to be borne")
        return
    if not rests_on_pad(spec):
        yield Undecided(BESIDE_PAD)
        return
    # held level and not pressed: the least that the force moves it
    normal = spec.requirements.normal_force or 0.0
    poses, _ = pushed(spec, np.array([(0.0, force, 0.0), (0.0, 0.0, force), (normal, 0.0, 0.0)]))
    travels = float(poses[0, 0]), float(poses[1, 1])
    rest = [coil.states[REST] for coil in design.estimates.coils if REST in coil.states]
    steps = [state.quantum for state in rest if state.quantum]
    if not steps:
        yield Undecided("nothing was estimated at rest")
        return
    moves = [(travels[0], 0.0), (0.0, travels[1])]
    changes = moved_changes(design.layout, moves, rest[0].frequency, design.estimates.is_solved)
    for axis in axes:
        moved = [change[axis] for change in changes.values()]
        apart = max(moved) - min(moved)
        hardly = list(_judged(design, axis, travels[axis], apart, max(steps)))
        yield from hardly or _tilted(design, axis, apart, -float(poses[2, 2]))


def _axes(spec: SensorSpec) -> list[int]:
    """The axes (0: x, 1: y) along which the coils stand apart: only along those can the array tell shear."""
    centres = [placement.centre for placement in spec.array.placements]
    return [k for k in (0, 1) if max(c[k] for c in centres) - min(c[k] for c in centres) > 1e-9]


def _judged(design: Design, axis: int, travel: float, apart: float, step: float) -> Iterator[Verdict]:
    """What is said where the coils' inductances part by too little (H) along one axis; `step` is the converter's."""
    spec, force = design.spec, design.spec.requirements.shear_force or 0.0
    pressed = max((abs(response.change) for response in responses(design)), default=0.0)
    asked = max(FEWEST_STEPS, LEAST_SHARE * pressed / step)
    if apart / step >= asked:
        return
    beside = f"; the required normal force changes a coil by {show(pressed, 'H', 3)}" if pressed else ""
    yield HARDLY_SHEAR.found("target.size", apart / step, asked, "steps", hint=_edges_over_coils(spec, axis),
                             advice=_nearer_edges(spec, axis), axis_name=AXES[axis], force=force, travel=travel,
                             apart=apart, beside=beside, fewest_steps=FEWEST_STEPS, least_share=LEAST_SHARE)


def _tilted(design: Design, axis: int, apart: float, pressed: float) -> Iterator[Verdict]:
    """What is said where one degree of tilt parts the coils' inductances by more than the shear force (`apart`; H).

    A tilted target counts for every coil as a level one at the height that it has over the middle of what both share,
    and inductances follow the height as they do while the normal force presses by `pressed` (m): the same within a
    fifth as the data sheet's error by tilt.
    """
    force, found = design.spec.requirements.shear_force or 0.0, responses(design)
    if not found or pressed <= 0.0 or apart <= 0.0:
        return
    places = [(middle.x, middle.y)[axis] for middle in shared_middles(design.spec)]
    per_metre = max(abs(response.change) for response in found) / pressed
    read = force * per_metre * (max(places) - min(places)) * math.tan(DEGREE) / apart
    if read <= force:
        return
    yield TILT_OVER_SHEAR.found("target.size", read, force, "N", axis_name=AXES[axis], other=AXES[1 - axis],
                                advice=_nearer_edges(design.spec, axis))


def _nearer_edges(spec: SensorSpec, axis: int) -> Advice:
    """A hint with targets that end nearer to the middles of the coils, and with coils farther apart."""
    return first_tried([list(smaller_targets(spec)), list(wider_arrays(spec))], _edges_over_coils(spec, axis))


def _edges_over_coils(spec: SensorSpec, axis: int) -> str:
    """Where the target's edges would have to lie."""
    target, least = spec.target, min(spec.coil.size)
    assert target is not None
    if abs(math.sin(target.rotation)) > 1e-9 and not target.outline.is_round:
        return f"only a target whose edges move over the coils along {AXES[axis]} tells shear, not one that covers all"
    here = footprint(spec, target)
    reach = max(abs(here.place_of(Point(*p.centre))[axis]) for p in spec.array.placements)
    beyond = 0.5 * target.size[axis] - reach
    return (
        "only a target whose edges move over the coils tells shear, best one that ends over the middles of the outer "
        f"coils, which stand {show(2.0 * reach, 'm', 3)} apart along {AXES[axis]}"
        + (f"; this one ends {show(beyond, 'm', 3)} beyond them" if beyond > 0.25 * least else "")
        + "; a softer or thicker elastomer lets it move farther. Where the force only has to be borne, "
        "this does not matter"
    )


HARDLY_SHEAR = Case(
    "the array hardly feels shear along {axis_name}: {force:N} part the coils' inductances by {measured:.2g} steps of "
    "the converter",
    detail="that force moves the target by {travel:m,2}, and the inductances differ by {apart:H,2} more{beside}; "
    "asked are {fewest_steps:.0f} steps and {least_share:%.0f} % of that change",
)


TILT_OVER_SHEAR = Case(
    "the target covers so much of the coils that a tilt of one degree about {other} is read as {measured:N,2} of shear "
    "along {axis_name}, where {limit:N} are to be felt: what moves it sideways hardly counts beside how it lies",
)

DEGREE = math.radians(1.0)

SHEAR_RULES: tuple[Rule, ...] = (
    Rule(
        "SIT218", "shear-response", Severity.WARNING,
        f"Along every axis on which coils stand apart, the required shear force makes their inductances differ by at "
        f"least {FEWEST_STEPS:.0f} steps of the converter more than at rest, and by at least {100.0 * LEAST_SHARE:.0f} "
        f"% of what the required normal force changes; and a tilt of one degree makes them differ by no more than that "
        f"force does.",
        "Shear shows only where the target's edges move over the coils. Under a target that covers the whole array and "
        "more, nothing changes when it moves, and no later computation finds what was not measured. Under one that "
        "ends at their rims little changes, and the slightest tilt, which lowers it over one coil and lifts it over "
        "another, is more.",
        "A target that ends over the outer coils, as long as their middles are apart; coils farther apart; a softer or "
        "thicker elastomer.",
        "the limits of SIT215; the travel by the pad's law, held level and not pressed; one degree: derived (a face "
        "held by hand or by a jaw is not level to less)", ("target", "elastomer", "shear force"), shear_response,
    ),
)
