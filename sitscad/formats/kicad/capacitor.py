"""The tank capacitors on the tail as footprints, on the board and in the project's own library.

They are bought and placed, so they stand in KiCad's lists of parts and of positions. Their 3-D models are those of
KiCad's own library, by the variable that says where it is installed; where it is not, KiCad shows the board alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from sitscad.formats.kicad.footprint import courtyard, extent, filled, pad_text, property_text
from sitscad.formats.kicad.sexpr import Grid, grid, identity, node, quoted, xy
from sitscad.geometry.path import Region, bounding_box
from sitscad.layout.board import Capacitor, Layout, Pad

_COURTYARD_MARGIN = 150_000
"""As in KiCad's own footprints of chips (nm)."""


MODELS = "${KICAD9_3DMODEL_DIR}"
"""KiCad 9's own variable for the folder of its 3-D models."""


def footprint_name(capacitor: Capacitor) -> str:
    """What the library calls the land pattern."""
    return f"capacitor-{capacitor.package}"


def capacitor_footprints(layout: Layout) -> dict[str, str]:
    """The library's footprints of capacitors by their names."""
    first = layout.capacitors[:1]
    head = "(version 20241229)", '(generator "sitscad")', '(layer "F.Cu")'
    return {
        footprint_name(each): node(f"footprint {quoted(footprint_name(each))}", *head, *_body(layout, each, None))
        + "\n"
        for each in first
    }


def placed_capacitors(layout: Layout, nets: Mapping[str, int], sheet: Grid) -> Iterator[str]:
    """The footprints as they stand on the board; `sheet` is the sheet's corner."""
    for each in layout.capacitors:
        yield node(
            f"footprint {quoted(f'{layout.spec.name}:{footprint_name(each)}')}",
            '(layer "F.Cu")',
            identity(layout.spec.name, each.reference),
            xy("at", grid(each.centre), sheet),
            *_body(layout, each, nets),
        )


def _body(layout: Layout, capacitor: Capacitor, nets: Mapping[str, int] | None) -> list[str]:
    """What stands in a capacitor's footprint: texts, openings, pads, model."""
    place = grid(capacitor.centre)
    owner = (layout.spec.name, capacitor.reference if nets is not None else "library capacitor")
    reference = capacitor.reference if nets is not None else "REF**"
    low, high = extent(capacitor.pads)
    low, high = (low[0] - place[0], low[1] - place[1]), (high[0] - place[0], high[1] - place[1])
    return [
        property_text("Reference", reference, (0, low[1] - 1_000_000), owner),
        property_text("Value", capacitor.package, (0, high[1] + 1_000_000), owner),
        f"(descr {quoted(f'tank capacitor, {capacitor.package}, C0G')})",
        "(attr smd)",
        *(
            filled("fp", region, "F.Mask", place, (*owner, "opening", i))
            for i, region in enumerate(_openings(layout, capacitor))
        ),
        courtyard(low, high, owner, _COURTYARD_MARGIN),
        *(pad_text(pad, layout, place, nets, owner, "smd") for pad in capacitor.pads),
        "(embedded_fonts no)",
        *_model(layout, capacitor),
    ]


def _model(layout: Layout, capacitor: Capacitor) -> list[str]:
    """KiCad's own solid of the chip, which lies along x there, turned along the line of the pads."""
    chip = layout.spec.readout.chip
    if chip is None or not chip.model:
        return []
    one, other = (pad.centre for pad in capacitor.pads)
    turned = 90 if abs(one.y - other.y) > abs(one.x - other.x) else 0
    moves = "(offset (xyz 0 0 0))", "(scale (xyz 1 1 1))", f"(rotate (xyz 0 0 {turned}))"
    return [node(f"model {quoted(f'{MODELS}/{chip.model}')}", *moves)]


def _openings(layout: Layout, capacitor: Capacitor) -> list[Region]:
    return [region for region in layout.top_openings if any(_is_over(region, pad) for pad in capacitor.pads)]


def _is_over(region: Region, pad: Pad) -> bool:
    x0, y0, x1, y1 = bounding_box([region.outline])
    return x0 < pad.centre.x < x1 and y0 < pad.centre.y < y1
