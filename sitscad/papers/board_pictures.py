"""The pictures of the flexible circuit beside its Gerber files: the whole board, and its body with the coils."""

from __future__ import annotations

from sitscad.drawing.pictures.board import picture
from sitscad.fabrication.files import fabrication_path
from sitscad.layout.board import Layout


def render(layout: Layout) -> dict[str, bytes]:
    """Two pictures by their paths in the package: the whole board, and its body, which carries the coils."""
    return {
        fabrication_path(layout, "board.svg"): picture(layout).encode("utf-8"),
        fabrication_path(layout, "body.svg"): picture(layout, window=layout.body, name="body").encode("utf-8"),
    }
