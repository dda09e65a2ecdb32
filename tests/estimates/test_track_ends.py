"""Wide ends of tracks in the resistance at the contacts; the copper as written is solved in tests/extraction."""

from __future__ import annotations

import pytest

import sitscad
from sitscad.estimates.track_ends import spared_squares
from sitscad.layout.board import Trace
from sitscad.physics.track_ends import pad_squares

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
    assert inner == pytest.approx(2.0 * pad, rel=1e-6)


def test_teardrops_lower_the_resistance_at_the_contacts_alone():
    plain, dropped = (sitscad.estimate(laid_out(2, kind)).coils[0] for kind in ("none", "auto"))
    assert laid_out(2, "auto").teardrops
    assert dropped.resistance_dc == plain.resistance_dc
    assert 0.97 < dropped.terminal_resistance_dc / plain.terminal_resistance_dc < 1.0
    assert dropped.terminal_inductance == pytest.approx(plain.terminal_inductance, rel=1e-9)
