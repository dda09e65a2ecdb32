"""Windings of a layout in the form of the kernels, and the METHODS for their inductance with error bounds.

The module also compares published closed formulas with the estimate.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, lru_cache
from itertools import pairwise

import numpy as np

from sitscad.basics.late import late
from sitscad.basics.record import record
from sitscad.data import rows
from sitscad.estimates.coil_estimates import CrossCheck
from sitscad.kernels.electromagnetics.inductance.rings import mean_ring_inductance
from sitscad.kernels.electromagnetics.inductance.spirals import (
    COEFFICIENTS,
    Resolution,
    SpiralLayer,
    SpiralOutline,
    current_sheet,
    modified_wheeler,
    monomial,
    spiral_inductance_matrix,
)
from sitscad.kernels.electromagnetics.inductance.track_strands import BentPiece, Side, Track, track
from sitscad.kernels.electromagnetics.loss.bent_tracks import BentTrack
from sitscad.kernels.electromagnetics.loss.corners import MOST_TURN, bend_loops
from sitscad.kernels.electromagnetics.metal.current_spectrum import CurrentSpectrum, ring_spectrum, spiral_spectrum
from sitscad.kernels.electromagnetics.metal.polyline_spectrum import polyline_spectrum, with_chords
from sitscad.kernels.geometry.path import Arc, Line, Path, Point
from sitscad.kernels.geometry.shapes import SHAPES, Outline
from sitscad.layout.board import Coil, Winding
from sitscad.spec.coil import CoilSpec

# round coils do not need it (1 ms)
winding_inductance = late("sitscad.kernels.electromagnetics.inductance.tracks", "winding_inductance")


@record(eq=False)
class WindingGeometry:
    """Layers of one coil around its own centre: as spirals (circles only), or as drawn (all other shapes).

    `drawn` holds sides and arcs for integrals of inductance, `bent` holds them for the computation of losses. Both are
    empty for circles, and `spirals` is empty for other shapes.
    """

    spec: CoilSpec
    spirals: tuple[SpiralLayer, ...]
    drawn: tuple[Track, ...] = ()
    bent: tuple[BentTrack, ...] = ()

    @property
    def fewest_turns(self) -> float:
        """Number of turns of the layer with the fewest turns."""
        return min(self.spec.layer_turns)

    @property
    def inner_radius(self) -> float:
        """Distance (m) of the innermost centre line from the coil's centre; at least half a track width."""
        return max((min(self.spec.size) - self.spec.trace_width) / 2 - self.spec.pitch * self.spec.most_turns,
                   self.spec.trace_width / 2)

    @property
    def outline(self) -> SpiralOutline:
        """Dimensions for the closed formulas, from the layer with the most turns.

        The formulas assume closed turns. A round spiral's outermost turn already moves inwards by a pitch, so its mean
        diameter is smaller.
        """
        across = min(self.spec.size) - (self.spec.pitch if self.spirals else 0.0)
        return SpiralOutline(self.spec.most_turns, across, self.spec.trace_width, self.spec.trace_spacing)


@lru_cache(maxsize=8)
def winding_geometry(spec: CoilSpec, coil: Coil, is_drawn: bool = False) -> WindingGeometry:
    """Return the geometry of a coil, moved so that its centre is the origin.

    If `is_drawn`, a circle has its turns as drawn and no spirals.
    """
    if spec.outline.is_round and not is_drawn:
        radius = (spec.size[0] - spec.trace_width) / 2
        spirals = tuple(
            SpiralLayer(radius, spec.pitch, turns, w.outer_angle, w.sense, w.inward, w.z, spec.trace_width, w.thickness)
            for w, turns in zip(coil.windings, spec.layer_turns, strict=True)
        )
        return WindingGeometry(spec, spirals)
    width, home = spec.trace_width, (-coil.centre.x, -coil.centre.y)
    plans: dict[Path, tuple[Track, BentTrack]] = {}
    for w in coil.windings:
        if w.path not in plans:  # every other layer repeats
            path = mitred_path(w.path.shifted(*home), width)
            plans[w.path] = track_of(path, width, w.thickness, w.z), bent_path(path, width, w.thickness, w.z)
    return WindingGeometry(spec, (),
                           tuple([replace(plans[w.path][0], thickness=w.thickness, z=w.z) for w in coil.windings]),
                           tuple([replace(plans[w.path][1], thickness=w.thickness, z=w.z) for w in coil.windings]))


def bent_track(winding: Winding, width: float) -> BentTrack:
    """Return a layer's path as straight sides and arcs. Arcs of less than half a track width become sharp corners."""
    return bent_path(winding.path, width, winding.thickness, winding.z)


def bent_path(path: Path, width: float, thickness: float, z: float) -> BentTrack:
    """Return any path as straight sides and arcs. Width, thickness and the mid-plane's height `z` are in metres."""
    segments = mitred_path(path, width).segments
    turns = [segment.sweep if isinstance(segment, Arc) else 0.0 for segment in segments]
    starts, ends = np.array([s.start for s in segments]), np.array([s.end for s in segments])
    return BentTrack(starts, ends, np.array(turns), width, thickness, z)


def mitred_path(path: Path, width: float) -> Path:
    """Return the path with arcs of less than half a `width` (m) replaced by sharp corners.

    The inner edge of such copper is sharp, and almost no current flows along its outside.
    """
    segments = list(path.segments)
    for k in range(len(segments) - 1, -1, -1):
        arc = segments[k]
        if isinstance(arc, Line) or arc.radius >= 0.5 * width or abs(arc.sweep) > MOST_TURN:
            continue
        before, after = segments[k - 1] if k else arc, segments[k + 1] if k + 1 < len(segments) else arc
        # the tangents at the arc's ends meet in the corner that the arc rounds
        if isinstance(before, Line):
            onwards = arc.radius * math.tan(0.5 * abs(arc.sweep)) / before.length
            dx, dy = before.end.x - before.start.x, before.end.y - before.start.y
        else:
            onwards = math.tan(0.5 * arc.sweep)  # in radii
            dx, dy = -(arc.start.y - arc.centre.y), arc.start.x - arc.centre.x
        corner = Point(arc.start.x + onwards * dx, arc.start.y + onwards * dy)
        low, high = k - isinstance(before, Line), k + 1 + isinstance(after, Line)
        segments[low:high] = [Line(segments[low].start, corner), Line(corner, segments[high - 1].end)]
    return Path(tuple(segments))


def track_of(path: Path, width: float, thickness: float, z: float) -> Track:
    """Return a path as a track for integrals of inductance. Width, thickness and mid-plane height `z` are in metres."""
    return track(_pieces(path), width, thickness, z)


def _pieces(path: Path) -> list[Side | BentPiece]:
    """Return a path as straight sides and bends, for the integrals of inductance over tracks."""
    pieces: list[Side | BentPiece] = []
    for s in path:
        if isinstance(s, Arc):
            pieces.append(((s.centre.x, s.centre.y), s.radius, s.start_angle, 1.0 if s.ccw else -1.0, abs(s.sweep)))
        else:
            pieces.append(((s.start.x, s.start.y), (s.end.x, s.end.y)))
    return pieces


def equivalent_spirals(geometry: WindingGeometry, coil: Coil) -> tuple[SpiralLayer, ...]:
    """Return round layers that replace a winding of another shape when its loss near metal is computed.

    They have equal cross-sections, pitch and mean turn length.
    """
    if geometry.spirals:
        return geometry.spirals
    spec = geometry.spec
    built = []
    for w, path, turns in zip(coil.windings, geometry.bent, spec.layer_turns, strict=True):
        mean = path.length / (2.0 * math.pi * turns)
        radius = max(mean + 0.5 * spec.pitch * turns, spec.pitch * turns + 0.5 * spec.trace_width)
        built.append(SpiralLayer(radius, spec.pitch, turns, w.outer_angle, w.sense, w.inward, w.z,
                                 spec.trace_width, w.thickness))
    return tuple(built)


def metal_spectrum(geometry: WindingGeometry, nearest: float, is_rough: bool = False) -> CurrentSpectrum:
    """Return the spatial spectrum of a winding's current over wave vectors in the plane of its layers.

    The current is distributed like direct current. The spectrum is accurate for metal `nearest` (m) or farther from the
    mid-plane of each layer. For coils that are not round, it includes the crowding of direct current at bends. For
    round coils, `LossesNearMetal` adds this crowding. If `is_rough`, rings replace the spirals.
    """
    if geometry.spirals and is_rough:
        return ring_spectrum(geometry.spirals, nearest)
    if geometry.spirals:
        return spiral_spectrum(geometry.spirals, nearest)
    tracks = [with_chords(track, nearest) for track in geometry.bent]
    return polyline_spectrum(tracks, nearest, [bend_loops(track, nearest) for track in geometry.bent])


FEW_TURNS, ONE_TURN = 5.0, 1.5  # Numbers of turns below which errors grow faster, and faster again
STACKED, WIDE_STACKED = 3.0, 12.0  # Ratios of track width to layer distance above which errors grow faster
CROWDED = 0.1  # Ratio of track width to inner radius above which errors grow faster
THICK = 4e-4  # Added error per ratio of thickness to width above 1, which the fit lacks


LEAST = 2e-6
"""Least error bound: the error of the reference solutions.

For narrow tracks in many turns the fitted bound alone would be smaller.
"""


@record
class WindingDimensions:
    """Dimensions (m) of a winding that determine the error of its inductance.

    `turns` is for a layer, `size` the shorter outer side, and `heights` are the mid-planes of the layers.
    `corner_radius` is 0 for sharp corners. `shape` is the outline of the coil. `is_mid_side` is True for spirals that
    begin in the middle of a side.
    """

    turns: float
    width: float
    pitch: float
    thickness: float
    inner_radius: float
    size: float
    heights: tuple[float, ...]
    corner_radius: float = 0.0
    shape: Outline = SHAPES["circle"]
    is_mid_side: bool = False

    @property
    def layer_distance(self) -> float:
        """Distance (m) of the nearest layers' mid-planes. Infinite for one layer."""
        heights = sorted(self.heights)
        return min((b - a for a, b in pairwise(heights)), default=math.inf)

    def log_ratios(self) -> dict[str, float]:
        """Return logarithms of ratios of dimensions. The keys are column names of the table of error bounds."""
        few = max(0.0, math.log(FEW_TURNS / self.turns))
        inner = math.log(self.width / self.inner_radius)
        values = {
            "constant": 1.0,
            "inner": inner,
            "crowded": max(0.0, inner - math.log(CROWDED)),
            "fill": math.log(self.width / self.pitch),
            "aspect": math.log(min(1.0, self.thickness / self.width)),
            "size": math.log(self.width / self.size),
            "turns": -math.log(self.turns),
            "few": few,
            "one": max(0.0, math.log(ONE_TURN / self.turns)),
        }
        if len(self.heights) > 1:
            near = math.log(self.width / self.layer_distance)
            stacked = max(0.0, near - math.log(STACKED))
            values |= {
                "near": near,
                "layers": math.log(len(self.heights)),
                "stacked": stacked,
                "stacked_few": stacked * few,
                "wide_stacked": max(0.0, near - math.log(WIDE_STACKED)),
            }
        if self.corner_radius:
            values["corner"] = math.log(self.corner_radius / self.width)
        return values


def error_bound(method: str, dimensions: WindingDimensions) -> float:
    """Return the relative error bound of a method for a winding.

    The bound is a product of powers of the ratios of width, thickness, pitch, distance and radius. The powers were
    fitted to converged volume integrals of random designs of every shape (tests/validation/fit_bounds.py), so that the
    bound exceeds every error by a margin. For a polygon outside the fit, it is `UNFITTED` times the largest bound of
    the shapes in `Outline.bounds`. `dimensions` holds the winding's dimensions.

    Raises ValueError for a shape that declares no bounds, and KeyError if the table has no such method for the shape.
    """
    features, stack = dimensions.log_ratios(), "one" if len(dimensions.heights) == 1 else "more"
    table, fitted = _bound_exponents(), dimensions.shape.shapes_with_bounds
    shapes = (ROUNDED,) if dimensions.corner_radius else fitted
    margin = 1.0 if dimensions.corner_radius or fitted == (dimensions.shape.name,) else UNFITTED
    margin *= MID_SIDE if dimensions.is_mid_side else 1.0
    products = [math.exp(math.fsum(table[shape, method, stack][name] * value for name, value in features.items()))
                for shape in shapes]
    return margin * max(*products, LEAST) + THICK * max(0.0, dimensions.thickness / dimensions.width - 1.0)


@cache
def _bound_exponents() -> dict[tuple[str, str, str], dict[str, float]]:
    """Return exponents of the fitted bounds by shape, method and stack ("one" layer, or "more")."""
    return {
        (row["shape"], row["method"], row["stack"]): {
            name: float(value or 0.0) for name, value in row.items() if name not in NAMES
        }
        for row in rows("inductance_bounds")
    }


UNFITTED = 5.0
"""Factor on the largest bound of the fitted shapes, for polygons outside the fit.

It was tested with pentagons, by the volume integral as in the fit. For one of 40 pentagons, the error was 3.05 times
the larger bound. The errors of the others were below the bound.
"""

MID_SIDE = 3.0
"""Factor on the error bounds of spirals that begin in the middle of a side.

For two of 300 such designs, the error exceeded the bound of spirals that begin in a corner (by the volume integral).
The factor was 2.08 for a design of half a turn, and 1.12 for a design of one turn.
"""

ROUNDED = "rounded"
"""Shape name in the table of bounds for all polygons with rounded corners."""

NAMES = ("shape", "method", "stack", "status", "source")
"""Names of the text columns in the table of error bounds. Each other column holds an exponent."""


@record
class Method:
    """A method for the winding's inductance: its outlines, stated relative error and rough cost (s).

    `serves` is True for outlines that the method can compute. `solve` returns the inductance (H), or None if the
    `source` has no constants for the outline. `error` returns the relative error. It is a bound if `is_valid`, and
    `validity` describes this range. A closed formula (`is_cross_check`) is used only if the user requests it by name.
    """

    name: str
    """Name by which users select the method."""
    serves: Callable[[Outline], bool]
    solve: Callable[[WindingGeometry], float | None]
    error: Callable[[WindingGeometry], float]
    is_valid: Callable[[WindingGeometry], bool]
    validity: str
    cost: float
    """Rough processor time (s)."""
    source: str
    is_cross_check: bool = False


def winding_dimensions(geometry: WindingGeometry, turns: float | None = None) -> WindingDimensions:
    """Return the dimensions of a winding for the error bounds.

    `turns` is the number of turns of the layer for which the bound is computed; None: the layer with the most turns.
    """
    spec, layers = geometry.spec, geometry.spirals or geometry.drawn
    heights, thickness = tuple(layer.z for layer in layers), max(layer.thickness for layer in layers)
    # tighter corners are sharp in the copper (`mitred_path`)
    corner = spec.corner_radius if spec.corner_radius >= 0.5 * spec.trace_width else 0.0
    return WindingDimensions(turns or spec.most_turns, spec.trace_width, spec.pitch, thickness, geometry.inner_radius,
                    min(spec.size), heights, corner, spec.outline, spec.is_mid_side)


def _error_function(method: str) -> Callable[[WindingGeometry], float]:
    """Return the function for a method's stated relative error: the largest bound of all its layers."""

    def error(geometry: WindingGeometry) -> float:
        return max(error_bound(method, winding_dimensions(geometry, turns))
                   for turns in sorted(set(geometry.spec.layer_turns)))

    return error


def _neumann_inductance(geometry: WindingGeometry) -> float:
    """Return the inductance (H) by Neumann's integral over spirals.

    Windings of few turns have more points, because the ends of the spirals have more weight.
    """
    resolution = Resolution(16, 12, 4) if geometry.fewest_turns < FEW_TURNS else Resolution(12, 8, 2)
    return float(spiral_inductance_matrix(list(geometry.spirals), resolution).sum())


def _formula_method(name: str, of_one_layer: float) -> Method:
    """Return one of Mohan's closed formulas as a method for the inductance.

    `of_one_layer` is its relative error for one layer: 1.2 times the largest deviation from the volume integral in 300
    random designs. The error for several layers is 35 %.
    """
    functions = {"current-sheet": current_sheet, "modified-wheeler": modified_wheeler, "monomial": monomial}

    def solve(geometry: WindingGeometry) -> float | None:
        """Return the inductance (H) of all layers: the inductance of one layer, times the number of layers squared.

        None if the formula does not hold.
        """
        outline = geometry.outline
        is_open = outline.inner_diameter > 0.0 and outline.fill > 0.0
        if geometry.spec.has_unequal_turns or geometry.fewest_turns < 1.0 or not is_open:
            return None
        single = functions[name](geometry.spec.outline.sides, outline)
        return None if single is None else single * len(geometry.spec.layers) ** 2

    return Method(
        name, has_formula_constants, solve, lambda g: of_one_layer if len(g.spec.layers) == 1 else 0.35,
        lambda g: g.outline.is_covered and len(g.spec.layers) == 1,
        "one layer, 1 to 20 turns, spacing up to 3 widths, fill 0.1 to 0.9; more layers as if fully coupled", 1e-5,
        "Mohan, Hershenson, Boyd, Lee, IEEE JSSC 34(10) 1999", True)


def has_formula_constants(outline: Outline) -> bool:
    """Return whether Mohan's closed formulas (1999) have constants for an outline."""
    return outline.sides in COEFFICIENTS and not outline.is_long


def _strands(geometry: WindingGeometry) -> float:
    return winding_inductance(geometry.drawn, (2, 3))


METHODS: tuple[Method, ...] = (
    Method("spiral-neumann", lambda shape: shape.is_round, _neumann_inductance,
           _error_function("spiral-neumann"), lambda g: True,
           "0.5 to 200 turns, 1 to 8 layers, any fraction of a turn", 5e-3,
           "Neumann's integral over the real spirals, strands by Gauss, geometric mean distance kept"),
    Method("mean-rings", lambda shape: shape.is_round, lambda g: mean_ring_inductance(g.spirals),
           lambda g: 0.012 + 0.45 / g.fewest_turns**2.5, lambda g: True,
           "thousands of designs; a broken turn weighs much where turns are few", 3e-4,
           "Maxwell's coaxial rings, one a turn at its mean radius, by mean logarithms of their distances"),
    Method("strands", lambda shape: not shape.is_round, _strands,
           _error_function("strands"), lambda g: True, "sides, arcs, any angle, 0.5 to 200 turns, 1 to 8 layers", 1e-2,
           "Neumann's closed forms for parallel and inclined filaments (Grover 1946), points along arcs, corner terms"),
    _formula_method("current-sheet", 0.15),
    _formula_method("modified-wheeler", 0.15),
    _formula_method("monomial", 0.18),
)
"""All methods for the winding's inductance, a row for each."""

DEFAULT_TOLERANCE = 1e-4
"""Relative tolerance of the inductance if the user states none."""


def choose_method(geometry: WindingGeometry, name: str | None = None, tolerance: float | None = None) -> Method:
    """Return the method of this name, or the cheapest method whose stated error meets the tolerance.

    If no method meets it, return the most accurate method. Raises ValueError for a name that does not exist or does not
    serve the shape; the text lists the valid names.
    """
    fitting = [method for method in METHODS if method.serves(geometry.spec.outline)]
    if name is not None:
        chosen = next((method for method in fitting if method.name == name), None)
        if chosen is None or chosen.solve(geometry) is None:
            names = ", ".join(m.name for m in fitting if not m.is_cross_check or m.solve(geometry) is not None)
            raise ValueError(f"no method {name!r} for shape {geometry.spec.shape!r}: choose one of {names}")
        return chosen
    if tolerance is not None and not tolerance > 0.0:
        raise ValueError("the tolerance must be positive")
    solvers = [method for method in fitting if not method.is_cross_check and method.is_valid(geometry)]
    if not solvers:
        raise ValueError(f"no method for shape {geometry.spec.shape!r}")
    allowed = DEFAULT_TOLERANCE if tolerance is None else tolerance
    good = [method for method in solvers if method.error(geometry) <= allowed]
    return min(good, key=lambda m: m.cost) if good else min(solvers, key=lambda m: m.error(geometry))


def cross_checks(name: str, geometry: WindingGeometry, inductance: float) -> tuple[CrossCheck, ...]:
    """Return every closed formula that holds for the coil's shape, compared with the winding's inductance (H).

    `name` is the coil's name.
    """
    checks = []
    for method in METHODS:
        if method.is_cross_check and method.serves(geometry.spec.outline):
            value = method.solve(geometry)
            if value is not None and math.isfinite(value):
                checks.append(CrossCheck(name, method.name, value, value / inductance - 1.0, method.is_valid(geometry),
                                        method.validity))
    return tuple(checks)


def reason_without_cross_check(coil: CoilSpec, checks: Sequence[CrossCheck]) -> str | None:
    """Return the reason why no closed formula is compared. None if `checks` has a closed formula."""
    if checks:
        return None
    if not has_formula_constants(coil.outline):
        return (
            f"no published closed formula with a stated range is known to us for a {coil.shape}: Mohan (1999) has "
            "none, and TI (SNOA930C) gives none for elongated coils"
        )
    return "Mohan's formulas (1999) want one number of turns on all layers, one turn or more, and an open middle"
