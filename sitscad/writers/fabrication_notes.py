"""What the fabricator reads: the order's parameters as plain text, and a drawing of the stack-up."""

from __future__ import annotations

from collections.abc import Iterator
from textwrap import wrap
from xml.sax.saxutils import escape

from sitscad.geometry.path import bounding_box
from sitscad.layout.board import Layout
from sitscad.spec.stackup import LayerKind, StackLayer
from sitscad.units import show
from sitscad.writers._fabrication_files import (
    FOLDER,
    body_files,
    drill_files,
    fabrication_path,
    gerber_files,
    has_coverlay,
    layer_name,
    tail_copper,
    tail_layers,
)

TEXT_WIDTH = 100
DRAWING_WIDTH = 1000.0
FONT = "font-family='Helvetica, Arial, sans-serif'"
COLOURS = {LayerKind.COVERLAY: "#d9a441", LayerKind.COPPER: "#c46a2b", LayerKind.DIELECTRIC: "#f0dfb0"}
STIFFENER_COLOUR = "#b8b8b8"
TOP = 50.0
"""Where the sections begin, in the drawing's units."""


def render(layout: Layout) -> dict[str, bytes]:
    """The readme for the fabricator and the stack-up drawing (SVG) by their paths in the package."""
    return {
        f"{FOLDER}/readme.txt": readme(layout).encode("utf-8"),
        fabrication_path(layout, "stackup.svg"): stackup_drawing(layout).encode("utf-8"),
    }


def readme(layout: Layout) -> str:
    """The order's parameters, what matters to the sensor, and the files, as plain text."""
    sections = [
        _incomplete(layout),
        _section("What to make", _order(layout)),
        _section("Stack-up, from the top", _layers(layout)),
        _section("What the sensor depends on", _care(layout)),
        _section("Test", _test(layout)),
        _section("Files", _files(layout)),
    ]
    title = f"{layout.spec.name}: flexible printed circuit of an inductive sensor"
    return "\n".join([title, "=" * len(title), "", *(line for section in sections for line in section)])


def _section(title: str, rows: Iterator[tuple[str, str]]) -> list[str]:
    """A heading and rows of a name and a text, the text wrapped beside its name."""
    lines = [title, "-" * len(title)]
    pairs = list(rows)
    indent = max(len(name) for name, _ in pairs) + 2
    for name, text in pairs:
        first, *rest = wrap(text, TEXT_WIDTH - indent, break_long_words=False) or [""]
        lines += [f"{name:<{indent}}{first}".rstrip(), *(" " * indent + more for more in rest)]
    return [*lines, ""]


def _incomplete(layout: Layout) -> list[str]:
    """A warning in front of everything where the layout lacks pieces."""
    if not layout.findings:
        return []
    lines = [f"- {finding.rule} {finding.message}" for finding in layout.findings]
    return ["DO NOT ORDER FROM THESE FILES: the layout is not complete.", *lines, ""]


def _order(layout: Layout) -> Iterator[tuple[str, str]]:
    fpc = layout.spec.fpc
    x0, y0, x1, y1 = bounding_box([layout.outline])
    copper = fpc.stackup.copper
    yield "Type", f"flexible circuit, {len(copper)} copper layer{'s' * (len(copper) > 1)}"
    yield "Size", f"{show(x1 - x0, 'm')} x {show(y1 - y0, 'm')} over all (outline file, middle of the line)"
    yield "Thickness", f"{show(fpc.stackup.thickness, 'm')} finished, without stiffener"
    if tail_copper(layout) < len(copper):
        yield "Tail", _thin_tail(layout)
    yield "Smallest track", show(min(trace.width for trace in layout.traces), "m") if layout.traces else "none"
    yield (
        "Coil",
        (f"tracks {show(layout.spec.coil.trace_width, 'm')} wide, {show(layout.spec.coil.trace_spacing, 'm')} apart"),
    )
    yield "Holes", _holes(layout)
    yield "Finish", "ENIG on the bare contacts (IPC-4552)"
    yield "Class", "IPC-6013 class 2 unless the order says otherwise"
    if layout.stiffener is not None:
        yield "Stiffener", _stiffener(layout)
    if fpc.tail is not None and fpc.tail.connector.insertion_thickness > 0.0:
        yield "Contacts", _contacts(layout)
    if layout.bend_zone is not None and fpc.tail is not None:
        a, b = layout.bend_zone
        yield (
            "Bend",
            f"the tail bends ({fpc.tail.bend}) between x = {show(a, 'm')} and x = {show(b, 'm')}: no holes there",
        )
    yield "Made for rules", _rules(layout)


def _thin_tail(layout: Layout) -> str:
    """The tail of fewer layers than the body, and where the others end."""
    first, last = tail_copper(layout) + 1, layout.copper_layers
    lower = f"copper {first}" if first == last else f"copper {first} to {last}"
    (extent,) = body_files(layout)
    return (
        f"beyond x = {show(layout.body[2], 'm')} the board has only its first {first - 1} copper "
        f"layer{'s' * (first > 2)}: {lower} and what lies between end there (file {extent.name}), the bottom coverlay "
        f"goes on; the tail is {show(sum(layer.thickness for layer in tail_layers(layout)), 'm')} thick. "
        f"Holes in the tail go through its own layers, their pads on the others fall away."
    )


def _holes(layout: Layout) -> str:
    if not layout.vias:
        return "none"
    sizes = sorted({(round(via.drill, 9), round(via.pad, 9)) for via in layout.vias})
    counts = [sum((round(v.drill, 9), round(v.pad, 9)) == size for v in layout.vias) for size in sizes]
    kinds = [
        f"{count} of {show(drill, 'm')} (pad {show(pad, 'm')})"
        for count, (drill, pad) in zip(counts, sizes, strict=True)
    ]
    return f"{', '.join(kinds)}, plated, through all layers, finished diameters"


def _stiffener(layout: Layout) -> str:
    plate = layout.stiffener
    assert plate is not None
    x0, y0, x1, y1 = bounding_box([plate.outline.outline])
    where = f"x = {show(x0, 'm')} to {show(x1, 'm')}, y = {show(y0, 'm')} to {show(y1, 'm')}"
    return f"{plate.material}, {show(plate.thickness, 'm')} with its adhesive, on the bottom face, {where}"


def thickness_at_contacts(layout: Layout) -> float:
    """Thickness (m) where the contacts are: the tail's layers without the opened coverlays, with the stiffener."""
    bare = sum(layer.thickness for i, layer in enumerate(tail_layers(layout)) if not _opened(layout, i, layer))
    return bare + (layout.stiffener.thickness if layout.stiffener is not None else 0.0)


def _opened(layout: Layout, index: int, layer: StackLayer) -> bool:
    """Whether a layer, counted from the top, is a coverlay with openings."""
    return layer.kind is LayerKind.COVERLAY and bool(layout.bottom_openings if index else layout.top_openings)


def _contacts(layout: Layout) -> str:
    tail = layout.spec.fpc.tail
    assert tail is not None
    connector = tail.connector
    made, wanted = thickness_at_contacts(layout), connector.insertion_thickness
    allowed = connector.insertion_thickness_tolerance
    text = (
        f"{connector.name}: {len(layout.pads)} contacts, {show(connector.pitch, 'm')} pitch, thickness at the contacts "
        f"{show(wanted, 'm')} +/- {show(allowed, 'm')}; the stack-up and stiffener above give {show(made, 'm')}"
    )
    if abs(made - wanted) > allowed + 1e-9:
        return text + ": THIS IS OUT OF TOLERANCE, change the stiffener before making the board"
    return text


def _rules(layout: Layout) -> str:
    rules = layout.spec.fpc.rules
    checked = f", read on {rules.checked_on}" if rules.checked_on else ""
    x0, y0, x1, y1 = bounding_box([layout.outline])
    small = min(x1 - x0, y1 - y0) < min(rules.part_size) or max(x1 - x0, y1 - y0) < max(rules.part_size)
    panel = "; smaller than the smallest part of these rules: deliver in a panel" if small else ""
    return (
        f"{rules.name} (track {show(rules.trace_width, 'm')}, gap {show(rules.trace_spacing, 'm')}, "
        f"hole {show(rules.via_drill, 'm')}, ring {show(rules.annular_ring, 'm')}){checked}{panel}"
    )


def _layers(layout: Layout) -> Iterator[tuple[str, str]]:
    stackup = layout.spec.fpc.stackup
    for layer, name in zip(stackup.layers, _names(layout), strict=True):
        yield show(layer.thickness, "m"), f"{name}, {layer.material}" if layer.material != name else name
    if stackup.plating_thickness:
        yield "Plating", f"{show(stackup.plating_thickness, 'm')}, contained in the outer copper's thickness above"
    top, bottom = has_coverlay(stackup)
    if top or bottom:
        yield (
            "Coverlay",
            "film and adhesive together; a file without any opening means that this side is closed throughout",
        )


def _names(layout: Layout) -> list[str]:
    """What each layer of the stack-up is called: copper by its file."""
    names, copper = [], 0
    for layer in layout.spec.fpc.stackup.layers:
        if layer.kind is LayerKind.COPPER:
            copper += 1
            names.append(f"copper {copper} ({layer_name(copper, layout.copper_layers)})")
        else:
            names.append("coverlay" if layer.kind is LayerKind.COVERLAY else "dielectric")
    return names


def _care(layout: Layout) -> Iterator[tuple[str, str]]:
    yield (
        "Copper",
        (
            "The coils are the function of this board: add no copper inside the outline (no thieving, fill, marks, "
            "test coupons or closed rings), remove none, add no teardrops."
        ),
    )
    yield "Tracks", "Width and copper thickness set the coils' resistance: tell us before compensating the artwork."
    if layout.copper_layers > 1:
        yield (
            "Dielectric",
            "The thickness between copper layers sets the coils' inductance: do not replace the film by another.",
        )
    yield "Registration", "Layers lie on each other as drawn; no layer is mirrored, all are seen from the top."
    yield "Metal", "No magnetic or conducting part (steel stiffener, shielding film) on or under the coils."


def _test(layout: Layout) -> Iterator[tuple[str, str]]:
    pins = "; ".join(
        f"{net}: {', '.join(str(pad.number) for pad in layout.pads if pad.net == net) or 'no contact'}"
        for net in layout.nets
    )
    yield "Bare board", "100 % continuity and isolation by the IPC-D-356A netlist"
    yield "Nets", f"{len(layout.nets)}, one a coil; the contacts of one coil are joined through its winding ({pins})"


def _files(layout: Layout) -> Iterator[tuple[str, str]]:
    for file in (*gerber_files(layout), *drill_files(layout)):
        kind = "Excellon, metric" if file.path.endswith(".drl") else f"Gerber X2, {file.function}"
        yield file.name, f"{file.title} ({kind})"
    yield _name(layout, "netlist.d356"), "netlist for the bare-board test (IPC-D-356A, micrometres)"
    yield _name(layout, "job.gbrjob"), "Gerber job file: the stack-up and the list of files for CAM"
    yield _name(layout, "stackup.svg"), "drawing of the stack-up"
    yield _name(layout, "board.svg"), "picture of the whole board, for orientation only"
    yield _name(layout, "body.svg"), "picture of the part with the coils, for orientation only"
    yield "Coordinates", "millimetres, one origin for all files"


def _name(layout: Layout, ending: str) -> str:
    return fabrication_path(layout, ending).rpartition("/")[2]


# The drawing: sections through the tail with its contacts (left) and through the body (right), heights to scale.


def stackup_drawing(layout: Layout) -> str:
    """The layers as bars with their thicknesses, heights to scale and lengths not, as SVG text."""
    stackup, plate = layout.spec.fpc.stackup, layout.stiffener
    total = stackup.thickness + (plate.thickness if plate else 0.0)
    scale = max(18.0 / min(layer.thickness for layer in stackup.layers), 260.0 / total)
    scale = min(scale, 1200.0 / total)
    tail = sum(layer.thickness for layer in tail_layers(layout)) + (plate.thickness if plate else 0.0)
    height = TOP + max(stackup.thickness, tail) * scale + 40.0
    heading = (
        f"{layout.spec.name}: stack-up {stackup.name}, {show(stackup.thickness, 'm')} without stiffener; "
        "heights to scale, lengths not"
    )
    parts = [
        f"<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {_n(DRAWING_WIDTH)} {_n(height)}' "
        f"width='{_n(DRAWING_WIDTH)}' height='{_n(height)}' role='img'>",
        f"<title>{escape(layout.spec.name)}: stack-up</title>",
        f"<rect width='{_n(DRAWING_WIDTH)}' height='{_n(height)}' fill='#ffffff'/>",
        f"<g {FONT} font-size='15'>",
        f"<text x='20' y='28' font-size='17'>{escape(heading)}</text>",
        *_tail_section(layout, scale),
        *_body_section(layout, scale),
        "</g>",
        "</svg>",
    ]
    return "\n".join(parts) + "\n"


def _body_section(layout: Layout, scale: float) -> Iterator[str]:
    """All layers, with their captions and a plated hole."""
    y, copper = TOP, []
    for layer, name in zip(layout.spec.fpc.stackup.layers, _names(layout), strict=True):
        h = layer.thickness * scale
        yield _bar(300.0, y, 280.0, h, COLOURS[layer.kind])
        material = f", {layer.material}" if layer.material != name else ""
        yield _caption(y + h / 2, f"{show(layer.thickness, 'm')}  {name}{material}")
        if layer.kind is LayerKind.COPPER:
            copper += [y, y + h]
        y += h
    if layout.vias and copper:
        yield from _barrel(copper[0], copper[-1] - copper[0])
    yield f"<text x='580' y='{_n(y + 22)}' font-size='13' text-anchor='end'>body with the coils</text>"


def _tail_section(layout: Layout, scale: float) -> Iterator[str]:
    """The tail's layers, its opened coverlays shorter, and the stiffener under its end."""
    if layout.spec.fpc.tail is None:
        return
    y = TOP
    for i, layer in enumerate(tail_layers(layout)):
        h, opened = layer.thickness * scale, _opened(layout, i, layer)
        yield _bar(150.0 if opened else 20.0, y, 150.0 if opened else 280.0, h, COLOURS[layer.kind])
        if opened:
            yield f"<text x='20' y='{_n(y + h / 2 + 5)}' font-size='13'>open at the contacts</text>"
        y += h
    plate = layout.stiffener
    if plate is not None:
        h = plate.thickness * scale
        yield _bar(20.0, y, 180.0, h, STIFFENER_COLOUR)
        yield f"<text x='30' y='{_n(y + h / 2 - 4)}' font-size='13'>stiffener, {escape(plate.material)}</text>"
        yield f"<text x='30' y='{_n(y + h / 2 + 14)}' font-size='13'>{show(plate.thickness, 'm')}</text>"
        y += h
    total = f"tail: {show(thickness_at_contacts(layout), 'm')} at the contacts"
    yield f"<text x='20' y='{_n(y + 22)}' font-size='13'>{total}</text>"


def _bar(x: float, y: float, width: float, height: float, fill: str) -> str:
    place = f"x='{_n(x)}' y='{_n(y)}' width='{_n(width)}' height='{_n(height)}'"
    return f"<rect {place} fill='{fill}' stroke='#333333' stroke-width='0.7'/>"


def _caption(y: float, text: str) -> str:
    """What a bar is, beside it at the right, with a line to it."""
    line = f"<path d='M580 {_n(y)}H600' stroke='#333333'/>"
    return f"{line}<text x='606' y='{_n(y + 5)}'>{escape(text)}</text>"


def _barrel(y: float, height: float) -> Iterator[str]:
    """A plated hole through all copper layers."""
    yield f"<rect x='448' y='{_n(y)}' width='20' height='{_n(height)}' fill='#ffffff'/>"
    yield _bar(440.0, y, 8.0, height, COLOURS[LayerKind.COPPER])
    yield _bar(468.0, y, 8.0, height, COLOURS[LayerKind.COPPER])


def _n(value: float) -> str:
    """A number with two decimals at most, never "-0"."""
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text
