"""The formats that a package is written in. A new format is one module here with a `render`, and one row of WRITERS."""

from __future__ import annotations

from sitscad.writer import Writer, is_cut, is_mounted

WRITERS: tuple[Writer, ...] = (
    Writer("gerber", "formats.gerber", "gerber"),
    Writer("excellon", "formats.gerber:render_drills", "gerber"),
    Writer("drill map", "formats.gerber:render_drill_map", "gerber"),
    Writer("ipc356", "formats.ipc356", "gerber"), Writer("job file", "formats.gerber:render_job", "gerber"),
    Writer("panel", "formats.gerber.panel", "gerber", ("panel", "files")),
    Writer("kicad", "formats.kicad", "kicad"),
    Writer("wiring", "formats.kicad.schematic", "firmware", ("layout", "estimates")),
    Writer("laser dxf", "formats.laser:render_dxf", "laser", ("layout", "forced"), is_cut),
    Writer("laser svg", "formats.laser:render_svg", "laser", ("layout", "forced"), is_cut),
    Writer("step", "formats.step", "mount", ("solids", "spec", "aids"), is_mounted),
    Writer("stl", "formats.meshes:render_stl", "mount", ("solids", "spec", "aids"), is_mounted),
    Writer("3mf", "formats.meshes:render_3mf", "mount", ("solids", "spec", "aids"), is_mounted),
    Writer("assembly step", "formats.step:render_whole", "assembly", ("whole", "spec"), is_mounted),
    Writer("assembly 3mf", "formats.meshes:render_whole_3mf", "assembly", ("whole", "spec"), is_mounted),
    Writer("assembly glb", "formats.meshes:render_glb", "assembly", ("whole", "spec"), is_mounted),
    Writer("volume mesh", "formats.volume_mesh", "mesh", ("solids", "spec"), lambda spec: spec.elastomer is not None),
)
"""Every format, in the order in which a package is made; the papers come after them."""
