"""A target of magnetic metal that conducts well: states and response solve the same target."""

from __future__ import annotations

import numpy as np
import pytest

import sitscad
from sitscad.spec import templates

METALS = {"nickel": (14.3, 100.0), "mild steel": (6.0, 200.0), "430 steel": (1.67, 400.0)}


def _design(name: str, metal: str):
    conductivity, permeability = METALS[metal]
    made = f"{{name: metal, conductivity: {conductivity} MS/m, relative_permeability: {permeability}}}"
    return sitscad.Design(sitscad.load_text(templates.read(name).replace("material: copper", f"material: {made}")))


def _apart(design) -> np.ndarray:
    """Differences of the target's changes at rest between states and response, over both stated errors."""
    found = sitscad.respond(design, loads=[(0.0, 0.0, 0.0)])
    rest = [coil.states["rest"] for coil in design.estimates.coils]
    told, solved = np.array([state.target_change for state in rest]), np.diagonal(found.target_change[0])
    errors = np.array([state.target_change_error for state in rest]) + np.diagonal(found.target_change_error[0])
    least = 0.01 * np.array([coil.winding_inductance for coil in design.estimates.coils])
    return np.abs(told - solved) / (errors * np.maximum(np.minimum(np.abs(told), np.abs(solved)), least))


@pytest.mark.parametrize(("name", "metal"), [("bench_7mm", "nickel"), ("bench_7mm", "mild steel"),
                                             ("three_axis_pad", "430 steel")])
def test_states_and_response_agree_within_what_they_state(name, metal):
    """Shares served for the states of what took long to solve: of mild steel they said six times the change, of 430
    steel its other sign.
    """
    design = _design(name, metal)
    assert design.estimates.is_solved
    assert np.all(_apart(design) < 1.0)
