"""Copper of a board as it is drawn: tracks, vias, pads and zones, with their nets. Metres, y upwards."""

from __future__ import annotations

import math
from collections.abc import Sequence

from sitscad.basics.record import record
from sitscad.kernels.geometry.path import Point, Segment


class DrawnCoilError(ValueError):
    """A drawn coil cannot be computed. The text gives the reason and the place."""


@record
class DrawnTrack:
    """A straight or round track: centre line, width (m), copper layer and net."""

    line: Segment
    width: float
    layer: str
    net: str = ""


@record
class DrawnPad:
    """A pad or a via: centre, outline, copper layers, net and name.

    * ``name``: component and pin, like ``J1.2``. Empty for a via.
    * ``size``, ``radius``, ``angle``: rectangle with sides (m), corner radius (m), and rotation (rad)
    * ``drill``: diameter (m) of the hole. 0 without a hole.
    """

    centre: Point
    size: tuple[float, float]
    layers: frozenset[str]
    net: str = ""
    name: str = ""
    radius: float = 0.0
    angle: float = 0.0
    is_plated: bool = False
    drill: float = 0.0

    def distance(self, point: Point) -> float:
        """Return the distance (m) from a point to the pad's copper. 0 if the point lies on the copper."""
        dx, dy = point.x - self.centre.x, point.y - self.centre.y
        cos, sin = math.cos(self.angle), math.sin(self.angle)
        x, y = abs(cos * dx + sin * dy), abs(cos * dy - sin * dx)
        out_x, out_y = x - self.size[0] / 2 + self.radius, y - self.size[1] / 2 + self.radius
        return max(0.0, math.hypot(max(out_x, 0.0), max(out_y, 0.0)) - self.radius)


@record
class DrawnZone:
    """A filled copper area: net, layers and one corner, which messages state as its place."""

    net: str
    layers: frozenset[str]
    corner: Point


@record
class CopperHeight:
    """Name, height (m) of the middle plane, and thickness (m) of a copper layer."""

    name: str
    z: float
    thickness: float


@record
class DrawnCopper:
    """All copper of a file. `heights` are empty if the file has no stack-up."""

    tracks: Sequence[DrawnTrack]
    pads: Sequence[DrawnPad]
    zones: Sequence[DrawnZone]
    layers: Sequence[str]
    heights: Sequence[CopperHeight] = ()
    is_footprint: bool = False

    def names_for(self, count: int) -> tuple[str, ...]:
        """Return the names of the copper layers from the top, for a board with `count` copper layers.

        Empty if the file has another number of layers. A footprint with tracks only on the outer layers fits a board
        with any number of layers.
        """
        if count == len(self.layers):
            return tuple(self.layers)
        if self.is_footprint and count > len(self.layers) and {track.layer for track in self.tracks} <= {*OUTER}:
            return (OUTER[0], *(f"In{k}.Cu" for k in range(1, count - 1)), OUTER[1])
        return ()

    def of_net(self, net: str) -> DrawnCopper:
        """Return the copper of one net. Raises DrawnCoilError if there is none."""
        tracks = [track for track in self.tracks if track.net == net]
        if not tracks:
            named = sorted({track.net for track in self.tracks if track.net})
            some = ", ".join(named[:MOST_NAMED]) + (", ..." if len(named) > MOST_NAMED else "")
            raise DrawnCoilError(f"no track has the net {net!r}; nets with tracks: {some or 'none'}")
        pads, zones = [pad for pad in self.pads if pad.net == net], [zone for zone in self.zones if zone.net == net]
        return DrawnCopper(tracks, pads, zones, self.layers, self.heights, self.is_footprint)


OUTER = ("F.Cu", "B.Cu")
"""Names of the outer copper layers."""

MOST_NAMED = 12
"""Largest number of nets that a message lists."""


def place_text(point: Point, layer: str = "") -> str:
    """Return a place as KiCad shows it: millimetres, y downwards."""
    return f"({point.x * 1e3:.4g}, {-point.y * 1e3:.4g}) mm{f' on {layer}' if layer else ''}"
