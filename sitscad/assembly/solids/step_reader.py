"""Separate process that reads a STEP file: ``python -m sitscad.assembly.solids.step_reader IN.step OUT.brep``.

It writes the file's solids in OpenCASCADE's binary format, and one line of JSON to standard output, ``{"unit_mm":
1.0}``. If the file has no solid, it ends with exit code 1 and a sentence on standard error.
"""

from __future__ import annotations

import json
import sys

MOST_MEMORY, MOST_SECONDS, MOST_FACES = 4 * 2**30, 100, 20_000
"""Limits of memory (bytes), processor time (s) and number of faces."""
UNITS = {"millimetre": 1.0, "millimeter": 1.0, "centimetre": 10.0, "metre": 1000.0, "inch": 25.4, "foot": 304.8}
"""Lengths (mm) of the units of length in STEP files."""


def main(source: str, target: str) -> int:
    """Read the STEP file `source`, check it, and write its shape to `target`. Return the exit code."""
    _limit()
    from OCP.BinTools import BinTools
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.STEPControl import STEPControl_Reader

    reader = STEPControl_Reader()
    if reader.ReadFile(source) != IFSelect_RetDone:
        return _refused("it is no STEP file that can be read")
    # The file's unit of length in millimetres; None for one that is not known
    from OCP.TColStd import TColStd_SequenceOfAsciiString as Names

    lengths, angles, solid_angles = Names(), Names(), Names()
    reader.FileUnits(lengths, angles, solid_angles)
    unit = UNITS.get(lengths.Value(1).ToCString().lower()) if lengths.Length() else 1.0
    if unit is None:
        return _refused(f"its unit of length is none of {', '.join(UNITS)}")
    reader.TransferRoots()
    shape = reader.OneShape()
    if shape is None or shape.IsNull():
        return _refused("there is no shape in it")
    from OCP.TopAbs import TopAbs_FACE
    from OCP.TopExp import TopExp_Explorer

    faces, explorer = 0, TopExp_Explorer(shape, TopAbs_FACE)
    while explorer.More():
        faces += 1
        explorer.Next()
    if faces > MOST_FACES:
        return _refused(f"it has {faces} faces: more than {MOST_FACES}")
    if not BinTools.Write_s(shape, target):
        return _refused("its shape cannot be kept")
    print(json.dumps({"unit_mm": unit}))
    return 0


def _limit() -> None:
    try:
        import resource
    except ImportError:  # Windows
        return
    for what, most in ((resource.RLIMIT_AS, MOST_MEMORY), (resource.RLIMIT_CPU, MOST_SECONDS)):
        _, hard = resource.getrlimit(what)
        resource.setrlimit(what, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))


def _refused(why: str) -> int:
    print(why, file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:3]))
