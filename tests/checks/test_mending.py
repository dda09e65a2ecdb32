"""Fixes written into a spec's text: only what they name changes, nothing gets worse, and once is enough."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ruamel.yaml import YAML

sys.path[:0] = [str(Path(__file__).parents[1] / "benchmarks")]

from check_times import design as random_design  # noqa: E402

from sitscad.basics.finding import Edit, Finding, NotChecked, Remedy, Severity  # noqa: E402
from sitscad.basics.messages import text_of  # noqa: E402
from sitscad.basics.record import record  # noqa: E402
from sitscad.checks.fixes.mending import mended_text, worsened_rules  # noqa: E402
from sitscad.checks.fixes.search import warnings_text  # noqa: E402
from sitscad.checks.judging import check, mended  # noqa: E402
from sitscad.spec import templates  # noqa: E402
from sitscad.spec.load import load_text  # noqa: E402
from sitscad.spec.reading import SpecError  # noqa: E402
from sitscad.spec.yaml.rewriting import rewritten  # noqa: E402
from sitscad.spec.yaml.source import read_yaml  # noqa: E402

plain = YAML(typ="safe")
TEMPLATES = {name: templates.read(name) for name in templates.names()}


@record
class Said:
    findings: tuple = ()
    not_checked: tuple = ()


def read(text):
    """What loading says of a text; a spec that loads is not checked further."""
    try:
        load_text(text, "spec.yaml")
    except SpecError as error:
        return Said(mended(error, "none"))
    return Said()


def judged(text, hints="decisive"):
    try:
        result = check(load_text(text, "spec.yaml"), hints=hints)
    except SpecError as error:
        return Said(mended(error, hints))
    return Said(result.findings, result.not_checked)


def verdict(text):
    return judged(text, "none")


def always(finding, remedy):
    return True


def only_safe(finding, remedy):
    return remedy.is_safe


BROKEN = """\
sitscad: 1
name: broken-coil
coil:
  shape: circel   # round
  outer_diamter: 3,5 mm   # size
  turns: "6.5"
  trace_width: 100 Um
  trace_spacing: 100 um
  corner_radius: 1
arry: {patern: line, count: 2, pitch: 3}
fpc: {tail: {conector: zif-0.5mm, contacts: 2}}
"""

MENDED = """\
sitscad: 1
name: broken-coil
coil:
  shape: circle   # round
  outer_diameter: 3.5 mm   # size
  turns: 6.5
  trace_width: 100 um
  trace_spacing: 100 um
  corner_radius: 0
array: {pattern: line, count: 2, pitch: 4.35}
fpc: {tail: {connector: zif-0.5mm, contacts: 4}}
"""

CAREFULLY = (
    MENDED.replace("3.5 mm", "3,5 mm")
    .replace("6.5", '"6.5"')
    .replace("radius: 0", "radius: 1")
    .replace("4.35", "3")
    .replace("contacts: 4", "contacts: 2")
)
"""The same with safe changes alone."""


def test_unreadable_spec_is_fixed_as_far_as_possible():
    result = mended_text(BROKEN, lambda text: judged(text) if text != MENDED else Said(), always)
    assert result.text == MENDED
    rules = [item.finding.rule for item in result.applied]
    assert rules == sorted(rules) and set(rules) == {"SIT002", "SIT004", "SIT005", "SIT007", "SIT009", "SIT014"}


def test_safe_fixes_leave_turns_and_size_unchanged():
    result = mended_text(BROKEN, read, only_safe)
    assert result.text == CAREFULLY
    assert {finding.rule for finding in result.check_result.findings} == {"SIT004"}


@pytest.mark.slow
@settings(deadline=None)
@given(st.data())
def test_misspelt_key_of_any_template_is_fixed_or_unchanged(data):
    text = TEMPLATES[data.draw(st.sampled_from(sorted(TEMPLATES)))]
    key = data.draw(st.sampled_from(sorted(k for k in read_yaml(text).keys if not k.rpartition(".")[2].isdigit())))
    name = key.rpartition(".")[2]
    at = data.draw(st.integers(0, len(name) - 1))
    slip = data.draw(st.sampled_from([name[:at] + name[at + 1 :], name[:at] + name[at] + name[at:], name[::-1]]))
    siblings = {k.rpartition(".")[2] for k in read_yaml(text).keys if k.rpartition(".")[0] == key.rpartition(".")[0]}
    if not slip or slip in siblings:
        return
    broken = rewritten(text, [Edit(key, slip, what="name")])
    result = mended_text(broken, read, only_safe)
    assert result.text in (broken, text)
    assert result.text == text or slip == name[::-1] or len(name) < 5 or not result.applied
    assert mended_text(result.text, read, only_safe).text == result.text


@pytest.mark.slow
@settings(deadline=None)
@given(st.data())
def test_misspelt_value_of_any_template_is_fixed_or_unchanged(data):
    text = TEMPLATES[data.draw(st.sampled_from(sorted(TEMPLATES)))]
    words = {"coil.shape": "circle", "array.pattern": "line", "mount.kind": "grasper-pad", "readout.device": "ldc1614"}
    here = [key for key in words if key in read_yaml(text).keys]
    key = data.draw(st.sampled_from(here))
    before = rewritten(text, [Edit(key, words[key])])
    at = data.draw(st.integers(1, len(words[key]) - 1))
    broken = rewritten(before, [Edit(key, words[key][:at] + words[key][at + 1 :])])
    result = mended_text(broken, read, only_safe)
    assert result.text == broken or result.text.splitlines()[:3] == before.splitlines()[:3]
    changed = [
        (a, b) for a, b in zip(broken.splitlines(), result.text.splitlines(), strict=True) if a != b and key not in a
    ]
    assert all(words[key] in b for _, b in changed if result.text == before)


def document(shape, size, turns, layers, width, spacing, rules, **more):
    coil = {"shape": shape, "outer_diameter": size, "turns": turns, "layers": layers}
    coil |= {"trace_width": f"{width} um", "trace_spacing": f"{spacing} um"}
    tail = {"length": 30, "connector": "zif-0.5mm", "layers": 2}
    return {"sitscad": 1, "name": "mended", "coil": coil, "fpc": {"rules": rules, "tail": tail}, **more}


def weights(findings):
    return sorted((f.rule, f.key or "", f.severity) for f in findings if f.severity is not Severity.NOTE)


SAFE = {
    "too fast a tank": (
        document("circle", 6, 12, 2, 100, 100, "generic-flex", readout={"capacitance": "47 pF"}),
        {"readout.capacitance"},
    ),
}

FOR_THE_DESIGNER = {
    "too slow a scan": document("circle", 6, 12, 2, 100, 100, "generic-flex", requirements={"bandwidth": "300 Hz"}),
    "too fast a scan": document("circle", 6, 12, 2, 100, 100, "generic-flex", array={"pattern": "line", "pitch": 7},
                                readout={"scan_rate": "3 kHz"}),
}


@pytest.mark.parametrize("name", FOR_THE_DESIGNER)
def test_scan_rate_is_changed_only_by_unsafe_fixes(name):
    """A slower scan, which is less than was asked for, was written without asking."""
    text = json.dumps(FOR_THE_DESIGNER[name], indent=1)
    assert "readout.scan_rate" not in keys_of(mended_text(text, judged, only_safe, verdict))
    assert "readout.scan_rate" in keys_of(mended_text(text, judged, always, verdict))


def keys_of(found):
    return {edit.key for item in found.applied for edit in item.remedy.edits}


@pytest.mark.parametrize("name", SAFE)
def test_safe_fixes_change_only_listed_keys(name):
    request, keys = SAFE[name]
    text = json.dumps(request, indent=1)
    result = mended_text(text, judged, only_safe, verdict)
    assert keys_of(result) == keys
    again = mended_text(result.text, judged, only_safe, verdict)
    assert again.text == result.text and not again.applied
    before, after = judged(text, "none"), judged(result.text, "none")
    assert len(weights(after.findings)) < len(weights(before.findings))
    assert set(weights(after.findings)) < set(weights(before.findings))


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize(
    "seed", [1, 2, 4, *(pytest.param(seed, marks=pytest.mark.more) for seed in (3, *range(5, 13)))]
)
def test_fixed_random_design_is_no_worse_and_needs_no_second_fix(seed):
    text = json.dumps(random_design(seed), indent=1)
    result = mended_text(text, judged, always, verdict)
    again = mended_text(result.text, judged, always, verdict)
    assert again.text == result.text
    keys = {edit.key for item in result.applied for edit in item.remedy.edits}
    changed = {k for k in places(result.text) | places(text) if at(result.text, k) != at(text, k)}
    assert all(any(f"{k}.".startswith(f"{key}.") or f"{key}.".startswith(f"{k}.") for key in keys) for k in changed)
    if not any(f.rule.startswith("SIT0") for f in judged(text, "none").findings):
        assert set(weights(result.check_result.findings)) <= set(weights(judged(text, "none").findings))


def places(text):
    return set(read_yaml(text).keys)


def at(text, key):
    value = read_yaml(text).data
    for name in key.split("."):
        value = value[int(name)] if isinstance(value, list) else (value or {}).get(name)
    return value


def finding(rule, *remedies, severity=Severity.ERROR, key="coil.turns"):
    return Finding(rule, "made-up", severity, "", key=key, fixes=remedies)


WORSE = {
    "a new finding": (finding("SIT205", severity=Severity.WARNING),),
    "the same, once more": (finding("SIT201", key="coil.layers"), finding("SIT201", key="coil.layers")),
}


@pytest.mark.parametrize("name", WORSE)
def test_fix_that_adds_finding_is_rolled_back(name):
    remedy = Remedy((Edit("coil.turns", "7"),))
    first = Said((finding("SIT201", remedy), finding("SIT201", key="coil.layers")))
    texts = {"coil: {turns: 6}\n": first, "coil: {turns: 7}\n": Said(WORSE[name])}
    result = mended_text("coil: {turns: 6}\n", texts.__getitem__, always)
    assert (result.text, result.applied) == ("coil: {turns: 6}\n", ())


def test_rolled_back_fix_gives_reason():
    remedy = Remedy((Edit("coil.turns", "7"),))
    first = Said((finding("SIT201", remedy),))
    for after, why in (
        (Said((finding("SIT205", severity=Severity.WARNING),)), "it brings SIT205 (warning)"),
        (Said((finding("SIT201"),)), "SIT201 stays"),
        (Said((), (NotChecked("SIT302", "why"),)), "SIT302 can then not be checked"),
    ):
        result = mended_text(
            "coil: {turns: 6}\n", {"coil: {turns: 6}\n": first, "coil: {turns: 7}\n": after}.get, always
        )
        assert [item.why for item in result.rolled_back] == [why] and not result.applied


@pytest.mark.parametrize("more", [(), (finding("SIT204", severity=Severity.NOTE),)])
@pytest.mark.parametrize("way_back", [(), (Remedy((Edit("coil.turns", "6"),)),)])
def test_fix_that_replaces_note_by_unfixable_note_is_applied(way_back, more):
    """A lead that runs back was not mended, because its design kept another limit by little."""
    remedy = Remedy((Edit("coil.turns", "7"),))
    note = finding("SIT203", *way_back, severity=Severity.NOTE)
    texts = {
        "coil: {turns: 6}\n": Said((finding("SIT216", remedy, severity=Severity.NOTE),)),
        "coil: {turns: 7}\n": Said((note, *more)),
    }
    result = mended_text("coil: {turns: 6}\n", texts.__getitem__, always)
    is_written = not way_back and not more
    assert (result.text == "coil: {turns: 7}\n") == is_written == (not result.rolled_back)
    assert is_written or result.rolled_back[0].why.startswith("it brings SIT203 (note)")


def test_fix_that_adds_warning_is_not_applied():
    remedy = Remedy((Edit("coil.turns", "7"),), ("SIT205",))
    result = mended_text("coil: {turns: 6}\n", lambda _: Said((finding("SIT201", remedy),)), always)
    assert not result.applied


def test_finding_with_changed_key_does_not_roll_back_fix():
    """SIT113 names the pitch where a pitch was tried and the start angle where none was: a good fix was rolled back."""
    remedy = Remedy((Edit("target.size", "[4, 3]"),))
    wrong = Finding("SIT307", "overhang", Severity.ERROR, "it hangs over", key="target.size", fixes=(remedy,))

    def findings(text, key):
        routing = Finding("SIT113", "room", Severity.ERROR, "no room", key=key)
        return (routing,) if "[4, 3]" in text else (routing, wrong)

    text = "sitscad: 1\ntarget: {size: [9, 9]}\n"
    done = mended_text(
        text,
        lambda said: Said(findings(said, "array.pitch")),
        always,
        lambda said: Said(findings(said, "coil.start_angle")),
    )
    assert "[4, 3]" in done.text and not done.rolled_back


def test_warnings_text_separates_new_warnings_from_worsened_ones():
    """"SIT103, SIT130 then warn" was said of rules that warned as the design stood."""
    new, more = (text_of(case, "hint", {"rules": rules}) for case, rules in (
        ("tried-warns", ["SIT205"]), ("tried-warns-more", ["SIT103", "SIT130"])))
    assert warnings_text(("SIT103", "SIT130", "SIT205"), {"SIT103", "SIT130"}) == f"{new}, {more}"
    assert warnings_text(("SIT103", "SIT130"), {"SIT103", "SIT130"}) == more
    assert warnings_text(("SIT205",), ()) == new and warnings_text((), ()) == ""


def test_errors_are_fixed_before_warnings_of_lower_rules():
    """SIT103 (warning) was mended before SIT201 (error), because its number is lower."""
    error = finding("SIT201", Remedy((Edit("coil.turns", "7"),)))
    warning = finding("SIT103", Remedy((Edit("coil.turns", "6.5"),)), severity=Severity.WARNING)
    result = mended_text("coil: {turns: 6}\n", lambda text: Said((warning, error) if "6" in text else ()), always)
    assert [item.finding for item in result.applied] == [error]


def test_worsened_error_is_listed_and_blocks_warning_fix():
    """A fix that made another error graver was written without a word."""
    remedy = Remedy((Edit("coil.turns", "7"),))
    before, after = (replace(finding("SIT205"), measured=measured, limit=1.0) for measured in (1.1, 1.4))

    def judge(text, severity):
        return Said((finding("SIT201", remedy, severity=severity), before)) if "6" in text else Said((after,))

    result = mended_text("coil: {turns: 6}\n", lambda text: judge(text, Severity.ERROR), always)
    assert [item.worsens for item in result.applied] == [("SIT205",)]
    assert not mended_text("coil: {turns: 6}\n", lambda text: judge(text, Severity.WARNING), always).applied


def test_error_reduced_to_warning_is_not_worsened():
    """A rule with an error of 50 % and a warning of 10 % that leaves two warnings of 10 and 30 % was called worse."""
    error = replace(finding("SIT201"), measured=1.5, limit=1.0)
    mild, half = (replace(error, severity=Severity.WARNING, measured=measured) for measured in (1.1, 1.3))
    assert worsened_rules((error, mild), (half, mild)) == set()
    assert worsened_rules((mild,), (half, mild)) == {"SIT201"}
