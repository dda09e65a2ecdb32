"""The pad's law against finite elements, and against what every law of a pad must do."""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from tolerance import approx

from sitscad.estimates.loads.pad import TILT_SIGMAS, tilt_stiffness_error
from sitscad.kernels.mechanics.elastomer import Face, Surround, even_rim
from sitscad.kernels.mechanics.motion import (
    _rotation_coefficients,
    angles,
    cross_matrices,
    rotation_vectors,
    rotations,
    rotations_of_vectors,
)
from sitscad.kernels.mechanics.pad import BondedPad
from sitscad.kernels.mechanics.pad_law import (
    FILM_SIGMA,
    NEO_HOOKEAN,
    Block,
    compression_modulus,
    force_sigma,
    pressure_stiffness,
)

FIGURES = Path(__file__).parents[1] / "validation" / "pad_figures.csv"
SQUARE = BondedPad(Face(4e-3, 4e-3), 2e-3, 50e3, 1.5e9, height=0.3e-3)
OBLONG = BondedPad(Face(6e-3, 4e-3), 2e-3, 50e3, 1.5e9, Surround(0.4e-3), 0.2e-3)
WIDTH = st.floats(1.0, 8.0)


def left_jacobians(vectors):
    """(n, 3, 3): what turn, in board axes, follows from a small change of a rotation vector (n, 3; rad)."""
    _, second, third = _rotation_coefficients(vectors)
    turning = cross_matrices(vectors)
    return np.eye(3) + second[:, None, None] * turning + third[:, None, None] * (turning @ turning)


def figures():
    with FIGURES.open(encoding="utf-8") as lines:
        rows = [{name: float(value) for name, value in row.items()}
                for row in csv.DictReader(line for line in lines if not line.startswith("#"))]
    pads = ("along", "across", "round", "rim", "skin", "skin_modulus")
    for measures, of_pad in groupby(rows, key=lambda row: tuple(row[name] for name in pads)):
        along, across, is_round, rim, skin, skin_modulus = measures
        face = Face(along, across, is_round)
        yield BondedPad(face, 1.0, 1.0, 1e4, Surround(rim, skin, skin_modulus if skin else 0.0)), list(of_pad)


def errors(pad, rows):
    """Error of the force over the force, and of the moment over force times half of the length."""
    poses = np.array([[row["x"], 0.0, row["z"], 0.0, row["ry"], 0.0] for row in rows])
    held, given_force = pad.force(poses), np.array([[row["force_x"], row["force_z"]] for row in rows])
    size = np.hypot(*given_force.T)
    moved = size > 0.0
    off = np.hypot(*(held[:, [0, 2]] - given_force).T)[moved] / size[moved]
    turned = np.abs(held[:, 4] - [row["moment_y"] for row in rows])[moved] / size[moved]
    return off, turned / (0.5 * pad.face.width_x)


@pytest.mark.parametrize(("kind", "rms", "most"), [("bare", 0.03, 0.09), ("rim", 0.03, 0.05), ("film", 0.035, 0.17)])
def test_pad_forces_agree_with_finite_elements(kind, rms, most):
    """Within 5 % but for a few of the flattest, the hardest sheared and the stiffest films."""
    result = [errors(pad, rows) for pad, rows in figures()
             if kind == ("film" if pad.surround.film else "rim" if pad.surround.rim else "bare")]
    force, moment = (np.concatenate(part) for part in zip(*result, strict=True))
    assert len(force) >= 20
    assert math.sqrt(np.mean(force**2)) < rms
    assert force.max() < most
    assert np.quantile(moment, 0.95) < 0.04
    assert np.quantile(force, 0.95) < (0.07 if kind == "film" else 0.051)
    if kind == "film":  # pressed, of what is built: up to a fifth of the thickness, faces of two thicknesses and more
        usual = [off[k] for pad, rows in figures() if 0.05 <= pad.surround.film <= 0.2 and pad.face.width_x >= 2.0
                 for off in [errors(pad, rows)[0]]
                 for k, row in enumerate(r for r in rows if r["x"] or r["z"]) if row["z"] < 0.0]
        assert len(usual) > 100 and np.quantile(usual, 0.95) < 0.05


def test_pad_forces_agree_with_fourth_degree_elements():
    """Of fourth degree: within 5 %, rest stiffness within 1.5 %."""
    for pad, rows in figures():
        fine = [row for row in rows if row["degree"] == 4]
        if fine:
            assert errors(pad, fine)[0].max(initial=0.0) < 0.05
            rest = next(row for row in fine if not any((row["x"], row["z"], row["ry"])))
            stiffness = pad.stiffness(np.zeros((1, 6)))[0]
            assert stiffness[2, 2] == approx(rest["k_zz"], rel=0.015)
            assert stiffness[0, 0] == approx(rest["k_xx"], rel=0.015)
            assert stiffness[4, 4] == approx(rest["k_rr"], rel=0.025)


def test_pad_force_stated_error_holds():
    """Two sigma enclose 95 % of all forces."""
    outside = [off > 2.0 * pad.sigma for pad, rows in figures() for off in errors(pad, rows)[0]]
    assert np.mean(outside) < 0.08
    assert BondedPad(Face(4e-3, 4e-3), 2e-3, 15e3, surround=Surround(0.0, 0.1e-3, 660e3)).sigma > 0.5 * FILM_SIGMA


@pytest.mark.parametrize(("least", "most"), [(0.2, 0.55), (0.6, 0.8), (0.9, 1.1), (1.4, 2.0)])
def test_stated_error_covers_pads_of_each_shape_factor(least, most):
    there = [(pad.sigma, errors(pad, rows)[0]) for pad, rows in figures()
             if not pad.surround.film and not pad.surround.rim and least < pad.block.shape_factor < most]
    off = np.concatenate([of_pad for _, of_pad in there])
    stated = np.concatenate([np.full_like(of_pad, sigma) for sigma, of_pad in there])
    assert len(off) >= 8
    assert math.sqrt(np.mean(off**2)) < math.sqrt(np.mean(stated**2))


PLAIN = Block(4.0, 4.0, exponent=3.3)


@pytest.mark.parametrize(("least", "most", "block"), [
    (0.8, 24.0, lambda width: replace(PLAIN, along=width, across=width)),
    (0.8, 24.0, lambda width: Block(width, width)),
    (2.0, 16.0, lambda along: Block(along, 2.0)),
    (0.0, 2.0, lambda rim: replace(PLAIN, rim=rim)),
    (0.0, 0.5, lambda skin: replace(PLAIN, skin=skin, skin_modulus=10.0)),
    (1.5, 4.0, lambda exponent: replace(PLAIN, exponent=exponent)),
])
def test_pad_force_stated_error_is_continuous(least, most, block):
    """A parameter that is swept finely changes it by little: twenty times finer by a twentieth, and never at once."""
    changes = []
    for count in (1000, 20000):
        stated = np.array([force_sigma(block(value)) for value in np.linspace(least, most, count)])
        changes.append(np.abs(np.diff(stated)).max())
    assert changes[1] < 0.1 * changes[0]


def test_effective_rim_is_continuous_in_pad_size():
    """Of a target off the middle of a pad: from all rims narrower than the thickness to all of them wider."""
    changes = []
    for count in (1000, 20000):
        rims = [even_rim(Face(width, width + 2.5), Face(4.0, 4.0), (0.1, 0.0), 1.0)
                for width in np.linspace(6.01, 9.0, count)]
        assert None not in rims
        changes.append(np.abs(np.diff(np.array(rims, dtype=float))).max())
    assert changes[1] < 0.1 * changes[0]
    assert even_rim(Face(10.0, 8.0), Face(4.0, 4.0), (0.1, 0.0), 1.0) == approx(2.5, rel=1e-6)


def test_compression_lowers_shear_stiffness_and_more_with_free_target():
    """A third less shear stiffness at 25 %, and several times less where the target may tilt."""
    rest, pressed = SQUARE.stiffness(np.array([np.zeros(6), [0, 0, -0.5e-3, 0, 0, 0]]))
    assert 0.55 < pressed[0, 0] / rest[0, 0] < 0.68
    weight = float(SQUARE.pressure(np.array([0.25]))[0])
    loads = np.array([[0.0, 0.001, 0.0], [weight, 0.001, 0.0]])
    level = replace(SQUARE, height=0.0)
    free, held = level.pose(loads)[:, 0], level.pose(loads, is_held=True)[:, 0]
    assert free[0] / held[0] < 1.5
    assert 2.5 < free[1] / free[0] < 8.0
    assert free[1] > 2.0 * held[1]


@given(st.floats(0.0, 1.2), st.floats(-0.05, 0.05), st.floats(-0.05, 0.05), st.booleans())
def test_pad_pose_inverts_force(normal, shear_x, shear_y, is_held):
    pose = OBLONG.pose(np.array([[normal, shear_x, shear_y]]), is_held)
    held = OBLONG.force(pose)[0]
    assert held[:3] == approx([shear_x, shear_y, -normal], abs=1e-8, rel=1e-7)
    if not is_held:
        lever = OBLONG.height * rotations(pose[:, 3:])[0, :, 2]
        assert held[3:] == approx(np.cross(lever, held[:3]), abs=1e-9)


def test_shear_force_above_pad_lowers_far_end_of_target():
    pushed = SQUARE.pose(np.array([[0.3, 0.05, 0.0], [0.3, 0.0, 0.05]]))
    assert pushed[0, 0] > 0.0 and pushed[0, 4] > 0.0
    assert pushed[1, 1] > 0.0 and pushed[1, 3] < 0.0
    assert pushed[0, 2] == approx(pushed[1, 2], rel=1e-9)


def test_pad_forces_do_no_work_on_closed_path():
    """Force and moment have an energy: their work along a way that closes is nothing."""
    t = np.linspace(0.0, 2.0 * math.pi, 2001)
    way = np.column_stack([3e-4 * np.sin(t), 2e-4 * np.cos(t), -3e-4 + 2e-4 * np.sin(t + 1.0), 0.05 * np.cos(t),
                           0.04 * np.sin(2.0 * t), 0.06 * np.sin(t)])
    held, turned = OBLONG.force(way), rotations(way[:, 3:])
    middle = 0.5 * (held[1:] + held[:-1])
    spin = rotation_vectors(turned[1:] @ np.swapaxes(turned[:-1], 1, 2))
    work = np.sum(middle[:, :3] * np.diff(way[:, :3], axis=0), axis=1) + np.sum(middle[:, 3:] * spin, axis=1)
    assert abs(work.sum()) < 1e-5 * np.abs(work).sum()


def test_pad_and_load_rotated_by_90_degrees_give_rotated_pose():
    across = BondedPad(Face(4e-3, 6e-3), 2e-3, 50e3, 1.5e9, Surround(0.4e-3), 0.2e-3)
    item = OBLONG.pose(np.array([[0.5, 0.04, 0.0]]))[0]
    other = across.pose(np.array([[0.5, 0.0, 0.04]]))[0]
    assert other[[1, 2, 3]] == approx([item[0], item[2], -item[4]], rel=1e-6)


@given(WIDTH, WIDTH, st.floats(0.0, 0.99), st.sampled_from([0.0, 1.0]))
def test_pad_force_rises_with_strain_and_is_invertible(along, across, strain, is_round):
    pad = BondedPad(Face(along, across, is_round), 1.0, 1.0, 1e4)
    force = pad.pressure(np.array([strain, strain + 0.005]))
    assert force[0] < force[1]
    assert pad.strain(force)[0] == approx(strain, abs=1e-9)


def test_pad_stiffness_has_known_limits():
    disc = Block(6.0, 6.0, 1.0)
    assert pressure_stiffness(disc) == approx(1.5 * 3.0**2, rel=1e-6)
    assert pressure_stiffness(Block(1e4, 2.0)) == approx(4.0, rel=1e-3)  # an endless strip: (width / h)^2
    assert compression_modulus(Block(0.01, 0.01)) == approx(3.0, rel=0.01)  # a bar
    bulky = BondedPad(Face(1.0, 1.0), 1e-3, 1.0, 50.0)
    assert bulky.pressure(np.array([1e-4]))[0] / 1e-4 == approx(50.0, rel=0.01)


@given(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4), st.floats(-1.5, 1.5))
def test_rotation_vectors_and_jacobians_agree_with_matrices(rx, ry, rz):
    turned = rotations(np.array([[rx, ry, rz]]))
    vector = rotation_vectors(turned)
    assert angles(turned)[0] == approx([rx, ry, rz], abs=1e-12)
    assert rotations_of_vectors(vector)[0] == approx(turned[0], abs=1e-9)
    small = np.array([[1e-6, -2e-6, 1.5e-6]])
    spin = rotation_vectors(rotations_of_vectors(vector + small) @ np.swapaxes(turned, 1, 2))[0]
    assert spin == approx(left_jacobians(vector)[0] @ small[0], abs=1e-10)


def test_unstable_load_gives_nan_and_invalid_pad_raises():
    soft = BondedPad(Face(2e-3, 2e-3), 2e-3, 15e3, height=1e-3)
    assert np.isnan(soft.pose(np.array([[0.2, 0.05, 0.0]]))).all()
    assert np.isnan(SQUARE.force(np.array([[0.0, 0.0, -2.1e-3, 0.0, 0.0, 0.0]]))).all()
    for loads in ([[1.0, math.nan, 0.0]], [[1.0, 0.0]], [1.0, 0.0, 0.0]):
        with pytest.raises(ValueError):
            SQUARE.pose(np.array(loads))
    for wrong in ({"surround": Surround(-1.0)}, {"surround": Surround(film=-1.0)}, {"height": -1.0}):
        with pytest.raises(ValueError):
            BondedPad(Face(1.0, 1.0), 1.0, 1.0, **wrong).force(np.zeros((1, 6)))
    with pytest.raises(ValueError):
        _ = BondedPad(Face(1.0, 1.0), 0.0, 1.0).block


@pytest.mark.parametrize("modulus", [0.2, 1.0])
def test_soft_film_acts_as_wider_pad(modulus):
    """Of the pad's own rubber as much as the wider pad adds, of a softer one in proportion."""
    bare, wide = BondedPad(Face(4.0, 4.0), 2.0, 1.0), BondedPad(Face(4.4, 4.4), 2.0, 1.0)
    skinned = replace(bare, surround=Surround(0.0, 0.2, modulus))
    pose = np.array([[0.0, 0.0, -0.3, 0.0, 0.0, 0.0], [0.0, 0.0, -0.1, 0.0, 0.0, 0.0]])
    item, none, all_of_it = (pad.force(pose)[:, 2] for pad in (skinned, bare, wide))
    assert (item - none) / (all_of_it - none) == approx(modulus * np.ones(2), abs=0.25 * modulus)


@example(skin=0.5, modulus=1.0, along=1.0, strain=1.175494351e-38)  # right at the first try: half of it was taken
@given(st.floats(0.02, 0.5), st.floats(0.1, 45.0), WIDTH, st.floats(0.0, 0.9))
def test_pad_force_rises_with_strain_under_any_film(skin, modulus, along, strain):
    pad = BondedPad(Face(along, along), 1.0, 1.0, 1e4, Surround(0.0, skin, modulus))
    force = pad.pressure(np.array([strain, strain + 0.01]))
    assert force[0] < force[1]
    assert pad.pressure(pad.strain(force)) == approx(force, rel=1e-9, abs=1e-300)  # denormal numbers have no 1e-9


@pytest.mark.parametrize("name", ["thickness", "width", "modulus", "film", "film_modulus", "rim"])
def test_pad_pose_is_continuous_in_every_dimension(name):
    """500 steps over a factor of four and more: no step of the force is five times its neighbours' mean."""
    factor = np.geomspace(0.5, 2.0, 500)

    def pad(f):
        made = {"thickness": 2e-3, "modulus": 50e3, "film": 0.1e-3, "film_modulus": 300e3, "rim": 0.4e-3, "width": 5e-3}
        made[name] *= f
        return BondedPad(Face(made["width"], 4e-3), made["thickness"], made["modulus"], 1.5e9,
                         Surround(made["rim"], made["film"], made["film_modulus"]))

    poses = np.array([[0.2e-3, 0.1e-3, -0.25e-3, 0.01, 0.03, 0.02]])
    held = np.array([pad(f).force(poses)[0] for f in factor])
    for column in held.T:
        step = np.abs(np.diff(column))
        usual = np.convolve(step, np.ones(9) / 9.0, "same") + 1e-5 * np.abs(column).max()
        assert (step / usual).max() < 5.0


def test_small_loads_superpose():
    loads = 1e-5 * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    single, together = SQUARE.pose(loads), SQUARE.pose(loads.sum(axis=0, keepdims=True))[0]
    assert single.sum(axis=0) == approx(together, rel=2e-3, abs=1e-9)


@pytest.mark.slow
@given(st.floats(-3e-4, 3e-4), st.floats(-3e-4, 3e-4), st.floats(-6e-4, 1e-4), st.floats(-0.08, 0.08),
       st.floats(-0.08, 0.08))
def test_pad_forces_derive_from_energy(x, y, z, rx, ry):
    """Without twist the stiffness in the turned frame is symmetric where no moment acts; the work round a small square
    is nothing in any two of the numbers, up to what the square's size leaves.
    """
    here, size = np.array([x, y, z, rx, ry, 0.0]), np.array([1e-6, 1e-6, 1e-6, 5e-4, 5e-4, 5e-4])
    for i in range(6):
        for j in range(i):
            steps = np.diag(size)[[i, j]]
            corners = np.array([here, here + steps[0], here + steps[0] + steps[1], here + steps[1], here])
            held, turned = OBLONG.force(corners), rotations(corners[:, 3:])
            middle = 0.5 * (held[1:] + held[:-1])
            spin = rotation_vectors(turned[1:] @ np.swapaxes(turned[:-1], 1, 2))
            way = np.concatenate([np.diff(corners[:, :3], axis=0), spin], axis=1)
            work = np.sum(middle * way, axis=1)
            assert abs(work.sum()) < 2e-3 * np.abs(work).max() + 1e-13


@pytest.mark.parametrize("pad", [SQUARE, OBLONG, replace(OBLONG, surround=Surround(0.4e-3, 0.2e-3, 600e3),
                                                         exponent=3.2)])
@pytest.mark.parametrize("turned", [0.1, 1.2])
def test_equilibrium_residual_matches_force_and_its_derivative(pad, turned):
    """Of a level, a tilted and a far turned target, with a moment: by virtual work, and by differences."""
    rng = np.random.default_rng(8)
    there = np.concatenate([[0.2, -0.1, 0.8], turned * rng.uniform(-1.0, 1.0, 3)])
    wanted, point = rng.uniform(-0.3, 0.3, (1, 6)), rng.uniform(-0.2, 0.4, (1, 3))
    lack, slope = pad._gradients_and_hessians(there[None], wanted, point)
    frame, turn = (rotations_of_vectors(part * there[None, 3:])[0] for part in (pad._share, 1.0))
    h, whole = pad.thickness, pad.shear_modulus * pad.face.area
    pose = np.concatenate([h * (frame @ there[:3] - [0.0, 0.0, 1.0]), angles(turn[None])[0]])
    given_force, given_moment = np.split(pad.force(pose)[0] / (3 * [whole] + 3 * [whole * h]) - wanted[0], 2)
    given_moment -= np.cross(turn @ point[0], wanted[0, :3])
    assert lack[0, :3] == approx(frame.T @ given_force, abs=1e-9)
    # the place in the frame stays where it is: in board axes it goes with the frame
    moved = pad._share * np.cross(left_jacobians(pad._share * there[None, 3:])[0].T, frame @ there[:3])
    assert lack[0, 3:] == approx(moved @ given_force + left_jacobians(there[None, 3:])[0].T @ given_moment,
                                        abs=1e-9)
    small = 1e-6 * np.eye(6)
    many = np.repeat(wanted, 12, axis=0), np.repeat(point, 12, axis=0)
    forth, back = np.split(pad._gradients_and_hessians(np.concatenate([there + small, there - small]), *many)[0], 2)
    assert slope[0] == approx(((forth - back) / 2e-6).T, rel=1e-6, abs=2e-6)


def test_single_load_gives_pose_equal_to_batch():
    """Single loads are worked out in floats, many of them in arrays."""
    spread = np.array([0.03, 0.03, 0.15, 1e-5, 1e-5, 1e-5])
    wrenches = np.random.default_rng(4).uniform(-1.0, 1.0, (30, 6)) * spread - [0, 0, 0.2, 0, 0, 0]
    for pad in (SQUARE, OBLONG):
        together = pad.pose(wrenches)
        assert not np.isnan(together).any()
        assert np.concatenate([pad.pose(item[None]) for item in wrenches]) == approx(together, abs=2e-9)


def test_modified_pose_array_does_not_change_cached_poses():
    loads = np.array([[1.0, 0.1, 0.2]])
    first = SQUARE.pose(loads)
    known = first.copy()
    first[:] = 0.0
    assert np.array_equal(SQUARE.pose(loads), known)
    assert not np.array_equal(SQUARE.pose(loads, is_held=True), known)
    assert not np.array_equal(SQUARE.pose(loads, at=np.array([[1e-4, 0.0]])), known)


@pytest.mark.parametrize(("kind", "count"), [("bare", 90), ("film", 100)])
def test_free_tilt_stiffness_is_within_stated_error(kind, count):
    """Of level pads: one sigma holds (root mean square), and twice that nearly always; a press takes stiffness away."""
    result = []
    for pad, rows in figures():
        if kind != ("film" if pad.surround.film else "bare"):
            continue
        for row in rows:
            strain = -row["z"]
            if row["ry"] or row["x"] or strain > TILT_SIGMAS[-1][0]:
                continue
            pose = np.array([0.0, 0.0, -strain, 0.0, 0.0, 0.0])
            # by elements, about the near face's middle: x, z and the turn find their balance
            given = np.array([[row["k_xx"], row["k_xz"], row["k_xr"]], [row["k_xz"], row["k_zz"], row["k_zr"]],
                              [row["k_xr"], row["k_zr"], row["k_rr"]]])
            ours = pad.stiffness(pose[None])[0][np.ix_([0, 2, 4], [0, 2, 4])]
            true, law = (1.0 / np.linalg.inv(each)[2, 2] for each in (given, ours))
            stated = tilt_stiffness_error(pad, pose, np.array([law, law]))[1] * abs(law)
            result.append((law - true) / stated)
    assert len(result) >= count
    assert np.sqrt(np.mean(np.square(result))) < 1.0
    assert np.quantile(np.abs(result), 0.95) < 2.0


def test_warm_pad_lifts_its_target_as_finite_elements_do():
    """At rest within 1.5 %; up to 20 % strain within 4 % of this, and 10 % with an exponent of 3.25."""
    with (FIGURES.parent / "warm_pads.csv").open(encoding="utf-8") as lines:
        rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(lines)]
    growth, checked = 0.004, 0
    for row in rows:
        face = Face(row["along"], row["across"], row["round"])
        cold = BondedPad(face, 1.0, 1.0, 1e4, exponent=row["exponent"])
        warm, load = cold.expanded(growth), np.array([[row["pressure"] * face.area, 0.0, 0.0]])
        at_rest = (warm.thickness - 1.0) / growth
        lift = at_rest + (warm.pose(load, is_held=True) - cold.pose(load, is_held=True))[0, 2] / growth
        most = 0.015 if row["pressure"] == 0.0 else 0.04 if row["exponent"] == NEO_HOOKEAN else 0.10
        if cold.strain(load[0, :1])[0] < 0.21:
            assert abs(lift - row["lift"]) < most * at_rest, row
            checked += 1
    assert checked >= 20


def test_tall_bar_expands_as_free_rubber():
    """Between small plates nothing hinders it; between wide plates all of the volume goes into the thickness."""
    bar, sheet = (BondedPad(Face(width, width), 1.0, 1.0, 1e9).expanded(1e-6) for width in (0.05, 50.0))
    assert bar.thickness - 1.0 == approx(1e-6, rel=0.05)
    assert sheet.thickness - 1.0 == approx(3e-6, rel=0.02)
