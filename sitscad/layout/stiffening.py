"""The plate under the contacts, and how thick the tail is without it."""

from __future__ import annotations

from sitscad.geometry.region import Region
from sitscad.layout.board import Stiffener
from sitscad.layout.tail import TailFrame, first_via
from sitscad.spec.sensor import SensorSpec


def tail_thickness(spec: SensorSpec) -> float:
    """Thickness (m) of the tail: the stack-up down to its last copper layer, and the bottom coverlay."""
    stack = spec.fpc.stackup
    layers = min(spec.fpc.tail.layers, len(stack.copper)) if spec.fpc.tail else len(stack.copper)
    last = stack.copper[layers - 1]
    return -(last.z - last.thickness / 2) + stack.layers[-1].thickness


def stiffener(spec: SensorSpec, tail: TailFrame) -> Stiffener | None:
    """The plate under the contacts that brings them to the connector's insertion thickness; none for solder pads."""
    connector = tail.connector
    bare = tail_thickness(spec) - spec.fpc.stackup.layers[0].thickness
    thickness = connector.insertion_thickness - bare
    if spec.fpc.tail is None or connector.insertion_thickness <= 0.0 or thickness <= 0.0:
        return None
    start = max(tail.start, min(tail.end - connector.stiffener_length, first_via(spec, tail)))
    return Stiffener(Region(tail.strip(start)), thickness, "polyimide")
