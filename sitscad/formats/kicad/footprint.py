"""The contacts of the tail (or the solder pads) as a footprint, on the board and in the project's own library.

It names no 3-D model: the contacts are printed copper, and the connector that takes them is not on this board.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from sitscad.formats.kicad.sexpr import Grid, grid, identity, length, node, polygon_points, quoted, xy
from sitscad.formats.kicad.stackup import copper_names
from sitscad.geometry.path import Path, Region, bounding_box
from sitscad.layout.board import Layout, Pad

REFERENCE = "J1"
FOOTPRINT_NAME = "contacts"

_FONT = "(effects (font (size 1 1) (thickness 0.15)))"
_COURTYARD_MARGIN = 250_000

# One coverlay window over all contacts of an edge connector is how such tails are made (there is no web between
# contacts at 0.5 mm pitch); KiCad takes a window over two nets for an error unless the footprint says that it is meant.
# The contacts are printed copper: neither bought nor placed; in a schematic they are the sensor's symbol.
_ATTRIBUTES = "(attr smd exclude_from_pos_files exclude_from_bom allow_soldermask_bridges)"


def anchor(layout: Layout) -> Grid:
    """Where the footprint stands: the middle of its pads."""
    corners = [corner for pad in layout.pads for corner in _corners(pad)]
    xs, ys = [x for x, _ in corners], [y for _, y in corners]
    return (min(xs) + max(xs)) // 2, (min(ys) + max(ys)) // 2


def contact_openings(openings: Sequence[Region], pads: Sequence[Pad]) -> tuple[Region, ...]:
    """The coverlay openings that lie over any of the pads: they belong to the footprint."""
    return tuple(o for o in openings if any(_overlaps(o.outline, pad) for pad in pads))


def board_footprint(layout: Layout, nets: Mapping[str, int], sheet: Grid) -> str:
    """The footprint as it stands on the board, pads with their nets; `sheet` is the sheet's corner."""
    place = anchor(layout)
    return node(
        f"footprint {quoted(f'{layout.spec.name}:{FOOTPRINT_NAME}')}",
        '(layer "F.Cu")',
        identity(layout.spec.name, "footprint"),
        xy("at", place, sheet),
        *_body(layout, REFERENCE, nets),
    )


def library_footprint(layout: Layout) -> str:
    """The same footprint as a ``.kicad_mod`` file of the project's library."""
    head = "(version 20241229)", '(generator "sitscad")', '(layer "F.Cu")'
    return node(f"footprint {quoted(FOOTPRINT_NAME)}", *head, *_body(layout, "REF**", None)) + "\n"


def _body(layout: Layout, reference: str, nets: Mapping[str, int] | None) -> list[str]:
    """What stands in the footprint of the contacts: texts, openings, pads."""
    place, owner = anchor(layout), (layout.spec.name, "board" if nets is not None else "library")
    low, high = extent(layout.pads)
    low, high = (low[0] - place[0], low[1] - place[1]), (high[0] - place[0], high[1] - place[1])
    tail = layout.spec.fpc.tail
    value = tail.connector.name if tail else "solder pads"
    above, below = low[1] - _COURTYARD_MARGIN - 1_000_000, high[1] + _COURTYARD_MARGIN + 1_000_000
    rows = [
        property_text("Reference", reference, (0, above), owner),
        property_text("Value", value, (0, below), owner),
        f"(descr {quoted(f'{len(layout.pads)} contacts of {layout.spec.name}, {value}')})",
        _ATTRIBUTES,
        *_openings(layout, place, owner),
        courtyard(low, high, owner),
        *(pad_text(pad, layout, place, nets, owner) for pad in layout.pads),
    ]
    return [*rows, "(embedded_fonts no)"]


def property_text(name: str, text: str, at: Grid, owner: tuple[str, ...]) -> str:
    """A property of a footprint, shown on the fabrication layer."""
    place = f"{xy('at', at)[:-1]} 0)"
    return node(f"property {quoted(name)} {quoted(text)}", place, '(layer "F.Fab")', identity(*owner, name), _FONT)


def _openings(layout: Layout, place: Grid, owner: tuple[str, ...]) -> list[str]:
    """The openings of both masks beside the contacts' own."""
    rows = []
    for layer, openings, number in (
        ("F.Mask", layout.top_openings, 1),
        ("B.Mask", layout.bottom_openings, layout.copper_layers),
    ):
        pads = [pad for pad in layout.pads if pad.layer == number]
        for i, region in enumerate(contact_openings(openings, pads)):
            rows.append(filled("fp", region, layer, place, (*owner, layer, i)))
    return rows


def filled(prefix: str, region: Region, layer: str, place: Grid, names: tuple[object, ...]) -> str:
    """A filled polygon without a pen (``gr_poly``, ``fp_poly``) on a layer.

    Raises ValueError for a region with holes, which KiCad's polygons cannot have.
    """
    if region.holes:
        raise ValueError(f"an opening with {len(region.holes)} holes cannot be drawn as a KiCad polygon")
    points = polygon_points(region.outline, place)
    pen = "(stroke (width 0) (type solid)) (fill yes)"
    return f"({prefix}_poly {points} {pen} (layer {quoted(layer)}) {identity(*names)})"


def courtyard(low: Grid, high: Grid, owner: tuple[str, ...], margin: int = _COURTYARD_MARGIN) -> str:
    """The courtyard's rectangle, a margin (nm) round what lies between two corners."""
    start = xy("start", (low[0] - margin, low[1] - margin))
    end = xy("end", (high[0] + margin, high[1] + margin))
    pen = "(stroke (width 0.05) (type solid)) (fill no)"
    return f'(fp_rect {start} {end} {pen} (layer "F.CrtYd") {identity(*owner, "courtyard")})'


def pad_text(
    pad: Pad, layout: Layout, place: Grid, nets: Mapping[str, int] | None, owner: tuple[str, ...], kind: str = "connect"
) -> str:
    """A rectangular pad of a footprint that stands at `place`, with its net where `nets` numbers them."""
    layer = copper_names(layout.copper_layers)[pad.layer - 1]
    if layer not in ("F.Cu", "B.Cu"):
        raise ValueError(f"contact {pad.name} is on {layer}: a contact must be on an outer layer")
    size = f"(size {length(pad.size[0])} {length(pad.size[1])})"
    net = f" (net {nets[pad.net]} {quoted(pad.net)})" if nets is not None and pad.net else ""
    pin = f' (pinfunction {quoted(pad.pin)}) (pintype "passive")' if nets is not None and pad.pin else ""
    where = xy("at", grid(pad.centre), place)
    head = f'pad "{pad.number}" {kind} rect {where} {size} (layers {quoted(layer)})'
    return f"({head}{net}{pin} {identity(*owner, 'pad', pad.number)})"


def _corners(pad: Pad) -> tuple[Grid, Grid]:
    x, y = grid(pad.centre)
    half = round(pad.size[0] * 5e8), round(pad.size[1] * 5e8)
    return (x - half[0], y - half[1]), (x + half[0], y + half[1])


def extent(pads: Sequence[Pad]) -> tuple[Grid, Grid]:
    """The corners of the smallest rectangle round some pads."""
    corners = [corner for pad in pads for corner in _corners(pad)]
    xs, ys = [x for x, _ in corners], [y for _, y in corners]
    return (min(xs), min(ys)), (max(xs), max(ys))


def _overlaps(outline: Path, pad: Pad) -> bool:
    """Whether the boxes of an outline and of a contact overlap."""
    x0, y0, x1, y1 = bounding_box([outline])
    half_x, half_y = pad.size[0] / 2, pad.size[1] / 2
    return (
        x0 < pad.centre.x + half_x
        and x1 > pad.centre.x - half_x
        and y0 < pad.centre.y + half_y
        and y1 > pad.centre.y - half_y
    )
