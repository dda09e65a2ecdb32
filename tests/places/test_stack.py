"""The pieces in their places: no gap in the height, no overlap, and the same places as in the solids."""

from itertools import pairwise

import pytest
from tolerance import approx

import sitscad
from sitscad.assembly.places.bodies import BodyRole, backing_of, top_height
from sitscad.assembly.places.column import column
from sitscad.assembly.places.fit import closed_section
from sitscad.assembly.places.jaws import closed_span
from sitscad.assembly.places.stack import stack
from sitscad.assembly.places.state import FREE, PRESSED, REST, STATES, state_text, state_title
from sitscad.spec import templates

TEMPLATES = ("grasper_4layer", "grasper_3p5mm", "bench_7mm", "single_coil", "jaw_5x20", "fingertip_foil")
FILLED = (BodyRole.SHIELD, BodyRole.BOARD, BodyRole.ELASTOMER, BodyRole.TARGET)


def layout_of(template):
    return sitscad.lay_out(sitscad.load_text(templates.read(template)))


@pytest.fixture(params=TEMPLATES, scope="module")
def layout(request):
    return layout_of(request.param)


def test_stack_pieces_are_ordered_and_touch(layout):
    pieces = stack(layout)
    assert [piece.lower for piece in pieces] == sorted(piece.lower for piece in pieces)
    assert all(piece.thickness > 0.0 for piece in pieces)
    solid = [piece for piece in pieces if piece.role in FILLED and piece.role is not BodyRole.SHIELD]
    for under, over in pairwise(solid):
        assert over.lower == approx(under.upper, abs=1e-12)


def test_stack_metals_match_estimates(layout):
    conducting = {piece.role for piece in stack(layout) if piece.metal is not None}
    assert conducting <= {BodyRole.JAW, BodyRole.OPPOSING_JAW, BodyRole.TARGET, BodyRole.SHIELD}
    assert (BodyRole.TARGET in conducting) == (layout.spec.target is not None)


def test_closed_section_spans_both_backs(layout):
    span, section = closed_span(backing_of(layout.spec), top_height(layout.spec)), closed_section(layout)
    if span is None:
        assert section is None
        return
    pieces = stack(layout)
    assert min(piece.lower for piece in pieces) == approx(span[0], rel=1e-6)
    assert max(piece.upper for piece in pieces) == approx(span[1], rel=1e-6)
    lines = [layer for layer in column(layout) if layer.is_glue]
    assert lines and section.height == approx(span[1] - span[0] + 30e-6 * len(lines), rel=1e-6)


def test_states_have_target_pose():
    result = {state.name: state for state in sitscad.estimate(layout_of("bench_7mm")).states}
    assert list(result) == [FREE, REST, PRESSED]
    assert result[FREE].is_free and not result[REST].is_free
    assert result[REST].pose.z == 0.0 and result[REST].force == 0.0
    pose = result[PRESSED].pose
    assert pose.rx == pose.ry == 0.0 and pose.z < 0.0
    assert result[PRESSED].force == layout_of("bench_7mm").spec.requirements.normal_force


def test_state_names_have_texts():
    assert {state_text(kind.name) for kind in STATES}.isdisjoint((FREE, REST))
    assert state_title("behind_the_board") == "behind the board"
    assert state_text("scissor") == "scissor"
