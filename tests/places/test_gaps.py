"""What the coils see is the glued assembly: every line between board and metal takes the metal farther away."""

import pytest
from tolerance import approx

from sitscad import load_text
from sitscad.assembly.places.bodies import backing_of, target_gap
from sitscad.assembly.places.column import column, layer_heights
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
def test_gaps_match_column_of_closed_pair(standoff, shield):
    """Two ways to the same heights: the column of all layers that decides about the port, and the coils' gaps."""
    result = design(standoff, shield)
    at = {part: (low.nominal, high.nominal) for part, (low, high) in layer_heights(column(result.layout)).items()}
    top = at["board"][1]
    assert target_gap(result.spec) == approx(at["target"][0] - top, rel=1e-6)
    assert backing_of(result.spec).metal_face == approx(at["jaw"][1] - top, rel=1e-6)
    if shield:
        assert backing_of(result.spec).shield_span == approx([level - top for level in at["shield"]], rel=1e-6)
        assert backing_of(result.spec).room == approx(at["board"][0] - at["shield"][1], rel=1e-6)
    else:
        assert backing_of(result.spec).room == approx(at["board"][0] - at["jaw"][1], rel=1e-6)


@pytest.mark.slow
def test_glue_increases_target_gap_and_inductance():
    thin, thick = design(), Design(design().spec.replace("assembly.glue_line", "100 um"))
    rest, other = (each.estimates.coils[0].states["rest"].inductance for each in (thin, thick))
    assert other > 1.01 * rest
    assert thick.estimates.gaps["rest"] - thin.estimates.gaps["rest"] == approx(120e-6, rel=1e-6)
    assert thick.response.rest[2] == approx(thick.estimates.gaps["rest"], rel=1e-6)
