"""From the spec to everything that is drawn: coils, vias, leads, tail, contacts and outline."""

from __future__ import annotations

from sitscad.layout.arrangement import lay_out
from sitscad.layout.board import Coil, Layout, Stiffener, Winding
from sitscad.layout.pieces import Pad, Role, Trace, Via

__all__ = ["Coil", "Layout", "Pad", "Role", "Stiffener", "Trace", "Via", "Winding", "lay_out"]
