"""Every rule of fit and mechanics fires on a design that breaks it and is silent on one that does not."""

from __future__ import annotations

import ast
import math
import re
from dataclasses import replace
from pathlib import Path

import pytest
from one_rule import findings_of
from tolerance import approx

import sitscad
from sitscad import check
from sitscad.assembly.places.fit import OVERHANG, closed_section, fit
from sitscad.basics.finding import Severity
from sitscad.basics.units import parse_quantity
from sitscad.checks.assembly.plates import gain_at_length
from sitscad.estimates.design import Design
from sitscad.estimates.loads.pad import soft_pad
from sitscad.estimates.loads.pressing import pressed_pad
from sitscad.estimates.loads.working_range import extrapolated_shear_note, shear_for_travel, validated_shear
from sitscad.kernels.mechanics.elastomer import VALID_SHEAR
from sitscad.layout import lay_out
from sitscad.spec import presets

TEMPLATES = Path(__file__).parents[2] / "templates"


@pytest.fixture(scope="module")
def drawn():
    """Layouts by the spec's text, laid out once."""
    made = {}

    def layout_of(spec):
        if spec.source.text not in made:
            made[spec.source.text] = lay_out(spec)
        return made[spec.source.text]

    return layout_of


def with_jaw(spec, **figures):
    return replace(spec, mount=replace(spec.mount, jaw=replace(spec.mount.jaw, **figures)))


@pytest.mark.parametrize("number", [1, 2, 4, 5, 6, 7, 9, 10, 11, 12])
def test_valid_design_has_no_fit_finding(number, judge, design, drawn):
    spec = design()
    assert judge(f"SIT3{number:02d}", spec, drawn(spec)) == []


@pytest.mark.parametrize("aside", [{"turn": "left"}, {"offset": 8}])
def test_tail_outside_port_circle_gives_warning(aside, judge, design, drawn):
    spec = design(**{f"fpc__tail__{key}": value for key, value in aside.items()})
    (result,) = judge("SIT301", spec, drawn(spec))
    assert (result.severity, result.key) == (Severity.WARNING, "fpc.tail")
    assert result.measured > 8e-3 and result.limit == spec.mount.jaw.port_diameter


def test_jaw_wider_than_port_without_stated_face_gives_error(judge, design):
    """A face that was measured decides by where it is; without one the back would be taken as narrow as the port."""
    spec = design()
    wide = with_jaw(spec, width=12e-3, port_diameter=10e-3)
    result = [f for f in judge("SIT303", wide, lay_out(wide)) if f.key == "mount.jaw.width"]
    assert [(f.severity, f.measured, f.limit) for f in result] == [("error", 12e-3, 10e-3)]
    flat = with_jaw(spec, width=12e-3, face=4.4e-3, port_diameter=10e-3)
    assert not [f for f in judge("SIT303", flat, lay_out(flat)) if f.key == "mount.jaw.width"]


def test_board_larger_than_jaw_gives_width_and_length_findings(judge, design, drawn):
    spec = design()
    layout = drawn(spec)
    narrow = with_jaw(spec, width=2.6e-3, source="width: unverified: from memory")
    (result,) = judge("SIT301", narrow, replace(layout, spec=narrow))
    assert result.severity is Severity.ERROR and result.limit == approx(0.6e-3, rel=1e-9) and result.measured > 0.6e-3
    assert f"{1e3 * layout.body_size[1]:.4g} mm" in result.message
    assert {"width-shares", "jaw-unverified"} <= set(result.cases) and "4 mm" in result.detail
    measured = with_jaw(spec, width=2.6e-3, source="measured with a calliper")
    (result,) = judge("SIT301", measured, replace(layout, spec=measured))
    assert "jaw-unverified" not in result.cases
    short = with_jaw(spec, length=9e-3)
    (result,) = judge("SIT302", short, replace(layout, spec=short))
    assert layout.body_size[0] < result.measured < layout.body_size[0] + 0.15e-3 and result.limit == 9e-3


@pytest.mark.parametrize(
    ("port", "severity"),
    [(4.6e-3, Severity.ERROR), (5.0e-3, Severity.ERROR), (5.5e-3, Severity.WARNING), (6e-3, None)],
)
@pytest.mark.parametrize("source", ["width: unverified: from memory", "measured"])
def test_closed_pair_larger_than_port_gives_warning_or_error(port, source, severity, judge, design, drawn):
    """Nominally 4.99 mm, 5.2 by root-sum-square, 5.6 at worst (more on a wider back); sources change nothing."""
    spec = with_jaw(design(), port_diameter=port, source=source)
    result = judge("SIT303", spec, replace(drawn(design()), spec=spec))
    result = [f for f in result if f.key != "mount.jaw.width"]
    assert [f.severity for f in result] == ([severity] if severity else [])
    for f in result:
        assert f.limit == port < f.measured < 5.9e-3
        assert "elastomer.thickness" in f.hint
        assert "elastomer.thickness 1 mm" in f.detail and "elastomer +-150 um" in f.detail
        assert ("jaw-unverified" in f.cases) == (source != "measured") and "150 um" in f.detail
        assert ("pair-measured-port" in f.cases) == (f.measured <= 1.1 * port)


@pytest.mark.parametrize(("layers", "severity", "most"), [(4, Severity.ERROR, 2.0), (2, Severity.WARNING, 1.0)])
def test_dynamic_bend_with_several_layers_gives_warning_or_error(judge, design, layers, severity, most):
    spec = design(fpc__tail__bend="dynamic", fpc__tail__layers=layers, fpc__stackup="flex-4l")
    (result,) = [f for f in judge("SIT308", spec, lay_out(spec)) if f.key == "fpc.tail.layers"]
    assert (result.severity, result.measured, result.limit) == (severity, layers, most)


@pytest.mark.parametrize(("layers", "severity"), [(2, Severity.WARNING), (1, Severity.NOTE)])
def test_static_tail_at_jaw_hinge_gives_bend_finding(layers, severity, judge, design):
    """Only the assembly steps said so, after the boards were bought."""
    hinged = {"mount__jaw__hinge": 8, "mount__jaw__opening": "60 deg", "mount__jaw__port_diameter": 20,
              "fpc__tail__layers": layers}
    (result,) = judge("SIT308", design(**hinged))
    assert result.key == "fpc.tail.bend" and result.severity is severity
    dynamic = judge("SIT308", design(**hinged, fpc__tail__bend="dynamic"))
    assert bool(dynamic) is (severity is Severity.WARNING)
    assert judge("SIT308", design(**hinged, fpc__tail__bend="none")) == []
    assert judge("SIT308", design(fpc__tail__layers=layers)) == [], "no hinge"


def test_bench_plate_leaves_jaw_rules_not_checked(verdicts, design, drawn):
    spec = design(mount={"kind": "bench-plate", "standoff": 0.7})
    for rule in ("SIT301", "SIT302", "SIT303", "SIT311"):
        findings, skipped = verdicts(rule, spec, drawn(spec))
        assert findings == [] and skipped[0].case == "no-jaw"


def test_soft_thesis_pad_gives_compression_error(judge, design):
    miniature = {"material": "ecoflex-00-30", "shape": "square", "size": 4, "thickness": 2, "kerf": 0.15}
    spec = design(elastomer=miniature, encapsulation=None)
    (result,) = judge("SIT304", spec)
    assert (result.severity, result.limit) == (Severity.ERROR, 0.5)
    assert 0.57 < result.measured < 0.73 and "compression-beyond" in result.cases
    known = {"shear_modulus": 39.4e3, "shear_modulus_sigma": 0.0, "ogden_exponent": 2.0}
    pad = replace(spec.elastomer, material=replace(spec.elastomer.material, **known))
    (stiff,) = judge("SIT304", replace(spec, elastomer=pad))
    assert stiff.measured == approx(0.57, abs=0.005)
    (skinned,) = judge("SIT304", design(elastomer=miniature))
    assert skinned.measured < result.measured


@pytest.mark.parametrize(
    ("modulus", "sigma", "severity", "limit"),
    [
        (200e3, 0.1, None, 0),
        (36e3, 0.35, Severity.WARNING, 0.3),
        (30e3, 0.1, Severity.WARNING, 0.3),
        (40e3, 0.7, Severity.WARNING, 0.3),
        (8e3, 0.1, Severity.ERROR, 0.5),
    ],
)
def test_large_pad_strain_gives_warning_or_error(modulus, sigma, severity, limit, judge, design):
    spec = design(encapsulation=None)
    material = replace(spec.elastomer.material, shear_modulus=modulus, shear_modulus_sigma=sigma)
    result = judge("SIT304", replace(spec, elastomer=replace(spec.elastomer, material=material)))
    assert [(f.severity, f.limit) for f in result] == ([(severity, limit)] if severity else [])
    assert all(f.measured > f.limit for f in result)


@pytest.mark.parametrize("bulk_modulus", [1.5e9, 3e6])
@pytest.mark.parametrize(("modulus", "sigma"), [(25e3, 0.0), (36e3, 0.35), (25e3, 0.7), (40e3, 1.5)])
def test_suggested_modulus_is_smallest_that_meets_strain_limit(modulus, sigma, bulk_modulus, judge, advised, design):
    """The hint, followed to its last digit, is enough; a hundredth less is not."""
    spec = design(encapsulation=None)
    soft = replace(spec.elastomer.material, shear_modulus=modulus, shear_modulus_sigma=sigma, bulk_modulus=bulk_modulus)
    (result,) = advised("SIT304", replace(spec, elastomer=replace(spec.elastomer, material=soft)))
    number, unit = re.search(r"shear modulus of ([\d.]+) ([kM]?Pa)", result.hint).groups()
    wanted = parse_quantity(f"{number} {unit}", "pressure")
    for factor, count in ((1.0, 0), (0.98, 1)):
        enough = replace(soft, shear_modulus=wanted * factor)
        assert len(judge("SIT304", replace(spec, elastomer=replace(spec.elastomer, material=enough)))) == count


@pytest.mark.parametrize(("celsius", "severity"), [(200, Severity.NOTE), (60, Severity.NOTE), (-60, Severity.WARNING)])
def test_pad_strain_is_computed_with_modulus_at_sensor_temperature(celsius, severity, judge, design):
    """At -60, 20 and 200 degrees the strain was the same, without a word."""
    spec = design(encapsulation=None, requirements__temperature=f"{celsius} degC")
    law = {"shear_modulus": 34e3, "shear_modulus_sigma": 0.0}
    spec = replace(spec, elastomer=replace(spec.elastomer, material=replace(spec.elastomer.material, **law)))
    (result,) = judge("SIT304", spec)
    assert result.severity is severity and f"{celsius} degC" in result.message
    more = 1.0 + 3411e-6 * (celsius - 20.0)
    there = replace(spec.elastomer.material, shear_modulus=34e3 * more)
    there = replace(spec, elastomer=replace(spec.elastomer, material=there))
    assert result.measured == approx(pressed_pad(there).strain,
                                    rel=1e-9) and result.keeps_limit is (result.measured <= 0.3)


def test_pad_at_room_temperature_gives_no_finding(judge, design):
    assert judge("SIT304", design(requirements__temperature="30 degC")) == []


@pytest.mark.slow
def test_shear_beyond_data_sheet_range_gives_warning():
    """1 N beyond a range of 0.82 N passed with a note: one was judged under the full normal force, the other without
    one, too, where this target goes farther.
    """
    spec = sitscad.load(Path(__file__).parents[2] / "templates" / "grasper_4layer.yaml")
    small = spec.replace("target.size", [0.7 * side for side in spec.target.size])
    most = shear_for_travel(small, VALID_SHEAR)
    for share, severity in ((0.99, Severity.NOTE), (1.01, Severity.WARNING)):
        findings = check(small.replace("requirements.shear_force", f"{share * most:.6g} N"), hints="none").findings
        strained = [f.severity for f in findings if f.rule == "SIT312" and f.limit == VALID_SHEAR]
        assert strained == [severity]


def of_pad(found):
    """Findings of the pad, without the note that its law is extrapolated."""
    return [f for f in found if f.key != "requirements.shear_force"]


@pytest.mark.parametrize("rule", ["SIT304", "SIT312"])
@pytest.mark.parametrize("force", [3.0, 4.8, 9.0])
def test_suggested_elastomer_is_softest_sufficient_preset(rule, force, judge, advised, design):
    soft = {"material": "ecoflex-00-10", "shape": "square", "size": 4, "thickness": 1, "kerf": 0.15}
    wanted = {"requirements__normal_force": f"{force} N", "requirements__shear_force": f"{force / 5} N"}
    wanted |= {"target__size": 4, "array": None, "encapsulation": None}
    result, *_ = advised(rule, design(elastomer=soft, **wanted))
    named = re.search(r"elastomer\.material: ([\w-]+)", result.hint).group(1)
    moduli = {name: presets.elastomer(name).shear_modulus for name in presets.names("elastomer")}
    enough = {name for name in moduli if not of_pad(judge(rule, design(elastomer=soft | {"material": name}, **wanted)))}
    assert named == min(enough, key=lambda name: (moduli[name], name))


def test_hint_suggests_no_preset_if_none_is_stiff_enough(advised, design):
    result, *_ = advised("SIT304", design(target__size=4, elastomer__size=4, requirements__normal_force="400 N"))
    assert "compression-stiffer" in result.cases


def test_strain_message_shows_measured_value_and_limit(judge, design):
    spec = design(encapsulation=None)
    for modulus, sigma in ((36e3, 0.35), (40e3, 0.7), (8e3, 0.1)):
        material = replace(spec.elastomer.material, shear_modulus=modulus, shear_modulus_sigma=sigma)
        (found,) = judge("SIT304", replace(spec, elastomer=replace(spec.elastomer, material=material)))
        shown = re.findall(r"([\d.]+) %", found.message)
        assert {f"{100 * found.measured:.3g}", f"{100 * found.limit:.3g}"} <= set(shown)


@pytest.mark.slow
def test_body_too_large_by_margin_gets_sufficiently_smaller_margin(judge, advised, design):
    """The margin was called room for leads and vias, and smaller coils were asked for."""
    spec = design(fpc__margin=[10, 0.5])
    layout = lay_out(spec)
    (wide,), (long,) = (
        [f for f in advised(rule, spec, layout) if f.key == "fpc.margin"] for rule in ("SIT301", "SIT302")
    )
    assert "width-margin" in wide.cases and "1 mm" in wide.detail
    (narrow,), (short,) = ([ast.literal_eval(fix.edits[0].new) for fix in result.fixes] for result in (wide, long))
    assert narrow[0] == 10 and short[1] == 0.5
    less = design(fpc__margin=[short[0], narrow[1]])
    drawn = lay_out(less)
    left = [f for rule in ("SIT301", "SIT302") for f in judge(rule, less, drawn) if "body" in f.message]
    assert not [f for f in left if f.severity is not Severity.NOTE]


@pytest.mark.parametrize(("width", "severity"), [(4.0, "note"), (3.0, "error")])
def test_body_wider_than_jaw_agrees_with_fit_line(width, severity, design):
    """4.16 mm on a jaw of 4 mm was an error while the line of fit had 745 um to spare."""
    spec = design(mount={"kind": "grasper-pad", "jaw": {"based_on": "generic-5mm", "width": width}, "standoff": 0.7})
    result = check(spec, hints="none")
    (over,) = [each for each in result.fit if each.name == OVERHANG]
    (findings,) = [each for each in result.findings if each.rule == "SIT301"]
    assert (findings.measured, findings.limit) == (over.measured, over.limit) and findings.severity == severity
    assert (over.root_sum_square > over.limit) == (severity == "error")


def test_offset_plate_is_compared_with_jaw_at_its_position(judge, design):
    """A pad of 4 mm passed on a jaw of 4.8 mm wherever it stood."""
    narrow = {"target__size": 4, "elastomer__size": 4, "elastomer__offset": [0, 0.3]}
    assert [f.key for f in judge("SIT301", design(**narrow | {"elastomer__offset": [0, 0.3]}))] == []
    (result,) = judge("SIT301", design(**narrow | {"elastomer__offset": [0, 0.7]}))
    assert result.key == "elastomer.offset" and result.measured == approx(5.4e-3, rel=1e-6)
    assert "plate-aside" in result.cases and "700 um" in result.message and "300 um" in result.hint
    (turned,) = judge("SIT301", design(target__size=4, target__rotation="45 deg"))
    assert turned.key == "target.size" and turned.measured == approx(4e-3 * math.sqrt(2), rel=1e-6)


def test_rotated_target_is_checked_by_length_along_coils(judge, design):
    wide = {"target__shape": "rectangle", "target__size": [4.2, 9],
            "elastomer__shape": "rectangle", "elastomer__size": [9, 9]}
    assert [f.measured for f in judge("SIT306", design(**wide))] == []
    (result,) = judge("SIT306", design(**wide, target__rotation="90 deg"))
    assert result.key == "target.size" and result.measured > result.limit
    assert "target.rotation" in result.hint


def test_short_target_of_two_coils_gives_signal_and_width_findings(judge, design):
    gain, width = judge("SIT306", design(target__size=3.5, elastomer__size=3.5))
    assert gain.severity is Severity.WARNING and gain.measured > gain.limit == approx(1.25, rel=1e-9)
    assert (width.measured, width.limit) == approx((3.5e-3, 4e-3), rel=1e-6)


@pytest.mark.parametrize(("length", "is_told"), [(4.0, False), (5.6, False), (6.2, False), (9.0, True), (10.0, True)])
def test_long_target_of_two_coils_gives_finding_only_if_signals_shrink(judge, design, length, is_told):
    """A target a quarter longer gave twice the normal signal for a little shear, and was warned of."""
    size = {"target__shape": "rectangle", "target__size": [length, 4.5],
            "elastomer__shape": "rectangle", "elastomer__size": [length, 4.5]}
    assert bool(judge("SIT306", design(**size))) is is_told


@pytest.mark.slow
def test_gain_at_other_target_length_agrees_with_noise_ratio(design):
    """Beside what is felt: the noise at rest of both axes under both targets."""
    def sized(length):
        size = {"shape": "rectangle", "size": [length, 4.5]}
        changes = {f"{part}__{key}": value for part in ("target", "elastomer") for key, value in size.items()}
        return Design(design(**changes, encapsulation=None))

    long, usual = sized(6.0), sized(4.5)
    gain = gain_at_length(long, 4.5e-3, 1.0)
    noise = [[float(item.sensing.analysis.points[0].noise[axis]) for axis in (0, 1)] for item in (long, usual)]
    assert (gain.normal, gain.shear) == approx((noise[0][0] / noise[1][0], noise[0][1] / noise[1][1]), rel=0.2)


def test_long_target_with_both_resolutions_required_gives_no_length_finding(judge, design):
    request = {"normal_force": "4.8 N", "shear_force": "1 N", "normal_resolution": "1 N", "shear_resolution": "1 N"}
    size = {"target__shape": "rectangle", "target__size": [10, 4.5]}
    assert judge("SIT306", design(**size, requirements=request)) == []


def test_long_target_without_required_shear_gives_no_finding(judge, design):
    long = {"target__shape": "rectangle", "target__size": [9, 4.5], "requirements": {"normal_force": "4.8 N"}}
    assert judge("SIT306", design(**long)) == []


def test_target_smaller_than_single_coil_gives_findings(judge, design):
    result = judge("SIT306", design(array=None, target__size=3.9))
    assert [f.limit for f in result] == [approx(4e-3, rel=1e-6)] * 2
    assert judge("SIT306", design(array=None, target__size=6)) == []


def test_offset_target_beside_single_coil_gives_finding(judge, design):
    """Only its size was held against the coil: with no force required, a target beside every coil passed in silence."""
    for offset, over in (([12, 0], 12e-3), ([0, 1.5], 1.5e-3), ([-2, 1.2], 2e-3)):
        (result,) = judge("SIT306", design(array=None, target__size=4, target__offset=offset))
        assert result.key == "target.offset" and result.measured == approx(over, rel=1e-6)
        assert "target-aside" in result.cases and "C1" in result.message and "target.offset: [0, 0]" in result.hint
    assert judge("SIT306", design(array=None, target__size=8, target__offset=[1.9, -1.9])) == []
    assert len(judge("SIT306", design(array=None, target__size=8, target__offset=[2.1, 0]))) == 1


def test_offset_target_that_misses_array_coil_gives_finding(judge, design):
    (result,) = judge("SIT306", design(target__size=4.5, target__offset=[4, 0]))
    assert "C1" in result.message and result.measured == approx(4e-3, rel=1e-6)
    assert judge("SIT306", design(target__size=4.5, target__offset=[0.3, 0.2])) == []
    grid = {"pattern": "grid", "count": [2, 2], "pitch": 5}
    (result,) = judge("SIT306", design(array=grid, target__size=8, target__offset=[0, -3]))
    assert "C2, C4" in result.message


def test_target_between_grid_coils_gives_finding(judge, design):
    grid = {"pattern": "grid", "count": [2, 2], "pitch": 10}
    (result,) = judge("SIT306", design(array=grid, target__size=5))
    assert result.key == "target.size" and result.measured == approx(2.5e-3 * math.sqrt(2), rel=1e-6)
    assert judge("SIT306", design(array=grid, target__size=9)) == []


def test_target_shorter_than_racetrack_coil_gives_finding(judge, design):
    """The lesser side was held against the lesser side: a short target over a racetrack passed."""
    long = {"shape": "racetrack", "outer_diameter": [10, 4], "turns": 6.5}
    coil = {f"coil__{key}": value for key, value in long.items()}
    spec = design(array=None, **coil, target__shape="rectangle", target__size=[8, 4])
    (result,) = judge("SIT306", spec)
    assert (result.measured, result.limit) == (
        approx(8e-3, rel=1e-6),
        approx(10e-3, rel=1e-6),
    ) and "long" in result.message


def test_target_length_is_not_checked_for_grid_or_three_coils(verdicts, design):
    for array in ({"pattern": "grid", "count": [2, 2], "pitch": 5}, {"pattern": "line", "count": 3, "pitch": 4.5}):
        findings, skipped = verdicts("SIT306", design(array=array, target__size=8))
        assert findings == [] and skipped[0].case == "target-length-line"


def test_small_target_on_large_pad_increases_strain_and_shear(judge, design):
    """Stiffness of the whole pad made both come out too low, on the unsafe side."""
    soft = {"material": "dragon-skin-10", "shape": "square", "size": 8, "thickness": 1, "kerf": 0.15}
    assert judge("SIT304", design(elastomer=soft, target__size=8)) == []
    (result,) = judge("SIT304", design(elastomer=soft, target__size=3, encapsulation=None))
    assert result.measured > result.limit and "14 %" in result.whole_message
    thick = {**soft, "material": "ecoflex-00-30", "thickness": 2}
    bare = {"elastomer": thick, "encapsulation": None, "requirements__normal_force": "0.2 N"}
    assert [f.severity for f in judge("SIT312", design(target__size=8, **bare))] == [Severity.NOTE]
    strained, moved = judge("SIT312", design(target__size=3.5, **bare))
    assert strained.severity is Severity.WARNING and strained.limit == VALID_SHEAR
    modulus = design(elastomer=thick).elastomer.material.shear_modulus
    assert 0.3 < moved.measured / (1.0 * 2e-3 / (modulus * 12.25e-6)) < 0.8  # the rim helps


def test_bend_radius_below_minimum_gives_finding(judge, verdicts, design, drawn):
    films = [film.thickness for film in design().fpc.stackup.layers]
    thin = sum(films[:4]) + films[-1]  # two of four copper layers, between the coverlays
    assert judge("SIT308", design(fpc__tail__bend="none")) == []
    assert judge("SIT308", design()) == []
    (note,) = judge("SIT308", with_jaw(design(), port_diameter=2.4e-3))
    assert note.severity is Severity.NOTE and note.measured == approx(10 * thin, rel=1e-6)
    whole = design(fpc__tail__layers=4)
    (thick,) = judge("SIT308", whole)
    assert thick.severity is Severity.WARNING
    assert thick.measured == approx(20 * sum(film.thickness for film in whole.fpc.stackup.layers), rel=1e-6)
    dynamic = judge("SIT308", design(fpc__tail__bend="dynamic"))
    assert [f.severity for f in dynamic] == [Severity.WARNING, Severity.WARNING]
    assert dynamic[1].measured == approx(40 * thin, rel=1e-6)
    many = judge("SIT308", design(fpc__tail__bend="dynamic", fpc__tail__layers=4))
    assert many[0].severity is Severity.ERROR and many[0].measured == 4.0
    item = judge("SIT308", design(fpc__tail__bend="dynamic", fpc__tail__layers=1))
    assert [f.unit for f in item] == ["m"]
    free = verdicts("SIT308", design(mount=None, shield=None))
    assert free[0] == [] and free[1][0].case == "no-bend-room"
    roomy = with_jaw(design(), port_diameter=10e-3)
    assert judge("SIT308", roomy) == []


def test_shield_deeper_than_standoff_gives_finding(judge, design):
    spec = design()
    deep = replace(spec, shield=replace(spec.shield, gap=0.7e-3))
    (result,) = judge("SIT309", deep)
    assert (
        result.measured == approx(0.8e-3, rel=1e-6)
        and result.limit == approx(0.7e-3, rel=1e-6)
        and "100 um" in result.hint
    )
    assert judge("SIT309", spec) == []


def test_shield_narrower_than_coils_gives_warning(judge, design):
    """Low in the standoff the port leaves 3.4 mm, the coils are 4 mm."""
    jaw = {"kind": "grasper-pad", "jaw": "generic-5mm", "standoff": 1.6}
    low = design(mount=jaw, shield__gap=1.5)
    (result,) = judge("SIT309", low)
    assert result.severity is Severity.WARNING and result.measured < 4e-3 and result.limit == approx(4e-3, rel=1e-6)
    assert (
        judge("SIT309", design(mount__standoff=1.6, shield__gap=1.5, mount__kind="bench-plate", mount__jaw=None)) == []
    )


def test_slender_pad_gives_target_tilt_note(judge, design):
    (result,) = judge("SIT310", design(elastomer__thickness=2))
    assert result.severity is Severity.NOTE and result.measured == approx(2 / 4.5, rel=1e-6)
    assert judge("SIT310", design(elastomer__size=8, elastomer__thickness=2, target__size=8)) == []
    (small,) = judge("SIT310", design(elastomer__size=8, elastomer__thickness=2))
    assert small.measured == approx(2 / 4.5, rel=1e-6)


@pytest.mark.parametrize(("thickness", "severity"), [(1.5, Severity.WARNING), (2, Severity.ERROR)])
def test_unstable_pad_gets_largest_stable_thickness(thickness, severity, judge, design):
    """The hint of a pad of 1.5 mm named 2 mm, which gives way even with the target held level."""
    wide = {"target__size": 8, "elastomer__size": 8, "elastomer__material": "dragon-skin-10", "encapsulation": None,
            "requirements__normal_force": "60 N"}
    (result,) = judge("SIT310", design(elastomer__thickness=thickness, **wide))
    assert result.severity is severity and result.limit < result.measured == approx(thickness / 8, rel=1e-6)
    (named,) = re.findall(r"([0-9.]+) mm", result.hint)
    assert float(named) == approx(8 * result.limit, rel=1e-6)
    assert judge("SIT310", design(elastomer__thickness=float(named), **wide)) == []
    (more,) = judge("SIT310", design(elastomer__thickness=float(named) + 0.1, **wide))
    assert more.severity is Severity.WARNING


def test_tilt_message_names_force_for_one_coil_and_shear_for_two(judge, design):
    """It has no other coil to tell shear by."""
    (item,) = judge("SIT310", design(elastomer__thickness=3, array=None))
    (two,) = judge("SIT310", design(elastomer__thickness=3))
    assert item.cases[0] == two.cases[0] == "slender" and "force" in item.message and "shear" in two.message


def test_bare_metal_target_gives_warning(judge, design):
    (result,) = judge("SIT311", design(encapsulation=None))
    assert result.severity is Severity.WARNING and "copper" in result.message
    assert judge("SIT311", design()) == []


def test_sheared_thin_pad_gives_strain_warning(judge, design):
    """A pad sheared by 540 % passed: its travel was less than half the coils' distance, for it was thin."""
    soft = {"material": "ecoflex-00-30", "shape": "square", "size": 4, "thickness": 0.3, "kerf": 0.15}
    bare = {"target__size": 4, "requirements__shear_force": "2 N", "encapsulation": None}
    (result,) = judge("SIT312", design(elastomer=soft, **bare))
    assert result.severity is Severity.WARNING and result.measured > 3.0 and "unverified" in result.source
    wanted, unit = re.search(r"shear modulus of ([\d.]+) (\wPa)", result.hint).groups()
    material = design(elastomer=soft).elastomer.material
    stiff = {"name": "stiff", "uncertainty": material.shear_modulus_sigma, "shear_modulus": f"{wanted} {unit}",
             "ogden_exponent": material.ogden_exponent}
    assert of_pad(judge("SIT312", design(elastomer=soft | {"material": stiff}, **bare))) == []


def test_shear_travel_beyond_half_pitch_gives_finding(judge, verdicts, design):
    neo_hookean = {"name": "soft", "shear_modulus": "23.8 kPa", "uncertainty": 0.5}
    pad = {"material": neo_hookean, "shape": "square", "size": 4, "thickness": 2, "kerf": 0.15}
    soft = design(elastomer=pad, target__size=4, encapsulation=None, requirements__normal_force="0.2 N")
    strained, result = judge("SIT312", soft)
    travel = soft_pad(soft).pose([[0.2, 1.0, 0.0], [0.0, 1.0, 0.0]], is_held=True)[:, 0].max()
    assert result.measured == approx(travel, rel=1e-6) and result.limit == approx(2.25e-3, rel=1e-6)
    assert strained.measured == approx(travel / 2e-3, rel=1e-6)
    plain = 1.0 / (soft.elastomer.material.shear_modulus * 16e-6)
    assert 0.8 < strained.measured / plain < 1.1  # bonded edges and bending soften, large shear hardens
    (lost,) = judge("SIT312", design(elastomer=pad, target__size=4, encapsulation=None))
    assert lost.severity is Severity.WARNING and "shear-lost" in lost.cases
    assert not of_pad(judge("SIT312", design(elastomer=pad, target__size=4)))  # a skin of PDMS bears it
    assert verdicts("SIT312", design(array=None))[1][0].case == "no-pitch"


@pytest.mark.parametrize(("force", "kind", "has_room"), [
    ("3 N", "grasper-pad", False),
    ("3 N", "bench-plate", True),
    ("1.2 N", "grasper-pad", True),
])
def test_shear_hint_proposes_larger_target_only_if_jaw_has_room(judge, design, force, kind, has_room):
    """117 mm2 were asked for on a face of 100 mm2."""
    mount = {"kind": kind, "standoff": 0.7} | ({"jaw": "generic-5mm"} if kind == "grasper-pad" else {})
    soft = {"material": "ecoflex-00-50", "shape": "square", "size": 4.5, "thickness": 1}
    spec = design(mount=mount, elastomer=soft, shield=None, encapsulation=None, requirements__shear_force=force)
    finding = judge("SIT312", spec)[0]
    assert any(case.startswith("shear-jaw") for case in finding.cases) is not has_room
    request = float(re.search(r"target and pad (?:need|of) ([\d.]+) mm2", finding.hint)[1])
    room = spec.mount.jaw.width * spec.mount.jaw.length * 1e6 if spec.mount.jaw else math.inf
    assert (request <= room) is has_room


@pytest.mark.parametrize(("size", "force", "severity"), [(9, 4, "warning"), (9, 30, "error"), (4.5, 4, "error")])
def test_small_target_gives_error_only_if_strain_is_certain(size, force, severity, judge, design):
    """What lies around it was taken as not helping, and the upper bound that this is refused pads that hold."""
    spec = design(
        mount=None, shield=None, encapsulation=None, elastomer__offset=[1.5 if size > 4.5 else 0, 0],
        elastomer__size=size, elastomer__thickness=2, elastomer__material="ecoflex-00-30",
        requirements__normal_force=f"{force} N",
    )
    (result,) = judge("SIT304", spec)
    assert result.severity.value == severity
    if severity == "error":
        assert result.measured > result.limit == 0.5
        assert ("compression-helped" in result.cases) is (size > 4.5)


def test_body_width_detail_includes_coils_off_axis(judge, design):
    centres = [[0, 0], [7.5, 0], [15, 0], [0, 7.5]]
    spec = design(coil__outer_diameter=6, array={"pattern": "explicit", "centres": centres})
    (result,) = judge("SIT301", with_jaw(spec, width=10e-3, length=60e-3, port_diameter=60e-3), lay_out(spec))
    assert "width-shares" in result.cases and "13.5 mm" in result.detail


@pytest.mark.parametrize(("standoff", "count"), [(0.73, 1), (0.7, 0), (1.09, 1), (1.1, 0)])
def test_too_thin_printed_wall_over_shield_gives_error(standoff, count, judge, design):
    """A standoff of 0.73 mm over a shield that ends at 0.7 mm printed a sheet of 0.03 mm without a word."""
    result = judge("SIT314", design(mount__standoff=standoff))
    assert len(result) == count
    for item in result:
        assert item.severity is Severity.ERROR and item.measured == approx(standoff * 1e-3 - 0.7e-3, rel=1e-6)
        assert item.limit == 0.4e-3 and {"0.7", "1.1"} <= set(item.hint.split())


def test_coarser_print_process_raises_minimum_thickness(judge, design):
    assert judge("SIT314", design(mount__process="resin")) == []
    (result,) = judge("SIT314", design(mount__process="powder"))
    assert result.key == "shield.gap" and result.limit == 0.7e-3 and result.measured == approx(0.6e-3, rel=1e-6)
    assert judge("SIT314", design(mount={"kind": "bench-plate", "standoff": 2}, shield=None)) == []


def test_board_overhang_beyond_jaw_face_is_limited_by_seat_thickness(judge, design):
    """4.712 mm on a face of 4.386 mm passed in silence, for the bar that the jaw is milled from is 4.8 mm wide."""
    jaw = {"kind": "grasper-pad", "jaw": "generic-5mm", "standoff": 0.7}
    (note,) = judge("SIT301", design(mount=jaw))
    assert note.severity is Severity.NOTE and note.limit == approx(0.6e-3, rel=1e-6)
    (bare,) = judge("SIT301", design(mount=jaw | {"standoff": 0.1}, shield=None, elastomer__thickness=0.5))
    assert bare.severity is Severity.ERROR and bare.limit == approx(0.1e-3, rel=1e-6) and bare.measured > bare.limit


def test_board_below_pocket_rim_must_fit_pocket(judge, design):
    jaw = {"width": 4.8, "length": 20, "height": 1.3, "port_diameter": 8, "recess": 1, "pocket": [18, 3.7]}
    mount = {"kind": "grasper-pad", "jaw": jaw, "standoff": 0.7}
    (result,) = judge("SIT301", design(mount=mount))
    assert result.key == "mount.standoff" and result.limit == approx(3.5e-3, rel=1e-6) and "300 um" in result.message
    assert judge("SIT301", design(mount=mount | {"standoff": 1})) == []
    (short,) = judge("SIT301", design(mount=mount | {"standoff": 1, "jaw": jaw | {"pocket": [9, 3.7]}}))
    assert " 9 mm" not in short.message and short.limit == approx(8.8e-3, rel=1e-6)


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("thickness", [0.9e-3, 1.3e-3])
def test_suggested_height_reduction_is_just_sufficient(thickness):
    """The circle shrinks by less than the stack: 236 um off a pad of 1.3 mm left it 14 um too high."""
    spec = sitscad.load(Path(__file__).parents[2] / "templates" / "grasper_4layer.yaml").replace(
        "elastomer.thickness", f"{1e3 * thickness} mm"
    )
    finding = next(item for item in check(spec).findings if item.rule == "SIT303")
    less = 1e-6 * float(re.search(r"([\d.]+) um", finding.hint)[1])
    assert "pair-height" in finding.cases and less > finding.measured - finding.limit
    mended = spec.replace("elastomer.thickness", f"{1e3 * (thickness - less)} mm")
    severities = [item.severity for item in findings_of("SIT303", mended)]
    assert finding.severity not in severities
    barely = spec.replace("elastomer.thickness", f"{1e3 * (thickness - less) + 0.01} mm")
    assert finding.severity in [item.severity for item in findings_of("SIT303", barely)]


@pytest.mark.slow
def test_board_edges_outside_port_circle_get_smaller_margin():
    """The hint offered heights alone where the board's edges, wide by their margin, left the port's circle. 30 um of
    margin would be narrow enough, had leads not then room for their wider gaps.
    """
    spec = sitscad.load(Path(__file__).parents[2] / "templates" / "grasper_4layer.yaml").replace(
        "fpc.margin", [0.15e-3, 0.2e-3]
    )
    finding = next(item for item in check(spec, hints="full").findings if item.rule == "SIT303")
    assert "closed-pair" in finding.cases and "board body" in finding.message
    ((edit,),) = (fix.edits for fix in finding.fixes)
    margin = ast.literal_eval(edit.new)
    assert edit.key == "fpc.margin" and margin[0] == 0.15 and 0.0 <= margin[1] <= 0.02
    mended = spec.replace(edit.key, [1e-3 * side for side in margin])
    assert findings_of("SIT303", mended) == []
    high = next(item for item in check(mended.replace("elastomer.thickness", 1.5e-3), hints="none").findings
                if item.rule == "SIT303")
    assert "pair-height" in high.cases and "opposing jaw" in high.message
    unread = findings_of("SIT303", spec)[0]
    assert "338 um" in unread.hint


@pytest.mark.slow
def test_margin_fix_for_narrow_face_includes_wider_lead_gaps():
    """50 um of margin were named, with which the board is 8 um wider than that leaves it, and fails as before."""
    spec = sitscad.load(Path(__file__).parents[2] / "templates" / "grasper_4layer.yaml").replace(
        {"fpc.margin": [0.15e-3, 0.2e-3], "mount.jaw": {"based_on": "generic-5mm", "face": 4.015e-3}}
    )
    (findings,) = [f for f in check(spec, hints="full").findings if f.rule == "SIT301" and f.severity is Severity.ERROR]
    (fix,) = findings.fixes
    assert [(edit.key, ast.literal_eval(edit.new)[0]) for edit in fix.edits] == [("fpc.margin", 0.15)]
    assert ast.literal_eval(fix.edits[0].new)[1] <= 0.04


@pytest.mark.parametrize(("share", "is_said"), [(0.99, False), (1.01, True), (1.9, True)])
def test_shear_beyond_validated_range_gives_note_of_extrapolation(share, is_said, judge, design):
    """The data sheet and the calibration said it; the check of the required force said nothing."""
    rubber = {"name": "x", "shear_modulus": "60 kPa", "uncertainty": 0}
    pad = {"thickness": 1, "size": 4, "material": rubber}
    spec = design(elastomer=pad, target__size=4, encapsulation=None, requirements__shear_force="1 N")
    held = validated_shear(spec)
    request = replace(spec, requirements=replace(spec.requirements, shear_force=share * held))
    result = [f for f in judge("SIT312", request) if f.key == "requirements.shear_force"]
    assert [f.severity for f in result] == [Severity.NOTE] * is_said
    assert all(f.limit == held and extrapolated_shear_note(held) in f.detail for f in result)


def test_unstable_pressed_pad_has_zero_validated_shear():
    """"Shear beyond 0 N, half the pad's thickness" was said of it."""
    path = Path(__file__).parents[2] / "templates" / "bench_7mm.yaml"
    slender = sitscad.load(path).replace("elastomer.thickness", 5e-3)
    assert validated_shear(slender) == 0.0
    note = extrapolated_shear_note(0.0)
    assert note.startswith("any shear is extrapolated") and "0 N" not in note


def filed(folder, width=4.6, port=5.5):
    """The template of a jaw with a STEP file beside it that nothing reads."""
    (folder / "jaw.step").write_text("ISO-10303-21;\nEND-ISO-10303-21;\n")
    text = (TEMPLATES / "grasper_4layer.yaml").read_text()
    head, _, rest = text.partition("\n  jaw:")
    jaw = f"{{width: {width}, length: 18, height: 1.1, port_diameter: {port}, step: jaw.step}}"
    (folder / "sensor.yaml").write_text(f"{head}\n  jaw: {jaw}\n{rest.partition(chr(10))[2]}")
    return sitscad.load(folder / "sensor.yaml")


@pytest.mark.parametrize(("port", "told"), [(5.5, True), (7.0, False)])
def test_jaw_from_step_file_with_tight_port_gives_note(tmp_path, port, told):
    """Build alone reads the back: a square one reaches half the width beside and half the height above the axis."""
    spec = filed(tmp_path, port=port)
    layout, result = lay_out(spec), check(spec, hints="none")
    pair = closed_section(layout)
    closed, beside, _ = result.fit
    assert closed.assumption and not beside.assumption
    notes = [each for each in result.findings if each.rule == "SIT303" and each.key == "mount.jaw.step"]
    assert [each.severity for each in notes] == [Severity.NOTE] * told
    square = 2.0 * math.hypot(2.3e-3, pair.height / 2)
    for note in notes:
        assert closed.worst < note.limit < square < note.measured < square + 1e-3


def test_jaw_stated_in_spec_has_no_fit_assumption(tmp_path):
    spec = sitscad.load(TEMPLATES / "grasper_4layer.yaml")
    assert not any(each.assumption for each in fit(lay_out(spec)))
