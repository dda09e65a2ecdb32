"""The board's drill file in Excellon format. All holes of a board are plated and go through the whole of it."""

from __future__ import annotations

from sitscad.layout.board import Layout
from sitscad.writers._excellon_text import DrilledHole, drill_text, on_grid
from sitscad.writers._fabrication_files import drill_files, project_attributes


def render(layout: Layout) -> dict[str, bytes]:
    """The drill file by its path in the package; nothing where the layout has no hole.

    The tools' diameters are the finished holes'.
    """
    holes = [DrilledHole(on_grid(via.centre.x), on_grid(via.centre.y), on_grid(via.drill)) for via in layout.vias]
    return {
        file.path: drill_text(
            f"{layout.spec.name}: {file.title}", file.function, project_attributes(layout), holes, "ViaDrill"
        )
        for file in drill_files(layout)
    }
