"""Neumann's integral over Archimedean spirals, with their slope, their ends and their crossing layers.

Neumann's integral is the double integral of dp.dq / distance along two conductors. One variable is the difference of
the azimuths of both points, the other is the position of the pair of points along the spirals. For layers of equal
sense, the integrand has no peak in the second variable. For crossing layers it has one peak at a known place. So the
double integral costs a few hundred points per turn. Its cost grows linearly with the turns, not with the square of the
number of nodes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.inductance.mean_distance import clearance_table, level_heights, strand_clearance
from sitscad.kernels.electromagnetics.special_functions import gauss

CROSSING_STRANDS = 3
"""Largest number of strands (filaments) that replace each track of two layers that cross.

With more strands, some pairs of strands would be so close that each pair would need its own quadrature points.
"""


@record
class SpiralLayer:
    """One layer r(theta) = radius - pitch theta / (2 pi), with theta from 0 to 2 pi turns, about the z axis.

    Its azimuth is angle + sense * theta (sense +1 or -1; rad). `inward` is true if the current runs with theta. Lengths
    are in metres: `radius` at the outer end, `pitch` from turn to turn, `width` and `thickness` of the track, `z` of
    its mid-plane.
    """

    radius: float
    pitch: float
    turns: float
    angle: float
    sense: int
    inward: bool
    z: float
    width: float
    thickness: float

    @property
    def span(self) -> float:
        """Angle (rad) from the outer end to the inner end: 2 pi for each turn."""
        return 2.0 * math.pi * self.turns

    @property
    def inner_radius(self) -> float:
        """Radius (m) of the centre line at the layer's inner end."""
        return self.radius - self.pitch * self.turns

    @property
    def circulation(self) -> int:
        """Direction of the current (no unit): 1 counter-clockwise, -1 clockwise."""
        return self.sense if self.inward else -self.sense


@record
class Resolution:
    """Numbers of points in Neumann's integral over two spirals.

    `along` is the number of Gauss points along the spiral. `around` is the number of Gauss points at each place where
    two turns come near. `strands` is the number of filaments across the track's width.
    """

    around: int = 14
    along: int = 10
    strands: int = 2


def spiral_mutual_inductance(first: SpiralLayer, second: SpiralLayer, resolution: Resolution = Resolution()) -> float:
    """Return the mutual inductance (H) of two coaxial spiral layers with equal pitch.

    For two equal layers it is the self-inductance.

    Parameters
    ----------
    first, second : SpiralLayer
        both layers. The pitch of the first is used for both.
    resolution : Resolution, optional
        numbers of Gauss points and strands

    Notes
    -----
    The current is uniform over the real cross-sections. Strands at the Gauss points of the width keep the rectangles'
    geometric mean distance. Sources: Neumann 1845 (integral), Grover 1946 chapter 3 (mean distance).
    """
    unit = first.radius
    if first.sense == second.sense:
        total = _parallel_integral(first, second, unit, resolution)
    else:
        total = _crossing_integral(first, second, unit, resolution)
    sign = (1 if first.inward else -1) * (1 if second.inward else -1)
    return sign * MU0 / (4.0 * math.pi) * unit * total


def spiral_inductance_matrix(layers: list[SpiralLayer], resolution: Resolution = Resolution()) -> Array:
    """Return the inductance matrix (layers, layers; H) of coaxial spiral layers with equal pitch.

    Pairs of layers that are equal by symmetry are computed once.
    """
    count = len(layers)
    matrix = np.empty((count, count))
    inductances: dict[tuple[object, ...], float] = {}
    for i in range(count):
        for j in range(i + 1):
            # pairs have equal keys if a rotation, a mirror or an exchange maps them to each other
            a, b = layers[i], layers[j]
            turn = (a.sense * (a.angle - b.angle)) % (2.0 * math.pi)
            sections = ((a.width, a.thickness), (b.width, b.thickness))
            is_same_length = a.turns == b.turns
            turn = min(turn, 2.0 * math.pi - turn) if a.sense == b.sense and is_same_length else turn
            section = tuple(sorted(sections)) if is_same_length else sections
            key = (a.sense == b.sense, round(turn, 9) % round(2.0 * math.pi, 9), round(abs(a.z - b.z), 12), section,
                    a.radius, b.radius, a.pitch, a.turns, b.turns, a.inward == b.inward)
            if key not in inductances:
                inductances[key] = spiral_mutual_inductance(layers[i], layers[j], resolution)
            matrix[i, j] = matrix[j, i] = inductances[key]
    return matrix


def _graded_points(low: Array, high: Array, scale: Array, count: int) -> tuple[Array, Array]:
    """Return points on [low, high] and their weights (panels, count), in the unit of `low`.

    They are Gauss points in t, crowded about 0 by x = scale sinh(t). `low`, `high` and `scale` have one value per
    panel.
    """
    nodes, weights = gauss(count)
    a, b = np.arcsinh(low / scale)[:, None], np.arcsinh(high / scale)[:, None]
    t = 0.5 * (a + b) + 0.5 * (b - a) * nodes
    return scale[:, None] * np.sinh(t), 0.5 * (b - a) * weights * scale[:, None] * np.cosh(t)


def _panels(centres: Array, low: float, high: float, cuts: list[float]) -> tuple[Array, Array, Array]:
    """Return the panels of [low, high] (rad): low ends (n), high ends (n) and the number (n) of the nearest centre.

    `centres` (rad) are differences of azimuth at which two turns are nearest. A panel ends at a centre, half-way to the
    next centre or at a value of `cuts` (rad).
    """
    edges = {low, high, *(c for c in cuts if low < c < high)}
    halves = np.concatenate([centres, centres - math.pi, centres + math.pi])
    edges.update(float(e) for e in halves if low < e < high)
    ordered = np.array(sorted(edges))
    ordered = ordered[np.concatenate([[True], np.diff(ordered) > 1e-12])]
    middle = 0.5 * (ordered[1:] + ordered[:-1])
    owner = np.argmin(np.abs(middle[:, None] - centres[None, :]), axis=1)
    return ordered[:-1], ordered[1:], owner


def _parallel_integral(first: SpiralLayer, second: SpiralLayer, unit: float, resolution: Resolution) -> float:
    """Return Neumann's integral of two spirals of equal sense, over their angles, divided by `unit` (m).

    `resolution` has the numbers of points.

    Notes
    -----
    Derived here. v is the difference of both azimuths, and b is the fall of the radius per radian. Then dl1.dl2 = ((b^2
    + r1 r2) cos v + b (r2 - r1) sin v) dv dtheta.
    """
    b = first.pitch / (2.0 * math.pi * unit)
    ra, rb, spans = first.radius / unit, second.radius / unit, (first.span, second.span)
    span = max(spans)
    height = (first.z - second.z) / unit
    offset = first.sense * (first.angle - second.angle)
    strands = resolution.strands
    count = math.ceil((span + 2.0 * math.pi) / (2.0 * math.pi)) + 1
    centres = offset % (2.0 * math.pi) + 2.0 * math.pi * np.arange(-count - 1, count + 1, dtype=np.float64)
    apart = np.abs(rb - ra - b * centres)
    # Points are graded by a single radius for all turns: the geometric mean of outer and inner radius, with a floor.
    mean_radius = math.sqrt(max(ra * (ra - b * span), 0.04 * ra * ra))
    # The distance of turns across the track is the radial distance times the cosine of the spiral's slope.
    slant = mean_radius / math.hypot(mean_radius, b)
    widths, thicknesses = (first.width / unit, second.width / unit), (first.thickness / unit, second.thickness / unit)
    levels = 2 if height else 1
    clearance = strand_clearance(apart * slant, height, widths, thicknesses, strands, levels)
    level, levels_apart = _mean_squared_height(height, thicknesses, levels)
    low, high, owner = _panels(centres, -spans[0], spans[1], [0.0, spans[1] - spans[0]])
    reach = apart**2 + height**2 + clearance
    smallest = 0.02 * (first.width / unit) ** 2
    # 1 / distance falls by a root of two if the arc between both is as long as their least distance.
    scale = np.sqrt(np.maximum(reach, smallest))[owner] / mean_radius
    v, weight = _graded_points(low - centres[owner], high - centres[owner], scale, resolution.around)
    u = v + centres[owner][:, None]
    start, end = np.maximum(0.0, -u), np.minimum(spans[0], spans[1] - u)
    nodes, node_weights = gauss(resolution.along)
    theta = (0.5 * (start + end))[..., None] + (0.5 * (end - start))[..., None] * nodes
    weight = (weight * 0.5 * (end - start))[..., None] * node_weights
    extra = level + clearance[owner][:, None, None]
    step = (rb - ra - b * u)[..., None]
    r1 = ra - b * theta
    r2 = r1 + step
    weight = weight * ((b * b + r1 * r2) * np.cos(v)[..., None] + b * step * np.sin(v)[..., None])
    first_strands = _normal_strands(r1, b, first.width / unit, strands)
    second_strands = _normal_strands(r2, b, second.width / unit, strands)
    return _sum_over_strands(first_strands, second_strands, v, step, 1.0, extra, weight, levels_apart)


Strand = tuple[float, Array, Array, Array, Array]
"""Weight, coordinates along radius and azimuth, offset outwards, and length divided by the centre line's length."""


def _sum_over_strands(
    first: Sequence[Strand], second: Sequence[Strand], v: Array, step: Array, sense: float, extra: Array, weight: Array,
    levels_apart: float,
) -> float:
    """Return the sum (in the unit of length) of `weight` divided by distance, for all pairs of strands of two layers.

    Parameters
    ----------
    first, second : sequence of Strand
        strands of both layers, from `_normal_strands`
    v : array
        azimuth from the first to the second centre line (rad)
    step : array
        radius of the second centre line minus the radius of the first
    sense : float
        1 if both wind in one direction, otherwise -1
    extra : array
        term of the squared distance for heights and cross-sections
    weight : array
        quadrature weight times the product of the line elements
    levels_apart : float
        half the difference of the squared heights; 0 for a single height

    Notes
    -----
    Distances are by the law of cosines. Radii of near strands are nearly equal, so their difference is taken from
    `step`.
    """
    half, sine = (2.0 * np.sin(0.5 * v) ** 2)[..., None], np.sin(v)[..., None]
    total = 0.0
    for share, p, a, x1, stretch in first:
        for other_share, q, ahead, x2, other_stretch in second:
            c = sense * ahead
            squared = (x1 - x2 - step) ** 2 + (a - c) ** 2 + extra
            squared += 2.0 * ((p * q + a * c) * half + (p * c - a * q) * (sense * sine))
            if levels_apart:  # the mean of 1/distance at both heights
                inverse = 0.5 / np.sqrt(squared - levels_apart) + 0.5 / np.sqrt(squared + levels_apart)
            else:
                inverse = 1.0 / np.sqrt(squared)
            total += share * other_share * float(np.sum(weight * stretch * other_stretch * inverse))
    return total


def _normal_strands(radius: Array, b: float, width: float, count: int) -> list[Strand]:
    """Return the strands beside a centre line r(theta) = r0 - b theta, offset along its normal; lengths in one unit.

    Each strand is (weight, coordinate along the radius, coordinate along the azimuth, offset outwards, length divided
    by the centre line's). The length ratio is 1 + x times the curvature (r^2 + 2 b^2) / (r^2 + b^2)^(3/2) (differential
    geometry of r(theta), textbook).
    """
    speed = np.sqrt(radius**2 + b * b)
    curvature = (radius**2 + 2.0 * b * b) / speed**3
    strands = []
    for node, weight in zip(*gauss(count), strict=True):
        x = 0.5 * width * float(node)
        outwards = x * radius / speed
        strands.append((0.5 * float(weight), radius + outwards, x * b / speed, outwards, 1.0 + x * curvature))
    return strands


def _mean_squared_height(height: float, thicknesses: tuple[float, float], levels: int) -> tuple[float, float]:
    """Return the mean and half the difference of the squared heights between strands, in the squared unit of `height`.

    `levels` is the number of heights that represent the distance of two layers. It is 2 for thick layers near each
    other, for which one mean height is not accurate enough.
    """
    low, *_, high = 2 * level_heights(height, thicknesses, levels)  # a single height serves as both
    return 0.5 * (low**2 + high**2), 0.5 * (high**2 - low**2)


def _crossing_integral(first: SpiralLayer, second: SpiralLayer, unit: float, resolution: Resolution) -> float:
    """Return Neumann's integral of two spirals of opposite sense, which cross each other, divided by `unit` (m).

    `resolution` has the numbers of points.

    Notes
    -----
    Derived here. The variables are the sum of both angles and the difference of radii, `gap`. The integrand has its
    peak at a gap of 0. The product of the line elements is as in `_parallel_integral`, with the sign of one angle
    reversed.
    """
    b = first.pitch / (2.0 * math.pi * unit)
    ra, rb, spans = first.radius / unit, second.radius / unit, (first.span, second.span)
    span = max(spans)
    height = (first.z - second.z) / unit
    offset = -first.sense * (first.angle - second.angle)
    count = math.ceil(span / math.pi) + 2
    centres = offset % (2.0 * math.pi) + 2.0 * math.pi * np.arange(-1, count, dtype=np.float64)
    widths = (first.width / unit, second.width / unit)
    strands = min(resolution.strands, CROSSING_STRANDS)
    thicknesses = (first.thickness / unit, second.thickness / unit)
    table = clearance_table(height, widths, thicknesses, strands, 2)
    level, levels_apart = _mean_squared_height(height, thicknesses, 2)
    mean_radius = math.sqrt(max(ra * (ra - b * span), 0.04 * ra * ra))
    grade = math.sqrt(height**2 + abs(float(table[1][0])) + 0.01 * widths[0] ** 2)
    low, high, owner = _panels(centres, 0.0, math.fsum(spans), list(spans))
    v, weight = _graded_points(low - centres[owner], high - centres[owner], np.full(owner.shape, grade / mean_radius),
                               resolution.around)
    total_angle = v + centres[owner][:, None]
    # Range of the gap of radii for a given sum of both angles, each of which runs from 0 to its span.
    least = b * (total_angle - 2.0 * np.minimum(total_angle, spans[0]))
    most = b * (2.0 * np.minimum(total_angle, spans[1]) - total_angle)
    width = np.sqrt(grade**2 + (mean_radius * 2.0 * np.sin(0.5 * v)) ** 2)
    apart = ra - rb
    gap, gap_weight = _graded_points(apart + least.ravel(), apart + most.ravel(), width.ravel(), 2 * resolution.along)
    shape = (*width.shape, 2 * resolution.along)
    # the area element of both angles is the element of their sum and the gap, divided by 2 b
    gap, weight = gap.reshape(shape), (weight.ravel()[:, None] * gap_weight).reshape(shape) / (2.0 * b)
    extra = level + np.interp(np.abs(gap), *table)
    radius_sum = (ra + rb - b * total_angle)[..., None]
    r1, r2 = 0.5 * (radius_sum + gap), 0.5 * (radius_sum - gap)
    weight = weight * ((b * b - r1 * r2) * np.cos(v)[..., None] + b * radius_sum * np.sin(v)[..., None])
    first_strands, second_strands = (_normal_strands(radius, b, track_width, strands)
                                     for radius, track_width in zip((r1, r2), widths, strict=True))
    return _sum_over_strands(first_strands, second_strands, v, -gap, -1.0, extra, weight, levels_apart)


# Closed formulas for single-layer planar spirals: Mohan, Hershenson, Boyd, Lee, IEEE JSSC 34(10), 1999, 1419-1424. They
# are fits to a field solver for on-chip spirals, 1 to 20 turns, track spacing up to three widths. They serve as checks:
# for several layers they need a coupling factor, unknown for flexible circuits, so k = 1 is an upper bound.


@record
class SheetCoefficients:
    """Constants of three closed formulas for the inductance of spirals (Mohan et al. 1999), for one shape.

    `sheet` are c1 to c4 of the current-sheet formula, `wheeler` K1 and K2 of the modified Wheeler formula. `monomial`
    are beta and a1 to a5 of the monomial fit, for micrometres and nanohenries. None if the paper has no constants.
    """

    sheet: tuple[float, float, float, float]
    wheeler: tuple[float, float] | None
    monomial: tuple[float, float, float, float, float, float] | None


COEFFICIENTS: dict[int, SheetCoefficients] = {
    4: SheetCoefficients((1.27, 2.07, 0.18, 0.13), (2.34, 2.75), (1.62e-3, -1.21, -0.147, 2.40, 1.78, -0.030)),
    6: SheetCoefficients((1.09, 2.23, 0.00, 0.17), (2.33, 3.82), (1.28e-3, -1.24, -0.174, 2.47, 1.77, -0.049)),
    8: SheetCoefficients((1.07, 2.29, 0.00, 0.19), (2.25, 3.55), (1.33e-3, -1.21, -0.163, 2.43, 1.75, -0.049)),
    0: SheetCoefficients((1.00, 2.46, 0.00, 0.20), None, None),
}
"""Constants of the closed formulas, by the number of sides of the spiral; 0 is the circle."""


@record
class SpiralOutline:
    """Dimensions of a spiral layer as the closed formulas need them.

    `turns` is the number of turns. In metres: `outer_diameter` across the copper's outer edges, track `width`,
    `spacing` between tracks.
    """

    turns: float
    outer_diameter: float
    width: float
    spacing: float

    @property
    def inner_diameter(self) -> float:
        """Inner diameter (m) as the paper defines it: d_in = d_out - 2 n w - 2 (n - 1) s."""
        return self.outer_diameter - 2.0 * self.turns * self.width - 2.0 * (self.turns - 1.0) * self.spacing

    @property
    def mean_diameter(self) -> float:
        """Mean diameter (m) as the paper defines it: d_avg = (d_out + d_in) / 2."""
        return 0.5 * (self.outer_diameter + self.inner_diameter)

    @property
    def fill(self) -> float:
        """Fill ratio (no unit) as the paper defines it: rho = (d_out - d_in) / (d_out + d_in)."""
        return (self.outer_diameter - self.inner_diameter) / (self.outer_diameter + self.inner_diameter)

    @property
    def is_covered(self) -> bool:
        """Whether the spiral lies in the range of the fits: 1 to 20 turns, spacing <= 3 widths, fill 0.1 to 0.9."""
        return 1.0 <= self.turns <= 20.0 and self.spacing <= 3.0 * self.width and 0.1 <= self.fill <= 0.9


def current_sheet(sides: int, outline: SpiralOutline) -> float:
    """Return a spiral's inductance (H) by the current-sheet formula, equation (4) of Mohan et al. 1999.

    It is mu0 n^2 d_avg c1 / 2 (ln(c2/rho) + c3 rho + c4 rho^2). Raises KeyError for a number of sides that is not in
    COEFFICIENTS.
    """
    c1, c2, c3, c4 = COEFFICIENTS[sides].sheet
    rho = outline.fill
    bracket = math.log(c2 / rho) + c3 * rho + c4 * rho * rho
    return 0.5 * MU0 * outline.turns**2 * outline.mean_diameter * c1 * bracket


def modified_wheeler(sides: int, outline: SpiralOutline) -> float | None:
    """Return a spiral's inductance (H) by equation (1) of Mohan et al. 1999, or None if the paper has no constants.

    It is K1 mu0 n^2 d_avg / (1 + K2 rho).
    """
    constants = COEFFICIENTS[sides].wheeler
    if constants is None:
        return None
    return constants[0] * MU0 * outline.turns**2 * outline.mean_diameter / (1.0 + constants[1] * outline.fill)


def monomial(sides: int, outline: SpiralOutline) -> float | None:
    """Return a spiral's inductance (H) by equation (5) of Mohan et al. 1999, or None if the paper has no constants.

    It is beta d_out^a1 w^a2 d_avg^a3 n^a4 s^a5, in micrometres and nanohenries.
    """
    constants = COEFFICIENTS[sides].monomial
    if constants is None:
        return None
    beta, a1, a2, a3, a4, a5 = constants
    um = 1e6
    return 1e-9 * (beta * (outline.outer_diameter * um) ** a1 * (outline.width * um) ** a2
                   * (outline.mean_diameter * um) ** a3 * outline.turns**a4 * (outline.spacing * um) ** a5)
