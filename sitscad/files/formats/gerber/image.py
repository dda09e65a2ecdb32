"""Gerber X2 files of a layout (RS-274X with attributes), Excellon drill files, drill map and job file.

Coordinates are millimetres with six decimals, so that a unit is a nanometre. Tracks are strokes of round apertures
along lines and circular arcs (G01, G02, G03 in multi-quadrant mode). Pads and vias are flashes, openings and stiffener
are regions. Every copper object has its net (``.N``), every contact its component and pin (``.P``), and every aperture
its function.

Drill files follow the XNC subset of Excellon: metric, explicit decimal points, drilling only, X2 attributes in
comments. The drill map is a Gerber drawing of every hole with its tool's symbol, and a table of the tools below the
board. The job file (.gbrjob) states the board, the function of each file, and the stack-up.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from typing import Any

from sitscad.basics.record import record
from sitscad.basics.units import in_mm
from sitscad.basics.version import __version__
from sitscad.files.drawing.frame import tool_symbol
from sitscad.files.drawing.sheet import text_strokes
from sitscad.files.order_facts.files import (
    NO_NET,
    UNIT,
    VENDOR,
    DrilledHole,
    FabricationFile,
    Tool,
    body_files,
    copper_files,
    coverlay_files,
    layer_name,
    millimetres,
    profile_file,
    project_attributes,
    project_guid,
    stiffener_files,
    tail_coverlay_files,
    tools_of,
)
from sitscad.files.order_facts.notes import copper_text
from sitscad.kernels.geometry.areas import areas_beyond
from sitscad.kernels.geometry.path import Arc, Path, Point, Region, Segment, bounding_box, rectangle
from sitscad.layout.board import Layout, Pad, Trace, Via
from sitscad.layout.gaps import Nearness, smallest_gaps
from sitscad.spec.circuit import MASK, LayerKind, StackLayer, Stackup
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.presets import finish
from sitscad.spec.yaml.source import UNNUMBERED, Issue, creation_date

PROFILE_WIDTH = 50e-6  # Width (m) of the line that draws the outline; its middle is the board's edge
FLAT = 1.0  # An arc with a rise below this (units) is drawn as a line: rounding spoils its centre

Grid = tuple[int, int]


def layer_files(layout: Layout) -> dict[str, bytes]:
    """Return all Gerber files of a layout by their paths in the package. They depend on the layout alone."""
    files: dict[str, bytes] = {}
    for file in copper_files(layout.copper_layers, layout.spec.name):
        files[file.path] = document(layout.spec.issue, layout.spec.name, file, _copper(layout, file.layer or 1))
    for file in coverlay_files(layout.spec.fpc.stackup, layout.spec.name):
        openings = layout.top_openings if file.function.endswith("Top") else layout.bottom_openings
        files[file.path] = document(layout.spec.issue, layout.spec.name, file, regions(openings))
    for file in stiffener_files(layout.spec.name, layout.stiffener):
        assert layout.stiffener is not None
        files[file.path] = document(layout.spec.issue, layout.spec.name, file, regions((layout.stiffener.outline,)))
    for file in body_files(layout.spec.name, layout.spec.fpc):
        files[file.path] = document(layout.spec.issue, layout.spec.name, file,
                                    regions((Region(rectangle(*layout.body)),)))
    for file in tail_coverlay_files(layout.spec.name, layout.spec.fpc):
        covered = areas_beyond(layout.outline, layout.lap_start)
        files[file.path] = document(layout.spec.issue, layout.spec.name, file, regions(map(Region, covered)))
    outline = profile_file(layout.spec.name)
    files[outline.path] = document(layout.spec.issue, layout.spec.name, outline, profile(layout.outline))
    return files


def document(
    issue: Issue, name: str, file: FabricationFile, body: Iterable[str],
    attributes: tuple[tuple[str, ...], ...] | None = None,
) -> bytes:
    """Return a whole Gerber file: title, attributes, and `body` with apertures and drawing.

    If `attributes` is None, the file has the board's attributes.
    """
    head = [f"G04 {name}: {file.title}*"]
    head += [f"G04 {issue.words}*"] if issue.rows else []
    head += [f"%TF{','.join(attribute)}*%" for attribute in attributes or project_attributes(issue.revision, name)]
    head += [f"%TF.FileFunction,{file.function}*%", f"%TF.FilePolarity,{file.polarity}*%"]
    head += ["%FSLAX46Y46*%", "%MOMM*%", "%LPD*%", "G75*"]
    return ("\n".join([*head, *body, "M02*"]) + "\n").encode("ascii")


# Copper: each object with its aperture (function, template). The order depends on the layout alone.

CONTACTS = "J1"  # Reference of the tail's contacts; other pads belong to capacitors and thermistor

Object = Trace | Via | Pad
Aperture = tuple[str, str]


def _copper(layout: Layout, layer: int) -> Iterator[str]:
    objects: list[Object] = [
        *layout.on_layer(layer), *layout.vias_on(layer), *(p for p in layout.all_pads if p.layer == layer),
    ]
    tail = layout.spec.fpc.tail
    contact = "ConnectorPad" if tail is not None and tail.connector.insertion_thickness > 0.0 else "SMDPad,CuDef"
    ordered = sorted(((_aperture(item, contact), item.net, order), item) for order, item in enumerate(objects))
    codes = {aperture: 10 + i for i, aperture in enumerate(sorted({key[0] for key, _ in ordered}))}
    for (function, template), code in codes.items():
        yield from (f"%TA.AperFunction,{function}*%", f"%ADD{code}{template}*%", "%TD*%")
    for (aperture, net), group in groupby(ordered, key=lambda entry: entry[0][:2]):
        yield from (f"D{codes[aperture]}*", f"%TO.N,{net or NO_NET}*%")
        for _, item in group:
            yield from _drawn(item)
        yield "%TD*%"
    # The teardrops of a layer as regions, each with its net
    for drop in layout.teardrops:
        if drop.layer == layer:
            yield from ("%TA.AperFunction,Conductor*%", f"%TO.N,{drop.net}*%", "G36*")
            yield from (*stroke(drop.outline), "G37*", "%TD*%")


def _aperture(item: Object, contact: str) -> Aperture:
    if isinstance(item, Trace):
        return "Conductor", f"C,{mm(item.width)}"
    if isinstance(item, Via):
        return "ViaPad", f"C,{mm(item.pad)}"
    function = contact if item.reference == CONTACTS else "SMDPad,CuDef"
    return function, f"R,{mm(item.size[0])}X{mm(item.size[1])}"


def _drawn(item: Object) -> Iterator[str]:
    if isinstance(item, Trace):
        yield from stroke(item.path)
    elif isinstance(item, Via):
        yield f"{xy(grid(item.centre))}D03*"
    else:
        function = f",{item.pin}" if item.pin else ""
        yield f"%TO.P,{item.reference},{item.number}{function}*%"
        yield f"{xy(grid(item.centre))}D03*"
        yield "%TD.P*%"


# Regions and the outline.


def regions(areas: Iterable[Region]) -> Iterator[str]:
    """Yield the commands of filled areas: outlines dark, then holes clear."""
    solid = list(areas)
    # A region needs no aperture, but readers such as gerbv mistake a file without apertures for the format of 1980.
    yield from ("%TA.AperFunction,Material*%", f"%ADD10C,{mm(PROFILE_WIDTH)}*%", "D10*")
    for region in solid:
        yield from ("G36*", *stroke(region.outline), "G37*")
    holes = [hole for region in solid for hole in region.holes]
    if holes:
        yield "%LPC*%"
        for hole in holes:
            yield from ("G36*", *stroke(hole), "G37*")
        yield "%LPD*%"
    yield "%TD*%"


def profile(*paths: Path, function: str = "Profile") -> Iterator[str]:
    """Yield commands that draw paths as thin lines, such as the board's outline.

    `function` is the X2 function of their aperture.
    """
    yield from (f"%TA.AperFunction,{function}*%", f"%ADD10C,{mm(PROFILE_WIDTH)}*%", "%TD*%", "D10*")
    for path in paths:
        yield from stroke(path)


# Strokes: a path as plot commands.


def stroke(path: Path) -> Iterator[str]:
    """Yield the plot commands along a path with the current aperture.

    A closed path ends exactly on the grid point of its start.
    """
    here = first = grid(path.start)
    mode = ""
    yield f"{xy(here)}D02*"
    segments = [piece for segment in path for piece in _halves(segment)]
    for i, segment in enumerate(segments):
        there = first if path.is_closed and i == len(segments) - 1 else grid(segment.end)
        if there == here:
            continue
        target, offset = _plotted(segment, here, there)
        if target != mode:
            yield f"{target}*"
            mode = target
        yield f"{xy(there)}{offset}D01*"
        here = there


def _plotted(segment: Segment, here: Grid, there: Grid) -> tuple[str, str]:
    """Return the mode (G01, G02, G03) of a segment between two grid points, and the centre's offset from the start."""
    if not isinstance(segment, Arc):
        return "G01", ""
    bow = segment.radius * (1.0 - math.cos(min(math.pi, abs(segment.sweep) / 2)))
    if bow < FLAT * UNIT:
        return "G01", ""
    x, y = centre_on_grid(segment.centre, here, there)
    return ("G03" if segment.ccw else "G02"), f"I{x - here[0]}J{y - here[1]}"


def _halves(segment: Segment) -> tuple[Segment, ...]:
    """Return an arc of more than half a turn as two arcs, other segments unchanged.

    Near a full turn, rounding could make an arc an empty arc or a full circle.
    """
    if not isinstance(segment, Arc) or abs(segment.sweep) <= math.pi + 1e-9:
        return (segment,)
    middle = segment.at(0.5)
    centre, ccw = segment.centre, segment.ccw
    return Arc(segment.start, middle, centre, ccw), Arc(middle, segment.end, centre, ccw)


def centre_on_grid(centre: Point, start: Grid, end: Grid) -> Grid:
    """Return the grid point near `centre` whose distances from `start` and `end` are most nearly equal.

    The centre (m) is first moved onto the perpendicular bisector of the chord. Then the best of 25 grid points around
    it is taken. Rounding alone would leave two radii that differ by up to about 3 nm. The remaining difference is a
    fraction of a nanometre, far below the tolerances of Gerber readers.
    """
    x, y, ux, uy = centre.x / UNIT, centre.y / UNIT, end[0] - start[0], end[1] - start[1]
    fraction = ((x - (start[0] + end[0]) / 2) * ux + (y - (start[1] + end[1]) / 2) * uy) / (ux * ux + uy * uy)
    x, y = x - fraction * ux, y - fraction * uy
    near = [(round(x) + i, round(y) + j) for i in range(-2, 3) for j in range(-2, 3)]
    return min(near, key=lambda c: (abs(math.dist(c, start) - math.dist(c, end)) + 0.05 * math.dist(c, (x, y)), c))


def grid(point: Point) -> Grid:
    """Return a point (m) in whole units of the file."""
    return round(point.x / UNIT), round(point.y / UNIT)


def xy(at: Grid) -> str:
    """Return the coordinates of a grid point as Gerber text."""
    return f"X{at[0]}Y{at[1]}"


def mm(length: float) -> str:
    """Return a length (m) in millimetres with at most six decimals."""
    return in_mm(length, 6, 1)


_COORDINATES = re.compile(r"X(-?\d+)Y(-?\d+)")
_CODE = re.compile(r"(%AD|^)D(\d{2,})")
_FIRST_CODE = 10


# Repeated Gerber files: the board's finished file drawn once for every copy, moved by whole nanometres. A copy is
# therefore exactly equal to the board's own file. Nets and pins would be equal in every copy and are left out: the
# netlist belongs to the single board.


@record
class Image:
    """Drawing of a file without its head: apertures with their attributes, and plot commands."""

    apertures: tuple[str, ...]
    commands: tuple[str, ...]

    @property
    def codes(self) -> int:
        """Number of aperture codes in use, counted from 10."""
        numbers = [int(match[2]) for line in self.apertures if (match := _CODE.match(line))]
        return max(numbers, default=_FIRST_CODE - 1) + 1 - _FIRST_CODE


def image_of(text: bytes) -> Image:
    """Return the image of a Gerber file that sitscad wrote. Raises ValueError for a file of another form."""
    lines = text.decode("ascii").splitlines()
    if "G75*" not in lines or lines[-1] != "M02*":
        raise ValueError("a Gerber file of another form cannot be repeated")
    body = lines[lines.index("G75*") + 1 : -1]
    last = max((i for i, line in enumerate(body) if line.startswith("%AD")), default=-1)
    apertures = [line for line in body[: last + 1] if line.startswith(("%AD", "%TA", "%TD"))]
    commands = [line for line in body if not line.startswith(("%AD", "%T"))]
    return Image(tuple([*apertures, "%TD*%"] if apertures else ()), tuple(commands))


def repeated(images: Iterable[tuple[Image, Iterable[Point]]]) -> Iterator[str]:
    """Yield the apertures of all images, then the commands of each image at each of its places.

    `images` are pairs of an image and its places (shifts in metres).
    """
    lines, first = [], 0
    for image, places in images:
        yield from (_renumbered(line, first) for line in image.apertures)
        lines.append(([_renumbered(line, first) for line in image.commands], [grid(at) for at in places]))
        first += image.codes
    for commands, moves in lines:
        for dx, dy in moves:
            yield from (_moved(line, dx, dy) for line in commands)


def _renumbered(line: str, first: int) -> str:
    return _CODE.sub(lambda match: f"{match[1]}D{int(match[2]) + first}", line)


def _moved(line: str, dx: int, dy: int) -> str:
    return _COORDINATES.sub(lambda match: f"X{int(match[1]) + dx}Y{int(match[2]) + dy}", line)


def drill_text(
    title: str, function: str, attributes: Iterable[tuple[str, ...]], holes: Sequence[DrilledHole], use: str
) -> bytes:
    """Return a drill file. ``function`` is its X2 file function, ``use`` the purpose of the holes (``ViaDrill``)."""
    plating, *_, kind = function.split(",")
    tools = tools_of(holes)
    lines = ["M48", f"; {title}, tool sizes are finished holes"]
    lines += [f"; #@! TF{','.join(attribute)}" for attribute in (*attributes, (".FileFunction", function))]
    lines += ["METRIC", ";TYPE=PLATED" if plating == "Plated" else ";TYPE=NON_PLATED"]
    for code, (diameter, _) in enumerate(tools, 1):
        lines += [f"; #@! TA.AperFunction,{plating},{kind},{use}", f"T{code}C{millimetres(diameter, 3)}"]
    lines += ["%", "G05"]
    for code, (_, drilled) in enumerate(tools, 1):
        lines += [f"T{code}", *(f"X{millimetres(hole.x)}Y{millimetres(hole.y)}" for hole in drilled)]
    return ("\n".join([*lines, "M30"]) + "\n").encode("ascii")


PEN = 0.05e-3
TEXT_PEN = 0.1e-3
LINE = 2.0e-3  # Line spacing of the table (m)
TEXT_HEIGHT = 1.0e-3


def map_text(outline: Path, tools: Sequence[Tool]) -> Iterator[str]:
    """Yield the body of a drill map: outline, holes, table."""
    yield from ("%TA.AperFunction,Drawing*%", f"%ADD10C,{mm(PEN)}*%", f"%ADD11C,{mm(TEXT_PEN)}*%", "%TD*%", "D10*")
    yield from stroke(outline)
    for order, tool in enumerate(tools):
        for hole in tool.holes:
            at = Point(hole.x * UNIT, hole.y * UNIT)
            for path in tool_symbol(order, at, max(hole.diameter * UNIT, 0.25e-3) / 2.0):
                yield from stroke(path)
    x0, y0, _, _ = bounding_box([outline])
    yield "D11*"
    for order, tool in enumerate(tools):
        at = Point(x0 + LINE / 2, y0 - (order + 1) * LINE)
        label = f"{millimetres(tool.diameter, 3)} MM {len(tool.holes)} {tool.words.upper()}, FINISHED"
        text = text_strokes(label, at.shifted(LINE, -TEXT_HEIGHT / 2), TEXT_HEIGHT)
        for path in (*tool_symbol(order, at, TEXT_HEIGHT / 2), *text):
            yield from stroke(path)


def job_document(layout: Layout, files: Sequence[FabricationFile], size: tuple[float, float]) -> bytes:
    """Return the job file of the board, or of its panel.

    ``size`` (m) is measured along the middle of the outline's line. The thickness excludes the stiffener. Lengths in
    the file are millimetres.
    """
    software = {"Vendor": VENDOR, "Application": VENDOR, "Version": __version__}
    created, issue = creation_date(), layout.spec.issue
    length, width = size
    name, revision = layout.spec.name, issue.revision or UNNUMBERED
    job: dict[str, Any] = {
        "Header": {
            "GenerationSoftware": software,
            **({"CreationDate": created} if created else {}),
            **({"Comment": issue.title} if issue.rows else {}),
        },
        "GeneralSpecs": {
            "ProjectId": {"Name": name, "GUID": project_guid(name), "Revision": revision},
            "Size": {"X": _mm(length), "Y": _mm(width)},
            "LayerNumber": layout.copper_layers,
            "BoardThickness": _mm(layout.spec.fpc.stackup.thickness),
            "Finish": finish(layout.spec.fpc.finish).job_name,
        },
        "DesignRules": _rules(layout.copper_layers, layout.spec.fpc.rules, layout.traces, smallest_gaps(layout)),
        "FilesAttributes": [
            {"Path": file.name, "FileFunction": file.function, "FilePolarity": file.polarity}
            for file in files
        ],
        "MaterialStackup": list(_stackup(layout.copper_layers, layout.spec.fpc.stackup)),
    }
    return (json.dumps(job, indent=2, ensure_ascii=True) + "\n").encode("ascii")


def _rules(
    copper_layers: int, rules: DesignRules, traces: tuple[Trace, ...], gaps: dict[int, Nearness]
) -> list[dict[str, Any]]:
    """Return the smallest gap and track width of outer and of inner copper as drawn.

    Without such copper, the values of the design rules are returned.
    """
    count = copper_layers
    rules_rows = []
    for group, layers in {"Outer": {1, count}, "Inner": set(range(2, count))}.items():
        gap = min((near.gap for number, near in gaps.items() if number in layers), default=rules.trace_spacing)
        width = min((trace.width for trace in traces if trace.layer in layers), default=rules.trace_width)
        if layers:
            rules_rows.append({"Layers": group, **dict.fromkeys(("PadToPad", "PadToTrack", "TrackToTrack"), _mm(gap)),
                          "MinLineWidth": _mm(width)})
    return rules_rows


def _stackup(count: int, stackup: Stackup) -> Iterator[dict[str, Any]]:
    """Yield every layer from the top. A coverlay has the type solder mask, and a note states its material."""
    copper = coverlay = 0
    for layer in stackup.layers:
        if layer.kind is LayerKind.COPPER:
            copper += 1
            row = {"Type": "Copper", "Thickness": _mm(layer.thickness), "Name": layer_name(copper, count)}
            yield {**row, "Notes": copper_text(stackup, layer)}
        elif layer.kind is LayerKind.COVERLAY:
            coverlay += 1
            side = "Bottom" if copper else "Top"
            notes = "" if layer.material == MASK else "Flexible coverlay, polyimide film and adhesive together"
            yield _row("SolderMask", layer, f"{side} {layer.material if layer.material == MASK else 'coverlay'}", notes)
        else:
            yield _row("Dielectric", layer, f"{layer_name(copper, count)}/{layer_name(copper + 1, count)}")


def _row(kind: str, layer: StackLayer, name: str, notes: str = "") -> dict[str, Any]:
    row: dict[str, Any] = {"Type": kind, "Thickness": _mm(layer.thickness), "Material": layer.material, "Name": name}
    if kind == "Dielectric" and layer.relative_permittivity is not None:
        row["DielectricConstant"] = layer.relative_permittivity
    return {**row, "Notes": notes} if notes else row


def _mm(length: float) -> float:
    return round(length * 1e3, 6)
