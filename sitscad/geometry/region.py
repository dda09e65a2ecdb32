"""A filled area: one closed outline and the holes in it."""

from __future__ import annotations

from sitscad.geometry.path import Path, enclosed_area
from sitscad.record import record


@record
class Region:
    """The area inside a closed `outline` and outside its `holes`."""

    outline: Path
    holes: tuple[Path, ...] = ()

    @property
    def area(self) -> float:
        """Area in square metres."""
        return abs(enclosed_area(self.outline)) - sum(abs(enclosed_area(hole)) for hole in self.holes)
