"""Extraction of nets from areas and holes, and comparison with the intent that the same files state.

The comparison finds shorts, opens, loops and holes off their pads. The Gerber job file is compared with the files:
function and order of the layers.
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
"""Largest distance (m) between the copper and the place at which a file states the copper's net.

It is the resolution of an IPC-D-356 coordinate.
"""

SMALLEST_LOOP = 1e-12
"""Smallest area (m2) of a hole in the copper that counts as a loop: 1 um x 1 um. Smaller holes arise from chords."""


@record
class Piece:
    """One connected area of copper on one layer (from 1 at the top)."""

    layer: int
    shape: Polygon


@record
class BarePad:
    """Pad for an external conductor: pin, function and intended net as the files name them, place (m) and area."""

    pin: str
    function: str | None
    net: str
    layer: int
    x: float
    y: float
    shape: BaseGeometry


@record
class Loop:
    """Closed path in the copper of one net.

    * Hole in the copper of one layer: ``layer`` is its number, ``area`` (m2) the area inside.
    * Path through several layers: the drilled hole at (x, y) closes it. ``layer`` is None, ``area`` is nan.
    """

    x: float
    y: float
    layer: int | None = None
    area: float = math.nan


@record
class ExtractedNet:
    """Connected copper: its pieces and plated holes, the intended nets and contacts on this copper, and its loops.

    The number of loops is the first Betti number of the net. It counts holes in the pieces, and independent cycles of
    the graph whose nodes are pieces and plated holes.
    """

    pieces: tuple[Piece, ...]
    holes: tuple[PlottedHole, ...]
    names: tuple[str, ...]
    contacts: tuple[BarePad, ...]
    loops: tuple[Loop, ...]


@record
class ExtractedBoard:
    """Board as its finished files draw it, and the nets that the files state.

    ``marks`` are all places at which a file states a net, and ``astray`` the marks without copper.
    """

    artwork: Artwork
    marks: tuple[Mark, ...]
    astray: tuple[Mark, ...]
    nets: tuple[ExtractedNet, ...]

    def net(self, name: str) -> ExtractedNet:
        """Return the extracted net on which a file states the net `name`.

        Raises KeyError if there is no such net, or more than one.
        """
        matches = [net for net in self.nets if name in net.names]
        if len(matches) != 1:
            raise KeyError(f"{len(matches)} extracted nets carry {name!r}")
        return matches[0]


def extract(directory: str | Path, growth: float = 0.0) -> ExtractedBoard:
    """Return the nets of the Gerber and drill files in a directory, or in its ``fpc`` folder if there is one.

    Copper is grown by ``growth`` (m) on every side before it is joined. With almost half the least spacing, copper that
    is too close counts as touching. Raises ExtractionError if the files do not make up a board.
    """
    directory = Path(directory)
    directory = directory / "fpc" if (directory / "fpc").is_dir() else directory
    artwork = read_artwork(directory)
    return nets_of(artwork, read_marks(directory, artwork.sources), growth)


def nets_of(artwork: Artwork, marks: tuple[Mark, ...], growth: float = 0.0) -> ExtractedBoard:
    """Return the nets of some artwork, with the marks that its files state.

    Copper is grown by ``growth`` (m) on every side before it is joined.
    """
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
        net_pieces = [pieces[n] for n in members if n < len(pieces)]
        loops = [loop for piece in net_pieces for loop in _windows(piece)]
        loops += [loop for n in members for loop in closing[n]]
        own_holes = tuple(holes[n - len(pieces)] for n in members if n >= len(pieces))
        own_names = tuple(sorted(names[root]))
        # Both sources name this pad. The Gerber file comes first, because it states the pin's function
        pads: dict[tuple[int, int, int], BarePad] = {}
        for contact in contacts[root]:
            pads.setdefault((contact.layer, *_cell(contact.x, contact.y)), contact)
        nets.append(ExtractedNet(tuple(net_pieces), own_holes, own_names, tuple(pads.values()), tuple(loops)))
    return ExtractedBoard(artwork, marks, tuple(astray), tuple(nets))


def _windows(piece: Piece) -> list[Loop]:
    """Return the holes in the area of one piece of copper. Each is a closed loop for a current."""
    inside = [Polygon(ring) for ring in piece.shape.interiors]
    points = [window.representative_point() for window in inside]
    return [
        Loop(point.x, point.y, piece.layer, window.area)
        for window, point in zip(inside, points, strict=True)
        if window.area > SMALLEST_LOOP
    ]


def _pieces_under(marks: Sequence[Mark], trees: dict[int, _LayerTree]) -> list[list[int]]:
    piece_numbers: list[list[int]] = [[] for _ in marks]
    for layer, tree in trees.items():
        here = [k for k, mark in enumerate(marks) if mark.layer in (None, layer)]
        points = np.array([(marks[k].x, marks[k].y) for k in here]).reshape(-1, 2)
        for k, under in zip(here, tree.under(points, REACH), strict=True):
            piece_numbers[k] += under
    return piece_numbers


def _cell(x: float, y: float) -> tuple[int, int]:
    return round(x * 1e9), round(y * 1e9)


def _contacts(mark: Mark, flashes: dict[tuple[int, int, int], Flash]) -> list[BarePad]:
    """Return the contact that a mark names. Empty if no pad is flashed exactly at the mark.

    `flashes` holds the flashed pads by layer and by x and y of their centre (nm).
    """
    if mark.pin is None or mark.layer is None:
        return []
    flash = flashes.get((mark.layer, *_cell(mark.x, mark.y)))
    if flash is None:
        return []
    return [BarePad(mark.pin, mark.function, mark.net, mark.layer, flash.x, flash.y, flash.shape)]


class _LayerTree:
    """Spatial index of the pieces of one layer."""

    def __init__(self, layer: int, pieces: list[Piece]) -> None:
        self._numbers = [number for number, piece in enumerate(pieces) if piece.layer == layer]
        self._shapes = [pieces[number].shape for number in self._numbers]
        shapely.prepare(self._shapes)
        self._tree = STRtree(self._shapes)

    def near(self, shape: BaseGeometry, distance: float) -> list[int]:
        """Return the numbers of the pieces within a distance (m) of a shape."""
        return sorted(self._numbers[i] for i in self._tree.query(shape, predicate="dwithin", distance=distance))

    def under(self, points: Array, distance: float) -> list[list[int]]:
        """Return, for each of many points (n, 2; m), the numbers of the pieces within a distance (m).

        A coil is one piece with thousands of corners. Its edges are indexed once, not searched for every point.
        """
        numbers: list[list[int]] = [[] for _ in points]
        places = shapely.points(points)
        for number, shape in zip(self._numbers, self._shapes, strict=True):
            low, high = np.array(shape.bounds).reshape(2, 2)
            inside = np.all((points >= low - distance) & (points <= high + distance), axis=1)
            (near,) = np.nonzero(inside)
            for k in near[shapely.dwithin(shape, places[near], distance)]:
                numbers[k].append(number)
        return numbers


class _DisjointSets:
    """Disjoint sets of numbers (union-find)."""

    def __init__(self, count: int) -> None:
        self._parent = list(range(count))

    def root(self, number: int) -> int:
        while self._parent[number] != number:
            self._parent[number] = self._parent[self._parent[number]]
            number = self._parent[number]
        return number

    def join(self, a: int, b: int) -> bool:
        """Join the sets of two numbers. Return False if both were already in one set."""
        a, b = self.root(a), self.root(b)
        self._parent[max(a, b)] = min(a, b)
        return a != b


PAD_EDGE = 1e-6
"""Distance (m) by which copper may extend beyond a flashed pad, a layer's extent or a coverlay.

Copper within this distance counts as inside.
"""

OPEN_RIM = 0.3e-3
"""Distance (m) from a contact up to which an opening of the coverlay may expose copper.

Openings are larger than contacts by the registration of the coverlay, 0.05 to 0.2 mm.
"""

MAX_COVERED_FRACTION = 0.5
"""Largest allowed fraction of a contact's area under the coverlay.

The coverlay intentionally covers the rims of solder pads and the ends of contact fingers.
"""

DRILL_TOLERANCE = 2.6e-6
"""Largest allowed difference (m) between a drilled diameter and the diameter in the netlist.

The netlist rounds diameters to 0.0001 inch.
"""

SMALLEST_TRACK = 1e-9
"""Largest area (m2) of copper outside the pads that does not count as a dead end: a square of 30 um."""


class DifferenceKind(StrEnum):
    """Kind of a difference."""

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
    """Difference between the copper that the files draw and the nets that they state.

    `x` and `y` (m) are its place, and `layer` its copper layer (from 1).
    """

    kind: DifferenceKind
    message: str
    nets: tuple[str, ...] = ()
    x: float | None = None
    y: float | None = None
    layer: int | None = None


def compare(board: ExtractedBoard) -> tuple[Difference, ...]:
    """Return all differences between extracted nets and the nets that the files state. Empty if there are none.

    A coil is copper from one contact to the other, so both contacts belong to one net. Touching turns do not change
    this net. They close a loop, which counts as a difference in any net.
    """
    looks = (_nets, _holes, _netlists, _openings, _dead_ends, _beyond_their_layers, _bare)
    return tuple(difference for look in looks for difference in look(board))


def _place(x: float, y: float, layer: int | None) -> str:
    where = ", ".join(f"{axis} {round(at * 1e3, 6) + 0.0:.4g} mm" for axis, at in (("x", x), ("y", y)))
    return f"{where}, layer {layer}" if layer else where


def _nets(board: ExtractedBoard) -> Iterator[Difference]:
    """Yield a difference for each short, divided net, copper without a net, net without copper, and closed loop."""
    if not board.marks:
        yield Difference(DifferenceKind.NO_INTENT, "no file names a net: there is nothing to compare the copper with")
    for net in board.nets:
        x, y, layer = _somewhere(net)
        if len(net.names) > 1:
            yield Difference(DifferenceKind.SHORT, f"{' and '.join(net.names)} are joined", net.names, x, y, layer)
        if not net.names:
            fault = f"copper at {_place(x, y, layer)} belongs to no net"
            yield Difference(DifferenceKind.NO_NET, fault, (), x, y, layer)
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
    """Yield holes beside their pads, vias without a hole, and plated holes of another diameter than in the netlist."""
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
    # Every layer and the netlist mark a via; the netlist rounds its place to a micrometre
    vias = {(mark.net, round(mark.x, 6), round(mark.y, 6)): (mark.x, mark.y) for mark in board.marks if mark.is_via}
    for (net, *_), (x, y) in vias.items():
        point = shapely.Point(x, y)
        if not any(shapely.intersects(hole.shape, point) for hole in plated):
            fault = f"the via of {net} at {_place(x, y, None)} is not drilled"
            yield Difference(DifferenceKind.NO_HOLE, fault, (net,), x, y)
    sizes = [(mark.x, mark.y, mark.drill, mark.net) for mark in board.marks if mark.drill is not None]
    for hole in plated:
        for x, y, drill, net in sizes:
            if math.hypot(hole.x - x, hole.y - y) < hole.diameter / 2.0 and abs(hole.diameter
                                                                                - drill) > DRILL_TOLERANCE:
                wrong = f"is {hole.diameter * 1e6:.0f} um wide, where the netlist has {drill * 1e6:.0f} um"
                message = f"the hole at {_place(hole.x, hole.y, None)} {wrong}"
                yield Difference(DifferenceKind.HOLE_SIZE, message, (net,), hole.x, hole.y)


def _netlists(board: ExtractedBoard) -> Iterator[Difference]:
    """Yield nets that the copper files name and a netlist does not, or the reverse."""
    by_source: dict[MarkSource, set[str]] = {}
    for mark in board.marks:
        by_source.setdefault(mark.source, set()).add(mark.net)
    if len(by_source) < 2:
        return
    for name in sorted(by_source[MarkSource.X2] ^ by_source[MarkSource.IPC_D_356]):
        where = next(source for source, names in by_source.items() if name in names)
        yield Difference(DifferenceKind.NETLISTS, f"{name} is named by the {where} only", (name,))


def _openings(board: ExtractedBoard) -> Iterator[Difference]:
    """Yield contacts that the coverlay covers too far, then exposed copper that is no contact.

    Only outer layers whose coverlay has a file are examined.
    """
    exposed: list[Difference] = []
    for side, layer in (("Top", 1), ("Bot", len(board.artwork.copper))):
        if side not in board.artwork.openings:
            continue
        opening = board.artwork.openings[side]
        contacts = [contact for net in board.nets for contact in net.contacts if contact.layer == layer]
        for contact in contacts:
            open_share = shapely.intersection(opening, contact.shape).area / contact.shape.area
            if open_share < 1.0 - MAX_COVERED_FRACTION:
                how = f"with {100.0 * (1.0 - open_share):.0f} % of it under" if open_share else "under"
                message = f"contact {contact.pin} at {_place(contact.x, contact.y, layer)} is {how} the coverlay"
                yield Difference(DifferenceKind.COVERED, message, (contact.net,), contact.x, contact.y, layer)
        near = shapely.union_all([contact.shape for contact in contacts]).buffer(OPEN_RIM)
        bare_area = shapely.intersection(board.artwork.copper[layer - 1], opening).difference(near)
        fault = "lies bare in an opening of the coverlay and is no contact"
        exposed += _drawn(DifferenceKind.EXPOSED, bare_area, layer, fault)
    yield from exposed


def _dead_ends(board: ExtractedBoard) -> Iterator[Difference]:
    """Yield copper that meets the rest of its net in at most one place, so that it carries no current.

    Only nets in one part are examined.
    """
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
    """Yield a difference at a point inside an area of copper. Empty if the area is empty.

    `says` ends the message, after the place of the copper.
    """
    if not copper.is_empty:
        x, y = copper.representative_point().coords[0]
        yield Difference(kind, f"copper at {_place(x, y, layer)} {says}", (), x, y, layer)


def _beyond_their_layers(board: ExtractedBoard) -> Iterator[Difference]:
    """Yield copper and holes outside the extent of their layer.

    Lower layers of a board with a thinner tail have such an extent.
    """
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
    """Yield copper of a tail's last layer that neither the layers below nor the tail's own coverlay cover."""
    for layer, cover in board.artwork.covers:
        below = [extent for first, _, extent in board.artwork.extents if first == layer + 1]
        covered = shapely.union_all([cover, *below]).buffer(PAD_EDGE)
        bare_area = board.artwork.copper[layer - 1].difference(covered)
        yield from _drawn(DifferenceKind.BARE, bare_area, layer, "is covered by nothing from below")


def _somewhere(net: ExtractedNet) -> tuple[float, float, int | None]:
    if not net.pieces:
        return net.holes[0].x, net.holes[0].y, None
    point = net.pieces[0].shape.representative_point()
    return float(point.x), float(point.y), net.pieces[0].layer


def compare_job(directory: Path) -> Iterator[str]:
    """Yield the differences between the job files in a directory and the other files there, as texts.

    The file functions in a job file are compared with the functions that the files declare. The order of the copper
    layers is compared with the stack-up. Empty if there is no job file. Raises ExtractionError if a job file cannot be
    read.
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
            stated, function = listed.get(name), functions.get(name)
            if function is None:
                yield f"{path.name} lists {name}, which is not there or does not say what it is"
            elif stated != function and function != UNLISTED:
                other = f"that it is {stated}" if stated else "not"
                yield f"{name} says that it is {function}, and {path.name} {other}"
        for number, layer in enumerate(copper, start=1):
            for name, function in functions.items():
                if name.endswith(f"-{layer}.gbr") and not function.startswith(f"Copper,L{number},"):
                    place = f"copper layer {number} of the stack-up in {path.name}"
                    yield f"{name} says that it is {function}, and is {place}"
        own_layers = sum(function.startswith("Copper,") for function in functions.values())
        if own_layers != len(copper):
            yield f"{path.name} has {len(copper)} copper layers in its stack-up, and there are files of {own_layers}"
