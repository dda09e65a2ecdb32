"""A fabricator's design rules as a user writes them: in the spec, or as a profile file beside it. The keys are those of
the installed profiles (`sitscad/data/fabricators`).
"""

from __future__ import annotations

from sitscad.spec.format.kinds import Figure, Number, Pair, Preset, ProfileName, Quantity, Sourced, Text, Truth
from sitscad.spec.format.section import NameOr, Part, Section, key

Label = Text(64)
Date = Text(10, r"20[0-9]{2}-[0-1][0-9]-[0-3][0-9]", "a date like 2026-11-20")
Feature = Sourced(Quantity("length", "5 um", "10 mm"))
Tolerance = Sourced(Quantity("length", "1 um", "1 mm"))
BendRatio = Sourced(Number(1, 1000))
Sides = Sourced(Pair(Quantity("length", "1 mm", "1000 mm")))

Written = Figure | None


class RulesDocument(Section):
    """A fabricator's design rules written out, in the spec or in a file of their own; what is left out comes from
    `based_on`. Every figure may also be written `{value: 80 um, source: their page, status: unverified}`.
    """

    name: str = key(Label, "what to call them (a file: its name)", "written out")
    based_on: str = key(ProfileName(), "where the rest comes from", "generic-flex")
    source: str = key(Label, "where the figures come from", "the spec")
    trace_width: Written = key(Feature, "smallest, whatever the copper", None)
    trace_spacing: Written = key(Feature, "smallest, whatever the copper", None)
    via_drill: Written = key(Feature, "smallest finished hole", None)
    annular_ring: Written = key(Feature, "smallest copper ring around a hole", None)
    coil_trace_width: Written = key(Feature, "smallest width of coil (loop) lines", None)
    coil_trace_spacing: Written = key(Feature, "smallest gap of coil (loop) lines", None)
    coil_rule_binding: bool | None = key(
        Truth(), "whether the coil lines are an error and not a warning; true where they are written", None
    )
    hole_to_hole: Written = key(Feature, "smallest web between holes", None)
    drill_to_copper: Written = key(Feature, "hole's edge to foreign copper", None)
    copper_to_edge: Written = key(Feature, "copper to the outline", None)
    coverlay_web: Written = key(Feature, "smallest coverlay between openings", None)
    coverlay_opening_to_trace: Written = key(Feature, "opening's edge to a trace that stays covered", None)
    trace_width_12um: Written = key(Feature, "smallest in copper of up to 12 um; so the others", None)
    trace_spacing_12um: Written = key(Feature, "the gap that goes with it", None)
    trace_width_18um: Written = key(Feature, "in copper of up to 18 um", None)
    trace_spacing_18um: Written = key(Feature, "in copper of up to 18 um", None)
    trace_width_35um: Written = key(Feature, "in copper of up to 35 um", None)
    trace_spacing_35um: Written = key(Feature, "in copper of up to 35 um", None)
    trace_width_70um: Written = key(Feature, "in copper of up to 70 um", None)
    trace_spacing_70um: Written = key(Feature, "in copper of up to 70 um", None)
    coil_trace_width_12um: Written = key(Feature, "smallest of coil lines in copper of up to 12 um", None)
    coil_trace_spacing_12um: Written = key(Feature, "the gap that goes with it", None)
    coil_trace_width_18um: Written = key(Feature, "in copper of up to 18 um", None)
    coil_trace_spacing_18um: Written = key(Feature, "in copper of up to 18 um", None)
    coil_trace_width_35um: Written = key(Feature, "in copper of up to 35 um", None)
    coil_trace_spacing_35um: Written = key(Feature, "in copper of up to 35 um", None)
    coil_trace_width_70um: Written = key(Feature, "in copper of up to 70 um", None)
    coil_trace_spacing_70um: Written = key(Feature, "in copper of up to 70 um", None)
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
    file_naming: str | None = key(Preset("file naming"), "how files are called in the archive", None)
    checked_on: str | None = key(Date, "when that was read", None)


RulesChoice = NameOr(ProfileName(), Part(RulesDocument))
