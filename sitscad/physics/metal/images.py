"""Tracks that are each other's images: a coil's layers are one spiral, turned and mirrored, and so are their waves."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sitscad.arrays import Array, ComplexArray, Flags, Index
from sitscad.physics.inductance.filaments import PolylineTrack
from sitscad.physics.loss.corner_excess import Loops
from sitscad.record import record

SAME = 1e-9
"""How far corners (m), and directions (rad), may be from an image's to be its: rounding alone."""

SAME_MOMENT = 1e-6
"""The same of what loops make of a wave, of all their moments."""

PROBES = np.array([(0.9, 0.3), (-2.3, 3.1), (7.7, 4.1), (-13.9, 17.3), (29.3, -31.7), (61.1, 53.9)]).T
"""Waves (2, n; rad over the loops' extent) by which two sets of loops are known to be the same."""


@record(eq=False)
class Image:
    """A track as the image of another, number `of`: turned by `matrix` (2, 2) about a middle that they share, mirrored
    where its determinant is negative, then moved by `offset` (m); `sense` is -1 where the current runs the other way.
    """

    of: int
    matrix: Array
    offset: Array
    sense: float

    def directions(self, angle: Array) -> tuple[Index, Flags] | None:
        """For directions (rows, n; rad) over half a turn: where among them those are that the other track has to be
        seen from, and which of these are opposite to one of them. None where they are not among them.
        """
        mirrored = np.linalg.det(self.matrix) < 0.0
        turn = math.atan2(self.matrix[1, 0], self.matrix[0, 0])
        wanted = turn - angle if mirrored else angle - turn
        order = np.argsort(angle[0])
        low = angle[0, order[0]] - SAME
        place = np.searchsorted(angle[0, order], (wanted[0] - low) % math.pi + low - SAME) % angle.shape[1]
        found = order[place]
        halves = np.round((wanted - angle[:, found]) / math.pi)
        if np.abs(wanted - angle[:, found] - math.pi * halves).max() > 3.0 * SAME:
            return None
        return found, np.asarray(halves[0] % 2.0 != 0.0)

    def waves(self, other: ComplexArray, wave: Array, found: Index, opposite: Flags,
              ) -> ComplexArray:  # fmt: skip
        """The track's waves (2, rows, n) at `wave` (2, rows, n; 1/m), of the other's."""
        seen = other[..., found]
        np.conjugate(seen, out=seen, where=opposite)
        phase = np.tensordot(self.offset, wave, axes=1)
        return np.asarray(self.sense * np.exp(-1j * phase) * np.tensordot(self.matrix, seen, axes=1))


def images(tracks: Sequence[PolylineTrack], loops: Sequence[Loops], centre: Array) -> list[Image | None]:
    """For each track the first one before it whose image about the centre (m) it is, with its loops where there are
    any; None for those that are nobody's.
    """
    found: list[Image | None] = []
    for n, track in enumerate(tracks):
        roots = (m for m in range(n) if found[m] is None and tracks[m].width == track.width)
        ways = (_image(m, tracks[m].corners - centre, track.corners - centre) for m in roots)
        ways = (w for w in ways if w is not None and (not loops or _loops_follow(w, loops[w.of], loops[n], centre)))
        found.append(next(ways, None))
    return found


def _image(of: int, source: Array, target: Array) -> Image | None:
    """How corners (n, 2; m) follow from those of track `of`, walked either way, turned or mirrored; None where they do
    not.
    """
    if source.shape != target.shape:
        return None
    for sense, aim in ((1.0, target), (-1.0, target[::-1])):
        for mirror in (False, True):
            matrix, offset = _fitted(source, aim, mirror)
            if np.abs(source @ matrix.T + offset - aim).max() < SAME:
                return Image(of, matrix, offset, sense)
    return None


def _fitted(source: Array, target: Array, mirror: bool) -> tuple[Array, Array]:
    """The turn, or the mirror (no unit), and the shift (m) that take points (n, 2; m) nearest to others."""
    middles = source.mean(axis=0), target.mean(axis=0)
    x, y = (source - middles[0]).T
    u, v = (target - middles[1]).T
    if mirror:
        angle = math.atan2(float(x @ v + y @ u), float(x @ u - y @ v))
        matrix = np.array([(math.cos(angle), math.sin(angle)), (math.sin(angle), -math.cos(angle))])
    else:
        angle = math.atan2(float(x @ v - y @ u), float(x @ u + y @ v))
        matrix = np.array([(math.cos(angle), -math.sin(angle)), (math.sin(angle), math.cos(angle))])
    return matrix, middles[1] - matrix @ middles[0]


def _loops_follow(image: Image, source: Loops, target: Loops, centre: Array) -> bool:
    """Whether a track's loops are the images of the other's: they make the same of some waves."""
    if source.moments.size != target.moments.size or source.spread != target.spread:
        return False
    if not source.moments.size:
        return True
    turn = image.sense * np.sign(np.linalg.det(image.matrix))
    probes = PROBES / max(float(np.ptp(target.places)), 1e-9)
    places = (source.places - centre) @ image.matrix.T + image.offset
    theirs = turn * source.moments @ np.exp(1j * (places @ probes))
    own = target.moments @ np.exp(1j * ((target.places - centre) @ probes))
    return bool(np.abs(theirs - own).max() < SAME_MOMENT * np.sum(np.abs(target.moments)))
