"""Every layout, whatever its shape, layers, array and angles: joined in the right order, touching nothing else."""

import dataclasses
import math
import random
from itertools import combinations, pairwise

import pytest
from tolerance import approx

from sitscad.basics.finding import Missing
from sitscad.checks.judging import check
from sitscad.kernels.geometry.path import Point, bounding_box
from sitscad.layout import Role, Trace, Via, lay_out
from sitscad.spec import presets
from sitscad.spec.circuit import LayerKind, StackLayer, Stackup
from sitscad.spec.load import load_text
from sitscad.spec.resolver import coils as positions

CASES = {
    "bench": dict(diameter=7e-3, turns=12, layers=2, width=1e-4, spacing=1e-4, pitch=8e-3, stackup="flex-2l-35um",
                  rules="generic-flex"),
    "miniature": dict(diameter=3.5e-3, turns=6.5, layers=2, width=1e-4, spacing=1e-4, pitch=4e-3,
                      stackup="flex-2l-35um", rules="generic-flex"),
    "jaw": {},
    "jaw clockwise": dict(clockwise=True, start_angle=1.0),
    "single": dict(diameter=7e-3, turns=10, layers=1, coils=1, stackup="flex-2l-35um", tail=False),
    "three layers, flat pairs": dict(diameter=5e-3, turns=6, layers=3, coils=3, pitch=6e-3, tail_layers=1),
    "squares": dict(shape="square", diameter=5e-3, turns=6.25, pitch=6e-3),
    "rounded squares": dict(shape="square", diameter=8e-3, turns=12, layers=2, width=1e-4, spacing=1e-4, pitch=9e-3,
                            stackup="flex-2l-18um", corner_radius=0.5e-3),
    "racetracks": dict(shape="racetrack", size=(8e-3, 5e-3), turns=6.5, layers=2, stackup="flex-2l-18um", pitch=9e-3),
    "octagons": dict(shape="octagon", diameter=5e-3, turns=5.5, layers=2, pitch=6e-3),
    "hexagons": dict(shape="hexagon", diameter=5e-3, turns=5, layers=2, pitch=6.4e-3),
    "eight layers": dict(diameter=7e-3, turns=6.5, layers=8, stackup="flex-8l", pitch=8e-3),
    "triangle": dict(centres=positions.triangle_centres(4.6e-3)),
    "four-coil grid": dict(centres=positions.grid_centres(2, 2, 4.8e-3)),
    "grid of squares": dict(shape="square", diameter=5e-3, turns=6, layers=2, stackup="flex-2l-18um",
                            centres=positions.grid_centres(2, 2, 6.2e-3)),
    "six-coil grid": dict(turns=6, layers=2, stackup="flex-2l-18um", centres=positions.grid_centres(3, 2, 5.2e-3)),
    "explicit": dict(turns=6, layers=2, stackup="flex-2l-18um", centres=[(-3e-3, 0), (3e-3, 0), (0, 5e-3)]),
    "eight in a row": dict(diameter=6e-3, turns=8, layers=2, width=1e-4, coils=8, pitch=8e-3, stackup="flex-2l-18um",
                           tail=False),
    "four in a row": dict(diameter=4e-3, turns=6, layers=2, coils=4, pitch=4.9e-3, start_angle=math.radians(30)),
}


@pytest.fixture(params=CASES, scope="module")
def layout(request):
    from .conftest import sensor

    return lay_out(sensor(**CASES[request.param]))


def assert_sound(layout):
    """Consecutive conductors of a coil meet; all others keep the rules' distance, arcs flattened within 0.2 um."""
    assert layout.shortfalls == ()
    spacing = min(layout.spec.fpc.rules.trace_spacing, layout.spec.coil.trace_spacing) - 1e-6
    for coil in layout.coils:
        assert coil.is_closed_circuit
        assert_in_series(coil.series)
    assert clashes(layout, spacing) == []


def assert_in_series(series):
    for item, other in pairwise(series):
        end = item.path.end if isinstance(item, Trace) else item.centre
        start = other.path.start if isinstance(other, Trace) else other.centre
        assert end.distance(start) < 1e-9
        if isinstance(item, Trace) and isinstance(other, Trace):
            assert item.layer == other.layer
    kinds = [isinstance(piece, Via) for piece in series]
    assert not any(a and b for a, b in pairwise(kinds))


def clashes(layout, spacing):
    """Pairs of conductors that come too near on some layer, though the current does not pass from one to the next."""
    shapely = pytest.importorskip("shapely", reason="shapely compares the copper; it comes with sitscad[all]")
    pieces = []
    for coil in layout.coils:
        for index, piece in enumerate(coil.series):
            if isinstance(piece, Trace):
                line = shapely.LineString(piece.path.flattened(0.2e-6))
                pieces.append((coil.name, index, piece.layer, line.buffer(piece.width / 2, quad_segs=32)))
            else:
                pad = shapely.Point(piece.centre).buffer(piece.pad / 2, quad_segs=32)
                pieces += [(coil.name, index, layer, pad) for layer in range(1, layout.copper_layers + 1)]
    result = []
    for (net, i, layer, a), (other, j, rival, b) in combinations(pieces, 2):
        if layer == rival and (net != other or abs(i - j) > 2) and a.distance(b) < spacing:
            result.append((net, i, other, j, layer, a.distance(b)))
    return result


def test_copper_of_sample_designs_passes_design_rules(layout):
    assert_sound(layout)


def test_each_coil_connects_its_two_contacts(layout):
    assert len(layout.pads) == 2 * len(layout.coils)
    assert [pad.number for pad in layout.pads] == list(range(1, len(layout.pads) + 1))
    heights = [pad.centre.y for pad in layout.pads]
    assert heights == sorted(heights, reverse=True)
    for coil in layout.coils:
        pins = {pad.pin: pad.centre for pad in layout.pads if pad.net == coil.net}
        assert set(pins) == {f"{coil.name}.A", f"{coil.name}.B"}
        assert coil.series[0].path.start.distance(pins[f"{coil.name}.A"]) < 1e-9
        assert coil.series[-1].path.end.distance(pins[f"{coil.name}.B"]) < 1e-9


def test_current_circulates_in_one_sense_on_all_layers(layout):
    sense = -1 if layout.spec.coil.clockwise else 1
    for coil in layout.coils:
        for winding in coil.windings:
            points = winding.path.flattened(1e-6)
            swept = sum(
                math.remainder(
                    math.atan2(b.y - coil.centre.y, b.x - coil.centre.x)
                    - math.atan2(a.y - coil.centre.y, a.x - coil.centre.x),
                    2 * math.pi,
                )
                for a, b in pairwise(points)
            )
            assert swept == approx(sense * 2 * math.pi * layout.spec.coil.turns, abs=0.35)


def test_copper_has_required_distance_to_board_edge(layout):
    shapely = pytest.importorskip("shapely", reason="shapely measures to the outline; it comes with sitscad[all]")
    board = shapely.Polygon(layout.outline.flattened(0.2e-6))
    edge = layout.spec.fpc.rules.copper_to_edge
    for trace in layout.traces:
        copper = shapely.LineString(trace.path.flattened(0.2e-6)).buffer(trace.width / 2)
        assert board.contains(copper)
        assert board.exterior.distance(copper) > edge - 1e-6
    for via in layout.vias:
        assert board.exterior.distance(shapely.Point(via.centre)) > via.pad / 2 + edge - 1e-6


def test_lead_pairs_run_on_both_layers_of_two_layer_tail(sensor):
    layout = lay_out(sensor())
    for coil in layout.coils:
        leads = [piece for piece in coil.series if isinstance(piece, Trace) and piece.role is Role.TAIL]
        assert {trace.layer for trace in leads} == {1, 2}
        longest = {layer: max(t.path.length for t in leads if t.layer == layer) for layer in (1, 2)}
        assert longest[1] == approx(longest[2], abs=5e-3)


def test_inner_vias_lie_at_ends_of_windings(sensor):
    """4 x 7.75 turns: inner vias near 270 and 90 degrees, as the windings' ends stand there."""
    layout = lay_out(sensor(coils=1))
    centre = layout.coils[0].centre
    inner = [via.centre for via in layout.vias if via.centre.distance(centre) < 0.7e-3]
    angles = sorted(math.degrees(math.atan2(p.y - centre.y, p.x - centre.x)) % 360 for p in inner)
    assert angles == approx([90, 270], abs=8)


@pytest.mark.parametrize("extra", [0.0, 2e-6])
def test_missing_room_for_inner_via_is_named(sensor, extra):
    layout = lay_out(sensor(diameter=2.6e-3, turns=7.0, layers=2, pitch=3.2e-3, stackup="flex-2l-18um"))
    (lack,) = layout.shortfalls
    assert lack.what is Missing.INNER_ROOM and lack.missing == lack.need - lack.have > 0.0
    missing = lack.missing + extra
    mended = lay_out(sensor(diameter=2.6e-3 + missing, turns=7.0, layers=2, pitch=3.2e-3 + missing,
                            stackup="flex-2l-18um"))
    assert Missing.INNER_ROOM not in {lack.what for lack in mended.shortfalls}


def test_odd_layer_count_without_free_layer_has_way_out_shortfall(sensor):
    spec = sensor(layers=1, coils=1, turns=5, stackup="flex-2l-18um")
    coverlay = StackLayer(LayerKind.COVERLAY, 27e-6, "polyimide")
    item = Stackup("one", (coverlay, StackLayer(LayerKind.COPPER, 18e-6, "copper"), coverlay))
    layout = lay_out(dataclasses.replace(spec, fpc=dataclasses.replace(spec.fpc, stackup=item)))
    assert [lack.what for lack in layout.shortfalls] == [Missing.WAY_OUT]
    assert not layout.coils[0].is_closed_circuit and layout.coils[0].windings


@pytest.mark.more
@pytest.mark.slow
def test_close_coils_are_refused_with_missing_length(sensor):
    spec = sensor(diameter=7e-3, pitch=7.1e-3, coils=4, shape="square", turns=8)
    layout = lay_out(spec)
    assert [lack.what for lack in layout.shortfalls] == [Missing.LEAD_ROOM]
    (finding,) = (result for result in check(spec, layout, hints="decisive").findings if result.rule == "SIT113")
    assert finding.key == "array.pitch" and "um more) lets them pass" in finding.hint


@pytest.mark.more
@pytest.mark.slow
def test_random_designs_pass_design_rules_or_have_shortfalls():
    from .conftest import sensor

    source = random.Random(20261120)
    routed = 0
    for _ in range(60):
        layers = source.choice([1, 2, 2, 3, 4, 4, 6, 8])
        diameter = source.choice([3.5e-3, 4e-3, 5e-3, 7e-3])
        shape = source.choice(["circle", "circle", "square", "hexagon", "octagon"])
        turns = source.choice([2, 3.25, 4.5, 5, 6.5, 7.75, 8])
        turns = round(turns * 6) / 6 if shape == "hexagon" else turns
        width = source.choice([80e-6, 100e-6])
        if diameter / 2 - 2 * width * turns < 0.5e-3:
            continue
        layout = lay_out(
            sensor(
                shape, diameter, turns, layers, width, width,
                coils=source.choice([1, 2, 2, 3, 4]),
                pitch=1.16 * diameter + source.choice([0.4e-3, 0.8e-3, 1.2e-3]) * (shape == "hexagon") + 0.5e-3,
                stackup={1: "flex-2l-35um", 2: "flex-2l-35um", 6: "flex-6l", 8: "flex-8l"}.get(layers, "flex-4l"),
                rules=source.choice(["generic-fine", "generic-flex"]),
                tail=source.random() < 0.8,
                tail_layers=source.choice([1, 2]),
                start_angle=math.radians(source.choice([0, 0, 45, 90, -30, 180, source.uniform(0, 360)])),
                clockwise=source.random() < 0.3,
            )
        )
        if layout.shortfalls:
            assert all(lack.message for lack in layout.shortfalls)
            continue
        routed += 1
        assert_sound(layout)
    assert routed >= 20


def test_layout_has_expected_net_names_and_dimensions(sensor):
    layout = lay_out(sensor())
    assert layout.nets == ("C1", "C2") and layout.coils[0].centre == Point(-2.25e-3, 0.0)
    assert layout.body_size[1] == approx(4.72e-3, abs=1e-6)


def test_array_in_rows_with_one_tail_layer_has_tail_layers_shortfall(sensor):
    layout = lay_out(sensor(centres=positions.triangle_centres(5e-3), tail_layers=1))
    assert [lack.what for lack in layout.shortfalls] == [Missing.TAIL_LAYERS]
    assert layout.pads == () and len(layout.coils) == 3


def test_reversed_order_of_explicit_centres_is_routed(sensor):
    spec = sensor(coils=3, pitch=5e-3, layers=2, stackup="flex-2l-18um", turns=6)
    backwards = dataclasses.replace(spec.array, placements=spec.array.placements[::-1])
    layout = lay_out(dataclasses.replace(spec, array=backwards))
    assert_sound(layout)


def with_fine_connector(spec, length=5e-3):
    """A connector of 0.3 mm with no more contacts than the coils need."""
    contacts = 2 * len(spec.array.placements)
    connector = presets.connector("zif-0.3mm")
    tail = dataclasses.replace(spec.fpc.tail, connector=connector, length=length, contacts=contacts)
    return dataclasses.replace(spec, fpc=dataclasses.replace(spec.fpc, tail=tail))


@pytest.mark.slow
def test_short_tail_is_lengthened_for_tracks(sensor):
    assert_sound(lay_out(with_fine_connector(sensor(diameter=7e-3, turns=6.5, coils=9, pitch=8e-3))))


@pytest.mark.parametrize("coils", [1, 2, 4])
@pytest.mark.parametrize("rules", ["generic-flex", "shipco", "rehan-2l"])
def test_tail_with_wide_vias_is_wider_and_narrows_at_contacts(sensor, coils, rules):
    spec = sensor(diameter=7e-3, turns=6.5, coils=coils, pitch=9e-3, rules=rules, layers=2, stackup="flex-2l-18um")
    layout = lay_out(with_fine_connector(spec, 8e-3))
    assert_sound(layout)
    contacts = sorted((pad.centre.y for pad in layout.pads), reverse=True)
    assert [a - b for a, b in pairwise(contacts)] == approx([0.3e-3] * (2 * coils - 1), rel=1e-6)
    low, high = layout.reach_at(layout.pads[0].centre.x)
    assert high - low == approx(0.3e-3 * (2 * coils + 1), rel=1e-6)
    assert layout.bend_zone[1] <= bounding_box([layout.stiffener.outline.outline])[0] + 1e-9


def test_tracks_too_wide_for_tail_yield_tail_room_shortfall(sensor):
    """At 0.3 mm pitch contacts and tracks of six mils, six mils apart, leave each other no room."""
    layout = lay_out(with_fine_connector(sensor(diameter=7e-3, turns=6.5, pitch=8e-3, rules="osh-park-flex")))
    assert [lack.what for lack in layout.shortfalls] == [Missing.TAIL_ROOM]


def with_edge_distance(spec, edge):
    rules = dataclasses.replace(spec.fpc.rules, copper_to_edge=edge)
    return dataclasses.replace(spec, fpc=dataclasses.replace(spec.fpc, rules=rules))


@pytest.mark.parametrize("tail", [True, False])
@pytest.mark.parametrize("edge", [0.15e-3, 0.3e-3, 0.381e-3])
def test_copper_at_contacts_has_required_edge_distance(sensor, edge, tail):
    layout = lay_out(with_edge_distance(sensor(tail=tail), edge))
    assert_sound(layout)
    test_copper_has_required_distance_to_board_edge(layout)
    half = layout.spec.fpc.tail.connector.width(4) / 2 if tail else None
    if half:
        end = max(point.x for point in layout.outline.flattened(1e-6))
        assert max(abs(p.y) for p in layout.outline.flattened(1e-6) if p.x > end - 1e-9) == approx(half, rel=1e-6)


@pytest.mark.parametrize(
    "aside", ["turn: left", "offset: 3", "turn: right, turn_radius: 15", "offset: 3, connector: solder-pads"]
)
@pytest.mark.parametrize("length", [8, 12])
def test_short_tail_is_lengthened_for_turn(aside, length):
    spec = load_text(
        "sitscad: 1\nname: turned\n"
        "coil: {shape: circle, outer_diameter: 7, turns: 8, layers: 2, trace_width: 100 um, trace_spacing: 100 um}\n"
        f"fpc: {{stackup: flex-2l-35um, tail: {{length: {length}, {aside}}}}}\n",
        "turned.yaml",
    )
    assert_sound(lay_out(spec))


def test_long_coil_vias_stay_inside_round_corners():
    """Inner ends of some layers lie in corners that the turns of others round off: no via may stand out there."""
    from .conftest import sensor

    spec = sensor(shape="rectangle", size=(21.1e-3, 11.52e-3), turns=10.25, layers=5, width=120e-6, spacing=100e-6,
                     stackup="flex-6l", rules="generic-flex", coils=1, corner_radius=3.03e-3)
    layout = lay_out(spec)
    assert layout.shortfalls == ()
    assert clashes(layout, 99e-6) == []


@pytest.mark.parametrize("turns", ["0.5", "0.25", "[0.5, 3.5]", "[3.5, 0.5]"])
def test_long_coil_with_partial_turn_has_inner_via(turns):
    """Less than a turn goes round no place, so that it must not be asked to go round the via's."""
    spec = load_text(
        "sitscad: 1\nname: short\n"
        f"coil: {{shape: rectangle, outer_diameter: [9, 6], turns: {turns}, layers: 2, trace_width: 100 um, "
        "trace_spacing: 100 um}\n",
        "short.yaml",
    )
    assert_sound(lay_out(spec))
