"""The target of a design as a surface of eddy currents, with the coils' fields at it and the mirror behind them; and
what its change of the inductances can be off by: stated for every pose, and held by tests/validation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache

import numpy as np

from sitscad.basics.arrays import Array, ComplexArray
from sitscad.basics.record import record
from sitscad.estimates.states.placed import Cover, tabled
from sitscad.estimates.targets.assembly import conductivity_of, depth_in, metal_behind, sheet_of
from sitscad.estimates.targets.window import WindowEffect, missing_parts
from sitscad.estimates.windings.methods import bent_track
from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.eddy.box import Box, box
from sitscad.kernels.electromagnetics.eddy.coil_potential import CoilPotential, Plane, coil_potentials
from sitscad.kernels.electromagnetics.eddy.disc import Disc, disc
from sitscad.kernels.electromagnetics.eddy.image import Mirror, Roof, image_modes
from sitscad.kernels.electromagnetics.eddy.surface import Metal, Surface
from sitscad.kernels.electromagnetics.eddy.target import SolvedTarget, changes_at
from sitscad.kernels.electromagnetics.metal.half_spaces import Reflector, reflection
from sitscad.kernels.electromagnetics.metal.polyline_spectrum import chorded
from sitscad.kernels.solve_cache import solved
from sitscad.layout.board import Coil, Layout
from sitscad.spec.coil import CoilSpec
from sitscad.spec.materials import Target
from sitscad.spec.sensor import SensorSpec

IMAGED = 0.35
"""Error of a change over that difference: at most 0.3, over steels and ferrite behind endless sheets."""

LONGEST = 1e-3
"""Least wave number (1/m) that is looked at: at none, air between two plates has no reflection of its own."""

MOST_WAVES = 4.0
"""Wave number, over one by the coil's size, whose reflection goes with the frequency like a target's changes do: a
fourteenth to a half of what straight lines leave, for steels and foils of 3 to 6 mm over coils of 6 mm."""

SQUEEZED = 0.8
"""Length of the waves that count between target and mirror, over their distance, at most: without it boxes and discs
over coils that are long against that were off by up to 0.5 and 0.8 % of the change (tests/validation/random_poses.py).
"""

FRONT_WAVES = 0.1
"""Length of the waves that count between target and what is in front of it, in the coils' width, at least."""

ROOF, ROOF_MAGNETIC, ROOF_WAVES = (0.3, 0.6, 1.5), (0.0, 0.5, 1.5), 24
"""Depths of the planes that are like metal in front, in its skin depth times its permeability, and waves at which they
are: 0.5 to 2 % off of what comes back from steels, brass and copper, 5 to 10 % of magnetic steels'."""

MOST_ORDERS = 44
"""Orders of currents round a disc, at most."""

OUT_OF_PHASE = 1e-4
"""Share of the field that a mirror returns out of phase (its loss) from which on that counts."""


@record
class Detail:
    """How fine a target is resolved: least height (m) of it over the coils' copper, the coils' size (m), and least
    distance (m) to a mirror behind them.

    `finer` is how many times finer than usual, to see what that changes.
    """

    height: float
    coil: float
    mirror: float = math.inf
    finer: float = 1.0

    @property
    def length(self) -> float:
        """Length (m) over which the coils' field at the target varies: their images leave little of longer waves."""
        return (self.height + min(0.1 * self.coil, SQUEEZED * self.mirror)) / self.finer

    def points(self, length: float) -> int:
        """How many Gauss points resolve it along a length (m)."""
        return 12 + math.ceil(1.6 * length / self.length)

    def widest(self, length: float) -> float:
        """Distance (m) of the splines' knots in the middle of a length."""
        return min(0.11 * length / self.finer, 0.85 * self.length)


def surface(target: Target, detail: Detail, edge: float) -> Box | Disc:
    """The target about its own middle, knots `edge` (m) apart at its edges."""
    (x, y), z = target.size, target.thickness
    through = 4 + math.ceil(z / detail.length)
    if target.outline.is_disc:
        orders = min(8 + math.ceil(0.8 * x / detail.length), MOST_ORDERS)
        return disc(x, z, edge, detail.widest(x), (detail.points(0.5 * x), through), orders)
    counts = detail.points(x), detail.points(y), through
    return box((x, y, z), edge, max(detail.widest(x), detail.widest(y)), counts)


def with_points(whole: Box | Disc, distance: float) -> Surface:
    """The surface with as few points as resolve a field from so far (m) away as its own image is."""

    def count(length: float) -> int:
        return 4 + math.ceil(1.2 * length / distance)

    if isinstance(whole, Disc):
        return replace(whole, counts=(count(whole.face.half), 3))
    x, y, _ = (2.0 * line.half for line in whole.lines)
    return replace(whole, counts=(count(x), count(y), 3))


@record
class Solving:
    """A target of metal or ferrite, coils over it, what is behind them and what is in front of the target: all that its
    currents hang on, at some frequencies (Hz), for heights (m) over the coils down to the `lowest` and coils seen from
    as far as `reach` (m); `finer` as in `Detail`. What is solved is solved when it is asked for.
    """

    target: Target
    coil: CoilSpec
    coils: tuple[Coil, ...]
    frequencies: tuple[float, ...]
    behind: Reflector | None
    lowest: float
    reach: float
    finer: float
    front: Reflector | None = None

    @property
    def middle(self) -> float:
        """The frequency (Hz) that stands for all of them."""
        return math.sqrt(min(self.frequencies) * max(self.frequencies))

    @cached_property
    def mirror(self) -> Mirror | None:
        """What the image of the target's own currents is taken in."""
        found = None if self.behind is None else mirror_like(self.behind, self.middle, self.lowest)
        if self.front is None:
            return found
        found = found or Mirror(-math.inf, 0.0)
        return replace(found, roof=roof_like(self.front, self.middle, self._room, found.floor))

    @property
    def _room(self) -> float:
        """Length (m) of the waves that count between target and front: what the target leaves is not much shorter."""
        assert self.front is not None
        room = self.front.distance - self.lowest - self.target.thickness
        return max(room, FRONT_WAVES * min(self.coil.size))

    @cached_property
    def mirror_error(self) -> float:
        """What taking that image in a perfect mirror adds to the relative error."""
        if self.mirror is None or self.behind is None:
            return 0.0
        return mirror_error(self.behind, self.mirror, self.middle, self.lowest, max(self.coil.size))

    @property
    def seen(self) -> _Coils:
        """The coils as their potentials are tabulated."""
        height = _detail(self.coil, self.coils, self.lowest, self.behind, self.finer).height
        return _Coils(self.coils, self.coil.trace_width, height / self.finer, self.reach)

    @cached_property
    def is_lossy(self) -> bool:
        """Whether what is behind the coils returns part of the field out of phase that counts."""
        waves = np.geomspace(1e2, 0.5 / self.seen.height, 9)
        found = [_returned(metal, self.middle)(waves) for metal in (self.behind, self.front) if metal is not None]
        return any(np.abs(returned.imag).max() >= OUT_OF_PHASE for returned in found)

    @cached_property
    def potentials(self) -> tuple[CoilPotential, ...]:
        """Potentials of all coils; after them what comes back out of phase, in the same order, where that counts."""
        frequency = None if self.behind is None and self.front is None else self.middle
        return _potentials(self.seen, self.behind, frequency, self.is_lossy, self.front)

    @cached_property
    def targets(self) -> tuple[SolvedTarget, ...]:
        """The target solved at every frequency."""
        asked = self.target, self.coil, self.coils, self.middle, self.lowest, self.behind, self.finer
        whole = _resolved(*asked)[1]
        near_face, images, smooth = -0.5 * self.target.thickness, None, None
        if self.mirror is not None:
            away = self.lowest - self.mirror.floor
            away = (away if self.front is None else min(away, self._room)) / self.finer
            images = image_modes(whole, with_points(whole, 2.0 * away), near_face, self.lowest, self.mirror)
            smooth = with_points(whole, away)
        metal = conductivity_of(self.target.material), self.target.material.relative_permeability
        metals = [Metal(frequency, *metal) for frequency in self.frequencies]
        return tuple(SolvedTarget(whole, near_face, one, self.mirror, images, smooth) for one in metals)

    @cached_property
    def said(self) -> bytes:
        """All of it in words, by which what was solved is kept."""
        return repr(self).encode("utf-8")

    def changes(self, turns: Array, places: Array, once: bool) -> tuple[ComplexArray, ComplexArray]:
        """See `Plate.changes`."""
        n = len(self.coils)
        centres = np.array([coil.placement.centre for coil in self.coils])
        direct, returned = self.potentials[:n], self.potentials[n:]
        found = changes_at(self.targets, turns, places, direct, centres, once, returned)
        own = found[..., :n, :n]
        if found.shape[-1] == n:
            return own, own
        across = found[..., :n, n:]
        return own + 1j * (across + np.swapaxes(across, -1, -2)) - found[..., n:, n:], own


@record(eq=False)
class TargetPlate:
    """A target of metal or ferrite over coils; `mirror_error` is what taking the image of the target's own currents in
    a perfect mirror adds to the relative error.
    """

    solving: Solving
    mirror_error: float = 0.0

    @property
    def frequencies(self) -> tuple[float, ...]:
        """Frequencies (Hz) at which the plate is solved."""
        return self.solving.frequencies

    @property
    def is_over_a_poor_mirror(self) -> bool:
        """Whether what is behind the coils returns less than all of the field, or some of it out of phase."""
        mirror = self.solving.mirror
        return mirror is not None and (self.solving.is_lossy or abs(mirror.strength - 1.0) > 0.02)

    def changes(self, turns: Array, places: Array, once: bool = False) -> tuple[ComplexArray, ComplexArray]:
        """Changes of the coils' inductance matrix (H, complex) at every frequency, (frequencies, poses, coils, coils):
        all of it, and what it would be with a mirror that does not lose, whose loss is the target's own. `once` where
        no other poses follow.
        """
        found = solved(
            lambda: (self.solving.said, turns.tobytes(), places.tobytes(), once),
            lambda: self.solving.changes(turns, places, once),
        )
        return found[0], found[1]


@record(eq=False)
class WindowedPlate(TargetPlate):
    """A target before a jaw with a window, `missing` for each coil: what it changes grows by that."""

    missing: tuple[WindowEffect, ...] = ()

    def changes(self, turns: Array, places: Array, once: bool = False) -> tuple[ComplexArray, ComplexArray]:
        """Changes as of `TargetPlate`, grown by what the jaw lacks behind each coil."""
        found = super().changes(turns, places, once)
        own = np.einsum("fpcc->cfp", found[0].real)
        more = np.stack([one.factor(change) for one, change in zip(self.missing, own, strict=True)], axis=-1)
        both = 0.5 * (more[..., :, None] + more[..., None, :])
        return found[0] * both, found[1] * both


def plate_over_jaw(layout: Layout, frequencies: Sequence[float], cover: Cover, finer: float = 1.0) -> TargetPlate:
    """The target of a layout solved at frequencies (Hz) with what is behind the board, a window in the jaw included."""
    spec, missing = layout.spec, missing_parts(layout)
    plate = solved_plate(spec, layout.coils, frequencies, metal_behind(spec), cover, finer)
    if not missing:
        return plate
    parts = tuple(missing[coil.name] for coil in layout.coils)
    error = plate.mirror_error + max(one.moving for one in parts)
    return WindowedPlate(plate.solving, error, parts)


def solved_plate(
    spec: SensorSpec, coils: Sequence[Coil], frequencies: Sequence[float], behind: Reflector | None, cover: Cover,
    finer: float = 1.0, front: Reflector | None = None,
) -> TargetPlate:
    """The target solved at frequencies (Hz), for the poses of `cover`; `finer` as in `Detail`. With metal in `front`
    of it, whose distance (m) counts from the board's top face, the cover's lowest height is that of the one pose.
    """
    bare, reach = tuple(replace(coil, series=()) for coil in coils), tabled(spec.coil, cover.reach)
    part = cover.part(spec).target
    assert part is not None
    found = _solving(part, spec.coil, bare, tuple(frequencies), behind, cover.lowest, reach, finer, front)
    return TargetPlate(found, found.mirror_error)


_solving = lru_cache(maxsize=4)(Solving)
"""What is solved is found done when it is tried with another pad or converter."""


def _resolved(
    target: Target, coil: CoilSpec, coils: Sequence[Coil], frequency: float, lowest: float, behind: Reflector | None,
    finer: float = 1.0,
) -> tuple[Detail, Box | Disc]:
    """How fine the target is resolved at a frequency (Hz), and its surface."""
    detail = _detail(coil, coils, lowest, behind, finer)
    depth = depth_in(target.material, frequency)
    edge = min(0.5 * depth, 0.25 * target.thickness, 0.02 * min(target.size)) / finer
    return detail, surface(target, detail, edge)


def _detail(
    coil: CoilSpec, coils: Sequence[Coil], lowest: float, behind: Reflector | None, finer: float
) -> Detail:
    mirror = math.inf if behind is None else lowest + behind.distance
    return Detail(lowest - max(winding.z for winding in coils[0].windings), max(coil.size), mirror, finer)


def solving_work(
    spec: SensorSpec, coils: Sequence[Coil], frequency: float, behind: Reflector | None, cover: Cover
) -> float:
    """What solving a target takes for the poses of `cover`, with what is `behind` the coils: the cube of the functions
    that are solved in a box's largest class of currents, and as much for what takes as long of a disc.
    """
    part = cover.part(spec).target
    assert part is not None
    whole = _resolved(part, spec.coil, coils, frequency, cover.lowest, behind)[1]
    if isinstance(whole, Box):
        return float(whole.largest) ** 3
    functions = sum(line.values[1].shape[1] for line in (whole.face, whole.wall))
    work = DISCS * functions * len(whole.points) * whole.orders
    if behind is not None:
        away = cover.lowest - mirror_like(behind, frequency, cover.lowest).floor
        work += IMAGES * whole.orders * float(len(with_points(whole, 2.0 * away).points)) ** 2
    return work


DISCS, IMAGES = 50.0, 12.0
"""Work of one function of one order of a disc at one of its points, and of what the mirror returns of the currents of
one order to two of the points that they are seen at."""


def endless_like(size: tuple[float, float], target: Target | None) -> Callable[[Array], ComplexArray]:
    """What an endless sheet of the target's metal and thickness returns (no unit) of waves as long as coils hold most
    of, at (n,) frequencies (Hz): the target's changes go with the frequency nearly like it.
    """
    assert target is not None
    k = np.array([MOST_WAVES / max(size)])
    layer = sheet_of(target.material, target.thickness)

    def factors(frequencies: Array) -> ComplexArray:
        return reflection(k, frequencies[:, None], [layer])[:, 0]

    return factors


def mirror_like(behind: Reflector, frequency: float, height: float) -> Mirror:
    """The perfect mirror, deeper and weaker, that returns waves as long as the target at a height (m) is far from what
    is behind like this does: only the image of the target's own currents is taken in it, the coils' is exact.
    """
    away = height + behind.distance
    k = np.array([0.7, 1.4]) / away
    long, short = reflection(k, frequency, behind.plates).real
    deeper = 0.0
    if abs(short) > 1e-9 and long / short > 1.0:
        deeper = min(0.5 * math.log(long / short) / float(k[1] - k[0]), away)
    strength = -float(long) * math.exp(2.0 * float(k[0]) * deeper)
    return Mirror(-behind.distance - deeper, strength)


def roof_like(front: Reflector, frequency: float, room: float, floor: float) -> Roof:
    """The planes whose waves together are like those that come back from what is in front of a target, of waves from
    three over the `room` (m) between both on: least squares, each as much as it is left after that way. `floor` (m) is
    that of the mirror behind.
    """
    k = np.linspace(0.02, 1.0, ROOF_WAVES) * 3.0 / room
    first = front.plates[0]
    depth = first.permeability / math.sqrt(math.pi * frequency * MU0 * first.permeability * first.conductivity)
    depths = np.array(ROOF_MAGNETIC if first.permeability > 1.5 else ROOF) * depth
    left = np.exp(-k * room)
    waves = np.exp(-2.0 * k[:, None] * depths) * left[:, None]
    strengths = np.linalg.lstsq(waves.astype(complex), -reflection(k, frequency, front.plates) * left, rcond=None)[0]
    planes = tuple((front.distance + float(down), complex(part)) for down, part in zip(depths, strengths, strict=True))
    height = max(room, front.distance - floor) if math.isfinite(floor) else room
    far = mirror_like(front, frequency, height - front.distance)
    return Roof(planes, (-far.floor, far.strength))


def mirror_error(behind: Reflector, mirror: Mirror, frequency: float, height: float, size: float) -> float:
    """How unlike the mirror is to what is behind, as far as it matters to a target at a height (m) or a few times that:
    relative difference of the waves that go to and fro, about as long as the coils' size (m). The changes differ by
    less, for shorter waves make most of them.
    """
    k = np.array([2.0, 2.5, 4.0]) / size
    returned, worst = reflection(k, frequency, behind.plates), 0.0
    for high in (height, 2.0 * height, 5.0 * height):
        true = 1.0 + returned * np.exp(-2.0 * k * (high + behind.distance))
        taken = 1.0 - mirror.strength * np.exp(-2.0 * k * (high - mirror.floor))
        worst = max(worst, float(np.abs((true / taken).real - 1.0).max()))
    return IMAGED * worst


@record
class _Coils:
    # The coils, their tracks' width (m), and for which height and reach (m) of points their potential is wanted.
    coils: tuple[Coil, ...]
    width: float
    height: float
    reach: float

    def potentials(
        self, floor: Plane | None = None, roof: Plane | None = None, is_lossy: bool = False
    ) -> tuple[CoilPotential, ...]:
        """The potentials of every coil, then what comes back of each out of phase, where that is lossy; coils that are
        not turned against each other have them in common.
        """
        known: dict[float, tuple[CoilPotential, ...]] = {}
        for coil in self.coils:
            turn = coil.placement.rotation
            if turn not in known:
                x, y = coil.placement.centre
                paths = [replace(w, path=w.path.shifted(-x, -y)) for w in coil.windings]
                tracks = [chorded(bent_track(w, self.width), self.height) for w in paths]
                known[turn] = coil_potentials(tracks, self.height, self.reach, floor, roof, is_lossy)
        return tuple(known[coil.placement.rotation][part] for part in range(1 + is_lossy) for coil in self.coils)


@lru_cache(maxsize=1)
def _potentials(
    seen: _Coils, behind: Reflector | None, frequency: float | None, is_lossy: bool, front: Reflector | None = None
) -> tuple[CoilPotential, ...]:
    """The coils' potentials, with what comes back from behind and from the front in phase, and out of phase where that
    loses.
    """
    # with no metal about them they are the same at all frequencies, and for every target at that height
    if frequency is None:
        return seen.potentials()
    floor = None if behind is None else Plane(-behind.distance, _returned(behind, frequency))
    roof = None if front is None else Plane(front.distance, _returned(front, frequency))
    return seen.potentials(floor, roof, is_lossy)


def _returned(behind: Reflector, frequency: float) -> Callable[[Array], ComplexArray]:
    """The factor by which waves of wave numbers (1/m) come back."""

    def factor(k: Array) -> ComplexArray:
        return reflection(np.maximum(k.ravel(), LONGEST), frequency, behind.plates).reshape(k.shape)

    return factor


USUAL = 0.006
"""Error of a change, of its complex size: of any thickness, conductivity and permeability it is within half of that of
endless plates and of discs of finite elements (tests/validation/test_plates.py); the rest is what a coil's tracks and
the resolution add (0.07 % of 95 in 100 poses, 0.33 % at most, tests/validation/random_poses.csv)."""

CLOSE, CLOSE_WIDTHS = 0.01, 1.5
"""What nearness adds: all of it at the copper, none from so many track widths on (a track is two filaments there)."""

WIDE, WIDE_FROM = 0.0002, 8.0
"""What a target adds for every length, beyond so many, over which the field at it varies."""

MUTUAL = 0.0008
"""Error of a mutual inductance's change, of the root of the product of both coils' own changes."""

LOSSY = 0.001
"""What a mirror adds that loses or returns part of the field, beside `Plate.mirror_error`."""


MAGNET = 0.006
"""What permeability adds, of the complex change's size: of magnetic steels the inductance's own change may pass zero,
and a thin one leads the field farther than it is wide (discs of finite elements, rods and plates of ferrite)."""

LOSS = 0.015
"""Error of the loss in a target, of itself (endless plates: 1.2 %, discs of finite elements: 0.1 %)."""

TALL = 0.007
"""What a target adds to the error of its loss when it is thicker than wide (a brass rod of 2 x 3 mm was 2.0 % off)."""

LEAST_LOSSY = 5.0
"""Times its loss that a magnetic target's complex change counts as, at most: what hardly loses has no large error."""


def stated_errors(spec: SensorSpec, change: Array, size: Array, scale: float, lowest: Array, mapping: float,
                  mirror: float) -> Array:
    """Relative errors (poses, coils, coils) of changes (H), each of the larger of it and 1 % of `scale` (H).

    `size` (H) is that of the complex changes, loss included, `lowest` (m) the height of the target's lowest point in
    each pose, `mapping` what interpolation adds, `mirror` what the one behind the coils does.
    """
    target = spec.target
    assert target is not None
    near, least = _more_errors(spec.coil, spec.target, lowest), np.maximum(np.abs(change), 0.01 * scale)
    relative = (mapping + mirror + near)[:, None, None]
    own = np.sqrt(np.abs(np.einsum("pcc->pc", change)))
    shared = (MUTUAL + 0.3 * mirror) * own[:, :, None] * own[:, None, :]
    stated = np.maximum(relative, shared / least)
    diagonal = np.arange(change.shape[1])
    stated[:, diagonal, diagonal] = np.broadcast_to(relative[:, 0], stated.shape[:2])
    return np.asarray(stated + (USUAL + poles_error(target)) * np.maximum(size, 0.01 * scale) / least)


def _more_errors(coil: CoilSpec, target: Target | None, lowest: Array) -> Array:
    """What nearness and a target far wider than its distance add, (poses,), relative: by the height (m) of its lowest
    point.
    """
    assert target is not None
    near = np.clip(1.0 - lowest / (CLOSE_WIDTHS * coil.trace_width), 0.0, 1.0)
    length = Detail(1.0, max(coil.size)).length - 1.0 + np.maximum(lowest, 0.0)
    return np.asarray(CLOSE * near + WIDE * np.maximum(max(target.size) / length - WIDE_FROM, 0.0))


def stated_losses(spec: SensorSpec, lost: Array, size: Array, scale: float, lowest: Array, mapping: float,
                  mirror: float, frequency: float) -> Array:
    """What the losses (poses, coils; ohm) in a target may be off by (ohm), the size (H) being that of the complex
    changes of each coil; see `stated_errors`.
    """
    omega = 2.0 * math.pi * frequency
    near = _more_errors(spec.coil, spec.target, lowest)[:, None]
    poles = poles_error(spec.target) * np.minimum(omega * size, LEAST_LOSSY * lost)
    assert spec.target is not None
    tall = TALL * float(np.clip(spec.target.thickness / min(spec.target.size) - 0.5, 0.0, 1.0))
    return np.asarray((LOSS + tall + mirror + near) * lost + mapping * np.maximum(lost, 0.01 * omega * scale) + poles)


def poles_error(target: Target | None) -> float:
    """What permeability adds, of the complex change's size: it rises from nothing, so weakly magnetic steels are what
    they nearly are.
    """
    return MAGNET * (1.0 - 1.0 / target.material.relative_permeability) if target is not None else 0.0
