"""Tracks wider than a via's pad: their round ends, not the pad, keep the distance where they meet outside a coil."""

import pytest
from tolerance import approx

from sitscad.layout import lay_out
from sitscad.layout.clearance import hole_keep_out, joined_hole
from sitscad.spec.profiles import installed_rules

from .test_layout import assert_sound


@pytest.mark.parametrize("layers", [3, 4])
@pytest.mark.parametrize("width", [0.4e-3, 0.5e-3, 0.8e-3])
@pytest.mark.parametrize("shape", ["square", "hexagon", "circle"])
def test_leads_wider_than_via_pad_keep_coil_clearance(sensor, shape, width, layers):
    turns = {"square": 3, "hexagon": 2, "circle": 1.75}[shape]
    spacing = 0.11e-3 if shape == "circle" else 0.1e-3  # on a steep spiral turns lie nearer than the spec's spacing
    layout = lay_out(
        sensor(shape=shape, diameter=10e-3, turns=turns, layers=layers, width=width, spacing=spacing, coils=1,
               rules="generic-flex", tail=False)
    )
    assert_sound(layout)
    outside = [via for via in layout.vias if max(map(abs, via.centre)) > 4.5e-3]
    assert outside and all(via.pad == layout.spec.fpc.rules.via_pad for via in outside)


def test_wide_tracks_in_array_pass_design_rules(sensor):
    assert_sound(
        lay_out(
            sensor(shape="circle", diameter=8e-3, turns=1.5, layers=4, width=0.5e-3, spacing=0.15e-3, coils=3,
                   pitch=12e-3, rules="generic-flex", tail=False)
        )
    )


def test_via_pad_of_joined_tracks_is_larger_of_pad_and_track_width():
    rules = installed_rules("generic-flex")
    assert joined_hole(rules, 0.5 * rules.via_pad).pad == rules.via_pad
    wide = joined_hole(rules, 3.0 * rules.via_pad)
    assert wide.pad == 3.0 * rules.via_pad and wide.drill == rules.via_drill
    assert hole_keep_out(wide, rules, 1e-4) == approx(1.5 * rules.via_pad + 1e-4, rel=1e-6)
