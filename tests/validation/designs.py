"""Random coils of every shape in published ranges, the same for every run: a seed and a number name a design.

Outer size 2 to 40 mm (rectangle and racetrack: 1.05 to 3 times as long), track 30 to 80 % of the pitch, turns fill
10 to 85 % of the way to the centre, 0.5 to MOST_TURNS turns (circles any number, others what the shape allows), 1 to 3
layers, copper 9 to 70 um and at most as thick as the track is wide, layers' mid-planes 25 to 300 um further apart than
the copper is thick.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import volume_integral
from windings import coil

from sitscad.geometry.path import Arc, Path
from sitscad.geometry.spiral import SpiralDimensions, corner_angle, wind
from sitscad.physics.spirals import SpiralLayer
from sitscad.physics.tracks import Track, track
from sitscad.spec.sensor import CoilSpec

SHAPES = ("circle", "square", "rectangle", "hexagon", "octagon", "racetrack")
PARTS = {"square": 4, "rectangle": 4, "hexagon": 6, "octagon": 8, "racetrack": 2}
MOST_TURNS = 6.0


@dataclass(frozen=True)
class Design:
    """A coil and its layers as the fast methods and as the volume integral want them."""

    spec: CoilSpec
    spirals: tuple[SpiralLayer, ...]
    drawn: tuple[Track, ...]
    conductors: tuple[volume_integral.Conductor, ...]


def design(shape: str, number: int, most_turns: float = MOST_TURNS) -> Design:
    """Design `number` of a shape."""
    random = np.random.default_rng([2614, SHAPES.index(shape), number])

    def logarithmic(low, high):
        return float(low * (high / low) ** random.random())

    size = logarithmic(2e-3, 40e-3)
    turns = logarithmic(0.5, most_turns)
    if shape in PARTS:
        turns = max(1, round(turns * PARTS[shape])) / PARTS[shape]
    share, fill = random.uniform(0.3, 0.8), random.uniform(0.1, 0.85)
    pitch = fill * 0.5 * size / (turns + 1.0)
    width = share * pitch
    layers = int(random.choice([1, 2, 2, 3]))
    copper = min(logarithmic(9e-6, 70e-6), width)
    apart = copper + logarithmic(25e-6, 300e-6)
    long = size * (random.uniform(1.05, 3.0) if shape in ("rectangle", "racetrack") else 1.0)
    spec = CoilSpec(shape=shape, size=(long, size), turns=turns, layers=tuple(range(1, layers + 1)), trace_width=width,
                    trace_spacing=pitch - width, start_angle=0.0, clockwise=False, corner_radius=0.0)  # fmt: skip
    return built(spec, tuple(-k * apart for k in range(layers)), copper)


def built(spec: CoilSpec, heights: tuple[float, ...], copper: float) -> Design:
    """A coil of the spec with copper of one thickness at the given mid-planes."""
    if spec.shape == "circle":
        spirals = tuple(coil(spec.size[1], spec.turns, spec.trace_width, spec.trace_spacing, heights,
                             [copper] * len(heights)))  # fmt: skip
        return Design(spec, spirals, (), tuple(volume_integral.spiral(layer) for layer in spirals))
    dimensions = SpiralDimensions(spec.size, spec.trace_width, spec.pitch, spec.turns)
    angle, drawn, conductors = corner_angle(spec.shape, spec.start_angle, 1), [], []
    for k, z in enumerate(heights):
        inward = k % 2 == 0
        if not inward:
            angle += 4.0 * math.pi * spec.turns
        path = wind(spec.shape, dimensions, angle, 1 if inward else -1)
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


def exact(coil: Design, points: volume_integral.Points | None = None) -> float:
    """The coil's inductance (H) by the volume integral; congruent layers are integrated once."""
    n = points or volume_integral.Points(along=9 if coil.spirals else 12 if coil.spec.shape == "racetrack" else 14)
    layers = coil.conductors
    congruent = coil.spec.shape not in ("rectangle", "racetrack")
    total = alone = 0.0
    for i in range(len(layers)):
        if i < 2:
            alone = alone if congruent and i else volume_integral.mutual(layers[i], layers[i], n)
        total += alone if congruent or i < 2 else volume_integral.mutual(layers[i], layers[i], n)
        total += 2.0 * sum(volume_integral.mutual(layers[i], layers[j], n) for j in range(i))
    return total
