"""The plate under the contacts, and how thick the tail is without it."""

from __future__ import annotations

from sitscad.geometry.region import Region
from sitscad.layout.board import Stiffener
from sitscad.layout.tail.frame import TailFrame, first_via
from sitscad.spec.circuit import Connector
from sitscad.spec.presets import stock_stiffeners
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.stackup import LayerKind


def tail_thickness(spec: SensorSpec) -> float:
    """Thickness (m) of the tail: the stack-up down to its last copper layer, and the bottom coverlay."""
    stack = spec.fpc.stackup
    layers = min(spec.fpc.tail.layers, len(stack.copper)) if spec.fpc.tail else len(stack.copper)
    last = stack.copper[layers - 1]
    bottom = stack.layers[-1]
    below = bottom.thickness if bottom.kind is not LayerKind.COPPER else 0.0
    return -(last.z - last.thickness / 2) + below


def stiffener(spec: SensorSpec, tail: TailFrame) -> Stiffener | None:
    """The plate under the contacts that brings them to the connector's insertion thickness; none for solder pads."""
    connector = tail.connector
    if spec.fpc.tail is None or connector.insertion_thickness <= 0.0:
        return None
    thickness, adhesive = _thickness(spec.fpc.tail.stiffener, wanted_stiffener(spec, connector), connector)
    if thickness <= 0.0:
        return None
    start = max(tail.start, min(tail.end - connector.stiffener_length, first_via(spec, tail)))
    return Stiffener(Region(tail.strip(start)), thickness, "polyimide", adhesive)


def wanted_stiffener(spec: SensorSpec, connector: Connector) -> float:
    """What the bare contacts lack of the connector's insertion thickness (m); negative where they are thicker."""
    top = spec.fpc.stackup.layers[0]
    return (
        connector.insertion_thickness
        - tail_thickness(spec)
        + (top.thickness if top.kind is LayerKind.COVERLAY else 0.0)
    )


def _thickness(written: float | None, wanted: float, connector: Connector) -> tuple[float, float]:
    """A stiffener's thickness and its adhesive's (m): as written; else the stock one, or none, that comes nearest; else
    what is wanted, with an adhesive of 0.
    """
    stock = stock_stiffeners()
    if written is not None:
        return written, next((glue for film, glue in stock if abs(film + glue - written) < _SAME), 0.0)
    film, adhesive = min(((0.0, 0.0), *stock), key=lambda pair: (round(abs(sum(pair) - wanted), 9), pair[1]))
    if abs(film + adhesive - wanted) <= connector.insertion_thickness_tolerance or wanted <= 0.0:
        return film + adhesive, adhesive
    return wanted, 0.0


_SAME = 1e-9
