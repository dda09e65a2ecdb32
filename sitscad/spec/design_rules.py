"""A fabricator's design rules: what can be made, each figure with its source."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace


@dataclass(frozen=True)
class CoilLines:
    """Smallest width and spacing (m) of coiled tracks in copper foil of one thickness (m), with their sources."""

    copper: float
    width: float
    spacing: float
    width_source: str = ""
    spacing_source: str = ""


@dataclass(frozen=True)
class DesignRules:
    """Smallest makeable sizes in metres; `sources` names where each figure (by field name) comes from.

    ``coil_lines`` are the smallest widths and spacings of coiled tracks by the thickness of the copper foil (m), from
    the thinnest; ``coil_trace_width`` and ``coil_trace_spacing`` are those that hold, of ``coil_copper`` where known.
    """

    name: str
    trace_width: float
    trace_spacing: float
    via_drill: float
    annular_ring: float
    coil_trace_width: float | None
    coil_trace_spacing: float | None
    coil_rule_binding: bool
    hole_to_hole: float
    drill_to_copper: float
    copper_to_edge: float
    coverlay_web: float
    coverlay_opening_to_trace: float
    part_size: tuple[float, float]
    static_bend_ratio: Mapping[int, float] = field(default_factory=dict)
    dynamic_bend_ratio: Mapping[int, float] = field(default_factory=dict)
    source: str = ""
    checked_on: str = ""
    sources: Mapping[str, str] = field(default_factory=dict)
    coil_lines: tuple[CoilLines, ...] = ()
    coil_copper: float | None = None

    def for_foil(self, thickness: float) -> DesignRules:
        """The rules with the coil lines of the thinnest listed copper that is not thinner than the coil's foil (m);
        those of the thickest one listed where none is.
        """
        if not self.coil_lines:
            return self
        lines = next((row for row in self.coil_lines if row.copper >= thickness - 1e-9), self.coil_lines[-1])
        return replace(
            self,
            coil_trace_width=lines.width,
            coil_trace_spacing=lines.spacing,
            coil_copper=lines.copper,
            sources={
                **self.sources,
                "coil_trace_width": lines.width_source,
                "coil_trace_spacing": lines.spacing_source,
            },
        )

    @property
    def via_pad(self) -> float:
        """Smallest via pad diameter in metres: the drill and a ring on both sides."""
        return self.via_drill + 2.0 * self.annular_ring
