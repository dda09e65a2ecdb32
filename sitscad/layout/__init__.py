"""From the spec to everything that is drawn: coils, vias, leads, tail, contacts and outline."""

from __future__ import annotations

from sitscad.layout.arrangement import arrange
from sitscad.layout.board import Coil, Layout, Pad, Role, Stiffener, Trace, Via, Winding
from sitscad.spec.format.validity import refuse_unusable
from sitscad.spec.sensor import SensorSpec

__all__ = ["Coil", "Layout", "Pad", "Role", "Stiffener", "Trace", "Via", "Winding", "lay_out"]


def lay_out(spec: SensorSpec) -> Layout:
    """The sensor as drawn; what found no room is in its `shortfalls`, and is no error here.

    Raises
    ------
    SpecError
        where the spec was put together in Python and has values that could not have been read from a text.
    """
    refuse_unusable(spec)
    return arrange(spec)
