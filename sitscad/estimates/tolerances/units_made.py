"""Specs of units with an error of one cause of scatter, and the layout of such a unit (`as_made`).

A `SpecChange` is a function of two arguments, the drawn spec and the size of the error. It returns the changed spec.
Other functions return a `SpecChange` for a part, an axis or kinds of layers.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from sitscad.assembly.places.bodies import backing_of, board_heights, target_lines
from sitscad.basics.record import replace
from sitscad.kernels.geometry.path import Point
from sitscad.layout.board import Coil, Layout, Via
from sitscad.spec.circuit import LayerKind, StackLayer, Stackup
from sitscad.spec.coil import CoilSpec
from sitscad.spec.materials import Target
from sitscad.spec.sensor import SensorSpec

LEAST_FACTOR = 0.05
"""Least value of a unit's property, divided by its nominal value, however large the error is."""

SpecChange = Callable[[SensorSpec, float], SensorSpec]
"""Function that returns the spec of a unit from the drawn spec and the size of the error."""


def _part_change(part: str, change: Callable[[Any, float], Any]) -> SpecChange:
    """Return the `SpecChange` that applies `change` to one part of a spec. A spec without this part stays unchanged.

    `change` is a function of the part and the size of the error. It returns the changed part.
    """

    def moved(spec: SensorSpec, off: float) -> SensorSpec:
        present = getattr(spec, part)
        return spec if present is None else replace(spec, **{part: change(present, off)})

    return moved


def _with_wider_tracks(coil: CoilSpec, off: float) -> CoilSpec:
    """Return a coil whose tracks are wider by a fraction `off` of their width.

    The centre lines of the tracks stay, because the artwork's film keeps the pitch.
    """
    width = coil.trace_width * max(LEAST_FACTOR, 1.0 + off)
    x, y = (side + width - coil.trace_width for side in coil.size)
    return replace(coil, size=(x, y), trace_width=width, trace_spacing=coil.pitch - width)


def _enlarged_coil(coil: CoilSpec, off: float) -> CoilSpec:
    """Return a coil that is larger by a fraction `off`, with tracks of unchanged width."""
    x, y = (side + off * (side - coil.trace_width) for side in coil.size)
    pitch = (1.0 + off) * coil.pitch
    return replace(coil, size=(x, y), trace_spacing=pitch - coil.trace_width)


with_width = _part_change("coil", _with_wider_tracks)
"""Function that changes the track width of a spec's coils by a fraction."""

with_diameter = _part_change("coil", _enlarged_coil)
"""Function that changes the size of a spec's coils by a fraction."""


def _with_layers(change: Callable[[Stackup, float], list[StackLayer]]) -> SpecChange:
    """Return a function that replaces the layers of a spec's stack-up by the result of `change`."""
    return _part_change("fpc", lambda fpc, off: replace(fpc, stackup=replace(
        fpc.stackup, layers=tuple(change(fpc.stackup, off)))))


def with_layers(*kinds: LayerKind) -> SpecChange:
    """Return a function that changes the thickness of all layers of these kinds by a fraction.

    Plating is left out. All layers change equally, because foils and films are of one delivery.
    """
    return _with_layers(lambda stackup, off: [
        replace(layer, thickness=layer.thickness + off * (layer.thickness - layer.plated)) if layer.kind in kinds
        else layer for layer in stackup.layers])


def _with_thicker_plating(stackup: Stackup, off: float) -> list[StackLayer]:
    """Return the layers of a stack-up whose steps of plating are all thicker by `off` (m)."""
    layers, number = [], 0
    for layer in stackup.layers:
        number += layer.kind is LayerKind.COPPER
        if layer.kind is LayerKind.COPPER and layer.plated:
            more = max(off * stackup.platings(number), (LEAST_FACTOR - 1.0) * layer.plated)
            layer = replace(layer, thickness=layer.thickness + more, plated=layer.plated + more)
        layers.append(layer)
    return layers


with_plating = _with_layers(_with_thicker_plating)
"""Function that makes every step of plating thicker by a length (m)."""

with_permittivity = _with_layers(lambda stackup, off: [
    layer if layer.relative_permittivity is None
    else replace(layer, relative_permittivity=max(1.0, (1.0 + off) * layer.relative_permittivity))
    for layer in stackup.layers])
"""Function that changes the relative permittivity of all insulating layers by a fraction."""

with_capacitor = _part_change("readout", lambda readout, off: readout if readout.capacitance is None else replace(
    readout, capacitance=readout.capacitance * (1.0 + off)))
"""Function that changes the tank capacitor by a fraction. A spec without a capacitor value stays unchanged."""


def with_thickness(part: str) -> SpecChange:
    """Return a function that makes a part (``elastomer``, ``encapsulation`` or ``target``) thicker by a length (m)."""
    return _part_change(part, lambda piece, off: replace(
        piece, thickness=max(LEAST_FACTOR * piece.thickness, piece.thickness + off)))


def with_size(part: str) -> SpecChange:
    """Return a function that makes a part (``elastomer`` or ``target``) longer and wider by a length (m)."""
    return _part_change(part, lambda piece, off: replace(
        piece, size=tuple(max(LEAST_FACTOR * side, side + off) for side in piece.size)))


def with_modulus(part: str) -> SpecChange:
    """Return a function that adds an error to ln(shear modulus) of a part (``elastomer`` or ``encapsulation``)."""
    return _part_change(part, lambda piece, off: replace(piece, material=replace(
        piece.material, shear_modulus=piece.material.shear_modulus * math.exp(off))))


def with_glue(spec: SensorSpec, off: float) -> SensorSpec:
    """Return the spec with the target higher over the board by `off` (m), because of thicker glue."""
    return with_distances(spec, target=max(off, -target_lines(spec)))


def with_height(spec: SensorSpec, off: float) -> SensorSpec:
    """Return the spec with shield and metal behind the board farther from the board by `off` (m).

    The cause is thicker glue between, or thicker printed parts.
    """
    mount, sheet, offsets = spec.mount, backing_of(spec).shield_heights, spec.assembly.offsets
    room = 0.0 if mount is None else offsets.metal + (
        mount.standoff if mount.metal_behind is None else mount.metal_behind.distance)
    if sheet is not None:
        room = board_heights(spec.fpc.stackup)[0] - sheet[1] + offsets.shield
    down = max(off,
               -room - spec.assembly.glue_line * (backing_of(spec).glue_lines_above_shield if sheet is not None else 1))
    return with_distances(spec, shield=down, metal=down)


def with_shield(spec: SensorSpec, off: float) -> SensorSpec:
    """Return the spec with the shield thicker by `off` (m). The metal behind the shield is lower by this length."""
    sheet = spec.shield
    if sheet is None:
        return spec
    thickness, mount = max(LEAST_FACTOR * sheet.thickness, sheet.thickness + off), spec.mount
    if mount is not None:
        more, metal = thickness - sheet.thickness, mount.metal_behind
        metal = None if metal is None else replace(metal, distance=metal.distance + more)
        mount = replace(mount, standoff=mount.standoff + more, metal_behind=metal)
    return replace(spec, shield=replace(sheet, thickness=thickness), mount=mount)


def with_metal(spec: SensorSpec, off: float) -> SensorSpec:
    """Return the spec with the metal behind the board thicker by `off` (m). Without such metal, the jaw is higher."""
    mount = spec.mount
    if mount is None:
        return spec
    if mount.metal_behind is not None:
        thickness = max(LEAST_FACTOR * mount.metal_behind.thickness, mount.metal_behind.thickness + off)
        return replace(spec, mount=replace(mount, metal_behind=replace(mount.metal_behind, thickness=thickness)))
    if mount.jaw is None:
        return spec
    height = max(LEAST_FACTOR * mount.jaw.height, mount.jaw.height + off)
    return replace(spec, mount=replace(mount, jaw=replace(mount.jaw, height=height)))


def with_target_offset(axis: int) -> SpecChange:
    """Return a function that shifts the target of a spec along an axis (0: x, 1: y) by a distance (m)."""

    def moved(target: Target, off: float) -> Target:
        x, y = target.offset
        return replace(target, offset=(x + off, y) if axis == 0 else (x, y + off))

    return _part_change("target", moved)


with_target_rotation = _part_change("target", lambda target, off: replace(target, rotation=target.rotation + off))
"""Function that rotates the target of a spec about z by an angle (rad)."""


def with_distances(spec: SensorSpec, **by: float) -> SensorSpec:
    """Return the spec with parts farther from their drawn heights by lengths (m): `target`, `shield`, `metal`.

    The lengths are added to the unit's offsets by other causes.
    """
    offsets = spec.assembly.offsets
    moved = replace(offsets, **{name: getattr(offsets, name) + more for name, more in by.items()})
    return replace(spec, assembly=replace(spec.assembly, offsets=moved))


def as_made(layout: Layout, spec: SensorSpec) -> Layout:
    """Return the layout of one manufactured unit. `spec` has the unit's deviations from the nominal dimensions.

    Widths of winding tracks and leads scale like `coil.trace_width` in `spec`. Winding sizes, copper heights and copper
    thicknesses are taken from its coils and stack-up. Positions of leads and vias stay nominal.
    """
    nominal, coil = layout.spec.coil, spec.coil
    wider = coil.trace_width / nominal.trace_width
    # by centre lines: wider tracks make a coil larger, but do not move them
    larger = (coil.size[0] - coil.trace_width) / (nominal.size[0] - nominal.trace_width)

    # a coil's tracks are the same objects as the board's, not equal copies
    traces = tuple(replace(trace, width=wider * trace.width) for trace in layout.traces)
    etched = {id(item): trace for item, trace in zip(layout.traces, traces, strict=True)}

    copper = {layer.number: layer for layer in spec.fpc.stackup.copper}

    def made(coil_drawn: Coil) -> Coil:
        centre = coil_drawn.centre

        def moved(point: Point) -> Point:
            return Point(centre.x + larger * (point.x - centre.x), centre.y + larger * (point.y - centre.y))

        windings = tuple(
            replace(w, z=copper[w.layer].z, thickness=copper[w.layer].thickness,
                    path=w.path if abs(larger - 1.0) < 1e-9 else w.path.mapped(moved))
            for w in coil_drawn.windings
        )
        pairs = tuple(replace(pair, width=wider * pair.width) for pair in coil_drawn.undrawn)
        series = tuple(piece if isinstance(piece, Via) else etched.get(id(piece)) or
                       replace(piece, width=wider * piece.width) for piece in coil_drawn.series)
        return replace(coil_drawn, windings=windings, series=series, undrawn=pairs)

    return replace(layout, spec=spec, coils=tuple(map(made, layout.coils)), traces=traces)
