"""A window in the jaw's face: how much of what the jaw's metal does to a coil is missing for it.

The window is solved as an opening through an endless slab (`physics.metal.opening`), as deep as the jaw is where the
window's long walls end, its faces half a skin depth inside the metal's: once without a target, and under endless ones
at rest and nearer. What a target changes is so much more than before the whole jaw, by its size. Of the loss in the jaw
a part is missing by Wheeler's rule (as in `finite_plate`): from what the opening gains when all of the jaw's faces
recede by a little, against what the whole face does.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from sitscad.assembly.places.bodies import metal_face, target_gap
from sitscad.assembly.places.jaws import axis, section
from sitscad.basics.arrays import Array, ComplexArray
from sitscad.basics.record import record, replace
from sitscad.estimates.targets.assembly import LOSSLESS, Reflection, depth_in, metal_behind
from sitscad.estimates.targets.finite_target import FREQUENCY, like_a_conductor
from sitscad.estimates.windings.methods import bent_track, reflected_by, winding_geometry
from sitscad.kernels.electromagnetics.metal.half_spaces import MetalLayer, Reflector, reflected_inductances
from sitscad.kernels.electromagnetics.metal.opening import Opening, gained_inductance
from sitscad.layout.board import Coil, Layout
from sitscad.spec.coil import CoilSpec
from sitscad.spec.mount import Jaw

ERROR, PER_DEPTH = 0.06, 0.5
"""How far off the missing part of the inductance may be, of itself, and what is added for every skin depth over the
window's shorter side: slabs of surface currents and round holes of finite elements in steel differ by up to 0.03
(tests/validation/test_window.py)."""

WALL = 0.75
"""What of a skin depth counts at the opening's walls, against its face: currents do not follow its edge so closely.
Fitted to inductance and loss of the same holes (within 0.03 of either's whole effect; 1 gives 0.07 of the loss)."""

LOSS_ERROR = 0.6
"""How far off the missing part of the loss may be beyond that, of the product of what is missing and what is left of
the inductance."""

MAGNETIC = 1.1  # Relative permeability from which on the missing part is a guess, off by as much as itself
STEP = 0.02  # By how much faces recede to see what loses, over the gap

PRESSED, FARTHEST = 0.6, 3.0
"""Of the target's height at rest: the other one at which its effect is looked at; and how much larger than at rest, at
most, a change counts in its own growth."""

DIGITS = 9  # Digits of a part that count: the last ones of a system's solution hang on the number of threads

BENT, SMALL = 0.5, 0.15
"""How far off a target's change may be, of what its growth goes up by with the change itself; and of its growth, for
targets that are not endless: before a jaw that is nearly all window, grasper_4layer's signal was 14 % larger than
without a jaw."""


@record
class WindowEffect:
    """What a window takes away of the jaw's effect on a coil without a target: parts (no unit) of inductance and loss,
    and how far off either may be. What a target changes of the coil grows with its size: `growth` is the first part of
    it and the second for every `scale` (H) of change, `moving` how far off that may be, relative.
    """

    inductance: float
    loss: float
    error: float
    loss_error: float
    growth: tuple[float, float] = (0.0, 0.0)
    scale: float = 1.0
    moving: float = 0.0

    def factor(self, change: Array) -> Array:
        """Factor by which a target's change of a coil's inductance (H) before the whole jaw grows for the window."""
        return np.asarray(1.0 + self.growth[0] + self.growth[1] * np.clip(change / self.scale, 0.0, FARTHEST))


def missing_parts(layout: Layout) -> Mapping[str, WindowEffect]:
    """What is missing of the jaw's effect on each coil, by its name; empty without a window."""
    spec, face = layout.spec, metal_face(layout.spec)
    jaw = spec.jaw
    if jaw is None or jaw.fenestration is None or face is None:
        return {}
    gap, echo = target_gap(spec), 1.0
    if spec.target is not None and like_a_conductor(spec.target, max(spec.coil.size)) < 0.5:
        echo = -1.0
    middle, found, known = axis(layout.body), {}, {}
    behind = metal_behind(spec), metal_behind(spec, without_jaw=True)
    for coil in layout.coils:
        x, y, turn = coil.centre.x - middle.x, coil.centre.y - middle.y, coil.placement.rotation
        if spec.coil.outline.is_round:
            turn = 0.0
        askew = abs(math.remainder(turn, 0.5 * math.pi)) > 1e-6
        key = round(x if askew else abs(x), 9), round(y if askew else abs(y), 9), round(turn % math.pi, 9)
        if key not in known:
            known[key] = _missing(spec.coil, replace(coil, series=()), jaw, (x, y), behind, (gap, -face, echo))
        found[coil.name] = known[key]
    return found


def through_window(layout: Layout, coil: str, change: Array) -> Array:
    """What a target changes of a coil's inductance (H), from what it does before the whole jaw."""
    missing = missing_parts(layout).get(coil)
    return change if missing is None else change * missing.factor(change)


@lru_cache(maxsize=16)
def _missing(
    spec: CoilSpec, coil: Coil, jaw: Jaw, place: tuple[float, float], behind: tuple[Reflector | None, Reflector | None],
    between: tuple[float | None, float, float],
) -> WindowEffect:
    """Of one coil at a place (m) from the window's middle; `behind` are all metal behind the board and that without the
    jaw, `between` how far (m) above the board's top face the target's is at rest (None without one), how far below it
    the jaw's, and the target's `echo` as in `gained_inductance`.
    """
    from sitscad.kernels.electromagnetics.metal.polyline_spectrum import chorded  # only for a jaw with a window

    (roof, floor, echo), size, metal = between, jaw.fenestration, jaw.material
    assert size is not None
    shift = place[0] - coil.centre.x, place[1] - coil.centre.y
    layers = [replace(w, path=w.path.shifted(*shift)) for w in coil.windings]
    nearest = floor + min(w.z for w in layers)
    tracks = [chorded(bent_track(w, spec.trace_width), nearest) for w in layers]
    top = max(w.z for w in layers)
    roofs = [] if roof is None else [roof, top + PRESSED * (roof - top)]
    spectrum = reflected_by(winding_geometry(spec, coil), min([nearest, *(away - top for away in roofs)]))
    depth = min(depth_in(metal, FREQUENCY), 0.25 * min(size))
    drawn = section(jaw)  # its back is round
    inside = math.sqrt(max(drawn.radius**2 - 0.25 * size[1] ** 2, 0.0))
    deep = max(drawn.height - drawn.radius + inside, 0.1 * drawn.height)
    opening, at = Opening(size, deep), np.array([FREQUENCY])
    mirrors = (MetalLayer(LOSSLESS) if echo > 0.0 else MetalLayer(0.0, FERRITE),), (MetalLayer(LOSSLESS),)

    def returned(away: float | None, under: float) -> float:
        """What perfect mirrors so far (m) above and below z = 0 add to the coil's inductance (H)."""
        above = None if away is None else Reflector(away, mirrors[0])
        return float(reflected_inductances(spectrum, at, above, Reflector(under, mirrors[1]), (0.0,))[0, 0].real)

    def effects(away: float | None, recess: float) -> tuple[float, float]:
        """What the window adds to the inductance (H) when all of the jaw's faces recede (m); and what a mirror so far
        (m) above changes of it before the whole jaw, or what the whole jaw takes away without one.
        """
        under, wider = floor + recess, receded(opening, recess)
        bare = returned(None, under)
        if away is None:
            return gained_inductance(wider, tracks, under), -bare
        return gained_inductance(wider, tracks, under, under + away, echo), returned(away, under) - bare

    (less, low), (more, high) = (effects(None, 0.5 * depth + by) for by in (-STEP * nearest, STEP * nearest))
    part, lost = min(0.5 * (less / low + more / high), 1.0), min((more - less) / (high - low), 1.0)
    part, lost = round(part, DIGITS), round(lost, DIGITS)
    error = 1.0 if metal.relative_permeability > MAGNETIC else min(ERROR + PER_DEPTH * depth / min(size), 1.0)
    found = WindowEffect(part, lost, error * part, (error + LOSS_ERROR * (1.0 - part)) * part)
    if roof is None:
        return found
    at_roofs = [effects(away, 0.5 * depth) for away in roofs]
    growths = [(gain - 0.5 * (less + more)) / change for gain, change in at_roofs]
    scale, nearer = at_roofs[0][1], at_roofs[1][1]
    bend = (growths[1] - growths[0]) / (nearer / scale - 1.0)
    # what of the jaw is seen at all: a sheet before the window hides it
    bare = [reflected_inductances(spectrum, at, None, one, (0.0,))[0, 0].real for one in behind]
    seen_part = min(float(bare[1] - bare[0]) / (0.5 * (low + high)), 1.0)
    growth, moving = (growths[0] - bend, bend), (error + SMALL) * abs(growths[0]) + BENT * abs(bend)
    first, second, moving = (round(seen_part * one, DIGITS) for one in (*growth, moving))
    return replace(found, growth=(first, second), scale=scale, moving=moving)


def receded(opening: Opening, recess: float) -> Opening:
    """The opening where the metal's faces recede (m), its walls by `WALL` of that."""
    x, y = (side + 2.0 * WALL * recess for side in opening.size)
    return Opening((x, y), max(opening.depth - 2.0 * recess, recess))


FERRITE = 1e6  # Relative permeability of a magnet that is a perfect mirror


class WindowedReflection(Reflection):
    """What metal returns where the jaw has a window: `real` in all but that; the jaw alone returns `whole`, and what is
    there without it `none`.
    """

    def __init__(self, real: Reflection, whole: Reflection, none: Reflection, missing: WindowEffect) -> None:
        self._real, self._whole, self._none, self._missing = real, whole, none, missing
        for name in (
            "shares", "factors", "with_factors", "target_change", "endless_change", "unsure", "is_rough"
        ):
            setattr(self, name, getattr(real, name))
        self.jaw_left = (1.0 - missing.inductance, 1.0 - missing.loss)

    def __call__(self, frequencies: Array) -> tuple[Array, Array]:
        """Change of inductance (H) and resistance (ohm) at (n,) frequencies (Hz)."""
        real, (more, lost) = self._real(frequencies), self._lacking(frequencies)
        return real[0] + self._missing.inductance * more, real[1] + self._missing.loss * lost

    def mutual(self, pair: tuple[int, int], distance: float, frequencies: Array) -> ComplexArray:
        """Change of the mutual inductance (H, complex) of a pair of coils at one of the distances (m)."""
        whole, none = (one.mutual(pair, distance, frequencies) for one in (self._whole, self._none))
        return np.asarray(self._real.mutual(pair, distance, frequencies) + self._missing.inductance * (none - whole))

    def crowding(self, frequencies: Array) -> ComplexArray:
        """What of it (H, complex) the winding's own eddy currents make, which see their images, too."""
        real, whole, none = (one.crowding(frequencies) for one in (self._real, self._whole, self._none))
        return np.asarray(real + self._missing.inductance * (none - whole))

    def crowding_near(self, frequencies: Array, above: Reflector | None, below: Reflector | None) -> ComplexArray:
        """As before the whole jaw: what moves it is small."""
        return self._real.crowding_near(frequencies, above, below)

    def window(self, frequency: float) -> tuple[float, float]:
        """How far off inductance (H) and resistance (ohm) may be for the window, at most, both one way."""
        more, lost = self._lacking(np.array([frequency]))
        return self._missing.error * float(more[0]), self._missing.loss_error * float(lost[0])

    def _lacking(self, frequencies: Array) -> tuple[Array, Array]:
        # What would be more of both (H, ohm) without the jaw, the target left out.
        (one, lost), (other, other_lost) = self._whole(frequencies), self._none(frequencies)
        return other - one, other_lost - lost
