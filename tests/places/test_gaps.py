"""What the coils see is the glued assembly: every line between board and metal takes the metal farther away."""

import pytest
from tolerance import approx

from sitscad import load_text
from sitscad.assembly.places.bodies import metal_face, room_behind, shield_span, target_gap
from sitscad.assembly.places.column import column, levels
from sitscad.estimates.design import Design

TEXT = """
sitscad: 1
name: glued
coil: {shape: circle, outer_diameter: 4, turns: 7.75, layers: 4, trace_width: 80 um, trace_spacing: 80 um}
array: {pattern: line, count: 2, pitch: 4.5}
fpc: {stackup: flex-4l, rules: generic-fine}
target: {shape: rectangle, size: [4.5, 4.1], thickness: 0.15}
elastomer: {shape: rectangle, size: [4.5, 4.1], thickness: 0.65}
mount: {kind: grasper-pad, jaw: generic-5mm, standoff: STANDOFF}
SHIELD
assembly: {glue_line: 40 um, glue_tolerance: 20 um}
"""
SHIELD = "shield: {material: copper, thickness: 0.1, gap: GAP}"


NEAR = SHIELD.replace("GAP", "0.6")


def design(standoff="1.2", shield=NEAR):
    return Design(load_text(TEXT.replace("STANDOFF", standoff).replace("SHIELD", shield), "glued.yaml"))


@pytest.mark.parametrize(
    ("standoff", "shield"),
    [("1.2", NEAR), ("0.7", NEAR), ("0.7", ""), ("0", "")],
)
def test_gaps_are_those_of_the_closed_pair_from_back_to_back(standoff, shield):
    """Two ways to the same heights: the column of all layers that decides about the port, and the coils' gaps."""
    found = design(standoff, shield)
    at = {part: (low.nominal, high.nominal) for part, (low, high) in levels(column(found.layout)).items()}
    top = at["board"][1]
    assert target_gap(found.spec) == approx(at["target"][0] - top, rel=1e-6)
    assert metal_face(found.spec) == approx(at["jaw"][1] - top, rel=1e-6)
    if shield:
        assert shield_span(found.spec) == approx([level - top for level in at["shield"]], rel=1e-6)
        assert room_behind(found.spec) == approx(at["board"][0] - at["shield"][1], rel=1e-6)
    else:
        assert room_behind(found.spec) == approx(at["board"][0] - at["jaw"][1], rel=1e-6)


@pytest.mark.slow
def test_glue_takes_the_target_away_and_inductance_up():
    thin, thick = design(), Design(design().spec.replace("assembly.glue_line", "100 um"))
    rest, other = (each.estimates.coils[0].states["rest"].inductance for each in (thin, thick))
    assert other > 1.01 * rest
    assert thick.estimates.gaps["rest"] - thin.estimates.gaps["rest"] == approx(120e-6, rel=1e-6)
    assert thick.response.rest[2] == approx(thick.estimates.gaps["rest"], rel=1e-6)
