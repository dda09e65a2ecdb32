"""Wide ends of tracks in the resistance at the contacts; the copper as written is solved in tests/extraction."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import pytest
from probe_spots import touched
from tolerance import approx

import sitscad
from sitscad.estimates.circuit.track_ends import spared_squares
from sitscad.layout.board import Role, Trace
from sitscad.physics.loss.resistance import bend_squares, pad_squares, step_squares

SPEC = """
sitscad: 1
name: ends
coil: {shape: octagon, outer_diameter: 3.7, turns: 1.875, layers: %d, trace_width: 0.12, trace_spacing: 0.1}
fpc: {rules: generic-flex, teardrops: %s}
"""


def laid_out(layers, teardrops):
    return sitscad.lay_out(sitscad.load_text(SPEC % (layers, teardrops), "ends.yaml"))


def squares(coil):
    return sum(item.path.length / item.width for item in coil.series if isinstance(item, Trace))


@pytest.mark.parametrize("layers", [1, 2, 6])
def test_every_end_spares_some_squares_and_no_track_vanishes(layers):
    layout = laid_out(layers, "none")
    spared = spared_squares(layout.coils[0], layout)
    assert set(spared) == {item.layer for item in layout.coils[0].series if isinstance(item, Trace)}
    assert all(value > 0.0 for value in spared.values())
    assert sum(spared.values()) < 0.1 * squares(layout.coils[0])


def test_a_layer_between_two_vias_spares_the_two_pads():
    layout = laid_out(6, "none")
    via, width = layout.vias[0], layout.spec.coil.trace_width
    pad = -pad_squares(via.pad / width, via.drill / width)
    inner = spared_squares(layout.coils[0], layout)[4]
    corners = inner - 2.0 * pad
    assert 0.0 < corners < 2.0 * -bend_squares(math.pi / 2), "where the stubs go over into the winding"


def test_teardrops_lower_the_resistance_at_the_contacts_alone():
    plain, dropped = (sitscad.estimate(laid_out(2, kind)).coils[0] for kind in ("none", "auto"))
    assert laid_out(2, "auto").teardrops
    assert dropped.resistance_dc == plain.resistance_dc
    assert 0.97 < dropped.terminal_resistance_dc / plain.terminal_resistance_dc < 1.0
    # at the terminals the inductance holds a millionth of what the leads' resistance does
    assert dropped.terminal_inductance == approx(plain.terminal_inductance, rel=1e-6)


WIDE = """
sitscad: 1
name: wide
coil: {shape: circle, outer_diameter: 5.4, turns: 1.5, layers: 2, trace_width: %s, trace_spacing: 0.3}
fpc: {rules: generic-flex, teardrops: none, tail: {length: 8, connector: zif-0.3mm}}
"""


def wide(width):
    return sitscad.lay_out(sitscad.load_text(WIDE % width, "wide.yaml"))


def test_a_neck_narrower_than_the_lead_begins_where_it_leaves_the_lead_s_round_end():
    """0.5 mm leads that went over into 0.1 mm necks, counted from middle to middle, came 3.8 % too high."""
    layout = wide(0.5)
    coil = layout.coils[0]
    tracks = [item for item in coil.series if isinstance(item, Trace) and item.layer == 2]
    lead, neck = next(pair for pair in pairwise(tracks) if pair[1].role is Role.TAIL)
    lanes = layout.spec.fpc.tail.connector.pitch
    assert (lead.width, neck.width) == approx((0.5e-3, lanes - layout.spec.fpc.rules.trace_spacing), rel=1e-6)
    alone = replace(coil, series=(lead, neck))
    assert spared_squares(alone, layout) == {2: approx(-step_squares(lead.width / neck.width), rel=1e-6)}


def test_a_neck_shorter_than_the_lead_is_wide_does_not_vanish():
    """Its way would end within the lead's round end: a tenth of it counts."""
    layout = wide(0.5)
    coil = layout.coils[0]
    lead, neck = next(
        pair
        for pair in pairwise([item for item in coil.series if isinstance(item, Trace) and item.layer == 2])
        if pair[1].role is Role.TAIL
    )
    broad = replace(coil, series=(replace(lead, width=30 * neck.path.length), neck))
    assert spared_squares(broad, layout) == {2: approx(0.9 * neck.path.length / neck.width, rel=1e-6)}


@pytest.mark.slow
@pytest.mark.needs("gerbonara", "gmsh", "scipy", "shapely")
@pytest.mark.parametrize(("width", "within"), [(0.5, 0.016), (0.1, 0.006)])
def test_wide_and_narrow_leads_have_the_resistance_of_their_copper(tmp_path, width, within):
    from sitscad.extraction.nets import extract
    from tests.oracles.copper_resistance import copper_resistance

    layout = wide(width)
    built = sitscad.build(layout.spec, tmp_path, ["gerber"], force=True)
    net = extract(built.directory).net("C1")
    start, end = (touched(contact) for contact in sorted(net.contacts, key=lambda contact: contact.function))
    stackup = layout.spec.fpc.stackup
    thickness, depths = zip(*((foil.thickness, foil.z) for foil in stackup.copper), strict=True)
    plating = stackup.plating_thickness
    found = copper_resistance(net, start, end, thickness, depths=depths, plating=plating, fineness=4.0)
    assert sitscad.estimate(layout, tolerance=1e-2).coils[0].terminal_resistance_dc == approx(found, rel=within)
