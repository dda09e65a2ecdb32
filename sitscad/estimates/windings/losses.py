"""Losses by alternating current in a layout's tracks: windings of every shape, and leads in pairs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from sitscad.basics.arrays import Array, ComplexArray
from sitscad.basics.record import record
from sitscad.basics.units import show
from sitscad.estimates.windings.methods import bent_track
from sitscad.kernels.electromagnetics.inductance.spirals import SpiralLayer
from sitscad.kernels.electromagnetics.loss.bent_tracks import BentTrack, bent_winding_loss
from sitscad.kernels.electromagnetics.loss.corners import (
    direct_resistance,
    enclosing_tracks,
    with_corners,
    with_mitred_arcs,
)
from sitscad.kernels.electromagnetics.loss.current_modes import ProximityLoss, join_losses
from sitscad.kernels.electromagnetics.loss.proximity import (
    ROUGH,
    least_gap,
    resolution_for,
    suited_resolution,
    winding_cuts,
    winding_loss,
)
from sitscad.kernels.electromagnetics.loss.resistance import lone_track_loss, pair_loss
from sitscad.kernels.electromagnetics.loss.track_modes import ModeSet
from sitscad.kernels.electromagnetics.metal.half_spaces import Reflector
from sitscad.kernels.electromagnetics.metal.near_metal import ROUGH_STEPS, STEPS, crowding_near_metal
from sitscad.kernels.solve_cache import cached_solution
from sitscad.layout.board import Coil
from sitscad.spec.coil import CoilSpec

if TYPE_CHECKING:
    from sitscad.kernels.electromagnetics.metal.near_metal import CrowdingNearMetal

USUAL_TOLERANCE = 3e-2  # Usual relative tolerance of R up to 10 MHz

ALIKE_SHARP, ALIKE_ROUNDED = 4.0, 12.0
"""Least number of turns at which both halves of a winding are computed as equal: with sharp and with rounded corners.

In mirrored layers, arcs and the halves of racetracks differ: by 5 % of R at five turns, and by less than 1 % from
eight turns on.
"""

ALIKE_ENDS = 12.0  # Turns from which on half a side stands for the whole side: within 0.1 % of R
ALIKE = 4.0  # Least inner radius in pitches for this: an octagon with 2.5 was 5.6 % off
ROUGH_TOLERANCE = ROUGH  # Of R where a tolerance of the inductance from `SCREENING` on is asked for

SCREENING = 2e-2
"""Relative tolerance of the inductance. If the user's tolerance is this or larger, all values are rough (screening)."""

FINE_TOLERANCE = 1e-2  # Of R where an inductance tolerance below that of USUAL_TOLERANCE, a tenth of it, is asked for


def winding_losses(spec: CoilSpec, coil: Coil, spirals: tuple[SpiralLayer, ...], conductivity: float,
                   tolerance: float | None = None) -> ProximityLoss:
    """Return the losses by skin and proximity effect in a drawn coil whose copper has a conductivity (S/m).

    Round coils are computed as `spirals`. Other coils are computed from the sides and arcs of their paths, with the
    route of direct current around sharp corners. `tolerance` is the relative tolerance of the inductance; None is the
    usual one.
    """
    target = resistance_tolerance(tolerance)
    if spirals:
        return winding_loss(spirals, conductivity, target)
    thickness = max(w.thickness for w in coil.windings)
    gap = least_gap(spec.trace_spacing, spec.trace_width, [w.z for w in coil.windings])
    resolution = resolution_for(spec.trace_width, thickness, gap, target, conductivity)
    bent = [bent_track(winding, spec.trace_width) for winding in coil.windings]
    usual = target > FINE_TOLERANCE
    arcs = any(np.any(with_mitred_arcs(track).turns) for track in bent)
    inner = 0.5 * (min(spec.size) - spec.trace_width) - spec.pitch * spec.most_turns
    # with an odd number of sides, opposite sides differ
    even, fewest = usual and spec.outline.sides % 2 == 0, min(spec.layer_turns)
    is_alike = even and fewest >= (ALIKE_ROUNDED if arcs else ALIKE_SHARP) and inner >= ALIKE * spec.pitch
    equal_ends = (4 if fewest >= ALIKE_ENDS else 2) if is_alike else 1
    # the field along a side is smooth, except for layers that cross near corners: these need twice the places
    cuts = 4 if usual and (not spec.outline.sides or len(bent) == 1) else 8
    return bent_track_loss(bent, conductivity, resolution.modes, cuts, resolution.steps, equal_ends)


def bent_track_loss(bent: Sequence[BentTrack], conductivity: float, modes: ModeSet, cuts: int, steps: int,
              equal_ends: int = 1) -> ProximityLoss:
    """Return the losses by skin and proximity effect in tracks of straight sides and arcs.

    `conductivity` is in S/m. Each side has `cuts` cross-sections; `steps` and `equal_ends` are as in
    `bent_winding_loss`. The loss of sharp corners is added.
    """

    def loss(tracks: Sequence[BentTrack]) -> ProximityLoss:
        sides = [with_mitred_arcs(track) for track in tracks]
        proximity = bent_winding_loss(sides, conductivity, modes, cuts, steps, equal_ends)
        return with_corners(proximity, tracks, conductivity)

    share, cornered, wide = enclosing_tracks(bent)
    if share == 0.0:
        return loss(cornered)
    cornered_loss, wide_loss = loss(cornered), loss(wide)
    combined = join_losses([cornered_loss.scaled((1.0 - share) * cornered_loss.direct),
                            wide_loss.scaled(share * wide_loss.direct)])
    return replace(combined, direct=math.fsum(direct_resistance(track, conductivity) for track in bent))


def is_rough(tolerance: float | None) -> bool:
    """Whether a relative tolerance of the inductance is for screening. None is the usual tolerance."""
    return tolerance is not None and tolerance >= SCREENING


def resistance_tolerance(tolerance: float | None) -> float:
    """Return the relative tolerance of the resistance for a tolerance of the inductance (None: the usual one)."""
    if is_rough(tolerance):
        return ROUGH_TOLERANCE
    return FINE_TOLERANCE if tolerance is not None and tolerance < 0.1 * USUAL_TOLERANCE else USUAL_TOLERANCE


@record
class LossesNearMetal:
    """Inductance change because metal, at least `nearest` (m) from any layer's mid-plane, changes a winding's crowding.

    It is computed at its first use and cached with other solutions. Coils that are not round are computed as their
    `equivalent_spirals`: the currents' images in the metal act locally, so cross-sections, pitch and length of the
    tracks dominate. If `is_round`, the change includes the crowding of direct current at bends. For other shapes, the
    winding's current spectrum includes it. `conductivity` (S/m) is the copper's, and `tolerance` the relative tolerance
    of the inductance.
    """

    spirals: tuple[SpiralLayer, ...]
    conductivity: float
    nearest: float
    tolerance: float | None = None
    is_round: bool = True

    @cached_property
    def crowding(self) -> CrowdingNearMetal:
        """Current modes of the winding, with their response to waves that metal reflects."""
        resolution = suited_resolution(self.spirals, self.conductivity, resistance_tolerance(self.tolerance))
        cuts = winding_cuts(self.spirals, self.conductivity, resolution)
        steps = ROUGH_STEPS if is_rough(self.tolerance) else STEPS
        return crowding_near_metal(
            cuts, self.conductivity, resolution.modes, self.nearest, bends=self.is_round, steps=steps)

    @cached_property
    def cache_key(self) -> bytes:
        """All inputs as text, by which solutions are cached."""
        return repr(self).encode("utf-8")

    def changes(self, frequencies: Array, above: Reflector | None, below: Reflector | None,
                expected: Sequence[tuple[Reflector | None, Reflector | None]] = ()) -> ComplexArray:
        """Return the change of inductance (n; H, complex) by eddy currents near metal, at (n) frequencies (Hz).

        `above` and `below` are the metal on both sides. `expected` are pairs of metal for which further calls follow.
        """
        return cached_solution(lambda: (self, frequencies.tobytes(), above, below),
                               lambda: (self.crowding.changes(frequencies, above, below, expected),))[0]


losses_near_metal = lru_cache(maxsize=1)(LossesNearMetal)
"""Cache: the current modes of a winding are computed once for all metal around it."""


POLYGONS_NEAR_METAL = ((0.5, 0.004, 0.02), (2.0, 0.0025, 0.01))
"""Errors of crowding near metal for coils that are not round, which are computed as round coils of equal length.

A row holds three numbers. The first is the largest distance from metal in track widths. The second is the error of L at
10 MHz, divided by the free inductance. The third is the relative error of R. Source: squares, hexagons and octagons of
0.1 to 0.45 mm over a mirror, by triangles (tests/validation/test_polygons_near_metal.py). Up to 1 MHz the errors are a
quarter.
"""


def near_metal_notes(spec: CoilSpec, nearest: float | None) -> tuple[str, ...]:
    """Return notes on the crowding error of coils that are not round, near metal. Empty for round coils.

    `nearest` (m) is the distance of the metal; None means no metal.
    """
    if nearest is None or spec.outline.is_round:
        return ()
    for widths, of_inductance, of_resistance in POLYGONS_NEAR_METAL:
        if nearest < widths * spec.trace_width:
            return (
                f"metal is {show(nearest, 'm', 2)} from the middle of the copper: what it changes of the crowding of "
                f"the current is that of the round coil of equal length; on wide polygons L was within "
                f"{100 * of_inductance:.2g} % of the free inductance and R within {100 * of_resistance:.2g} %",
            )
    return ()


def winding_resistance(spec: CoilSpec, coil: Coil, conductivity: float) -> float:
    """Return the direct-current resistance (ohm) of a coil's winding.

    The current takes the inside of sharp corners and tight turns.
    """
    return math.fsum(direct_resistance(bent_track(w, spec.trace_width), conductivity) for w in coil.windings)


@record
class Strip:
    """A stretch of a lead: direct resistance (ohm), width and thickness (m), and the place of its return track.

    `beside` (across, height; m) leads to the centre of the return track. It is None if no return track is beside the
    stretch.
    """

    resistance: float
    width: float
    thickness: float
    beside: tuple[float, float] | None = None

    def loss(self, conductivity: float) -> ProximityLoss:
        """Return the loss by alternating current for a conductivity (S/m).

        It has the skin effect, and the effect of the return track.
        """
        if self.beside is None:
            normalised = lone_track_loss(self.width, self.thickness, conductivity)
        else:
            normalised = pair_loss(self.width, self.thickness, *self.beside, conductivity)
        return normalised.scaled(self.resistance)
