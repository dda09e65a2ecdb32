"""The finished thickness of the flexible circuit where it matters: at the coils, in the tail, at the contacts."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum

from sitscad.layout.board import Layout
from sitscad.record import record
from sitscad.spec.stackup import LayerKind, StackLayer


class Where(StrEnum):
    """A place on the board with a build-up of its own."""

    COIL = "coil"
    TAIL = "tail"
    CONTACT = "contact"


@record
class FinishedThickness:
    """A thickness in metres: the sum of the layers, and the least and the most that the fabricator delivers.

    ``source`` says where the band comes from.
    """

    minimum: float
    nominal: float
    maximum: float
    source: str


def finished_thickness(layout: Layout, where: Where) -> FinishedThickness:
    """The worst case of the stack at a place: the layers' sum, and the fabricator's tolerance of finished thickness.

    At the coils all layers count, in the tail those down to its last copper layer and the bottom coverlay; at the
    contacts these without the opened coverlays, with the stiffener. A fabricator answers for the whole, not for each
    film: the tolerance is the one of `fpc.rules` by copper layers, or by the stiffener's material where there is one.
    """
    rules, layers = layout.spec.fpc.rules, layers_at(layout, where)
    nominal = sum(layer.thickness for layer in layers)
    plate = layout.stiffener if where is Where.CONTACT else None
    if plate is not None:
        field = f"stiffened_tolerance_{plate.material}"
        nominal, tolerance = nominal + plate.thickness, _stiffened(rules.stiffened_tolerance, plate.material)
    else:
        copper = sum(layer.kind is LayerKind.COPPER for layer in layers)
        field, tolerance = _by_layers(rules.thickness_tolerance, copper)
    source = rules.sources.get(field) or rules.source or "the fabricator's design rules (fpc.rules)"
    return FinishedThickness(max(0.0, nominal - tolerance), nominal, nominal + tolerance, source)


def layers_at(layout: Layout, where: Where) -> tuple[StackLayer, ...]:
    """The layers of the stack-up at a place, from the top, without the stiffener."""
    layers = layout.spec.fpc.stackup.layers
    if where is Where.COIL:
        return layers
    tail = tail_layers(layout)
    if where is Where.TAIL:
        return tail
    return tuple(layer for i, layer in enumerate(tail) if not is_opened(layout, i, layer))


def tail_copper(layout: Layout) -> int:
    """How many copper layers, from the top, run down the tail; all of them where there is no tail."""
    tail = layout.spec.fpc.tail
    return min(tail.layers, layout.copper_layers) if tail is not None else layout.copper_layers


def has_tail_coverlay(layout: Layout) -> bool:
    """Whether the tail ends above the body's lower layers and has a bottom coverlay of its own, since the body's cannot
    run over such a step.
    """
    layers = layout.spec.fpc.stackup.layers
    return tail_copper(layout) < layout.copper_layers and layers[-1].kind is LayerKind.COVERLAY


def lap_start(layout: Layout) -> float:
    """Where along x (m) the tail's own bottom coverlay begins, inside the body."""
    return layout.body[2] - layout.spec.fpc.rules.coverlay_lap


def step_height(layout: Layout) -> float:
    """How much thicker (m) the body is than the tail where lower layers end."""
    return layout.spec.fpc.stackup.thickness - sum(layer.thickness for layer in tail_layers(layout))


def tail_layers(layout: Layout) -> tuple[StackLayer, ...]:
    """The stack-up of the tail: down to its last copper layer, and the bottom coverlay."""
    layers = layout.spec.fpc.stackup.layers
    copper = [i for i, layer in enumerate(layers) if layer.kind is LayerKind.COPPER]
    kept = copper[tail_copper(layout) - 1] + 1
    below = layers[copper[-1] + 1 :]
    return layers[:kept] + below


def is_opened(layout: Layout, index: int, layer: StackLayer) -> bool:
    """Whether a layer of the tail, counted from the top, is a coverlay with openings over the contacts."""
    openings = layout.top_openings if index == 0 else layout.bottom_openings
    return layer.kind is LayerKind.COVERLAY and bool(openings)


def _by_layers(tolerances: Mapping[int, float], copper: int) -> tuple[str, float]:
    """The figure's name and the tolerance (m) of a number of copper layers; the largest listed stands for more."""
    listed = max((count for count in tolerances if count <= copper), default=min(tolerances))
    return f"thickness_tolerance_{listed}", tolerances[listed]


def _stiffened(tolerances: Mapping[str, float], material: str) -> float:
    """The tolerance (m) with a stiffener; of a material that is not listed, the largest one."""
    return tolerances.get(material, max(tolerances.values()))
