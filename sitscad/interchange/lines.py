"""Coils as lines: the centre lines of their layers, and the way that the current takes from contact to contact."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sitscad.geometry.path import Path, Point, Segment
from sitscad.layout.board import Coil, Layout, Via
from sitscad.record import record

Array = NDArray[np.float64]

TOLERANCE = 1e-6
"""How far (m) chords may lie from an arc, unless another distance is asked for."""


@record
class CentreLine:
    """The middle of one layer's track, walked as the coil's current does: ``coil`` (C1, C2, ...), copper ``layer`` from
    1 at the top, the height ``z`` of the copper's middle, ``width`` and ``thickness`` of the track, all in metres.

    ``path`` has its straight pieces and arcs as they are drawn.
    """

    coil: str
    layer: int
    z: float
    width: float
    thickness: float
    path: Path

    @property
    def segments(self) -> tuple[Segment, ...]:
        """The lines and arcs in order: each begins where the one before ends."""
        return self.path.segments

    @property
    def length(self) -> float:
        """Length (m) of the line, arcs as arcs."""
        return self.path.length

    def points(self, tolerance: float = TOLERANCE) -> Array:
        """Points (n, 3) in metres whose chords stay within a tolerance (m) of the line."""
        return _raised(self.path.flattened(_positive(tolerance)), self.z)


@record(eq=False)
class CurrentPath:
    """A polyline that carries a current: points (n, 3) in metres, in the direction of the current (A); the names of the
    coil, and the copper layer that it lies on (None where it goes through several).
    """

    coil: str
    layer: int | None
    points: Array
    current: float


def centre_lines(layout: Layout) -> tuple[CentreLine, ...]:
    """Every layer of every coil, in the order of the coils and, within each, of its current."""
    width = layout.spec.coil.trace_width
    return tuple(
        CentreLine(coil.name, winding.layer, winding.z, width, winding.thickness, winding.path)
        for coil in layout.coils
        for winding in coil.windings
    )


def current_paths(
    layout: Layout, current: float = 1.0, leads: bool = True, tolerance: float = TOLERANCE
) -> tuple[CurrentPath, ...]:
    """The coils as filaments for a field program: chords within a tolerance (m) of the middle of the copper.

    With `leads` one path a coil, from its contact A through stubs, layers and vias back to its contact B, its tail held
    straight; without them one a layer, which are not joined. `current` (A) enters at contact A, which leads to the
    outer end of layer 1.

    Raises
    ------
    ValueError
        with `leads`, where a coil's leads found no room on the board and its circuit is open; and for a tolerance that
        is no positive length.
    """
    _positive(tolerance)
    if leads:
        return tuple(CurrentPath(c.name, None, _circuit(c, layout, tolerance), float(current)) for c in layout.coils)
    return tuple(
        CurrentPath(line.coil, line.layer, line.points(tolerance), float(current)) for line in centre_lines(layout)
    )


def _circuit(coil: Coil, layout: Layout, tolerance: float) -> Array:
    """A coil's whole circuit, leads included, as points (n, 3; m); ValueError where it is open."""
    if not coil.is_closed_circuit:
        raise ValueError(f"the leads of {coil.name} found no room: its circuit is open (leads=False gives its layers)")
    heights = {layer.number: layer.z for layer in layout.spec.fpc.stackup.copper}
    pieces = [
        _raised(piece.path.flattened(tolerance), heights[piece.layer])
        for piece in coil.series
        if not isinstance(piece, Via)
    ]
    points = np.vstack(list(_joined(pieces)))
    apart = np.any(np.diff(points, axis=0) != 0.0, axis=1)
    return np.asarray(points[np.concatenate([[True], apart])])


def _joined(pieces: Sequence[Array]) -> Iterator[Array]:
    """The pieces one after the other: between layers the current goes straight down or up the via."""
    for before, after in pairwise(pieces):
        assert np.hypot(*(after[0] - before[-1])[:2]) < TOLERANCE, "pieces of a circuit that do not meet"
    yield from pieces


def _raised(points: Sequence[Point], z: float) -> Array:
    flat = np.array(points, dtype=np.float64)
    return np.column_stack([flat, np.full(len(flat), z)])


def _positive(tolerance: float) -> float:
    if not 0.0 < tolerance < np.inf:
        raise ValueError("the tolerance is a positive length in metres")
    return tolerance
