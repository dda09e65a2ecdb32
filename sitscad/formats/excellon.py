"""The board's drill files in Excellon format: one for every span of copper layers that its plated holes go through."""

from __future__ import annotations

from sitscad.fabrication.files import drill_files, drill_title, drilled_to, project_attributes
from sitscad.formats.excellon_text import drill_text
from sitscad.layout.board import Layout


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
