"""How far a coil's leads run round it to close its circuit: what that costs, and what of it cannot be spared.

From contact to contact the current goes round the coil a whole number of times, for both conductors of a pair come from
one place. Whatever the layers' turns lack of a whole number, the leads run round the ring: that closing arc links the
winding's flux like a turn of its own. Where both leads run round together, above each other, they cancel. Only a coil
that ends inside its turns comes out wherever it likes, under them, and needs none; what that lead sweeps inside counts
by its area.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from sitscad.geometry.path import TWO_PI, Point
from sitscad.layout.board import Coil
from sitscad.layout.pieces import Role, Trace
from sitscad.spec.coil import CoilSpec

FLATTENED = 1e-6
"""Arcs become chords within this distance (m)."""

Values = TypeVar("Values", float, NDArray[np.float64])

WEIGHT = 10.0
"""A closing arc counts so many times its length: it moves the inductance by several per cent a quarter turn, while a
pair that runs round together only has its resistance.
"""

RUNNING_ON = 0.9
"""An arc that runs on as the winding does counts for less: it adds inductance, where one that runs back takes it away
and has the same resistance. So of two halves of a turn that one is taken.
"""


def closing_turns(coil: CoilSpec, sweep_a: Values, sweep_b: Values) -> Values:
    """Turns by which two leads that run round a coil by these angles (rad, from its ends) close its circuit: positive
    where they run on as the winding does.
    """
    sense = -1.0 if coil.clockwise else 1.0
    return sense * (sweep_b - sweep_a) / TWO_PI


def closing_cost(turns: Values, radius: float) -> NDArray[np.float64]:
    """What a closing arc of some turns on a ring of some radius (m) costs, as a length (m) of lead."""
    return WEIGHT * TWO_PI * radius * counted(turns)


def counted(turns: Values) -> NDArray[np.float64]:
    """The turns that closing arcs count for: less than they are where they run on."""
    return np.where(np.asarray(turns) > 0.0, RUNNING_ON * np.asarray(turns), np.abs(turns))


def least_closing(coil: CoilSpec) -> float:
    """The cheapest closing arc (turns) that a coil's leads can have, however much room there is."""
    if len(coil.layers) % 2:
        return 0.0
    beyond = math.fsum(coil.layer_turns) % 1.0
    return -beyond if beyond < RUNNING_ON * (1.0 - beyond) else 1.0 - beyond


def swept_inside(one: Point, other: Point, centre: Point) -> float:
    """What a straight lead from inside a coil out to its ring sweeps about the centre (rad): the angle on the ring over
    an equal area, for inside the turns the field is as good as even.
    """
    x, y, beyond_x, beyond_y = one.x - centre.x, one.y - centre.y, other.x - centre.x, other.y - centre.y
    return (x * beyond_y - y * beyond_x) / max(math.hypot(x, y), math.hypot(beyond_x, beyond_y)) ** 2


def drawn_closing(spec: CoilSpec, coil: Coil) -> float:
    """The closing arc (turns) of a coil as it is drawn: how far its conductors outside the turns run round it, positive
    where they run on as the winding does.
    """
    sense = -1.0 if spec.clockwise else 1.0
    outside = min(spec.size) / 2.0 - spec.trace_width
    centre = coil.centre
    swept = 0.0
    for piece in coil.series:
        if not isinstance(piece, Trace) or piece.role is Role.WINDING:
            continue
        for one, other in pairwise(Point(*place) for place in piece.path.flattened(FLATTENED)):
            near, far = sorted((one.distance(centre), other.distance(centre)))
            if near > outside:
                swept += math.remainder(_angle(other, centre) - _angle(one, centre), TWO_PI)
            elif far > outside:
                swept += swept_inside(one, other, centre)
    return sense * swept / TWO_PI


def _angle(point: Point, centre: Point) -> float:
    return math.atan2(point.y - centre.y, point.x - centre.x)
