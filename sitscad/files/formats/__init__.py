"""File formats of a package. A format is a module here with a `render` function, and a row in WRITERS."""

from __future__ import annotations

from sitscad.files.writer import Writer, is_cut, is_mounted

WRITERS: tuple[Writer, ...] = (
    Writer("gerber", "files.formats.gerber", "gerber"),
    Writer("excellon", "files.formats.gerber:render_drills", "gerber"),
    Writer("drill map", "files.formats.gerber:render_drill_map", "gerber"),
    Writer("ipc356", "files.formats.ipc356", "gerber"), Writer("job file", "files.formats.gerber:render_job", "gerber"),
    Writer("panel", "files.formats.gerber.panel_files", "gerber", ("panel", "files")),
    Writer("kicad", "files.formats.kicad.project_files", "kicad"),
    Writer("wiring", "files.formats.kicad.schematic", "firmware", ("layout", "estimates")),
    Writer("laser dxf", "files.formats.laser:render_dxf", "laser", ("layout", "forced"), is_cut),
    Writer("laser svg", "files.formats.laser:render_svg", "laser", ("layout", "forced"), is_cut),
    Writer("step", "files.formats.step", "mount", ("solids", "spec", "aids"), is_mounted),
    Writer("stl", "files.formats.meshes:render_stl", "mount", ("solids", "spec", "aids"), is_mounted),
    Writer("3mf", "files.formats.meshes:render_3mf", "mount", ("solids", "spec", "aids"), is_mounted),
    Writer("assembly step", "files.formats.step:render_whole", "assembly", ("whole", "spec"), is_mounted),
    Writer("assembly 3mf", "files.formats.meshes:render_whole_3mf", "assembly", ("whole", "spec"), is_mounted),
    Writer("assembly glb", "files.formats.meshes:render_glb", "assembly", ("whole", "spec"), is_mounted),
    Writer(
        "volume mesh", "files.formats.volume_mesh", "mesh", ("solids", "spec"), lambda spec: spec.elastomer is not None,
    ),
)
"""Formats in the order in which a package is made. The documents follow them."""
