"""Random coils of every shape in published ranges, the same for every run: a seed and a number name a design.

Outer size 2 to 40 mm (rectangle and racetrack: 1.05 to 3 times as long), track 30 to 80 % of the pitch, turns fill
10 to 85 % of the way to the centre, 0.5 to MOST_TURNS turns (circles any number, others what the shape allows), 1 to 3
layers, copper 9 to 70 um and at most as thick as the track is wide, layers' mid-planes 25 to 300 um further apart than
the copper is thick. "rounded" are the four polygons in turn with a corner radius of half a track to an eighth of the
size (up to 12 tracks). Large designs have 6 to 200 turns on 1 to 8 layers and are 4 to 80 mm across.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import volume_integral
from windings import coil

from sitscad.kernels.electromagnetics.inductance.spirals import SpiralLayer
from sitscad.kernels.electromagnetics.inductance.track_strands import Track, track
from sitscad.kernels.geometry.path import Arc, Path
from sitscad.kernels.geometry.shapes import SHAPES as OUTLINES
from sitscad.kernels.geometry.shapes import SpiralDimensions
from sitscad.spec.coil import CoilSpec

SHAPES = ("circle", "square", "rectangle", "hexagon", "octagon", "racetrack")
PARTS = {name: outline.ends_per_turn for name, outline in OUTLINES.items() if outline.ends_per_turn}
POLYGONS = ("square", "rectangle", "hexagon", "octagon")
FAMILIES = (*SHAPES, "rounded")
MOST_TURNS = 12.0
LARGEST = 250.0
"""Turns times the kinds of pairs of layers of a large design, at most: what the yardstick can afford."""


@dataclass(frozen=True)
class Design:
    """A coil and its layers as the fast methods and as the volume integral want them."""

    spec: CoilSpec
    spirals: tuple[SpiralLayer, ...]
    drawn: tuple[Track, ...]
    conductors: tuple[volume_integral.Conductor, ...]


def design(family: str, number: int, large: bool = False) -> Design:
    """Design `number` of a family; the large ones are a series of their own."""
    random = np.random.default_rng([2614, FAMILIES.index(family), number, *((1,) if large else ())])
    shape = POLYGONS[number // 2 % len(POLYGONS)] if family == "rounded" else family

    def logarithmic(low, high):
        return float(low * (high / low) ** random.random())

    turns = logarithmic(6.0, 200.0) if large else logarithmic(0.5, MOST_TURNS)
    if shape in PARTS:
        turns = max(1, round(turns * PARTS[shape])) / PARTS[shape]
    size = logarithmic(max(4e-3, 2.5e-4 * turns), 80e-3) if large else logarithmic(2e-3, 40e-3)
    share, fill = random.uniform(0.3, 0.8), random.uniform(0.1, 0.85)
    pitch = fill * 0.5 * size / (turns + 1.0)
    width = share * pitch
    choice = [n for n in range(1, 9) if turns * (2 * n - 1) <= LARGEST] if large else [1, 2, 2, 3]
    layers = int(random.choice(choice))
    copper = min(logarithmic(9e-6, 70e-6), width)
    apart = copper + logarithmic(25e-6, 300e-6)
    long = size * (random.uniform(1.05, 3.0) if shape in ("rectangle", "racetrack") else 1.0)
    radius = logarithmic(0.5 * width, max(0.6 * width, min(size / 8.0, 12.0 * width))) if family == "rounded" else 0.0
    spec = CoilSpec(shape=shape, size=(long, size), turns=turns, layers=tuple(range(1, layers + 1)), trace_width=width,
                    trace_spacing=pitch - width, start_angle=0.0, clockwise=False, corner_radius=radius)
    return built(spec, tuple(-k * apart for k in range(layers)), copper)


def built(spec: CoilSpec, heights: tuple[float, ...], copper: float) -> Design:
    """A coil of the spec with copper of one thickness at the given mid-planes."""
    if spec.shape == "circle":
        spirals = tuple(coil(spec.size[1], spec.turns, spec.trace_width, spec.trace_spacing, heights,
                             [copper] * len(heights)))
        return Design(spec, spirals, (), tuple(volume_integral.spiral(layer) for layer in spirals))
    dimensions = SpiralDimensions(spec.size, spec.trace_width, spec.pitch, spec.turns, is_mid_side=spec.is_mid_side)
    angle, drawn, conductors = spec.outline.start(spec.start_angle, 1, spec.is_mid_side), [], []
    for k, z in enumerate(heights):
        inward = k % 2 == 0
        if not inward:
            angle += 4.0 * math.pi * spec.turns
        path = spec.outline.wind(dimensions, angle, 1 if inward else -1, spec.corner_radius)
        pieces = pieces_of(path if inward else path.reversed())
        drawn.append(track(pieces, spec.trace_width, copper, z))
        named = [("arc" if len(piece) == 5 else "line", *piece) for piece in pieces]
        conductors.append(volume_integral.conductor(named, spec.trace_width, copper, z))
    return Design(spec, (), tuple(drawn), tuple(conductors))


def pieces_of(path: Path):
    """Sides and bends of a path, as `track` wants them."""
    return [
        (tuple(s.centre), s.radius, s.start_angle, 1.0 if s.ccw else -1.0, abs(s.sweep))
        if isinstance(s, Arc)
        else (tuple(s.start), tuple(s.end))
        for s in path
    ]


def resolution(coil: Design, finer: bool = False) -> volume_integral.Points:
    """The points that the yardstick takes for a coil, or finer ones that show how good those are."""
    curved = any(len(c.polar) for c in coil.conductors)
    joined, few = curved and not coil.spirals, coil.spec.turns < 2.5
    # wide tracks of few turns above each other: where one leaves the other, the mean over the widths bends
    across = 14 if few and len(coil.spirals) > 1 else 9 if few else 7
    points = volume_integral.Points(along=18 if joined else 12, across=across)
    if not finer:
        return points
    return replace(points, far=8, along=points.along + 6, inner=12, beside=5, across=points.across + 5, through=5,
                   outline=24, levels=9)


def exact(coil: Design, points: volume_integral.Points | None = None) -> float:
    """The coil's inductance (H) by the volume integral; layers lie at equal distances, so alike pairs are done once."""
    n = points or resolution(coil)
    layers, known, total = coil.conductors, {}, 0.0
    turned_alike = coil.spec.shape not in ("rectangle", "racetrack")
    for i in range(len(layers)):
        for j in range(i, len(layers)):
            # two layers on, a layer is the first one turned about the centre; by mirror it is so for the other sense
            key = (0 if i == j and turned_alike else i % 2, j - i)
            if key not in known:
                known[key] = volume_integral.mutual(layers[i], layers[j], n)
            total += known[key] if i == j else 2.0 * known[key]
    return total
