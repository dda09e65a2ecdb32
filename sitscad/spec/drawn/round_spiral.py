"""Recognise round spirals: the turns of all layers are fitted by Archimedean spirals about one centre."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.basics.units import show
from sitscad.kernels.geometry.path import TWO_PI, Arc, Path, Point
from sitscad.spec.drawn.arcs import DEVIATION, DrawnSpiral, DrawnTurns
from sitscad.spec.drawn.copper import DrawnCoilError, place_text
from sitscad.spec.drawn.follow import DrawnConductor, DrawnRun

LEAST_TURNS = 0.75
"""Smallest number of turns of a run that counts as a layer of the winding."""

SEARCH = (0.5, 0.25, DEVIATION)
"""Largest distance between a track and the fitted spiral, over the track's width (1), in successive fits.

The turns of a run end where the distance is larger.
"""

BEYOND = 1.1
"""Largest number of turns of a run that may lie outside its spiral: a lead may go round the coil."""

SAMPLES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Fractions of a segment's length at which its distance from the spiral is computed."""

CORE = 0.3
"""Fraction of a run's length, at each end, that the first fit leaves out: leads and stubs."""



@record(eq=False)
class _Fit:
    """Spirals about a common `centre` (m): r = start + slope theta, theta (rad) along the current from the start.

    `starts` (m) and `slopes` (m/rad) have one value for each layer.
    """

    centre: Point
    starts: Array
    slopes: Array


def round_spiral(runs: Sequence[DrawnRun], conductor: DrawnConductor) -> DrawnSpiral:
    """Return the round spiral that the runs of a conductor wind. Raises DrawnCoilError if there is none."""
    fit, turns = _fitted(runs, conductor)
    sweeps = [float(_polar(part.path, fit.centre)[1][-1, -1]) for part in turns]
    growths = [float(slope) * sweep for slope, sweep in zip(fit.slopes, sweeps, strict=True)]
    outer = float(np.mean([start + max(growth, 0.0) for start, growth in zip(fit.starts, growths, strict=True)]))
    pitch, inward = TWO_PI * float(np.abs(fit.slopes).mean()), tuple(growth < 0.0 for growth in growths)
    for part, sweep in zip(turns, sweeps, strict=True):
        _require_whole(part, abs(sweep) / TWO_PI, fit.centre)
    deviation = max(_deviation(part, is_inward, outer, pitch, fit.centre, conductor.width)
                    for part, is_inward in zip(turns, inward, strict=True))
    diameter = round(2.0 * outer + conductor.width, 9)
    return DrawnSpiral(
        "circle", (diameter, diameter), pitch, fit.centre, tuple(turns), tuple(abs(each) / TWO_PI for each in sweeps),
        inward, tuple(int(math.copysign(1, sweep)) for sweep in sweeps), deviation=deviation,
    )


def _polar(path: Path, centre: Point) -> tuple[Array, Array]:
    """Return radius (m) and angle (rad, continuous, 0 at the start) of the samples of a path: (segments, samples)."""
    places = np.array([[segment.at(fraction) for fraction in SAMPLES] for segment in path]) - centre
    angle = np.unwrap(np.arctan2(places[..., 1], places[..., 0]).ravel()).reshape(places.shape[:2])
    return np.hypot(places[..., 0], places[..., 1]), angle - angle[0, 0]


def _fitted(runs: Sequence[DrawnRun], conductor: DrawnConductor) -> tuple[_Fit, list[DrawnTurns]]:
    """Fit spirals to runs, and find the segments of each run that belong to its spiral."""
    turns = [_core(run) for run in runs]
    fit = _fit([part.path for part in turns], conductor.centre)
    for tolerance in SEARCH:
        turns = [_extended(fit, k, part, tolerance * conductor.width) for k, part in enumerate(turns)]
        fit = _fit([part.path for part in turns], fit.centre)
    return fit, turns


def _core(run: DrawnRun) -> DrawnTurns:
    """Return the middle part of a run, which is surely a part of the winding: `CORE` is left out at each end."""
    ends = np.cumsum([segment.length for segment in run.path]) / run.path.length
    first, last = (int(np.searchsorted(ends, fraction)) for fraction in (CORE, 1.0 - CORE))
    return DrawnTurns(run, first, last)


def _extended(fit: _Fit, layer: int, turns: DrawnTurns, tolerance: float) -> DrawnTurns:
    """Return the turns, extended as far as the run stays within `tolerance` (m) of its fitted spiral.

    `layer` is the index of the spiral in `fit`.
    """
    radius, angle = _polar(turns.run.path, fit.centre)
    spiral = fit.starts[layer] + fit.slopes[layer] * (angle - angle[turns.first, 0])
    # the middles of chords lie further inside than their ends
    inner = np.array([isinstance(segment, Arc) for segment in turns.run.path])[:, None] | np.isin(SAMPLES, (0.0, 1.0))
    is_away = (np.abs(radius - spiral) * inner).max(axis=1) > tolerance
    middle = (turns.first + turns.last) // 2
    before, after = np.flatnonzero(is_away[:middle]), np.flatnonzero(is_away[middle + 1 :])
    first, last = int(before[-1]) + 1 if before.size else 0, middle + int(after[0]) if after.size else len(is_away) - 1
    return DrawnTurns(turns.run, first, last)


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


def _require_whole(turns: DrawnTurns, count: float, centre: Point) -> None:
    """Raise DrawnCoilError if a spiral has too few turns, or if too much of its run lies outside the spiral.

    `count` is the number of turns of the spiral. The limits are `LEAST_TURNS` and `BEYOND`.
    """
    sweeps = _polar(turns.run.path, centre)[1]
    total = float(np.abs(sweeps[:, -1] - sweeps[:, 0]).sum()) / TWO_PI
    if count < LEAST_TURNS or total - count > BEYOND:
        beyond = turns.last + 1 if turns.last + 1 < len(sweeps) else turns.first
        place = place_text(turns.run.path.segments[beyond].start, turns.run.layer)
        raise DrawnCoilError(f"the turns at {place} leave the round spiral of the others: {ONLY}")


def _deviation(
    turns: DrawnTurns, inward: bool, radius: float, pitch: float, centre: Point, width: float
) -> float:
    """Return the largest distance (m) of the turns of one layer from the spiral that the whole coil is computed as.

    This spiral has an outer `radius` (m) and a `pitch` (m). Arcs that replace chords are compared at all samples, and
    the drawn chords at their ends.
    """
    largest, drawn = 0.0, Path(turns.run.path.segments[turns.first : turns.last + 1])
    for path, columns in ((turns.path, slice(None)), (drawn, slice(0, None, len(SAMPLES) - 1))):
        onward = path if inward else path.reversed()
        distance, angle = _polar(onward, centre)
        away = np.abs(distance - radius + pitch * np.abs(angle) / TWO_PI)[:, columns].max(axis=1)
        if away.max() > DEVIATION * width:
            place = place_text(onward.segments[int(away.argmax())].at(0.5), turns.run.layer)
            raise DrawnCoilError(f"the turns at {place} lie {show(float(away.max()), 'm', 2)} from a round spiral, "
                                 f"{show(DEVIATION * width, 'm', 2)} can be: {ONLY}")
        largest = max(largest, float(away.max()))
    return largest


ONLY = "only round spirals, squares, rectangles, hexagons and octagons have known errors"
