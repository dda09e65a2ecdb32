"""Own capacitance of a winding, from its layers in the stack-up and the voltages of its turns."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from sitscad.assembly.places.state import BEHIND_THE_BOARD
from sitscad.basics.arrays import Array, Flags
from sitscad.basics.units import show
from sitscad.kernels.electromagnetics.capacitance import (
    Slab,
    strip_layers,
    turn_capacitance,
    winding_capacitance,
    winding_voltages,
)
from sitscad.kernels.electromagnetics.constants import EPSILON0
from sitscad.layout.board import Coil
from sitscad.spec.circuit import LayerKind, Stackup
from sitscad.spec.coil import CoilSpec

USUAL_PERMITTIVITY = 3.4  # Relative permittivity of polyimide, where a layer of the stack-up states none

FILLING = 3.0
"""Relative permittivity assumed between winding and metal: silicones and printed mounts. Air has less."""

STATED = 0.10  # Stated relative error of the own capacitance: additions by metal below it have no note

CAPACITANCE_ERROR, FEW_TURNS_CAPACITANCE_ERROR = 0.20, 0.30
"""Relative errors of the own capacitance: for at least `FEW_TURNS` turns in each layer, and for fewer turns.

Random coils of two to four layers were compared with rings of charge, averaged over the shifts between the turns of two
layers (tests/validation/test_charged_rings.py).
"""

FEW_TURNS = 4.0
"""Number of turns in each layer below which `FEW_TURNS_CAPACITANCE_ERROR` is the error."""

PLACES = (24, 8)
"""Numbers of places along the turns at which voltages are computed.

The first is for turns that all layers have, the second for each further range of turns that only some layers have. The
numbers do not depend on the number of turns, so the result changes smoothly with the turns. Quadrupled numbers change
the result by 0.2 % at most (1.5 to 30 turns, one to eight layers).
"""


ROUGH_PLACES = (6, 2)
"""Numbers of places as in `PLACES`, for screening. The capacitance differs by up to 2 %."""

ROUGH_GRAIN = 10e-6
"""Rounding step (m) of widths and pitches in screening. The capacitance changes by less than 4 %."""


def self_capacitance(coil: Coil, dimensions: CoilSpec, stackup: Stackup, is_rough: bool = False) -> float:
    """Return the capacitance (F) of a coil's winding between its ends, without leads.

    It is twice the electric energy at one volt. The turns of two layers are strips that face each other through the
    stack-up, averaged over all lateral shifts. Turns of a layer face their neighbours. The voltage follows each turn's
    flux linkage. If a layer has no more turns, the other layers face each other through the material that fills its
    place. Elastomer and metal around the board are left out: see `capacitance_to_metal`. `dimensions` are the widths,
    pitch and turns of the coil.
    """
    lengths, fractions, present = _turn_places(coil, dimensions, ROUGH_PLACES if is_rough else PLACES)
    voltages = _voltages(lengths, fractions, present, coil, dimensions)
    width, pitch, reach = dimensions.trace_width, dimensions.pitch, 0.5 * min(dimensions.size)
    areas = lengths * pitch * fractions
    if is_rough:  # designs with nearly equal width and pitch share the solution of the strips
        width, pitch, reach = (round(width / ROUGH_GRAIN) * ROUGH_GRAIN, round(pitch / ROUGH_GRAIN) * ROUGH_GRAIN,
                               round(reach, 3))
    total, between, counts = 0.0, 0.0, present.sum(axis=0)
    for count in dict.fromkeys(counts.tolist()):
        here, have = counts == count, np.flatnonzero(present[:, counts == count][:, 0])
        layers = [coil.windings[k].layer for k in have]
        order = np.argsort(np.argsort(layers))
        per_area = _strips(tuple(dielectric_slabs(stackup, layers)), width, pitch, reach)[np.ix_(order, order)]
        total += winding_capacitance(per_area, voltages[np.ix_(have, here)], areas[here])
    beside = permittivity_beside_copper(stackup, coil.windings[0].layer)
    for has_turns, layer_voltages in zip(present, voltages, strict=True):
        between += turn_capacitance(lengths[has_turns], layer_voltages[has_turns], fractions[has_turns],
                                    dimensions.trace_width, dimensions.trace_spacing, coil.windings[0].thickness,
                                    beside)
    return total + between


def capacitance_to_metal(
    coil: Coil, dimensions: CoilSpec, board_thickness: float, gap: float | None, behind: float | None
) -> float:
    """Return an upper bound (F) of the additional capacitance by a target at a gap and by metal behind the board.

    `gap` and `behind` are distances (m) from the board's faces; None: no metal. The model has plates as large as the
    winding, without fringe, with `FILLING` between. Both plates are at the potential of the winding's middle. The metal
    behind is large, so it is at ground for an alternating voltage even without a connection. A target floats at the
    mean potential of the turns around it. `board_thickness` (m) is the board's.

    The bound is two to forty times too large for the windings of a jaw (validated with charged rings). These windings
    are small compared with the distances, and the metal returns one turn's charge to its neighbour.
    """
    lengths, fractions, present = _turn_places(coil, dimensions, PLACES)
    voltages = _voltages(lengths, fractions, present, coil, dimensions)
    areas = lengths * dimensions.pitch * fractions
    heights = np.array([winding.z for winding in coil.windings])
    squares, top, bottom = (voltages**2) @ areas, int(np.argmax(heights)), int(np.argmin(heights))
    total = 0.0 if gap is None else squares[top] / (gap - heights[top])
    if behind is not None:
        total += squares[bottom] / (behind + board_thickness + heights[bottom])
    return float(EPSILON0 * FILLING * total)


def metal_capacitance_notes(
    coil: Coil, dimensions: CoilSpec, board_thickness: float, gaps: Mapping[str, float], winding: float, tank: float
) -> list[str]:
    """Return a note if metal may add a larger capacitance than the error of the winding's own capacitance.

    Empty if metal adds less. `winding` (F) is the winding's own capacitance, `tank` (F) the whole tank's. `gaps` (m)
    are distances to metal by state.
    """
    behind = gaps.get(BEHIND_THE_BOARD)
    gap = min((gap for state, gap in gaps.items() if state != BEHIND_THE_BOARD), default=None)
    if gap is None and behind is None:
        return []
    most = capacitance_to_metal(coil, dimensions, board_thickness, gap, behind)
    if most <= STATED * winding:
        return []
    return [
        "the capacitance from the winding to the target and to the metal behind the board is not in the numbers: at "
        f"most {show(most, 'F', 2)}, {100.0 * most / tank:.2g} % of the tank's, by which the converter may read the "
        "inductance higher at rest and pressed"
    ]


def _turn_places(coil: Coil, dimensions: CoilSpec, places: tuple[int, int]) -> tuple[Array, Array, Flags]:
    """Return three arrays for places along the turns, from the outside in.

    The first two (places) hold the length (m) of a whole turn at each place, and the number of turns that the place
    represents. The third (layers, places) is True if the layer has a turn at the place.
    """
    turns, low = np.array(dimensions.layer_turns), 0.0
    stretches: list[tuple[Array, Array, Flags]] = []
    for high in sorted(set(dimensions.layer_turns)):
        count = places[1] if stretches else places[0]
        fraction = (high - low) / count
        middles: Array = low + fraction * (np.arange(count, dtype=np.float64) + 0.5)
        stretches.append((turn_lengths(coil, dimensions, middles), np.full(count, fraction),
                          np.tile(turns[:, None] >= high, count)))
        low = high
    lengths, fractions, present = (np.concatenate(parts, axis=-1) for parts in zip(*stretches, strict=True))
    return lengths, fractions, present


def turn_lengths(coil: Coil, dimensions: CoilSpec, places: Array) -> Array:
    """Return the length (m) of a whole turn at `places`, counted in turns from the outside.

    It is for the layer with the most turns.
    """
    turns = dimensions.layer_turns
    most = max(range(len(turns)), key=lambda k: turns[k])
    mean = coil.windings[most].path.length / turns[most]
    inside = dimensions.pitch * (places - 0.5 * turns[most])
    return np.asarray(np.maximum(mean - dimensions.outline.turn_shortening * inside, 0.05 * mean))


def _voltages(lengths: Array, fractions: Array, present: Flags, coil: Coil, dimensions: CoilSpec) -> Array:
    """Return the voltages (layers, places; no unit) of the layers at all places from the outside in.

    They are fractions of the voltage across the winding. Turns that a layer lacks have the voltage of its inner end.
    `lengths`, `fractions` and `present` are from `_turn_places`.
    """
    radii = np.maximum(lengths / (2.0 * math.pi), 0.5 * dimensions.trace_width)
    turns = present * fractions
    size = 0.2235 * (dimensions.pitch * turns.max(axis=0) + coil.windings[0].thickness)
    heights, inward = [w.z for w in coil.windings], [w.inward for w in coil.windings]
    return winding_voltages(radii, heights, inward, size, turns)


_strips = lru_cache(maxsize=1024)(strip_layers)


def dielectric_slabs(stackup: Stackup, layers: list[int]) -> list[Slab]:
    """Return the stack-up as slabs from top to bottom.

    Copper layers without winding are replaced by the material beside them.
    """
    layer_slabs, number = [], 0
    for layer in stackup.layers:
        if layer.kind is LayerKind.COPPER:
            number += 1
            layer_slabs.append(Slab(layer.thickness, permittivity_beside_copper(stackup, number), number in layers))
        elif layer.thickness > 0.0:
            layer_slabs.append(Slab(layer.thickness, layer.relative_permittivity or USUAL_PERMITTIVITY))
    return layer_slabs


def permittivity_beside_copper(stackup: Stackup, number: int) -> float:
    """Return the relative permittivity in the gaps of a copper layer, which coverlay adhesive or bonding film fills.

    `number` is the copper layer's number from 1 at the top.
    """
    indices = [i for i, layer in enumerate(stackup.layers) if layer.kind is LayerKind.COPPER]
    index = indices[number - 1]
    around = [stackup.layers[i] for i in (index - 1, index + 1) if 0 <= i < len(stackup.layers)]
    soft = [layer.relative_permittivity for layer in around if layer.relative_permittivity]
    return max(soft, default=1.0)
