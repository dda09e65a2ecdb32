"""Nets out of finished files: what the copper that the Gerber and drill files draw really joins.

`extract` reads a directory of finished files, `compare` holds the nets found against the nets that the same files name,
`compare_job` what files say of themselves against the job file, `compare_panel` holds every copy of a panel against
the single board,
`copper_resistance` solves for the resistance of the extracted copper. Nothing here knows how the files were written.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sitscad.extraction.artwork import Artwork, ExtractionError, Flash, Hole
from sitscad.extraction.differences import Difference, Kind, compare, compare_job
from sitscad.extraction.intent import UNUSED, Mark, Source
from sitscad.extraction.nets import Contact, ExtractedBoard, ExtractedNet, Loop, Piece, extract
from sitscad.extraction.panel import compare_panel

if TYPE_CHECKING:
    from sitscad.extraction.resistance import copper_resistance

__all__ = [
    "UNUSED",
    "Artwork",
    "Contact",
    "Difference",
    "ExtractedBoard",
    "ExtractedNet",
    "ExtractionError",
    "Flash",
    "Hole",
    "Kind",
    "Loop",
    "Mark",
    "Piece",
    "Source",
    "compare",
    "compare_job",
    "compare_panel",
    "copper_resistance",
    "extract",
]


def __getattr__(name: str) -> Any:
    """`copper_resistance`, which needs gmsh and scipy, is imported when it is first asked for."""
    if name == "copper_resistance":
        from sitscad.extraction.resistance import copper_resistance

        return copper_resistance
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
