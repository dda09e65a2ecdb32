"""The outline of the board's body as it is asked for: round, straight or drawn in a DXF file. SI units."""

from __future__ import annotations

from dataclasses import replace

from sitscad.geometry.path import Path, Point, bounding_box, circle, rectangle
from sitscad.record import record
from sitscad.spec.format.kinds import Choice, FileName, Pair, Quantity
from sitscad.spec.format.section import Section, key

PLAIN_CORNER = 0.5e-3
"""Radius (m) of a rectangle's corners: as of every board's outline, for what touches tissue has no sharp edge."""


@record
class BodySpec(Section):
    """The outline of the board's body, without its tail: its middle is the mean of the coils' centres.

    Lengths are metres; ``size`` is None only until it is worked out, as is ``edge``: the closed outline, walked
    counter-clockwise, about that mean.
    """

    shape: str = key(
        Choice(("circle", "rectangle", "rounded", "dxf")),
        "rectangle: corners of 0.5 mm; rounded: of corner_radius; dxf: as drawn in file",
    )
    size: tuple[float, float] | None = key(
        Pair(Quantity("length", "1 mm", "500 mm"), single=True),
        "diameter of a circle, or side; [x, y] along and across, of a rectangle; must be there but for a dxf", None,
    )
    corner_radius: float | None = key(
        Quantity("length", "0.1 mm", "250 mm"), "of shape rounded: 1 mm if left out", None
    )
    file: str | None = key(
        FileName("DXF", r"\.[dD][xX][fF]$", "body.dxf"), "of shape dxf: one closed outline of lines and arcs, in the "
        "spec's folder. Its origin comes to the mean of the coils' centres, its x runs to the tail", None,
    )
    edge: Path = Path(())

    def sized(self, size: tuple[float, float]) -> BodySpec:
        """The body of another size (m), with its outline; one that is drawn stays as it is."""
        if self.shape == "dxf":
            return self
        (x, y), radius = size, PLAIN_CORNER if self.corner_radius is None else self.corner_radius
        round_one = circle(Point(0.0, 0.0), x / 2)
        straight = rectangle(-x / 2, -y / 2, x / 2, y / 2, radius)
        return replace(self, size=size, edge=round_one if self.shape == "circle" else straight)

    @property
    def extent(self) -> tuple[float, float]:
        """Its length and width (m)."""
        x0, y0, x1, y1 = bounding_box([self.edge])
        return x1 - x0, y1 - y0

    @property
    def written(self) -> str:
        """The body as it stands in a spec, lengths in millimetres."""
        if self.shape == "dxf":
            return f"{{shape: dxf, file: {self.file}}}"
        x, y = (f"{side * 1e3:.9g}" for side in self.size or self.extent)
        corners = "" if self.corner_radius is None else f", corner_radius: {self.corner_radius * 1e3:.9g}"
        return f"{{shape: {self.shape}, size: {x if x == y else f'[{x}, {y}]'}{corners}}}"
