"""Specs of units with an error of one cause of scatter. Each function takes the drawn spec and the error."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from sitscad.assembly.places.bodies import backing_of, board_heights, target_lines
from sitscad.basics.record import replace
from sitscad.spec.circuit import LayerKind
from sitscad.spec.sensor import SensorSpec

LEAST_FACTOR = 0.05
"""Least factor of a unit's value, however large its sigma is."""

Moved = Callable[[SensorSpec, float], SensorSpec]


def with_width(spec: SensorSpec, off: float) -> SensorSpec:
    """Return the spec with tracks wider by a fraction.

    Their centre lines stay, because the artwork's film keeps the pitch.
    """
    coil = spec.coil
    width = coil.trace_width * max(LEAST_FACTOR, 1.0 + off)
    x, y = (side + width - coil.trace_width for side in coil.size)
    return replace(spec, coil=replace(coil, size=(x, y), trace_width=width, trace_spacing=coil.pitch - width))


def with_layers(*kinds: LayerKind) -> Moved:
    """Return a move of the thickness of all layers of some kinds by a fraction: foils and films are of one delivery."""

    def moved(spec: SensorSpec, off: float) -> SensorSpec:
        stackup = spec.fpc.stackup
        layers = tuple(
            replace(one, thickness=one.thickness + off * (one.thickness - one.plated)) if one.kind in kinds else one
            for one in stackup.layers
        )
        return replace(spec, fpc=replace(spec.fpc, stackup=replace(stackup, layers=layers)))

    return moved


def with_plating(spec: SensorSpec, off: float) -> SensorSpec:
    """Return the spec with every step of plating thicker (m)."""
    stackup, layers, number = spec.fpc.stackup, [], 0
    for one in stackup.layers:
        number += one.kind is LayerKind.COPPER
        if one.kind is LayerKind.COPPER and one.plated:
            more = max(off * stackup.platings(number), (LEAST_FACTOR - 1.0) * one.plated)
            one = replace(one, thickness=one.thickness + more, plated=one.plated + more)
        layers.append(one)
    return replace(spec, fpc=replace(spec.fpc, stackup=replace(stackup, layers=tuple(layers))))


def with_diameter(spec: SensorSpec, off: float) -> SensorSpec:
    """Return the spec with coils larger by a fraction, and tracks of unchanged width."""
    coil = spec.coil
    x, y = (side + off * (side - coil.trace_width) for side in coil.size)
    pitch = (1.0 + off) * coil.pitch
    return replace(spec, coil=replace(coil, size=(x, y), trace_spacing=pitch - coil.trace_width))


def with_permittivity(spec: SensorSpec, off: float) -> SensorSpec:
    """Return the spec with the permittivity of all films larger by a fraction."""
    stackup = spec.fpc.stackup
    layers = tuple(
        one if one.relative_permittivity is None else replace(
            one, relative_permittivity=max(1.0, (1.0 + off) * one.relative_permittivity))
        for one in stackup.layers
    )
    return replace(spec, fpc=replace(spec.fpc, stackup=replace(stackup, layers=layers)))


def with_capacitor(spec: SensorSpec, off: float) -> SensorSpec:
    """Return the spec with a tank capacitor larger by a fraction, if it has one."""
    chosen = spec.readout.capacitance
    return spec if chosen is None else replace(spec, readout=replace(spec.readout, capacitance=chosen * (1.0 + off)))


def _with(part: str, change: Callable[[Any, float], Any]) -> Moved:
    """Return a move that changes a part of the spec by an amount; a spec without that part stays as it is."""

    def moved(spec: SensorSpec, off: float) -> SensorSpec:
        own = getattr(spec, part)
        return spec if own is None else replace(spec, **{part: change(own, off)})

    return moved


def with_thickness(part: str) -> Moved:
    """Return a move that makes a part (``elastomer``, ``encapsulation`` or ``target``) thicker (m)."""
    return _with(part, lambda own, off: replace(own, thickness=max(LEAST_FACTOR * own.thickness, own.thickness + off)))


def with_size(part: str) -> Moved:
    """Return a move that makes a part (``elastomer`` or ``target``) longer and wider (m)."""
    return _with(part, lambda own, off: replace(own, size=tuple(max(LEAST_FACTOR * s, s + off) for s in own.size)))


def with_modulus(part: str) -> Moved:
    """Return a move of the logarithm of a part's shear modulus (``elastomer`` or ``encapsulation``)."""
    return _with(part, lambda own, off: replace(own, material=replace(
        own.material, shear_modulus=own.material.shear_modulus * math.exp(off))))


def with_glue(spec: SensorSpec, off: float) -> SensorSpec:
    """Return the spec with a higher target (m)."""
    return _farther(spec, target=max(off, -target_lines(spec)))


def with_height(spec: SensorSpec, off: float) -> SensorSpec:
    """Return the spec with shield and metal lower (m), by the glue over them and by printed parts."""
    mount, sheet, offsets = spec.mount, backing_of(spec).shield_heights, spec.assembly.offsets
    room = 0.0 if mount is None else offsets.metal + (
        mount.standoff if mount.metal_behind is None else mount.metal_behind.distance)
    if sheet is not None:
        room = board_heights(spec.fpc.stackup)[0] - sheet[1] + offsets.shield
    down = max(off,
               -room - spec.assembly.glue_line * (backing_of(spec).lines_over_shield if sheet is not None else 1))
    return _farther(spec, shield=down, metal=down)


def with_room_under_shield(spec: SensorSpec, off: float) -> SensorSpec:
    """Return the spec with metal farther below the shield (m)."""
    return _farther(spec, metal=off)


def with_shield(spec: SensorSpec, off: float) -> SensorSpec:
    """Return the spec with a thicker shield (m), and the metal behind it lower by an equal amount."""
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
    """Return the spec with a higher jaw, or thicker metal behind the board (m)."""
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


def beside(axis: int) -> Moved:
    """Return a move of the target along an axis (0: x, 1: y) (m)."""

    def moved(spec: SensorSpec, off: float) -> SensorSpec:
        if spec.target is None:
            return spec
        x, y = spec.target.offset
        offset = (x + off, y) if axis == 0 else (x, y + off)
        return replace(spec, target=replace(spec.target, offset=offset))

    return moved


def turned(spec: SensorSpec, off: float) -> SensorSpec:
    """Return the spec with a target turned by an angle (rad)."""
    target = spec.target
    return spec if target is None else replace(spec, target=replace(target, rotation=target.rotation + off))


def _farther(spec: SensorSpec, **by: float) -> SensorSpec:
    # Offsets of one unit add up
    offsets = spec.assembly.offsets
    moved = replace(offsets, **{name: getattr(offsets, name) + more for name, more in by.items()})
    return replace(spec, assembly=replace(spec.assembly, offsets=moved))
