"""The elastomer's finite-element mesh, read by a reader of its own: groups, areas, volume, and no inverted element."""

from __future__ import annotations

import os
import re
import signal
import subprocess
from dataclasses import replace
from pathlib import Path

import handmade
import numpy as np
import pytest
from tolerance import approx

import sitscad
from sitscad.assembly.places.bodies import BodyRole
from sitscad.estimates.loads.pad import soft_pad
from sitscad.estimates.loads.pressing import web_stiffness
from sitscad.files.formats import volume_mesh
from sitscad.kernels.mechanics.elastomer import Face, Surround
from sitscad.kernels.mechanics.pad import BondedPad
from sitscad.spec import templates
from tests.hardware.conftest import TEMPLATES

pytestmark = pytest.mark.cad


class Msh:
    """What an MSH 2.2 file says: nodes (n, 3), and by physical name its triangles or tetrahedra as node indices."""

    def __init__(self, data: bytes) -> None:
        lines = data.decode("ascii").splitlines()
        assert lines[lines.index("$MeshFormat") + 1] == "2.2 0 8"
        names = {tuple(map(int, row.split()[:2])): row.split('"')[1] for row in self._block(lines, "PhysicalNames")}
        nodes = [row.split() for row in self._block(lines, "Nodes")]
        index = {int(row[0]): position for position, row in enumerate(nodes)}
        self.nodes = np.array([[float(value) for value in row[1:]] for row in nodes])
        self.groups: dict[str, list] = {name: [] for name in names.values()}
        for row in self._block(lines, "Elements"):
            _, kind, tags, *rest = map(int, row.split())
            dimension = {2: 2, 4: 3}[kind]
            self.groups[names[dimension, rest[0]]].append([index[node] for node in rest[tags:]])

    @staticmethod
    def _block(lines: list[str], name: str) -> list[str]:
        start = lines.index(f"${name}")
        return lines[start + 2 : start + 2 + int(lines[start + 1])]

    def area(self, name: str) -> float:
        a, b, c = (self.nodes[np.array(self.groups[name])[:, i]] for i in range(3))
        return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)

    def heights(self, name: str) -> tuple[float, float]:
        z = self.nodes[np.unique(np.array(self.groups[name]))][:, 2]
        return float(z.min()), float(z.max())

    def volumes(self) -> np.ndarray:
        a, b, c, d = (self.nodes[np.array(self.groups["elastomer"])[:, i]] for i in range(4))
        return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6


def pad_of(sensor: str):
    return handmade.layout(sensor).spec.elastomer


def mesh(sensor: str) -> Msh:
    files = volume_mesh.render(handmade.solids(sensor), handmade.layout(sensor).spec)
    (data,) = (content for name, content in files.items() if name.endswith(".msh"))
    return Msh(data)


@pytest.mark.slow
def test_square_pad_mesh_is_in_metres_with_bonded_and_free_faces():
    result = mesh("jaw")
    assert set(result.groups) == {"bonded_bottom", "bonded_top", "free", "elastomer"}
    assert result.area("bonded_bottom") == approx(16e-6, rel=1e-9)
    assert result.area("bonded_top") == approx(16e-6, rel=1e-9)
    assert result.area("free") == approx(16e-6, rel=1e-9)
    assert result.heights("bonded_bottom") == (0.0, 0.0)
    assert result.heights("bonded_top") == approx((1e-3, 1e-3), rel=1e-6)
    assert result.volumes().sum() == approx(16e-9, rel=1e-9)
    assert result.volumes().min() > 0.0
    assert 1000 < len(result.groups["elastomer"]) < 50_000


@pytest.mark.slow
def test_pad_overhang_beyond_board_or_target_is_free_face():
    """The bench pad, 8 mm square, stands on a board 7.6 mm wide; the jaw's target reaches over its pad along x only."""
    bench = mesh("bench")
    assert bench.area("bonded_bottom") == approx(8e-3 * 7.6e-3, rel=1e-6)
    assert bench.area("free") == approx(4 * 8e-3 * 2e-3 + 8e-3 * 0.4e-3, rel=1e-6)
    jaw = mesh("overhanging")
    assert jaw.area("bonded_top") == approx(3e-3 * 2.4e-3, rel=1e-6)
    assert jaw.volumes().sum() == approx(9e-9, rel=1e-9)


@pytest.mark.slow
def test_round_pad_under_smaller_target_has_expected_face_areas():
    result = mesh("round")
    assert result.area("bonded_top") == approx(np.pi * 1.5e-3**2, rel=0.02)
    assert result.area("bonded_bottom") == approx(np.pi * 2e-3**2, rel=0.02)
    assert result.volumes().sum() == approx(np.pi * 2e-3**2 * 1e-3, rel=0.02)


def test_finer_pad_mesh_has_more_elements_and_equal_volume():
    solids = handmade.solids("jaw")
    coarse, fine = (Msh(volume_mesh.elastomer_meshes(solids, pad_of("jaw"), size)["msh"]) for size in (0.5e-3, 0.25e-3))
    assert len(fine.groups["elastomer"]) > 3 * len(coarse.groups["elastomer"])
    assert fine.volumes().sum() == approx(coarse.volumes().sum(), rel=1e-9)


def test_gmsh_reads_pad_mesh_and_open_session_is_kept(tmp_path):
    import gmsh

    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add("theirs")
        data = volume_mesh.elastomer_meshes(handmade.solids("jaw"), pad_of("jaw"))["msh"]
        assert gmsh.isInitialized()
        assert "theirs" in gmsh.model.list()
        assert "elastomer" not in gmsh.model.list()
        path = tmp_path / "pad.msh"
        path.write_bytes(data)
        gmsh.open(str(path))
        assert {gmsh.model.getPhysicalName(*group) for group in gmsh.model.getPhysicalGroups()} == {
            "bonded_bottom",
            "bonded_top",
            "free",
            "elastomer",
        }
    finally:
        gmsh.finalize()


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="needs Linux")
def test_meshing_keeps_sigpipe_ignored():
    """Gmsh has SIGPIPE end the process: test processes ended so long after, at the next closed socket."""
    assert volume_mesh.elastomer_meshes(handmade.solids("jaw"), pad_of("jaw"))
    (ignored,) = re.findall(r"SigIgn:\s*(\w+)", Path("/proc/self/status").read_text())
    assert int(ignored, 16) >> (signal.SIGPIPE - 1) & 1


def test_sensor_without_elastomer_has_no_volume_mesh():
    assert volume_mesh.render(handmade.solids("bare"), handmade.layout("bare").spec) == {}


@pytest.mark.slow
def test_second_order_mesh_has_named_faces_and_states_element_quality():
    import json

    from sitscad.files.formats.volume_mesh import elastomer_meshes

    made = elastomer_meshes(handmade.solids("bench"), pad_of("bench"))
    text, worth = made["inp"].decode("ascii"), json.loads(made["json"])
    assert "TYPE=C3D10, ELSET=elastomer" in text and "CPS" not in text
    for kind in (r"SURFACE, NAME=", "NSET, NSET=nodes_"):
        assert set(re.findall(rf"\*{kind}(\w+)", text)) == {"bonded_bottom", "bonded_top", "free"}
    nodes = re.search(r"\*NODE\n(.*?)\n\*", text, re.S)[1].splitlines()
    assert len(nodes) == worth["second_order"]["nodes"] > 4 * worth["first_order"]["nodes"]
    points = np.array([[float(value) for value in line.split(",")[1:]] for line in nodes])
    bounds = next(s for s in handmade.solids("bench") if s.name == "elastomer").shape.bounding_box()
    assert points.max(axis=0) == approx(np.array(tuple(bounds.max)) * 1e-3, abs=1e-9)
    for order in ("first_order", "second_order"):
        assert worth[order]["least_quality"] > 0.3 and worth[order]["share_below_0.1"] == 0.0
    assert elastomer_meshes(handmade.solids("bench"), pad_of("bench"))["inp"] == made["inp"]


@pytest.mark.slow
@pytest.mark.clients("ccx")
@pytest.mark.parametrize(
    ("sensor", "through"), [("jaw", 2), pytest.param("round", 3, marks=[pytest.mark.slow, pytest.mark.more])]
)
def test_calculix_force_of_deck_agrees_with_pad_law(sensor, through, tmp_path):
    """As it is written, no word changed: the force that holds the pressed target, within 10 % with two elements through
    the thickness of a pad that is loaded all over, with three under a smaller target. Coarse elements lock: with four
    it is 6 % there (docs/package.md has the package's own five).
    """
    pad = pad_of(sensor)
    made = volume_mesh.elastomer_meshes(handmade.solids(sensor), pad, pad.thickness / through)
    (tmp_path / "pad.inp").write_bytes(made["inp"])
    alone = {**os.environ, "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        ["ccx", "pad"], cwd=tmp_path, env=alone, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0 and "Job finished" in done.stdout and "*ERROR" not in done.stdout, done.stdout[-2000:]
    totals = re.findall(r"^ +(\S+) +(\S+) +(\S+)$", (tmp_path / "pad.dat").read_text(), re.MULTILINE)
    sideways, force = [abs(float(each)) for each in totals[-1][:2]], -float(totals[-1][2])
    face = Face(*handmade.layout(sensor).spec.target.size, 1.0 if pad.outline.is_round else 0.0)
    rim = 0.5 * (pad.size[0] - face.width_x) if sensor == "round" else 0.0
    law = BondedPad(face, pad.thickness, pad.material.shear_modulus, pad.material.bulk_modulus, Surround(rim),
                    exponent=pad.material.ogden_exponent)
    assert force == approx(float(law.pressure([volume_mesh.STRAIN])[0]), rel=0.1)
    assert max(sideways) < 0.01 * force


def test_deck_has_ogden_constants_of_spec_with_reduced_bulk_modulus():
    """Ogden's constants in Abaqus' convention, D = 2 / K; the more its faces hold the pad, the more K it takes."""
    pad = pad_of("jaw")
    text = volume_mesh.elastomer_meshes(handmade.solids("jaw"), pad, 0.5e-3)["inp"].decode("ascii")
    mu, alpha, compliance = map(float, re.search(r"\*HYPERELASTIC, OGDEN, N=1\n(.*)", text)[1].split(","))
    assert (mu, alpha) == approx((pad.material.shear_modulus, pad.material.ogden_exponent), rel=1e-8)
    assert 2.0 / compliance == approx(volume_mesh.bulk_ratio(pad) * mu, rel=1e-8)
    assert f"D = {2.0 / pad.material.bulk_modulus:.6g}" in text and "C3D10H" in text
    thin = replace(pad, thickness=pad.thickness / 3)
    assert volume_mesh.bulk_ratio(thin) > 4 * volume_mesh.bulk_ratio(pad)
    firm = replace(pad, material=replace(pad.material, bulk_modulus=2 * mu))
    assert volume_mesh.bulk_ratio(firm) == approx(2.0, rel=1e-12)


def test_deck_of_webbed_cell_states_that_webs_are_omitted():
    """It was taken for all of the elastomer; the file for the laser has the webs."""
    text = (TEMPLATES / "skin_strip_6.yaml").read_text(encoding="utf-8").replace("cells:\n", "cells:\n  web: 2 mm\n")
    spec = sitscad.load_text(text)
    deck = volume_mesh.pad_mesh(sitscad.lay_out(spec), 1.5e-3)["inp"].decode("ascii")
    end, middle = (f"{100.0 * (web_stiffness(spec)[k] - 1.0):.2g}" for k in (0, 2))
    assert "** This is the pad of ONE cell of 6, WITHOUT the webs" in deck and f"by {end} to {middle} %" in deck


@pytest.mark.parametrize("name", ["round_button_12mm", "grasper_4layer", "bench_7mm"])
def test_deck_states_stiffening_by_omitted_film(name):
    """The pad of a button is 9.5 % stiffer with the film that its deck left out without a word."""
    spec = sitscad.load_text(templates.read(name), "t.yaml")
    message = volume_mesh._left_out(spec)
    assert ("NOT in this deck" in message) == (spec.encapsulation is not None)
    if spec.encapsulation is not None:
        (held,) = re.findall(r"needs ([0-9.]+) % more force", message)
        depth = np.array([[0.0, 0.0, -volume_mesh.STRAIN * spec.elastomer.thickness, 0.0, 0.0, 0.0]])
        forces = [soft_pad(each).force(depth)[0, 2] for each in (spec, replace(spec, encapsulation=None))]
        assert float(held) == approx(100.0 * (forces[0] / forces[1] - 1.0), rel=0.05)


@pytest.mark.slow
@pytest.mark.more
@pytest.mark.clients("ccx")
def test_calculix_completes_deck_of_round_button_with_expected_force(tmp_path):
    """The second of two increments diverged, for all its iterations."""
    spec = sitscad.load_text(templates.read("round_button_12mm"), "t.yaml")
    made = volume_mesh.pad_mesh(sitscad.lay_out(spec))
    (tmp_path / "pad.inp").write_bytes(made["inp"])
    alone = {**os.environ, "OMP_NUM_THREADS": "1"}
    done = subprocess.run(["ccx", "pad"], cwd=tmp_path, env=alone, capture_output=True, text=True, timeout=3600,
                          check=False)
    assert done.returncode == 0 and "Job finished" in done.stdout, done.stdout[-2000:]
    totals = re.findall(r"^ +(\S+) +(\S+) +(\S+)$", (tmp_path / "pad.dat").read_text(), re.MULTILINE)
    law = soft_pad(replace(spec, encapsulation=None))
    assert -float(totals[-1][2]) == approx(float(law.pressure(np.array([volume_mesh.STRAIN]))[0]), rel=0.1)


@pytest.mark.slow
def test_deck_surfaces_and_node_sets_match_their_faces():
    """The faces S1 to S4 by their corners, and their area: CalculiX takes another face without a word."""
    sensor = "bench"
    text = volume_mesh.elastomer_meshes(handmade.solids(sensor), pad_of(sensor), 1e-3)["inp"].decode("ascii")

    def rows(words):
        block = re.search(rf"^\*{words}[^\n]*\n([^*]*)", text, re.MULTILINE)[1]
        return [line.split(",") for line in block.splitlines()]

    nodes = {int(tag): np.array([float(at) for at in place]) for tag, *place in rows("NODE")}
    elements = {int(tag): [int(node) for node in row] for tag, *row in rows("ELEMENT")}
    for corners in elements.values():  # each node of second order between its two corners
        for node, (a, b) in zip(corners[4:], ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)), strict=True):
            assert nodes[node] == approx((nodes[corners[a]] + nodes[corners[b]]) / 2, abs=1e-9)
    sides = {"S1": (0, 1, 2), "S2": (0, 3, 1), "S3": (1, 3, 2), "S4": (2, 3, 0)}
    for name, height, area in (("bonded_bottom", 0.0, 8e-3 * 7.6e-3), ("bonded_top", 2e-3, 8e-3 * 8e-3)):
        corners = [
            [nodes[elements[int(tag)][n]] for n in sides[side.strip()]] for tag, side in rows(f"SURFACE, NAME={name}")
        ]
        assert all(abs(place[2] - height) < 1e-9 for face in corners for place in face)
        assert sum(np.linalg.norm(np.cross(b - a, c - a)) / 2 for a, b, c in corners) == approx(area, rel=1e-6)
        listed = {int(tag) for (tag,) in rows(f"NSET, NSET=nodes_{name}")}
        assert (
            listed == {tag for tag, place in nodes.items() if abs(place[2] - height) < 1e-9} or name == "bonded_bottom"
        )


def test_deck_of_pad_without_target_has_no_load_step():
    assert b"*STEP" in volume_mesh.elastomer_meshes(handmade.solids("jaw"), pad_of("jaw"), 0.5e-3)["inp"]
    solids = tuple(s for s in handmade.solids("jaw") if s.role is not BodyRole.TARGET)
    made = volume_mesh.elastomer_meshes(solids, pad_of("jaw"), 0.5e-3)["inp"]
    assert b"*STEP" not in made and b"NAME=bonded_bottom" in made and b"NAME=bonded_top" not in made
