"""Every piece that is printed, of every kind of mount, as other programs see it.

    python tests/validation/all_parts.py [KIND...]

Each is written as STEP, STL and 3MF. STEP is read back by OpenCASCADE: one valid solid of the same volume. STL and 3MF
are closed for trimesh, admesh has nothing to repair, and PrusaSlicer slices both without a warning, lying on the side
that `print.json` names. It prints a line a piece and ends with 1 where anything was found.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from io import BytesIO
from pathlib import Path

HERE = Path(__file__).parents[1]
sys.path[:0] = [str(HERE.parent), str(HERE / "samples"), str(HERE / "oracles"), str(HERE / "parts")]

import build123d as bd  # noqa: E402
import numpy as np  # noqa: E402
import trimesh  # noqa: E402
from test_printable import KINDS  # noqa: E402

from sitscad.assembly.solids import Solid, assembly_aids, pieces  # noqa: E402
from sitscad.assembly.solids.pieces import jaw, opposing_jaw  # noqa: E402
from sitscad.assembly.solids.proof import check_print  # noqa: E402
from sitscad.assembly.solids.solid import TriangleMesh, tessellate  # noqa: E402
from sitscad.files.formats import meshes, step  # noqa: E402

DEFECTS = ("Backwards edges", "Degenerate facets", "Facets reversed", "Facets removed", "Facets added")
TURNS = {
    "-z": np.eye(3), "+z": np.diag([1.0, -1.0, -1.0]),
    "-x": np.array([[0, 0, -1], [0, 1, 0], [1, 0, 0]]), "+x": np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]]),
    "-y": np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]), "+y": np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]),
}
"""What lays a piece on one of its sides."""


def through_step(solid: Solid, folder: Path) -> list[str]:
    """What differs after STEP: the solid, its validity, its volume."""
    path = folder / "part.step"
    path.write_bytes(step.part(solid, "part"))
    read = bd.import_step(str(path)).solids()
    if len(read) != 1 or not read[0].is_valid:
        return [f"STEP: {len(read)} solids, valid: {[one.is_valid for one in read]}"]
    off = abs(read[0].volume / solid.shape.volume - 1.0)
    return [f"STEP: volume off by {off:.1e}"] if off > 1e-6 else []


def closed(solid: Solid, path: Path) -> list[str]:
    """What trimesh and admesh have to say of a mesh file."""
    body = trimesh.load(BytesIO(path.read_bytes()), file_type=path.suffix[1:], force="mesh")
    body.merge_vertices()
    result = [] if body.is_watertight and body.is_winding_consistent else [f"trimesh: {path.suffix} is not closed"]
    off = abs(body.volume / solid.shape.volume - 1.0)
    result += [f"trimesh: volume of {path.suffix} off by {off:.1e}"] if off > 5e-3 else []
    if path.suffix == ".stl":
        message = subprocess.run(["admesh", str(path)], capture_output=True, text=True, check=True).stdout
        counts = {defect: int(message.split(defect)[1].split(":")[1].split()[0]) for defect in DEFECTS}
        result += [f"admesh: {defect} {count}" for defect, count in counts.items() if count]
    return result


def sliced(path: Path) -> list[str]:
    """What PrusaSlicer warns of."""
    layers = ["--layer-height", "0.1", "--first-layer-height", "0.1", "--nozzle-diameter", "0.2"]
    out = path.with_suffix(".gcode")
    slicer = ["prusa-slicer", "--export-gcode", "--support-material", *layers, "-o", str(out), str(path)]
    ran = subprocess.run(slicer, capture_output=True, text=True)
    message = [line for line in (ran.stdout + ran.stderr).splitlines() if "warning" in line.lower()]
    if ran.returncode or out.read_text().count("G1 ") < 100:
        message.append(f"not sliced: {ran.stderr.strip()}")
    return [f"PrusaSlicer: {path.suffix}: {line}" for line in message]


def laid(solid: Solid, mesh: TriangleMesh) -> TriangleMesh:
    """A piece's mesh on the side that it is printed on."""
    bed = check_print(solid, "resin").bed
    return TriangleMesh(mesh.name, mesh.vertices @ TURNS[bed].T, mesh.triangles).on_bed()


def found_of(solid: Solid, folder: Path) -> list[str]:
    """All that any program finds of a piece."""
    mesh = laid(solid, tessellate(solid))
    files = {"part.stl": meshes.stl(mesh), "part.3mf": meshes.package(solid, mesh, "part")}
    message = [] if solid.shape.is_valid else ["not valid"]
    message += through_step(solid, folder)
    for name, data in files.items():
        path = folder / name
        path.write_bytes(data)
        message += [*closed(solid, path), *sliced(path)]
    return message


def main() -> int:
    """Ask about all kinds, or those that are named."""
    bad = 0
    for kind in sys.argv[1:] or KINDS:
        layout = KINDS[kind]
        jaws = [solid for solid in (jaw(layout), *opposing_jaw(layout)) if solid is not None]
        for solid in (*pieces.mount(layout), *jaws, *assembly_aids(layout)):
            with tempfile.TemporaryDirectory() as name:
                message = found_of(solid, Path(name))
            bad += len(message)
            size = " x ".join(f"{side:.2f}" for side in solid.shape.bounding_box().size)
            told = "; ".join(message) or "clean"
            print(f"{kind:24} {solid.name:20} {size:24} {solid.shape.volume:10.3f} mm3  {told}", flush=True)
    print(f"{bad} faults")
    return bool(bad)


if __name__ == "__main__":
    sys.exit(main())
