"""Window: an opening through the jaw's metal under the coils. It removes part of the jaw's effect on each coil.

The window is solved as an opening through an infinite slab. The slab is as deep as the window's long walls, and its
faces lie half a skin depth inside the metal. It is solved without a target, and under infinite targets at two heights:
at rest and nearer. With a target, the window increases the target's inductance change. The factor depends on the
magnitude of this change.

The window also removes part of the loss in the jaw, which follows from Wheeler's rule (as in `finite_plate`): all faces
of the jaw are moved back a little. The removed part of the loss is the change of the inductance gained by the opening,
divided by the change of the solid jaw's effect.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from sitscad.assembly.places.bodies import backing_of, target_gap
from sitscad.assembly.places.jaws import board_middle, jaw_section
from sitscad.basics.arrays import Array, ComplexArray
from sitscad.basics.record import record, replace
from sitscad.estimates.targets.assembly import LOSSLESS, Reflection, metal_behind, metal_skin_depth
from sitscad.estimates.targets.finite_target import FREQUENCY, conductor_weight
from sitscad.estimates.windings.methods import bent_track, metal_spectrum, winding_geometry
from sitscad.kernels.electromagnetics.metal.half_spaces import MetalLayer, Reflector, reflected_inductances
from sitscad.kernels.electromagnetics.metal.opening import Opening, gained_inductance
from sitscad.kernels.electromagnetics.metal.polyline_spectrum import with_chords
from sitscad.layout.board import Coil, Layout
from sitscad.spec.coil import CoilSpec
from sitscad.spec.mount import Jaw

ERROR = 0.06
"""Error of the fraction of the jaw's inductance change that the window removes, relative to this fraction.

The fraction for round holes in steel differs by up to 0.03 from finite elements (tests/validation/test_window.py).
"""

PER_DEPTH = 0.5
"""Increase of `ERROR` with the jaw's skin depth: factor on the skin depth divided by the opening's shorter side."""

WALL = 0.75
"""Recession of the opening's side walls into the metal, divided by the recession of the jaw's face.

It is below 1 because currents do not follow the edge closely. It was fitted to inductance and loss of the holes of
`ERROR`. The removed fractions then agree within 0.03. With a value of 1, the fraction of the loss agrees within 0.07.
"""

LOSS_ERROR = 0.6
"""Factor of the additional error of the fraction of the jaw's loss that the window removes.

The error is LOSS_ERROR r (1 - r), where r is the removed fraction of the jaw's inductance change.
"""

MAGNETIC = 1.1  # Relative permeability from which on the missing part is a guess with 100 % error
STEP = 0.02  # Recession of the faces for the derivative of Wheeler's rule, over the gap

PRESSED = 0.6
"""Second height of the target at which the window's effect is computed, divided by the target's height at rest.

Both heights count from the top copper layer.
"""

FARTHEST = 3.0
"""Largest change by the target, divided by its change at rest, up to which the window's effect is extrapolated.

For larger changes, the window's effect stays at its value for this change.
"""

DIGITS = 9  # Decimal places that are kept: the last digits of a solution depend on the number of threads

BENT = 0.5
"""Error of the second value of `WindowEffect.growth`, relative to this value."""

SMALL = 0.15
"""Error of the growth of a target's change because the target is finite, relative to the growth at rest.

A jaw that was nearly all window served as a test: the signal of the template grasper_4layer should equal the signal
without a jaw. It was 14 % larger.
"""


@record
class WindowEffect:
    """Fractions of the jaw's effect on inductance and loss that a window removes, each with an error bound.

    `inductance` and `loss` are the fractions for a coil without a target, `error` and `loss_error` their error bounds.
    The target's inductance change over a solid jaw is multiplied by `target_factor`: 1 + g0 + g1 (change / `scale`),
    with g0 and g1 from `growth`. `scale` is in H. `growth_error` is the error of the factor.
    """

    inductance: float
    loss: float
    error: float
    loss_error: float
    growth: tuple[float, float] = (0.0, 0.0)
    scale: float = 1.0
    growth_error: float = 0.0

    def target_factor(self, change: Array) -> Array:
        """Return the ratio of a target's inductance changes over the jaw with the window and over a solid jaw.

        `change` (H) is the change over a solid jaw. The result has its shape.
        """
        return np.asarray(1.0 + self.growth[0] + self.growth[1] * np.clip(change / self.scale, 0.0, FARTHEST))


def window_effects(layout: Layout) -> Mapping[str, WindowEffect]:
    """Return the window's effect on each coil, by coil name. Empty if the jaw has no window."""
    spec, face = layout.spec, backing_of(layout.spec).metal_face
    jaw = spec.jaw
    if jaw is None or jaw.fenestration is None or face is None:
        return {}
    gap, echo = target_gap(spec), 1.0
    if spec.target is not None and conductor_weight(spec.target, max(spec.coil.size)) < 0.5:
        echo = -1.0
    middle, by_coil, effects = board_middle(layout.body), {}, {}
    behind = metal_behind(spec), metal_behind(spec, without_jaw=True)
    for coil in layout.coils:
        x, y, turn = coil.centre.x - middle.x, coil.centre.y - middle.y, coil.placement.rotation
        if spec.coil.outline.is_round:
            turn = 0.0
        askew = abs(math.remainder(turn, 0.5 * math.pi)) > 1e-6
        key = round(x if askew else abs(x), 9), round(y if askew else abs(y), 9), round(turn % math.pi, 9)
        if key not in effects:
            effects[key] = _window_effect(spec.coil, replace(coil, series=()), jaw, (x, y), behind, (gap, -face, echo))
        by_coil[coil.name] = effects[key]
    return by_coil


@lru_cache(maxsize=16)
def _window_effect(
    spec: CoilSpec, coil: Coil, jaw: Jaw, place: tuple[float, float], behind: tuple[Reflector | None, Reflector | None],
    between: tuple[float | None, float, float],
) -> WindowEffect:
    """Return the window's effect on a coil at a place (x, y; m) relative to the window's middle.

    `behind` holds two reflectors: all metal behind the board, and this metal without the jaw. `between` holds three
    numbers: the target's distance (m) above the board's top face at rest (None without a target), the jaw's distance
    (m) below this face, and the target's `echo` as in `gained_inductance`.
    """
    (roof, floor, echo), size, metal = between, jaw.fenestration, jaw.material
    assert size is not None
    shift = place[0] - coil.centre.x, place[1] - coil.centre.y
    layers = [replace(w, path=w.path.shifted(*shift)) for w in coil.windings]
    nearest = floor + min(w.z for w in layers)
    tracks = [with_chords(bent_track(w, spec.trace_width), nearest) for w in layers]
    top = max(w.z for w in layers)
    roofs = [] if roof is None else [roof, top + PRESSED * (roof - top)]
    spectrum = metal_spectrum(winding_geometry(spec, coil), min([nearest, *(height - top for height in roofs)]))
    depth = min(metal_skin_depth(metal, FREQUENCY), 0.25 * min(size))
    back = jaw_section(jaw)  # its back is round
    inside = math.sqrt(max(back.radius**2 - 0.25 * size[1] ** 2, 0.0))
    deep = max(back.height - back.radius + inside, 0.1 * back.height)
    opening, at = Opening(size, deep), np.array([FREQUENCY])
    mirrors = (MetalLayer(LOSSLESS) if echo > 0.0 else MetalLayer(0.0, FERRITE),), (MetalLayer(LOSSLESS),)

    def returned(mirror_height: float | None, under: float) -> float:
        """Return the inductance change (H) by two perfect mirrors.

        They are `mirror_height` (m) above z = 0 (None: no mirror) and `under` (m) below z = 0.
        """
        above = None if mirror_height is None else Reflector(mirror_height, mirrors[0])
        return float(reflected_inductances(spectrum, at, above, Reflector(under, mirrors[1]), (0.0,))[0, 0].real)

    def effects(above: float | None, recess: float) -> tuple[float, float]:
        """Return the inductance (H) that the window adds, and the inductance (H) to which this gain is compared.

        If `above` is None, there is no target, and the second value is the reduction by a solid jaw. Otherwise a
        mirror at a height `above` (m) replaces the target. The second value is then its inductance change over a solid
        jaw. The jaw's faces recede by `recess` (m).
        """
        under, wider = floor + recess, opening_with_skin_depth(opening, recess)
        jaw_change = returned(None, under)
        if above is None:
            return gained_inductance(wider, tracks, under), -jaw_change
        return gained_inductance(wider, tracks, under, under + above, echo), returned(above, under) - jaw_change

    (less, low), (more, high) = (effects(None, 0.5 * depth + by) for by in (-STEP * nearest, STEP * nearest))
    part, lost = min(0.5 * (less / low + more / high), 1.0), min((more - less) / (high - low), 1.0)
    part, lost = round(part, DIGITS), round(lost, DIGITS)
    error = 1.0 if metal.relative_permeability > MAGNETIC else min(ERROR + PER_DEPTH * depth / min(size), 1.0)
    effect = WindowEffect(part, lost, error * part, (error + LOSS_ERROR * (1.0 - part)) * part)
    if roof is None:
        return effect
    at_roofs = [effects(height, 0.5 * depth) for height in roofs]
    growths = [(gain - 0.5 * (less + more)) / change for gain, change in at_roofs]
    scale, nearer = at_roofs[0][1], at_roofs[1][1]
    bend = (growths[1] - growths[0]) / (nearer / scale - 1.0)
    # part of the jaw's effect that reaches the coil: a sheet before the window hides the rest
    changes = [reflected_inductances(spectrum, at, None, value, (0.0,))[0, 0].real for value in behind]
    seen_part = min(float(changes[1] - changes[0]) / (0.5 * (low + high)), 1.0)
    growth, moving = (growths[0] - bend, bend), (error + SMALL) * abs(growths[0]) + BENT * abs(bend)
    first, second, moving = (round(seen_part * value, DIGITS) for value in (*growth, moving))
    return replace(effect, growth=(first, second), scale=scale, growth_error=moving)


def opening_with_skin_depth(opening: Opening, recess: float) -> Opening:
    """Return the opening for metal whose faces recede by `recess` (m).

    The depth decreases by 2 `recess`, but not below `recess`. Each side wall moves outward by `WALL` times `recess`.
    """
    x, y = (side + 2.0 * WALL * recess for side in opening.size)
    return Opening((x, y), max(opening.depth - 2.0 * recess, recess))


FERRITE = 1e6  # Relative permeability of a magnet that is a perfect mirror


class WindowedReflection(Reflection):
    """Change of a winding's inductance and resistance by metal with a window in the jaw.

    `real` is the reflection with a solid jaw and supplies all values that the window does not change. `whole` is the
    reflection by all metal behind the board, `none` by this metal without the jaw; both are without a target. `missing`
    is the window's effect.
    """

    def __init__(self, real: Reflection, whole: Reflection, none: Reflection, missing: WindowEffect) -> None:
        self._real, self._whole, self._none, self._missing = real, whole, none, missing
        for name in (
            "target_ratios", "factors", "with_factors", "target_change", "infinite_plate_change", "target_error_bounds",
            "is_rough",
        ):
            setattr(self, name, getattr(real, name))
        self.jaw_left = (1.0 - missing.inductance, 1.0 - missing.loss)

    def __call__(self, frequencies: Array) -> tuple[Array, Array]:
        """Return the changes of inductance (n; H) and resistance (n; ohm) by metal and window at (n) frequencies."""
        real, (more, lost) = self._real(frequencies), self._lacking(frequencies)
        return real[0] + self._missing.inductance * more, real[1] + self._missing.loss * lost

    def mutual(self, pair: tuple[int, int], distance: float, frequencies: Array) -> ComplexArray:
        """Return the change of the mutual inductance (n; H, complex) of two coils by target and metal.

        `pair` are the numbers of the coils. `distance` (m) is between their centres.
        """
        whole, none = (series.mutual(pair, distance, frequencies) for series in (self._whole, self._none))
        return np.asarray(self._real.mutual(pair, distance, frequencies) + self._missing.inductance * (none - whole))

    def crowding(self, frequencies: Array) -> ComplexArray:
        """Return the change of inductance (n; H, complex) because metal changes the eddy currents in the tracks."""
        real, whole, none = (series.crowding(frequencies) for series in (self._real, self._whole, self._none))
        return np.asarray(real + self._missing.inductance * (none - whole))

    def crowding_near(self, frequencies: Array, above: Reflector | None, below: Reflector | None) -> ComplexArray:
        """Return `Reflection.crowding_near` for a solid jaw, with the metal `above` and `below` the board.

        Results serve only for small differences, on which the window has little effect.
        """
        return self._real.crowding_near(frequencies, above, below)

    def window_error_bounds(self, frequency: float) -> tuple[float, float]:
        """Return signed error bounds of inductance (H) and resistance (ohm) by the window.

        The two errors have a common cause: both have these signs, or both the opposite signs.
        """
        more, lost = self._lacking(np.array([frequency]))
        return self._missing.error * float(more[0]), self._missing.loss_error * float(lost[0])

    def _lacking(self, frequencies: Array) -> tuple[Array, Array]:
        # Increase of inductance (H) and resistance (ohm) without the jaw and the target.
        (whole, lost), (none, other_lost) = self._whole(frequencies), self._none(frequencies)
        return none - whole, other_lost - lost
