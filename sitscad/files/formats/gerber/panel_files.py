"""Panel files in ``fpc/panel/``: copies of every layer, marks of the frame, cuts, holes, and a list of places."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from sitscad.files.drawing.sheet import stroke_length, text_strokes
from sitscad.files.formats.gerber.image import (
    Image,
    document,
    drill_text,
    grid,
    image_of,
    job_document,
    layer_files,
    map_text,
    mm,
    profile,
    regions,
    repeated,
    stroke,
    xy,
)
from sitscad.files.order_facts.files import (
    CUTS,
    DrilledHole,
    FabricationFile,
    Tool,
    body_files,
    cut_file,
    drill_files,
    drill_map_file,
    drill_title,
    drilled_to,
    gerber_files,
    on_grid,
    panel_attributes,
    panel_files,
    panel_path,
    plated_words,
    profile_file,
    tooling_file,
    tools,
)
from sitscad.files.writer import json_bytes
from sitscad.kernels.geometry.path import Path, Point, Region, rectangle
from sitscad.layout.board import Layout
from sitscad.layout.panel import FIDUCIAL, FIDUCIAL_OPENING, TOOLING_HOLE, Bridge, Panel, bridge_ends
from sitscad.spec.yaml.source import Issue

TEXT_HEIGHT = 1.5e-3
TEXT_PEN = 0.2e-3


def render(panel: Panel | None, files: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return the panel's files by their paths. Empty if there is no panel.

    ``files`` are the files of the single board, which are repeated unchanged.
    """
    if panel is None:
        return {}
    layout = panel.layout
    name, issue = layout.spec.name, layout.spec.issue
    contents: dict[str, bytes] = {}
    coupon = layer_files(panel.coupon) if panel.coupon is not None else {}
    for file in gerber_files(layout.spec.name, layout.spec.fpc, layout.stiffener):
        if file == profile_file(name):
            continue
        images = [(image_of(files[file.path]), panel.parts)]
        if file.path in coupon:
            images.append((image_of(coupon[file.path]), panel.coupons))
        images += _lower_layers(panel, file)
        images.append((Image(*_marks(panel, file)), (Point(0.0, 0.0),)))
        contents |= _file(name, issue, file, repeated(images))
    contents |= _file(name, issue, profile_file(name), profile(rectangle(0.0, 0.0, *panel.size)))
    contents |= _file(name, issue, cut_file(name), profile(*panel.cuts, function="CutOut"))
    job = job_document(layout, panel_files(layout.spec.name, layout.spec.fpc, layout.stiffener, layout.spans),
                       panel.size)
    return contents | _drills(panel) | {panel_path(name, ".json"): _places(panel), panel_path(name, "-job.gbrjob"): job}


def _file(name: str, issue: Issue, file: FabricationFile, body: Iterator[str]) -> dict[str, bytes]:
    path = file.path if file.function == CUTS else panel_path(name, file.path.removeprefix(f"fpc/{name}"))
    titled = replace(file, path=path, title=f"panel: {file.title}")
    return {path: document(issue, name, titled, body, panel_attributes(issue.revision, name))}


def _lower_layers(panel: Panel, file: FabricationFile) -> list[tuple[Image, tuple[Point, ...]]]:
    """Return (image, places (m)) of rails and coupon, for a file with the extent of layers missing from tails.

    The rails have one place, the coupon one for each copy. Empty for other files.
    """
    layout, coupon = panel.layout, panel.coupon
    if file not in body_files(layout.spec.name, layout.spec.fpc):
        return []
    (width, height), rail = panel.size, panel.rail
    rails = [
        rectangle(0.0, 0.0, width, rail), rectangle(0.0, height - rail, width, height),
        rectangle(0.0, rail, rail, height - rail), rectangle(width - rail, rail, width, height - rail),
    ]
    frame = image_of(document(layout.spec.issue, layout.spec.name, file, regions(Region(each) for each in rails)))
    images: list[tuple[Image, tuple[Point, ...]]] = [(frame, (Point(0.0, 0.0),))]
    if coupon is not None:
        images.append((image_of(document(layout.spec.issue, layout.spec.name, file,
                                         regions((Region(coupon.outline),)))), panel.coupons))
    return images


def _marks(panel: Panel, file: FabricationFile) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return apertures and commands of the frame's marks in a file.

    Fiducials are on both outer copper layers, the name on the first. Mask files have openings over the fiducials.
    """
    if file.function.startswith("Soldermask"):
        opened = ("%TA.AperFunction,Material*%", f"%ADD10C,{mm(FIDUCIAL_OPENING)}*%", "%TD*%")
        return opened, ("D10*", *_flashes(panel))
    if file.layer not in (1, panel.layout.copper_layers):
        return (), ()
    dots = ("%TA.AperFunction,FiducialPad,Global*%", f"%ADD10C,{mm(FIDUCIAL)}*%", "%TD*%")
    if file.layer != 1:
        return dots, ("D10*", *_flashes(panel))
    pen = ("%TA.AperFunction,NonConductor*%", f"%ADD11C,{mm(TEXT_PEN)}*%", "%TD*%")
    written = (command for line in _name(panel) for command in stroke(line))
    return (*dots, *pen), ("D10*", *_flashes(panel), "D11*", *written)


def _flashes(panel: Panel) -> Iterator[str]:
    return (f"{xy(grid(at))}D03*" for at in panel.fiducials)


def _name(panel: Panel) -> Iterator[Path]:
    """Yield the strokes of the design's name, between the fiducials of the lower rail.

    The name is cut off if the rail is too short.
    """
    room = panel.fiducials[1].x - panel.fiducials[0].x - 2 * FIDUCIAL_OPENING
    text = f"{panel.layout.spec.name} {panel.columns}x{panel.rows}"
    while text and stroke_length(text, TEXT_HEIGHT) > room:
        text = text[:-1]
    x = (panel.size[0] - stroke_length(text, TEXT_HEIGHT)) / 2 if text else 0.0
    return text_strokes(text, Point(x, (panel.rail - TEXT_HEIGHT) / 2), TEXT_HEIGHT)


def _drills(panel: Panel) -> dict[str, bytes]:
    """Return a file of plated holes per span of layers, a file of unplated holes, and the map of all holes."""
    layout = panel.layout
    tooling = [DrilledHole(on_grid(at.x), on_grid(at.y), on_grid(TOOLING_HOLE)) for at in panel.tooling_holes]
    attributes = panel_attributes(layout.spec.issue.revision, layout.spec.name)
    contents: dict[str, bytes] = {}
    shown: list[Tool] = []
    for file in drill_files(layout.copper_layers, layout.spans, layout.spec.name):
        # Plated holes of all copies, for one span of layers
        plated = [hole for at in panel.parts for hole in drilled_to(layout, file.layer, *grid(at))]
        if panel.coupon is not None:
            plated += [hole for at in panel.coupons for hole in drilled_to(panel.coupon, file.layer, *grid(at))]
        path = panel_path(layout.spec.name, file.path.removeprefix(f"fpc/{layout.spec.name}"))
        title = drill_title(layout.spec.issue.words, layout.spec.name, f"panel: {file.title}")
        contents[path] = drill_text(title, file.function, attributes, plated, "ViaDrill")
        shown += tools(plated, plated_words(layout.spans, file.layer or layout.copper_layers))
    holes = tooling_file(layout.copper_layers, layout.spec.name)
    title = drill_title(layout.spec.issue.words, layout.spec.name, f"panel: {holes.title}")
    contents[holes.path] = drill_text(title, holes.function, attributes, tooling, "ComponentDrill")
    drill_map = drill_map_file(panel_path(layout.spec.name, "-Drill_Map.gbr"))
    drawing = map_text(rectangle(0.0, 0.0, *panel.size), [*shown, *tools(tooling, "not plated")])
    return contents | {drill_map.path: document(layout.spec.issue, layout.spec.name, drill_map, drawing, attributes)}


def _places(panel: Panel) -> bytes:
    """Return the list of places (mm), from the panel's lower left corner. Bridges count from their copy's origin."""

    def points(places: tuple[Point, ...]) -> list[list[float]]:
        return [[round(at.x * 1e3, 6), round(at.y * 1e3, 6)] for at in places]

    document = {
        "unit": "mm",
        "size": [round(side * 1e3, 6) for side in panel.size],
        "parts": points(panel.parts),
        "coupons": points(panel.coupons),
        "bridges": _bridge_ends(panel.layout, panel.bridges, panel.parts),
        "coupon_bridges": _bridge_ends(panel.coupon, panel.coupon_bridges, panel.coupons),
        "tooling_holes": points(panel.tooling_holes),
        "tooling_hole_diameter": round(TOOLING_HOLE * 1e3, 6),
        "fiducials": points(panel.fiducials),
        "fiducial_diameter": round(FIDUCIAL * 1e3, 6),
        "fiducial_opening": round(FIDUCIAL_OPENING * 1e3, 6),
    }
    return json_bytes(document)


def _bridge_ends(part: Layout | None, stops: tuple[Bridge, ...], copies: tuple[Point, ...]) -> list[list[list[float]]]:
    """Return the ends (mm) of a part's bridges, rounded exactly as in the cuts around the part's first copy."""
    if part is None or not copies:
        return []
    (dx, dy), first = grid(copies[0]), copies[0]
    ends = (tuple(grid(end.shifted(*first)) for end in pair) for pair in bridge_ends(part.outline, stops))
    return [[[(x - dx) / 1e6, (y - dy) / 1e6] for x, y in pair] for pair in ends]
