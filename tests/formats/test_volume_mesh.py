"""The elastomer's finite-element mesh, read by a reader of its own: groups, areas, volume, and no inverted element."""

from __future__ import annotations

import handmade
import numpy as np
import pytest
from tolerance import approx

from sitscad.formats.tetrahedra import pad as volume_mesh

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


def mesh(sensor: str) -> Msh:
    files = volume_mesh.render(handmade.solids(sensor), handmade.layout(sensor).spec)
    (data,) = (content for name, content in files.items() if name.endswith(".msh"))
    return Msh(data)


def test_a_square_pad_in_metres_with_its_bonded_faces():
    found = mesh("jaw")
    assert set(found.groups) == {"bonded_bottom", "bonded_top", "free", "elastomer"}
    assert found.area("bonded_bottom") == approx(16e-6, rel=1e-9)
    assert found.area("bonded_top") == approx(16e-6, rel=1e-9)
    assert found.area("free") == approx(16e-6, rel=1e-9)
    assert found.heights("bonded_bottom") == (0.0, 0.0)
    assert found.heights("bonded_top") == approx((1e-3, 1e-3), rel=1e-6)
    assert found.volumes().sum() == approx(16e-9, rel=1e-9)
    assert found.volumes().min() > 0.0
    assert 1000 < len(found.groups["elastomer"]) < 50_000


def test_what_overhangs_the_board_or_the_target_is_free():
    """The bench pad, 8 mm square, stands on a board 7.6 mm wide; the jaw's target reaches over its pad along x only."""
    bench = mesh("bench")
    assert bench.area("bonded_bottom") == approx(8e-3 * 7.6e-3, rel=1e-6)
    assert bench.area("free") == approx(4 * 8e-3 * 2e-3 + 8e-3 * 0.4e-3, rel=1e-6)
    jaw = mesh("overhanging")
    assert jaw.area("bonded_top") == approx(3e-3 * 2.4e-3, rel=1e-6)
    assert jaw.volumes().sum() == approx(9e-9, rel=1e-9)


def test_a_round_pad_under_a_smaller_round_target():
    found = mesh("round")
    assert found.area("bonded_top") == approx(np.pi * 1.5e-3**2, rel=0.02)
    assert found.area("bonded_bottom") == approx(np.pi * 2e-3**2, rel=0.02)
    assert found.volumes().sum() == approx(np.pi * 2e-3**2 * 1e-3, rel=0.02)


def test_a_finer_mesh_has_more_elements_and_the_same_volume():
    solids = handmade.solids("jaw")
    coarse, fine = (Msh(volume_mesh.elastomer_meshes(solids, size)["msh"]) for size in (0.5e-3, 0.25e-3))
    assert len(fine.groups["elastomer"]) > 3 * len(coarse.groups["elastomer"])
    assert fine.volumes().sum() == approx(coarse.volumes().sum(), rel=1e-9)


def test_gmsh_itself_reads_it_and_a_session_that_is_open_survives(tmp_path):
    import gmsh

    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add("theirs")
        data = volume_mesh.elastomer_meshes(handmade.solids("jaw"))["msh"]
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


def test_without_an_elastomer_there_is_no_file():
    assert volume_mesh.render(handmade.solids("bare"), handmade.layout("bare").spec) == {}


def test_the_second_order_mesh_has_named_faces_and_says_what_it_is_worth():
    import json
    import re

    from sitscad.formats.tetrahedra.pad import elastomer_meshes

    made = elastomer_meshes(handmade.solids("bench"))
    text, worth = made["inp"].decode("ascii"), json.loads(made["json"])
    assert "type=C3D10" in text
    names = set(re.findall(r"\*ELSET,ELSET=(\w+)", text))
    assert {"elastomer", "bonded_bottom", "bonded_top", "free"} <= names
    nodes = re.search(r"\*NODE\n(.*?)\n\*", text, re.S)[1].splitlines()
    assert len(nodes) == worth["second_order"]["nodes"] > 4 * worth["first_order"]["nodes"]
    points = np.array([[float(value) for value in line.split(",")[1:]] for line in nodes])
    bounds = next(s for s in handmade.solids("bench") if s.name == "elastomer").shape.bounding_box()
    assert points.max(axis=0) == approx(np.array(tuple(bounds.max)) * 1e-3, abs=1e-9)
    for order in ("first_order", "second_order"):
        assert worth[order]["least_quality"] > 0.1 and worth[order]["share_below_0.1"] == 0.0
    assert elastomer_meshes(handmade.solids("bench"))["inp"] == made["inp"]
