"""Ratio of a finite target's effect on each coil to the effect of an infinite plate."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np

from sitscad.assembly.places.state import state_text
from sitscad.basics.arrays import Array, Index
from sitscad.basics.record import record, replace
from sitscad.estimates.targets.assembly import Surroundings, metal_sheet, metal_skin_depth
from sitscad.kernels.electromagnetics.metal.finite_plate import (
    EASED,
    CoaxialRings,
    FinitePlate,
    error_with_transition,
    error_with_transitions,
    loss_ratio_error,
    magnetic_ratio,
    magnetic_ratio_error,
    plate_loss_ratio,
    plate_ratio,
    ratio_error,
    sheet_ratios,
)
from sitscad.kernels.electromagnetics.metal.half_spaces import reflection
from sitscad.kernels.geometry.convex import Footprint
from sitscad.kernels.geometry.path import Point
from sitscad.spec.coil import CoilPlacement, CoilSpec
from sitscad.spec.materials import Target
from sitscad.spec.places import footprint
from sitscad.spec.sensor import SensorSpec

Move = tuple[float, float]
"""Displacement (m) of a target from rest, along x and y."""

FREQUENCY = 5e6
"""Frequency (Hz) at which the skin depth in the target is computed. The ratios hardly depend on it."""


@record
class TargetRatios:
    """Ratios of the target's effect to an infinite plate's effect, by (coil name, state), and notes about them.

    `inductance_ratios` are the ratios of the inductance changes, `loss_ratios` the ratios of the losses. `error` and
    `loss_error` are their largest relative errors.
    """

    inductance_ratios: Mapping[tuple[str, str], float]
    loss_ratios: Mapping[tuple[str, str], float]
    notes: tuple[str, ...]
    error: float = 0.0
    loss_error: float = 0.0
    def ratios_for(self, coil: str, state: str) -> tuple[float, float]:
        """Return the ratios of inductance change and loss for a coil in a state. Both are 1 if none are stored."""
        return self.inductance_ratios.get((coil, state), 1.0), self.loss_ratios.get((coil, state), 1.0)

    def cache_key(self, number: int, coil: str, state: str) -> tuple[complex, ...]:
        """Return a cache key. It is equal for coils on which the target has equal effects."""
        return self.ratios_for(coil, state)


WIDER, WIDER_THIN, WIDER_BENT, WIDER_MAGNETIC = (0.1, 0.5), (0.3, 0.8), (0.8, 0.5), (1.5, 0.8)
"""Additional relative errors (inductance, loss) of the correction ratios, for targets outside the range of their fit.

`WIDER` is for all these targets, and `WIDER_THIN` for targets thinner than the field's depth. `WIDER_BENT` is for
blocks, for targets at an angle to long coils, and for targets that do not cover long coils. `WIDER_MAGNETIC` is for
magnetic metals, which may even raise the inductance.
"""


NO_RATIOS = TargetRatios({}, {}, ())
"""Ratios if there is no target. All ratios are 1."""


@record
class SheetRatios:
    """Ratios of the target's effect to an infinite plate's effect, for coils at n places under the target.

    `inductance_ratios` (n) are for the inductance change, `loss_ratios` (n) for the loss. `error` and `loss_error` are
    relative errors of all ratios. `magnetic` is True if the target reflects waves more like a magnet than like a
    conductor.
    """

    inductance_ratios: Array
    loss_ratios: Array
    error: float
    loss_error: float
    magnetic: bool


def target_ratios(
    spec: SensorSpec, heights: Sequence[float], states: Sequence[Surroundings], is_rough: bool = False
) -> TargetRatios:
    """Return the correction ratios of all coils in all states that have a target.

    `heights` (m) are the mid-planes of the coils' layers. The ratios depend on a coil's place: its centre relative to
    the target's centre, in the target's axes. Mirrored places are solved once. Coils that are not round are replaced by
    round coils whose turns have equal areas. Elongated coils are shortened.
    """
    covered = _states_with_target(states)
    if spec.target is None or not covered:
        return NO_RATIOS
    plate, placements = footprint(spec, spec.target), spec.array.placements
    rings, target, (distinct, member) = _equivalent_round_coil(spec.coil, placements, spec.target, plate, heights)
    ratios, losses = {}, {}
    by_gap = _ratios_at_gaps(target, rings, distinct, [gap for _, gap, _ in covered], covered[0][2], is_rough)
    for (name, _, _), at_gap in zip(covered, by_gap, strict=True):
        for placement, row in zip(placements, member, strict=True):
            ratios[placement.name, name] = float(at_gap.inductance_ratios[row])
            losses[placement.name, name] = float(at_gap.loss_ratios[row])
    shortened = (ELONGATED if spec.coil.outline.sides else OVAL) * (1.0 - min(spec.coil.size) / max(spec.coil.size))
    errors = max(f.error for f in by_gap) + shortened, max(f.loss_error for f in by_gap)
    wider = errors_outside_fit(spec.coil, placements, spec.target, plate, states)
    errors = errors[0] + wider[0], errors[1] + wider[1]
    names = [name for name, _, _ in covered]
    notes = [] if is_rough else _notes(spec.coil, names, (ratios, losses), errors, any(f.magnetic for f in by_gap))
    return TargetRatios(ratios, losses, tuple(notes), *errors)


ROUGHER = 0.03
"""Additional relative error of the ratios of the inductance change in screening, by rougher computation."""

LOSS_ROUGHER = 0.3
"""Additional relative error of the loss ratios in screening, which are set equal to the inductance ratios."""


def _ratios_at_gaps(
    target: Target, rings: CoaxialRings, places: Array, gaps: Sequence[float], floor: float, is_rough: bool
) -> list[SheetRatios]:
    """Return the ratios at every gap (m), for coils at `places` (n, 2; m) under the target.

    `floor` (m) is the height of a mirror behind the board (-inf: none).
    """
    if not is_rough or not all(_is_conductor(target, rings, gap) for gap in gaps):
        return [target_sheet_ratios(target, rings, places, gap, floor) for gap in gaps]
    plate, depth = _plate(target)
    resisted, unsure = _resistive_divisor(target, rings)
    ratios = sheet_ratios(plate, rings, places, np.array(gaps) + depth, floor) / resisted
    error, loss_error = ratio_error(plate, rings) + unsure, loss_ratio_error(plate, rings) + unsure
    return [SheetRatios(row, row, error + ROUGHER, loss_error + LOSS_ROUGHER, False) for row in ratios]


OPAQUE, THICKEST, MAX_MISALIGNMENT, ASPECT, HANGING, RETURNED = 1.2, 0.1, math.radians(2.0), 1.3, 0.05, 0.7
"""Limits of the range in which the errors of the correction ratios were fitted.

`OPAQUE`: least thickness in skin depths. `THICKEST`: largest thickness divided by the target's shorter side.
`MAX_MISALIGNMENT`: largest angle (rad) between the sides of an elongated coil and of the target. `ASPECT`: largest
length divided by width of a polygon coil. `HANGING`: largest overhang of an elongated coil beyond the target, divided
by the coil's width. `RETURNED`: least fraction of the field that metal behind the board returns.
"""

BLOCK = 0.2
"""Least thickness of a block-shaped target, divided by its shorter side.

The side walls of a block carry much of the current.
"""

SHORTEST, LONGEST = 4.0, 2.0  # Relevant wave numbers for `RETURNED`, times the coil's smaller side


def errors_outside_fit(
    coil: CoilSpec, placements: tuple[CoilPlacement, ...], target: Target, plate: Footprint,
    states: Sequence[Surroundings],
) -> tuple[float, float]:
    """Return additional relative errors of the ratios of inductance and loss outside the range of their fit.

    The fit contains good conductors that the field does not penetrate. They lie over coils as long as wide, or cover
    longer coils. Behind the board is no metal, or nearly a mirror (tests/validation/states_of_response.py). `plate` is
    the target's footprint.
    """
    (short, long), thickness = sorted(coil.size), target.thickness
    errors = [(0.0, 0.0)]
    if 1.0 - conductor_weight(target, 0.25 * (long + short)) > PURE or thickness > THICKEST * min(target.size):
        errors.append(WIDER)
    if coil.outline.sides and long > ASPECT * short:
        errors.append(WIDER)
    waves = np.array([LONGEST, SHORTEST]) / short
    returned = [float(-reflection(waves, FREQUENCY, around.below.plates).real.min())
                for around in states if around.above is not None and around.below is not None]
    if min(returned, default=1.0) < RETURNED:
        errors.append(WIDER)
    if thickness < OPAQUE * _skin_depth(target):
        errors.append(WIDER_THIN)
    is_hanging = long - short > 1e-9 and (
        _largest_misalignment(placements, target) > MAX_MISALIGNMENT or _largest_overhang(coil, placements, target,
                                                                                      plate) > HANGING * short)
    if is_hanging or thickness > BLOCK * min(target.size):
        errors.append(WIDER_BENT)
    if errors[1:] and target.material.relative_permeability > MAGNETIC:
        errors.append(WIDER_MAGNETIC)
    change, loss = np.max(errors, axis=0).tolist()
    return change, loss


def _largest_misalignment(placements: tuple[CoilPlacement, ...], target: Target) -> float:
    """Return the largest angle (rad) between the sides of coils and target, or between two coils.

    The correction ratios assume that all have parallel sides.
    """
    turns = [target.rotation - placement.rotation for placement in placements]
    to_target = [] if target.outline.is_disc else [math.remainder(turn, math.pi / 2) for turn in turns]
    return max(map(abs, (*to_target, *(math.remainder(turn - turns[0], math.pi) for turn in turns))))


def _largest_overhang(
    coil: CoilSpec, placements: tuple[CoilPlacement, ...], target: Target, plate: Footprint
) -> float:
    """Return the largest overhang (m) of a coil beyond the target along its sides.

    Negative if all coils are covered. `plate` is the target's footprint.
    """
    overhang = -math.inf
    for placement in placements:
        place, turn = plate.local_coordinates(Point(*placement.centre)), target.rotation - placement.rotation
        size = coil.size[:: -1 if round(2.0 * turn / math.pi) % 2 else 1]
        ends = abs(place[0]) + 0.5 * size[0], abs(place[1]) + 0.5 * size[1]
        if target.outline.is_disc:
            overhang = max(overhang, math.hypot(*ends) - 0.5 * target.size[0])
        else:
            overhang = max(overhang, *(end - 0.5 * side for end, side in zip(ends, target.size, strict=True)))
    return overhang


def change_ratios(
    spec: SensorSpec, heights: Sequence[float], gaps: Sequence[float], floor: float, moves: Sequence[Move]
) -> Array:
    """Return rough ratios of the inductance change for a moved target: (gaps, moves, coils).

    `gaps` (m) are heights of the target. `moves` are its displacements (x, y; m) from rest. `heights` (m) are the
    mid-planes of the coils' layers, and `floor` (m) is the height of a mirror behind the board.
    """
    assert spec.target is not None
    rings, target, (distinct, member) = _equivalent_round_coil(
        spec.coil, spec.array.placements, spec.target, footprint(spec, spec.target), heights, moves)
    ratios = [each.inductance_ratios for each in _ratios_at_gaps(target, rings, distinct, gaps, floor, True)]
    return np.array(ratios)[:, member].reshape(len(gaps), len(moves), -1)


def _states_with_target(states: Sequence[Surroundings]) -> list[tuple[str, float, float]]:
    """Return name, gap (m) and height (m) of the mirror behind the board, for every state that has a target.

    The height is -inf if there is no mirror.
    """
    return [
        (around.name, around.above.distance, -math.inf if around.below is None else -around.below.distance)
        for around in states
        if around.above is not None
    ]


PURE, UNSURE = 1e-3, 0.01
"""Limits on the distance of `conductor_weight` from the nearer of 0 (magnet) and 1 (conductor).

Up to `PURE`, a target is computed as a pure magnet or a pure conductor. From `UNSURE` on, the ratios have the full
errors of a mixture (`BETWEEN`).
"""

MAGNETIC = 1.5
"""Least relative permeability of targets that may raise the inductance. Other conducting targets are conductors."""

BETWEEN = (
    ((0.5, 1.3), (0.75, 0.75), (0.95, 0.5), (1.15, 0.35), (1.6, 0.15)),
    ((0.5, 0.95), (0.75, 0.82), (0.95, 0.7), (1.15, 0.5), (1.6, 0.3)),
)
"""Relative errors of the ratios of inductance (first row) and loss (second row), for metals that act as a mixture.

A mixture is neither a conductor nor a magnet. Each entry is a pair: an upper limit of the target's shorter side divided
by the coil's diameter, and the error up to this limit. These metals have less loss than the ratios
(tests/validation/disc_of_elements.py).
"""

THIN, OVERHANGING, LOSS_OF_THIN = 2.0, 1.5, 0.3
"""Limits for thin and for small targets, and the relative error of the loss ratio of such targets.

In targets up to `THIN` skin depths thick, the edge current flows in the full thickness. In targets with a shorter side
up to `OVERHANGING` coil diameters, the edge carries much of the current. The true loss ratio of targets with both
properties is up to a quarter larger than computed. The stated relative error is `LOSS_OF_THIN`.
"""


def target_sheet_ratios(target: Target, rings: CoaxialRings, places: Array, gap: float, floor: float) -> SheetRatios:
    """Return the ratios of a target's effect to an infinite sheet's, for coils at places (n, 2; m), with errors.

    `gap` (m) is the target's height, `floor` (m) the height of the mirror behind the board (-inf: none).
    """
    if _is_conductor(target, rings, gap):
        return _conductor_ratios(target, rings, places, gap, floor)
    like = conductor_weight(target, float(rings.radii.mean()) + gap)
    magnet = FinitePlate(target.size, target.thickness, target.outline.is_disc)
    magnetic = np.minimum(magnetic_ratio(magnet, rings, places, gap, floor), 1.0)
    magnetic_error = magnetic_ratio_error(magnet, rings)
    if like <= PURE:
        return SheetRatios(magnetic, magnetic, magnetic_error, max(magnetic_error, LOSS_OF_MAGNETS), True)
    # Between conductor and magnet: a mean of both ratios, uncertain by half their difference in the middle.
    metal = _conductor_ratios(target, rings, places, gap, floor)
    ratios = like * metal.inductance_ratios + (1.0 - like) * magnetic
    losses = like * metal.loss_ratios + (1.0 - like) * magnetic
    unsure, unsure_loss = (
        2.0 * like * (1.0 - like) * float(np.max(np.abs(pure - magnetic) / mixed))
        for pure, mixed in ((metal.inductance_ratios, ratios), (metal.loss_ratios, losses))
    )
    wide = min(target.size) / (2.0 * float(rings.radii.max()))
    neither = error_with_transition(min(like, 1.0 - like), UNSURE / EASED, 0.0, 1.0)
    least = [neither * error_with_transitions(wide, steps, 0.0) for steps in BETWEEN]
    error = like * metal.error + (1.0 - like) * magnetic_error + unsure
    loss_error = like * metal.loss_error + (1.0 - like) * max(magnetic_error, LOSS_OF_MAGNETS) + unsure_loss
    return SheetRatios(ratios, losses, max(error, least[0]), max(loss_error, least[1]), like < 0.5)


LOSS_OF_MAGNETS = 0.5
"""Relative error of the loss ratio of targets that are no conductors.

This ratio is set equal to the inductance ratio.
"""


def _is_conductor(target: Target, rings: CoaxialRings, gap: float) -> bool:
    return conductor_weight(target, float(rings.radii.mean()) + gap) >= 1.0 - PURE


def _conductor_ratios(target: Target, rings: CoaxialRings, places: Array, gap: float, floor: float) -> SheetRatios:
    """Return the ratios of a conducting target.

    It is computed as a perfect conductor whose faces lie half a skin depth inside the metal. `gap` (m) is the target's
    height, `floor` (m) the height of the mirror behind the board (-inf: none).
    """
    plate, depth = _plate(target)
    lost = plate_loss_ratio(plate, rings, places, gap + depth, floor)
    error, loss_error = ratio_error(plate, rings), loss_ratio_error(plate, rings)
    thin = error_with_transition(target.thickness / _skin_depth(target), THIN, LOSS_OF_THIN, 0.0)
    relative_size = min(target.size) / (2.0 * float(rings.radii.max()))
    loss_error = max(loss_error, error_with_transition(relative_size, OVERHANGING, thin, 0.0))
    resisted, unsure = _resistive_divisor(target, rings)
    ratios = np.minimum(plate_ratio(plate, rings, places, gap + depth, floor), 1.0)
    return SheetRatios(ratios / resisted, lost / resisted, error + unsure, loss_error + unsure, False)


RESISTED = 0.3
"""Error of a poor conductor's ratios, divided by the relative reduction of these ratios by its resistance."""

LEAKY = 0.06
"""Error of a poor conductor's ratios, divided by (s / l)^2, with s and l as in `_resistive_divisor`.

s is the length of the sheet, l the length of the coil's field. The errors `RESISTED` and `LEAKY` were fitted to discs
of finite elements, of steel and titanium from 0.03 mm on.
"""


def _resistive_divisor(target: Target, rings: CoaxialRings) -> tuple[float, float]:
    """Return the divisor of the ratios for a thin target of a poor conductor, and the divisor's relative error.

    The target's resistance reduces its currents. A sheet in a field that varies over a length l has the response
    1 / (1 + (s / l)^2), with s = skin depth^2 / thickness. For a finite target, l is at most a quarter of its radius.
    For an infinite sheet, l is 0.3 of the coil's radius.
    """
    sheet = _skin_depth(target) ** 2 / target.thickness
    own_length, endless = 0.5 * min(target.size) / 4.1, 0.3 * float(rings.radii.max())
    less = max(1.0, (1.0 + (sheet / own_length) ** 2) / (1.0 + (sheet / endless) ** 2))
    return less, min(RESISTED * (1.0 - 1.0 / less) + LEAKY * (sheet / endless) ** 2, 0.6)


def conductor_weight(target: Target, distance: float) -> float:
    """Return a number from 0 (the target reflects a wave like a magnetic plate) to 1 (like a conductor).

    Values between are for mixtures of both. The wave has the wave number 1 / `distance` (1/m).
    """
    metal = target.material
    if metal.relative_permeability < MAGNETIC and metal.conductivity > 0.0:
        return 1.0
    factor = complex(reflection(np.array([1.0 / distance]), FREQUENCY, [metal_sheet(metal, target.thickness)])[0])
    return 0.5 * (1.0 - factor.real / abs(factor)) if abs(factor) > 1e-9 else 1.0


def _equivalent_round_coil(
    coil: CoilSpec, placements: tuple[CoilPlacement, ...], target: Target, plate: Footprint,
    heights: Sequence[float], moves: Sequence[Move] = ((0.0, 0.0),),
) -> tuple[CoaxialRings, Target, tuple[Array, Index]]:
    """Return an elongated coil and its target, both shortened to the coil's width, and the places of all coils.

    The field hardly varies along the long sides, so the ratios stay nearly equal. Coil and target are shortened by
    equal lengths. A target shorter than the coil is shortened in proportion. Other coils and targets stay unchanged.
    `plate` is the target's footprint. `heights` (m) are the mid-planes of the coils' layers. `moves` (m) are
    displacements of the target from rest.

    Returns
    -------
    rings
        The shortened coil as coaxial rings.
    target
        The shortened target.
    places, index
        Distinct places (n, 2; m) of coils relative to the target, and the number of the place of each coil at each
        move. Coil k of c coils has the place `places[index[k + c m]]` at move number m.
    """
    wide, high = coil.size
    long, short = max(wide, high), min(wide, high)
    turn = target.rotation - placements[0].rotation
    # mirrored places count as one
    centres = [placement.centre for placement in placements]
    offsets = np.abs(np.array([plate.local_coordinates(Point(x - dx, y - dy)) for dx, dy in moves for x, y in centres]))
    distinct, member = np.unique(np.round(offsets, 9), axis=0, return_inverse=True)
    places = distinct, member.ravel()
    side = (int(high > wide) + round(2.0 * turn / math.pi)) % 2
    if long - short < 1e-9 or target.outline.is_disc:
        return equivalent_rings(coil, tuple(heights)), target, places
    size = list(target.size)
    size[side] = size[side] - (long - short) if size[side] > long else size[side] * short / long
    shorter, less = replace(coil, size=(short, short)), replace(target, size=(size[0], size[1]))
    return equivalent_rings(shorter, tuple(heights)), less, places


ELONGATED = 0.06
"""Error of a polygon's ratio by shortening the coil, divided by the removed fraction of its length.

Rectangles of 16 x 4 mm are within 5.6 % (tests/estimates/test_response.py).
"""

OVAL = 0.02
"""Error of a racetrack's ratio by shortening the coil, divided by the removed fraction of its length.

Racetracks up to 17.6 x 3.8 mm are within 1.5 % (tests/estimates/test_response.py).
"""


@lru_cache(maxsize=4)
def equivalent_rings(coil: CoilSpec, heights: tuple[float, ...]) -> CoaxialRings:
    """Return a coil as coaxial rings with each turn's area.

    The last, partial turn of a layer has its fraction as weight.
    """
    layers = []
    for count, height in zip(coil.layer_turns, heights, strict=True):
        turns = np.minimum(1.0, count - np.arange(math.ceil(count)))
        of_any, of_each = coil.outline.INWARD
        middle = of_any + of_each * turns
        inward = coil.trace_width / 2.0 + coil.pitch * (np.arange(turns.size) + middle)
        sides = np.maximum(np.array(coil.size) - 2.0 * inward[:, None], coil.trace_width)
        corner = coil.outline.corner_radius(coil.size, coil.corner_radius)
        cut = (4.0 - math.pi) * np.minimum(corner - inward, 0.5 * sides.min(axis=1)).clip(0.0) ** 2
        radii = np.sqrt((coil.outline.area * sides.prod(axis=1) - cut) / math.pi)
        layers.append((radii, np.full(turns.size, float(height)), turns))
    return CoaxialRings(*(np.concatenate(parts) for parts in zip(*layers, strict=True)))


def _skin_depth(target: Target) -> float:
    return metal_skin_depth(target.material, FREQUENCY)


def _plate(target: Target) -> tuple[FinitePlate, float]:
    # A good conductor is a perfect conductor with its faces half a skin depth deeper.
    depth = min(0.25 * target.thickness, 0.25 * min(target.size), 0.5 * _skin_depth(target))
    size = target.size[0] - 2.0 * depth, target.size[1] - 2.0 * depth
    return FinitePlate(size, target.thickness - 2.0 * depth, target.outline.is_disc), depth


def _notes(
    coil: CoilSpec, states: Sequence[str],
    ratios: tuple[Mapping[tuple[str, str], float], Mapping[tuple[str, str], float]], errors: tuple[float, float],
    magnetic: bool,
) -> list[str]:
    """Return notes about a finite target's ratios. Empty if all inductance ratios are above 0.995.

    `ratios` are for inductance and loss, by coil name and state. `errors` are their relative errors.
    """
    if min(ratios[0].values()) > 0.995:
        return []

    def among_coils(part: Mapping[tuple[str, str], float], state: str) -> str:
        values = [share for (_, where), share in part.items() if where == state]
        low, high = min(values), max(values)
        share = f"{100.0 * low:.0f}" + (f" to {100.0 * high:.0f}" if high - low > 0.005 else "")
        return f"{share} % {state_text(state)}"

    changes, lost = (", ".join(among_coils(part, state) for state in states) for part in ratios)
    whose = "a finite magnetic plate (its poles need room)" if magnetic else "a finite plate"
    notes = [
        f"the target counts as {whose}. Compared with an endless sheet of the same material and thickness at the same "
        f"gap, it changes a coil's inductance by {changes} of the sheet's change (each share is known within "
        f"{100.0 * errors[0]:.0f} % of itself), and the loss that it adds is {lost} of the sheet's (within "
        f"{100.0 * errors[1]:.0f} %: currents crowd at its edges)"
    ]
    if not coil.outline.is_round:
        same = "of the same area, turn by turn"
        if coil.size[0] != coil.size[1]:
            same += ", as long as it is wide, and the target as one shorter by as much"
        notes.append(f"for that share a {coil.shape} coil counts as a round one {same}")
    return notes
