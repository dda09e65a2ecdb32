"""A sensor in a model of one's own: sitscad's solids in build123d and in CadQuery, copper among them.

    python docs/examples/cad_model.py [SPEC] [FOLDER]

The model here is a housing with a pocket for the whole sensor. Solids are in millimetres; z = 0 is the board's top
face.
"""

import sys
from pathlib import Path
from typing import Any

import build123d as bd
import cadquery as cq

import sitscad

ROOM = 0.3
"""Room (mm) left around the sensor."""


def housing(solids: tuple[sitscad.Solid, ...]) -> Any:
    """A block with a pocket, open above, that is larger all round than the sensor by `ROOM`."""
    box = bd.Compound([solid.shape for solid in solids]).bounding_box()
    with bd.BuildPart() as block:
        with bd.Locations((box.center().X, box.center().Y, box.min.Z - 2.0)):
            bd.Box(box.size.X + 6.0, box.size.Y + 6.0, box.size.Z + 1.0, align=(bd.Align.CENTER,) * 2 + (bd.Align.MIN,))
        with bd.Locations((box.center().X, box.center().Y, box.min.Z - ROOM)):
            size = (box.size.X + 2 * ROOM, box.size.Y + 2 * ROOM, box.size.Z + 9.0)
            bd.Box(*size, align=(bd.Align.CENTER,) * 2 + (bd.Align.MIN,), mode=bd.Mode.SUBTRACT)
    return block.part


def in_build123d(layout: sitscad.Layout) -> tuple[Any, Any]:
    """The housing, and an assembly of it with everything in it; names and colours are kept."""
    solids = sitscad.solids(layout)
    block = housing(solids)
    sensor = sitscad.as_build123d((*solids, *sitscad.copper_solids(layout, 20e-6)), name=layout.spec.name)
    return block, bd.Compound(label="housed", children=[block, sensor])


def in_cadquery(layout: sitscad.Layout) -> Any:
    """The sensor on a base plate drawn with CadQuery, as an assembly with names."""
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
