"""Hints that name what to write: written into the spec, each mends its finding and breaks nothing new."""

import json
import re
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from ruamel.yaml import YAML

sys.path[:0] = [str(Path(__file__).parents[1] / "validation")]

from follow_hints import alternatives, followed, written  # noqa: E402
from follow_hints import design as random_design  # noqa: E402
from one_rule import findings_of  # noqa: E402

from sitscad.basics.finding import Edit, Severity  # noqa: E402
from sitscad.basics.messages import text_of  # noqa: E402
from sitscad.checks.fixes.mending import AppliedFix, is_better, worsened_rules  # noqa: E402
from sitscad.checks.fixes.moves import with_turns  # noqa: E402
from sitscad.checks.fixes.search import Budget, RemainingProblems, hint_text, search  # noqa: E402
from sitscad.checks.judging import check  # noqa: E402
from sitscad.estimates.states import plate  # noqa: E402
from sitscad.spec import templates  # noqa: E402
from sitscad.spec.load import load_text, rewritten_spec  # noqa: E402
from sitscad.spec.reading import SpecError  # noqa: E402
from sitscad.spec.yaml.rewriting import rewritten  # noqa: E402

TAIL = {"length": 30, "connector": "zif-0.5mm", "layers": 2}


def design(shape, size, turns, layers, width, spacing, rules, **more):
    coil = {"shape": shape, "outer_diameter": size, "turns": turns, "layers": layers}
    coil |= {"trace_width": f"{width} um", "trace_spacing": f"{spacing} um"}
    return {"sitscad": 1, "name": "tried", "coil": coil, "fpc": {"rules": rules, "tail": TAIL}, **more}


SQUARES = {
    "sitscad": 1,
    "name": "squares",
    "coil": {
        "shape": "square", "outer_diameter": 5, "turns": 3.5, "layers": 4, "trace_width": "100 um",
        "trace_spacing": "100 um",
    },
    "array": {"pattern": "line", "count": 3, "pitch": 5.8},
}
"""A lead of its layout left a corner at 45 degrees."""

BINDING = {"based_on": "generic-flex", "coil_rule_binding": True}

QUICK = {
    "circle, both too narrow": (design("circle", 6, 9, 2, 80, 80, "generic-flex"), {"SIT101", "SIT102"}),
    "hexagon, binding loop lines": (design("hexagon", 7, 6, 2, 100, 100, BINDING), {"SIT103"}),
    "too few turns": (design("circle", 6, 3, 2, 100, 100, "generic-flex"), {"SIT203"}),
    "octagon with no room inside": (design("octagon", 6, 13.25, 2, 100, 100, "generic-flex"), {"SIT112"}),
    "too fast a tank": (
        design("circle", 6, 12, 2, 100, 100, "generic-flex", readout={"capacitance": "47 pF"}), {"SIT202"},
    ),
    "a tail too short to bend": (
        design(
            "circle", 6, 12, 2, 100, 100, "generic-flex",
            fpc={"rules": "generic-flex", "tail": {**TAIL, "length": 10, "bend": "dynamic", "layers": 1}},
        ),
        {"SIT123"},
    ),
    "too slow a scan": (
        design("circle", 6, 12, 2, 100, 100, "generic-flex", requirements={"bandwidth": "300 Hz"}), {"SIT210"},
    ),
    "too fast a clock": (
        design("circle", 6, 12, 2, 100, 100, "generic-flex", readout={"clock": "41 MHz"}), {"SIT213"},
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", QUICK)
def test_tried_fix_clears_its_finding(name):
    document, rules = QUICK[name]
    tried = list(followed(document))
    assert rules <= {rule for rule, _, _ in tried}
    assert [entry for entry in tried if entry[2]] == []


THIN = design(
    "circle", 4.5, 9, 2, 80, 80, "generic-fine", array={"pattern": "line", "count": 2, "pitch": 6},
    target={"shape": "rectangle", "size": [4, 4], "thickness": "25 um"},
    elastomer={"material": "dragon-skin-10", "shape": "rectangle", "size": [5, 4.6], "thickness": 1},
)
"""A target too thin, too short and too narrow, on a pad that is too small for the one that it should be."""


@pytest.mark.slow
def test_target_size_fix_also_enlarges_elastomer():
    size = [("target.size", "[6, 4.5]"), ("elastomer.size", "[6, 4.6]")]
    assert list(followed(THIN, "SIT306")) == [("SIT306", size, [])] * 2
    changed = THIN
    for key, value in size:
        changed = written(changed, key, value)
    findings = check(load_text(json.dumps(changed), "spec.yaml"), hints="none").findings
    assert "SIT307" not in {f.rule for f in findings}


SQUARE_TARGET = design(
    "rectangle", [8, 5], 5, 2, 100, 100, "generic-flex",
    target={"shape": "square", "size": 5.2, "thickness": 0.2},
    elastomer={"material": "dragon-skin-10", "shape": "square", "size": 5.2, "thickness": 1},
)


@pytest.mark.more
@pytest.mark.slow
def test_square_target_over_long_coil_gets_rectangle_fix():
    """A square as long as the coil hung over the board, which is SIT307."""
    (tried,) = followed(SQUARE_TARGET, "SIT306")
    assert tried[1][0] == ("target.shape", "rectangle") and tried[2] == []


PLATES = {
    "pad beyond the board": ({"size": 8}, {"size": 7}, "1 N"),
    "target beyond a smaller pad": ({"size": 6.5}, {"size": 7}, "1 N"),
    "both beyond the board": ({"size": 8}, {"size": 8}, "1 N"),
    "rectangles": ({"shape": "rectangle", "size": [8, 6]}, {"shape": "rectangle", "size": [9, 7]}, "1 N"),
    "no area to spare for the force": ({"size": 8}, {"size": 8}, "20 N"),
}


@pytest.mark.parametrize("name", PLATES)
def test_plate_size_fix_fits_board_and_breaks_no_plate_rule(name, judge, advised):
    """Told to shrink, a target became too small for its force: the board grows instead."""
    pad, target, force = PLATES[name]
    document = design("circle", 6, 12, 2, 100, 100, "generic-flex")
    document["target"] = {"shape": "square", "thickness": 0.2, **target}
    document["elastomer"] = {"material": "dragon-skin-10", "shape": "square", "thickness": 1, **pad}
    document["requirements"] = {"normal_force": force}
    (result, *_) = advised("SIT307", load_text(json.dumps(document), "spec.yaml"))
    changed = document
    for key, value in alternatives(result)[0]:
        changed = written(changed, key, value)
    after = load_text(json.dumps(changed), "spec.yaml")
    assert judge("SIT307", after) == judge("SIT306", after) == judge("SIT304", after) == []


@pytest.mark.slow
def test_contradicting_limits_give_hint_without_fix():
    document = design(
        "circle", 6.3, 12, 2, 100, 100, "generic-flex", mount={"kind": "grasper-pad", "jaw": "generic-5mm"},
        target={"shape": "square", "size": 5, "thickness": 0.2},
        elastomer={"material": "dragon-skin-10", "shape": "square", "size": 5, "thickness": 1},
    )
    findings = check(load_text(json.dumps(document), "spec.yaml"), hints="full").findings
    hints = [f.hint for f in findings if f.rule == "SIT306"]
    assert hints and all("SIT301" in hint for hint in hints) and not any(f.fixes for f in findings
                                                                              if f.rule == "SIT306")


@pytest.mark.parametrize(
    ("errors", "warnings", "turns"),
    [
        ({3.0: ("SIT101",)}, {4.0: ("SIT307",)}, [5.0]),
        ({3.0: ("SIT101",), 5.0: ("SIT101",)}, {4.0: ("SIT205", "SIT307")}, [4.0]),
        ({3.0: ("SIT101",), 4.0: ("SIT101",), 5.0: ("SIT101",)}, {}, []),
    ],
)
def test_search_returns_change_with_warning_only_without_better_one(errors, warnings, turns):
    spec = load_text(json.dumps(design("circle", 6, 2, 2, 100, 100, "generic-flex")), "spec.yaml")

    def trial(fix):
        count = fix.spec.coil.turns
        return RemainingProblems(errors.get(count, ()), warnings.get(count, ()))

    result = search([lambda: [with_turns(spec, n * 1.0) for n in (3, 4, 5)]], trial, Budget.of("decisive"))
    assert [fix.spec.coil.turns for fix, _ in result.mending] == turns and not result.is_cut_short
    assert [left.new_warnings for _, left in result.mending] == [warnings.get(count, ()) for count in turns]


def test_search_without_fix_hint_names_most_effective_change():
    spec = load_text(json.dumps(design("circle", 6, 2, 2, 100, 100, "generic-flex")), "spec.yaml")
    gains = {3.0: 1.05, 4.0: 1.9, 5.0: 1.2}
    result = search([lambda: [with_turns(spec, turns) for turns in gains]],
                   lambda fix: RemainingProblems(("SIT201",), gain=gains[fix.spec.coil.turns]), Budget.of("decisive"))
    text = text_of("tried-helps", "hint", {"change": "coil.turns: 4", "gain": 1.9})
    assert not result.mending and hint_text("more turns", result, ()).startswith(text)


def test_search_tries_second_family_only_at_full_level():
    spec = load_text(json.dumps(design("circle", 6, 2, 2, 100, 100, "generic-flex")), "spec.yaml")
    families = [lambda turns=turns: [with_turns(spec, turns)] for turns in (3.0, 4.0)]
    counts = [len(search(families, lambda _: RemainingProblems(), Budget.of(hints)).mending)
              for hints in ("decisive", "full")]
    assert counts == [1, 2]


@pytest.mark.slow
def test_error_fix_that_worsens_warning_is_accepted_and_reported():
    """Conversions of less time mend the bandwidth, and of the few steps over the load still fewer are left."""
    faint = design(
        "circle", 8, 14.5, 2, 100, 100, "generic-fine",
        target={"shape": "circle", "size": 8, "thickness": 0.2},
        elastomer={"material": "dragon-skin-30", "shape": "circle", "size": 8, "thickness": 1},
        readout={"scan_rate": "100 Hz"}, requirements={"normal_force": "0.12 N", "bandwidth": "80 Hz"},
    )
    text = json.dumps(faint, indent=1)
    before = check(load_text(text, "spec.yaml"), hints="full").findings
    result = {each.rule: each for each in before}
    (remedy,) = result["SIT210"].fixes
    assert [(edit.key, edit.new) for edit in remedy.edits] == [("readout.scan_rate", '"160 Hz"')]
    assert text_of("tried-warns-more", "hint", {"rules": ["SIT215"]}) in result["SIT210"].hint
    after = check(load_text(rewritten(text, remedy.edits), "spec.yaml"), hints="none").findings
    (worse,) = [each for each in after if each.rule == "SIT215"]
    assert remedy.new_warnings == () and worse.measured < 0.95 * result["SIT215"].measured
    assert worsened_rules(before, after) == {"SIT215"} and not worsened_rules(after, before)
    assert is_better(AppliedFix(result["SIT210"], remedy), before, after)
    milder = replace(result["SIT210"], severity=Severity.WARNING)
    warned = [milder if each.rule == "SIT210" else each for each in before]
    assert not is_better(AppliedFix(milder, remedy), warned, after)


@pytest.mark.more
@pytest.mark.slow
def test_thin_target_gets_tried_thicker_target():
    tried = list(followed(THIN, "SIT305"))
    assert [rule for rule, _, _ in tried] == ["SIT305"] and tried[0][2] == []


@pytest.mark.more
@pytest.mark.slow
def test_overloaded_pad_gets_stiffer_pad_hint(judge):
    """The modulus that bears the force is named with what then fails, if anything does."""
    soft = {**THIN, "requirements": {"normal_force": "64 N"}}
    (found,) = [f for f in check(load_text(json.dumps(soft), "spec.yaml"), hints="full").findings if f.rule == "SIT304"]
    assert {"compression-stiffer", "compression-preset"} & set(found.cases)
    assert found.fixes or "SIT" in found.hint


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("array", "named"),
    [
        ({"pattern": "line", "count": 2, "pitch": 6}, ["fpc.tail.layers: 1", "fpc.tail.bend: static"]),
        ({"pattern": "grid", "count": [2, 2], "pitch": 6}, ["fpc.tail.bend: static"]),
    ],
)
def test_dynamic_bend_fix_depends_on_array_rows(array, named):
    """Coils in rows are led out on two layers: one layer through the hinge would leave them without leads (SIT118)."""
    document = design("circle", 4.5, 9, 2, 80, 80, "generic-fine", array=array)
    document["fpc"] = {**document["fpc"], "tail": {**TAIL, "bend": "dynamic"}, "margin": [0.05, 0]}  # SIT130
    tried = list(followed(document, "SIT308"))
    assert [f"{key}: {value}" for _, changes, _ in tried for key, value in changes] == named
    assert [entry for entry in tried if entry[2]] == []


@pytest.mark.more
@pytest.mark.slow
def test_hint_lists_few_ineffective_changes():
    """Every try spelled out made the longest hint of all templates."""
    findings = check(load_text(templates.read("grasper_3p5mm"), "spec.yaml"), hints="full").findings
    (hint,) = [f.hint for f in findings if f.rule == "SIT203"]
    assert hint.count("SIT112") == 1 and len(hint.partition("SIT112")[2]) < 100


RACETRACK = design(
    "racetrack", [11, 4.4], 4.5, 2, 100, 100, "generic-flex",
    mount={"kind": "grasper-pad", "jaw": "generic-5mm", "standoff": 0.3},
)
"""Its leads pass beside the coil, which makes the body wider than the jaw and its thin seat hold."""


def test_body_wider_than_jaw_detail_lists_coils_edges_and_leads(judge):
    (result, port) = judge("SIT301", load_text(json.dumps(RACETRACK), "spec.yaml"))
    assert all(share in result.detail for share in ("coils 4.4 mm", "edges 400 um", "the coils 400 um"))
    assert port.key == "coil.outer_diameter"


@pytest.mark.slow
def test_suggested_coil_width_fits_jaw():
    tried = [entry for entry in followed(RACETRACK) if entry[0] == "SIT301"]
    assert tried == [("SIT301", [("coil.outer_diameter", "[11, 3.83]")], [])]


def test_leads_of_square_coils_in_line_have_no_acute_corner(judge):
    """They left their ring at 45 degrees on a fold, and the finding could only say that the layout drew it."""
    assert not judge("SIT120", load_text(json.dumps(SQUARES), "spec.yaml"))


VARIANTS = {
    "as it is": {},
    "narrower": {"coil.trace_width": "70 um", "coil.trace_spacing": "70 um"},
    "only the gap narrower": {"coil.trace_spacing": "70 um"},
    "few turns": {"coil.turns": "3"},
    "two layers": {"coil.layers": "2"},
    "binding loop lines": {"fpc.rules": "{based_on: generic-flex, coil_rule_binding: true}"},
    "fast": {"readout.capacitance": "47 pF", "requirements.bandwidth": "400 Hz"},
}


CASES = [(name, "few turns") for name in templates.names()]
CASES += [("racetrack_jaw", variant) for variant in VARIANTS]
EVERY_TIME = ("grasper_4layer", "three_axis_pad")
"""A pair of long coils and a triangle of round ones; CI leaves out the other templates."""


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize(("template", "variant"), [
    pytest.param(*case, marks=() if case[0] in EVERY_TIME else pytest.mark.more) for case in dict.fromkeys(CASES)
])
def test_hints_for_template_variants_clear_their_findings(template, variant):
    document = YAML(typ="safe").load(templates.read(template))
    for key, value in VARIANTS[variant].items():
        document = written(document, key, value)
    assert [entry for entry in followed(document) if entry[2]] == []


def test_invalid_turns_of_racetrack_get_turns_that_fit(tmp_path):
    document = design("racetrack", [11, 4], 12.3, 2, 80, 80, "generic-fine")
    with pytest.raises(SpecError) as raised:
        load_text(json.dumps(document), "spec.yaml")
    named = {f.rule: f.limit for f in raised.value.findings}
    assert named["SIT015"] <= 12.0
    document["coil"]["turns"] = named["SIT015"]
    load_text(json.dumps(document), "spec.yaml")


@pytest.mark.more
@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 3])
def test_fixes_of_random_designs_clear_their_findings(seed):
    """Those that a plain check gives, within its budget; thirty designs: tests/validation/follow_hints.py."""
    tried = list(followed(json.loads(json.dumps(random_design(seed))), hints="decisive"))
    assert tried and [entry for entry in tried if entry[2]] == []


def test_suggested_finer_fabricator_profiles_fit_design():
    """ "choose a finer fabricator" named none: the table of the docs led to one whose rule for coils refused it."""
    spec = load_text(json.dumps(design("circle", 6, 12, 2, 80, 80, "generic-flex")), "spec.yaml")
    (findings,) = findings_of("SIT101", spec)
    named = re.search(r"fpc\.rules \(([^)]+)\)", findings.hint)[1].split(", ")
    assert named
    for name in named:
        rules = {f.rule for f in check(spec.replace("fpc.rules", name), hints="none").findings
                 if f.severity is Severity.ERROR}
        assert not rules & {"SIT101", "SIT102", "SIT103", "SIT131"}
    assert not Edit("fpc.rules", "huayue").is_safe, "nobody else chooses who makes a board"
    finest = load_text(json.dumps(design("circle", 6, 12, 2, 20, 20, "generic-flex")), "spec.yaml")
    assert any("finer-rules-none" in f.cases for f in check(finest, hints="none").findings)


@pytest.mark.more
@pytest.mark.slow
def test_shear_fix_and_overhang_fix_do_not_conflict():
    """SIT312 asked for a larger target and pad, which hung over the board: SIT307 made them smaller again. Sizes are
    such as people write, not 7.79 and 7.78.
    """
    spec = load_text((Path(__file__).parents[1] / "report/broken/SIT407.yaml").read_text(), "felt.yaml")
    findings = check(spec, hints="full").findings
    fixes = {f.rule: [[(e.key, e.new) for e in fix.edits] for fix in f.fixes] for f in findings if f.fixes}
    assert fixes["SIT307"] == [[("fpc.margin", "[0, 0.1]")]]
    (hangs,) = [f.hint for f in findings if f.rule == "SIT307"]
    assert "elastomer.size: 7.8 with target.size: 7.8" in hangs and "SIT312" in hangs
    assert fixes["SIT312"] == [[("elastomer.material", "dragon-skin-10")]]
    assert any("shear-body" in f.cases and "fpc.margin" in f.hint for f in findings if f.rule == "SIT312")


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "changes", "rule", "edits"),
    [
        ("grasper_4layer", {"encapsulation": None}, "SIT311",
         {"encapsulation.material": "ecoflex-00-50", "encapsulation.thickness": "0.05"}),
        ("bench_7mm", {"target.size": 4, "target.offset": [-4, 0], "fpc.margin": [0, 10]}, "SIT215",
         {"target.offset": "[0, 0]"}),
        ("three_axis_pad", {"target.size": 24, "elastomer.size": 24}, "SIT218",
         {"target.size": "11.2", "elastomer.size": "11.2"}),
        ("bench_7mm", {"fpc.tail.bend": {"kind": "static", "radius": 0.1}}, "SIT123", {"fpc.tail.bend.radius": "1.6"}),
        ("bench_7mm", {"fpc.stackup": "flex-4l", "coil.layers": 4, "fpc.tail.layers": 2, "coil.trace_width": "155 um",
                       "coil.trace_spacing": "155 um", "coil.turns": 8}, "SIT103", {"fpc.plated": "buttons"}),
        ("grasper_4layer", {"fpc.plated": None, "mount.jaw": {"width": 4.8, "length": 20, "height": 1.3,
                                                              "port_diameter": 3}}, "SIT308",
         {"fpc.plated": "buttons"}),
        ("three_axis_pad", {"requirements.shear_force": "12 N"}, "SIT312", {"elastomer.material": "dragon-skin-20"}),
        ("grasper_4layer", {"fpc.tail.layers": 4}, "SIT308", {"fpc.tail.layers": "2"}),
        ("bench_7mm", {"fpc.tail.bend": "dynamic"}, "SIT308", {"fpc.tail.bend": "static"}),
    ],
)
def test_values_in_hints_are_tried_fixes(name, changes, rule, edits):
    """They were named "(not tried)" or without a word, sizes that other rules refuse; SIT308 named one layer alone."""
    spec = rewritten_spec(load_text(templates.read(name), "spec.yaml"), changes.items())
    findings = [f for f in check(spec, hints="full").findings if f.rule == rule]
    fixes = [(f, fix) for f in findings for fix in f.fixes if {edit.key: edit.new for edit in fix.edits} == edits]
    assert fixes and all(next(iter(edits)) in f.hint for f, _ in fixes)
    mended = check(load_text(rewritten(spec.source.text, fixes[0][1].edits)), hints="none").findings
    finding = fixes[0][0]  # of one key a rule may complain twice: of a static bend in a hinge, and of its radius
    assert (rule, finding.key, finding.unit) not in {(f.rule, f.key, f.unit) for f in mended}


def test_dynamic_bend_in_hinge_gets_no_static_bend_hint():
    """It moves at every grasp, whatever the spec says."""
    spec = load_text(templates.read("grasper_4layer"), "spec.yaml").replace("fpc.tail.bend", "dynamic")
    findings = [f for f in check(spec, hints="none").findings if f.rule == "SIT308" and f.key == "fpc.tail.layers"]
    assert findings and all({"moving-layers-hinge", "moving-foil-hinge"} & set(f.cases) for f in findings)


@pytest.mark.more
@pytest.mark.slow
@pytest.mark.parametrize("size", [24, [14, 10]])
def test_shear_and_length_fixes_do_not_conflict(size):
    """Over two coils 8 mm apart SIT306 asked for 8 mm, SIT218 for 12.5 mm or a pitch of 9.5 mm."""
    shape = "rectangle" if isinstance(size, list) else "square"
    wide = {f"{part}.{key}": value for part in ("target", "elastomer")
            for key, value in (("shape", shape), ("size", size))}
    changes = wide | {"requirements.shear_force": "1 N", "fpc.margin": [4, 8]}
    spec = rewritten_spec(load_text(templates.read("bench_7mm"), "spec.yaml"), changes.items())
    findings = {f.rule: f for f in check(spec, hints="full").findings}
    fixes = [fix for rule in ("SIT218", "SIT306") for fix in findings[rule].fixes]
    assert len(fixes) > 1
    for fix in fixes:
        after = check(load_text(rewritten(spec.source.text, fix.edits)), hints="none").findings
        assert not {"SIT218", "SIT306"} & {f.rule for f in after}, fix.edits


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("name", ["three_axis_pad", "grasper_4layer"])
def test_wide_target_and_missing_film_give_findings_without_trials(name):
    """Without trials a hint gives the direction; a way to write it is what the search finds."""
    wide = {"target.size": 24e-3, "elastomer.size": 24e-3} if name == "three_axis_pad" else {"encapsulation": None}
    findings = check(load_text(templates.read(name), "spec.yaml").replace(wide), hints="none").findings
    assert {"SIT218", "SIT311"} & {f.rule for f in findings} 


def test_trial_designs_reuse_solved_targets(monkeypatch):
    """Another clock moves no metal, so designs that are tried for it share the solutions of the refused design."""
    solved, changes = [], plate.PlateProblem.changes

    def counted(solving, turns, places, once):
        solved.append((repr(solving), turns.tobytes(), places.tobytes(), once))
        return changes(solving, turns, places, once)

    monkeypatch.setattr(plate.PlateProblem, "changes", counted)
    spec = load_text(rewritten(templates.read("bench_7mm"), [Edit("readout.clock", "42 MHz")]), "clock.yaml")
    assert any(finding.rule == "SIT213" and finding.fixes for finding in check(spec).findings)
    assert len(solved) == len(set(solved)) > 0
