"""A fabricator's design rules, each figure with its source, and their form in a spec or in a profile file.

The installed profiles (`sitscad/data/fabricators`) are files of this form.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import field, replace
from typing import Any, ClassVar

from sitscad.basics.record import record
from sitscad.basics.units import show
from sitscad.spec.format.kinds import (
    Boolean,
    Choice,
    Figure,
    Label,
    Number,
    Pair,
    Preset,
    ProfileName,
    Several,
    Sourced,
    Text,
    UnitValue,
)
from sitscad.spec.format.section import ListOf, NameOr, Part, Section, SpecValue, key, keys_like


@record
class FoilLines:
    """Smallest width and spacing (m) of tracks in copper foil of one thickness (m).

    Each has its source, and as holder the name of the profile that states it.
    """

    copper: float
    width: float
    spacing: float
    width_source: str = ""
    spacing_source: str = ""
    width_holder: str = ""
    spacing_holder: str = ""


@record
class DesignRules(SpecValue):
    """Smallest sizes (m) that a fabricator can make.

    Sources, by field:

    * ``sources``: source of each value
    * ``holders``: name of the profile that states the value. For a user's file, its path and line follow.
    * ``beyond``: only for values that are used for a thicker foil than the fabricator states. The entry is the thickest
      foil (m) for which the value is stated.
    * ``unbound``: minimums of coil tracks whose violation is only a warning, although ``coil_rule_binding`` is True

    Tracks:

    * ``coil_lines``: smallest widths and spacings of coil tracks, one row for each foil thickness, the thinnest first
    * ``track_lines``: such rows for all other tracks. Empty if their values do not depend on the foil.
    * ``coil_trace_width``, ``trace_width`` and their spacings: values for the foil of this design. ``coil_copper`` (m)
      is the foil of the row from which the coil's values come. None if the coil's values do not depend on the foil.

    Tables by the number of copper layers:

    * ``annular_rings``: rings (m) that replace ``annular_ring`` for boards with at least this number of layers
    * ``static_bend_ratio`` and ``dynamic_bend_ratio``: smallest bend radius divided by thickness
    * ``thickness_tolerance`` (half the band, m)

    In the last three tables, the entry of the largest number also applies to more layers.

    Boards and panels:

    * ``part_size``: smallest length and width of a board that the fabricator handles without a panel
    * ``panel_size``: length and width up to which a panel is filled with boards
    * ``largest_part``: length and width of the largest board or panel that the fabricator makes, by agreement
    * ``inside_radius``: smallest radius of inner edges of the outline
    * ``stiffened_tolerance`` (m): tolerance of the thickness with a stiffener, by its material
    * ``file_naming``: naming scheme of files in the archive

    Coverlay:

    * ``coverlay_lap``: if the tail has fewer layers than the body, length by which its coverlay overlaps the body
    * ``hole_to_step``: distance of holes from the body's end at a tail with fewer layers
    * ``finger_lap``: length by which the coverlay covers the beginning of the contact fingers
    * ``pad_lap``: width of the rim that the coverlay covers on each solder pad

    Orders:

    * ``layer_counts``, ``foils`` and ``cores`` (m), ``covers``, ``stiffeners``, ``finishes``: all options on offer.
      None if the fabricator does not state them; they are then not checked.
    * ``order_multiple``: boards are sold in multiples of this number
    * ``one_process``: True if all boards are made in the same way
    * ``house``, ``country``, ``purpose``: fabricator, place of production, and use of the profile. Empty if not stated.
    """

    read_instead: ClassVar[dict[str, str]] = {
        "based_on": "spec.fpc.rules.holders", "tracks": "spec.fpc.rules.track_lines",
        "coil_tracks": "spec.fpc.rules.coil_lines", "annular_ring_4": "spec.fpc.rules.annular_rings[4]",
        **{f"{name}_{layers}": f"spec.fpc.rules.{name}{ending}[{layers}]" for layers in (1, 2, 3)
           for name, ending in (("static_bend", "_ratio"), ("dynamic_bend", "_ratio"), ("thickness_tolerance", ""))},
        **{f"stiffened_tolerance_{name}": f"spec.fpc.rules.stiffened_tolerance[{name!r}]"
           for name in ("polyimide", "fr4")},
    }

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
    largest_part: tuple[float, float] = (0.2286, 0.5842)
    outline_tolerance: float = 0.1e-3
    registration: float = 0.1e-3
    coverlay_registration: float = 0.15e-3
    inside_radius: float = 1e-3
    coverlay_lap: float = 0.3e-3
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
    purpose: str = ""
    holders: Mapping[str, str] = field(default_factory=dict, hash=False)
    beyond: Mapping[str, float] = field(default_factory=dict, hash=False)
    unbound: tuple[str, ...] = ()

    def for_foil(self, thickness: float) -> DesignRules:
        """Return the rules with the track widths and spacings that apply to foil of this `thickness` (m).

        Of the profile's rows for foils of this thickness or more, the row with the thinnest foil applies. If all listed
        foils are thinner, the row with the thickest foil applies, and the sources state this.
        """
        rules = self
        for prefix, listed in (("coil_trace", self.coil_lines), ("trace", self.track_lines)):
            if listed:
                lines = next((row for row in listed if row.copper >= thickness - 1e-9), listed[-1])
                rules = rules._with_lines(prefix, lines, thickness)
        return rules

    def _with_lines(self, prefix: str, lines: FoilLines, thickness: float) -> DesignRules:
        # Return the rules with the lines in use for a foil (m), which may be thicker than the lines' foil.
        width, spacing = f"{prefix}_width", f"{prefix}_spacing"
        beyond, exceeded = "", {name: most for name, most in self.beyond.items() if name not in (width, spacing)}
        if thickness > lines.copper + 1e-9:
            beyond = f" (for copper up to {show(lines.copper, 'm')}: nothing is stated for {show(thickness, 'm')})"
            exceeded |= {width: lines.copper, spacing: lines.copper}
        changed: dict[str, Any] = {width: lines.width, spacing: lines.spacing, "beyond": exceeded}
        if prefix == "coil_trace":
            changed["coil_copper"] = lines.copper
        sources = {width: lines.width_source + beyond, spacing: lines.spacing_source + beyond}
        holders = {width: lines.width_holder, spacing: lines.spacing_holder}
        return replace(self, **changed, sources={**self.sources, **sources}, holders={**self.holders, **holders})

    def for_layers(self, count: int) -> DesignRules:
        """Return the rules with `annular_ring` set to the minimum for a board with `count` copper layers."""
        ring_layers = max((least for least in self.annular_rings if least <= count), default=None)
        if ring_layers is None:
            return self
        key = f"annular_ring_{ring_layers}"
        sources = {**self.sources, "annular_ring": self.sources[key]}
        holders = {**self.holders, "annular_ring": self.holders[key]}
        return replace(self, annular_ring=self.annular_rings[ring_layers], sources=sources, holders=holders)

    def is_binding(self, field: str) -> bool:
        """Whether a coil track below the minimum in `field` is an error. If False, it is only a warning.

        `field` is "coil_trace_width" or "coil_trace_spacing".
        """
        return self.coil_rule_binding and field not in self.unbound

    def source_of(self, field: str) -> str:
        """Return the source of the value in `field`: its own, or else the source of the whole profile."""
        return self.sources.get(field) or self.source or "the fabricator's design rules (fpc.rules)"

    def holder(self, field: str) -> str:
        """Return the text that names the profile which states the value in `field`.

        If the base of a profile states it, the text names both. For a user's profile, it has the file's path and line.
        """
        holder = self.holders.get(field, self.name)
        is_placed = "(" in holder  # a user's profile, with file and line
        return holder if holder == self.name or is_placed else f"{self.name} (which takes that from {holder})"

    @property
    def via_pad(self) -> float:
        """Smallest pad diameter (m) of a via: the smallest drill plus two smallest annular rings."""
        return self.via_drill + 2.0 * self.annular_ring


Feature = Sourced(UnitValue("length", "5 um", "10 mm"))
Foil = UnitValue("length", "1 um", "500 um")
Tolerance = Sourced(UnitValue("length", "1 um", "1 mm"))
BendRatio = Sourced(Number(1, 1000))
COVERS = ("film", "solder-mask")
"""Covers of the copper: a film bonded with adhesive, or a printed mask."""
FINISHES = ("enig", "hard-gold", "immersion-tin", "immersion-silver", "osp")
STIFFENERS = ("polyimide", "fr4")

Words = Sourced(Text(100))
Sides = Sourced(Pair(UnitValue("length", "1 mm", "1000 mm")))

Written = Figure | None


class TrackRowDocument(Section):
    """Smallest width and gap of tracks in copper foil up to one thickness, before plating."""

    copper: float = key(Foil, "the foil, like 9 um")
    width: Figure = key(Feature, "smallest")
    spacing: Figure = key(Feature, "smallest gap for this foil")


BY_FOIL = re.compile("(coil_)?trace_(width|spacing)_([1-9][0-9]{0,2})um")


class RulesDocument(Section):
    """Design rules written out. A figure can also be `{value: 80 um, source: their page, status: unverified}`.

    They are in the spec or in a file. Omitted figures come from `based_on`.
    """

    name: str | None = key(
        Label, "name in documents; default the file's name, or the spec's rules with the profile they are based on",
        None,
    )
    based_on: str = key(
        ProfileName(or_none=True), "profile of all omitted figures; none: all figures are here", "generic-flex"
    )
    source: str = key(Label, "source of the figures", "the spec")
    trace_width: Written = key(Feature, "smallest, for any copper", None)
    trace_spacing: Written = key(Feature, "smallest, for any copper", None)
    tracks: list[TrackRowDocument] | None = key(
        ListOf(Part(TrackRowDocument)),
        "by the thickness of the copper: the whole table, like [{copper: 18 um, width: 80 um, spacing: 80 um}]", None,
    )
    via_drill: Written = key(Feature, "smallest finished hole", None)
    annular_ring: Written = key(Feature, "smallest copper ring around a hole, for any number of layers", None)
    annular_ring_4: Written = key(Feature, "smallest copper ring in boards of four or more copper layers", None)
    coil_trace_width: Written = key(Feature, "smallest width of coil (loop) lines", None)
    coil_trace_spacing: Written = key(Feature, "smallest gap of coil (loop) lines", None)
    coil_tracks: list[TrackRowDocument] | None = key(
        ListOf(Part(TrackRowDocument)), "of coil (loop) lines by the thickness of the copper", None
    )
    coil_rule_binding: Written = key(
        Sourced(Boolean()),
        "whether the coil lines are an error and not a warning; default true if they are written", None
    )
    hole_to_hole: Written = key(Feature, "smallest web between holes", None)
    drill_to_copper: Written = key(Feature, "hole's edge to foreign copper", None)
    copper_to_edge: Written = key(Feature, "copper to the outline", None)
    coverlay_web: Written = key(Feature, "smallest coverlay between openings", None)
    coverlay_opening_to_trace: Written = key(Feature, "opening's edge to a trace that stays covered", None)
    static_bend_1: Written = key(BendRatio, "bend radius over thickness, bent once: one copper layer", None)
    static_bend_2: Written = key(BendRatio, "two layers", None)
    static_bend_3: Written = key(BendRatio, "three layers and more", None)
    dynamic_bend_1: Written = key(BendRatio, "bend radius over thickness, bent in use: one copper layer", None)
    dynamic_bend_2: Written = key(BendRatio, "two layers", None)
    dynamic_bend_3: Written = key(BendRatio, "three layers and more", None)
    thickness_tolerance_1: Written = key(Tolerance, "plus and minus, of one copper layer", None)
    thickness_tolerance_2: Written = key(Tolerance, "two layers", None)
    thickness_tolerance_3: Written = key(Tolerance, "three layers and more", None)
    stiffened_tolerance_polyimide: Written = key(Tolerance, "plus and minus, with a stiffener of polyimide", None)
    stiffened_tolerance_fr4: Written = key(Tolerance, "plus and minus, with a stiffener of FR4", None)
    outline_tolerance: Written = key(Tolerance, "plus and minus", None)
    registration: Written = key(Tolerance, "layer to layer", None)
    coverlay_registration: Written = key(Tolerance, "coverlay to copper", None)
    inside_radius: Written = key(Feature, "smallest radius of an inner edge of the outline", None)
    coverlay_lap: Written = key(Feature, "overlap of the coverlay into the body, for a tail of fewer layers", None)
    hole_to_step: Written = key(Feature, "hole's edge to the body's end, if layers end there", None)
    finger_lap: Written = key(Feature, "length of a plug's fingers below the coverlay", None)
    pad_lap: Written = key(Feature, "overlap of the coverlay over the rims of solder pads", None)
    part_size: Written = key(Sides, "smallest part that is handled without a panel", None)
    panel_size: Written = key(Sides, "size up to which a panel is filled", None)
    largest_part: Written = key(Sides, "longest part or panel that is made by agreement", None)
    file_naming: Written = key(Sourced(Preset("file naming")), "naming scheme of files in the archive", None)
    layer_counts: Written = key(
        Sourced(Several(Number(1, 32, whole=True))),
        "numbers of copper layers on offer, like [1, 2, 4]; this and the next six keys are checked only if written",
        None,
    )
    foils: Written = key(Sourced(Several(Foil)), "copper foils on offer, like [18 um, 35 um]", None)
    cores: Written = key(
        Sourced(Several(UnitValue("length", "5 um", "1 mm"))), "thicknesses of polyimide between copper on offer", None
    )
    covers: Written = key(Sourced(Several(Choice(COVERS))), "covers of the copper on offer", None)
    stiffeners: Written = key(Sourced(Several(Choice(STIFFENERS))), "materials of stiffeners on offer; []: none", None)
    finishes: Written = key(Sourced(Several(Choice(FINISHES))), "finishes on offer", None)
    order_multiple: Written = key(
        Sourced(Number(1, 1000, whole=True)), "boards are sold in multiples of this number", None,
    )
    one_process: Written = key(
        Sourced(Boolean()), "whether all boards are made in the same way; other requests in the order documents become "
        "a list of questions in the order notes", None,
    )
    house: Written = key(Words, "name of the fabricator", None)
    country: Written = key(Words, "where the boards are made", None)
    purpose: Written = key(Words, "use of the profile", None)
    checked_on: Written = key(
        Sourced(Text(10, r"20[0-9]{2}-[0-1][0-9]-[0-3][0-9]", "a date like 2026-11-20")), "date on which the figures "
        "were read", None
    )
    by_foil: dict[str, Figure] = keys_like(
        BY_FOIL, "trace_width_18um", Feature,
        "width for one foil, together with the gap trace_spacing_18um (coil lines: coil_ before it). "
        "It replaces the row of the base profile",
    )


RulesChoice = NameOr(ProfileName(), Part(RulesDocument))
