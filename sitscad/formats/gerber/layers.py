"""Gerber X2 files of the board: every copper layer, coverlay openings, stiffener, extent of inner layers, outline."""

from __future__ import annotations

from sitscad.formats.gerber.image import layer_files
from sitscad.layout.board import Layout


def render(layout: Layout) -> dict[str, bytes]:
    """All Gerber files of a layout by their path in the package. Deterministic: nothing but the layout enters."""
    return layer_files(layout)
