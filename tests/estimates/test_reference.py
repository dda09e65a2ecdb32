"""The reference coil: its place, its estimate, and what leaves it out."""

import numpy as np
import pytest
from one_rule import findings_of
from tolerance import approx

import sitscad
from sitscad.basics.finding import Missing, Shortfall
from sitscad.basics.record import replace
from sitscad.checks.board.room import _changes_for_room
from sitscad.checks.fixes.references import farther_references, smaller_references
from sitscad.estimates import estimate_layout
from sitscad.estimates.states.other_jaw import reference_change
from sitscad.estimates.states.reference import reference_signal
from sitscad.estimates.windings.methods import winding_geometry
from sitscad.estimates.windings.neighbours import winding_pair_inductance
from sitscad.kernels.geometry.path import bounding_box
from sitscad.spec.reading import SpecError

TEMPLATE = "templates/grasper_4layer.yaml"


@pytest.fixture(scope="module")
def without(root):
    return sitscad.Design(sitscad.load(root / TEMPLATE))


@pytest.fixture(scope="module")
def design(without):
    return sitscad.Design(without.spec.replace("array.reference", {}))


def test_reference_coil_is_placed_clear_of_coils_and_plates(design):
    layout, spec = design.layout, design.spec
    *sensing, reference = layout.coils
    radius, edge = spec.coil.size[0] / 2, max(spec.target.size[0], spec.elastomer.size[0]) / 2
    assert layout.shortfalls == () and layout.reference is reference and reference.is_closed_circuit
    assert [coil.name for coil in layout.sensing.coils] == ["C1", "C2"] and reference.name == "C3"
    assert reference.centre.x - radius >= max(coil.centre.x for coil in sensing) + radius + 0.5e-3 - 1e-9
    assert reference.centre.x - radius >= edge + radius - 1e-9
    assert {"C3.A", "C3.B"} <= {pad.pin for pad in layout.pads}


def test_reference_coil_estimate_has_no_target_change(design):
    estimates = design.estimates
    assert [coil.name for coil in estimates.all_coils] == ["C1", "C2", "C3"] and len(estimates.coils) == 2
    assert list(estimates.reference.states) == ["free", "rest"]
    rest, other = estimates.reference.states["rest"], estimates.coils[1].states["rest"]
    assert rest.target_change is None and other.target_change < 0.0
    # the same winding behind the same metal: the difference is the target's change, apart from leads and neighbours
    assert rest.inductance - other.inductance == approx(-other.target_change, rel=0.1)


def test_reference_coil_shortens_dwell_time_and_lengthens_read_back(design, without):
    shorter, longer = design.estimates.readout, without.estimates.readout
    assert shorter.scan_rate == approx(longer.scan_rate, rel=1e-3)
    assert shorter.dwell_time == approx(longer.dwell_time * 2 / 3, rel=1e-3)
    assert shorter.read_back_time == approx(1.5 * longer.read_back_time, rel=1e-9)


def test_response_excludes_reference_coil(design, without):
    press = [[0.0] * 6, [0.0, 0.0, -0.05e-3, 0.0, 0.0, 0.0]]
    with_it, alone = (sitscad.respond(each, press) for each in (design, without))
    assert with_it.coils == ("C1", "C2")
    assert np.diff(with_it.inductance, axis=0) == approx(np.diff(alone.inductance, axis=0), rel=1e-3)


OWN = {"shape": "circle", "outer_diameter": "3.4 mm", "turns": 5.5, "layers": 4,
       "trace_width": "80 um", "trace_spacing": "80 um"}


@pytest.fixture(scope="module")
def own(without):
    return sitscad.Design(without.spec.replace({"array.reference": {"coil": OWN}, "readout.capacitance": "330 pF"}))


def test_own_windings_are_drawn_and_estimated_as_coil_alone(own):
    reference = own.layout.reference
    assert own.layout.shortfalls == () and reference.is_closed_circuit
    assert bounding_box([w.path for w in reference.windings])[2] - reference.centre.x < 1.7e-3
    alone = sitscad.Design(own.spec.replace({"array.reference": None, "array.pattern": "single", "coil": OWN,
                                             "array.count": None, "array.pitch": None}))
    single = alone.estimates.coils[0].winding_inductance
    assert own.estimates.reference.winding_inductance == approx(single, rel=1e-9)
    matrix = own.estimates.inductance_matrix
    assert matrix[2][2] == own.estimates.reference.winding_inductance < 0.6 * matrix[0][0]
    assert matrix[1][2] == matrix[2][1] < 0.0


def test_mutual_inductance_of_circle_as_drawn_equals_its_spiral(own):
    pairs = [[(coil, winding_geometry(coil.placement.own or own.spec.coil, coil, is_drawn))
              for coil in own.layout.coils[1:]] for is_drawn in (False, True)]
    spiral, drawn = (winding_pair_inductance(*pair).inductance for pair in pairs)
    assert drawn == approx(spiral, rel=1e-5)


def test_target_signal_on_own_windings_is_solved_for_their_turns(own, design):
    signals = [reference_signal(each.layout, each.estimates) for each in (own, design)]
    assert signals[0].sensing == approx(signals[1].sensing, rel=1e-2)
    assert abs(signals[0].at_rest) < abs(signals[1].at_rest) and signals[0].share < 1e-4


def test_scatter_of_own_windings_is_independent_of_other_coils(own):
    compensation = own.sensing.solved.warmed[-1].compensation
    assert compensation.reading.is_by_metal and compensation.reading.has_own_windings


@pytest.mark.parametrize("change, rule, key", [
    ({"layers": 6}, "SIT009", "array.reference.coil.layers"), ({"turns": 40}, "SIT016", "array.reference.coil.turns"),
    ({"drawn": "a.kicad_mod"}, "SIT002", "array.reference.coil.drawn"),
    ({"turns": None}, "SIT003", "array.reference.coil.turns"),
])
def test_impossible_own_windings_give_spec_error(without, change, rule, key):
    with pytest.raises(SpecError) as refused:
        windings = {name: value for name, value in (OWN | change).items() if value is not None}
        without.spec.replace("array.reference", {"coil": windings})
    (finding,) = refused.value.findings
    assert (finding.rule, finding.key) == (rule, key)


def test_findings_on_own_windings_name_their_keys(without):
    fine = OWN | {"trace_width": "60 um", "trace_spacing": "60 um", "turns": 4, "layers": 2}
    spec = without.spec.replace({"array.reference": {"coil": fine}, "readout.capacitance": "330 pF"})
    keys = {each.rule: each.key for each in sitscad.check(spec).findings if "reference" in (each.key or "")}
    assert keys["SIT101"] == "array.reference.coil.trace_width"
    assert keys["SIT102"] == "array.reference.coil.trace_spacing" and "SIT203" in keys


def test_smaller_references_keep_their_inner_diameter(design):
    first, second = smaller_references(design.spec)
    coils = [fix.spec.reference_coil for fix in (first, second)]
    assert [coil.size[0] for coil in coils] == approx([0.85 * 3.95e-3, 0.7 * 3.95e-3], rel=5e-3)
    assert all(coil.inner_diameter >= design.spec.coil.inner_diameter - 1e-9 for coil in coils)
    assert first.edits[0].key == "array.reference.coil" and first.spec.coil == design.spec.coil


def test_missing_lead_room_tries_reference_coil_farther_away_and_smaller(design):
    farther, smaller, *_ = _changes_for_room(design.spec, Shortfall(Missing.LEAD_ROOM))
    assert next(iter(farther())).edits[0].key == "array.reference.offset"
    assert next(iter(smaller())).edits[0].key == "array.reference.coil"


def test_farther_references_keep_own_windings(own):
    moved = [fix.spec for fix in farther_references(own.spec)]
    assert [spec.reference_coil for spec in moved] == [own.spec.reference_coil] * 3
    places = [spec.reference_placement.centre[0] for spec in (own.spec, *moved)]
    assert np.diff(places) == approx([0.85e-3, 0.85e-3, 1.7e-3], abs=1e-5)


def test_reference_offset_sets_coil_centre(without):
    spec = without.spec.replace("array.reference", {"offset": [-6.6e-3, 0.0]})
    layout = sitscad.lay_out(spec)
    assert layout.shortfalls == () and layout.coils[-1].centre.x == approx(-6.6e-3, rel=1e-9)


def test_reference_offset_onto_other_coil_gives_spec_error(without):
    with pytest.raises(SpecError) as refused:
        without.spec.replace("array.reference", {"offset": [5.0e-3, 0.0]})
    (finding,) = refused.value.findings
    assert finding.rule == "SIT014" and finding.key == "array.reference.offset"
    assert finding.measured == approx(5.0e-3 - 2.1e-3 - 3.95e-3, rel=1e-9)


def test_default_reference_place_follows_array_pitch(without):
    spec = without.spec.replace({"array.reference": {}, "array.pitch": "5 mm"})
    assert spec.reference_placement.centre[0] == approx(2.5e-3 + 3.95e-3 + 0.5e-3, rel=2e-3)


def test_target_signal_in_reference_coil_falls_with_distance(root):
    spec = sitscad.load(root / "tests" / "report" / "broken" / "SIT223.yaml")
    shares = []
    for x in (9.0e-3, 11.0e-3, 17.0e-3):
        design = sitscad.Design(spec.replace("array.reference.offset", (x, 0.0)))
        signal = reference_signal(design.layout, design.estimates)
        sensing = design.estimates.coils[0].states
        assert signal.coil == "C1"
        assert signal.sensing == approx(sensing["pressed"].target_change - sensing["rest"].target_change, rel=0.02)
        shares.append(signal.share)
    assert 0.01 < shares[0] < 0.1 and shares[0] > 5.0 * shares[1] and shares[2] < 1e-4


def test_other_jaw_change_of_reference_coil_equals_plate_over_coil(design):
    estimates = design.estimates
    changes = [reference_change(design.layout, estimates.reference, estimates.temperature, grasped)
               for grasped in (0.0, 1e-3, 4e-3, 20e-3)]
    assert changes == sorted(changes) and changes[-1] == approx(0.0, abs=2e-12)
    # a plate of steel at the height of the other jaw, in the place of a target over the reference coil
    alone = design.layout.reference_alone
    jaw, top = design.spec.jaw, design.spec.elastomer.thickness + design.spec.target.thickness
    wide = {"shape": "square", "size": (40e-3, 40e-3)}
    plate = replace(design.spec.target, thickness=jaw.height, material=jaw.material, **wide)
    pad = replace(design.spec.elastomer, thickness=top + 0.05e-3 + 1e-3, **wide)
    spec = replace(alone.spec, target=plate, elastomer=pad, encapsulation=None)
    covered = estimate_layout(replace(alone, spec=spec), is_solved=False).coils[0].states["rest"]
    assert covered.target_change == approx(changes[1], rel=0.1)


def test_reference_coil_on_second_converter_gives_coupling_finding(design):
    spec = design.spec.replace("readout.device", "ldc1612")
    finding = findings_of("SIT211", spec)[0]
    matrix = sitscad.Design(spec).estimates.inductance_matrix
    assert finding.measured == approx(abs(matrix[1][2]) / matrix[1][1], rel=1e-6)


def test_reference_coil_beyond_jaw_length_gives_error(design):
    spec = design.spec.replace("mount.jaw", {"based_on": "generic-5mm", "length": 13e-3})
    finding = next(each for each in sitscad.check(spec).findings if each.rule == "SIT302")
    assert finding.severity == "error" and finding.measured > finding.limit == 13e-3
    assert "array.reference" in finding.hint


@pytest.mark.parametrize("changes", [{}, {"readout.capacitor_at": None, "readout.capacitors_on_board": "chip-0402"}])
def test_every_coil_with_reference_coil_has_contacts_and_capacitors(design, changes):
    layout = sitscad.lay_out(design.spec.replace(changes) if changes else design.spec)
    assert {pad.pin for pad in layout.pads if pad.pin} == {f"C{k}.{end}" for k in (1, 2, 3) for end in "AB"}
    assert [each.coil for each in layout.capacitors] == (["C1", "C2", "C3"] if changes else [])


def test_calibration_ignores_reference_coil_column(design, tmp_path):
    loads = [[0.0, 0.0, 0.0], *([n, 0.15 * n * way, 0.0] for n in range(1, 7) for way in (-1, 0, 1)), [0.0, 0.0, 0.0]]
    counts = np.round(sitscad.respond(design, loads=loads, rotation="held").counts).astype(int)
    rows = [(load[:2], row) for load, row in zip(loads, counts.tolist(), strict=True)]
    fits = []
    for name, head, extra in (("with", ",C3_counts", [48000000]), ("without", "", [])):
        lines = [",".join(map(str, [*load, *row, *extra])) for load, row in rows]
        table = tmp_path / f"{name}.csv"
        table.write_text("\n".join(["# rotation: held", f"normal_N,shear_x_N,C1_counts,C2_counts{head}", *lines]))
        fits.append(sitscad.calibrate(design, table))
    assert fits[0].map.coils == ("C1", "C2")
    assert np.array_equal(fits[0].map.coefficients, fits[1].map.coefficients)
