"""From areas and holes to nets: which copper hangs together, which contacts it joins, whether it closes on itself.

What the finished files make, held against what they say: shorts, opens, loops, holes that miss their pads; and the
Gerber job file held against the files beside it: which file is which layer, and in which order they lie.
"""

from __future__ import annotations

import json
import math
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely import Polygon, STRtree
from shapely.geometry.base import BaseGeometry

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.files.extraction.artwork import UNLISTED, Artwork, Flash, PlottedHole, file_functions, read_artwork
from sitscad.files.extraction.intent import Mark, MarkSource, read_marks
from sitscad.files.extraction.limits import ExtractionError, content_of

REACH = 1e-6
"""How far (m) from its copper a mark may stand: the resolution of an IPC-D-356 coordinate."""

SMALLEST_LOOP = 1e-12
"""Holes in the copper of a smaller area (m2) are the reader's own chords, not a loop: 1 um x 1 um."""


@record
class Piece:
    """One connected area of copper on one layer (from 1 at the top)."""

    layer: int
    shape: Polygon


@record
class BarePad:
    """A pad that an outside conductor meets: pin, function and intended net as the files name them, and its area."""

    pin: str
    function: str | None
    net: str
    layer: int
    x: float
    y: float
    shape: BaseGeometry


@record
class Loop:
    """A closed way round in the copper of one net. Either a hole in one layer's copper, ``layer`` and the ``area``
    inside it (m2), or a way through several layers that the hole at (x, y) closes (``layer`` None, ``area`` nan).
    """

    x: float
    y: float
    layer: int | None = None
    area: float = math.nan


@record
class ExtractedNet:
    """Copper that hangs together: its pieces and plated holes, the intended nets and contacts met on it, its loops. The
    number of loops is the first Betti number of the net: holes in the pieces, and independent cycles of the graph whose
    nodes are pieces and plated holes.
    """

    pieces: tuple[Piece, ...]
    holes: tuple[PlottedHole, ...]
    names: tuple[str, ...]
    contacts: tuple[BarePad, ...]
    loops: tuple[Loop, ...]


@record
class ExtractedBoard:
    """A board as its finished files make it, and what they say that it should be (``marks``)."""

    artwork: Artwork
    marks: tuple[Mark, ...]
    astray: tuple[Mark, ...]
    nets: tuple[ExtractedNet, ...]

    def net(self, name: str) -> ExtractedNet:
        """The one extracted net on which an intended net was met. Raises KeyError when there is none or several."""
        found = [net for net in self.nets if name in net.names]
        if len(found) != 1:
            raise KeyError(f"{len(found)} extracted nets carry {name!r}")
        return found[0]


def extract(directory: str | Path, growth: float = 0.0) -> ExtractedBoard:
    """The nets of the Gerber and drill files in a directory, or in its ``fpc`` folder if it has one. ``growth`` (m) is
    added on every side of the copper before it is joined: with almost half the least spacing, copper that stands too
    close counts as touching. Raises ExtractionError when the files do not make up a board.
    """
    directory = Path(directory)
    directory = directory / "fpc" if (directory / "fpc").is_dir() else directory
    artwork = read_artwork(directory)
    return nets_of(artwork, read_marks(directory, artwork.sources), growth)


def nets_of(artwork: Artwork, marks: tuple[Mark, ...], growth: float = 0.0) -> ExtractedBoard:
    """The nets of some artwork, its copper grown by ``growth`` (m) on every side before it is joined."""
    pieces = [
        Piece(layer, part) for layer, area in enumerate(artwork.copper, start=1)
        for part in shapely.get_parts(area.buffer(growth) if growth else area)
        if isinstance(part, Polygon) and not part.is_empty
    ]
    holes = [hole for hole in artwork.holes if hole.is_plated]
    trees = {layer: _LayerTree(layer, pieces) for layer in range(1, len(artwork.copper) + 1)}
    parts = _DisjointSets(len(pieces) + len(holes))
    closing: dict[int, list[Loop]] = defaultdict(list)
    for number, hole in enumerate(holes, start=len(pieces)):
        for layer in hole.layers:
            for piece in trees[layer].near(hole.shape, 0.0):
                if not parts.join(number, piece):
                    closing[piece].append(Loop(hole.x, hole.y))
    names: dict[int, set[str]] = defaultdict(set)
    contacts: dict[int, list[BarePad]] = defaultdict(list)
    astray = []
    flashes = {(flash.layer, *_cell(flash.x, flash.y)): flash for flash in artwork.flashes}
    for mark, pieces_under in zip(marks, _pieces_under(marks, trees), strict=True):
        met = {parts.root(piece) for piece in pieces_under}
        if not met:
            astray.append(mark)
        for root in met:
            names[root].add(mark.net)
            contacts[root] += _contacts(mark, flashes)
    groups: dict[int, list[int]] = defaultdict(list)
    for number in range(len(pieces) + len(holes)):
        groups[parts.root(number)].append(number)
    nets = []
    for root, members in groups.items():
        own = [pieces[n] for n in members if n < len(pieces)]
        loops = [loop for piece in own for loop in _windows(piece)] + [loop for n in members for loop in closing[n]]
        own_holes = tuple(holes[n - len(pieces)] for n in members if n >= len(pieces))
        own_names = tuple(sorted(names[root]))
        # Both sources name the same pad, and the Gerber file, which comes first, knows more of it
        pads: dict[tuple[int, int, int], BarePad] = {}
        for contact in contacts[root]:
            pads.setdefault((contact.layer, *_cell(contact.x, contact.y)), contact)
        nets.append(ExtractedNet(tuple(own), own_holes, own_names, tuple(pads.values()), tuple(loops)))
    return ExtractedBoard(artwork, marks, tuple(astray), tuple(nets))


def _windows(piece: Piece) -> list[Loop]:
    """The holes in one piece's area, as loops."""
    inside = [Polygon(ring) for ring in piece.shape.interiors]
    points = [window.representative_point() for window in inside]
    return [
        Loop(point.x, point.y, piece.layer, window.area)
        for window, point in zip(inside, points, strict=True)
        if window.area > SMALLEST_LOOP
    ]


def _pieces_under(marks: Sequence[Mark], trees: dict[int, _LayerTree]) -> list[list[int]]:
    found: list[list[int]] = [[] for _ in marks]
    for layer, tree in trees.items():
        here = [k for k, mark in enumerate(marks) if mark.layer in (None, layer)]
        points = np.array([(marks[k].x, marks[k].y) for k in here]).reshape(-1, 2)
        for k, under in zip(here, tree.under(points, REACH), strict=True):
            found[k] += under
    return found


def _cell(x: float, y: float) -> tuple[int, int]:
    return round(x * 1e9), round(y * 1e9)


def _contacts(mark: Mark, flashes: dict[tuple[int, int, int], Flash]) -> list[BarePad]:
    """The contact that a mark names, where a pad is flashed at just that place."""
    if mark.pin is None or mark.layer is None:
        return []
    flash = flashes.get((mark.layer, *_cell(mark.x, mark.y)))
    if flash is None:
        return []
    return [BarePad(mark.pin, mark.function, mark.net, mark.layer, flash.x, flash.y, flash.shape)]


class _LayerTree:
    """The pieces of one layer, to be asked for by place."""

    def __init__(self, layer: int, pieces: list[Piece]) -> None:
        self._numbers = [number for number, piece in enumerate(pieces) if piece.layer == layer]
        self._shapes = [pieces[number].shape for number in self._numbers]
        shapely.prepare(self._shapes)
        self._tree = STRtree(self._shapes)

    def near(self, shape: BaseGeometry, distance: float) -> list[int]:
        """The numbers of the pieces within a distance (m) of a shape."""
        return sorted(self._numbers[i] for i in self._tree.query(shape, predicate="dwithin", distance=distance))

    def under(self, points: Array, distance: float) -> list[list[int]]:
        """The numbers of the pieces within a distance (m) of each of many points (n, 2). A coil is one piece with
        thousands of corners: its edges are indexed once, not walked for every point.
        """
        found: list[list[int]] = [[] for _ in points]
        places = shapely.points(points)
        for number, shape in zip(self._numbers, self._shapes, strict=True):
            low, high = np.array(shape.bounds).reshape(2, 2)
            inside = np.all((points >= low - distance) & (points <= high + distance), axis=1)
            (near,) = np.nonzero(inside)
            for k in near[shapely.dwithin(shape, places[near], distance)]:
                found[k].append(number)
        return found


class _DisjointSets:
    """Sets of numbers that grow together (union-find)."""

    def __init__(self, count: int) -> None:
        self._parent = list(range(count))

    def root(self, number: int) -> int:
        while self._parent[number] != number:
            self._parent[number] = self._parent[self._parent[number]]
            number = self._parent[number]
        return number

    def join(self, a: int, b: int) -> bool:
        """Join the sets of two numbers; False when they were one already."""
        a, b = self.root(a), self.root(b)
        self._parent[max(a, b)] = min(a, b)
        return a != b


PAD_EDGE = 1e-6
"""How far (m) round a flashed pad copper counts as the pad's own."""

OPEN_RIM = 0.3e-3
"""How far (m) round a contact the coverlay's opening may bare copper: openings are larger than what they open by the
registration of the coverlay, which is 0.05 to 0.2 mm."""

HELD = 0.5
"""The share of a contact that may be under the coverlay: rims of solder pads and the ends of fingers are held so."""

ROUNDED = 2.6e-6
"""Netlists round a hole's diameter (m) by so much: to a ten-thousandth of an inch."""

SMALLEST_TRACK = 1e-9
"""Copper beyond the pads that is no more than this (m2) is no track: a square of 30 um."""


class DifferenceKind(StrEnum):
    """What is wrong."""

    SHORT = "short"
    OPEN = "open"
    LOOP = "loop"
    NO_COPPER = "no-copper"
    NO_NET = "no-net"
    NO_INTENT = "no-intent"
    NO_HOLE = "no-hole"
    HOLE_SIZE = "hole-size"
    HOLE_OFF_PAD = "hole-off-pad"
    NETLISTS = "netlists-differ"
    COVERED = "covered-contact"
    DEAD_END = "dead-end"
    NO_LAYER = "no-layer"
    BARE = "bare-copper"
    EXPOSED = "exposed-copper"


@record
class Difference:
    """One difference between the files' copper and the files' intent, and where it stands (m, layer from 1)."""

    kind: DifferenceKind
    message: str
    nets: tuple[str, ...] = ()
    x: float | None = None
    y: float | None = None
    layer: int | None = None


def compare(board: ExtractedBoard) -> tuple[Difference, ...]:
    """Every difference between the extracted nets and the intended ones; nothing when the files keep their word. A coil
    is copper from one contact to the other, so both contacts belong to one net; turns that touch do not change that,
    but they close a loop, which no net of a coil may have.
    """
    looks = (_nets, _holes, _netlists, _openings, _dead_ends, _beyond_their_layers, _bare)
    return tuple(difference for look in looks for difference in look(board))


def _place(x: float, y: float, layer: int | None) -> str:
    where = ", ".join(f"{axis} {round(at * 1e3, 6) + 0.0:.4g} mm" for axis, at in (("x", x), ("y", y)))
    return f"{where}, layer {layer}" if layer else where


def _nets(board: ExtractedBoard) -> Iterator[Difference]:
    """Nets that are joined or fall into parts, copper without a net, nets without copper, closed loops."""
    if not board.marks:
        yield Difference(DifferenceKind.NO_INTENT, "no file names a net: there is nothing to compare the copper with")
    for net in board.nets:
        x, y, layer = _somewhere(net)
        if len(net.names) > 1:
            yield Difference(DifferenceKind.SHORT, f"{' and '.join(net.names)} are joined", net.names, x, y, layer)
        if not net.names:
            said = f"copper at {_place(x, y, layer)} belongs to no net"
            yield Difference(DifferenceKind.NO_NET, said, (), x, y, layer)
        for loop in net.loops:
            what = f"round {loop.area * 1e6:.4g} mm2" if loop.layer else "through the hole there and another one"
            place = _place(loop.x, loop.y, loop.layer)
            message = f"{', '.join(net.names) or 'copper'} closes a loop at {place}, {what}"
            yield Difference(DifferenceKind.LOOP, message, net.names, loop.x, loop.y, loop.layer)
    for name in sorted({mark.net for mark in board.marks}):
        parts = [net for net in board.nets if name in net.names]
        if len(parts) > 1:
            places = "; ".join(_place(*_somewhere(net)) for net in parts)
            x, y, layer = _somewhere(parts[1])
            yield Difference(DifferenceKind.OPEN, f"{name} is in {len(parts)} parts: {places}", (name,), x, y, layer)
    for mark in board.astray:
        what = f"contact {mark.pin} of {mark.net}" if mark.pin else mark.net
        message = f"{what} should have copper at {_place(mark.x, mark.y, mark.layer)} ({mark.source})"
        yield Difference(DifferenceKind.NO_COPPER, message, (mark.net,), mark.x, mark.y, mark.layer)


def _holes(board: ExtractedBoard) -> Iterator[Difference]:
    """Holes off their pads, vias that the netlist names and no drill file makes, plated holes of another size than the
    netlist has at their place.
    """
    plated = [hole for hole in board.artwork.holes if hole.is_plated]
    for hole in board.artwork.holes:
        for layer in hole.layers:
            copper = board.artwork.copper[layer - 1]
            complaint, meets = "", shapely.intersects(copper, hole.shape)
            if not hole.is_plated:
                complaint = "is not plated and cuts into copper" if meets else ""
            elif not shapely.covers(copper, hole.shape):
                complaint = "breaks out of its pad" if meets else "has no pad"
            if complaint:
                message = f"the {hole.diameter * 1e6:.0f} um hole at {_place(hole.x, hole.y, layer)} {complaint}"
                yield Difference(DifferenceKind.HOLE_OFF_PAD, message, (), hole.x, hole.y, layer)
    # every layer and the netlist mark the same via, this one to a micrometre
    vias = {(mark.net, round(mark.x, 6), round(mark.y, 6)): (mark.x, mark.y) for mark in board.marks if mark.is_via}
    for (net, *_), (x, y) in vias.items():
        point = shapely.Point(x, y)
        if not any(shapely.intersects(hole.shape, point) for hole in plated):
            said = f"the via of {net} at {_place(x, y, None)} is not drilled"
            yield Difference(DifferenceKind.NO_HOLE, said, (net,), x, y)
    sizes = [(mark.x, mark.y, mark.drill, mark.net) for mark in board.marks if mark.drill is not None]
    for hole in plated:
        for x, y, drill, net in sizes:
            if math.hypot(hole.x - x, hole.y - y) < hole.diameter / 2.0 and abs(hole.diameter - drill) > ROUNDED:
                wrong = f"is {hole.diameter * 1e6:.0f} um wide, where the netlist has {drill * 1e6:.0f} um"
                message = f"the hole at {_place(hole.x, hole.y, None)} {wrong}"
                yield Difference(DifferenceKind.HOLE_SIZE, message, (net,), hole.x, hole.y)


def _netlists(board: ExtractedBoard) -> Iterator[Difference]:
    """Nets that only one of the netlists names."""
    by_source: dict[MarkSource, set[str]] = {}
    for mark in board.marks:
        by_source.setdefault(mark.source, set()).add(mark.net)
    if len(by_source) < 2:
        return
    for name in sorted(by_source[MarkSource.X2] ^ by_source[MarkSource.IPC_D_356]):
        where = next(source for source, names in by_source.items() if name in names)
        yield Difference(DifferenceKind.NETLISTS, f"{name} is named by the {where} only", (name,))


def _openings(board: ExtractedBoard) -> Iterator[Difference]:
    """Contacts that the coverlay covers, in part or altogether; then copper in its openings that is no contact, where
    an opening is not where it belongs. Outer layers are looked at whose coverlay has a file.
    """
    exposed: list[Difference] = []
    for side, layer in (("Top", 1), ("Bot", len(board.artwork.copper))):
        if side not in board.artwork.openings:
            continue
        opening = board.artwork.openings[side]
        contacts = [contact for net in board.nets for contact in net.contacts if contact.layer == layer]
        for contact in contacts:
            open_share = shapely.intersection(opening, contact.shape).area / contact.shape.area
            if open_share < 1.0 - HELD:
                how = f"with {100.0 * (1.0 - open_share):.0f} % of it under" if open_share else "under"
                message = f"contact {contact.pin} at {_place(contact.x, contact.y, layer)} is {how} the coverlay"
                yield Difference(DifferenceKind.COVERED, message, (contact.net,), contact.x, contact.y, layer)
        near = shapely.union_all([contact.shape for contact in contacts]).buffer(OPEN_RIM)
        bare = shapely.intersection(board.artwork.copper[layer - 1], opening).difference(near)
        said = "lies bare in an opening of the coverlay and is no contact"
        exposed += _drawn(DifferenceKind.EXPOSED, bare, layer, said)
    yield from exposed


def _dead_ends(board: ExtractedBoard) -> Iterator[Difference]:
    """Copper that meets the rest of its net in one place only, so that no current comes through; only of whole nets."""
    parts = Counter(name for net in board.nets for name in net.names)
    for net in (net for net in board.nets if net.names and all(parts[name] == 1 for name in net.names)):
        for piece in net.pieces:
            joints = sum(
                piece.layer in hole.layers and shapely.intersects(hole.shape, piece.shape) for hole in net.holes
            )
            contacts = [c for c in net.contacts if c.layer == piece.layer and shapely.intersects(c.shape, piece.shape)]
            if joints + len(contacts) > 1:
                continue
            flashes = [f.shape for f in board.artwork.flashes if f.layer == piece.layer]
            beyond = piece.shape.difference(shapely.union_all(flashes).buffer(PAD_EDGE))
            if beyond.area > SMALLEST_TRACK:
                point = beyond.representative_point()
                place = _place(point.x, point.y, piece.layer)
                message = f"copper of {', '.join(net.names)} at {place} leads nowhere"
                yield Difference(DifferenceKind.DEAD_END, message, net.names, point.x, point.y, piece.layer)


def _drawn(kind: DifferenceKind, copper: BaseGeometry, layer: int, says: str) -> Iterator[Difference]:
    """What is wrong with an area of copper, and a place in it; nothing where the area is empty."""
    if not copper.is_empty:
        x, y = copper.representative_point().coords[0]
        yield Difference(kind, f"copper at {_place(x, y, layer)} {says}", (), x, y, layer)


def _beyond_their_layers(board: ExtractedBoard) -> Iterator[Difference]:
    """Copper and holes where their layer is not: the lower layers of a board whose tail has fewer."""
    for first, last, extent in board.artwork.extents:
        grown = extent.buffer(PAD_EDGE)
        for layer in range(first, min(last, len(board.artwork.copper)) + 1):
            beyond = board.artwork.copper[layer - 1].difference(grown)
            yield from _drawn(DifferenceKind.NO_LAYER, beyond, layer, "lies beyond the end of its layer")
            for hole in board.artwork.holes:
                if hole.is_plated and layer in hole.layers and not shapely.covers(grown, hole.shape):
                    message = f"the hole at {_place(hole.x, hole.y, layer)} is drilled beyond the end of that layer"
                    yield Difference(DifferenceKind.NO_LAYER, message, (), hole.x, hole.y, layer)


def _bare(board: ExtractedBoard) -> Iterator[Difference]:
    """Copper of a tail's last layer that lies beyond the layers below it, and not under the tail's own coverlay."""
    for layer, cover in board.artwork.covers:
        below = [extent for first, _, extent in board.artwork.extents if first == layer + 1]
        covered = shapely.union_all([cover, *below]).buffer(PAD_EDGE)
        bare = board.artwork.copper[layer - 1].difference(covered)
        yield from _drawn(DifferenceKind.BARE, bare, layer, "is covered by nothing from below")


def _somewhere(net: ExtractedNet) -> tuple[float, float, int | None]:
    if not net.pieces:
        return net.holes[0].x, net.holes[0].y, None
    point = net.pieces[0].shape.representative_point()
    return float(point.x), float(point.y), net.pieces[0].layer


def compare_job(directory: Path) -> Iterator[str]:
    """Every difference between what the one job file of a directory says of its files, what these say of themselves,
    and the order in which the stack-up names them, in words; nothing where there is no job file. Raises ExtractionError
    where the job file cannot be read.
    """
    functions = {path.name: ",".join(fields) for path, fields in sorted(file_functions(directory))}
    for path in sorted(directory.glob("*.gbrjob")):
        try:
            document: Any = json.loads(content_of(path))
            listed = {str(row["Path"]): str(row["FileFunction"]) for row in document["FilesAttributes"]}
            copper = [str(row["Name"]) for row in document["MaterialStackup"] if row["Type"] == "Copper"]
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            raise ExtractionError(f"{path.name} is no job file: {type(error).__name__}: {error}") from error
        for name in sorted({*listed, *functions}):
            said, own = listed.get(name), functions.get(name)
            if own is None:
                yield f"{path.name} lists {name}, which is not there or does not say what it is"
            elif said != own and own != UNLISTED:
                yield f"{name} says that it is {own}, and {path.name} {f'that it is {said}' if said else 'not'}"
        for number, layer in enumerate(copper, start=1):
            for name, own in functions.items():
                if name.endswith(f"-{layer}.gbr") and not own.startswith(f"Copper,L{number},"):
                    yield f"{name} says that it is {own}, and is copper layer {number} of the stack-up in {path.name}"
        own_layers = sum(own.startswith("Copper,") for own in functions.values())
        if own_layers != len(copper):
            yield f"{path.name} has {len(copper)} copper layers in its stack-up, and there are files of {own_layers}"
