"""What is measured of a printed piece: walls, holes, hollows and the side it lies on, against known figures."""

from __future__ import annotations

import json
import math
import subprocess
from dataclasses import replace

import handmade
import pytest
from solid_pairs import clearances, interferences
from tolerance import approx

from sitscad.assembly.places.bodies import BodyRole
from sitscad.assembly.places.column import print_limit
from sitscad.assembly.solids import assembly_aids, proof
from sitscad.assembly.solids import pieces as mounts
from sitscad.assembly.solids.proof import check_print
from sitscad.assembly.solids.solid import Solid, tessellate
from sitscad.files.documents import mounting
from sitscad.files.formats import meshes
from sitscad.spec import presets
from sitscad.spec.materials import Encapsulation
from sitscad.spec.mount import Finger, Retention

pytestmark = pytest.mark.cad


def solid(shape):
    return Solid("piece", shape, "m", "#000000", BodyRole.MOUNT)


def block(x, y, z):
    import build123d as bd

    return bd.Solid.make_box(x, y, z)


def placed(shape, *at):
    import build123d as bd

    return shape.moved(bd.Location(at))


def test_block_wall_is_least_side():
    result = check_print(solid(block(5, 4, 0.7)), "resin")
    assert result.wall == approx(0.7e-3, abs=2e-6) and result.hole is None and result.faults == ()
    assert result.volume == approx(14e-9, rel=1e-6) and result.bed in ("-z", "+z") and result.unsupported == 0.0


def test_thin_wall_is_fault_with_size_and_limit():
    piece = solid((block(5, 4, 3) - placed(block(4, 3, 3), 0.3, 0.5, 0.5)).solids()[0])
    assert check_print(piece, "resin").wall == approx(0.3e-3, abs=2e-6)
    (fault,) = check_print(piece, "resin").faults
    assert (fault.what, fault.limit) == ("wall", print_limit("resin", "wall").value) and "mount.process" in fault.fix


def test_smallest_hole_ignores_pins():
    import build123d as bd

    drilled = block(9, 9, 3) - placed(bd.Solid.make_cylinder(0.3, 4), 3, 3, -0.5)
    pinned = (drilled + placed(bd.Solid.make_cylinder(0.2, 4), 6, 6, 2)).solids()[0]
    result = check_print(solid(pinned), "resin")
    assert result.hole == approx(0.6e-3, rel=1e-6)
    assert [fault.what for fault in check_print(solid(pinned), "powder").faults] == ["wall", "hole"]


def test_closed_hollow_is_found():
    piece = solid((block(6, 6, 6) - placed(block(2, 2, 2), 2, 2, 2)).solids()[0])
    (fault,) = check_print(piece, "resin").faults
    assert fault.what == "trapped volume" and fault.measured == approx(8e-9, rel=1e-6)


def test_print_bed_side_needs_least_support():
    """A table: standing it has a roof to be held up, upside down none."""
    table = block(8, 8, 1) + placed(block(2, 2, 5), 3, 3, -5)
    result = check_print(solid(table.solids()[0]), "resin")
    assert result.bed == "+z" and result.unsupported == 0.0


JAW = replace(handmade.jaw(9e-3, 2.4e-3, length=24e-3), port_diameter=10e-3)


def kinds():
    pad = handmade.Mount("grasper-pad", JAW, 1.2e-3)
    film = Encapsulation(handmade.PDMS, 0.4e-3)
    yield "ledges", handmade.jaw_sensor(mount=pad, shield=None, encapsulation=film)
    for kind in ("dovetail", "pins"):
        yield kind, handmade.jaw_sensor(mount=replace(pad, retention=Retention(kind)), shield=None)
    for name in presets.names("hole pattern"):
        mount_on = handmade.Mount("bench-plate", None, 2e-3, holes=presets.hole_pattern(name))
        yield name, handmade.bench_sensor(mount=mount_on)
    for shape, size in (("rectangle", (16e-3, 10e-3)), ("circle", (14e-3, 14e-3))):
        cap = handmade.Mount("fingertip", None, 1.2e-3, finger=Finger(shape, size, 8e-3, 2e-3))
        yield f"finger-{shape}", handmade.bench_sensor(mount=cap)


KINDS = dict(kinds())


def made(layout, process):
    carried = replace(layout.spec.mount, process=process)
    return replace(layout, spec=replace(layout.spec, mount=carried))


def pieces(layout):
    return (*mounts.mount(layout), *assembly_aids(layout))


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("kind", ["pins", "ati-nano17", "finger-circle"])
def test_mount_pieces_are_printable_in_resin(kind):
    for piece in mounts.mount(KINDS[kind]):
        assert piece.shape.is_valid and check_print(piece, "resin").faults == (), piece.name


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("process", ["powder", "filament"])
@pytest.mark.parametrize("kind", ["ledges", "ati-nano17", "finger-circle"])
def test_mount_pieces_are_printable_by_all_processes(kind, process):
    """But for the holes of a cap, which are drilled and tapped where its printer makes none so small."""
    layout = made(KINDS[kind], process)
    for piece in pieces(layout) if process == "filament" else mounts.mount(layout):
        result = check_print(piece, process)
        assert piece.shape.is_valid, piece.name
        assert all(fault.what == "hole" and kind.startswith("finger") for fault in result.faults), (piece.name, result)


@pytest.mark.slow
def test_report_states_process_of_each_piece():
    from sitscad.assembly.solids.pieces import jaw
    from sitscad.assembly.solids.tooling import mould

    layout = KINDS["pins"]
    given = (jaw(layout), *mounts.mount(layout)), mould(layout)
    document = json.loads(mounting.render_print(*given, layout.spec)["mount/print.json"])
    assert [piece["piece"] for piece in document["pieces"]] == ["mount", "mould-tray", "mould-lid"]
    assert document["can_be_made"]
    assert document["limits_m"]["wall"] == 0.4e-3 and all(document["sources"].values())
    assert mounting.render_print((), (), handmade.layout("bare").spec) == {}


@pytest.mark.more
@pytest.mark.clients("prusa-slicer", "admesh")
@pytest.mark.slow
@pytest.mark.parametrize(
    "kind", ["dovetail", *(pytest.param(kind, marks=pytest.mark.more) for kind in ("ati-nano17", "finger-circle"))]
)
def test_slicer_accepts_printed_meshes(kind, tmp_path):
    """admesh: no facet to be repaired; PrusaSlicer slices STL and 3MF without a warning."""
    layout = KINDS[kind]
    result = pieces(layout)
    files = meshes.render_stl(result, layout.spec) | meshes.render_3mf(result, layout.spec)
    jigs = {**meshes.render_stl((), layout.spec, assembly_aids(layout)),
            **meshes.render_3mf((), layout.spec, assembly_aids(layout))}
    for name, data in (files | jigs).items():
        path, out = tmp_path / name.rpartition("/")[2], tmp_path / "out.gcode"
        path.write_bytes(data)
        if path.suffix == ".stl":
            said = subprocess.run(["admesh", str(path)], capture_output=True, text=True, check=True).stdout
            for defect in ("Backwards edges", "Degenerate facets", "Facets reversed", "Facets removed", "Facets added"):
                assert f"{defect}" in said and int(said.split(defect)[1].split(":")[1].split()[0]) == 0, (name, said)
        layers = ["--layer-height", "0.1", "--first-layer-height", "0.1", "--nozzle-diameter", "0.2"]
        slicer = ["prusa-slicer", "--export-gcode", "--support-material", *layers, "-o", str(out), str(path)]
        ran = subprocess.run(slicer, check=True, capture_output=True, text=True)
        assert "warning" not in (ran.stdout + ran.stderr).lower(), (name, ran.stdout, ran.stderr)
        assert out.read_text().count("G1 ") > 100, name
        out.unlink()


def test_cap_bore_has_clearance_round_finger():
    from sitscad.assembly.places.seating import clearance

    layout = KINDS["finger-circle"]
    (cap, *_) = mounts.mount(layout)
    bores = [f for f in cap.shape.faces() if f.geom_type.name == "CYLINDER" and f.radius > 5.0]
    assert {round(f.radius, 6) for f in bores} == {round(7.0 + 1e3 * clearance(layout.spec.mount), 6)}


@pytest.mark.slow
def test_dovetail_tongue_has_section_volume():
    plain = mounts.mount(handmade.jaw_sensor(mount=handmade.Mount("grasper-pad", JAW, 1.2e-3), shield=None))[0]
    held = mounts.mount(KINDS["dovetail"])[0]
    result = Retention("dovetail")
    neck = result.width - 2 * result.depth / math.tan(result.angle)
    area = 0.5 * (result.width + neck) * result.depth
    length = 4.5e-3 - 1e-3 * held.shape.bounding_box().min.X
    assert held.volume - plain.volume == approx(area * length, rel=1e-6)


@pytest.mark.slow
def test_pins_have_cylinder_volume_less_chamfers():
    plain = mounts.mount(handmade.jaw_sensor(mount=handmade.Mount("grasper-pad", JAW, 1.2e-3), shield=None))[0]
    held, result = mounts.mount(KINDS["pins"])[0], Retention("pins")
    radius, cut = result.diameter / 2, 0.1e-3
    cone = math.pi * cut / 3 * (radius**2 + radius * (radius - cut) + (radius - cut) ** 2)
    item = math.pi * radius**2 * (result.depth - cut) + cone
    assert held.volume - plain.volume == approx(2 * item, rel=1e-6)


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("kind", ["dovetail", "pins"])
def test_jaw_cutout_is_larger_by_clearance(kind):
    from sitscad.assembly.places.seating import joint_clearance
    from sitscad.assembly.solids.pieces import jaw

    layout = KINDS[kind]
    metal, (seat, *_) = jaw(layout), mounts.mount(layout)
    assert interferences((metal, seat)) == ()
    import build123d as bd

    lifted = replace(seat, shape=seat.shape.moved(bd.Location((0, 0, 0.03))))
    (gap,) = clearances((metal, lifted))
    assert 0.02e-3 < gap.gap <= joint_clearance(layout.spec.assembly.glue_line, layout.spec.mount) + 0.03e-3
    assert metal.shape.is_valid and metal.volume < jaw(handmade.jaw_sensor(
        mount=handmade.Mount("grasper-pad", JAW, 1.2e-3), shield=None)).volume


def test_wall_rays_in_plate_with_holes_meet_only_near_triangles(monkeypatch):
    """The print check of a jig's base of 300 x 300 mm, with 361 holes, took minutes: each ray met every triangle."""
    import build123d as bd

    pairs, real = [], proof._first_hits

    def counted(origins, directions, corners):
        pairs.append(len(origins) * len(corners))
        return real(origins, directions, corners)

    holes = [placed(bd.Solid.make_cylinder(1.25, 5.0), 6.0 + 8.0 * i, 6.0 + 8.0 * k, -1.0)
             for i in range(6) for k in range(6)]
    plate = block(52, 52, 3).cut(*holes, placed(block(3, 3, 5), 8.5, 8.5, 0.9)).solids()[0]
    piece = solid(plate)
    monkeypatch.setattr(proof, "_first_hits", counted)
    result = check_print(piece, "resin")
    triangles = len(tessellate(piece, *proof.COARSE).triangles)
    assert result.wall == approx(0.9e-3, abs=2e-6)
    assert sum(pairs) < 0.35 * triangles**2
