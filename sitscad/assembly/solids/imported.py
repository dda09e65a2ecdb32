"""Solids from STEP files of a spec, read in a separate process and positioned by their datum (coordinate system).

A CAD kernel in C++ may crash, hang or exhaust memory on a malicious file. The reading process therefore has limits of
time and memory. It returns the solid in OpenCASCADE's own format. If it crashes, the main process continues.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import subprocess
import sys
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from sitscad.assembly.places.state import Vector
from sitscad.assembly.solids.solid import MM, PartsError, import_extra
from sitscad.data import PACKAGE
from sitscad.kernels.geometry.path import Point
from sitscad.spec.mount import StepPart
from sitscad.spec.yaml.source import SpecSource

SECONDS = 120
"""Longest time (s) of the reading process."""
LARGEST = 1000.0  # A part's longest side at most (mm)
"""Largest accepted length (mm) of a part's longest side."""

_NAME = r"'((?:[^']|''){0,80})'"
_PLACEMENT = re.compile(
    rf"#\d+\s*=\s*AXIS2_PLACEMENT_3D\s*\(\s*{_NAME}\s*,\s*(#\d+)\s*,\s*(#\d+|\$)\s*,\s*(#\d+|\$)\s*\)"
)
_TRIPLE = r"{}\s*=\s*{}\s*\(\s*'[^']*'\s*,\s*\(([^()]*)\)\s*\)"

AXES: dict[str, Vector] = {
    f"{sign}{name}": (scale * (name == "x"), scale * (name == "y"), scale * (name == "z"))
    for name in "xyz"
    for sign, scale in (("", 1.0), ("-", -1.0))
}


class DatumError(PartsError):
    """Raised if the STEP file does not have the named datum, or if the datum's axes are not perpendicular."""


def import_solid(source: SpecSource, part: StepPart, at: Point, height: float) -> Any:
    """Return the solid in a STEP file, with its datum at a point and a height (m).

    The datum's axes are turned to the sensor's axes.

    Raises `PartsError` for the reasons of `read_part`.
    """
    solid, frame = read_part(source, part)
    bd, gp, turn = import_extra("build123d"), import_extra("OCP.gp"), import_extra("OCP.gp").gp_Trsf()
    turn.SetDisplacement(
        frame, gp.gp_Ax3(gp.gp_Pnt(*(at.x * MM, at.y * MM, height * MM)), gp.gp_Dir(0, 0, 1), gp.gp_Dir(1, 0, 0))
    )
    # a copy whose very points are moved: a shape that carries a location gets a running number for a name in STEP
    moved = import_extra("OCP.BRepBuilderAPI").BRepBuilderAPI_Transform(with_location_applied(solid), turn, True)
    return bd.Solid(moved.Shape())


def read_part(source: SpecSource, part: StepPart) -> tuple[Any, Any]:
    """Return the solid in a STEP file and the axes of its datum (`gp_Ax3`), both in the file's coordinates (mm).

    Raises `PartsError` if the file does not belong to the spec or is not a single closed solid. Raises `DatumError` if
    it has no such coordinate system.
    """
    content = source.files.get(part.file)
    if content is None or hashlib.sha256(content).hexdigest() != part.sha256:
        raise PartsError(f"{part.file} is not with the spec as it was read: load the spec from its file again")
    brep, unit = _brep_shape(content, part.file)
    origin, x_axis, z_axis = _datum_frame(content.decode("latin-1"), part, unit)
    gp, solid = import_extra("OCP.gp"), _solid(brep, part.file)
    try:
        return solid, gp.gp_Ax3(gp.gp_Pnt(*origin), gp.gp_Dir(*z_axis), gp.gp_Dir(*x_axis))
    except Exception as error:  # of the kernel: parallel or vanishing axes
        message = f"the axes of {part.file}'s coordinate system {part.datum} do not stand on each other"
        raise DatumError(message) from error


@lru_cache(maxsize=4)
def _brep_shape(content: bytes, name: str) -> tuple[bytes, float]:
    """Return a STEP file's shape in OpenCASCADE's own format, and the file's unit of length in millimetres."""
    import_extra("build123d")  # a missing kernel is said as such
    with TemporaryDirectory() as folder:
        source, target = Path(folder) / "part.step", Path(folder) / "part.brep"
        source.write_bytes(content)
        reader = [sys.executable, "-m", "sitscad.assembly.solids.step_reader", str(source), str(target)]
        try:
            # in its own folder: a module of the user's, like json.py, would be imported from the working directory
            python_path = os.environ.get("PYTHONPATH")
            paths = os.pathsep.join([str(PACKAGE.parent), *([python_path] if python_path else [])])
            ran = subprocess.run(reader, capture_output=True, timeout=SECONDS, check=False, cwd=folder,
                                 env=os.environ | {"PYTHONPATH": paths})
        except subprocess.TimeoutExpired:
            raise PartsError(f"{name} could not be read in {SECONDS} s") from None
        if ran.returncode or not target.is_file():
            lines = ran.stderr.decode("utf-8", "replace").strip().splitlines()
            last_line = lines[-1][:200] if lines else "the CAD kernel gave up on it"
            raise PartsError(f"{name} cannot be read: {last_line}")
        result = json.loads(ran.stdout.splitlines()[-1])
        return target.read_bytes(), float(result["unit_mm"])


def _solid(brep: bytes, name: str) -> Any:
    bd = import_extra("build123d")
    shape = import_extra("OCP.TopoDS").TopoDS_Shape()
    with TemporaryDirectory() as folder:  # from a stream, the kernel loses its place in shapes of many kilobytes
        path = Path(folder) / "part.brep"
        path.write_bytes(brep)
        import_extra("OCP.BinTools").BinTools.Read_s(shape, str(path))
    solids = bd.Compound(shape).solids()
    if len(solids) != 1:
        raise PartsError(f"{name} holds {len(solids)} solids, where one is wanted: export the part alone")
    (solid,) = solids
    if not solid.is_valid or solid.volume <= 0.0:
        raise PartsError(f"{name} is no closed solid: mend it in the program that wrote it")
    if max(solid.bounding_box().size) > LARGEST:
        raise PartsError(f"{name} is larger than {LARGEST:g} mm: is its unit right?")
    return solid


def _datum_frame(text: str, part: StepPart, unit: float) -> tuple[Vector, Vector, Vector]:
    """Return the datum's origin (mm, in the file's coordinates) and the directions of the sensor's x and z axes.

    `text` is the STEP file's text, and `unit` its unit of length (mm).
    """
    if not isinstance(part.datum, str):
        x, y, z = (value * MM for value in part.datum)
        return (x, y, z), AXES[part.along], AXES[part.up]
    matches = [match for match in _PLACEMENT.finditer(text) if match[1].replace("''", "'") == part.datum]
    if len(matches) != 1:
        named = sorted({match[1] for match in _PLACEMENT.finditer(text) if match[1].strip()})[:6]
        there = f"; there are: {', '.join(named)}" if named else ""
        how = "has no" if not matches else f"has {len(matches)}"
        raise DatumError(f"{part.file} {how} coordinate system named {part.datum}{there}")
    _, place, z_axis, x_axis = matches[0].groups()
    x, y, z = (value * unit for value in _three_numbers(text, place, "CARTESIAN_POINT", (0.0, 0.0, 0.0), part))
    return (
        (x, y, z), _three_numbers(text, x_axis, "DIRECTION", (1.0, 0.0, 0.0), part),
        _three_numbers(text, z_axis, "DIRECTION", (0.0, 0.0, 1.0), part),
    )


def _three_numbers(text: str, number: str, entity: str, left_out: Vector, part: StepPart) -> Vector:
    if number == "$":
        return left_out
    match = re.search(_TRIPLE.format(re.escape(number), entity), text)
    try:
        numbers = [float(value) for value in match[1].split(",")] if match else []
    except ValueError:
        numbers = []
    if len(numbers) != 3:
        raise DatumError(f"{part.file}: the coordinate system {part.datum} is not whole")
    return numbers[0], numbers[1], numbers[2]


def with_location_applied(solid: Any) -> Any:
    """Return a shape of the CAD kernel whose points are moved by its location."""
    where = solid.wrapped.Location()
    if where.IsIdentity():
        return solid.wrapped
    still = solid.wrapped.Located(import_extra("OCP.TopLoc").TopLoc_Location())
    return import_extra("OCP.BRepBuilderAPI").BRepBuilderAPI_Transform(still, where.Transformation(), True).Shape()
