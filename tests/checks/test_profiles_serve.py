"""Every installed profile can be ordered from: a coil that its figures allow has no fault at its contacts."""

from __future__ import annotations

from dataclasses import replace

import pytest

from sitscad.kernels.geometry.path import bounding_box
from sitscad.layout import lay_out
from sitscad.spec import presets
from sitscad.spec.load import load_text
from sitscad.spec.profiles import installed_rules

DRAWN = [f"SIT{number}" for number in (*range(107, 116), 119)]
ENDS = {
    "plug": "tail: {length: 20, connector: zif-0.5mm, layers: 2}",
    "pads on a tail": "tail: {length: 20, connector: solder-pads, layers: 2}",
    "pads at the outline": "",
}


def single(rules, layers, fpc, readout="", width=0.16):
    stackup = {2: "flex-2l-18um", 4: "flex-4l"}[layers]
    return load_text(
        "sitscad: 1\nname: served\n"
        f"coil: {{shape: circle, outer_diameter: 10, turns: 4, layers: {layers}, trace_width: {width}, "
        f"trace_spacing: {width}}}\nfpc: {{stackup: {stackup}, rules: {rules}{', ' * bool(fpc)}{fpc}}}\n{readout}\n",
        "served.yaml",
    )


def faults(judge, spec, layout):
    return [finding.message for rule in DRAWN for finding in judge(rule, spec, layout)]


@pytest.mark.parametrize("end", ENDS)
@pytest.mark.parametrize("rules", presets.names("rules"))
def test_coil_for_every_installed_profile_has_no_layout_finding(judge, rules, end):
    layers = 2 if rules != "rehan-4l" else 4
    spec = single(rules, layers, ENDS[end])
    layout = lay_out(spec)
    assert layout.shortfalls == () and faults(judge, spec, layout) == []


@pytest.mark.parametrize("readout", ["", "readout: {capacitors_on_board: chip-0603}"])
@pytest.mark.parametrize("distance", [0.1e-3, 0.3e-3, 0.9e-3])
def test_vias_and_capacitors_are_clear_of_coverlay_openings(judge, readout, distance):
    """However far the coverlay is wanted from what it covers; beside a plug's contacts its web is the connector's."""
    spec = single("generic-flex", 2, ENDS["plug"], readout)
    rules = replace(spec.fpc.rules, coverlay_opening_to_trace=distance, coverlay_web=max(0.2e-3, distance / 2))
    spec = replace(spec, fpc=replace(spec.fpc, rules=rules))
    layout = lay_out(spec)
    beside_edge = [f for f in judge("SIT114", spec, layout) if "web-to-edge" in f.cases]
    assert [message for message in faults(judge, spec, layout) if message not in {f.message for f in beside_edge}] == []
    via = max((via for via in layout.vias), key=lambda via: via.centre.x)
    first = min(x for region in layout.top_openings for x in (bounding_box([region.outline])[0],))
    assert first - (via.centre.x + via.pad / 2) >= distance - 1e-9


@pytest.mark.parametrize("rules", ["rehan-2l", "rehan-4l"])
@pytest.mark.parametrize("template", ["single_coil", "bench_7mm", "grasper_4layer"])
def test_template_with_wide_coverlay_openings_has_no_bare_via(judge, root, template, rules):
    spec = load_text((root / "templates" / f"{template}.yaml").read_text(encoding="utf-8"), f"{template}.yaml")
    spec = replace(spec, fpc=replace(spec.fpc, rules=installed_rules(rules)))
    assert judge("SIT115", spec, lay_out(spec)) == []
