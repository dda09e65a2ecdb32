"""A fabricator's design rules: what can be made, each figure with its source."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from typing import Any

from sitscad.record import record
from sitscad.units import show


@record
class FoilLines:
    """Smallest width and spacing (m) of tracks in copper foil of one thickness (m), with their sources and holders."""

    copper: float
    width: float
    spacing: float
    width_source: str = ""
    spacing_source: str = ""
    width_holder: str = ""
    spacing_holder: str = ""


@record
class DesignRules:
    """Smallest makeable sizes in metres; `sources` names where each figure (by field name) comes from, `holders` the
    profile that it stands in, with its line in a user's file: one that another is based on has most of its figures.

    ``coil_lines`` are the smallest widths and spacings of coiled tracks by the thickness of the copper foil (m), from
    the thinnest, ``track_lines`` those of all other tracks where they go by the foil too; ``coil_trace_width`` and
    ``trace_width`` and their spacings are those that hold, of ``coil_copper`` where known.
    ``annular_rings`` are those of boards of so many copper layers and more, where they differ from ``annular_ring``.
    ``static_bend_ratio``, ``dynamic_bend_ratio`` and ``thickness_tolerance`` (half the band, m) go by the number of
    copper layers, the largest one listed standing for more; ``stiffened_tolerance`` (m) by the stiffener's material.
    Parts below ``part_size`` are not handled singly; ``panel_size`` is what a panel is filled up to; ``file_naming`` is
    how files are called in the archive that is sent; ``inside_radius`` is the smallest of inner edges of the outline.
    Where the tail has fewer layers than the body its own coverlay laps into the body by ``coverlay_lap``, and holes
    keep ``hole_to_step`` from the body's end. A plug's fingers go on under the coverlay by ``finger_lap``; it covers
    the rims of solder pads by ``pad_lap``.
    ``layer_counts``, ``foils`` and ``cores`` (m), ``covers``, ``stiffeners`` and ``finishes`` are all that is offered
    of each (None: not stated, so not judged), and boards are sold in an ``order_multiple``; with ``one_process``
    every board is made in one way. ``house`` and ``country`` are who makes it and where, empty where not stated.
    ``beyond`` names the figures that are taken for a thicker foil than any that they are stated for, and that thickness
    (m); ``unbound`` those minimums of coils that only warn although `coil_rule_binding` makes the others errors.
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
    annular_rings: Mapping[int, float] = field(default_factory=dict, hash=False)
    static_bend_ratio: Mapping[int, float] = field(default_factory=dict, hash=False)
    dynamic_bend_ratio: Mapping[int, float] = field(default_factory=dict, hash=False)
    source: str = ""
    checked_on: str = ""
    sources: Mapping[str, str] = field(default_factory=dict, hash=False)
    coil_lines: tuple[FoilLines, ...] = ()
    coil_copper: float | None = None
    track_lines: tuple[FoilLines, ...] = ()
    panel_size: tuple[float, float] = (0.1, 0.08)
    outline_tolerance: float = 0.1e-3
    registration: float = 0.1e-3
    inside_radius: float = 1e-3
    coverlay_lap: float = 0.5e-3
    hole_to_step: float = 0.5e-3
    finger_lap: float = 0.3e-3
    pad_lap: float = 0.125e-3
    thickness_tolerance: Mapping[int, float] = field(
        default_factory=lambda: {1: 50e-6, 2: 50e-6, 3: 100e-6}, hash=False
    )
    stiffened_tolerance: Mapping[str, float] = field(
        default_factory=lambda: {"polyimide": 50e-6, "fr4": 100e-6}, hash=False
    )
    file_naming: str = "protel"
    layer_counts: tuple[int, ...] | None = None
    foils: tuple[float, ...] | None = None
    cores: tuple[float, ...] | None = None
    covers: tuple[str, ...] | None = None
    stiffeners: tuple[str, ...] | None = None
    finishes: tuple[str, ...] | None = None
    order_multiple: int = 1
    one_process: bool = False
    house: str = ""
    country: str = ""
    holders: Mapping[str, str] = field(default_factory=dict, hash=False)
    beyond: Mapping[str, float] = field(default_factory=dict, hash=False)
    unbound: tuple[str, ...] = ()

    def for_foil(self, thickness: float) -> DesignRules:
        """The rules with the lines of the thinnest listed copper that is not thinner than the coil's foil (m); those of
        the thickest one listed where none is, whose sources then say so.
        """
        rules = self
        if self.coil_lines:
            lines = _lines_for(self.coil_lines, thickness)
            coiled: dict[str, Any] = {
                "coil_trace_width": lines.width,
                "coil_trace_spacing": lines.spacing,
                "coil_copper": lines.copper,
            }
            rules = replace(rules, **coiled, **_said(rules, "coil_trace", lines, thickness))
        if self.track_lines:
            lines = _lines_for(self.track_lines, thickness)
            others: dict[str, Any] = {"trace_width": lines.width, "trace_spacing": lines.spacing}
            rules = replace(rules, **others, **_said(rules, "trace", lines, thickness))
        return rules

    def for_layers(self, count: int) -> DesignRules:
        """The rules with the copper ring of a board of so many copper layers."""
        asked = max((least for least in self.annular_rings if least <= count), default=None)
        if asked is None:
            return self
        key = f"annular_ring_{asked}"
        sources = {**self.sources, "annular_ring": self.sources[key]}
        holders = {**self.holders, "annular_ring": self.holders[key]}
        return replace(self, annular_ring=self.annular_rings[asked], sources=sources, holders=holders)

    def binds(self, field: str) -> bool:
        """Whether a minimum of coiled tracks is an error where it is not kept, and not a warning."""
        return self.coil_rule_binding and field not in self.unbound

    def holder(self, field: str) -> str:
        """Who asks for one figure, in words: this profile, or it with the one that it takes the figure from."""
        holder = self.holders.get(field, self.name)
        is_placed = "(" in holder  # a user's, which names file and line itself
        return holder if holder == self.name or is_placed else f"{self.name} (which takes that from {holder})"

    @property
    def via_pad(self) -> float:
        """Smallest via pad diameter in metres: the drill and a ring on both sides."""
        return self.via_drill + 2.0 * self.annular_ring


def _lines_for(listed: tuple[FoilLines, ...], thickness: float) -> FoilLines:
    return next((row for row in listed if row.copper >= thickness - 1e-9), listed[-1])


def _said(rules: DesignRules, prefix: str, lines: FoilLines, thickness: float) -> dict[str, Any]:
    """Sources and holders with those of lines that are taken for a foil (m), which may be too thick for them."""
    width, spacing = f"{prefix}_width", f"{prefix}_spacing"
    beyond, stated = "", {name: most for name, most in rules.beyond.items() if name not in (width, spacing)}
    if thickness > lines.copper + 1e-9:
        beyond = f" (for copper up to {show(lines.copper, 'm')}: nothing is stated for {show(thickness, 'm')})"
        stated |= {width: lines.copper, spacing: lines.copper}
    return {
        "beyond": stated,
        "sources": {**rules.sources, width: lines.width_source + beyond, spacing: lines.spacing_source + beyond},
        "holders": {**rules.holders, width: lines.width_holder, spacing: lines.spacing_holder},
    }
