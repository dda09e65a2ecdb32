"""Resistance at the contacts against triangles over the copper as written: pads, teardrops, contacts and wide leads."""

from __future__ import annotations

from dataclasses import replace

import pytest
from probe_spots import touched
from tolerance import approx

import sitscad
from sitscad.estimates.states.steps import choose_readout, solve_windings
from sitscad.estimates.targets.finite_target import NO_RATIOS
from sitscad.estimates.windings.leads import LEAST_LEFT, estimate_leads
from sitscad.kernels.electromagnetics.loss.resistance import COPPER_CONDUCTIVITY
from sitscad.kernels.geometry.path import Line, Path, Point
from sitscad.layout.board import Role, Trace

OCTAGON = """
sitscad: 1
name: ends
coil: {shape: octagon, outer_diameter: 3.7, turns: 1.875, layers: %d, trace_width: 0.12, trace_spacing: 0.1}
fpc: {rules: generic-flex, teardrops: %s}
"""
CIRCLE = """
sitscad: 1
name: wide
coil: {shape: circle, outer_diameter: 5.4, turns: 1.5, layers: 2, trace_width: %s, trace_spacing: 0.3}
fpc: {rules: generic-flex, teardrops: none, tail: {length: 8, connector: zif-0.3mm}}
"""

# spec, and its resistance (ohm) by `solved_resistance`
BOARDS = {
    "one layer": (OCTAGON % (1, "none"), 0.167236),
    "two layers": (OCTAGON % (2, "none"), 0.280601),
    "teardrops": (OCTAGON % (2, "auto"), 0.279025),
    "six layers": (OCTAGON % (6, "auto"), 0.968408),
    "wide leads into narrow necks": (CIRCLE % 0.5, 0.0870690),
    "narrow leads": (CIRCLE % 0.1, 0.317049),
}


def laid_out(name):
    return sitscad.lay_out(sitscad.load_text(BOARDS[name][0], f"{name}.yaml"))


def solved_resistance(layout, folder):
    from sitscad.files.extraction.differences import extract
    from tests.oracles.copper_resistance import copper_resistance

    net = extract(sitscad.build(layout.spec, folder, ["gerber"], force=True).directory).net("C1")
    start, end = (touched(contact) for contact in sorted(net.contacts, key=lambda contact: contact.function))
    stackup = layout.spec.fpc.stackup
    thickness, depths = zip(*((foil.thickness, foil.z) for foil in stackup.copper), strict=True)
    plating = stackup.plating_thickness or None
    return copper_resistance(net, start, end, thickness, depths=depths, plating=plating, fineness=3.0)


@pytest.mark.parametrize("name", BOARDS)
def test_contact_resistance_of_short_coils_is_within_error_bound(name):
    circuit = choose_readout(solve_windings(laid_out(name), tolerance=1e-2), NO_RATIOS).circuits[0]
    leads, reference = circuit.leads, BOARDS[name][1]
    error = abs(circuit.resistance + leads.resistance - reference)
    assert error < leads.resistance_error * leads.resistance
    assert error < 0.015 * reference, "none of them has a tail longer than 8 mm or more than 6 turns"


def test_lead_error_bound_is_included_in_state_error():
    layout = laid_out("wide leads into narrow necks")
    leads = estimate_leads(layout.coils[0], layout.spec.fpc.stackup, COPPER_CONDUCTIVITY)
    assert leads.resistance_error > 0.15
    (free,) = sitscad.estimate(layout).coils[0].states.values()
    assert free.resistance_error > 0.08


def test_stub_shorter_than_its_ends_has_minimum_resistance():
    layout = laid_out("two layers")
    copper = layout.spec.fpc.stackup.copper[0]
    stub = Trace(net="C1", layer=1, width=0.2e-3, role=Role.STUB,
                 path=Path((Line(Point(0.0, 0.0), Point(0.1e-3, 0.0)),)))
    alone = replace(layout.coils[0], series=(stub,))
    whole = 0.5 / (COPPER_CONDUCTIVITY * copper.thickness)
    result = estimate_leads(alone, layout.spec.fpc.stackup, COPPER_CONDUCTIVITY)
    assert result.resistance == approx(LEAST_LEFT * whole, rel=1e-6, abs=0)


@pytest.mark.more
@pytest.mark.slow
@pytest.mark.needs("gerbonara", "gmsh", "scipy", "shapely")
@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.more if "layer" in n else ()) for n in BOARDS])
def test_copper_references_equal_recomputed_solution(name, tmp_path):
    assert solved_resistance(laid_out(name), tmp_path) == approx(BOARDS[name][1], rel=1e-4, abs=0)
