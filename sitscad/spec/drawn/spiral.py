"""Recognise the spiral that a drawn conductor forms on each layer, and its stubs and leads.

The estimates replace a drawn coil by a spiral of regular shape, because their error bounds are known only for such
shapes. Turns that do not follow one are an error, which states the place of the largest deviation.
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
from sitscad.kernels.geometry.path import TWO_PI, Arc, Line, Path, Point
from sitscad.spec.coil import CoilSpec, DrawnCopperCoil, DrawnHole, DrawnLayer, DrawnPiece, DrawnTerminal
from sitscad.spec.drawn.arcs import DEVIATION, DrawnSpiral, DrawnTurns, with_arcs
from sitscad.spec.drawn.copper import CopperHeight, DrawnCoilError, DrawnCopper, DrawnPad, place_text
from sitscad.spec.drawn.follow import DrawnConductor, DrawnRun, find_conductor
from sitscad.spec.drawn.kicad import kicad_copper
from sitscad.spec.drawn.polygons import polygon_spiral
from sitscad.spec.profiles import Origin
from sitscad.spec.reading import Remarks

EQUAL_TURNS = 2e-3
"""Largest difference between a layer's number of turns and a whole number for it to be rounded to this number."""


def recognise_coil(
    conductor: DrawnConductor, layers: Sequence[str], written: CoilSpec, heights: Sequence[CopperHeight] = ()
) -> CoilSpec:
    """Return the coil that a drawn conductor forms. The origin of its copper is the centre of its turns.

    `layers` are the names of the copper layers, from the top, and `heights` the copper layers of the file's stack-up.
    `written` is the coil as the spec states it. Raises DrawnCoilError if the turns do not form a spiral of a known
    shape, or if the winding changes its sense. The same error is raised if pitch, size or width differ between layers.
    """
    runs = [run for run, (_, turns) in zip(conductor.runs, conductor.turns(), strict=True) if abs(turns) >= LEAST_TURNS]
    if not runs:
        raise DrawnCoilError("the copper makes less than one turn about its centre: there is no coil")
    spiral = polygon_spiral(runs, conductor.width) if _is_straight(runs) else round_spiral(runs, conductor)
    for part in spiral.turns:
        _require_width(part, conductor.width)
    wound = _layers(spiral, layers)
    _require_series(wound, layers)
    counts = [layer.turns for layer in wound]
    return replace(
        written, shape=spiral.shape, size=spiral.size, turns=counts[0] if len(set(counts)) == 1 else tuple(counts),
        layers=tuple(layer.number for layer in wound), trace_width=conductor.width,
        trace_spacing=round(spiral.pitch - conductor.width, 9), start_angle=wound[0].outer_angle,
        is_mid_side=spiral.is_mid_side, clockwise=wound[0].sense < 0, corner_radius=spiral.corner_radius,
        copper=DrawnCopperCoil(tuple(wound), _series(conductor, spiral, wound, layers),
                               _terminals(conductor, spiral.centre, layers), spiral.deviation,
                               tuple((layers.index(each.name) + 1, each.z, each.thickness) for each in heights)),
    )


def _is_straight(runs: Sequence[DrawnRun]) -> bool:
    """Whether more than half of the length of the runs is straight, after `with_arcs` has replaced chords by arcs."""
    segments = [segment for run in runs for segment in with_arcs(run.path)]
    straight = math.fsum(segment.length for segment in segments if isinstance(segment, Line))
    return straight > 0.5 * math.fsum(segment.length for segment in segments)


def _layers(spiral: DrawnSpiral, layers: Sequence[str]) -> list[DrawnLayer]:
    """Return the layers of the winding in the order of the current. The origin is the spiral's centre."""
    wound = []
    for part, count, inward, sense in zip(spiral.turns, spiral.counts, spiral.inward, spiral.senses, strict=True):
        path = part.path.shifted(-spiral.centre.x, -spiral.centre.y)
        outer_end = path.start if inward else path.end
        turns = float(round(count)) if abs(count - round(count)) < EQUAL_TURNS else round(count, 6)
        wound.append(DrawnLayer(layers.index(part.run.layer) + 1, path, math.atan2(outer_end.y, outer_end.x),
                                sense if inward else -sense, inward, turns))
    return wound


def _require_width(turns: DrawnTurns, width: float) -> None:
    """Raise DrawnCoilError if any track of the turns has another width than `width` (m)."""
    for segment, each in zip(turns.run.path.segments[turns.first : turns.last + 1],
                             turns.run.widths[turns.first : turns.last + 1], strict=True):
        if abs(each - width) > 1e-9:
            place = place_text(segment.start, turns.run.layer)
            raise DrawnCoilError(f"the turn at {place} is {show(each, 'm')} wide, others {show(width, 'm')}: turns of "
                                 "unequal width are not computed")


def _require_series(wound: Sequence[DrawnLayer], layers: Sequence[str]) -> None:
    """Raise DrawnCoilError if the current of a layer turns opposite to the others, or if a layer has two spirals."""
    circulation = [layer.sense * (1 if layer.inward else -1) for layer in wound]
    for layer, way in zip(wound, circulation, strict=True):
        if way * sum(circulation) <= 0:
            raise DrawnCoilError(f"layer {layers[layer.number - 1]} turns the other way and cancels the field of the "
                                 "others")
    if len({layer.number for layer in wound}) < len(wound):
        raise DrawnCoilError("two spirals lie on one layer: a coil has one spiral on each layer")


def _series(
    conductor: DrawnConductor, spiral: DrawnSpiral, wound: Sequence[DrawnLayer], layers: Sequence[str]
) -> tuple[DrawnPiece | DrawnHole, ...]:
    """Return tracks and holes in the order of the current, relative to the spiral's centre.

    `wound` are the layers of the winding, and `layers` the names of the copper layers from the top.
    """
    if len(conductor.vias) != len(conductor.runs) - 1:
        raise DrawnCoilError("a via joins no two tracks")
    series: list[DrawnPiece | DrawnHole] = []
    home, started = (-spiral.centre.x, -spiral.centre.y), 0
    for run, via in zip(conductor.runs, (*conductor.vias, None), strict=True):
        number, part = layers.index(run.layer) + 1, next((part for part in spiral.turns if part.run is run), None)
        first, last = (part.first, part.last) if part else (0, -1)
        series += _pieces(run, 0, first, number, LEAD if not started else STUB, home)
        if part is not None:
            series.append(DrawnPiece(number, wound[started].path, conductor.width, WINDING))
            started += 1
        role = LEAD if started in (0, len(spiral.turns)) else STUB
        series += _pieces(run, last + 1, len(run.widths), number, role, home)
        if via is not None:
            series.append(DrawnHole(via.centre.shifted(*home), via.drill or 0.5 * min(via.size), min(via.size)))
    return tuple(series)


WINDING, STUB, LEAD = "winding", "stub", "lead"
"""Purposes of drawn tracks, as in `layout.board.Role`."""


def _pieces(
    run: DrawnRun, first: int, stop: int, layer: int, role: str, home: tuple[float, float]
) -> Iterator[DrawnPiece]:
    """Yield the segments `first` to `stop` (exclusive) of a run as tracks. Each track has one width.

    `layer` is the number of the copper layer, and `role` the purpose of the tracks. `home` (m) is added to their
    coordinates.
    """
    rows = zip(run.path.segments[first:stop], run.widths[first:stop], strict=True)
    for width, group in groupby(rows, key=lambda row: row[1]):
        yield DrawnPiece(layer, Path(tuple(segment for segment, _ in group)).shifted(*home), width, role)


def _terminals(
    conductor: DrawnConductor, centre: Point, layers: Sequence[str]
) -> tuple[DrawnTerminal, DrawnTerminal]:
    """Return both terminals relative to the coil's `centre` (m).

    If a track ends without a pad, the terminal is a square whose sides are the track's width.
    """
    ends = ((conductor.runs[0], conductor.runs[0].path.start), (conductor.runs[-1], conductor.runs[-1].path.end))
    first, second = (
        DrawnTerminal(at.shifted(-centre.x, -centre.y), (run.widths[0],) * 2 if pad is None else _extent(pad),
                      layers.index(run.layer) + 1)
        for (run, end), pad in zip(ends, conductor.terminals, strict=True)
        for at in (end if pad is None else pad.centre,)
    )
    return first, second


def _extent(pad: DrawnPad) -> tuple[float, float]:
    """Return the sides (m) of a pad's bounding box along x and y."""
    (x, y), cos, sin = pad.size, abs(math.cos(pad.angle)), abs(math.sin(pad.angle))
    return x * cos + y * sin, x * sin + y * cos


KEY = "coil.drawn"

MOST_BYTES = 32 * 2**20
"""Largest size of a file (bytes). A package holds a copy of the file."""


def coil_from_file(written: CoilSpec, place: Origin, copper_layers: int | None, remarks: Remarks) -> CoilSpec:
    """Return the coil that is drawn in a file.

    `written` is the coil as the spec states it, and `place` the spec, which names the file. The file's bytes are added
    to `remarks.files`. If the file cannot be used, record the reason as an error in `remarks` and return a small
    circular coil as a placeholder. `copper_layers` is the number of copper layers of the spec's stack-up. None if the
    spec has no stack-up.
    """
    assert written.drawn is not None
    # a small coil in place of a file that cannot be used, for the checks of the rest of the spec
    unread = replace(written, shape="circle", size=(1e-3, 1e-3), turns=1.0, trace_width=1e-4, trace_spacing=1e-4)
    smaller = "name the coil's own board"
    file = place.read_named_file(written.drawn, KEY, remarks, "KiCad", "coil.kicad_mod", MOST_BYTES, smaller)
    if file is None:
        return unread
    content, names = file
    remarks.files |= dict.fromkeys(names, content)
    written = replace(written, drawn=min(names))
    try:
        copper = kicad_copper(content, "the file")
        conductor = find_conductor(copper, written.net or "", written.start_pad or "", written.end_pad or "")
        return recognise_coil(conductor, _board_layers(copper, copper_layers), written, copper.heights)
    except DrawnCoilError as error:
        remarks.flaw("SIT011", KEY, f"{written.drawn}: {error}", "correct the drawing, or write the coil's shape")
        return unread


def _board_layers(copper: DrawnCopper, count: int | None) -> tuple[str, ...]:
    """Return the names of the file's copper layers from the top, for a stack-up with `count` copper layers.

    A `count` of None stands for the default stack-up, which has two copper layers. Raises DrawnCoilError if the file
    has another number of copper layers.
    """
    names = copper.names_for(2 if count is None else count)
    if not names:
        layers = "the default stack-up has 2" if count is None else f"fpc.stackup has {count}"
        raise DrawnCoilError(f"it has {len(copper.layers)} copper layers, {layers}: write its own stack-up")
    return names


LEAST_TURNS = 0.75
"""Smallest number of turns of a run that counts as a layer of the winding."""

SEARCH = (0.5, 0.25, DEVIATION)
"""Largest distance between a track and the fitted spiral, divided by the track width, for three successive fits.

Tracks at a larger distance do not count as turns: there the turns of a run begin or end.
"""

BEYOND = 1.1
"""Largest number of turns of a run that are not part of its spiral. A lead may go round the coil once."""

SAMPLES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Fractions of a segment's length at which its distance from the spiral is computed."""

CORE = 0.3
"""Fraction of a run's length that the first fit omits at each end, because leads and stubs can lie there."""



@record(eq=False)
class _FittedSpirals:
    """Fitted spirals of all layers about a common `centre` (m): r = start + slope * theta.

    theta (rad) is the angle from the start of the layer, along the current. `starts` (m) and `slopes` (m/rad) have one
    value for each layer.
    """

    centre: Point
    starts: Array
    slopes: Array


def round_spiral(runs: Sequence[DrawnRun], conductor: DrawnConductor) -> DrawnSpiral:
    """Return the round spiral that the runs of a conductor form. Raises DrawnCoilError if they form none."""
    fit, turns = _fit_spirals_to_runs(runs, conductor)
    sweeps = [float(_polar_coordinates(part.path, fit.centre)[1][-1, -1]) for part in turns]
    growths = [float(slope) * sweep for slope, sweep in zip(fit.slopes, sweeps, strict=True)]
    outer = float(np.mean([start + max(growth, 0.0) for start, growth in zip(fit.starts, growths, strict=True)]))
    pitch, inward = TWO_PI * float(np.abs(fit.slopes).mean()), tuple(growth < 0.0 for growth in growths)
    for part, sweep in zip(turns, sweeps, strict=True):
        _require_enough_turns(part, abs(sweep) / TWO_PI, fit.centre)
    deviation = max(_deviation(part, is_inward, outer, pitch, fit.centre, conductor.width)
                    for part, is_inward in zip(turns, inward, strict=True))
    diameter = round(2.0 * outer + conductor.width, 9)
    return DrawnSpiral(
        "circle", (diameter, diameter), pitch, fit.centre, tuple(turns), tuple(abs(each) / TWO_PI for each in sweeps),
        inward, tuple(int(math.copysign(1, sweep)) for sweep in sweeps), deviation=deviation,
    )


def _polar_coordinates(path: Path, centre: Point) -> tuple[Array, Array]:
    """Return polar radius (m) and angle (rad) about `centre` of points on a path: arrays (segments, samples).

    The points lie at the fractions `SAMPLES` of each segment. The angle is 0 at the start and has no jumps of 2 pi.
    """
    places = np.array([[segment.at(fraction) for fraction in SAMPLES] for segment in path]) - centre
    angle = np.unwrap(np.arctan2(places[..., 1], places[..., 0]).ravel()).reshape(places.shape[:2])
    return np.hypot(places[..., 0], places[..., 1]), angle - angle[0, 0]


def _fit_spirals_to_runs(
    runs: Sequence[DrawnRun], conductor: DrawnConductor
) -> tuple[_FittedSpirals, list[DrawnTurns]]:
    """Return the spirals that are fitted to the runs, and the segments of each run that belong to its spiral."""
    turns = [_middle_turns(run) for run in runs]
    fit = _fit_spirals([part.path for part in turns], conductor.centre)
    for tolerance in SEARCH:
        turns = [_extend_turns(fit, k, part, tolerance * conductor.width) for k, part in enumerate(turns)]
        fit = _fit_spirals([part.path for part in turns], fit.centre)
    return fit, turns


def _middle_turns(run: DrawnRun) -> DrawnTurns:
    """Return the middle part of a run, without the fraction `CORE` of its length at each end.

    This part surely belongs to the winding.
    """
    ends = np.cumsum([segment.length for segment in run.path]) / run.path.length
    first, last = (int(np.searchsorted(ends, fraction)) for fraction in (CORE, 1.0 - CORE))
    return DrawnTurns(run, first, last)


def _extend_turns(fit: _FittedSpirals, layer: int, turns: DrawnTurns, tolerance: float) -> DrawnTurns:
    """Return the turns, extended along their run as long as it stays within `tolerance` (m) of its fitted spiral.

    `layer` is the index of the spiral in `fit`.
    """
    radius, angle = _polar_coordinates(turns.run.path, fit.centre)
    spiral = fit.starts[layer] + fit.slopes[layer] * (angle - angle[turns.first, 0])
    # the middles of chords lie further inside than their ends
    inner = np.array([isinstance(segment, Arc) for segment in turns.run.path])[:, None] | np.isin(SAMPLES, (0.0, 1.0))
    is_away = (np.abs(radius - spiral) * inner).max(axis=1) > tolerance
    middle = (turns.first + turns.last) // 2
    before, after = np.flatnonzero(is_away[:middle]), np.flatnonzero(is_away[middle + 1 :])
    first, last = int(before[-1]) + 1 if before.size else 0, middle + int(after[0]) if after.size else len(is_away) - 1
    return DrawnTurns(turns.run, first, last)


def _fit_spirals(paths: Sequence[Path], centre: Point) -> _FittedSpirals:
    """Fit one spiral to each path, with a common centre, by least squares. `centre` (m) is the initial guess."""
    for _ in range(FITS):
        rows, radii = [], []
        for k, path in enumerate(paths):
            radius, angle = (each.ravel() for each in _polar_coordinates(path, centre))
            heading = math.atan2(path.start.y - centre.y, path.start.x - centre.x) + angle
            row = np.zeros((radius.size, 2 + 2 * len(paths)))
            row[:, 0], row[:, 1], row[:, 2 + 2 * k], row[:, 3 + 2 * k] = np.cos(heading), np.sin(heading), 1.0, angle
            rows.append(row)
            radii.append(radius)
        solution = np.linalg.lstsq(np.vstack(rows), np.concatenate(radii), rcond=None)[0]
        centre = centre.shifted(float(solution[0]), float(solution[1]))
    return _FittedSpirals(centre, solution[2::2], solution[3::2])


FITS = 10
"""Number of linear fits.

Each fit multiplies the error of the centre by the ratio of the pitch to the circumference, or by less.
"""


def _require_enough_turns(turns: DrawnTurns, count: float, centre: Point) -> None:
    """Raise DrawnCoilError if a spiral has too few turns, or if too much of its run lies outside the spiral.

    `count` is the number of turns of the spiral. The limits are `LEAST_TURNS` and `BEYOND`.
    """
    sweeps = _polar_coordinates(turns.run.path, centre)[1]
    total = float(np.abs(sweeps[:, -1] - sweeps[:, 0]).sum()) / TWO_PI
    if count < LEAST_TURNS or total - count > BEYOND:
        beyond = turns.last + 1 if turns.last + 1 < len(sweeps) else turns.first
        place = place_text(turns.run.path.segments[beyond].start, turns.run.layer)
        raise DrawnCoilError(f"the turns at {place} leave the round spiral of the others: {ONLY}")


def _deviation(
    turns: DrawnTurns, inward: bool, radius: float, pitch: float, centre: Point, width: float
) -> float:
    """Return the largest distance (m) between the turns of one layer and the spiral that the estimates use.

    This spiral has the outer `radius` (m) and the `pitch` (m), equal for all layers. `width` (m) is the track width.
    Distances are computed at all samples of the arcs that replace chords, and at the ends of the drawn chords. Raises
    DrawnCoilError if a distance exceeds `DEVIATION` times the width.
    """
    largest, drawn = 0.0, Path(turns.run.path.segments[turns.first : turns.last + 1])
    for path, columns in ((turns.path, slice(None)), (drawn, slice(0, None, len(SAMPLES) - 1))):
        onward = path if inward else path.reversed()
        distance, angle = _polar_coordinates(onward, centre)
        away = np.abs(distance - radius + pitch * np.abs(angle) / TWO_PI)[:, columns].max(axis=1)
        if away.max() > DEVIATION * width:
            place = place_text(onward.segments[int(away.argmax())].at(0.5), turns.run.layer)
            raise DrawnCoilError(f"the turns at {place} lie {show(float(away.max()), 'm', 2)} from a round spiral, "
                                 f"{show(DEVIATION * width, 'm', 2)} can be: {ONLY}")
        largest = max(largest, float(away.max()))
    return largest


ONLY = "only round spirals, squares, rectangles, hexagons and octagons have known errors"
