"""The solids of every template: closed, apart from each other, and of the same envelope by figures and by meshes."""

from __future__ import annotations

from dataclasses import replace

import pytest
from envelope import envelope_radius
from solid_pairs import interferences
from tolerance import approx

from sitscad.assembly.places.fit import closed_section
from sitscad.assembly.solids import solids
from sitscad.layout import lay_out
from sitscad.spec.load import load
from sitscad.spec.mount import Assembly
from tests.oracles.envelope import closed_pair

pytestmark = pytest.mark.cad


def unglued(layout):
    """The same pieces laid on each other without glue, as the solids stand."""
    return replace(layout, spec=replace(layout.spec, assembly=Assembly(glue_line=0.0, glue_tolerance=0.0)))


@pytest.mark.few(2)
@pytest.mark.slow
def test_template_solids_fit_together(template):
    layout = unglued(lay_out(load(template)))
    built = solids(layout)
    assert all(solid.shape.is_valid for solid in built)
    pair, section = closed_pair(layout), closed_section(layout)
    assert interferences(pair or built) == ()
    assert (section is None) == (not pair)
    if section is not None:
        assert envelope_radius(pair) == approx(section.radius, rel=1e-4)
