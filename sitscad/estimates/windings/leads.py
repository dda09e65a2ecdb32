"""Conductors between winding and contacts (stubs, leads, tail and vias), computed from their drawn tracks."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field
from functools import lru_cache
from itertools import pairwise

import numpy as np

from sitscad.basics.arrays import Array
from sitscad.basics.record import record, replace
from sitscad.estimates.windings.losses import Strip
from sitscad.estimates.windings.methods import bent_path
from sitscad.kernels.electromagnetics.capacitance import coplanar_strips, series_permittivity, stacked_strips
from sitscad.kernels.electromagnetics.constants import MU0
from sitscad.kernels.electromagnetics.inductance.filaments import (
    PolylineTrack,
    curve_segments_mutual,
    grouped_segments_inductance,
    segment_set,
    via_inductance,
)
from sitscad.kernels.electromagnetics.inductance.mean_distance import log_mean_distance
from sitscad.kernels.electromagnetics.inductance.rings import mean_rings
from sitscad.kernels.electromagnetics.inductance.spirals import SpiralLayer
from sitscad.kernels.electromagnetics.loss.corners import direct_resistance
from sitscad.kernels.electromagnetics.loss.current_modes import ProximityLoss, join_losses
from sitscad.kernels.electromagnetics.loss.resistance import via_resistance
from sitscad.kernels.electromagnetics.special_functions import coaxial_rings
from sitscad.kernels.geometry.path import Arc
from sitscad.layout.board import Coil, LeadPair, Role, Trace, Via
from sitscad.spec.circuit import CopperLayer, LayerKind, Stackup

FLATTENED = 10e-6  # Arcs of the leads become chords within this distance (m)
CHORD = math.radians(5.0)  # Arcs of a bent tail become chords of at most this angle (rad)
SAMPLED = 2.5e-6  # Chords of the winding, for its coupling with the leads, lie within this distance (m) of it
LONGEST = 0.4e-3  # Straight sides of a winding are cut to this length (m) for this coupling
SELF_DISTANCE = 0.2235  # Geometric mean distance of a rectangle from itself over the sum of its sides (Grover 1946)

USUAL_PLATING = 20e-6
"""Copper thickness (m) in a plated hole if the stack-up states none (IPC class 2: 20 um; from memory, unverified)."""


Place = tuple[float, float]
"""Position (x, y; m) on a layer."""
Piece = tuple[Place, Place]
"""Straight piece of a track: start and end (m)."""


@record
class LeadEstimate:
    """All conductors between winding and contacts: inductance (H), direct resistance (ohm), pair capacitance (F).

    `parts` are contributions to the inductance by name. "stubs", "leads" and "tail" are groups of tracks; each holds
    the inductances within its group and half of the mutual inductance with the other groups. "coupling" is twice the
    mutual inductance between the winding and the tracks. "vias" is the inductance of the vias. `strips` are the
    stretches of track, from which the rise of resistance with frequency is computed. `via_resistance` (ohm) is the
    direct resistance of all vias. `resistance_error` is the relative error bound of the resistance.
    """

    inductance: float
    resistance: float
    capacitance: float
    strips: tuple[Strip, ...]
    via_resistance: float
    parts: Mapping[str, float] = field(default_factory=dict)
    resistance_error: float = 0.01

    def resistances_at(self, frequencies: Array, conductivity: float) -> Array:
        """Return the leads' resistances (n; ohm) at (n) frequencies (Hz), with skin effect.

        The effect of return tracks beside the leads is included. `conductivity` is in S/m.
        """
        if not self.strips:
            return np.full(len(frequencies), self.via_resistance)
        loss = _loss(self.strips, conductivity)
        return np.asarray(loss.direct * loss.resistance_ratios(frequencies) + self.via_resistance)


@lru_cache(maxsize=64)
def _loss(strips: tuple[Strip, ...], conductivity: float) -> ProximityLoss:
    return join_losses([strip.loss(conductivity) for strip in strips])


NO_LEADS = LeadEstimate(0.0, 0.0, 0.0, (), 0.0)
"""Leads of a coil without leads: all values are 0."""


PARTS = {Role.STUB: "stubs", Role.LEAD: "leads", Role.TAIL: "tail"}
"""Names of the parts of a lead's inductance, by the role of the track."""


WIDE_ENDS, WIDE_ENDS_BOUND = 2.0, 1.5
"""Reduction of a lead track's resistance by its ends and corners, in squares of copper, and its error bound.

Ends are pads, teardrops, contacts and wider tracks, where the copper is wider than the track. The first value is a
mean: the lead tracks of 206 coils of templates and random boards had 1.26 to 3.42 squares. Laplace's equation was
solved for each kind of end; finite elements over the same copper agreed within 0.1 square.
"""

TRACKS_BOUND = 0.01  # Relative error of the resistance of lead tracks and vias without their ends (tests/extraction)
LEAST_LEFT = 0.1  # Least remaining fraction of a track's resistance: a short stub lies in pads at both ends


def estimate_leads(coil: Coil, stackup: Stackup, conductivity: float) -> LeadEstimate:
    """Return inductance, resistance and capacitance of all conductors of a coil except the winding."""
    copper = {layer.number: layer for layer in stackup.copper}
    tracks: list[tuple[Role, PolylineTrack]] = []
    strips: list[Strip] = []
    squares = 0.0  # resistance (ohm) of one square of each lead track
    paths = _straight_pieces(coil)
    facing = [(trace, *beside) for first, second in (paths, paths[::-1]) for line, trace in first
              if (beside := _nearest_parallel(line, second, 5.0 * trace.width)) is not None]
    for trace in coil.series:
        if not isinstance(trace, Trace) or trace.role is Role.WINDING:
            continue
        layer = copper[trace.layer]
        corners = np.array(_without_repeats(_points_along_current(coil, trace)))
        if len(corners) < 2:
            continue
        tracks.append((trace.role, PolylineTrack(corners, trace.width, layer.thickness, layer.z)))
        resistance = direct_resistance(bent_path(trace.path, trace.width, layer.thickness, layer.z), conductivity)
        squares += (square := 1.0 / (conductivity * layer.thickness))
        strips += _strips(trace, max(resistance - WIDE_ENDS * square, LEAST_LEFT * resistance), copper, facing)
    parts = _partial_inductances(tracks) | {"coupling": _coupling(coil, tracks)}
    plating = stackup.plating_thickness or USUAL_PLATING
    barrels, parts["vias"] = 0.0, 0.0
    for k, via in enumerate(coil.series):
        if not isinstance(via, Via):
            continue
        before, after = (next((t for t in items if isinstance(t, Trace)), None)
                         for items in (coil.series[:k][::-1], coil.series[k + 1 :]))
        if before and after and before.layer != after.layer:
            length = abs(copper[before.layer].z - copper[after.layer].z)
            barrels += via_resistance(length, via.drill, plating, conductivity)
            parts["vias"] += via_inductance(length, via.drill)
    total = math.fsum(strip.resistance for strip in strips) + barrels
    inductance, error = math.fsum(parts.values()), TRACKS_BOUND + WIDE_ENDS_BOUND * squares / max(total, 1e-30)
    return LeadEstimate(inductance, total, _pair_capacitance(coil, stackup), _merged_strips(strips), barrels, parts,
                        error)


UNDRAWN = 0.25
"""Relative error bound of inductance and resistance of leads that are not drawn."""

APART = 2e-9
"""Inductance (H) that is added to leads that are not drawn.

It is for stubs and for the tracks to the contacts, which do not run close together (tests/validation).
"""


GRAIN = 20e-6  # Step (m) of rounded widths of undrawn leads for their skin effect


def sketched_leads(pairs: Sequence[LeadPair], stackup: Stackup, conductivity: float) -> LeadEstimate:
    """Return estimates of leads that are not drawn, from their planned lengths and widths.

    Each of the `pairs` is computed as a long pair of tracks, there and back, by mean distances.
    """
    strips, inductance, capacitance = [], 0.0, 0.0
    for pair in pairs:
        own_inductance, own_capacitance, tracks = _pair_values_per_metre(replace(pair, length=1.0), stackup)
        inductance += pair.length * own_inductance
        capacitance += pair.length * own_capacitance
        strips += [replace(strip, resistance=pair.length / (conductivity * pair.width * strip.thickness))
                   for strip in tracks]
    resistance = math.fsum(strip.resistance for strip in strips)
    inductance += APART
    return LeadEstimate(inductance, resistance, capacitance, _merged_strips(strips), 0.0, {"leads": inductance})


@lru_cache(maxsize=256)
def _pair_values_per_metre(pair: LeadPair, stackup: Stackup) -> tuple[float, float, tuple[Strip, Strip]]:
    """Return inductance (H/m) and capacitance (F/m) of a long pair of tracks, there and back, and both tracks."""
    copper = {layer.number: layer for layer in stackup.copper}
    first, second = (copper[number] for number in pair.layers)
    across, height = (0.0, abs(first.z - second.z)) if first is not second else (pair.apart, 0.0)
    widths = pair.width, pair.width
    alone = sum(0.5 * log_mean_distance(0.0, 0.0, widths, (t, t)) for t in (first.thickness, second.thickness))
    between = log_mean_distance(across, height, widths, (first.thickness, second.thickness))
    if across:
        capacitance = coplanar_strips(pair.width, across - pair.width, 0.5 * (1.0 + mean_permittivity(stackup)))
    else:
        capacitance = stacked_strips(pair.width, *gap_between_layers(stackup, *sorted(pair.layers)))
    wide = max(round(pair.width / GRAIN), 1) * GRAIN  # nearly equal skin effect
    beside = round(across / GRAIN) * GRAIN, height
    tracks = Strip(0.0, wide, first.thickness, beside), Strip(0.0, wide, second.thickness, beside)
    return MU0 / math.pi * float(between - alone), capacitance, tracks


def with_lead_around_winding(
    leads: LeadEstimate, goes_on: tuple[float, float], width: float, copper: CopperLayer, conductivity: float,
    spirals: Sequence[SpiralLayer],
) -> LeadEstimate:
    """Return the leads with the additional inductance and resistance of one lead that continues around its winding.

    `goes_on` holds the number of additional turns, and their radius (m). `width` (m) is the track's width, `copper` its
    layer. `spirals` are the winding's layers.
    """
    turns, radius = goes_on
    if not turns:
        return leads
    rings = mean_rings(spirals)
    z, way = np.array([(layer.z, layer.circulation) for layer in spirals]).T[:, rings.layer]
    mutual = coaxial_rings(radius, rings.radii, (rings.radii - radius) ** 2 + (z - copper.z) ** 2)
    self_inductance = coaxial_rings(radius, radius, (SELF_DISTANCE * (width + copper.thickness)) ** 2)
    coupling = 2.0 * turns * float(np.sum(mutual * rings.parts * way)) * way[0]
    more = turns * turns * float(self_inductance) + coupling
    resistance = abs(turns) * 2.0 * math.pi * radius / (conductivity * width * copper.thickness)
    strips = (*leads.strips, Strip(resistance, max(round(width / GRAIN), 1) * GRAIN, copper.thickness))
    parts = {"leads": leads.inductance + more - coupling, "coupling": coupling}
    return replace(leads, inductance=leads.inductance + more, resistance=leads.resistance + resistance, strips=strips,
                   parts=parts)


def _merged_strips(strips: Sequence[Strip]) -> tuple[Strip, ...]:
    # Stretches with equal cross-section and surroundings count as one: their resistance rises equally.
    whole: dict[Strip, list[float]] = {}
    for strip in strips:
        if strip.resistance > 0.0:
            whole.setdefault(replace(strip, resistance=0.0), []).append(strip.resistance)
    return tuple(replace(strip, resistance=math.fsum(parts)) for strip, parts in whole.items())


def _partial_inductances(tracks: list[tuple[Role, PolylineTrack]]) -> dict[str, float]:
    """Return partial inductances (H) of the tracks, summed by role.

    Chords of tracks with equal cross-section and height are summed together.
    """
    groups: dict[tuple[str, float, float, float], list[PolylineTrack]] = {}
    for role, track in tracks:
        groups.setdefault((PARTS[role], track.width, track.thickness, track.z), []).append(track)
    names = list(PARTS.values())
    if not groups:
        return dict.fromkeys(names, 0.0)
    sets = [segment_set(group) for group in groups.values()]
    sums = grouped_segments_inductance(sets, [names.index(key[0]) for key in groups])
    rows = sums.sum(axis=1)
    return {name: float(rows[k]) if k < len(rows) else 0.0 for k, name in enumerate(names)}


def _coupling(coil: Coil, tracks: list[tuple[Role, PolylineTrack]]) -> float:
    """Return twice the mutual inductance (H) between a coil's windings and its leads, by Neumann's integral.

    `tracks` are the lead tracks with their roles.
    """
    if not coil.windings or not tracks:
        return 0.0
    pieces = [_sample_path(np.array(w.path.flattened(SAMPLED)), w.z) for w in coil.windings]
    curve = np.concatenate([points for points, _ in pieces]), np.concatenate([elements for _, elements in pieces])
    groups: dict[tuple[float, float, float], list[PolylineTrack]] = {}
    for _, track in tracks:
        groups.setdefault((track.width, track.thickness, track.z), []).append(track)
    return 2.0 * math.fsum(
        curve_segments_mutual(curve, segment_set(group), SELF_DISTANCE * (key[0] + key[1]))
        for key, group in groups.items()
    )


def _sample_path(corners: Array, z: float) -> tuple[Array, Array]:
    """Return middles (n, 3; m) and elements (n, 2; m) of a polyline at a height `z` (m).

    Sides longer than `LONGEST` are divided. `corners` (n, 2; m) are the points of the polyline.
    """
    sides = np.diff(corners, axis=0)
    parts = np.maximum(np.ceil(np.hypot(sides[:, 0], sides[:, 1]) / LONGEST), 1.0).astype(int)
    of = np.repeat(np.arange(len(sides)), parts)
    share = (np.arange(of.size) - np.repeat(np.cumsum(parts) - parts, parts) + 0.5) / parts[of]
    middle = corners[of] + share[:, None] * sides[of]
    return np.column_stack([middle, np.full(len(middle), z)]), sides[of] / parts[of, None]


def _points_along_current(coil: Coil, trace: Trace) -> list[Place]:
    """Return the points of a track in the direction of the current.

    The next item of the coil's series is near the last point. For the last item, the previous item is near the first
    point.
    """
    points, series = list(_chords(trace)), coil.series
    if len(series) == 1:
        return points
    index = next(k for k, item in enumerate(series) if item is trace)
    goes_on = index + 1 < len(series)
    places = _places(series[index + 1 if goes_on else index - 1])
    start, end = (min(math.dist(point, place) for place in places) for point in (points[0], points[-1]))
    return points if (end <= start if goes_on else start <= end) else points[::-1]


def _chords(trace: Trace) -> list[Place]:
    """Return the corner points of a track.

    Arcs of a tail become chords that are parallel for both tracks of the pair. `trace` is the track.
    """
    if trace.role is not Role.TAIL:
        return list(trace.path.flattened(FLATTENED))
    points: list[Place] = [trace.path.start]
    for segment in trace.path:
        count = max(1, math.ceil(abs(segment.sweep) / CHORD - 1e-9)) if isinstance(segment, Arc) else 1
        points += [segment.at((k + 1) / count) for k in range(count)]
    return points


def _places(item: Trace | Via) -> list[Place]:
    return [item.centre] if isinstance(item, Via) else [item.path.start, item.path.end]


def _without_repeats(points: Sequence[Place]) -> list[Place]:
    distinct = list(points[:1])
    for point in points[1:]:
        if math.dist(point, distinct[-1]) > 1e-9:
            distinct.append(point)
    return distinct


def _straight_pieces(coil: Coil) -> tuple[list[tuple[Piece, Trace]], list[tuple[Piece, Trace]]]:
    """Return all straight pieces of the track to the winding, and of the track from the winding, with their tracks."""
    way_in, way_out, windings = [], [], 0
    for item in coil.series:
        if isinstance(item, Trace) and item.role is Role.WINDING:
            windings += 1
        elif isinstance(item, Trace):
            lines = [(line, item) for line in pairwise(_without_repeats(_chords(item)))]
            if windings == 0:
                way_in += lines
            elif windings == len(coil.windings):
                way_out += lines
    return way_in, way_out


def _nearest_parallel(
    line: Piece, pieces: list[tuple[Piece, Trace]], reach: float
) -> tuple[float, float, Trace] | None:
    """Return overlap (m), lateral distance (m) and track of the nearest piece that is parallel to a line.

    Only pieces nearer than `reach` (m) that overlap the line count. None if there is no such piece.
    """
    (x, y), _ = line
    length, candidates = math.dist(*line), []
    ux, uy = ((end - start) / length for start, end in zip(*line, strict=True))
    for piece, trace in pieces:
        there = math.dist(*piece)
        vx, vy = ((end - start) / there for start, end in zip(*piece, strict=True))
        if abs(ux * vy - uy * vx) > 1e-3:
            continue
        ends = sorted((px - x) * ux + (py - y) * uy for px, py in piece)
        overlap = min(ends[1], length) - max(ends[0], 0.0)
        lateral = abs((piece[0][0] - x) * uy - (piece[0][1] - y) * ux)
        if overlap > 0.0 and lateral < reach:
            candidates.append((overlap, lateral, trace))
    return min(candidates, key=lambda row: (row[1], -row[0]), default=None)


def _strips(trace: Trace, resistance: float, copper: dict[int, CopperLayer],
            facing: list[tuple[Trace, float, float, Trace]]) -> list[Strip]:
    """Return a track as strips, each with its part of the resistance (ohm) and the place of its return track.

    `facing` holds (track, overlap in m, lateral distance in m, return track) for all pieces. `copper` holds the copper
    layers by number.
    """
    layer = copper[trace.layer]
    strips, alone = [], resistance
    for owner, length, lateral, back in facing:
        if owner is trace:
            height = abs(layer.z - copper[back.layer].z)
            if height == 0.0 and lateral <= trace.width:
                continue
            share = resistance * length / trace.path.length
            alone -= share
            strips.append(Strip(share, trace.width, layer.thickness, (round(lateral, 6), height)))
    return [Strip(max(alone, 0.0), trace.width, layer.thickness), *strips]


def _pair_capacitance(coil: Coil, stackup: Stackup) -> float:
    """Return the capacitance (F) between the track to the winding and the track from the winding.

    Each piece of the first track faces the nearest parallel piece of the second, beside or above it.
    """
    (way_in, way_out), total = _straight_pieces(coil), 0.0
    for line, trace in way_in:
        if (beside := _nearest_parallel(line, way_out, 10.0 * trace.width)) is None:
            continue
        length, lateral, other = beside
        width = min(trace.width, other.width)
        if trace.layer == other.layer or lateral > width:
            around = 0.5 * (1.0 + mean_permittivity(stackup))
            per_metre = coplanar_strips(width, max(lateral - width, 0.2 * width), around)
        else:
            # The coverlay is taken as the dielectric all around, and the copper as thin: both within 6 % (tested).
            per_metre = stacked_strips(width, *gap_between_layers(stackup, *sorted((trace.layer, other.layer))))
        total += length * per_metre
    return total


def gap_between_layers(stackup: Stackup, upper: int, lower: int) -> tuple[float, float]:
    """Return the distance (m) between the facing copper surfaces of two layers, and the relative permittivity between.

    Layers are given by their copper numbers.
    """
    layers = stackup.between(upper, lower)
    thicknesses = [layer.thickness for layer in layers]
    return math.fsum(thicknesses), series_permittivity(
        thicknesses, [layer.relative_permittivity or 3.4 for layer in layers])


def mean_permittivity(stackup: Stackup) -> float:
    """Return the mean relative permittivity of the stack-up's insulating layers, weighted by thickness."""
    layers = [layer for layer in stackup.layers if layer.kind is not LayerKind.COPPER]
    total = math.fsum(layer.thickness for layer in layers)
    by_thickness = math.fsum(layer.thickness * (layer.relative_permittivity or 3.4) for layer in layers)
    return by_thickness / total if total else 3.4


def missing_leads_note(coils: tuple[Coil, ...]) -> str | None:
    """Return a note on leads that the layout lacks, so that contact values lack them, too. None if all are drawn."""
    missing = [coil.name for coil in coils if not coil.is_closed_circuit or not coil.series]
    if missing:
        return (
            f"INCOMPLETE LAYOUT: {', '.join(missing)}: no room was found for all leads (see `sitscad check`), so all "
            "numbers at the contacts lack the leads and the tail that are not drawn"
        )
    ends = [pair for coil in coils for pair in pairwise(map(_places, coil.series))]
    if not all(min(math.dist(a, b) for a in first for b in second) < 1e-6 for first, second in ends):
        return "INCOMPLETE LAYOUT: some leads do not meet end to end; the numbers at the contacts hold what is drawn"
    return None
