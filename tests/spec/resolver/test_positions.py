"""Where coils stand and how far apart their outlines are, turned or not."""

import math
import re
from itertools import combinations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tolerance import approx

from sitscad.kernels.geometry import shapes
from sitscad.kernels.geometry.path import Path
from sitscad.kernels.geometry.primitives import distances, from_rows, path_rows
from sitscad.spec.load import load_text
from sitscad.spec.reading import SpecError
from sitscad.spec.resolver.coils import coil_gap, coil_placements

SHAPES = {name: (9.0, 4.0) if row.is_long else (4.0, 4.0) for name, row in shapes.SHAPES.items()}


def drawn(shape, size, place) -> Path:
    return shapes.SHAPES[shape].boundary(size, 0.0).rotated(place.rotation).shifted(*place.centre)


@pytest.mark.parametrize("shape", SHAPES)
@given(
    bearing=st.floats(0.0, 6.28),
    distance=st.floats(10.0, 30.0),
    first=st.floats(-3.0, 3.0),
    second=st.floats(-3.0, 3.0),
)
def test_computed_gap_never_exceeds_distance_of_drawn_outlines(shape, bearing, distance, first, second):
    centres = ((1.0, 2.0), (1.0 + distance * math.cos(bearing), 2.0 + distance * math.sin(bearing)))
    item, other = coil_placements(centres, (first, second))
    rows = [from_rows([row for row, _ in path_rows(drawn(shape, SHAPES[shape], p))]) for p in (item, other)]
    pairs = [(i, j) for i in range(len(rows[0])) for j in range(len(rows[1]))]
    true = distances(*(r.take([p[k] for p in pairs]) for k, r in enumerate(rows))).min()
    result = coil_gap(shape, SHAPES[shape], item, other)
    assert result <= true + (1e-9 if shape != "racetrack" else 0.05)  # drawn with chords outside of the half circles
    if shape != "racetrack":
        assert result == approx(true, abs=1e-9)
    assert coil_gap(shape, SHAPES[shape], other, item) == approx(result, abs=1e-9)


def test_crossed_racetracks_overlap_and_parallel_racetracks_have_gap():
    size = (9.0, 4.0)
    across, along = coil_placements(((0.0, 0.0), (3.0, 0.0)), (math.pi / 2, 0.0))
    assert coil_gap("racetrack", size, across, along) < 0.0
    item, other = coil_placements(((0.0, 0.0), (5.0, 0.0)), (math.pi / 2, math.pi / 2))
    assert coil_gap("racetrack", size, item, other) == approx(1.0, rel=1e-6)


TURNED = """sitscad: 1
name: turned
coil: {shape: racetrack, outer_diameter: [8, 4], turns: 5, layers: 2, trace_width: 100 um, trace_spacing: 100 um}
array: {pattern: explicit, centres: [[-4, 0], [4, 0]], rotations: ROTATIONS}
"""


def test_rotations_are_read_in_the_order_of_the_centres():
    spec = load_text(TURNED.replace("ROTATIONS", "[0 deg, 90 deg]"))
    assert [p.rotation for p in spec.array.placements] == [0.0, approx(math.pi / 2, rel=1e-6)]


@pytest.mark.parametrize(
    ("array", "rule", "key"),
    [
        (TURNED.replace("ROTATIONS", "[90 deg]"), "SIT009", "array.rotations"),
        (TURNED.replace("pattern: explicit, centres: [[-4, 0], [4, 0]]", "pattern: line, count: 2, pitch: 9").replace(
            "ROTATIONS", "[0 deg, 90 deg]"), "SIT009", "array.rotations"),
        (TURNED.replace("[-4, 0]", "[-2, 0]").replace("[4, 0]", "[2, 0]").replace("ROTATIONS", "[0 deg, 90 deg]"),
         "SIT014", "array.centres"),
    ],
)
def test_rotations_that_do_not_match_array_are_refused(array, rule, key):
    with pytest.raises(SpecError) as error:
        load_text(array)
    assert (rule, key) in [(finding.rule, finding.key) for finding in error.value.findings]


def array_of(shape, array):
    size = "[8, 5]" if shape in ("racetrack", "rectangle") else "8"
    return load_text(
        f"sitscad: 1\nname: near\ncoil: {{shape: {shape}, outer_diameter: {size}, turns: 5, layers: 2, trace_width: 0.1"
        f", trace_spacing: 0.1}}\narray: {{{array}}}\n"
    ).array


def told(shape, array):
    """What is missing, as the finding says it: millimetres of pitch, or a factor; None where the coils are apart."""
    try:
        array_of(shape, array)
    except SpecError as error:
        (finding,) = error.findings
        assert finding.rule == "SIT014" and finding.measured < finding.limit
        (number,) = re.findall(r"a pitch larger by ([\d.]+) mm|centres ([\d.]+) times", finding.hint)
        return float(number[0] or number[1])
    return None


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("pattern", ["line, count: 3", "triangle", "grid, count: [2, 2]"])
@pytest.mark.parametrize("pitch", [1.0, 4.9, 8.02])
def test_suggested_pitch_increase_removes_overlap_and_is_minimal(shape, pattern, pitch):
    """Not the missing gap: the flat sides of two squares in a triangle open by less than their centres part."""
    more = told(shape, f"pattern: {pattern}, pitch: {pitch}")
    if more is None:
        return
    assert told(shape, f"pattern: {pattern}, pitch: {pitch + more:.6f}") is None
    assert told(shape, f"pattern: {pattern}, pitch: {pitch + more - 0.002:.6f}") == approx(0.002, abs=1.1e-3)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("turned", [(0, 0), (45, 45), (20, 70), (90, 0)])
@pytest.mark.parametrize("place", [(6.0, 2.0), (3.5, 3.5), (0.5, -4.0)])
def test_suggested_scale_factor_removes_overlap_and_is_minimal(shape, turned, place):
    def array(factor):
        x, y = (factor * each for each in place)
        angles = ", ".join(f"{each} deg" for each in turned)
        return f"pattern: explicit, centres: [[{-x}, {-y}], [{x}, {y}]], rotations: [{angles}]"

    factor = told(shape, array(1.0))
    if factor is None:
        return
    assert told(shape, array(factor)) is None
    assert told(shape, array(factor - 3e-4)) is not None


def test_coincident_coils_yield_finding_without_scale_factor():
    with pytest.raises(SpecError) as caught:
        array_of("square", "pattern: explicit, centres: [[1, 1], [1, 1]]")
    assert [(f.rule, f.hint) for f in caught.value.findings] == [("SIT014", "move them apart")]


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("pattern", ["line", "triangle", "grid"])
def test_default_pitch_keeps_half_millimetre_between_coils(shape, pattern):
    """Also in a triangle, whose flat sides come nearer than its centres; for round coils it is their size and a gap."""
    array = array_of(shape, f"pattern: {pattern}")
    size = (8e-3, 5e-3) if shape in ("racetrack", "rectangle") else (8e-3, 8e-3)
    gaps = [coil_gap(shape, size, a, b) for a, b in combinations(array.placements, 2)]
    assert min(gaps) >= 0.5e-3 - 1e-9
    assert shape != "circle" or array.pitch == 8.5e-3
