"""A winding's own capacitance: its layers through the real stack-up, at the voltages of the series circuit."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sitscad.layout.board import Coil
from sitscad.physics.capacitance import Slab, strip_layers, turn_capacitance, winding_capacitance, winding_voltages
from sitscad.record import record
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.stackup import LayerKind, Stackup

Array = NDArray[np.float64]

USUAL_PERMITTIVITY = 3.4
"""Relative permittivity of polyimide, where a layer of the stack-up states none."""

PLACES = (8, 24)
"""Fewest and most places along a layer at which its voltage is taken."""

SHRINKS = {
    "square": 8.0,
    "rectangle": 8.0,
    "hexagon": 12.0 * math.tan(math.pi / 6.0),
    "octagon": 16.0 * math.tan(math.pi / 8.0),
}
"""How much shorter a turn gets per metre that it lies further inside; round ones by 2 pi."""


@record(eq=False)
class _Part:
    """The places between two numbers of turns from the outside, where the same layers have turns.

    ``lengths`` (m) are of a whole turn at each place, each of which stands for ``share`` turns.
    """

    present: tuple[int, ...]
    lengths: Array
    share: float


def self_capacitance(coil: Coil, spec: SensorSpec) -> float:
    """Capacitance (F) of a coil's winding between its ends, without leads: twice the electric energy at one volt.

    Layers see each other through the stack-up as strips shifted by every amount, turns of a layer their neighbours;
    the voltage follows the flux that each turn links. Further inside than a layer has turns, the others see each other
    through what takes its place. Elastomer and metal around the board are not in it.
    """
    parts = _parts(coil, spec)
    voltages = _voltages(parts, coil, spec)
    layers = [winding.layer for winding in coil.windings]
    total, first = 0.0, 0
    for part in parts:
        size = part.lengths.size
        areas = part.lengths * spec.coil.pitch * part.share
        here = voltages[list(part.present), first : first + size]
        total += winding_capacitance(_per_area(spec, [layers[k] for k in part.present]), here, areas)
        first += size
    return total + _between_turns(parts, voltages, coil, spec)


def _parts(coil: Coil, spec: SensorSpec) -> list[_Part]:
    turns = spec.coil.layer_turns
    found, low = [], 0.0
    for high in sorted(set(turns)):
        count = min(PLACES[1], max(PLACES[0], math.ceil(high - low)))
        share = (high - low) / count
        present = tuple(k for k, number in enumerate(turns) if number >= high)
        middles: Array = low + share * (np.arange(count, dtype=np.float64) + 0.5)
        found.append(_Part(present, turn_lengths(coil, spec, middles), share))
        low = high
    return found


def turn_lengths(coil: Coil, spec: SensorSpec, places: Array) -> Array:
    """Length (m) of a whole turn at places so many turns from the outside; as in the layer that has most turns."""
    turns = spec.coil.layer_turns
    most = max(range(len(turns)), key=lambda k: turns[k])
    mean = coil.windings[most].path.length / turns[most]
    inside = spec.coil.pitch * (places - 0.5 * turns[most])
    return np.asarray(np.maximum(mean - SHRINKS.get(spec.coil.shape, 2.0 * math.pi) * inside, 0.05 * mean))


def _voltages(parts: list[_Part], coil: Coil, spec: SensorSpec) -> Array:
    # Along every layer at all places, from the outside in; what a layer has no turns for is left at its inner end's.
    lengths = np.concatenate([part.lengths for part in parts])
    radii = np.maximum(lengths / (2.0 * math.pi), 0.5 * spec.coil.trace_width)
    turns = np.concatenate([
        np.outer([k in part.present for k in range(len(coil.windings))], np.full(part.lengths.size, part.share))
        for part in parts
    ], axis=1)  # fmt: skip
    size = 0.2235 * (spec.coil.pitch * turns.max(axis=0) + coil.windings[0].thickness)
    heights, inward = [w.z for w in coil.windings], [w.inward for w in coil.windings]
    return winding_voltages(radii, heights, inward, size, turns)


def _per_area(spec: SensorSpec, layers: list[int]) -> Array:
    # Capacitance matrix per area (F/m2) of these layers, in the order of winding.
    order = np.argsort(np.argsort(layers))
    reach = 0.5 * spec.coil.outer_diameter
    matrix = strip_layers(slabs(spec.fpc.stackup, layers), spec.coil.trace_width, spec.coil.pitch, reach)
    return np.asarray(matrix[np.ix_(order, order)])


def _between_turns(parts: list[_Part], voltages: Array, coil: Coil, spec: SensorSpec) -> float:
    lengths = np.concatenate([part.lengths for part in parts])
    shares = np.concatenate([np.full(part.lengths.size, part.share) for part in parts])
    beside = beside_copper(spec.fpc.stackup, coil.windings[0].layer)
    total = 0.0
    for k in range(len(coil.windings)):
        count = sum(part.lengths.size for part in parts if k in part.present)
        total += turn_capacitance(
            lengths[:count], voltages[k, :count], shares[:count], spec.coil.trace_width, spec.coil.trace_spacing,
            coil.windings[0].thickness, beside,
        )  # fmt: skip
    return total


def slabs(stackup: Stackup, layers: list[int]) -> list[Slab]:
    """The stack-up from top to bottom; copper layers without winding count as what lies beside them."""
    found, number = [], 0
    for layer in stackup.layers:
        if layer.kind is LayerKind.COPPER:
            number += 1
            found.append(Slab(layer.thickness, beside_copper(stackup, number), number in layers))
        elif layer.thickness > 0.0:
            found.append(Slab(layer.thickness, layer.relative_permittivity or USUAL_PERMITTIVITY))
    return found


def beside_copper(stackup: Stackup, number: int) -> float:
    """Relative permittivity of what fills the gaps of a copper layer: coverlay adhesive or bonding film flows in."""
    indices = [i for i, layer in enumerate(stackup.layers) if layer.kind is LayerKind.COPPER]
    index = indices[number - 1]
    around = [stackup.layers[i] for i in (index - 1, index + 1) if 0 <= i < len(stackup.layers)]
    soft = [layer.relative_permittivity for layer in around if layer.relative_permittivity]
    return max(soft, default=1.0)
