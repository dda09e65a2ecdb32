"""A fabricator's design rules as a user writes them: in the spec, or as a profile file beside it. The installed
profiles (`sitscad/data/fabricators`) are such files.
"""

from __future__ import annotations

import re

from sitscad.spec.format.kinds.figure import Figure, Sourced
from sitscad.spec.format.kinds.number import Number, Several, Truth
from sitscad.spec.format.kinds.preset import Preset, ProfileName
from sitscad.spec.format.kinds.quantity import Pair, Quantity
from sitscad.spec.format.kinds.word import Choice, Text
from sitscad.spec.format.section import ListOf, NameOr, Part, Section, key, keys_like

Label = Text(64)
Date = Text(10, r"20[0-9]{2}-[0-1][0-9]-[0-3][0-9]", "a date like 2026-11-20")
Feature = Sourced(Quantity("length", "5 um", "10 mm"))
Foil = Quantity("length", "1 um", "500 um")
Tolerance = Sourced(Quantity("length", "1 um", "1 mm"))
BendRatio = Sourced(Number(1, 1000))
COVERS = ("film", "solder-mask")
"""What covers the copper: a film bonded on with adhesive, or a mask that is printed."""
FINISHES = ("enig", "hard-gold", "immersion-tin", "immersion-silver", "osp")
STIFFENERS = ("polyimide", "fr4")

Words = Sourced(Text(100))
Sides = Sourced(Pair(Quantity("length", "1 mm", "1000 mm")))

Written = Figure | None


class TrackRowDocument(Section):
    """Smallest width and gap of tracks in copper foil up to one thickness, before plating."""

    copper: float = key(Foil, "the foil, like 9 um")
    width: Figure = key(Feature, "smallest")
    spacing: Figure = key(Feature, "the gap that goes with it")


BY_FOIL = re.compile("(coil_)?trace_(width|spacing)_([1-9][0-9]{0,2})um")


class RulesDocument(Section):
    """A fabricator's design rules written out, in the spec or in a file of their own; what is left out comes from
    `based_on`. Every figure may also be written `{value: 80 um, source: their page, status: unverified}`.
    """

    name: str = key(Label, "what to call them (a file: its name)", "written out")
    based_on: str = key(
        ProfileName(or_none=True), "where the rest comes from; none: every figure stands here", "generic-flex"
    )
    source: str = key(Label, "where the figures come from", "the spec")
    trace_width: Written = key(Feature, "smallest, whatever the copper", None)
    trace_spacing: Written = key(Feature, "smallest, whatever the copper", None)
    tracks: list[TrackRowDocument] | None = key(
        ListOf(Part(TrackRowDocument)), "by the thickness of the copper: the whole table, like "
        "[{copper: 18 um, width: 80 um, spacing: 80 um}]", None,
    )  # fmt: skip
    via_drill: Written = key(Feature, "smallest finished hole", None)
    annular_ring: Written = key(Feature, "smallest copper ring around a hole, whatever the number of layers", None)
    annular_ring_4: Written = key(Feature, "of a board of four copper layers and more, over that", None)
    coil_trace_width: Written = key(Feature, "smallest width of coil (loop) lines", None)
    coil_trace_spacing: Written = key(Feature, "smallest gap of coil (loop) lines", None)
    coil_tracks: list[TrackRowDocument] | None = key(
        ListOf(Part(TrackRowDocument)), "of coil (loop) lines by the thickness of the copper", None
    )
    coil_rule_binding: Written = key(
        Sourced(Truth()), "whether the coil lines are an error and not a warning; true where they are written", None
    )
    hole_to_hole: Written = key(Feature, "smallest web between holes", None)
    drill_to_copper: Written = key(Feature, "hole's edge to foreign copper", None)
    copper_to_edge: Written = key(Feature, "copper to the outline", None)
    coverlay_web: Written = key(Feature, "smallest coverlay between openings", None)
    coverlay_opening_to_trace: Written = key(Feature, "opening's edge to a trace that stays covered", None)
    static_bend_1: Written = key(BendRatio, "bend radius by thickness, bent once: one copper layer", None)
    static_bend_2: Written = key(BendRatio, "two layers", None)
    static_bend_3: Written = key(BendRatio, "three layers and more", None)
    dynamic_bend_1: Written = key(BendRatio, "the same, bent in use: one copper layer", None)
    dynamic_bend_2: Written = key(BendRatio, "two layers", None)
    dynamic_bend_3: Written = key(BendRatio, "three layers and more", None)
    thickness_tolerance_1: Written = key(Tolerance, "plus and minus, of one copper layer", None)
    thickness_tolerance_2: Written = key(Tolerance, "two layers", None)
    thickness_tolerance_3: Written = key(Tolerance, "three layers and more", None)
    stiffened_tolerance_polyimide: Written = key(Tolerance, "plus and minus, with a stiffener of polyimide", None)
    stiffened_tolerance_fr4: Written = key(Tolerance, "with one of FR4", None)
    outline_tolerance: Written = key(Tolerance, "plus and minus", None)
    registration: Written = key(Tolerance, "layer to layer", None)
    inside_radius: Written = key(Feature, "smallest radius of an inner edge of the outline", None)
    coverlay_lap: Written = key(Feature, "how far the coverlay of a tail of fewer layers laps into the body", None)
    hole_to_step: Written = key(Feature, "hole's edge to the body's end, where layers end there", None)
    finger_lap: Written = key(Feature, "how far a plug's fingers go on under the coverlay", None)
    pad_lap: Written = key(Feature, "how far the coverlay covers the rims of solder pads", None)
    part_size: Written = key(Sides, "smallest part that is handled singly", None)
    panel_size: Written = key(Sides, "what a panel is filled up to", None)
    file_naming: Written = key(Sourced(Preset("file naming")), "how files are called in the archive", None)
    layer_counts: Written = key(
        Sourced(Several(Number(1, 32, whole=True))), "how many copper layers they offer, like [1, 2, 4]; what of this "
        "and the next six is not written is not judged", None,
    )  # fmt: skip
    foils: Written = key(Sourced(Several(Foil)), "copper that they offer, like [18 um, 35 um]", None)
    cores: Written = key(
        Sourced(Several(Quantity("length", "5 um", "1 mm"))), "polyimide between copper that they offer", None
    )
    covers: Written = key(Sourced(Several(Choice(COVERS))), "what they cover the copper with", None)
    stiffeners: Written = key(Sourced(Several(Choice(STIFFENERS))), "what stiffeners are made of; []: none", None)
    finishes: Written = key(Sourced(Several(Choice(FINISHES))), "finishes that they offer", None)
    order_multiple: Written = key(Sourced(Number(1, 1000, whole=True)), "boards are sold in so many at a time", None)
    one_process: Written = key(
        Sourced(Truth()), "whether every board is made in one way: what else the papers would ask for becomes a list "
        "of questions in the order notes", None,
    )  # fmt: skip
    house: Written = key(Words, "who that is", None)
    country: Written = key(Words, "where the boards are made", None)
    checked_on: Written = key(Sourced(Date), "when that was read", None)
    by_foil: dict[str, Figure] = keys_like(
        BY_FOIL, "trace_width_18um", Feature,
        "width and gap for one foil alone, with trace_spacing_18um (coil lines: coil_ before it), a "
        "row over those of what it is based on",
    )  # fmt: skip


RulesChoice = NameOr(ProfileName(), Part(RulesDocument))
