"""Target of a design as a surface of eddy currents, with the coils' fields and their reflection by metal.

A mirror is a perfectly conducting plane in place of the metal behind the board: each current has an image in it. The
module also states error bounds of the inductance changes for every pose. Tests in tests/validation check these bounds.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache

import numpy as np

from sitscad.basics.arrays import Array, ComplexArray
from sitscad.basics.record import record
from sitscad.estimates.states.placed import WIDEST, PoseRange
from sitscad.estimates.targets.assembly import computed_conductivity, metal_behind, metal_sheet, metal_skin_depth
from sitscad.estimates.targets.window import WindowEffect, window_effects
from sitscad.estimates.windings.methods import bent_track
from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.eddy.box import Box, box
from sitscad.kernels.electromagnetics.eddy.coil_potential import ROOM, CoilPotential, Plane, coil_potentials
from sitscad.kernels.electromagnetics.eddy.disc import Disc, disc
from sitscad.kernels.electromagnetics.eddy.image import Mirror, Roof, image_modes
from sitscad.kernels.electromagnetics.eddy.surface import Metal, Surface
from sitscad.kernels.electromagnetics.eddy.target import SolvedTarget, changes_at
from sitscad.kernels.electromagnetics.metal.half_spaces import Reflector, reflection
from sitscad.kernels.electromagnetics.metal.polyline_spectrum import with_chords
from sitscad.kernels.solve_cache import cached_solution
from sitscad.layout.board import Coil, Layout
from sitscad.spec.coil import CoilSpec
from sitscad.spec.materials import Target

IMAGED = 0.35
"""Error of an inductance change because a perfect mirror replaces the metal behind the board (`mirror_error`).

The error is relative to the change. It is divided by the relative difference of the fields that mirror and metal
reflect. This quotient is at most 0.3 for steels and ferrite behind infinite sheets.
"""

LONGEST = 1e-3
"""Least wave number (1/m) at which a reflection factor is computed.

At wave number zero, the formula for a layer of air between two plates is undefined.
"""

MOST_WAVES = 4.0
"""Wave number of the reflection factors in `sheet_spectrum`, multiplied by the coil size.

This reflection has nearly the frequency dependence of a target's changes. Changes were interpolated between two
frequencies for steels and foils of 3 to 6 mm over coils of 6 mm. The error with this reflection is a fourteenth to a
half of the error by straight lines.
"""

SQUEEZED = 0.8
"""Limit of the coils' part in `Detail.field_length`, divided by the target's distance to the mirror.

The limit is for coils that are long compared with this distance. Without it, inductance changes had errors up to 0.5 %
(box-shaped targets) and 0.8 % (discs; tests/validation/random_poses.py).
"""

FRONT_WAVES = 0.1
"""Least distance of target and metal in front for which the field is resolved, divided by the coils' shorter side.

A smaller distance is replaced by this least distance.
"""

ROOF = (0.3, 0.6, 1.5)
"""Depths of the image planes that replace metal in front of a target, in skin depths times relative permeability.

The strengths of the planes are fitted to the metal's reflection. The error of the fit is 0.5 to 2 % for non-magnetic
steels, brass and copper.
"""

ROOF_MAGNETIC = (0.0, 0.5, 1.5)
"""Depths of image planes as in ROOF, for magnetic steels. The error of the fitted reflection is 5 to 10 %."""

ROOF_WAVES = 24
"""Number of wave numbers at which the reflection of the image planes is fitted to the metal's reflection."""

MOST_ORDERS = 44
"""Largest angular order of the currents in a disc: the number of periods along its circumference."""

OUT_OF_PHASE = 1e-4
"""Least imaginary part of a reflection factor, caused by loss in the metal, that the solution includes."""


@record
class Detail:
    """Resolution with which a target's currents are computed.

    `height` (m) is the target's least height over the coils' copper, and `coil` (m) the coils' longer side. `mirror`
    (m) is the least distance of the target to a mirror behind the coils. `finer` multiplies the usual resolution, for
    convergence tests.
    """

    height: float
    coil: float
    mirror: float = math.inf
    finer: float = 1.0

    @property
    def field_length(self) -> float:
        """Length (m) over which the coils' field varies at the target.

        It is limited near a mirror, because the coils' images in the mirror cancel most of the field of longer waves.
        """
        return (self.height + min(0.1 * self.coil, SQUEEZED * self.mirror)) / self.finer

    def point_count(self, length: float) -> int:
        """Return the number of Gauss points at which the field along a `length` (m) of the target is computed."""
        return 12 + math.ceil(1.6 * length / self.field_length)

    def middle_knot_spacing(self, length: float) -> float:
        """Return the distance (m) between the spline knots in the middle of a face with a side of this `length` (m)."""
        return min(0.11 * length / self.finer, 0.85 * self.field_length)


def target_surface(target: Target, detail: Detail, edge: float) -> Box | Disc:
    """Return the target's surface around its own middle, with spline knots `edge` (m) apart at its edges.

    `detail` is the resolution.
    """
    (x, y), z = target.size, target.thickness
    through = 4 + math.ceil(z / detail.field_length)
    if target.outline.is_disc:
        orders = min(8 + math.ceil(0.8 * x / detail.field_length), MOST_ORDERS)
        return disc(x, z, edge, detail.middle_knot_spacing(x), (detail.point_count(0.5 * x), through), orders)
    counts = detail.point_count(x), detail.point_count(y), through
    return box((x, y, z), edge, max(detail.middle_knot_spacing(x), detail.middle_knot_spacing(y)), counts)


def with_field_points(whole: Box | Disc, distance: float) -> Surface:
    """Return the surface with fewer field points, just enough for the field of its own image.

    The image is at a `distance` (m) from the surface. `whole` is the surface with its usual points.
    """

    def count(length: float) -> int:
        return 4 + math.ceil(1.2 * length / distance)

    if isinstance(whole, Disc):
        return replace(whole, counts=(count(whole.face.half), 3))
    x, y, _ = (2.0 * line.half for line in whole.lines)
    return replace(whole, counts=(count(x), count(y), 3))


@record
class PlateProblem:
    """Problem of a target of metal or ferrite over coils, with metal behind the coils and in front of the target.

    It holds all inputs that determine the target's currents, at `frequencies` (Hz). `lowest` (m) is the target's least
    height in the layout's coordinates, and `reach` (m) the largest lateral distance of its points from a coil. `finer`
    is as in `Detail`. Solutions are computed at their first use.
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
        """Geometric mean (Hz) of the lowest and the highest frequency, used for mirrors and potentials."""
        return math.sqrt(min(self.frequencies) * max(self.frequencies))

    @cached_property
    def mirror(self) -> Mirror | None:
        """Mirror in which the target's own currents have images. None if no metal is behind the board or in front."""
        mirror = None if self.behind is None else equivalent_mirror(self.behind, self.middle, self.lowest)
        if self.front is None:
            return mirror
        mirror = mirror or Mirror(-math.inf, 0.0)
        return replace(mirror, roof=equivalent_roof(self.front, self.middle, self._room, mirror.floor))

    @property
    def _room(self) -> float:
        """Distance (m) between target and metal in front for which the field between them is resolved.

        It is at least `FRONT_WAVES` times the coils' shorter side.
        """
        assert self.front is not None
        room = self.front.distance - self.lowest - self.target.thickness
        return max(room, FRONT_WAVES * min(self.coil.size))

    @cached_property
    def mirror_error(self) -> float:
        """Relative error of an inductance change because a perfect mirror replaces the metal behind the board.

        The mirror serves only for the image of the target's currents. The error is 0 without metal.
        """
        if self.mirror is None or self.behind is None:
            return 0.0
        return mirror_error(self.behind, self.mirror, self.middle, self.lowest, max(self.coil.size))

    @property
    def tabulated_coils(self) -> _Coils:
        """Coils with the three sizes (m) that determine their tables of potentials: track width, least height, reach.

        Points of the tables lie at or above the least height, and within the lateral reach from the coil.
        """
        height = _detail(self.coil, self.coils, self.lowest, self.behind, self.finer).height
        return _Coils(self.coils, self.coil.trace_width, height / self.finer, self.reach)

    @cached_property
    def is_lossy(self) -> bool:
        """Whether metal behind the board or in front of the target reflects waves with a loss above `OUT_OF_PHASE`."""
        waves = np.geomspace(1e2, 0.5 / self.tabulated_coils.height, 9)
        return any(np.abs(_reflection_factors(metal, self.middle)(waves).imag).max() >= OUT_OF_PHASE
                   for metal in (self.behind, self.front) if metal is not None)

    @cached_property
    def potentials(self) -> tuple[CoilPotential, ...]:
        """Potentials of all coils with reflections in phase with the coils' current.

        If `is_lossy`, a second potential of each coil follows: its reflections that are out of phase.
        """
        frequency = None if self.behind is None and self.front is None else self.middle
        return _potentials(self.tabulated_coils, self.behind, frequency, self.is_lossy, self.front)

    @cached_property
    def targets(self) -> tuple[SolvedTarget, ...]:
        """Solutions of the target, one for each of `frequencies`."""
        whole = _surface_at_frequency(self.target, self.coil, self.coils, self.middle, self.lowest, self.behind,
                                      self.finer)
        near_face, images, smooth = -0.5 * self.target.thickness, None, None
        if self.mirror is not None:
            distance = self.lowest - self.mirror.floor
            distance = (distance if self.front is None else min(distance, self._room)) / self.finer
            images = image_modes(whole, with_field_points(whole, 2.0 * distance), near_face, self.lowest, self.mirror)
            smooth = with_field_points(whole, distance)
        metal = computed_conductivity(self.target.material), self.target.material.relative_permeability
        metals = [Metal(frequency, *metal) for frequency in self.frequencies]
        return tuple(SolvedTarget(whole, near_face, conductor, self.mirror, images, smooth) for conductor in metals)

    @cached_property
    def cache_key(self) -> bytes:
        """All inputs as text, by which solutions are cached."""
        return repr(self).encode("utf-8")

    def changes(self, turns: Array, places: Array, is_single: bool) -> tuple[ComplexArray, ComplexArray]:
        """Return the target's changes of the inductance matrix, with real metal and with a lossless mirror behind.

        Both are (frequencies, poses, coils, coils; H, complex), computed without a cache. `turns` (poses, 3, 3) are the
        target's rotations, `places` (poses, 3; m) the centres of its near face. Set `is_single` if no other poses
        follow.
        """
        n = len(self.coils)
        centres = np.array([coil.placement.centre for coil in self.coils])
        direct, returned = self.potentials[:n], self.potentials[n:]
        matrices = changes_at(self.targets, turns, places, direct, centres, is_single, returned)
        among_coils = matrices[..., :n, :n]
        if matrices.shape[-1] == n:
            return among_coils, among_coils
        across = matrices[..., :n, n:]
        return among_coils + 1j * (across + np.swapaxes(across, -1, -2)) - matrices[..., n:, n:], among_coils


@record(eq=False)
class TargetPlate:
    """Target of metal or ferrite over coils, with its eddy currents computed for the problem `solving`.

    `missing` holds the effect of the window in the jaw behind each coil. Empty if the jaw has no window.
    """

    solving: PlateProblem
    missing: tuple[WindowEffect, ...] = ()

    @property
    def frequencies(self) -> tuple[float, ...]:
        """Frequencies (Hz) at which the target's eddy currents are computed."""
        return self.solving.frequencies

    @property
    def mirror_error(self) -> float:
        """Relative error of an inductance change by two causes: the mirror approximation, and the jaw's window.

        The mirror replaces the metal behind the board.
        """
        return self.solving.mirror_error + max((effect.growth_error for effect in self.missing), default=0.0)

    @property
    def is_over_a_poor_mirror(self) -> bool:
        """Whether the metal behind the board reflects only part of the coils' field, or a part out of phase."""
        mirror = self.solving.mirror
        return mirror is not None and (self.solving.is_lossy or abs(mirror.strength - 1.0) > 0.02)

    def changes(self, turns: Array, places: Array, is_single: bool = False) -> tuple[ComplexArray, ComplexArray]:
        """Return the target's changes of the inductance matrix, with real metal and with a lossless mirror behind.

        Both are (frequencies, poses, coils, coils; H, complex). The second result has only the loss in the target.
        Over a jaw with a window, both are larger, because metal is missing. `turns` (poses, 3, 3) are the target's
        rotations, `places` (poses, 3; m) the centres of its near face. Set `is_single` if no other poses follow.
        """
        matrices = cached_solution(
            lambda: (self.solving, turns.tobytes(), places.tobytes(), is_single),
            lambda: self.solving.changes(turns, places, is_single),
        )
        if not self.missing:
            return matrices[0], matrices[1]
        among_coils = np.einsum("fpcc->cfp", matrices[0].real)
        more = np.stack([each.target_factor(change)
                         for each, change in zip(self.missing, among_coils, strict=True)], axis=-1)
        factors = 0.5 * (more[..., :, None] + more[..., None, :])
        return matrices[0] * factors, matrices[1] * factors


def plate_over_jaw(layout: Layout, frequencies: Sequence[float], cover: PoseRange, finer: float = 1.0) -> TargetPlate:
    """Return the target of a layout over its jaw, with the effect of the jaw's window, at `frequencies` (Hz).

    `cover` is the range of poses, and `finer` multiplies the usual resolution.
    """
    spec, missing = layout.spec, window_effects(layout)
    assert spec.target is not None
    plate = make_target_plate(spec.target, spec.coil, layout.coils, frequencies, metal_behind(spec), cover, finer)
    return replace(plate, missing=tuple(missing[coil.name] for coil in layout.coils)) if missing else plate


def make_target_plate(
    target: Target, coil: CoilSpec, coils: Sequence[Coil], frequencies: Sequence[float], behind: Reflector | None,
    cover: PoseRange, finer: float = 1.0, front: Reflector | None = None,
) -> TargetPlate:
    """Return a target whose eddy currents are computed at frequencies (Hz) for the poses of `cover`.

    `coil` has the dimensions of the coils. `finer` is as in `Detail`. `behind` is the metal behind the coils.
    `front` is metal in front of the target, with its distance (m) from the board's top face. With it, the solution is
    for a single pose, whose height is the cover's lowest.
    """
    windings = tuple(replace(each, series=()) for each in coils)
    reach = min(cover.reach, (WIDEST / ROOM - 0.5) * max(coil.size))  # up to which potentials are tabulated
    return TargetPlate(_solving(
        cover.part(target), coil, windings, tuple(frequencies), behind, cover.lowest, reach, finer, front))


_solving = lru_cache(maxsize=4)(PlateProblem)
"""Cache of problems with their solutions. Designs that differ only in pad or converter share an entry."""


def _surface_at_frequency(
    target: Target, coil: CoilSpec, coils: Sequence[Coil], frequency: float, lowest: float, behind: Reflector | None,
    finer: float = 1.0,
) -> Box | Disc:
    """Return the target's surface with its resolution at a frequency (Hz).

    `lowest` (m) is the target's least height in the layout's coordinates. `behind` is the metal behind the coils, and
    `finer` multiplies the usual resolution.
    """
    detail = _detail(coil, coils, lowest, behind, finer)
    depth = metal_skin_depth(target.material, frequency)
    edge = min(0.5 * depth, 0.25 * target.thickness, 0.02 * min(target.size)) / finer
    return target_surface(target, detail, edge)


def _detail(coil: CoilSpec, coils: Sequence[Coil], lowest: float, behind: Reflector | None, finer: float) -> Detail:
    mirror = math.inf if behind is None else lowest + behind.distance
    return Detail(lowest - max(winding.z for winding in coils[0].windings), max(coil.size), mirror, finer)


def solving_work(
    target: Target, coil: CoilSpec, coils: Sequence[Coil], frequency: float, behind: Reflector | None, cover: PoseRange
) -> float:
    """Return a measure of the work to compute a target's eddy currents for the poses of `cover`.

    For a box, it is the cube of the number of basis functions in its largest symmetry class of currents. For a disc,
    it is scaled so that equal work takes equal time. `behind` is the metal behind the coils.
    """
    whole = _surface_at_frequency(cover.part(target), coil, coils, frequency, cover.lowest, behind)
    if isinstance(whole, Box):
        return float(whole.largest_class_size) ** 3
    functions = sum(line.values[1].shape[1] for line in (whole.face, whole.wall))
    work = DISCS * functions * len(whole.points) * whole.orders
    if behind is not None:
        distance = cover.lowest - equivalent_mirror(behind, frequency, cover.lowest).floor
        work += IMAGES * whole.orders * float(len(with_field_points(whole, 2.0 * distance).points)) ** 2
    return work


DISCS, IMAGES = 50.0, 12.0
"""Factors that convert the work for a disc to the unit of the work for a box (`solving_work`).

`DISCS` is the work for each function, order and point. `IMAGES` is the work for the image of the currents, for each
order and each pair of field points.
"""


def sheet_spectrum(size: tuple[float, float], target: Target | None) -> Callable[[Array], ComplexArray]:
    """Return a function of (n) frequencies (Hz) that returns reflection factors (no unit) of an infinite sheet.

    The sheet has the target's metal and thickness. The factors are for the dominant wavelength in the field of coils
    with this `size` (m). The target's inductance changes have nearly this frequency dependence.
    """
    assert target is not None
    k = np.array([MOST_WAVES / max(size)])
    layer = metal_sheet(target.material, target.thickness)
    return lambda frequencies: reflection(k, frequencies[:, None], [layer])[:, 0]


def equivalent_mirror(behind: Reflector, frequency: float, height: float) -> Mirror:
    """Return a perfect mirror, deeper and weaker, that reflects nearly like the metal behind the board.

    Its reflection equals the metal's at two wave numbers: 0.7 and 1.4, divided by the distance of metal and target. The
    target is at a height (m). The mirror serves only for the image of the target's own currents; the image of the coils
    is exact.
    """
    distance = height + behind.distance
    k = np.array([0.7, 1.4]) / distance
    long, short = reflection(k, frequency, behind.plates).real
    deeper = 0.0
    if abs(short) > 1e-9 and long / short > 1.0:
        deeper = min(0.5 * math.log(long / short) / float(k[1] - k[0]), distance)
    return Mirror(-behind.distance - deeper, -float(long) * math.exp(2.0 * float(k[0]) * deeper))


def equivalent_roof(front: Reflector, frequency: float, room: float, floor: float) -> Roof:
    """Return image planes whose combined reflection is nearly the reflection of the metal in front of a target.

    They are a least-squares fit over wave numbers up to 3 / `room`, where `room` (m) is the distance between target and
    metal. Each wave is weighted by its decay over this distance. `floor` (m) is the height of the mirror behind the
    board.
    """
    k = np.linspace(0.02, 1.0, ROOF_WAVES) * 3.0 / room
    first = front.plates[0]
    depth = first.permeability / math.sqrt(math.pi * frequency * MU0 * first.permeability * first.conductivity)
    depths = np.array(ROOF_MAGNETIC if first.permeability > 1.5 else ROOF) * depth
    decay = np.exp(-k * room)
    waves = np.exp(-2.0 * k[:, None] * depths) * decay[:, None]
    strengths = np.linalg.lstsq(waves.astype(complex), -reflection(k, frequency, front.plates) * decay, rcond=None)[0]
    planes = tuple((front.distance + float(down), complex(part)) for down, part in zip(depths, strengths, strict=True))
    height = max(room, front.distance - floor) if math.isfinite(floor) else room
    mirror = equivalent_mirror(front, frequency, height - front.distance)
    return Roof(planes, (-mirror.floor, mirror.strength))


def mirror_error(behind: Reflector, mirror: Mirror, frequency: float, height: float, size: float) -> float:
    """Return the relative error of a target's inductance changes if `mirror` replaces the metal behind the board.

    It is `IMAGED` times the largest relative difference of the field at the target between mirror and metal. The field
    includes multiple reflections between target and metal. Targets at 1, 2 and 5 times a `height` (m) are compared, for
    wavelengths near the coils' `size` (m). Inductance changes differ by less than this field, because shorter waves
    cause most of each change.
    """
    k = np.array([2.0, 2.5, 4.0]) / size
    returned, worst = reflection(k, frequency, behind.plates), 0.0
    for high in (height, 2.0 * height, 5.0 * height):
        true = 1.0 + returned * np.exp(-2.0 * k * (high + behind.distance))
        denominator = 1.0 - mirror.strength * np.exp(-2.0 * k * (high - mirror.floor))
        worst = max(worst, float(np.abs((true / denominator).real - 1.0).max()))
    return IMAGED * worst


@record
class _Coils:
    # The coils, their tracks' width (m), and the least height and the reach (m) of points for their potential.
    coils: tuple[Coil, ...]
    width: float
    height: float
    reach: float

    def potentials(
        self, floor: Plane | None = None, roof: Plane | None = None, is_lossy: bool = False
    ) -> tuple[CoilPotential, ...]:
        """Return the potentials of every coil with its reflections. If `is_lossy`, their out-of-phase parts follow.

        `floor` and `roof` are reflecting planes below and above the coils. Coils with equal rotations share one
        potential.
        """
        by_turn: dict[float, tuple[CoilPotential, ...]] = {}
        for coil in self.coils:
            turn = coil.placement.rotation
            if turn not in by_turn:
                x, y = coil.placement.centre
                paths = [replace(w, path=w.path.shifted(-x, -y)) for w in coil.windings]
                tracks = [with_chords(bent_track(w, self.width), self.height) for w in paths]
                by_turn[turn] = coil_potentials(tracks, self.height, self.reach, floor, roof, is_lossy)
        return tuple(by_turn[coil.placement.rotation][part] for part in range(1 + is_lossy) for coil in self.coils)


@lru_cache(maxsize=1)
def _potentials(
    coils: _Coils, behind: Reflector | None, frequency: float | None, is_lossy: bool, front: Reflector | None = None
) -> tuple[CoilPotential, ...]:
    """Return the coils' potentials for in-phase reflections. If `is_lossy`, the out-of-phase potentials follow.

    `behind` and `front` are the metal behind the board and in front of the target.
    """
    # without metal around the coils, the potentials are equal at all frequencies and for all targets at this height
    if frequency is None:
        return coils.potentials()
    floor = None if behind is None else Plane(-behind.distance, _reflection_factors(behind, frequency))
    roof = None if front is None else Plane(front.distance, _reflection_factors(front, frequency))
    return coils.potentials(floor, roof, is_lossy)


def _reflection_factors(behind: Reflector, frequency: float) -> Callable[[Array], ComplexArray]:
    """Return a function of wave numbers k (1/m) that returns the reflection factors of metal.

    `behind` is the metal. Wave numbers below `LONGEST` have the factor at `LONGEST`.
    """
    return lambda k: reflection(np.maximum(k.ravel(), LONGEST), frequency, behind.plates).reshape(k.shape)


USUAL = 0.006
"""Error of every inductance change, as a fraction of the magnitude of the complex change.

One half covers differences from infinite plates and from discs of finite elements, for any thickness, conductivity and
permeability (tests/validation/test_plates.py). The other half covers the tracks' finite width and the resolution: 0.07
% for 95 of 100 poses, 0.33 % at most (tests/validation/random_poses.csv).
"""

CLOSE = 0.01
"""Additional relative error of the inductance change by a target that touches the copper.

A track is computed as two filaments, which is too coarse for a target at this distance.
"""

CLOSE_WIDTHS = 1.5
"""Height of the target over the copper, in track widths, at which the error `CLOSE` has fallen linearly to 0."""

WIDE = 0.0002
"""Additional relative error of the change by a large target: `WIDE` times (size / length - `WIDE_FROM`).

The size is the target's. The length is that over which the coils' field varies at the target (`Detail.field_length`).
"""

WIDE_FROM = 8.0
"""Size of the target, divided by the length over which the field varies, above which the error `WIDE` is added."""

MUTUAL = 0.0008
"""Error of the change of a mutual inductance, divided by the geometric mean of both coils' self-inductance changes."""

LOSSY = 0.001
"""Additional relative error of changes if the metal behind the board has loss or reflects only part of the field.

`TargetPlate.mirror_error` is added to this error.
"""

MAGNET = 0.006
"""Additional error of a permeable target's inductance change, as a fraction of the magnitude of the complex change.

The real change alone is no suitable reference, because it passes zero for magnetic steels. Source: comparison with
discs of finite elements, and with rods and plates of ferrite.
"""

LOSS = 0.015
"""Error of the loss in a target, relative to the loss (infinite plates: 1.2 %, discs of finite elements: 0.1 %)."""

TALL = 0.007
"""Additional error of the loss in a target that is thicker than wide, as a fraction of the loss.

The computed loss in a brass rod of 2 x 3 mm had an error of 2.0 %.
"""

LEAST_LOSSY = 5.0
"""Largest complex change (as omega L) that enters the loss error of a magnetic target, divided by the target's loss.

A larger change is replaced by this limit, so that the error stays small for targets with little loss.
"""


def stated_errors(target: Target, coil: CoilSpec, change: Array, size: Array, scale: float, lowest: Array,
                  mapping: float, mirror: float) -> Array:
    """Return relative errors of the coils' inductance changes (poses, coils, coils).

    Each error is divided by the larger of the change and 1 % of `scale`, the free inductance (H). `change` (poses,
    coils, coils; H) are the real changes, `size` the magnitudes of the complex changes. `lowest` (poses; m) is the
    height of the target's lowest point. `mapping` is the relative error by interpolation between poses. `mirror` is the
    relative error by the mirror in place of the metal behind the coils (`mirror_error`).
    """
    near, least = _additional_errors(coil, target, lowest), np.maximum(np.abs(change), 0.01 * scale)
    relative = (mapping + mirror + near)[:, None, None]
    roots = np.sqrt(np.abs(np.einsum("pcc->pc", change)))
    shared = (MUTUAL + 0.3 * mirror) * roots[:, :, None] * roots[:, None, :]
    errors = np.maximum(relative, shared / least)
    diagonal = np.arange(change.shape[1])
    errors[:, diagonal, diagonal] = np.broadcast_to(relative[:, 0], errors.shape[:2])
    return np.asarray(errors + (USUAL + permeability_error(target)) * np.maximum(size, 0.01 * scale) / least)


def _additional_errors(coil: CoilSpec, target: Target, lowest: Array) -> Array:
    """Return additional relative errors (poses) for targets close to the copper, and for very large targets.

    `lowest` (poses; m) is the height of the target's lowest point.
    """
    near = np.clip(1.0 - lowest / (CLOSE_WIDTHS * coil.trace_width), 0.0, 1.0)
    length = Detail(1.0, max(coil.size)).field_length - 1.0 + np.maximum(lowest, 0.0)
    return np.asarray(CLOSE * near + WIDE * np.maximum(max(target.size) / length - WIDE_FROM, 0.0))


def loss_error_bounds(target: Target, coil: CoilSpec, lost: Array, size: Array, scale: float, lowest: Array,
                  mapping: float, mirror: float, frequency: float) -> Array:
    """Return error bounds (poses, coils; ohm) of the losses in a target.

    `lost` (poses, coils; ohm) are the losses, and `size` (poses, coils; H) the magnitudes of the complex inductance
    changes. `scale`, `lowest`, `mapping` and `mirror` are as in `stated_errors`. The frequency is in Hz.
    """
    omega = 2.0 * math.pi * frequency
    near = _additional_errors(coil, target, lowest)[:, None]
    poles = permeability_error(target) * np.minimum(omega * size, LEAST_LOSSY * lost)
    tall = TALL * float(np.clip(target.thickness / min(target.size) - 0.5, 0.0, 1.0))
    return np.asarray((LOSS + tall + mirror + near) * lost + mapping * np.maximum(lost, 0.01 * omega * scale) + poles)


def permeability_error(target: Target | None) -> float:
    """Return the additional error of the change by permeable metals, as a fraction of the complex change's magnitude.

    It is 0 at permeability 1 and rises with permeability, so weakly magnetic steels have a small error.
    """
    return MAGNET * (1.0 - 1.0 / target.material.relative_permeability) if target is not None else 0.0
