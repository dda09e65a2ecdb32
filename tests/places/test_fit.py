"""The fit from the figures alone: tolerances against sampled sensors, and what is said of one that passes."""

from __future__ import annotations

import math
import random
from dataclasses import replace

import handmade
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tolerance import approx

import sitscad
from sitscad.assembly.places.column import (
    Toleranced,
    column,
    layer_heights,
    print_limit,
    process_tolerance,
    worst_deviations,
)
from sitscad.assembly.places.fit import CLOSED_PAIR, LENGTH, OVERHANG, Corner, closed_section, fit, measures
from sitscad.assembly.places.jaws import jaw_section
from sitscad.basics.units import show
from sitscad.spec import templates
from sitscad.spec.mount import PROCESSES, Assembly

GLUED = Assembly(None, 30e-6, 20e-6)

lengths = st.floats(-2e-3, 2e-3)
bands = st.floats(0.0, 3e-4)


def glued(layout, **assembly):
    return replace(layout, spec=replace(layout.spec, assembly=replace(GLUED, **assembly)))


@given(lengths, lengths, bands, bands, bands, st.integers(0, 10**6))
def test_parts_within_tolerances_stay_within_worst_case(y, z, a, b, c, seed):
    across = Toleranced(y) + Toleranced.of(0.0, a, "a") + Toleranced.of(0.0, b, "b")
    up = Toleranced(z) + Toleranced.of(0.0, c, "c")
    nominal, likely, worst = Corner("edge", across, up).reach
    assert nominal <= likely <= worst + 1e-15
    chance = random.Random(seed)
    for signs in ([chance.choice((-1, 1)) for _ in range(3)] for _ in range(20)):
        there = math.hypot(y + signs[0] * a + signs[1] * b, z + signs[2] * c)
        assert there <= worst + 1e-15


@given(st.lists(st.tuples(lengths, bands), min_size=1, max_size=6))
def test_length_minus_itself_has_no_tolerance(parts):
    length = sum((Toleranced.of(size, band, str(i)) for i, (size, band) in enumerate(parts)), Toleranced(0.0))
    gone = length - length
    assert gone.nominal == 0.0 and gone.spread == 0.0
    assert length.root_sum_square <= length.spread * (1 + 1e-12)
    assert (length + length).spread == approx(2 * length.spread, rel=1e-6)


def test_worst_case_is_maximum_over_tolerance_corners():
    """Every layer at either end, drawn anew without the arithmetic of tolerances: none is worse, and one is as bad."""
    layout = glued(handmade.jaw_sensor(), tolerances=(("outline", 0.0), ("placement", 0.0)))
    layers, result = column(layout), closed_section(layout)
    bottoms = [layer.thickness.nominal for layer in layers]
    spreads = [layer.thickness.spread for layer in layers]
    chance = random.Random(7)
    highest = 0.0
    for signs in [[1] * len(layers), *([chance.choice((-1, 1)) for _ in layers] for _ in range(200))]:
        height = sum(t + s * d for t, s, d in zip(bottoms, signs, spreads, strict=True))
        highest = max(highest, height / 2)
    assert highest <= result.worst_radius + 1e-12
    assert result.height == approx(sum(bottoms), rel=1e-6) and highest == approx(
        (sum(bottoms) + sum(spreads)) / 2, rel=1e-6
    )


def test_root_sum_square_matches_sampled_sensors():
    """Tolerances as three sigma of normal spread: 99.7 of 100 pairs lie within it, for one corner decides here."""
    layout = glued(handmade.jaw_sensor(encapsulation=None, elastomer=None, target=None), tolerances=(("outline", 0.0),))
    layers, pair = column(layout), fit(layout)[0]
    chance = random.Random(1)
    over = 0
    for _ in range(4000):
        height = sum(chance.gauss(e.thickness.nominal, e.thickness.spread / 3) for e in layers)
        over += height > pair.root_sum_square + 1e-12
    assert over <= 4000 * 0.006


def test_only_glued_pieces_have_glue_lines():
    parts = [layer.part for layer in column(glued(handmade.jaw_sensor()))]
    assert parts == [
        "jaw", "glue under the mount", "mount", "glue under the shield", "shield", "glue under the mount-spacer",
        "mount-spacer", "glue under the board", "board", "glue under the elastomer", "elastomer",
        "glue under the target", "target", "encapsulation", "opposing-jaw",
    ]
    assert not [layer for layer in column(handmade.jaw_sensor()) if layer.is_glue]
    assert column(handmade.bench_sensor()) == ()


def test_levels_are_contiguous_up_to_height():
    layers = column(glued(handmade.jaw_sensor()))
    here = 0.0
    for lower, upper in layer_heights(layers).values():
        assert lower.nominal == approx(here, abs=1e-15)
        here = upper.nominal
    assert here == approx(closed_section(glued(handmade.jaw_sensor())).height, rel=1e-6)


def test_glue_raises_pair_by_its_lines():
    bare, with_glue = (fit(layout)[0] for layout in (handmade.jaw_sensor(), glued(handmade.jaw_sensor())))
    assert with_glue.nominal > bare.nominal and with_glue.worst > bare.worst
    assert worst_deviations(glued(handmade.jaw_sensor()))[1] > worst_deviations(handmade.jaw_sensor())[1]


def test_written_tolerance_replaces_process_tolerance():
    layout = glued(handmade.jaw_sensor(), tolerances=(("elastomer", 50e-6),))
    shares = {share.part: share for share in fit(layout)[0].parts}
    assert shares["elastomer"].tolerance == 50e-6 and "assembly.tolerances" in shares["elastomer"].source
    assert fit(glued(handmade.jaw_sensor()))[0].worst > fit(layout)[0].worst


def test_board_width_is_compared_with_jaw_chord():
    layout = handmade.board(handmade.jaw_sensor().spec, body=(9e-3, 4.6e-3))
    over = next(measure for measure in fit(layout) if measure.name == OVERHANG)
    face = jaw_section(layout.spec.mount.jaw).face
    assert face < layout.spec.mount.jaw.width
    assert over.nominal == approx((4.6e-3 - face) / 2, rel=1e-6) and over.limit == approx(0.9e-3, rel=1e-6)


def test_fit_measures_name_limits():
    result = {measure.name: measure for measure in fit(handmade.jaw_sensor())}
    assert list(result) == [CLOSED_PAIR, OVERHANG, LENGTH]
    assert result[CLOSED_PAIR].limit == 5e-3 and result[LENGTH].limit == 16e-3
    for measure in result.values():
        assert measure.nominal <= measure.root_sum_square <= measure.worst
        assert measure.margin == approx(measure.limit - measure.worst, rel=1e-6)
    assert fit(handmade.bench_sensor()) == ()


def test_unfitting_shield_has_no_fit_measures():
    deep = handmade.jaw_sensor(shield=handmade.Shield(handmade.COPPER, 0.1e-3, 1.0e-3))
    assert measures(deep) == ()


@pytest.mark.parametrize("process", PROCESSES)
def test_processes_have_limits_and_tolerances(process):
    for figure in ("wall", "free_wall", "hole", "clearance"):
        limit = print_limit(process, figure)
        assert 0.0 < limit.value < 3e-3 and limit.source
    assert 0.0 < process_tolerance("mount", process, 1e-3).band < 1e-3
    with pytest.raises(KeyError):
        print_limit(process, "colour")


@pytest.mark.parametrize(("size", "band"), [(0.05e-3, 5e-6), (0.15e-3, 18e-6), (0.2e-3, 18e-6), (1.0e-3, 50e-6)])
def test_sheet_tolerance_follows_thickness(size, band):
    assert process_tolerance("sheet", "rolled", size).band == approx(band, rel=1e-6)


@pytest.mark.parametrize(("width", "is_told"), [("4.8 mm", True), ("4.6 mm", True), ("4.2 mm", False)])
def test_jaw_with_narrow_face_lists_face_among_defaults(width, is_told):
    """A width of 4.8 or 4.6 mm left the face at 4.386 mm, and nothing said so."""
    text = templates.read("jaw_5x20").replace("jaw: generic-5mm", f"jaw: {{based_on: generic-5mm, width: {width}}}")
    assert width in text
    spec = sitscad.load_text(text, "jaw.yaml")
    lines = [each.partition(": ")[2] for each in spec.source.defaults if each.startswith("mount.jaw.face:")]
    assert bool(lines) is is_told
    face = jaw_section(spec.jaw).face
    assert all(each.startswith(show(face, "m", 4)) for each in lines)
    assert (face < spec.jaw.width - 1e-9) is is_told
