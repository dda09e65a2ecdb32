"""A winding's own capacitance: its layers through the real stack-up, at the voltages of the series circuit."""

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
from sitscad.spec.sensor import SensorSpec

USUAL_PERMITTIVITY = 3.4  # Relative permittivity of polyimide, where a layer of the stack-up states none

FILLING = 3.0
"""Relative permittivity taken for all that lies between winding and metal: about that of silicones and printed mounts;
air has less."""

STATED = 0.10  # What the own capacitance is good to: the part of it that metal may add without being told

CAPACITANCE_ERROR, FEW_TURNS_CAPACITANCE_ERROR = 0.20, 0.30
"""Relative error of the own capacitance of windings with at least `FEW_TURNS` a layer, and of those with fewer. Random
coils of two to four layers were compared with rings of charge, averaged over the shifts between the turns of two layers
(tests/validation/test_charged_rings.py)."""

FEW_TURNS = 4.0

PLACES = (24, 8)
"""Places along the turns that all layers have at which their voltages are taken, and along every further stretch that
only some have: as many for any number of turns, so that a millionth more of these changes nothing. Within 0.2 % of four
times as many (1.5 to 30 turns, one to eight layers)."""


ROUGH_PLACES, ROUGH_GRAIN = (6, 2), 10e-6
"""Places for screening, within 2 %; and how fine (m) widths and pitches are told apart there, within 4 %."""


def self_capacitance(coil: Coil, spec: SensorSpec, is_rough: bool = False) -> float:
    """Capacitance (F) of a coil's winding between its ends, without leads: twice the electric energy at one volt.

    Layers see each other through the stack-up as strips shifted by every amount, turns of a layer their neighbours;
    the voltage follows the flux that each turn links. Further inside than a layer has turns, the others see each other
    through what takes its place. Elastomer and metal around the board are not in it: see `added_by_metal`.
    """
    lengths, shares, present = _turns(coil, spec, ROUGH_PLACES if is_rough else PLACES)
    voltages, areas = _voltages(lengths, shares, present, coil, spec), lengths * spec.coil.pitch * shares
    width, pitch, reach = spec.coil.trace_width, spec.coil.pitch, 0.5 * min(spec.coil.size)
    if is_rough:  # strips are solved once for designs of about one width and pitch
        width, pitch, reach = (round(width / ROUGH_GRAIN) * ROUGH_GRAIN, round(pitch / ROUGH_GRAIN) * ROUGH_GRAIN,
                               round(reach, 3))
    total, between, counts = 0.0, 0.0, present.sum(axis=0)
    for count in dict.fromkeys(counts.tolist()):
        here, have = counts == count, np.flatnonzero(present[:, counts == count][:, 0])
        layers = [coil.windings[k].layer for k in have]
        order = np.argsort(np.argsort(layers))
        per_area = _strips(tuple(slabs(spec.fpc.stackup, layers)), width, pitch, reach)[np.ix_(order, order)]
        total += winding_capacitance(per_area, voltages[np.ix_(have, here)], areas[here])
    beside = beside_copper(spec.fpc.stackup, coil.windings[0].layer)
    for own, own_voltages in zip(present, voltages, strict=True):
        between += turn_capacitance(lengths[own], own_voltages[own], shares[own], spec.coil.trace_width,
                                    spec.coil.trace_spacing, coil.windings[0].thickness, beside)
    return total + between


def added_by_metal(coil: Coil, spec: SensorSpec, gap: float | None, behind: float | None) -> float:
    """The most (F) that a target at a gap and metal behind the board (m from its faces; None: none) add to it.

    Plates as large as the winding, no fringe, `FILLING` between, both at the potential of the winding's middle: the
    metal behind is large, and so at ground for an alternating voltage even where nothing connects it; a target floats,
    and takes what the turns around it have on average. An upper bound for the windings of a jaw, by two to forty times:
    they are small against the distances, and what one turn gives to the metal its neighbour takes (validated with
    charged rings).
    """
    lengths, shares, present = _turns(coil, spec, PLACES)
    voltages, areas = _voltages(lengths, shares, present, coil, spec), lengths * spec.coil.pitch * shares
    heights = np.array([winding.z for winding in coil.windings])
    squares, top, bottom = (voltages**2) @ areas, int(np.argmax(heights)), int(np.argmin(heights))
    total = 0.0 if gap is None else squares[top] / (gap - heights[top])
    if behind is not None:
        total += squares[bottom] / (behind + spec.fpc.stackup.thickness + heights[bottom])
    return float(EPSILON0 * FILLING * total)


def metal_notes(coil: Coil, spec: SensorSpec, gaps: Mapping[str, float], own: float, tank: float) -> list[str]:
    """A note where metal may add more to the own capacitance (F) than that is good to; `tank` is the whole (F)."""
    behind = gaps.get(BEHIND_THE_BOARD)
    gap = min((gap for state, gap in gaps.items() if state != BEHIND_THE_BOARD), default=None)
    if gap is None and behind is None:
        return []
    most = added_by_metal(coil, spec, gap, behind)
    if most <= STATED * own:
        return []
    return [
        "the capacitance from the winding to the target and to the metal behind the board is not in the numbers: at "
        f"most {show(most, 'F', 2)}, {100.0 * most / tank:.2g} % of the tank's, by which the converter may read the "
        "inductance higher at rest and pressed"
    ]


def _turns(coil: Coil, spec: SensorSpec, places: tuple[int, int]) -> tuple[Array, Array, Flags]:
    """Places along the turns, from the outside in: the length (m) of a whole turn there, how many turns it stands for,
    and which layers have turns there, (layers, places).
    """
    turns, low = np.array(spec.coil.layer_turns), 0.0
    found: list[tuple[Array, Array, Flags]] = []
    for high in sorted(set(spec.coil.layer_turns)):
        count = places[1] if found else places[0]
        share = (high - low) / count
        middles: Array = low + share * (np.arange(count, dtype=np.float64) + 0.5)
        found.append((turn_lengths(coil, spec, middles), np.full(count, share), np.tile(turns[:, None] >= high, count)))
        low = high
    lengths, shares, present = (np.concatenate(parts, axis=-1) for parts in zip(*found, strict=True))
    return lengths, shares, present


def turn_lengths(coil: Coil, spec: SensorSpec, places: Array) -> Array:
    """Length (m) of a whole turn at places so many turns from the outside; as in the layer that has most turns."""
    turns = spec.coil.layer_turns
    most = max(range(len(turns)), key=lambda k: turns[k])
    mean = coil.windings[most].path.length / turns[most]
    inside = spec.coil.pitch * (places - 0.5 * turns[most])
    return np.asarray(np.maximum(mean - spec.coil.outline.shrinks * inside, 0.05 * mean))


def _voltages(lengths: Array, shares: Array, present: Flags, coil: Coil, spec: SensorSpec) -> Array:
    """Voltages of the layers at all places from the outside in; turns that a layer has not count as its inner end."""
    radii = np.maximum(lengths / (2.0 * math.pi), 0.5 * spec.coil.trace_width)
    turns = present * shares
    size = 0.2235 * (spec.coil.pitch * turns.max(axis=0) + coil.windings[0].thickness)
    heights, inward = [w.z for w in coil.windings], [w.inward for w in coil.windings]
    return winding_voltages(radii, heights, inward, size, turns)


_strips = lru_cache(maxsize=1024)(strip_layers)


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
