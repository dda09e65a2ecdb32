"""From areas and holes to nets: which copper hangs together, which contacts it joins, whether it closes on itself."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import shapely
from shapely import Polygon, STRtree
from shapely.geometry.base import BaseGeometry

from sitscad.arrays import Array
from sitscad.extraction.artwork import Artwork, Flash, PlottedHole, read_artwork
from sitscad.extraction.intent import Mark, read_marks
from sitscad.record import record

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
