"""The stack-up: the layers of the flexible circuit from top to bottom, and where each copper layer lies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from enum import StrEnum
from functools import cached_property

from sitscad.record import record


class LayerKind(StrEnum):
    """What a layer of the stack-up is made for."""

    COVERLAY = "coverlay"
    COPPER = "copper"
    DIELECTRIC = "dielectric"


class Plating(StrEnum):
    """What of the copper is plated together with the holes: all of the panel before it is etched, the tracks alone
    (through a resist, on foil that is etched afterwards), or the holes and their pads alone ("buttons").
    """

    PANEL = "panel"
    PATTERN = "pattern"
    BUTTONS = "buttons"


MASK = "solder-mask"
"""The material of a coverlay that is printed and no film."""


@record
class StackLayer:
    """One layer: its thickness in metres and its material (a row of the materials data).

    ``made_of`` names the films of a layer that is laminated from several, in words; empty where that is not stated.
    ``plated`` (m) is the part of a copper layer's thickness that is plated on its foil.
    """

    kind: LayerKind
    thickness: float
    material: str
    relative_permittivity: float | None = None
    made_of: str = ""
    plated: float = 0.0

    @property
    def foil(self) -> float:
        """Thickness (m) of the foil that a copper layer is made from."""
        return self.thickness - self.plated


@record
class CopperLayer:
    """A copper layer: `number` counts from 1 at the top, `z` is its mid-plane (m), negative below the board's top.

    ``thickness`` (m) is finished, ``plated`` (m) the part of it that is plated on the foil.
    """

    number: int
    z: float
    thickness: float
    plated: float = 0.0

    @property
    def foil(self) -> float:
        """Thickness (m) of the foil."""
        return self.thickness - self.plated


@record
class Stackup:
    """The flexible circuit's layers from top to bottom, as they are finished: `built` says how.

    `plating_thickness` (m) is the copper that one step of plating lays into holes and, as `plating` says, on foil;
    `is_plating_stated` is False where the fabricator does not say how much of his copper is plated. ``core_layers`` is
    the number of copper layers from the top that are drilled and plated before the others are laminated on, 0 if none.
    """

    name: str
    layers: tuple[StackLayer, ...]
    source: str = ""
    plating_thickness: float = 0.0
    is_plating_stated: bool = True
    plating: Plating = Plating.PANEL
    core_layers: int = 0

    @property
    def thickness(self) -> float:
        """Finished thickness in metres, without stiffener."""
        return sum(layer.thickness for layer in self.layers)

    @cached_property
    def copper(self) -> tuple[CopperLayer, ...]:
        """The copper layers from the top, each with its height."""
        found: list[CopperLayer] = []
        depth = 0.0
        for layer in self.layers:
            if layer.kind is LayerKind.COPPER:
                z = -(depth + layer.thickness / 2)
                found.append(CopperLayer(len(found) + 1, z, layer.thickness, layer.plated))
            depth += layer.thickness
        return tuple(found)

    def platings(self, number: int) -> int:
        """How often a copper layer (from 1) lies open while holes are plated: the outer ones once, those of a core
        that is plated by itself once with it, one that is both twice. A single layer has no plated holes.
        """
        count = sum(layer.kind is LayerKind.COPPER for layer in self.layers)
        ends = [(1, count)] * (count > 1) + [(1, self.core_layers)] * (self.core_layers > 1)
        return sum(number in pair for pair in ends)

    def built(
        self, plating: Plating, core_layers: int, thickness: float | None = None, finished: bool = False
    ) -> Stackup:
        """The stack-up built in one way, with a plating of so many metres (None: its own): from its foils, or where
        its copper is given as it is ``finished``, to that, from what foil is left.
        """
        wall = self.plating_thickness if thickness is None else thickness
        bare = replace(self, plating=plating, core_layers=core_layers, plating_thickness=wall)
        layers, number = [], 0
        for layer in self.layers:
            if layer.kind is LayerKind.COPPER:
                number += 1
                plated = 0.0 if plating is Plating.BUTTONS else bare.platings(number) * wall
                whole = layer.thickness if finished else layer.foil + plated
                layer = replace(layer, thickness=whole, plated=plated)
            layers.append(layer)
        return replace(bare, layers=tuple(layers))

    def line_foil(self, layers: Sequence[int]) -> float:
        """The thickest copper (m) of some layers (numbers from 1, missing ones are passed over) as fabricators list
        their widths by it: the foil. One plating of the whole panel is in those figures; what a second one adds is
        etched like thicker foil. Where it is not stated how much is plated, all of it counts.
        """
        return max((self._line_foil(layer) for layer in self.copper if layer.number in layers), default=0.0)

    def _line_foil(self, layer: CopperLayer) -> float:
        if not self.is_plating_stated:
            return layer.thickness
        again = max(0.0, layer.plated - self.plating_thickness) if self.plating is Plating.PANEL else 0.0
        return layer.foil + again

    def between(self, upper: int, lower: int) -> tuple[StackLayer, ...]:
        """The layers strictly between two copper layers (numbers from 1)."""
        indices = [i for i, layer in enumerate(self.layers) if layer.kind is LayerKind.COPPER]
        return self.layers[indices[upper - 1] + 1 : indices[lower - 1]]
