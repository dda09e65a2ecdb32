"""Alternating current on the way from layout to estimate: shapes, temperature, plating, leads in pairs, tolerance."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from tolerance import approx

from sitscad.estimates import estimate
from sitscad.estimates.circuits.solved_winding import near_metal_error
from sitscad.estimates.windings.leads import estimate_leads
from sitscad.estimates.windings.losses import Strip, near_metal_notes, winding_losses, winding_resistance
from sitscad.estimates.windings.methods import bent_track, winding_geometry
from sitscad.kernels.electromagnetics.loss.bent_tracks import bent_winding_loss
from sitscad.kernels.electromagnetics.loss.corners import enclosing_tracks, with_mitred_arcs
from sitscad.kernels.electromagnetics.loss.proximity import LossResolution, winding_loss
from sitscad.kernels.electromagnetics.loss.resistance import bend_squares, conductivity_at
from sitscad.kernels.electromagnetics.loss.track_modes import ModeSet
from sitscad.kernels.geometry.path import Point, rounded_polyline
from sitscad.layout import lay_out
from sitscad.layout.board import Winding
from sitscad.spec.coil import CoilSpec
from sitscad.spec.load import load_text
from tests.oracles.losses import inductance_change

COPPER = 58e6
SPEC = """
sitscad: 1
name: losses
coil: {shape: SHAPE, outer_diameter: 5, turns: 6, layers: 2, trace_width: 100 um, trace_spacing: 100 um}
fpc: {stackup: flex-2l-35um, rules: generic-flex, tail: {length: 30, connector: zif-0.5mm, layers: 2, bend: static}}
"""


def laid_out(shape="circle"):
    return lay_out(load_text(SPEC.replace("SHAPE", shape), "test.yaml"))


def losses(layout, **how):
    coil = layout.coils[0]
    geometry = winding_geometry(layout.spec.coil, coil)
    return winding_losses(layout.spec.coil, coil, geometry.spirals, COPPER, **how)


def test_drawn_arcs_of_circle_have_loss_of_spirals():
    layout = laid_out()
    coil, modes = layout.coils[0], ModeSet(6, 2, (6, 2))
    drawn = bent_winding_loss([bent_track(w, 100e-6) for w in coil.windings], COPPER, modes, 2, 20)
    spirals = winding_geometry(layout.spec.coil, coil).spirals
    ideal = winding_loss(spirals, COPPER, resolution=LossResolution(modes, 12, 20))
    for frequency in (1e6, 10e6):
        assert drawn.resistance_ratio(frequency) == approx(ideal.resistance_ratio(frequency), rel=5e-3)


@pytest.mark.parametrize("shape", ["square", "hexagon", "octagon"])
def test_polygon_loss_at_usual_tolerance_agrees_with_fine_tolerance(shape):
    layout = laid_out(shape)
    usual, fine = losses(layout), losses(layout, tolerance=1e-3)
    for frequency in (1e5, 1e6, 10e6):
        assert usual.resistance_ratio(frequency) == approx(fine.resistance_ratio(frequency), rel=0.02)


def test_octagon_loss_is_close_to_circle_loss():
    at = {shape: losses(laid_out(shape)).resistance_ratio(10e6) for shape in ("square", "hexagon", "octagon", "circle")}
    assert abs(at["octagon"] / at["circle"] - 1.0) < 0.08
    assert at["square"] != approx(at["circle"], rel=0.02)


def test_direct_current_resistance_includes_corner_squares():
    layout = laid_out("square")
    coil, spec = layout.coils[0], layout.spec.coil
    length = sum(w.path.length for w in coil.windings)
    corners = sum(len(w.path.segments) - 1 for w in coil.windings)
    thickness = coil.windings[0].thickness
    expected = (length + corners * bend_squares(math.pi / 2) * 100e-6) / (COPPER * 100e-6 * thickness)
    assert winding_resistance(spec, coil, COPPER) == approx(expected, rel=1e-6)


def test_warm_copper_has_higher_resistance_and_less_crowding():
    layout = laid_out()
    cold, warm = estimate(layout), estimate(layout, temperature=60.0)
    factor = 1.0 + 3.93e-3 * 40.0
    assert conductivity_at(60.0) == approx(COPPER / factor, rel=1e-6)
    for before, after in zip(cold.coils, warm.coils, strict=True):
        assert after.terminal_resistance_dc == approx(before.terminal_resistance_dc * factor, rel=1e-9)
        ratio = after.resistance_ac / before.resistance_ac
        assert 1.0 < ratio < factor
    with pytest.raises(ValueError, match="out of range"):
        conductivity_at(-300.0)


def test_spec_temperature_changes_copper_and_target_metal():
    text = """sitscad: 1
name: warm
coil: {shape: circle, outer_diameter: 6, turns: 8, layers: 2, trace_width: 100 um, trace_spacing: 100 um}
target: {size: 8, thickness: 0.02, material: copper}
elastomer: {size: 8, thickness: 1, material: ecoflex-00-30}
"""
    cold = estimate(lay_out(load_text(text)))
    warm = estimate(lay_out(load_text(text + "requirements: {temperature: 37 degC}\n")))
    factor = 1.0 + 3.93e-3 * 17.0
    assert (cold.temperature, warm.temperature) == (20.0, 37.0)
    assert warm.coils[0].resistance_dc == approx(cold.coils[0].resistance_dc * factor, rel=1e-9)
    # a thin sheet that is warm holds less of the field back
    assert warm.coils[0].states["rest"].inductance > cold.coils[0].states["rest"].inductance
    assert warm.coils[0].states["free"].inductance == approx(cold.coils[0].states["free"].inductance, rel=1e-3)


def test_thicker_plating_lowers_via_resistance():
    layout = laid_out()
    stackup = layout.spec.fpc.stackup
    thin, thick = (
        estimate_leads(layout.coils[0], replace(stackup, plating_thickness=t), COPPER).via_resistance
        for t in (8e-6, 20e-6)
    )
    assert thick < 0.6 * thin


def test_paired_tail_leads_carry_most_lead_resistance():
    leads = estimate_leads(laid_out().coils[0], laid_out().spec.fpc.stackup, COPPER)
    paired = [strip for strip in leads.strips if strip.beside]
    assert sum(s.resistance for s in paired) > 0.5 * sum(s.resistance for s in leads.strips)
    assert sum(s.resistance for s in leads.strips) + leads.via_resistance == approx(leads.resistance, rel=1e-6)
    for strip in paired:
        assert resistance_at(strip, 1e3) == approx(strip.resistance, rel=1e-5)
        # above each other they draw the current to the facing sides and away from the edges: no worse than alone
        alone = resistance_at(Strip(strip.resistance, strip.width, strip.thickness), 10e6)
        assert resistance_at(strip, 10e6) == approx(alone, rel=0.1)
    frequencies = np.array([1e3, 10e6])
    expected = [sum(resistance_at(strip, f) for strip in leads.strips) + leads.via_resistance for f in frequencies]
    assert leads.resistances_at(frequencies, COPPER) == approx(expected, rel=1e-12)


def resistance_at(strip, frequency):
    loss = strip.loss(COPPER)
    return loss.direct * loss.resistance_ratio(frequency)


def test_polygon_near_metal_note_depends_on_distance():
    """A square coil's crowding near metal is that of a round one: said where it matters, with what it was measured."""
    square, circle = (laid_out(shape).spec.coil for shape in ("square", "circle"))
    width = square.trace_width
    assert near_metal_notes(circle, 0.1 * width) == near_metal_notes(square, None) == ()
    assert near_metal_notes(square, 2.1 * width) == ()
    near, further = near_metal_notes(square, 0.4 * width)[0], near_metal_notes(square, 1.5 * width)[0]
    assert "R within 2 %" in near and "R within 1 %" in further
    mounted = load_text(SPEC.replace("SHAPE", "square") + "mount: {standoff: 0.05}\n", "near.yaml")
    assert any("round coil of equal length" in note for note in estimate(lay_out(mounted)).notes)


@pytest.mark.parametrize("radius", [0.02, 0.05, 0.06, 0.1])
def test_corner_radius_below_track_width_gives_sharp_corner_values(radius):
    """A radius of half a track and less gave no resistance: an arc cannot be tighter than its inner edge."""
    rounded = SPEC.replace("SHAPE", "square").replace("trace_width: 100", f"corner_radius: {radius}, trace_width: 100")
    sharp = estimate(laid_out("square")).coils[0]
    result = estimate(lay_out(load_text(rounded, "test.yaml"))).coils[0]
    assert result.resistance_ac == approx(sharp.resistance_ac, rel=0.02)
    assert result.terminal_inductance == approx(sharp.terminal_inductance, rel=0.01)
    whole = [coil.winding_inductance + coil.bend_inductance for coil in (result, sharp)]
    assert whole[0] == approx(whole[1], rel=5e-3)


@pytest.mark.parametrize(
    "coil",
    [
        "{shape: octagon, outer_diameter: 5, turns: 3, corner_radius: 0.8, LINES}",
        "{shape: square, outer_diameter: 5, turns: 3, corner_radius: 1, LINES}",
        "{shape: hexagon, outer_diameter: 5, turns: 3, corner_radius: 1, LINES}",
        "{shape: racetrack, outer_diameter: [9, 6], turns: 3, LINES}",
    ],
)
def test_coil_rotation_does_not_change_loss(coil):
    """No part of a round corner counts as abreast of the next one's, however the coil is turned."""
    coil = coil.replace("LINES", "layers: 1, trace_width: 200 um, trace_spacing: 200 um")
    result = []
    for turned in (0, 10, 20, 22.5, 45):
        array = f"{{pattern: explicit, centres: [[0, 0]], rotations: [{turned} deg]}}"
        layout = lay_out(load_text(f"sitscad: 1\nname: turned\ncoil: {coil}\narray: {array}", "test.yaml"))
        loss = losses(layout)
        result.append([(loss.resistance_ratio(f), inductance_change(loss, f)) for f in (1e6, 1e7)])
    assert np.array(result) == approx(np.array(result[:1] * 5), rel=1e-6)
    assert result[0][1][0] < 1.6


def test_slightly_rounded_octagon_has_loss_of_sharp_octagon():
    """Once 19.7 ohm at 10 MHz instead of 5.3: parts of neighbouring corners counted as abreast."""
    ratios = []
    for radius in (0.0, 0.1, 0.5, 1.5):
        spec = SPEC.replace("SHAPE", f"octagon, corner_radius: {radius}").replace(
            "outer_diameter: 5", "outer_diameter: 7"
        )
        ratios.append(losses(lay_out(load_text(spec, "test.yaml"))).resistance_ratio(1e7))
    assert np.array(ratios) == approx(ratios[0], rel=0.06)


@pytest.mark.parametrize("radius", [0.0005, 0.01, 0.049])
def test_tiny_corner_radius_gives_inductance_of_sharp_corners(radius):
    """The copper is the same: no other method is taken for it, nor another stated error."""
    sharp, rounded = (
        estimate(lay_out(load_text(SPEC.replace("SHAPE", shape), "test.yaml"))).coils[0].winding_inductance
        for shape in ("square", f"square, corner_radius: {radius}")
    )
    assert rounded == approx(sharp, rel=1e-14, abs=0)


ROUNDED = """
sitscad: 1
name: rounded
coil: {{shape: {0}, outer_diameter: 8, turns: {1}, layers: 2, trace_width: 0.3, trace_spacing: 0.1, corner_radius: {2},
       sense: {3}}}
"""


def rounded_coil(shape, turns, radius, sense="counter-clockwise"):
    return losses(lay_out(load_text(ROUNDED.format(shape, turns, radius, sense), "test.yaml")))


@pytest.mark.parametrize("turns", [4.5, 5])
def test_rounded_coil_has_loss_of_its_mirror_image(turns):
    """Half of the sides once stood for all: 1.41 ohm, and 1.55 ohm for the same coil wound clockwise."""
    found = [rounded_coil("square", turns, 1, sense) for sense in ("counter-clockwise", "clockwise")]
    resistance = [loss.direct * loss.resistance_ratio(9e6) for loss in found]
    assert resistance[0] == approx(resistance[1], rel=1e-6)
    assert [inductance_change(loss, 9e6) for loss in found] == approx([inductance_change(found[0], 9e6)] * 2, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("shape", ["square", "hexagon", "octagon"])
def test_loss_changes_continuously_with_corner_radius(shape):
    """At 0.7 track widths R once jumped by a tenth, or had no number at all."""
    result = [rounded_coil(shape, 5, radius) for radius in (0.15, 0.209, 0.211, 0.3, 0.389, 0.391, 1.0)]
    assert all(loss.is_resolved(1e7) for loss in result)
    resistance = np.array([loss.direct * loss.resistance_ratio(9e6) for loss in result])
    assert np.all(np.diff(resistance) < 3e-3 * resistance[0])
    inductance = np.array([inductance_change(loss, 9e6) for loss in result])
    for before, after in ((1, 2), (4, 5)):  # where one model passes into the other
        assert resistance[after] == approx(resistance[before], rel=1e-3)
        assert inductance[after] == approx(inductance[before], rel=2e-3)


def test_too_short_sides_are_treated_as_corners():
    """Arcs of 0.3 mm between sides of 0.1 mm: wider ones have no place, so they count as corners."""
    side, radius, width = 0.7e-3, 0.3e-3, 0.3e-3
    corners = [Point(0, 0), Point(side, 0), Point(side, side), Point(0, side), Point(0, 3e-3)]
    path = rounded_polyline(corners, radius)
    winding = Winding(1, 0.0, 18e-6, 0.0, 1, True, path)
    track = bent_track(winding, width)
    share, cornered, wide = enclosing_tracks([track])
    assert share == 0.0 and cornered == wide and not np.any(with_mitred_arcs(cornered[0]).turns)
    assert enclosing_tracks([with_mitred_arcs(track)])[0] == 0.0


@pytest.mark.parametrize("radius", [0.5, 1.0, 1.5])
def test_short_side_between_arcs_gives_expected_inductance(radius):
    """The octagon's inductance was not a number: a strand ran inside an arc's centre."""
    coil = "{shape: octagon, outer_diameter: 5, turns: 1.75, trace_width: 0.8, trace_spacing: 0.3, corner_radius: R}"
    coil = coil.replace("R}", f"{radius}}}")
    text = f"sitscad: 1\nname: short\ncoil: {coil}\nfpc: {{stackup: flex-2l-18um}}"
    result = estimate(lay_out(load_text(text, "test.yaml"))).coils[0]
    assert result.winding_inductance == approx(10.35e-9, rel=0.01) and 0.03 < result.resistance_ac < 0.06


@pytest.mark.parametrize("shape", ["circle", "square"])
def test_near_metal_error_changes_continuously_with_distance(shape):
    """A target of a little more or less size moved the pad under it past 0.2 mm, and the stated error by a quarter."""
    spec = CoilSpec(shape, (10e-3, 10e-3), 10.0, layers=(1, 2), trace_width=0.2e-3, trace_spacing=0.2e-3)
    gaps = [0.02e-3 * 1.005**k for k in range(1000)]
    errors = [near_metal_error(spec, gap) for gap in gaps]
    assert all(0.0 <= before - after < 1e-3 for before, after in pairwise(errors))
    assert errors[-1] == approx(0.03, rel=1e-6)
    assert errors[0] == approx(0.04 if shape == "circle" else 0.06, rel=1e-6)
    assert near_metal_error(spec, 0.2e-3) >= 0.04
