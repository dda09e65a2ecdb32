"""Fabrication files of the board: Gerber X2, Excellon drill files, drill map and job file.

The Gerber files show every copper layer, coverlay openings, stiffener, extent of inner layers, and outline.
"""

from __future__ import annotations

from sitscad.files.formats.gerber.image import document, drill_text, job_document, layer_files, map_text
from sitscad.files.order_facts.files import (
    drill_files,
    drill_map_file,
    drill_title,
    drilled_to,
    fabrication_path,
    gerber_files,
    plated_tools,
    project_attributes,
)
from sitscad.layout.board import Layout


def render(layout: Layout) -> dict[str, bytes]:
    """Return all Gerber files of a layout by their paths in the package. They depend on the layout alone."""
    return layer_files(layout)


def render_drills(layout: Layout) -> dict[str, bytes]:
    """Return the drill files by their paths in the package. Empty if the layout has no hole.

    Tool diameters are the diameters of the finished holes.
    """
    return {
        file.path: drill_text(
            drill_title(layout.spec.issue.words, layout.spec.name, file.title), file.function,
            project_attributes(layout.spec.issue.revision, layout.spec.name),
            drilled_to(layout, file.layer), "ViaDrill",
        )
        for file in drill_files(layout.copper_layers, layout.spans, layout.spec.name)
    }


def render_drill_map(layout: Layout) -> dict[str, bytes]:
    """Return the drill map by its path in the package. Empty if the layout has no hole."""
    if not layout.vias:
        return {}
    file = drill_map_file(fabrication_path(layout.spec.name, "Drill_Map.gbr"))
    return {file.path: document(layout.spec.issue, layout.spec.name, file,
                                map_text(layout.outline, plated_tools(layout)))}


def render_job(layout: Layout) -> dict[str, bytes]:
    """Return the board's job file by its path in the package."""
    files = (*gerber_files(layout.spec.name, layout.spec.fpc, layout.stiffener),
             *drill_files(layout.copper_layers, layout.spans, layout.spec.name))
    return {fabrication_path(layout.spec.name, "job.gbrjob"): job_document(layout, files, layout.size)}
