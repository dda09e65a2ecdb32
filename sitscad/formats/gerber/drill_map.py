"""The board's drill map, a Gerber drawing."""

from __future__ import annotations

from sitscad.fabrication.files import drill_map_file, fabrication_path, plated_tools
from sitscad.formats.gerber.drill_map_text import map_text
from sitscad.formats.gerber.image import document
from sitscad.layout.board import Layout


def render(layout: Layout) -> dict[str, bytes]:
    """The drill map by its path in the package; nothing where the layout has no hole."""
    if not layout.vias:
        return {}
    file = drill_map_file(fabrication_path(layout, "Drill_Map.gbr"))
    return {file.path: document(layout, file, map_text(layout.outline, plated_tools(layout)))}
