"""A winding's own capacitance: its layers through the real stack-up, at the voltages of the series circuit."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sitscad.layout.board import Coil
from sitscad.physics.capacitance import Slab, strip_layers, turn_capacitance, winding_capacitance, winding_voltages
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


def self_capacitance(coil: Coil, spec: SensorSpec) -> float:
    """Capacitance (F) of a coil's winding between its ends, without leads: twice the electric energy at one volt.

    Layers see each other through the stack-up as strips shifted by every amount, turns of a layer their neighbours;
    the voltage follows the flux that each turn links. Elastomer and metal around the board are not in it.
    """
    geometry = spec.coil
    lengths = turn_lengths(coil, spec)
    radii = np.maximum(lengths / (2.0 * math.pi), 0.5 * geometry.trace_width)
    size = 0.2235 * (geometry.pitch * geometry.turns / radii.size + coil.windings[0].thickness)
    heights, inward = [w.z for w in coil.windings], [w.inward for w in coil.windings]
    voltages = winding_voltages(radii, heights, inward, size)
    layers = [w.layer for w in coil.windings]
    order = np.argsort(np.argsort(layers))
    reach = 0.5 * geometry.outer_diameter
    per_area = strip_layers(slabs(spec.fpc.stackup, layers), geometry.trace_width, geometry.pitch, reach)
    areas = lengths * geometry.pitch * geometry.turns / radii.size
    between_turns = turn_capacitance(
        lengths, voltages, geometry.turns, geometry.trace_width, geometry.trace_spacing,
        coil.windings[0].thickness, beside_copper(spec.fpc.stackup, layers[0]),
    )  # fmt: skip
    return winding_capacitance(per_area[np.ix_(order, order)], voltages, areas) + between_turns


def turn_lengths(coil: Coil, spec: SensorSpec) -> Array:
    """Length (m) of a whole turn at places that share a layer's turns evenly, from the outside in."""
    turns = spec.coil.turns
    count = min(PLACES[1], max(PLACES[0], math.ceil(turns)))
    inside = spec.coil.pitch * turns * ((np.arange(count) + 0.5) / count - 0.5)
    mean = coil.windings[0].path.length / turns
    return np.asarray(np.maximum(mean - SHRINKS.get(spec.coil.shape, 2.0 * math.pi) * inside, 0.05 * mean))


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
