"""Turns of a drawn conductor: the segments of a run that belong to a spiral, and the dimensions of the spiral."""

from __future__ import annotations

from sitscad.basics.record import record
from sitscad.kernels.geometry.path import Path, Point
from sitscad.spec.drawn.arcs import with_arcs
from sitscad.spec.drawn.follow import DrawnRun

DEVIATION = 0.1
"""Largest distance between the turns and their fitted spiral, over the width of the track (1)."""


@record(eq=False)
class DrawnTurns:
    """The part of a run that belongs to a spiral: the run, and the indices of the first and last segment."""

    run: DrawnRun
    first: int
    last: int

    @property
    def path(self) -> Path:
        """The turns, with arcs in place of chords."""
        return with_arcs(Path(self.run.path.segments[self.first : self.last + 1]))


@record(eq=False)
class DrawnSpiral:
    """The spiral that a conductor winds: shape, size (m), pitch (m), centre (m), and one value for each layer.

    The values for each layer are the turns, their number, and whether the current flows inward. Another is the sense of
    turning along the current (+1 counter-clockwise). `deviation` (m) is the largest distance of the drawn turns from
    this spiral.
    """

    shape: str
    size: tuple[float, float]
    pitch: float
    centre: Point
    turns: tuple[DrawnTurns, ...]
    counts: tuple[float, ...]
    inward: tuple[bool, ...]
    senses: tuple[int, ...]
    is_mid_side: bool = False
    corner_radius: float = 0.0
    deviation: float = 0.0
