"""Preparations of an assembly: tools that its steps name, and how long its steps wait."""

from __future__ import annotations

import re

from sitscad.layout.board import Layout
from sitscad.papers.gluing import board_assembly, duration
from sitscad.spec import presets

TOOLS = (
    ("microscope", "microscope with a scale"), ("gloves", "gloves"), ("isopropanol", "isopropanol"),
    ("caliper", "caliper"), ("dial gauge (on|there)", "dial gauge on a stand, and a flat plate"),
    ("dial gauge of at most", "light dial gauge"), ("cover glass", "cover glasses"),
    ("micrometer", "micrometer (not on silicone)"), ("feeler gauge", "feeler gauges"),
    ("film that no glue holds", "polyethylene or PTFE film"), ("waxed strips", "two straight strips, block, clamps"),
    ("clamp what|fix (the|your) mount", "vice or clamps"), ("kitchen scale", "kitchen scale"),
    ("flat stick", "flat stick"), ("stiff plate", "flat stiff plate and weight"),
    ("abrasive film", "abrasive film on glass"),
    ("mould release", "wax or mould release"), ("mix ", "balance, cups and stirrers"),
    ("vacuum|take the air out", "vacuum chamber"), ("1 kg[);]|with 1 kg", "weight of 1 kg"),
    ("blunt plastic tip", "blunt plastic tip"), ("cure it fully under uv", "UV lamp and oven"),
    ("acrylic lacquer", "clear acrylic lacquer"), ("petroleum jelly", "petroleum jelly"),
    ("m8 washers", "M8 washers"), ("round bar of steel", "round steel bars with a hole"),
    ("flat-ended rod", "flat-ended rod"), ("lay a rod", "rod to bend over"), ("a blade|thin blade", "thin blade"),
    (r"with a file|file their nubs", "file"), ("polyimide tape", "polyimide tape"), ("brushed on", "brush"),
    ("zero the meter", "meter for inductance and resistance"), ("read by the converter", "converter with firmware/"),
    ("ring gauge", "ring gauge"), ("tap both holes", "tap for the cap's screws"),
    (r"screw (the mount|mount-)|set screws", "key for the screws"),
    ("mill the dovetail", "mill with a dovetail cutter"), ("drill two holes", "drill"),
    ("solder wires", "soldering iron"),
)
"""Tools, each by the words of the steps that name it."""


def tools(steps: str) -> str:
    """List all tools that the steps name; a whole sentence."""
    page = re.sub(r"\s+", " ", steps).lower()
    return f"Tools: {', '.join(tool for words, tool in TOOLS if re.search(words, page))}."


def waits(layout: Layout) -> str:
    """List the longest waits: for a cast pad, for glue, for the film; empty if there are none."""
    spec, found = layout.spec, list[str]()
    if spec.elastomer is not None:
        found.append(f"a cast pad {_cure(spec.elastomer.material.name)}")
    glues = {glue.product: glue.cure_time for glue in (spec.assembly.adhesive, board_assembly(layout).adhesive) if glue}
    found += [f"{name} {duration(time)} to full strength" for name, time in glues.items() if time]
    if spec.encapsulation is not None:
        found.append(f"the film {_cure(spec.encapsulation.material.name)}")
    return f"Longest waits: {'; '.join(found)}." if found else ""


def _cure(material: str) -> str:
    """How long a silicone cures, in words."""
    known = presets.casting(material)
    if known is None or not known.cure_time:
        return f"as its maker's sheet says ({material})"
    return f"{duration(known.cure_time)} ({material})"
