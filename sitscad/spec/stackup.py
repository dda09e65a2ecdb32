"""The stack-up: the layers of the flexible circuit from top to bottom, and where each copper layer lies."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from functools import cached_property

from sitscad.record import record


class LayerKind(StrEnum):
    """What a layer of the stack-up is made for."""

    COVERLAY = "coverlay"
    COPPER = "copper"
    DIELECTRIC = "dielectric"


MASK = "solder-mask"
"""The material of a coverlay that is printed and no film."""


@record
class StackLayer:
    """One layer: its thickness in metres and its material (a row of the materials data).

    ``made_of`` names the films of a layer that is laminated from several, in words; empty where that is not stated.
    """

    kind: LayerKind
    thickness: float
    material: str
    relative_permittivity: float | None = None
    made_of: str = ""


@record
class CopperLayer:
    """A copper layer: `number` counts from 1 at the top, `z` is its mid-plane (m), negative below the board's top."""

    number: int
    z: float
    thickness: float


@record
class Stackup:
    """The flexible circuit's layers from top to bottom.

    Thicknesses are finished ones. `plating_thickness` (m) is the copper in the via barrels, part of the outer copper
    layers' thickness already, and `is_plating_stated` is False where it is only what is usual: then no foil counts as
    thinner for it; `copper_thickness_sigma` (m) is one sigma of the outer copper's thickness.
    """

    name: str
    layers: tuple[StackLayer, ...]
    source: str = ""
    plating_thickness: float = 0.0
    copper_thickness_sigma: float | None = None
    is_plating_stated: bool = True

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
                found.append(CopperLayer(len(found) + 1, -(depth + layer.thickness / 2), layer.thickness))
            depth += layer.thickness
        return tuple(found)

    def foil_thickness(self, layers: Sequence[int]) -> float:
        """The thickest foil (m) of some copper layers (numbers from 1, missing ones are passed over): the copper before
        plating, by which fabricators list their widths. Only the outer layers are plated.
        """
        copper = self.copper
        plating = self.plating_thickness if self.is_plating_stated else 0.0
        foils = [
            layer.thickness - (plating if layer.number in (1, len(copper)) else 0.0)
            for layer in copper
            if layer.number in layers
        ]
        return max(foils, default=0.0)

    def between(self, upper: int, lower: int) -> tuple[StackLayer, ...]:
        """The layers strictly between two copper layers (numbers from 1)."""
        indices = [i for i, layer in enumerate(self.layers) if layer.kind is LayerKind.COPPER]
        return self.layers[indices[upper - 1] + 1 : indices[lower - 1]]
