"""A finite target at any pose: against boxes of loops, images and finite elements, and what must hold of any."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from tolerance import approx

from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.eddy.box import box
from sitscad.kernels.electromagnetics.eddy.coil_potential import Plane, coil_potentials
from sitscad.kernels.electromagnetics.eddy.disc import disc, toroidal
from sitscad.kernels.electromagnetics.eddy.graded_line import gaussian_sum, repeated_integrals
from sitscad.kernels.electromagnetics.eddy.image import Mirror, Roof, _matrix_factor, image_modes
from sitscad.kernels.electromagnetics.eddy.surface import Metal
from sitscad.kernels.electromagnetics.eddy.target import SolvedTarget, rotation_matrices
from sitscad.kernels.electromagnetics.inductance.filaments import PolylineTrack
from sitscad.kernels.electromagnetics.metal.half_spaces import MetalLayer, reflection
from sitscad.kernels.electromagnetics.special_functions import gauss, j1

sys.path.insert(0, str(Path(__file__).parents[1] / "validation"))
from finite_discs import EIGHT, Rings, check_disc, of_disc

COPPER, LOSSLESS, FREQUENCY = 5.8e7, 5.8e17, 5e6
OMEGA = 2.0 * math.pi * FREQUENCY
LEAST = 2e-6  # First knots within a body that no field enters: it is as if that lay a third of them deeper


def coil(outer, turns, pitch, width, heights):
    radii = (outer - width) / 2 - pitch * (np.arange(turns) + 0.5)
    return np.tile(radii, len(heights)), np.repeat(heights, turns)


JAW = coil(4e-3, 7, 160e-6, 80e-6, np.array([-15e-6, -64e-6, -142e-6, -191e-6]))
PLATE = (4.5e-3, 4.2e-3, 0.2e-3)
CENTRES = np.array([[-2.25e-3, 0.0], [2.25e-3, 0.0]])
STRAIGHT = np.zeros((1, 3))


def a_box(size=PLATE, conductivity=COPPER, fine=1.0, points=24, first=15e-6):
    surface = box(size, first / fine, 0.5e-3 / fine, (points, points, 5))
    return SolvedTarget(surface, -0.5 * size[2], Metal(FREQUENCY, conductivity))


@pytest.fixture(scope="module")
def plate():
    return a_box()


@pytest.fixture(scope="module")
def round_plate():
    surface = disc(4e-3, 0.2e-3, 15e-6, 0.4e-3, (20, 4), 16)
    return SolvedTarget(surface, -0.1e-3, Metal(FREQUENCY, COPPER))


def change(target, poses, rings=JAW, centres=CENTRES, floor=-math.inf):
    poses = np.atleast_2d(poses)
    return target.changes(rotation_matrices(poses[:, 3:]), poses[:, :3], [Rings(*rings, floor)] * len(centres), centres)


def test_gaussian_sum_approximates_inverse_distance():
    result = gaussian_sum(1e-6, 1e-2)
    at = np.geomspace(2e-6, 1e-2, 50)
    summed = (result.weights * np.exp(-((result.scales * at[:, None]) ** 2))).sum(axis=1)
    constant = (summed - 1.0 / at)[-1]
    assert summed - constant == approx(1.0 / at, rel=1e-4)


def test_gaussian_sum_tail_equals_missing_surface_integral():
    result = gaussian_sum(1e-6, 1e-2)
    edges = np.geomspace(1e-11, 20e-6, 4001)
    at = np.sqrt(edges[1:] * edges[:-1])
    summed = (result.weights * np.exp(-((result.scales * at[:, None]) ** 2))).sum(axis=1)
    lacked = math.fsum((1.0 / at - summed) * math.pi * np.diff(edges**2))
    assert result.tail == approx(lacked, rel=0.01)


def test_non_positive_energy_eigenvalues_are_raised():
    turned, _ = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))
    energies = np.array([-1e-3, 0.5, 1.0])
    matrix = turned * energies @ turned.T
    factor = _matrix_factor(matrix)
    assert np.linalg.eigvalsh(factor @ factor.T) == approx(np.array([2e-3, 0.5, 1.0]), rel=1e-9)
    assert np.linalg.eigvalsh(factor @ factor.T - matrix)[0] > -1e-12


def test_toroidal_functions_match_circle_averages():
    excess = np.array([1e-4, 1e-2, 0.04, 0.05, 0.5, 20.0])
    angle = 2.0 * math.pi * (np.arange(40_000) + 0.5) / 40_000
    for order in (0, 1, 2, 7, 15):
        mean = [np.mean(np.cos(order * angle) / np.sqrt(2.0 * (1.0 + x - np.cos(angle)))) for x in excess]
        assert toroidal(excess, 15)[order] == approx(math.pi * np.array(mean), rel=1e-6, abs=1e-13)


@pytest.mark.slow
@pytest.mark.parametrize("offset", [0.0, 2.25e-3])
def test_lossless_box_target_agrees_with_loop_model(offset):
    from box_of_loops import converged_change

    target = a_box(conductivity=LOSSLESS, first=LEAST)
    ours = change(target, [0.0, 0.0, 1e-3, 0.0, 0.0, 0.0], centres=np.array([[offset, 0.0]]))[0, 0, 0].real
    assert ours == approx(converged_change(PLATE[:2], PLATE[2], offset, *JAW, 1e-3), rel=4e-3)


def test_target_solution_has_converged_in_splines_and_points(plate):
    poses = [[0.3e-3, -0.2e-3, 0.4e-3, 0.1, -0.08, 0.4], [0.0, 0.0, 1e-3, 0.0, 0.0, 0.0]]
    coarse, fine = change(plate, poses), change(a_box(fine=2.0, points=36), poses)
    assert coarse == approx(fine, abs=2e-3 * np.abs(fine).max())


@pytest.mark.more
@pytest.mark.slow
def test_large_lossless_plate_acts_as_image():
    from box_of_loops import endless_change

    size = (22e-3, 22e-3, 0.3e-3)
    target = SolvedTarget(box(size, LEAST, 0.6e-3, (60, 60, 3)), -0.5 * size[2], Metal(FREQUENCY, LOSSLESS))
    for gap in (0.5e-3, 1.5e-3):
        ours = change(target, [0.0, 0.0, gap, 0.0, 0.0, 0.0], centres=np.zeros((1, 2)))[0, 0, 0].real
        assert ours == approx(endless_change(*JAW, gap), rel=2e-3)


@pytest.mark.slow
def test_large_lossless_disc_off_centre_acts_as_image():
    from box_of_loops import endless_change

    surface = disc(24e-3, 0.3e-3, LEAST, 0.6e-3, (48, 3), 30)
    target = SolvedTarget(surface, -0.15e-3, Metal(FREQUENCY, LOSSLESS))
    ours = change(target, [3e-3, 1e-3, 1.5e-3, 0.0, 0.0, 0.0], centres=np.zeros((1, 2)))[0, 0, 0].real
    assert ours == approx(endless_change(*JAW, 1.5e-3), rel=3e-3)


# gap, diameter, thickness (m), conductivity (S/m): aluminium, brass, copper; foils
DISCS = [(1e-3, 8e-3, 0.2e-3, 5.8e7), (0.5e-3, 4e-3, 0.035e-3, 5.8e7), (1e-3, 8e-3, 1e-3, 3.5e7)]


@pytest.mark.needs("scipy")
@pytest.mark.parametrize("case", DISCS, ids=str)
def test_disc_target_agrees_with_finite_elements(case):
    from disc_of_elements import disc_change

    reference = disc_change(EIGHT[0], *case[:3], case[3], cells=1.0)
    check_disc(*case, reference, 4e-3, 0.02)


# gap, diameter, thickness (m), conductivity (S/m), permeability: steels thick and thin, iron, ferrite
MAGNETS = [
    (0.5e-3, 4e-3, 0.2e-3, 1.3e6, 95.0), (0.5e-3, 5e-3, 0.03e-3, 1.3e6, 20.0), (1e-3, 8e-3, 0.5e-3, 6e6, 400.0),
    (0.5e-3, 4e-3, 0.2e-3, 1.3e6, 2.0), (1e-3, 8e-3, 0.5e-3, 0.01, 150.0),
]


@pytest.mark.needs("scipy")
@pytest.mark.parametrize("case", MAGNETS, ids=str)
def test_magnetic_disc_target_agrees_with_finite_elements(case):
    """Of the size of the complex change: the inductance's own may pass zero."""
    from disc_of_elements import disc_change

    lower, more = disc_change(EIGHT[0], *case, cells=0.8)
    ours = of_disc(*case)
    apart = abs(ours.real - lower), abs(-OMEGA * ours.imag - more) / OMEGA
    assert max(apart) < 0.02 * abs(complex(lower, more / OMEGA))


@pytest.mark.parametrize(
    ("size", "axes"), [((4e-3, 3e-3, 1e-3), (1.0, -1.0, 0.0)), ((4e-3, 4e-3, 2e-3), (1.0, 1.0, -2.0))]
)
def test_box_energy_of_harmonic_potential_matches_closed_form(size, axes):
    # of x^2 - y^2 and the like the squared gradient's integral is known
    surface = box(size, 0.1e-3, 0.5e-3, (6, 6, 5))
    item = next(item for item in surface.classes if item.parity == (1, 1, 1))
    grid = [line.values[1] for line in surface.lines]
    fits = [np.linalg.lstsq(v, line.nodes**2, rcond=None)[0] for v, line in zip(grid, surface.lines, strict=True)]
    ones = [np.linalg.lstsq(v, np.ones(len(v)), rcond=None)[0] for v in grid]
    whole = sum(
        axes[k] * np.einsum("a,b,c->abc", *(fits[a] if a == k else ones[a] for a in range(3))) for k in range(3)
    )
    on_surface = np.zeros(whole.shape, dtype=bool)
    on_surface[-1], on_surface[:, -1], on_surface[:, :, -1] = True, True, True
    values = whole[on_surface][item.functions.kept]
    values[-1] = 0.0  # a constant is no field, and has an energy of its own for that
    exact = MU0 * np.prod(size) / 3.0 * sum((a * length) ** 2 for a, length in zip(axes, size, strict=True))
    assert MU0 * (values @ item.functions.body.vacuum @ values) == approx(exact, rel=2e-3)


def test_magnetic_square_rotated_by_90_degrees_gives_equal_change():
    surface = box((3e-3, 3e-3, 0.3e-3), 15e-6, 0.4e-3, (20, 20, 5))
    square = SolvedTarget(surface, -0.15e-3, Metal(FREQUENCY, 1.3e6, 95.0))
    pose = [0.3e-3, 0.2e-3, 1e-3, 0.0, 0.0]
    assert change(square, [*pose, math.pi / 2.0]) == approx(change(square, [*pose, 0.0]), rel=1e-3)


@pytest.mark.parametrize(("conductivity", "permeability"), [(1.3e6, 95.0), (0.01, 150.0)])
def test_large_magnetic_sheet_agrees_with_infinite_plate(conductivity, permeability):
    gap, thickness, metal = 1e-3, 0.3e-3, (conductivity, permeability)
    k = 7.0 / gap * (1.0 + np.polynomial.legendre.leggauss(500)[0])
    share = 7.0 / gap * np.polynomial.legendre.leggauss(500)[1]
    spectrum = (EIGHT[0] * j1(k[:, None] * EIGHT[0])).sum(axis=1)
    factor = reflection(k, FREQUENCY, [MetalLayer(*metal, thickness)])
    endless = MU0 * math.pi * complex(np.sum(share * spectrum**2 * np.exp(-2.0 * k * gap) * factor))
    surface = disc(30e-3, thickness, 20e-6, 0.9e-3, (60, 4), 0)
    target = SolvedTarget(surface, -0.5 * thickness, Metal(FREQUENCY, conductivity, permeability))
    ours = change(target, [0.0, 0.0, gap, 0.0, 0.0, 0.0], EIGHT, np.zeros((1, 2)))[0, 0, 0]
    assert abs(ours - endless) < 0.01 * abs(endless)


def test_distant_target_gives_negligible_change(plate):
    near = change(plate, [0.0, 0.0, 0.5e-3, 0.0, 0.0, 0.0])
    for pose in ([0.0, 0.0, 40e-3, 0.2, 0.0, 0.0], [40e-3, 0.0, 0.5e-3, 0.0, 0.0, 0.0]):
        assert np.abs(change(plate, pose)).max() < 1e-5 * np.abs(near).max()


def test_target_change_is_reciprocal_lowers_inductance_and_adds_loss(plate, round_plate):
    pose = [0.7e-3, -0.4e-3, 0.4e-3, 0.1, 0.2, 0.5]
    for target in (plate, round_plate):
        result = change(target, pose)[0]
        assert result[0, 1] == approx(result[1, 0], rel=1e-9)
        assert np.linalg.eigvalsh(result.real).max() < 0.0
        assert np.linalg.eigvalsh(-result.imag).min() > 0.0


def test_mirrored_target_pose_gives_mirrored_change(plate, round_plate):
    pose = np.array([0.7e-3, 0.4e-3, 0.4e-3, 0.1, 0.2, 0.5])
    across, along = pose * [1, -1, 1, -1, 1, -1], pose * [-1, 1, 1, 1, -1, -1]
    for target in (plate, round_plate):
        result, mirrored, other = (change(target, item)[0] for item in (pose, across, along))
        assert mirrored == approx(result, rel=1e-6)
        assert other == approx(result[::-1, ::-1], rel=1e-6)


def test_disc_rotated_about_its_axis_gives_equal_change(round_plate):
    pose = np.array([0.7e-3, 0.4e-3, 0.6e-3, 0.1, 0.1])
    result, after = (change(round_plate, [*pose, turn])[0] for turn in (0.0, 0.7))
    assert after == approx(result, rel=2e-4)


def test_positive_tilt_about_y_increases_change_at_plus_x(plate):
    point = rotation_matrices(np.array([[0.0, 0.1, 0.0]]))[0] @ [1.0, 0.0, 0.0]
    assert point[2] < 0.0
    left, right = np.diag(change(plate, [0.0, 0.0, 1e-3, 0.0, 0.1, 0.0])[0].real)
    assert abs(right) > abs(left)


@pytest.mark.slow
def test_change_is_smooth_over_target_pose():
    # Across the doublings of the height at which the table's grids change, too.
    target, table = a_box(points=20), coil_potentials(LAYERS, 0.15e-3, 5e-3)[0]
    first, last = (
        np.array(pose) for pose in ((-1e-3, 0.5e-3, 3e-3, -0.1, 0.0, -0.3), (1e-3, -1e-3, 0.7e-3, 0.1, 0.1, 0.4))
    )
    poses = first + np.linspace(0.0, 1.0, 500)[:, None] * (last - first)
    result = target.changes(rotation_matrices(poses[:, 3:]), poses[:, :3], [table, table], CENTRES).reshape(500, -1)
    for part in (result.real, result.imag):
        jump = np.abs(np.diff(part, n=4, axis=0)).max(axis=0)
        assert np.all(jump < 1e-3 * np.ptp(part, axis=0))


FIELDS_AT = [box(PLATE, 20e-6, 0.5e-3, (12, 12, 5)), disc(4e-3, 0.2e-3, 20e-6, 0.4e-3, (12, 4), 6)]


@pytest.mark.parametrize("surface", FIELDS_AT, ids=["box", "disc"])
def test_gradient_fields_drive_no_target_current(surface):
    x, y, z = surface.points.T * 1e3
    none = np.zeros_like(x)
    fields = (z, none, x), (y * z, x * z, x * y), (z * z, none, 2.0 * x * z)
    slopes = np.stack([np.stack(item, axis=1) for item in fields], axis=2)
    across, up = slopes.copy(), slopes.copy()
    across[:, 2], up[:, :2] = 0.0, 0.0
    whole, parts = (
        np.array([max(np.abs(item.flux_linkages(field)).max(initial=0.0) for item in surface.classes)
                  for field in fields])
        for fields in ([slopes], [across, up])
    )
    assert parts.min() > 0.0 and whole.max() < 1e-3 * parts.min()


@pytest.mark.slow
def test_repeated_gaussian_integrals_match_erf_and_each_other():
    scales, u, (nodes, weights) = np.geomspace(1.0, 1e3, 7), np.linspace(0.0, 0.1, 4001), gauss(6)
    result = repeated_integrals(scales, u)
    erf = np.array([[math.erf(s * v) for v in u] for s in scales])
    assert result[0] == approx(0.5 * math.sqrt(math.pi) / scales[:, None] * erf, rel=1e-12, abs=1e-18)
    between = (u[:-1, None] + 0.5 * np.diff(u)[:, None] * (1.0 + nodes)).ravel()
    for lower, upper, values in zip(result, result[1:], repeated_integrals(scales, between), strict=False):
        steps = (values.reshape(len(scales), -1, nodes.size) * weights).sum(axis=2) * 0.5 * np.diff(u)
        assert np.diff(upper, axis=1) == approx(steps, rel=1e-7, abs=1e-15 * float(np.abs(upper).max()))
        assert np.all(np.diff(lower, axis=1) >= 0.0)


@pytest.mark.parametrize("surface", [box(PLATE, 20e-6, 1e-3, (6, 5, 4)), disc(4e-3, 0.2e-3, 20e-6, 1e-3, (6, 3), 3)])
def test_flux_linkage_and_current_operators_are_transposed(surface):
    field = np.sin(np.arange(len(surface.points) * 3 * 2)).reshape(-1, 3, 2)
    for item in surface.classes:
        some = np.cos(np.arange(len(item.functions.inductance) * 3)).reshape(-1, 3)
        linked = np.einsum("pcm,pcs->ms", item.potential_weights(some), field)
        assert linked == approx(some.T @ item.flux_linkages(field), rel=1e-9, abs=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(("floor", "gap"), [(-0.9e-3, 1e-3), (-0.4e-3, 0.4e-3)])
def test_target_over_mirror_agrees_with_loop_model(floor, gap):
    from box_of_loops import converged_change

    mirror, near_face = Mirror(floor), -0.5 * PLATE[2]
    surface, coarse = box(PLATE, LEAST, 0.5e-3, (24, 24, 5)), box(PLATE, LEAST, 0.5e-3, (8, 8, 3))
    images = image_modes(surface, coarse, near_face, 0.2e-3, mirror)
    target = SolvedTarget(surface, near_face, Metal(FREQUENCY, LOSSLESS), mirror, images)
    centres = np.array([[2.25e-3, 0.0]])
    ours = change(target, [0.0, 0.0, gap, 0.0, 0.0, 0.0], centres=centres, floor=floor)[0, 0, 0].real
    assert ours == approx(converged_change(PLATE[:2], PLATE[2], 2.25e-3, *JAW, gap, floor=floor), rel=5e-3)


def test_reduced_image_currents_agree_with_all_currents():
    mirror, near_face = Mirror(-0.4e-3), -0.5 * PLATE[2]
    surface = box(PLATE, 15e-6, 0.5e-3, (24, 24, 5))
    poses, result = [[0.3e-3, 0.0, 0.3e-3, 0.05, 0.1, 0.2], [0.0, 0.5e-3, 1e-3, -0.2, 0.0, 0.0]], []
    for points in (8, 11):
        images = image_modes(surface, box(PLATE, 15e-6, 0.5e-3, (points, points, 4)), near_face, 0.2e-3, mirror)
        target = SolvedTarget(surface, near_face, Metal(FREQUENCY, COPPER), mirror, images)
        result.append(change(target, poses, floor=-0.4e-3))
    assert images.currents.shape[2] < 160
    assert result[0] == approx(result[1], abs=5e-4 * np.abs(result[1]).max())


class Unfolded:
    """A surface whose planes of symmetry nobody knows of."""

    mirror_image_numbers = None

    def __init__(self, surface):
        self.points, self.classes = surface.points, surface.classes


@pytest.mark.parametrize(("points", "floor"), [((8, 6, 3), -0.4e-3), ((7, 9, 4), -0.4e-3), ((6, 6, 3), -20e-3)])
def test_symmetric_target_couples_with_image_like_full_model(points, floor):
    """Of a mirror 20 mm below some symmetries feel nothing."""
    mirror, near_face = Mirror(floor), -0.5 * PLATE[2]
    surface, coarse = box(PLATE, 15e-6, 0.5e-3, (16, 16, 4)), box(PLATE, 15e-6, 0.5e-3, points)
    folded, whole = (image_modes(surface, item, near_face, 0.2e-3, mirror) for item in (coarse, Unfolded(coarse)))
    assert folded.folding is not None and whole.folding is None
    for angles in ([0.0, 0.0, 0.0], [0.0, 0.0, 0.4], [0.1, -0.05, 0.2]):
        turn, place = rotation_matrices(np.array([angles]))[0], np.array([0.1e-3, 0.2e-3, 0.3e-3])
        ours, theirs = (np.linalg.eigvalsh(item.coupling(turn, place, mirror)) for item in (folded, whole))
        assert ours == approx(theirs, abs=1e-9)
    counts = [count for _, count in folded.parities]
    assert sum(counts) == folded.currents.shape[2] and (0 in counts) == (floor < -10e-3)


def spiral(z, sense, inward, outer=4e-3, width=80e-6, pitch=160e-6, turns=7.25):
    angle = np.linspace(0.0, 2.0 * math.pi * turns, int(60 * turns) + 1)
    radius = (outer - width) / 2 - pitch * angle / (2.0 * math.pi)
    corners = np.stack([radius * np.cos(0.3 + sense * angle), radius * np.sin(0.3 + sense * angle)], axis=1)
    return PolylineTrack(corners if inward else corners[::-1], width, 35e-6, z)


LAYERS = [spiral(-15e-6, 1, True), spiral(-64e-6, -1, False), spiral(-142e-6, 1, True), spiral(-191e-6, -1, False)]


def filaments(tracks, points, floor, roof=math.inf):
    """The potential of straight filaments in closed form, with their images in perfect mirrors."""
    images = [(1.0, 0.0), (-1.0, 2.0 * floor), (-1.0, 2.0 * roof)]
    if math.isfinite(floor) and math.isfinite(roof):
        apart = 2.0 * (roof - floor)
        images += [(1.0, sign * n * apart) for n in range(1, 13) for sign in (1, -1)]
        images += [(-1.0, 2.0 * floor - n * apart) for n in range(1, 13)]
        images += [(-1.0, 2.0 * roof + n * apart) for n in range(1, 13)]
    result = np.zeros(len(points), dtype=complex)
    for track in tracks:
        for offset in (-0.5 / math.sqrt(3.0), 0.5 / math.sqrt(3.0)):
            corners = track.strand(offset * track.width)
            a, b = corners[:-1], corners[1:]
            length = np.hypot(*(b - a).T)
            for way, shift in images:
                z, sign = way * track.z + shift, 0.5 * way
                if math.isfinite(z):
                    from_a, from_b = (np.sqrt(((points[:, None, :2] - p) ** 2).sum(-1) + (points[:, 2, None] - z) ** 2)
                                      for p in (a, b))
                    along = np.log((from_a + from_b + length) / (from_a + from_b - length)) / length
                    result += sign * along @ ((b - a) @ np.array([1.0, 1j]))
    return MU0 / (4.0 * math.pi) * result


@pytest.mark.parametrize("floor", [-math.inf, -0.6e-3, -20e-3])
@pytest.mark.parametrize("height", [0.16e-3, 0.3e-3, 0.9e-3, 2.5e-3])
def test_tabulated_coil_potential_agrees_with_filaments(floor, height):
    # A constant potential drives nothing, so it may differ by one.
    table = coil_potentials(LAYERS, 0.15e-3, 4e-3, None if math.isinf(floor) else Plane(floor))[0]
    generator = np.random.default_rng(1)
    points = np.column_stack([generator.uniform(-4.5e-3, 4.5e-3, (400, 2)), np.full(400, height - 15e-6)])
    exact = filaments(LAYERS, points, floor)
    apart = table(points) - exact
    assert np.abs(apart - apart.mean()).max() < 1e-3 * np.abs(exact).max()


@pytest.mark.parametrize("planes", [(-math.inf, 1.1e-3), (-0.6e-3, 1.1e-3), (-0.6e-3, 9e-3)])
@pytest.mark.parametrize("height", [0.16e-3, 0.9e-3])
def test_coil_potential_between_mirrors_agrees_with_images(planes, height):
    floor, roof = planes
    table = coil_potentials(LAYERS, 0.15e-3, 4e-3, None if math.isinf(floor) else Plane(floor), Plane(roof))[0]
    generator = np.random.default_rng(2)
    points = np.column_stack([generator.uniform(-4.5e-3, 4.5e-3, (12, 2)), np.full(12, height - 15e-6)])
    exact = filaments(LAYERS, points, floor, roof)
    apart = table(points) - exact
    # at a mirror the field all but vanishes, so what it is without one is the measure
    assert np.abs(apart - apart.mean()).max() < 1e-3 * np.abs(filaments(LAYERS, points, floor)).max()


@pytest.mark.parametrize("planes", [(-60e-3, None), (-0.6e-3, 20e-3)])
def test_distant_mirror_leaves_coil_potential_unchanged(planes):
    """The field of far images, which the grid repeats, is taken off it again."""
    floor, roof = planes
    generator = np.random.default_rng(3)
    points = np.column_stack([generator.uniform(-4e-3, 4e-3, (60, 2)), np.full(60, 0.6e-3)])
    near = None if roof is None else Plane(floor)
    without = coil_potentials(LAYERS, 0.15e-3, 4e-3, near)[0](points)
    far = coil_potentials(LAYERS, 0.15e-3, 4e-3, Plane(floor), None if roof is None else Plane(roof))[0](points)
    apart = far - without
    assert np.abs(apart - apart.mean()).max() < 1e-4 * np.abs(without).max()


def in_front(z, strength=1.0 + 0.0j):
    return Roof(((z, strength),), (z, strength.real))


def test_mirror_above_and_below_at_equal_distance_couple_equally():
    """Turned upside down, one is the other."""
    surface, coarse = box(PLATE, 15e-6, 0.5e-3, (16, 16, 4)), box(PLATE, 15e-6, 0.5e-3, (8, 6, 3))
    near_face, place = -0.5 * PLATE[2], np.array([0.0, 0.0, 0.3e-3])
    floor, roof = Mirror(-0.4e-3), Mirror(-math.inf, 0.0, in_front(0.3e-3 + PLATE[2] + 0.7e-3))
    sizes = [np.linalg.eigvalsh(image_modes(surface, coarse, near_face, 0.3e-3, item).coupling(np.eye(3), place, item))
             for item in (floor, roof)]
    most = np.abs(sizes[0]).max()
    stored = min(map(len, sizes))
    largest = [np.sort(np.abs(size))[::-1][: stored // 2] for size in sizes]
    assert largest[0] == approx(largest[1], abs=1e-6 * most)


def test_change_of_target_between_metals_is_reciprocal():
    near_face, gap = -0.5 * PLATE[2], 0.5e-3
    mirror = Mirror(-0.8e-3, 1.0, in_front(gap + PLATE[2] + 0.4e-3, 0.9 - 0.2j))
    surface, coarse = box(PLATE, 15e-6, 0.5e-3, (16, 16, 4)), box(PLATE, 15e-6, 0.5e-3, (8, 8, 3))
    images = image_modes(surface, coarse, near_face, gap, mirror)
    target = SolvedTarget(surface, near_face, Metal(FREQUENCY, COPPER), mirror, images)
    result = change(target, [0.3e-3, 0.0, gap, 0.0, 0.0, 0.0], floor=-0.8e-3)[0]
    assert result == approx(result.T, abs=1e-12 * np.abs(result).max())
    alone = SolvedTarget(surface, near_face, Metal(FREQUENCY, COPPER))
    assert abs(result[0, 0] / change(alone, [0.3e-3, 0.0, gap, 0.0, 0.0, 0.0], floor=-0.8e-3)[0][0, 0] - 1.0) > 0.02
