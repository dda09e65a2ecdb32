"""How thick the flexible circuit is where it matters (coils, tail, contacts), and the plate under the contacts."""

from __future__ import annotations

from enum import StrEnum

from sitscad.geometry.path import Region
from sitscad.layout.board import Layout, Stiffener
from sitscad.layout.tail_frame import TailFrame, first_via
from sitscad.record import record
from sitscad.spec.circuit import LayerKind, StackLayer
from sitscad.spec.presets import stock_stiffeners
from sitscad.spec.sensor import SensorSpec


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
    film: the tolerance is the one of `fpc.rules` by copper layers (the largest listed stands for more), or by the
    stiffener's material where there is one (of one that is not listed, the largest).
    """
    rules, plate = layout.spec.fpc.rules, layout.stiffener if where is Where.CONTACT else None
    layers = layout.spec.fpc.stackup.layers if where is Where.COIL else tail_layers(layout)
    if where is Where.CONTACT:
        layers = tuple(layer for i, layer in enumerate(layers) if not is_opened(layout, i, layer))
    nominal = sum(layer.thickness for layer in layers)
    if plate is not None:
        field, tolerances = f"stiffened_tolerance_{plate.material}", rules.stiffened_tolerance
        nominal, tolerance = nominal + plate.thickness, tolerances.get(plate.material, max(tolerances.values()))
    else:
        copper = sum(layer.kind is LayerKind.COPPER for layer in layers)
        by_layers = rules.thickness_tolerance
        listed = max((count for count in by_layers if count <= copper), default=min(by_layers))
        field, tolerance = f"thickness_tolerance_{listed}", by_layers[listed]
    source = rules.sources.get(field) or rules.source or "the fabricator's design rules (fpc.rules)"
    return FinishedThickness(max(0.0, nominal - tolerance), nominal, nominal + tolerance, source)


def tail_copper(layout: Layout) -> int:
    """How many copper layers, from the top, run down the tail; all of them where there is no tail."""
    tail = layout.spec.fpc.tail
    return min(tail.layers, layout.copper_layers) if tail is not None else layout.copper_layers


def has_tail_coverlay(layout: Layout) -> bool:
    """Whether the tail has a bottom coverlay of its own: the body's cannot run over a step to fewer layers."""
    last = layout.spec.fpc.stackup.layers[-1]
    return tail_copper(layout) < layout.copper_layers and last.kind is LayerKind.COVERLAY


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


def tail_thickness(spec: SensorSpec) -> float:
    """Thickness (m) of the tail: the stack-up down to its last copper layer, and the bottom coverlay."""
    stack = spec.fpc.stackup
    layers = min(spec.fpc.tail.layers, len(stack.copper)) if spec.fpc.tail else len(stack.copper)
    last = stack.copper[layers - 1]
    bottom = stack.layers[-1]
    below = bottom.thickness if bottom.kind is not LayerKind.COPPER else 0.0
    return -(last.z - last.thickness / 2) + below


def stiffener(spec: SensorSpec, tail: TailFrame) -> Stiffener | None:
    """The plate under the contacts that brings them to the connector's insertion thickness; none for solder pads.

    As thick as the spec says, its adhesive that of a stock film; else the stock one, or none, that comes nearest to
    what is wanted; else what is wanted, with an adhesive of 0.
    """
    connector = tail.connector
    if spec.fpc.tail is None or connector.insertion_thickness <= 0.0:
        return None
    top, written, stock = spec.fpc.stackup.layers[0], spec.fpc.tail.stiffener, stock_stiffeners()
    opened = top.thickness if top.kind is LayerKind.COVERLAY else 0.0
    wanted = connector.insertion_thickness - tail_thickness(spec) + opened
    film, adhesive = min(((0.0, 0.0), *stock), key=lambda pair: (round(abs(sum(pair) - wanted), 9), pair[1]))
    thickness = film + adhesive
    if written is not None:
        thickness = written
        adhesive = next((glue for film, glue in stock if abs(film + glue - written) < 1e-9), 0.0)
    elif abs(thickness - wanted) > connector.insertion_thickness_tolerance and wanted > 0.0:
        thickness, adhesive = wanted, 0.0
    if thickness <= 0.0:
        return None
    start = max(tail.start, min(tail.end - connector.stiffener_length, first_via(spec, tail)))
    return Stiffener(Region(tail.strip(start)), thickness, "polyimide", adhesive)
