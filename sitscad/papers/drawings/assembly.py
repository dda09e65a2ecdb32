"""The assembly from the top, for whoever lays the pieces on the board: elastomer and target over the coils, to scale,
with the coordinates of their edges, as PDF beside the files that they are cut by.
"""

from __future__ import annotations

from sitscad.drawing.pdf import pdf
from sitscad.layout.board import Layout
from sitscad.papers.drawings.plan_view import drawing


def render(layout: Layout, forced: str) -> dict[str, bytes]:
    """``laser/NAME-assembly.pdf``; nothing for a sensor without elastomer and target; stamped where ``forced``."""
    sheet = drawing(layout, bool(forced))
    return {} if sheet is None else {f"laser/{layout.spec.name}-assembly.pdf": pdf([sheet])}
