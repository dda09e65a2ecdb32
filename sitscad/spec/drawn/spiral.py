"""Recognise the spiral that a drawn conductor winds, layer by layer, and the stubs and leads beside it.

A drawn coil is computed as the shape that it winds: all error bounds are fitted to shapes. Turns that follow no such
shape are refused with the place of the largest deviation.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.basics.units import show
from sitscad.kernels.geometry.path import TWO_PI, Path, Point
from sitscad.spec.coil import CoilSpec, DrawnCopperCoil, DrawnHole, DrawnLayer, DrawnPiece, DrawnTerminal
from sitscad.spec.drawn.arcs import with_arcs
from sitscad.spec.drawn.copper import DrawnCoilError, DrawnPad, place_text
from sitscad.spec.drawn.follow import DrawnConductor, DrawnRun

LEAST_TURNS = 0.75
"""Least number of turns of a run that counts as a layer of the winding."""

DEVIATION = 0.1
"""Largest distance of the turns from the spiral, divided by the width of the track."""

SEARCH = (0.5, 0.25, DEVIATION)
"""Distances from the spiral, divided by the width of the track, at which turns end in successive fits."""

BEYOND = 1.1
"""Largest number of turns of a run that are no part of the spiral: a lead may go round the coil."""

SAMPLES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Places along a segment at which its distance from the spiral is computed."""

CORE = 0.3
"""Fraction of a run's length, at each end, that the first fit leaves out: leads and stubs."""

EQUAL_TURNS = 2e-3
"""Largest difference of turns between layers that counts as equal, and rounding of turns to whole numbers."""


@record(eq=False)
class _Turns:
    """Turns of one run: the run, and the first and last segment (index) of the spiral."""

    run: DrawnRun
    first: int
    last: int

    @property
    def path(self) -> Path:
        """The turns, with arcs in place of chords."""
        return with_arcs(Path(self.run.path.segments[self.first : self.last + 1]))


@record(eq=False)
class _Fit:
    """Spirals about a common `centre` (m): r = start + slope theta, theta (rad) along the current from the start.

    `starts` (m) and `slopes` (m/rad) have one value for each layer.
    """

    centre: Point
    starts: Array
    slopes: Array

    def layer(self, number: int, turns: _Turns, copper_layer: int) -> DrawnLayer:
        """Return one layer of the winding about the centre."""
        path = turns.path.shifted(-self.centre.x, -self.centre.y)
        sweep, slope = float(_polar(path, ORIGIN)[1][-1, -1]), float(self.slopes[number])
        inward = slope * sweep < 0.0
        sense = int(math.copysign(1, sweep if inward else -sweep))
        outer_radius = float(self.starts[number]) + (0.0 if inward else slope * sweep)
        outer_end = path.start if inward else path.end
        outer_angle = math.atan2(outer_end.y, outer_end.x)
        return DrawnLayer(copper_layer, path, outer_angle, sense, inward, abs(sweep) / TWO_PI, outer_radius)


ORIGIN = Point(0.0, 0.0)


def recognised(conductor: DrawnConductor, layers: Sequence[str], written: CoilSpec) -> CoilSpec:
    """Return the coil that a conductor winds, with its copper about its centre.

    `layers` are the names of the copper layers, from the top. Raises DrawnCoilError if the turns are no round spiral
    with equal pitch, size and width on all layers.
    """
    runs = [run for run, (_, turns) in zip(conductor.runs, conductor.turns(), strict=True) if abs(turns) >= LEAST_TURNS]
    if not runs:
        raise DrawnCoilError("the copper makes less than one turn about its centre: there is no coil")
    _require_width(runs, conductor.width)
    fit, turns = _fitted(runs, conductor)
    wound = [fit.layer(k, part, layers.index(part.run.layer) + 1) for k, part in enumerate(turns)]
    _require_series(wound, layers)
    radius, pitch = float(np.mean([layer.outer_radius for layer in wound])), TWO_PI * float(np.abs(fit.slopes).mean())
    for part, layer in zip(turns, wound, strict=True):
        _require_whole(part, layer, fit.centre)
    deviation = max(_deviation(part, layer, radius, pitch, fit.centre, conductor.width)
                    for part, layer in zip(turns, wound, strict=True))
    counts = [_rounded(layer.turns) for layer in wound]
    diameter = round(2.0 * radius + conductor.width, 9)
    return replace(
        written, shape="circle", size=(diameter, diameter), turns=counts[0] if len(set(counts)) == 1 else tuple(counts),
        layers=tuple(layer.number for layer in wound), trace_width=conductor.width,
        trace_spacing=round(pitch - conductor.width, 9), start_angle=wound[0].outer_angle, clockwise=wound[0].sense < 0,
        copper=DrawnCopperCoil(tuple(wound), _series(conductor, turns, wound, fit.centre, layers),
                               _terminals(conductor, fit.centre, layers), deviation),
    )


def _rounded(turns: float) -> float:
    return float(round(turns)) if abs(turns - round(turns)) < EQUAL_TURNS else round(turns, 6)


def _require_width(runs: Sequence[DrawnRun], width: float) -> None:
    """Raise DrawnCoilError if most of the turns of a layer have another width (m)."""
    for run in runs:
        of_width = math.fsum(segment.length for segment, each in zip(run.path, run.widths, strict=True)
                             if each == width)
        if of_width < 0.5 * run.path.length:
            raise DrawnCoilError(f"tracks on {run.layer} are not {show(width, 'm')} wide as the others: turns of "
                                 "unequal width are not computed")


def _polar(path: Path, centre: Point) -> tuple[Array, Array]:
    """Return radius (m) and angle (rad, continuous, 0 at the start) of the samples of a path: (segments, samples)."""
    places = np.array([[segment.at(fraction) for fraction in SAMPLES] for segment in path]) - centre
    angle = np.unwrap(np.arctan2(places[..., 1], places[..., 0]).ravel()).reshape(places.shape[:2])
    return np.hypot(places[..., 0], places[..., 1]), angle - angle[0, 0]


def _fitted(runs: Sequence[DrawnRun], conductor: DrawnConductor) -> tuple[_Fit, list[_Turns]]:
    """Fit spirals to runs, and find the segments of each run that belong to its spiral."""
    turns = [_core(run) for run in runs]
    fit = _fit([part.path for part in turns], conductor.centre)
    for tolerance in SEARCH:
        turns = [_extended(fit, k, part, tolerance * conductor.width) for k, part in enumerate(turns)]
        fit = _fit([part.path for part in turns], fit.centre)
    return fit, turns


def _core(run: DrawnRun) -> _Turns:
    """Return the middle of a run, in which turns are certain."""
    ends = np.cumsum([segment.length for segment in run.path]) / run.path.length
    first, last = (int(np.searchsorted(ends, fraction)) for fraction in (CORE, 1.0 - CORE))
    return _Turns(run, first, last)


def _extended(fit: _Fit, layer: int, turns: _Turns, tolerance: float) -> _Turns:
    """Return the turns as far as the run stays within a distance (m) of its spiral."""
    radius, angle = _polar(turns.run.path, fit.centre)
    spiral = fit.starts[layer] + fit.slopes[layer] * (angle - angle[turns.first, 0])
    is_away = np.abs(radius - spiral).max(axis=1) > tolerance
    middle = (turns.first + turns.last) // 2
    before, after = np.flatnonzero(is_away[:middle]), np.flatnonzero(is_away[middle + 1 :])
    first, last = int(before[-1]) + 1 if before.size else 0, middle + int(after[0]) if after.size else len(is_away) - 1
    return _Turns(turns.run, first, last)


def _fit(paths: Sequence[Path], centre: Point) -> _Fit:
    """Fit spirals about one centre by least squares, from a first guess of the centre (m)."""
    for _ in range(FITS):
        rows, radii = [], []
        for k, path in enumerate(paths):
            radius, angle = (each.ravel() for each in _polar(path, centre))
            heading = math.atan2(path.start.y - centre.y, path.start.x - centre.x) + angle
            row = np.zeros((radius.size, 2 + 2 * len(paths)))
            row[:, 0], row[:, 1], row[:, 2 + 2 * k], row[:, 3 + 2 * k] = np.cos(heading), np.sin(heading), 1.0, angle
            rows.append(row)
            radii.append(radius)
        solution = np.linalg.lstsq(np.vstack(rows), np.concatenate(radii), rcond=None)[0]
        centre = centre.shifted(float(solution[0]), float(solution[1]))
    return _Fit(centre, solution[2::2], solution[3::2])


FITS = 10
"""Number of linear fits. Each reduces the error of the centre by the ratio of pitch to circumference or more."""


def _require_series(wound: Sequence[DrawnLayer], layers: Sequence[str]) -> None:
    """Raise DrawnCoilError if a layer cancels the field of the others, or if a layer has two spirals."""
    circulation = [layer.sense * (1 if layer.inward else -1) for layer in wound]
    for layer, way in zip(wound, circulation, strict=True):
        if way * sum(circulation) <= 0:
            raise DrawnCoilError(f"layer {layers[layer.number - 1]} turns the other way and cancels the field of the "
                                 "others")
    if len({layer.number for layer in wound}) < len(wound):
        raise DrawnCoilError("two spirals lie on one layer: a coil has one spiral on each layer")


def _require_whole(turns: _Turns, layer: DrawnLayer, centre: Point) -> None:
    """Raise DrawnCoilError if much of a run does not lie on its spiral."""
    sweeps = _polar(turns.run.path, centre)[1]
    total = float(np.abs(sweeps[:, -1] - sweeps[:, 0]).sum()) / TWO_PI
    if layer.turns < LEAST_TURNS or total - layer.turns > BEYOND:
        beyond = turns.last + 1 if turns.last + 1 < len(sweeps) else turns.first
        place = place_text(turns.run.path.segments[beyond].start, turns.run.layer)
        raise DrawnCoilError(f"the turns at {place} leave the round spiral of the others: {ONLY}")


def _deviation(
    turns: _Turns, layer: DrawnLayer, radius: float, pitch: float, centre: Point, width: float
) -> float:
    """Return the largest distance (m) of a layer from a spiral with outer radius and pitch (m) of the whole coil."""
    path = turns.path if layer.inward else turns.path.reversed()
    distance, angle = _polar(path, centre)
    away = np.abs(distance - radius + pitch * np.abs(angle) / TWO_PI).max(axis=1)
    if away.max() > DEVIATION * width:
        place = place_text(path.segments[int(away.argmax())].at(0.5), turns.run.layer)
        raise DrawnCoilError(f"the turns at {place} lie {show(float(away.max()), 'm', 2)} from a round spiral, "
                             f"{show(DEVIATION * width, 'm', 2)} can be: {ONLY}")
    return float(away.max())


ONLY = "only round spirals of equal size and pitch on all layers have known errors"


def _series(
    conductor: DrawnConductor, turns: Sequence[_Turns], wound: Sequence[DrawnLayer], centre: Point,
    layers: Sequence[str],
) -> tuple[DrawnPiece | DrawnHole, ...]:
    """Return tracks and holes in the order of the current, about the centre (m)."""
    if len(conductor.vias) != len(conductor.runs) - 1:
        raise DrawnCoilError("a via joins no two tracks")
    series: list[DrawnPiece | DrawnHole] = []
    home, started = (-centre.x, -centre.y), 0
    for run, via in zip(conductor.runs, (*conductor.vias, None), strict=True):
        number, part = layers.index(run.layer) + 1, next((part for part in turns if part.run is run), None)
        first, last = (part.first, part.last) if part else (0, -1)
        series += _pieces(run, 0, first, number, LEAD if not started else STUB, home)
        if part is not None:
            series.append(DrawnPiece(number, wound[started].path, conductor.width, WINDING))
            started += 1
        role = LEAD if started in (0, len(turns)) else STUB
        series += _pieces(run, last + 1, len(run.widths), number, role, home)
        if via is not None:
            series.append(DrawnHole(via.centre.shifted(*home), via.drill or 0.5 * min(via.size), min(via.size)))
    return tuple(series)


WINDING, STUB, LEAD = "winding", "stub", "lead"
"""Purposes of drawn tracks, as in `layout.board.Role`."""


def _pieces(
    run: DrawnRun, first: int, stop: int, layer: int, role: str, home: tuple[float, float]
) -> Iterator[DrawnPiece]:
    """Yield a part of a run as tracks, one for each stretch of equal width, moved by `home` (m)."""
    rows = zip(run.path.segments[first:stop], run.widths[first:stop], strict=True)
    for width, group in groupby(rows, key=lambda row: row[1]):
        yield DrawnPiece(layer, Path(tuple(segment for segment, _ in group)).shifted(*home), width, role)


def _terminals(
    conductor: DrawnConductor, centre: Point, layers: Sequence[str]
) -> tuple[DrawnTerminal, DrawnTerminal]:
    """Return both terminals about the centre (m). A free end of a track is a terminal as large as it is wide."""
    ends = ((conductor.runs[0], conductor.runs[0].path.start), (conductor.runs[-1], conductor.runs[-1].path.end))
    first, second = (
        DrawnTerminal(at.shifted(-centre.x, -centre.y), (run.widths[0],) * 2 if pad is None else _extent(pad),
                      layers.index(run.layer) + 1)
        for (run, end), pad in zip(ends, conductor.terminals, strict=True)
        for at in (end if pad is None else pad.centre,)
    )
    return first, second


def _extent(pad: DrawnPad) -> tuple[float, float]:
    """Return the sides (m) of the box about a pad."""
    (x, y), cos, sin = pad.size, abs(math.cos(pad.angle)), abs(math.sin(pad.angle))
    return x * cos + y * sin, x * sin + y * cos
