"""What other programs compute with: a layout as lines, currents, areas and solids.

All of it is in one frame, the board's: x along the jaw towards the tail, y across it, z away from the board's top face,
which is z = 0 (copper lies below it); the origin is the spec's, the middle of the array unless its centres are written
out. Lengths are metres; solids are in millimetres, which is what CAD programs take a number for.
"""

from __future__ import annotations

from sitscad.interchange.areas import Area, areas
from sitscad.interchange.cad import as_build123d, as_cadquery, as_cadquery_assembly, copper_solids
from sitscad.interchange.lines import CentreLine, CurrentPath, centre_lines, current_paths

__all__ = [
    "Area", "CentreLine", "CurrentPath", "areas", "as_build123d", "as_cadquery", "as_cadquery_assembly", "centre_lines",
    "copper_solids", "current_paths",
]
