"""Pairs of pieces that lie alike: of a coil's turns most repeat, turned about its centre, mirrored, on other layers.

A piece is told by how it lies seen from its own direction, so that a turn about the centre changes that direction
alone; a mirror turns the current's way round, and the same piece walked the other way is the same. What two pieces are
to each other is both kinds and the angle between their directions: each such pair is worked out once.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from sitscad.arrays import Array, Index
from sitscad.physics.inductance.track_strands import Pairs, Track
from sitscad.record import record

DIGITS = 9
"""Decimal places, of the coil's size, to which pieces that lie alike agree."""

CIRCLE = 720_720_000
"""Parts of a circle that directions are told in: those of all regular polygons are whole numbers of them."""

SPACE = 3_000_000
"""Numbers of pairs up to which all that there may be are counted in one table; beyond they are sorted."""

AT_ONCE = 500_000
"""Pairs that are numbered at once."""


@record(eq=False)
class Kinds:
    """What kind each piece is (n), its mirror image's kind (n), which direction it has (n), and whose it is (n)."""

    number: Index
    mirrored: Index
    heading: Index
    owner: Index

    @property
    def count(self) -> int:
        """Number of kinds, mirrored ones included; no unit."""
        return 1 + int(max(self.number.max(), self.mirrored.max()))


@record(eq=False)
class Turns:
    """Numbers of the angles from one direction (n) to another (n), and of each angle's opposite."""

    between: Index
    opposite: Index


def pool(tracks: Sequence[Track]) -> Track:
    """All pieces of tracks (m) as one, in one plane, about the origin that they have."""
    first = tracks[0]
    starts, ends, before, after, arcs, turnings = (
        np.concatenate([getattr(track, name) for track in tracks])
        for name in ("starts", "ends", "before", "after", "arcs", "turnings")
    )
    return Track(starts, ends, before, after, arcs, turnings, first.width, first.thickness, 0.0)


def kinds(tracks: Sequence[Track]) -> tuple[Kinds, Kinds, Turns]:
    """Those of all sides, and of all arcs, of tracks about their common centre; lengths in their size, no unit."""
    sides = [_sides(track) for track in tracks]
    arcs = [_arcs(track) for track in tracks]
    headings, turns = _turns(np.concatenate([angle for _, _, angle in (*sides, *arcs)]))
    split = sum(len(angle) for _, _, angle in sides)
    return _numbered(sides, headings[:split]), _numbered(arcs, headings[split:]), turns


def _sides(track: Track) -> tuple[Array, Array, Array]:
    """Rows that a turn leaves alone, those of the mirror images, and directions (rad)."""
    step = track.ends - track.starts
    along = step / np.hypot(step[:, 0], step[:, 1])[:, None]
    left = np.stack([-along[:, 1], along[:, 0]], axis=1)

    def seen(points: Array, axis: Array = along) -> Array:
        return np.asarray(np.sum(points * axis, axis=1))

    start, end, aside = seen(track.starts), seen(track.ends), seen(track.starts, left)
    before, after = seen(track.before), seen(track.after)
    rows, mirrored = (start, end, aside, before, after), (-end, -start, aside, -after, -before)
    return np.stack(rows, axis=1), np.stack(mirrored, axis=1), np.arctan2(along[:, 1], along[:, 0])


def _arcs(track: Track) -> tuple[Array, Array, Array]:
    """Rows that a turn leaves alone, those of the mirror images, and directions (rad), of arcs."""
    x, y, radius, start, way, angle = track.arcs.T
    middle = start + 0.5 * way * angle
    cosine, sine = np.cos(middle), np.sin(middle)
    out, aside = x * cosine + y * sine, y * cosine - x * sine
    # as of a counter-clockwise one: the way is told by its own column
    return (np.stack([out, aside, radius, way, angle], axis=1), np.stack([out, -aside, radius, way, angle], axis=1),
            middle + 0.5 * math.pi)  # fmt: skip


def _turns(angles: Array) -> tuple[Index, Turns]:
    # Which direction each angle (rad) is, and the turns between directions.
    some, heading = np.unique(np.round(angles * (CIRCLE / math.tau)).astype(np.int64) % CIRCLE, return_inverse=True)
    turn, between = np.unique((some[None, :] - some[:, None]) % CIRCLE, return_inverse=True)
    return heading, Turns(between.reshape(some.size, some.size), np.searchsorted(turn, (CIRCLE - turn) % CIRCLE))


def _numbered(found: Sequence[tuple[Array, Array, Array]], headings: Index) -> Kinds:
    rows, mirrored = (np.concatenate([part[k] for part in found]) for k in (0, 1))
    both = np.round(np.concatenate([rows, mirrored]), DIGITS) + 0.0
    number = np.unique(both, axis=0, return_inverse=True)[1].reshape(-1)
    owner = np.repeat(np.arange(len(found)), [len(part[0]) for part in found])
    return Kinds(number[: len(rows)], number[len(rows) :], headings, owner)


def distinct_pairs(
    one: Kinds, other: Kinds, turns: Turns, relations: Sequence[Sequence[tuple[int, int, float]]]
) -> Pairs:
    """The pairs of a piece of the one's and a piece of the other's that differ, and how often each occurs: `times` has
    a column for each of `relations`, which are numbers of layers, the one's and the other's, and how often they count.
    """
    plans, others = _plans(one), _plans(other)
    alike: list[dict[tuple[int, int], float]] = [{} for _ in relations]
    for layers, count in zip(relations, alike, strict=True):
        for i, j, often in layers:
            count[plans[i], others[j]] = count.get((plans[i], others[j]), 0.0) + often
    tallies = {pair: list(_counted(one, other, turns, *pair)) for pair in dict.fromkeys(k for c in alike for k in c)}
    found = [(codes, where, often * counts, column) for column, count in enumerate(alike)
             for pair, often in count.items() for codes, where, counts in tallies[pair]]  # fmt: skip
    codes, where, times = (np.concatenate([part[k] for part in found]) for k in range(3))
    column = np.repeat([part[3] for part in found], [len(part[0]) for part in found])
    _, first, which = np.unique(codes, return_index=True, return_inverse=True)
    table = np.bincount(which * len(relations) + column, times, first.size * len(relations)).astype(float)
    rows, columns = np.divmod(where[first], len(other.number))
    return Pairs(rows, columns, table.reshape(first.size, len(relations)))


def _plans(kinds: Kinds) -> list[int]:
    """Of every layer (no unit) the first one with the same pieces: many coils repeat every other one."""
    known: dict[tuple[bytes, ...], int] = {}
    layers = [kinds.owner == layer for layer in range(int(kinds.owner.max(initial=-1)) + 1)]
    tables = kinds.number, kinds.mirrored, kinds.heading
    return [known.setdefault(tuple(one[own].tobytes() for one in tables), k) for k, own in enumerate(layers)]


def _counted(one: Kinds, other: Kinds, turns: Turns, first: int, second: int) -> Iterator[tuple[Index, Index, Array]]:
    """Numbers (no unit) of pairs of two layers' pieces that differ, where each stands in the table of all pairs, and
    how often it occurs.
    """
    rows, columns = np.nonzero(one.owner == first)[0], np.nonzero(other.owner == second)[0]
    size = max(1, AT_ONCE // max(1, columns.size))
    for k in range(0, rows.size, size):
        here = rows[k : k + size, None]
        where = (here * len(other.number) + columns).ravel()
        codes, space = _codes(one, other, turns, here, columns)
        found, index, counts = _tallied(codes.ravel(), space)
        yield found, where[index], counts.astype(float)


def _codes(one: Kinds, other: Kinds, turns: Turns, i: Index, j: Index) -> tuple[Index, int]:
    """A number that pairs which lie alike share: the least of those of the pair, its mirror image, and both swapped."""
    angles = turns.opposite.size
    turn = turns.between[one.heading[i], other.heading[j]]
    back = turns.opposite[turn]
    a, b, c, d = one.number[i], other.number[j], one.mirrored[i], other.mirrored[j]
    count, others = one.count, other.count
    codes = np.minimum((a * others + b) * angles + turn, (c * others + d) * angles + back)
    if one is other:
        np.minimum(codes, (b * others + a) * angles + back, out=codes)
        np.minimum(codes, (d * others + c) * angles + turn, out=codes)
    return codes, count * others * angles


def _tallied(codes: Index, space: int) -> tuple[Index, Index, Index]:
    """What numbers there are, where one of each stands, and how many (no unit)."""
    if space > SPACE:
        return np.unique(codes, return_index=True, return_counts=True)
    counts: Index = np.bincount(codes, minlength=space)
    index = np.empty(space, dtype=np.intp)
    index[codes] = np.arange(codes.size)
    found = np.nonzero(counts)[0]
    return found, index[found], counts[found]
