"""The smallest gap of each copper layer, as drawn and as the order says it; leads as far apart as the turns."""

import json
from dataclasses import replace

import pytest
from tolerance import approx

import sitscad
from sitscad.files.documents import order_notes
from sitscad.files.formats import gerber as board
from sitscad.layout.gaps import smallest_gaps
from sitscad.layout.lanes import lead_spacings
from sitscad.spec import templates

UM = 1e-6

WITH_ROOM = ["fingertip_foil", "grasper_4layer", "robotic_jaw_12mm", "single_coil", "square_bench", "three_axis_grid"]
"""Templates whose boards have room for leads as far apart as the turns."""

CRAMPED = ["jaw_5x20", "round_button_12mm", "three_axis_pad"]
"""Templates whose leads come nearer to each other than the turns."""


def laid(name):
    return sitscad.lay_out(sitscad.load_text(templates.read(name), f"{name}.yaml"))


@pytest.mark.parametrize("name", WITH_ROOM)
def test_leads_with_room_have_spacing_of_turns(name):
    layout = laid(name)
    gaps = smallest_gaps(layout)
    assert set(gaps) == set(layout.spec.coil.layers)
    assert all(near.gap > layout.spec.coil.trace_spacing - 1 * UM for near in gaps.values())


def test_leads_without_room_use_minimum_spacing():
    layout = laid("jaw_5x20")
    gaps = [near.gap for near in smallest_gaps(layout).values()]
    assert not layout.shortfalls
    assert min(gaps) == approx(layout.spec.fpc.rules.trace_spacing, abs=1 * UM)


@pytest.mark.parametrize("name, share", [("round_button_12mm", 0.5), ("three_axis_pad", 0.5), ("fingertip_cell", 0.25)])
def test_leads_with_little_room_use_intermediate_spacing(name, share):
    layout = laid(name)
    wanted, least = layout.spec.coil.trace_spacing, layout.spec.fpc.rules.trace_spacing
    assert least + share * (wanted - least) in [approx(step, abs=1e-12) for step in lead_spacings(wanted, least)]
    gaps = [near.gap for near in smallest_gaps(layout).values()]
    assert min(gaps) == approx(least + share * (wanted - least), abs=1 * UM)


@pytest.mark.parametrize("name", [*CRAMPED, "grasper_4layer"])
def test_order_notes_and_job_file_state_smallest_gap_per_layer(name):
    layout = laid(name)
    gaps = smallest_gaps(layout)
    text = " ".join(order_notes.order_readme(layout).split())
    rows = [row for row in text.split("Smallest gap")[1:]]
    for number, near in gaps.items():
        assert any(f" {number} (x = " in row and f": {near.gap / UM:.3g} um between" in row for row in rows), number
    (job,) = (json.loads(data) for path, data in board.render_job(layout).items())
    outer = min(gaps[number].gap for number in (1, layout.copper_layers))
    assert job["DesignRules"][0]["TrackToTrack"] == approx(outer * 1e3, abs=1e-6)


def test_smallest_gap_of_moved_via_is_measured_on_its_copper():
    layout = laid("grasper_4layer")
    via = next(via for via in layout.vias if via.net == "C1" and via.centre.x < 0)
    near = min((trace for trace in layout.on_layer(1) if trace.net == "C2"), key=lambda t: t.path.distance(via.centre))
    foot = min((p for s in near.path for p in s.flattened(1e-7)), key=via.centre.distance)
    gap = via.centre.distance(foot) - near.width / 2 - via.pad / 2
    share = (gap - 40 * UM) / via.centre.distance(foot)
    moved = replace(via, centre=via.centre.shifted(share * (foot.x - via.centre.x), share * (foot.y - via.centre.y)))
    spoilt = replace(layout, vias=tuple(moved if each is via else each for each in layout.vias))
    expected = min(t.path.distance(v.centre) - t.width / 2 - v.pad / 2
                   for t in spoilt.on_layer(1) for v in spoilt.vias if v.net != t.net)
    assert expected < 41 * UM
    assert smallest_gaps(spoilt)[1].gap <= expected + 1e-9
