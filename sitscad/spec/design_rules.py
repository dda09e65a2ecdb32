"""A fabricator's design rules: what can be made, each figure with its source."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class DesignRules:
    """Smallest makeable sizes in metres; `sources` names where each figure (by field name) comes from."""

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

    @property
    def via_pad(self) -> float:
        """Smallest via pad diameter in metres: the drill and a ring on both sides."""
        return self.via_drill + 2.0 * self.annular_ring
