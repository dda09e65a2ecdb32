"""What target and jaw add to a winding's own capacitance is left out of the numbers: less than that is good to."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tolerance import approx

pytest.importorskip("scipy", reason="scipy is not installed")

from charged_rings import capacitance

import sitscad
from sitscad.estimates import estimate
from sitscad.estimates.windings.own_capacitance import (
    FILLING,
    PLACES,
    USUAL_PERMITTIVITY,
    _turn_places,
    _voltages,
    capacitance_to_metal,
)
from sitscad.layout import lay_out
from sitscad.spec.load import load, load_text

NEAR = """
sitscad: 1
name: near
coil: {shape: circle, outer_diameter: 14, turns: 20, layers: LAYERS, trace_width: 150 um, trace_spacing: 150 um}
fpc: {tail: {length: 20, connector: zif-0.5mm, layers: 2}}
target: {shape: square, size: 14, thickness: 0.2, material: copper}
elastomer: {material: dragon-skin-30, shape: square, size: 14, thickness: 0.2}
readout: {capacitance: 330 pF}
"""


def turns(coil, spec):
    """Radii, heights and voltages of a round coil's turns."""
    voltages = _voltages(*_turn_places(coil, spec.coil, PLACES), coil, spec.coil)
    radii, heights, values = [], [], []
    for k, (winding, count) in enumerate(zip(coil.windings, spec.coil.layer_turns, strict=True)):
        whole = math.floor(count)
        mean = winding.path.length / (2.0 * math.pi * count)
        places = (np.arange(whole) + 0.5) * count / whole
        radii.append(mean + spec.coil.pitch * (0.5 * count - places))
        heights.append(np.full(whole, winding.z))
        at = (np.arange(voltages.shape[1]) + 0.5) / voltages.shape[1]
        values.append(np.interp(places / count, at, voltages[k]))
    return np.concatenate(radii), np.concatenate(heights), np.concatenate(values)


def added(spec, gap, behind, cells=4):
    """What metal adds, by the rings."""
    coil = lay_out(spec).coils[0]
    winding = (*turns(coil, spec), spec.coil.trace_width, FILLING)
    target = (math.sqrt(spec.target.size[0] * spec.target.size[1] / math.pi), gap) if gap is not None else None
    plane = -(spec.fpc.stackup.thickness + behind) if behind is not None else None
    return capacitance(*winding, target, plane, cells) - capacitance(*winding, None, None, cells)


@pytest.mark.few(1)
@pytest.mark.parametrize("name", ["bench_7mm", "grasper_4layer", "grasper_3p5mm"])
def test_capacitance_to_metal_is_below_error_of_own_capacitance(name, root):
    spec = load(root / "templates" / f"{name}.yaml")
    layout = lay_out(spec)
    result = estimate(layout)
    gap, behind = result.gaps["pressed"], result.gaps.get("behind_the_board")
    by_rings, most = added(spec, gap, behind), capacitance_to_metal(
        layout.coils[0], spec.coil, spec.fpc.stackup.thickness, gap, behind)
    assert 0.0 < by_rings < most < 0.1 * result.coils[0].self_capacitance
    assert by_rings < 2e-4 * result.coils[0].capacitance
    # and pressing changes it by less than a hundred-thousandth of the tank's
    assert abs(by_rings - added(spec, result.gaps["rest"], behind)) < 1e-5 * result.coils[0].capacitance
    assert not any("capacitance from the winding" in note for note in result.notes)


@pytest.mark.parametrize(("layers", "is_told"), [(1, True), (2, False)])
def test_large_capacitance_to_target_yields_note(layers, is_told):
    """Two layers have so much capacitance of their own that what the target adds is within its tenth."""
    spec = load_text(NEAR.replace("LAYERS", str(layers)), "near.yaml")
    layout = lay_out(spec)
    result = estimate(layout)
    by_rings, most = added(spec, 0.2e-3, None), capacitance_to_metal(
        layout.coils[0], spec.coil, spec.fpc.stackup.thickness, 0.2e-3, None)
    assert 0.1 * most < by_rings < most
    assert (by_rings > 0.1 * result.coils[0].self_capacitance) == is_told
    assert any("capacitance from the winding" in note for note in result.notes) == is_told


@pytest.mark.slow
def test_charged_ring_capacitance_has_converged():
    spec = load_text(NEAR.replace("LAYERS", "1"), "near.yaml")
    coarse, fine = (added(spec, 0.2e-3, 0.5e-3, cells) for cells in (3, 6))
    assert coarse == approx(fine, rel=0.02)


def test_ring_over_plane_agrees_with_strip_capacitance():
    """Turns of large radius: the capacitance a length of a strip over a plane is twice that to its image."""
    radius, width, height = 0.2, 1e-4, 5e-5
    turn = np.array([radius]), np.array([height]), np.array([1.0])
    result = capacitance(*turn, width, 1.0, None, 0.0, cells=24) / (2.0 * math.pi * radius)
    from sitscad.kernels.electromagnetics.capacitance import stacked_strips

    assert result == approx(2.0 * stacked_strips(width, 2.0 * height, 1.0), rel=0.01)


SHIFTS = np.array([-0.375, -0.125, 0.125, 0.375])
"""Shifts between the turns of two layers, of a pitch: where spirals of opposite slope cross, all shifts occur."""


def by_rings(spiral: sitscad.Spiral, cells: int = 12) -> float:
    """Capacitance (F) of a round coil, two rings of charge a turn: on the upper and on the lower face of its track."""
    spec, coil = spiral.layout.spec, spiral.layout.coils[0]
    radii, heights, voltages = turns(coil, spec)
    half, layer = 0.5 * coil.windings[0].thickness, np.unique(np.round(heights, 9), return_inverse=True)[1]
    result = []
    for shift in SHIFTS * spec.coil.pitch:
        seen = voltages.copy()
        moved = radii + np.where(layer % 2 == 1, shift, 0.0)
        for each in np.unique(layer):
            own = np.flatnonzero(layer == each)
            order = own[np.argsort(radii[own])]
            seen[own] = np.interp(moved[own], radii[order], voltages[order])
        result.append(capacitance(np.tile(moved, 2), np.concatenate([heights - half, heights + half]),
                                 np.tile(seen, 2), spec.coil.trace_width, USUAL_PERMITTIVITY, None, None, cells))
    return float(np.mean(result))


@pytest.mark.few(3)
@pytest.mark.parametrize(
    ("layers", "diameter", "turns_a_layer", "width", "spacing", "distance"),
    [(2, 7, 9, 75, 160, 50), (2, 10, 17, 75, 160, 25), (4, 7, 5, 100, 160, 100), (4, 10, 5, 100, 300, 25),
     (2, 4, 2, 100, 300, 100), (3, 16, 28, 75, 160, 25), (4, 25, 29, 75, 100, 50)],
)
def test_own_capacitance_is_within_stated_error_of_rings(layers, diameter, turns_a_layer, width, spacing, distance):
    """Two millimetres of polyimide on both faces stand for the one dielectric of the rings."""
    between = [{"dielectric": f"{distance} um", "material": "polyimide"}, {"copper": "18 um"}] * (layers - 1)
    spiral = sitscad.coil(
        outer_diameter=f"{diameter} mm", turns=turns_a_layer, layers=layers, trace_width=f"{width} um",
        trace_spacing=f"{spacing} um",
        stackup=[{"coverlay": "2 mm"}, {"copper": "18 um"}, *between, {"coverlay": "2 mm"}],
    )
    assert by_rings(spiral) == approx(spiral.capacitance, rel=spiral.capacitance_error, abs=0)
