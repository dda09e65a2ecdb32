"""The board's drill map, a Gerber drawing."""

from __future__ import annotations

from sitscad.layout.board import Layout
from sitscad.writers._drill_map import map_file, map_text
from sitscad.writers._fabrication_files import fabrication_path
from sitscad.writers._gerber_image import document
from sitscad.writers._holes import plated_tools


def render(layout: Layout) -> dict[str, bytes]:
    """The drill map by its path in the package; nothing where the layout has no hole."""
    if not layout.vias:
        return {}
    file = map_file(fabrication_path(layout, "Drill_Map.gbr"))
    return {file.path: document(layout, file, map_text(layout.outline, plated_tools(layout)))}
