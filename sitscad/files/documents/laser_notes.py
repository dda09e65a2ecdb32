"""Notes for the shop that cuts elastomer and target (``laser/readme.txt``)."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

from sitscad.assembly.places.stack import sheets
from sitscad.basics.units import count_text, in_mm, parse_quantity
from sitscad.data import rows
from sitscad.files.documents.preparing import order_of
from sitscad.files.drawing.frame import FORCED
from sitscad.files.order_facts.notes import hanging
from sitscad.kernels.geometry.shapes import PLATES
from sitscad.layout.board import Layout
from sitscad.layout.laser_sheet import (
    COUPON_HOLE,
    COUPON_SIZE,
    LOOKS,
    CutLayer,
    CutPart,
    LaserSheet,
    is_laser_cut,
    joined_part,
)
from sitscad.spec.materials import ElastomerPad
from sitscad.spec.mount import Mount
from sitscad.spec.sensor import SensorSpec

WIDTH = 96
SILICONE = "silicone"


def render(layout: Layout, forced: str = "") -> dict[str, bytes]:
    """Return the text, with a warning first if `forced`. Raises ValueError if a sheet cannot be laid out."""
    cut_sheets = sheets(layout)
    if not cut_sheets:
        return {}
    return {"laser/readme.txt": laser_readme(layout.spec, cut_sheets, bool(forced)).encode("utf-8")}


def laser_readme(spec: SensorSpec, sheets: tuple[LaserSheet, ...], forced: bool = False) -> str:
    """Return the whole page, with a warning at the top if `forced`."""
    lines = [FORCED, ""] if forced else []
    lines += [f"{spec.name}: parts to be cut, for {count_text(spec.fpc.boards or 1, 'sensor')}"]
    lines += [*([f"{spec.issue.title}."] if spec.issue.rows else []), ""]
    for sheet in sheets:
        lines += [*_sheet_lines(spec.cutting.gap, spec.name, spec.web, joined_part(spec), sheet), ""]
    lines.append("Colours and order")
    for number, layer in enumerate((layer for layer in CutLayer if LOOKS[layer].work), 1):
        look = LOOKS[layer]
        lines.append(f"   {number}. {look.colour:<8} {look.rgb}  layer {layer:<10} {look.work}")
    lines += [f"   -  {LOOKS[CutLayer.REF].colour:<8} {LOOKS[CutLayer.REF].rgb}  layer {CutLayer.REF:<10} not cut", ""]
    for material in dict.fromkeys(_part_kind(sheet) for sheet in sheets):
        lines += [*_laser_lines(material), ""]
    if any(sheet.part == "shield" for sheet in sheets):
        lines += [*hanging("", SHIELD, WIDTH), ""]
    for target in (sheet for sheet in sheets if sheet.part == "target"):
        is_soft = target.material in SOFT_METALS and target.thickness <= MAX_SCALPEL_THICKNESS + 1e-9
        by_hand = BY_HAND if is_soft else NOT_BY_HAND
        lines += [*hanging("", WITHOUT_LASER.format(name=spec.name, by_hand=by_hand), WIDTH), ""]
    if (bought := _source_text(spec.elastomer, spec.mount)) is not None:
        lines += [*hanging("", bought, WIDTH), ""]
    return "\n".join([*lines, *hanging("", _kerf_text(sheets), WIDTH)]) + "\n"


WITHOUT_LASER = (
    "Metal without a laser. Etched: send laser/{name}-target.dxf to a maker of photochemically etched parts with "
    "target.kerf 0, so that the drawing is nominal (they allow for their own undercut, about the foil's thickness on "
    "each side); tabs of 0.2 mm hold the pieces in their frame. Punched: for many pieces a punch of the nominal size; "
    "corners then have a radius of 0.1 to 0.3 mm, and a burr on one side, which goes away from the elastomer. "
    "{by_hand} (Unverified, from memory: ask the shop.)"
)

BY_HAND = "By hand: cut with a scalpel along a printed copy, and rub the edge flat."
NOT_BY_HAND = "By hand: not in this metal and thickness. A scalpel does not cut it, and snips bend it."

SOFT_METALS = ("copper", "aluminium")
"""Metals that a scalpel cuts in several passes."""

MAX_SCALPEL_THICKNESS = 0.2e-3
"""Largest thickness (m) of these metals that a scalpel cuts. From memory, not verified."""

SHIELD = (
    "The shield lies hidden under the board, so its edges need not be fine. A flexible ferrite sheet is cut with a "
    "scalpel along a printed copy, its carrier foil still on; foil of metal by scissors, and pressed flat. Sintered "
    "ferrite breaks: buy it in its size. (Unverified, from memory: ask the maker of the sheet.)"
)

def _kerf_text(sheets: tuple[LaserSheet, ...]) -> str:
    """Describe the kerf of each sheet's drawing, and the compensation that the shop sets."""
    kerfs, sentences = {sheet.part: sheet.kerf for sheet in sheets}, ["The kerf."]
    for part, kerf in kerfs.items():
        width = in_mm(COUPON_SIZE)
        if kerf:
            sentences.append(
                f"The {part} is drawn for a kerf of {in_mm(kerf)} mm, half of it outside the part and inside holes: "
                "set no tool compensation. Cut the coupon first: it is right if it is "
                f"{width} mm wide; else write {part}.kerf = {in_mm(kerf)} + {width} - measured width (mm) and build "
                "anew."
            )
        else:
            sentences.append(
                f"The {part} is drawn at nominal size, for the kerf is not known: set your tool's compensation. Or cut "
                f"the coupon without one, write {part}.kerf = {width} - measured width (mm), and build anew."
            )
    return " ".join(sentences)


def _sheet_lines(gap: float, name: str, web: float | None, joined: CutPart | None, sheet: LaserSheet) -> Iterator[str]:
    """Yield the lines of the readme on one sheet.

    `gap` (m) is the distance of neighbouring copies, and `name` the design's name. If webs join all pads to one piece,
    `joined` is this piece and `web` the width (m) of the webs. Otherwise both are None.
    """
    nest, is_joined = sheet.nest, joined is not None and web is not None and sheet.part == "elastomer"
    yield f"laser/{name}-{sheet.name}.dxf and .svg (the same, in mm, full size)"
    yield f"   material   {sheet.material}, {in_mm(sheet.thickness)} mm thick"
    if joined is not None and is_joined:
        yield f"   part       {joined.words}, finished"
    else:
        yield f"   part       {sheet.shape} {PLATES[sheet.shape].size_text(sheet.size)} mm, finished"
    yield f"   pieces     {nest.count} on the sheet" + (f", cut {nest.times} times" if nest.times > 1 else "")
    yield f"   drawing    {in_mm(sheet.width)} x {in_mm(sheet.height)} mm with its notes, which are not cut"
    # Least feature (m) that lasers for this material leave; None if unknown
    material = _part_kind(sheet)
    rows_of_material = [row for row in _table() if row["material"] == material]
    features = [parse_quantity(row["least"], "length") for row in rows_of_material if row["least"]]
    least = max(features) if features else None
    if least is not None:
        # parts and webs are drawn wider by a kerf, so copies are closer by a kerf
        beside = [gap - sheet.kerf] if nest.count > 1 else []
        webs = [web] if web is not None and is_joined else []
        narrow = max(0.0, min(*sheet.size, *beside, *webs, (COUPON_SIZE - COUPON_HOLE) / 2))
        verdict = "wide enough" if narrow >= least else "TOO NARROW: ask for a laser of finer beam"
        yield f"   least      {in_mm(narrow)} mm between two cuts; lasers for it need {in_mm(least)} mm: {verdict}"
    if not is_laser_cut(material, sheet.thickness):
        yield (f"   laser      none that we know cuts {in_mm(sheet.thickness)} mm of {material}: etched or punched "
               "(below), or ask the shop")


def _laser_lines(material: str) -> Iterator[str]:
    lasers = [row for row in _table() if row["material"] == material]
    yield f"Lasers for {material}" + ("" if lasers else ": nothing is known; ask the shop")
    for row in lasers:
        verdict = "cuts" if row["cuts"] == "yes" else "does NOT cut"
        doubt = "" if row["status"] == "verified" else " (unverified)"
        yield from hanging("   ", f"{row['laser']} {verdict}: {row['source']}{doubt}", WIDTH)


def _part_kind(sheet: LaserSheet) -> str:
    return SILICONE if sheet.part == "elastomer" else sheet.material


def _source_text(pad: ElastomerPad | None, mount: Mount | None) -> str | None:
    """Describe where to buy the elastomer's sheet; None if no order code is known."""
    order = None if pad is None else order_of("elastomer", pad.material.name)
    if pad is None or order is None:
        return None
    moulded = "or cast single pads in the mould of mount/, which need no laser"
    if mount is None:
        moulded = "or write mount: {kind: custom} into the spec, which makes a mould for single pads and a jig"
    return (
        f"Where the silicone sheet comes from. {order.code} ({order.maker}) is sold as {order.words}: cast a sheet "
        f"of {in_mm(pad.thickness)} mm between two plates with spacers, {moulded}. Cured sheet of the same hardness is "
        "sold by others: measure its modulus before you trust the estimate."
    )


@cache
def _table() -> tuple[dict[str, str], ...]:
    return rows("laser_cutting")
