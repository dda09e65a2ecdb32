"""Where a layout's tracks meet the solvers of alternating current: windings of every shape, and leads in pairs."""

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
from sitscad.kernels.electromagnetics.loss.corners import direct_resistance, mitred, opened, with_corners
from sitscad.kernels.electromagnetics.loss.current_modes import ProximityLoss, joined
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
from sitscad.kernels.solve_cache import solved
from sitscad.layout.board import Coil
from sitscad.spec.coil import CoilSpec

if TYPE_CHECKING:
    from sitscad.kernels.electromagnetics.metal.near_metal import CrowdingNearMetal

USUAL_TOLERANCE = 3e-2  # Of R up to 10 MHz, where nobody asks for more

ALIKE_SHARP, ALIKE_ROUNDED = 4.0, 12.0
"""Turns from which on opposite sides are alike enough for one half of them to stand for both: arcs and the halves of
racetracks lie unlike in mirrored layers (5 % of R at five turns, below 1 % from eight on)."""

ALIKE_ENDS = 12.0  # Turns from which on one half of a side stands for the other half, too: within 0.1 % of R
ALIKE = 4.0  # Pitches from the centre to the innermost turn from which on they are: an octagon with 2.5 was 5.6 % off
ROUGH_TOLERANCE = ROUGH  # Of R where a tolerance of the inductance from `SCREENING` on is asked for

SCREENING = 2e-2
"""Tolerance of the inductance with which thousands of designs are screened: everything else is as rough."""

FINE_TOLERANCE = 1e-2  # Of R where an inductance tolerance below that of USUAL_TOLERANCE, a tenth of it, is asked for


def winding_losses(spec: CoilSpec, coil: Coil, spirals: tuple[SpiralLayer, ...], conductivity: float,
                   tolerance: float | None = None) -> ProximityLoss:
    """Skin and proximity effect of a drawn coil (S/m): spirals where it has them, else the sides and arcs of its paths,
    with the way that direct current takes round sharp corners.

    `tolerance` is the relative one asked for the inductance, None for the usual.
    """
    wanted = wanted_tolerance(tolerance)
    if spirals:
        return winding_loss(spirals, conductivity, wanted)
    thickness = max(w.thickness for w in coil.windings)
    gap = least_gap(spec.trace_spacing, spec.trace_width, [w.z for w in coil.windings])
    resolution = resolution_for(spec.trace_width, thickness, gap, wanted, conductivity)
    bent = [bent_track(winding, spec.trace_width) for winding in coil.windings]
    usual = wanted > FINE_TOLERANCE
    arcs = any(np.any(mitred(track).turns) for track in bent)
    inner = 0.5 * (min(spec.size) - spec.trace_width) - spec.pitch * spec.most_turns
    # opposite sides of an odd number of them are not alike
    even, fewest = usual and spec.outline.sides % 2 == 0, min(spec.layer_turns)
    is_alike = even and fewest >= (ALIKE_ROUNDED if arcs else ALIKE_SHARP) and inner >= ALIKE * spec.pitch
    alike = (4 if fewest >= ALIKE_ENDS else 2) if is_alike else 1
    # the field along a side is smooth, but for layers that cross near corners: those want twice the places
    cuts = 4 if usual and (not spec.outline.sides or len(bent) == 1) else 8
    return bent_loss(bent, conductivity, resolution.modes, cuts, resolution.steps, alike)


def bent_loss(bent: Sequence[BentTrack], conductivity: float, modes: ModeSet, cuts: int, steps: int,
              alike: int = 1) -> ProximityLoss:
    """Skin and proximity losses of sides and arcs (S/m), a side cut `cuts` times; `alike` as in `bent_winding_loss`."""

    def loss(tracks: Sequence[BentTrack]) -> ProximityLoss:
        sides = [mitred(track) for track in tracks]
        return with_corners(bent_winding_loss(sides, conductivity, modes, cuts, steps, alike), tracks, conductivity)

    share, cornered, wide = opened(bent)
    if share == 0.0:
        return loss(cornered)
    one, other = loss(cornered), loss(wide)
    found = joined([one.scaled((1.0 - share) * one.direct), other.scaled(share * other.direct)])
    return replace(found, direct=math.fsum(direct_resistance(track, conductivity) for track in bent))


def is_rough(tolerance: float | None) -> bool:
    """Whether that tolerance of the inductance (relative; None: the usual) is for screening."""
    return tolerance is not None and tolerance >= SCREENING


def wanted_tolerance(tolerance: float | None) -> float:
    """The tolerance of R that goes with one asked for the inductance (None: the usual)."""
    if is_rough(tolerance):
        return ROUGH_TOLERANCE
    return FINE_TOLERANCE if tolerance is not None and tolerance < 0.1 * USUAL_TOLERANCE else USUAL_TOLERANCE


@record
class LossesNearMetal:
    """What metal no nearer than `nearest` (m) to any mid-plane changes of a winding's eddy currents; worked out when it
    is asked for, and kept where solutions are.

    A coil that is not round counts as its `equivalent_spirals`: what the images change is local, so cross-sections,
    pitch and length of the tracks make most of it. What direct current does at its bends is in its spectrum.
    """

    spirals: tuple[SpiralLayer, ...]
    conductivity: float
    nearest: float
    tolerance: float | None = None
    is_round: bool = True

    @cached_property
    def crowding(self) -> CrowdingNearMetal:
        """The winding's modes, and what they are to the waves that metal returns."""
        from sitscad.kernels.electromagnetics.metal.near_metal import ROUGH_STEPS, STEPS, crowding_near_metal

        resolution = suited_resolution(self.spirals, self.conductivity, wanted_tolerance(self.tolerance))
        cuts = winding_cuts(self.spirals, self.conductivity, resolution)
        steps = ROUGH_STEPS if is_rough(self.tolerance) else STEPS
        return crowding_near_metal(
            cuts, self.conductivity, resolution.modes, self.nearest, bends=self.is_round, steps=steps)

    @cached_property
    def said(self) -> bytes:
        """All that it hangs on in words, by which what was solved is kept."""
        return repr(self).encode("utf-8")

    def changes(self, frequencies: Array, above: Reflector | None, below: Reflector | None) -> ComplexArray:
        """`CrowdingNearMetal.changes` (H, complex) at (n,) frequencies (Hz)."""
        return solved(lambda: (self.said, frequencies.tobytes(), above, below),
                      lambda: (self.crowding.changes(frequencies, above, below),))[0]


losses_near_metal = lru_cache(maxsize=1)(LossesNearMetal)
"""The modes of one winding are found once for all that stands about it."""


POLYGONS_NEAR_METAL = ((0.5, 0.004, 0.02), (2.0, 0.0025, 0.01))
"""Up to so many track widths from metal: error of L at 10 MHz, in parts of the free inductance, and of R, by the round
coil of equal length. Squares, hexagons and octagons of 0.1 to 0.45 mm over a mirror, by triangles
(tests/validation/test_polygons_near_metal.py); up to 1 MHz a quarter of it."""


def near_metal_notes(spec: CoilSpec, nearest: float | None) -> tuple[str, ...]:
    """How far off the crowding of a coil that is not round may be with metal at `nearest` (m; None without metal)."""
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
    """Direct-current resistance (ohm) of a coil's winding; the current cuts sharp corners and tight turns short."""
    return math.fsum(direct_resistance(bent_track(w, spec.trace_width), conductivity) for w in coil.windings)


@record
class Strip:
    """A stretch of a lead: direct resistance (ohm), cross-section (m), and where its way back runs, if it has one.

    `across` and `height` (m) lead to the return's centre; None when the stretch runs alone.
    """

    resistance: float
    width: float
    thickness: float
    beside: tuple[float, float] | None = None

    def loss(self, conductivity: float) -> ProximityLoss:
        """Its skin effect (S/m), with what the way back adds."""
        if self.beside is None:
            alike = lone_track_loss(self.width, self.thickness, conductivity)
        else:
            alike = pair_loss(self.width, self.thickness, *self.beside, conductivity)
        return alike.scaled(self.resistance)
