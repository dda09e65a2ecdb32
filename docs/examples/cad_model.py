"""Place a sensor with its copper in your own CAD model, in build123d and in CadQuery.

    python docs/examples/cad_model.py [SPEC] [FOLDER]

The model is a housing with a pocket for the whole sensor. Solids are in millimetres. The board's top face is z = 0.
"""

import sys
from pathlib import Path
from typing import Any

import build123d as bd
import cadquery as cq

import sitscad

ROOM = 0.3
"""Clearance (mm) around the sensor."""


def housing(solids: tuple[sitscad.Solid, ...]) -> Any:
    """Return a block with an open pocket, which is larger than the sensor by `ROOM` on all sides."""
    box = bd.Compound([solid.shape for solid in solids]).bounding_box()
    with bd.BuildPart() as block:
        with bd.Locations((box.center().X, box.center().Y, box.min.Z - 2.0)):
            bd.Box(box.size.X + 6.0, box.size.Y + 6.0, box.size.Z + 1.0, align=(bd.Align.CENTER,) * 2 + (bd.Align.MIN,))
        with bd.Locations((box.center().X, box.center().Y, box.min.Z - ROOM)):
            size = (box.size.X + 2 * ROOM, box.size.Y + 2 * ROOM, box.size.Z + 9.0)
            bd.Box(*size, align=(bd.Align.CENTER,) * 2 + (bd.Align.MIN,), mode=bd.Mode.SUBTRACT)
    return block.part


def in_build123d(layout: sitscad.Layout) -> tuple[Any, Any]:
    """Return the housing, and an assembly of housing and sensor with names and colours."""
    solids = sitscad.solids(layout)
    block = housing(solids)
    sensor = sitscad.as_build123d((*solids, *sitscad.copper_solids(layout, 20e-6)), name=layout.spec.name)
    return block, bd.Compound(label="housed", children=[block, sensor])


def in_cadquery(layout: sitscad.Layout) -> Any:
    """Return an assembly: the sensor on a base plate drawn with CadQuery."""
    sensor = sitscad.as_cadquery_assembly(sitscad.solids(layout), name=layout.spec.name)
    lowest = sensor.toCompound().BoundingBox().zmin
    base = cq.Workplane("XY", origin=(0, 0, lowest)).box(40, 20, 2, centered=(True, True, False)).translate((0, 0, -2))
    return cq.Assembly(name="on-a-plate").add(base, name="base").add(sensor)


def main() -> dict[str, Any]:
    """Make both models and write them as STEP."""
    named = [*sys.argv[1:], *("templates/square_bench.yaml", ".")[len(sys.argv) - 1 :]][:2]
    layout, folder = sitscad.lay_out(sitscad.load(named[0])), Path(named[1])
    block, model = in_build123d(layout)
    assembly = in_cadquery(layout)
    bd.export_step(model, str(folder / "housing.step"))
    assembly.export(str(folder / "on-a-plate.step"))
    return {"housing": block, "model": model, "assembly": assembly, "layout": layout}


if __name__ == "__main__":
    main()
