"""The board's drill files in Excellon format: one for every span of copper layers that its plated holes go through."""

from __future__ import annotations

from sitscad.layout.board import Layout
from sitscad.writers._excellon_text import drill_text
from sitscad.writers._fabrication_files import drill_files, drill_title, project_attributes
from sitscad.writers._holes import drilled_to


def render(layout: Layout) -> dict[str, bytes]:
    """The drill files by their paths in the package; none where the layout has no hole.

    The tools' diameters are the finished holes'.
    """
    return {
        file.path: drill_text(
            drill_title(layout, file.title),
            file.function,
            project_attributes(layout),
            drilled_to(layout, file.layer),
            "ViaDrill",
        )
        for file in drill_files(layout)
    }
