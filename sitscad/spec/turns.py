"""How many turns a coil's shape allows: whole sides of polygons, halves of racetracks, and what fits inside.

Follows the winding's definition: the centre line starts (D - w)/2 from the centre and moves in by one pitch a turn.
"""

from __future__ import annotations

import math

SIDES = {"square": 4, "rectangle": 4, "hexagon": 6, "octagon": 8}
_SLACK = 1e-9


def turn_fraction(shape: str) -> int | None:
    """Into how many parts a turn of this shape may be broken; None where any number of turns is defined (circle)."""
    return 2 if shape == "racetrack" else SIDES.get(shape)


def nearest_turns(shape: str, turns: float) -> float:
    """The number of turns nearest to `turns` that the shape allows (at least one part of a turn)."""
    parts = turn_fraction(shape)
    return turns if parts is None else max(1, round(turns * parts)) / parts


def is_whole(shape: str, turns: float) -> bool:
    """Whether the turns end where the shape defines an end; one part in 10^6 is taken as rounding (2.166667)."""
    return abs(nearest_turns(shape, turns) - turns) <= 1e-6 * max(1.0, turns)


def most_turns(shape: str, size: tuple[float, float], trace_width: float, pitch: float) -> float:
    """Largest number of turns whose innermost trace stays clear of the centre; 0 where none does. Lengths in metres.

    circle: the inner edge (D - w)/2 - p N - w/2 stays positive. Polygons: so does the flat on which the inner end
    stands, (D - w)/2 - p floor(N) - w/2. Racetrack: so does the innermost end, (D - w)/2 - p (N - 1/2) - w/2.
    """
    room = (min(size) / 2 - trace_width) / pitch - _SLACK
    if room <= 0:
        return 0.0
    if shape == "circle":
        return room
    if shape == "racetrack":
        return max(0.0, math.floor(2 * (room + 0.5)) / 2)
    sides = SIDES[shape]
    return math.floor(room) + (sides - 1) / sides
