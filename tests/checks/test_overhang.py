"""SIT307: what lies on what, each piece in its place. True geometry is worked out here with shapely, on its own."""

from __future__ import annotations

import math
import re

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from ruamel.yaml import YAML
from shapely import affinity
from shapely.geometry import Point, Polygon, box
from tolerance import approx

from sitscad.checks.judging import check
from sitscad.layout import lay_out
from sitscad.spec.load import load_text

MM = 1e-3
SAME = 1e-8 / MM  # mm: outlines that coincide are the same

LONG_PAD = {"target": {"size": 10}, "elastomer": {"shape": "rectangle", "size": [12, 10], "thickness": 1.5}}


def document(array=None, coil=(10, 18), **parts):
    """A spec as a mapping: round coils of an outer diameter and turns on a board with a tail."""
    return {
        "sitscad": 1,
        "name": "places",
        "coil": {"shape": "circle", "outer_diameter": coil[0], "turns": coil[1], "layers": 2, "trace_width": "100 um",
                 "trace_spacing": "100 um"},
        **({"array": array} if array else {}),
        "fpc": {"tail": {"length": 40}},
        **parts,
    }


def loaded(document):
    from io import StringIO

    out = StringIO()
    YAML().dump(document, out)
    return load_text(out.getvalue(), "places.yaml")


def followed(document, fixes):
    """The specs with each of a finding's fixes written into it."""
    for fix in fixes:
        changed = {key: dict(value) if isinstance(value, dict) else value for key, value in document.items()}
        for edit in fix.edits:
            section, name = edit.key.split(".")
            changed.setdefault(section, {})[name] = YAML(typ="safe").load(edit.new)
        yield changed


def outlines(spec, layout):
    """Body, elastomer and target from above in millimetres: what the spec says, drawn here once more."""
    board = Polygon([(p.x / MM, p.y / MM) for p in layout.outline.flattened(1e-8)])
    body = board.intersection(box(*(v / MM for v in layout.body)))
    centres = [place.centre for place in spec.array.placements]
    middle = [sum(c[k] for c in centres) / len(centres) / MM for k in (0, 1)]

    def plate(part, turn=0.0):
        x, y = part.size[0] / MM / 2, part.size[1] / MM / 2
        flat = Point(0, 0).buffer(x, 256) if part.shape == "circle" else box(-x, -y, x, y)
        turned = affinity.rotate(flat, turn, origin=(0, 0), use_radians=True)
        return affinity.translate(turned, middle[0] + part.offset[0] / MM, middle[1] + part.offset[1] / MM)

    pad = plate(spec.elastomer) if spec.elastomer else None
    return board, body, pad, plate(spec.target, spec.target.rotation) if spec.target else None


def hangs_nowhere(spec, layout):
    board, body, pad, target = outlines(spec, layout)
    around = spec.encapsulation.thickness / MM if spec.encapsulation else 0.0
    lowest = pad or target
    grown = lowest.buffer(around, 64) if around else lowest
    ok = body.buffer(SAME).covers(grown) and board.buffer(SAME).covers(grown)
    return ok and (pad is None or target is None or pad.buffer(SAME + 1e-4).covers(target))


@pytest.mark.parametrize(
    "written",
    [
        document(**LONG_PAD, mount={"kind": "bench-plate"}, requirements={"normal_force": "5 N"}),
        document({"pattern": "triangle", "pitch": 7}, (6, 9), target={"size": 12},
                 elastomer={"shape": "rectangle", "size": [18, 15], "thickness": 1.5}),
        document({"pattern": "grid", "count": [2, 2], "pitch": 7}, (6, 9), target={"size": 12},
                 elastomer={"shape": "rectangle", "size": [15.5, 14.6], "thickness": 1.5}),
        document(None, (4, 5), target={"size": 3.9}, elastomer={"shape": "rectangle", "size": [7, 4], "thickness": 1},
                 mount={"jaw": "generic-5mm"}, encapsulation={"thickness": 0.1}),
        document(None, (4, 5), target={"size": 4}, elastomer={"shape": "rectangle", "size": [5.2, 4], "thickness": 1},
                 mount={"jaw": {"width": 5, "length": 5, "height": 2}}),
        document(target={"size": 12}),
        document(target={"shape": "circle", "size": 10.6}, elastomer={"shape": "circle", "size": 11}),
        document(target={"size": 7, "rotation": "45 deg"}, elastomer={"size": 8, "shape": "square"}),
        document(target={"size": 5, "offset": [1, 0.5]}, elastomer={"size": 6, "shape": "square"}),
        document(target={"size": 5}, elastomer={"size": 8, "shape": "circle", "offset": [4, 0]}),
        document({"pattern": "explicit", "centres": [[-6, 2.5], [2, 3.5], [4, -6]]}, (6, 9), target={"size": 10},
                 elastomer={"shape": "rectangle", "size": [19, 10], "thickness": 1, "offset": [0, -2]}),
    ],
    ids=["single", "triangle", "grid", "jaw", "short jaw", "no pad", "discs", "turned", "target offset", "pad offset",
         "odd array"],
)
def test_every_overhang_fix_clears_finding_and_overhang(judge, advised, written):
    spec = loaded(written)
    assert not hangs_nowhere(spec, lay_out(spec))
    result = advised("SIT307", spec)
    assert result
    for finding in result:
        assert finding.fixes
        for changed in followed(written, finding.fixes):
            after = loaded(changed)
            assert judge("SIT307", after) == []
            assert hangs_nowhere(after, lay_out(after))


def test_pad_as_long_as_body_gets_margin_and_size_fixes(advised):
    """The length that was named before was that of a body in which the coils stood aside."""
    (result,) = advised("SIT307", loaded(document(**LONG_PAD, mount={"kind": "bench-plate"})))
    edits = [[(edit.key, edit.new) for edit in fix.edits] for fix in result.fixes]
    assert edits == [[("fpc.margin", "[0.21, 0.07]")], [("elastomer.size", "[11.5, 10]")]]
    assert "far end" in result.detail and "tail's end" in result.detail


def test_square_pad_corners_overhang_rounded_board_corners(judge):
    plain = document(**LONG_PAD)
    body = lay_out(loaded(plain)).body_size
    plain["elastomer"] = {"shape": "rectangle", "size": [float(f"{side / MM:.6f}") for side in body], "thickness": 1}
    (result,) = judge("SIT307", loaded(plain))
    radius = 0.5 * MM
    assert result.measured == approx((math.sqrt(2) - 1) * radius, abs=1e-6) and "overhang-corners" in result.cases


def test_overhang_includes_film_around_pad(judge):
    parts = {"target": {"size": 10}, "elastomer": {"size": 10.3, "shape": "square"}}
    assert judge("SIT307", loaded(document(**parts))) == []
    (result,) = judge("SIT307", loaded(document(**parts, encapsulation={"thickness": 0.1})))
    assert "overhang-film" in result.cases and result.measured == approx(50e-6, rel=1e-3)


def test_overhang_on_short_jaw_names_jaw_length(judge):
    jaw = {"jaw": {"width": 5, "length": 5, "height": 2}}
    pad = {"shape": "rectangle", "size": [5, 4], "thickness": 1}
    (result,) = judge("SIT307", loaded(document(None, (4, 5), target={"size": 4}, elastomer=pad, mount=jaw)))
    assert "overhang-jaw-length" in result.cases and "5 mm" in result.detail


@pytest.mark.slow
def test_smaller_plates_that_break_other_rule_are_not_suggested(judge):
    pad = {"shape": "rectangle", "size": [7, 4.6], "thickness": 1}
    parts = {"elastomer": pad, "mount": {"jaw": "generic-5mm"}, "encapsulation": {"thickness": 0.1}}
    written = document(None, (4, 5), target={"size": 4}, **parts)
    before = check(loaded(written), hints="full").findings
    (result,) = [item for item in before if item.rule == "SIT307"]
    for changed in followed(written, [fix for fix in result.fixes if not fix.new_warnings]):
        spec = loaded(changed)
        assert judge("SIT307", spec) == []
        assert len(judge("SIT306", spec)) <= [item.rule for item in before].count("SIT306")


@pytest.mark.parametrize(
    ("target", "pad", "severities"),
    [
        ([2.4, 0], [0, 0], ["warning"]),
        ([2.6, 0], [0, 0], ["error"]),
        ([5.5, 0], [5.5, 0], ["warning"]),
        ([6.2, 0], [6.2, 0], ["error"]),
        ([9, 0], [-9, 0], ["error", "error"]),
    ],
)
def test_large_plate_offset_gives_error_and_small_offset_gives_warning(judge, target, pad, severities):
    """A target beside its pad was a warning, and the force on it was computed as if it lay there."""
    parts = {"target": {"size": 4, "offset": target}, "elastomer": {"size": 5, "shape": "square", "offset": pad}}
    assert [f.severity.value for f in judge("SIT307", loaded(document(**parts)))] == severities


def test_spec_without_target_and_pad_leaves_overhang_not_checked(verdicts):
    findings, skipped = verdicts("SIT307", loaded(document()))
    assert not findings and skipped[0].case == "no-plate"


def test_extreme_offset_hint_proposes_no_extreme_size(judge, advised):
    """A margin of 0.6 m was, and an elastomer of 0.8 m."""
    far = document(None, (4, 6), target={"size": 4, "offset": [400, -300]},
                   elastomer={"shape": "circle", "size": 3, "offset": [-200, 5]})
    for finding in advised("SIT307", loaded(far)):
        assert not re.search(r"\d{3}", finding.hint.replace("-200", "")), finding.hint
        for changed in followed(far, finding.fixes):
            assert judge("SIT307", loaded(changed)) == []


lengths = st.floats(2.0, 14.0).map(lambda v: round(v, 2))
offsets = st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)).map(lambda v: [round(v[0], 2), round(v[1], 2)])
arrays = st.sampled_from([
    None,
    {"pattern": "line", "count": 2, "pitch": 4.2},
    {"pattern": "triangle", "pitch": 4.6},
    {"pattern": "grid", "count": [2, 2], "pitch": 4.6},
    {"pattern": "explicit", "centres": [[-3, 0.7], [2.5, 1.8]]},
])
jaws = st.sampled_from([None, {"jaw": {"width": 9, "length": 8, "height": 2}}, {"kind": "bench-plate"}])


@st.composite
def sensors(draw):
    """Small coils in any array under a target and a pad of any size, offset and turned, some with a film or a jaw."""
    plates = {}
    for key in ("target", "elastomer"):
        if draw(st.booleans()) or (key == "elastomer" and not plates):
            shape, x = draw(st.sampled_from(["circle", "square", "rectangle"])), draw(lengths)
            size = [x, draw(lengths)] if shape == "rectangle" else x
            plates[key] = {"shape": shape, "size": size, "offset": draw(st.just([0, 0]) | offsets)}
    if "target" in plates:
        plates["target"]["rotation"] = f"{draw(st.sampled_from([0, 0, 30, 45, 90]))} deg"
    jaw, film = draw(jaws), draw(st.booleans())
    written = document(draw(arrays), (3.6, 4), **plates, **({"mount": jaw} if jaw else {}))
    written["fpc"]["margin"] = draw(st.sampled_from([0, 0.4, [1, 0]]))
    return written | ({"encapsulation": {"thickness": 0.1}} if film else {})


@pytest.mark.more
@pytest.mark.slow
@settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
@given(sensors())
def test_overhang_rule_agrees_with_shapely_geometry(judge, written):
    spec = loaded(written)
    layout = lay_out(spec)
    assert (judge("SIT307", spec, layout) == []) is hangs_nowhere(spec, layout)
