"""Waivers with reasons: comments in a spec, the nearest configuration, a baseline; and what they do to a package."""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path

import pytest

from sitscad.basics.finding import Finding, Severity
from sitscad.checks.fixes.search import Search
from sitscad.checks.policy.judgement import Baseline, BaselineFinding, silencing_comments
from sitscad.spec import templates

COMMENT = "# sitscad: ignore "


def waived(text: str, line_with: str, words: str) -> str:
    """A spec's text with a comment at the end of one line."""
    (line,) = [each for each in text.splitlines() if each.strip().startswith(line_with)]
    return text.replace(line, f"{line}   {COMMENT}{words}")


def spec_of(run, *arguments: str) -> dict:
    return json.loads(run("check", *arguments, "--hints", "none", "--format", "json").out)["specs"][0]


def rules_of(spec: dict) -> set[str]:
    return {finding["rule"] for finding in spec["findings"]}


def ignored_of(spec: dict) -> dict[str, tuple[str, str]]:
    return {each["finding"]["rule"]: (each["by"], each["reason"]) for each in spec["ignored"]}


@pytest.fixture
def good(tmp_path) -> Path:
    return tmp_path / "good.yaml"


# --------------------------------------------------------------------------------------------------------- comments


def test_ignore_comment_silences_its_line_and_is_reported_with_reason(run, good):
    good.write_text(waived(good.read_text(), "trace_width", "SIT103 their quotation of 3 May"))
    spec = spec_of(run, "good.yaml")
    assert [f["key"] for f in spec["findings"] if f["rule"] == "SIT103"] == ["coil.trace_spacing"]
    assert ignored_of(spec) == {"SIT103": ("comment", "their quotation of 3 May")}
    text = run("check", "good.yaml", "--hints", "none").out
    assert "ignored: SIT103 " in text and "(comment: their quotation of 3 May)" in text


def test_ignore_comment_on_flow_mapping_covers_all_its_keys(run, good):
    flow = (
        "coil: {shape: circle, outer_diameter: 10, turns: 12.5, layers: 2,   # sitscad: ignore SIT103, SIT116 asked\n"
    )
    good.write_text(f"sitscad: 1\nname: flow\n{flow}  trace_width: 150 um, trace_spacing: 150 um}}\n")
    spec = spec_of(run, "good.yaml")
    assert "SIT103" not in rules_of(spec) and ignored_of(spec)["SIT103"] == ("comment", "asked")
    (spare,) = [finding["message"] for finding in spec["findings"] if finding["rule"] == "SIT020"]
    assert "SIT116" in spare and "SIT103" not in spare


def test_ignore_comment_on_section_line_does_not_cover_keys_below(run, good):
    good.write_text(waived(good.read_text(), "coil:", "SIT103 no"))
    spec = spec_of(run, "good.yaml")
    assert {"SIT103", "SIT020"} <= rules_of(spec) and not spec["ignored"]


def test_ignore_comment_may_follow_other_comment_on_its_line(run, good):
    good.write_text(
        waived(waived(good.read_text(), "trace_width", "").replace(COMMENT, "# fine"), "trace_width", "SIT103 asked")
    )
    spec = spec_of(run, "good.yaml")
    assert ignored_of(spec) == {"SIT103": ("comment", "asked")}
    (result,) = silencing_comments("turns: 9  # eight do not do  # sitscad: ignore SIT103", {"SIT103"})
    assert (result.column, result.fault) == (30, "it gives no reason: who said so, and when?")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("SIT103", "gives no reason"),
        ("", "names no rule"),
        ("whatever it is", "names no rule"),
        ("SIT999 because", "no rule SIT999"),
        ("SIT004 because", "cannot be ignored"),
        ("SIT201 nothing of it is here", "silences nothing"),
    ],
)
def test_ineffective_ignore_comment_yields_warning_at_its_place(run, good, words, said):
    good.write_text(waived(good.read_text(), "trace_width", words))
    spec = spec_of(run, "good.yaml")
    (warning,) = [finding for finding in spec["findings"] if finding["rule"] == "SIT020"]
    line = good.read_text().splitlines()[warning["line"] - 1]
    assert said in warning["message"] and warning["severity"] == "warning"
    assert line[warning["column"] - 1 :].startswith(COMMENT.strip())
    assert "SIT103" in rules_of(spec)


@pytest.mark.parametrize(("more", "said"), [
    ("SIT104", "names rules in vain: no finding of SIT104 is"),
    ("SIT104, SIT201, SIT301", "no finding of SIT104, SIT201 is"),
])
def test_ineffective_rule_in_ignore_comment_is_reported(run, good, more, said):
    good.write_text(waived(good.read_text(), "trace_width", f"SIT103, {more} their quotation"))
    spec = spec_of(run, "good.yaml")
    (warning,) = [finding for finding in spec["findings"] if finding["rule"] == "SIT020"]
    assert said in warning["message"] and "take SIT104" in warning["hint"] and "SIT301" not in warning["message"]
    assert ignored_of(spec)["SIT103"] == ("comment", "their quotation")


def test_ignore_comment_for_unchecked_rule_yields_no_warning(run, good):
    good.write_text(waived(good.read_text(), "outer_diameter", "SIT301 the jaw is theirs"))
    assert "SIT020" not in rules_of(spec_of(run, "good.yaml"))


@pytest.mark.parametrize(
    "line", ['name: "x # sitscad: ignore SIT103 no"', "name: 'x # sitscad: ignore SIT103 no'", "a: b#sitscad: ignore x"]
)
def test_hash_in_quotes_starts_no_comment(line):
    assert silencing_comments(line, ["SIT103"]) == ()


# ---------------------------------------------------------------------------------------------------- configuration


def test_nearest_configuration_file_is_used(run, tmp_path):
    folder = tmp_path / "sensors" / "inner"
    folder.mkdir(parents=True)
    (folder / "a.yaml").write_text((tmp_path / "good.yaml").read_text())
    (tmp_path / "pyproject.toml").write_text('[tool.sitscad]\nignore = ["SIT103"]\n')
    spec = spec_of(run, str(folder / "a.yaml"))
    assert "SIT103" not in rules_of(spec)
    assert {"rule": "SIT103", "reason": "left out by pyproject.toml"} in spec["not_checked"]
    (tmp_path / "sensors" / "sitscad.toml").write_text('[ignore]\ncoil-trace = "their quotation"\n')
    spec = spec_of(run, str(folder / "a.yaml"))
    assert ignored_of(spec)["SIT103"] == ("configuration", "their quotation")
    (folder / "pyproject.toml").write_text("[tool.other]\nx = 1  # sitscad\n")
    assert ignored_of(spec_of(run, str(folder / "a.yaml"))), "a pyproject.toml without the table does not count"
    (folder / "sitscad.toml").write_text("")
    assert "SIT103" in rules_of(spec_of(run, str(folder / "a.yaml")))


def test_configuration_sets_severities_and_selection(run, tmp_path):
    Path("sitscad.toml").write_text('select = ["SIT1"]\n[severity]\nSIT103 = "error"\n')
    spec = spec_of(run, "good.yaml")
    assert {f["severity"] for f in spec["findings"] if f["rule"] == "SIT103"} == {"error"}
    assert all(rule.startswith("SIT1") for rule in rules_of(spec))
    assert run("check", "good.yaml", "--hints", "none").code == 1
    assert run("check", "broken.yaml").code == 2, "what a spec is read by holds always"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("selct = []", "did you mean select?"),
        ("[waivers]", "which are select, ignore, severity, profiles; did you mean ignore?"),
        ('ignore = ["SIT999"]', "no rule 'SIT999'"),
        ('ignore = ["SIT004"]', "holds always"),
        ('[ignore]\nSIT103 = " "', "has no reason"),
        ('[severity]\nSIT103 = "fatal"', "one of error, warning, note"),
        ("select = 3", "no list"),
        ("profiles = 3", "no folder"),
        ('profiles = "../shops"', "no folder beside"),
        ('profiles = "/etc"', "no folder beside"),
        ("x = [", "is not TOML"),
        ("\xff\xfe", "is not TOML"),
    ],
)
def test_invalid_configuration_prints_one_sentence_and_exits_2(run, text, said):
    Path("sitscad.toml").write_bytes(text.encode("latin-1"))
    done = run("check", "good.yaml")
    assert (done.code, done.out) == (2, "") and said in done.err and "sitscad.toml" in done.err


@pytest.mark.slow
def test_profiles_are_found_in_configured_folder(run, tmp_path):
    """And the package holds them where the spec finds them: it builds the same again."""
    (tmp_path / "shops").mkdir()
    (tmp_path / "sensors").mkdir()
    (tmp_path / "shops" / "ourshop.yaml").write_text("name: ours\nbased_on: generic-flex\nvia_drill: 0.3 mm\n")
    text = Path("good.yaml").read_text() + "fpc: {rules: ourshop.yaml}\n"
    (tmp_path / "sensors" / "a.yaml").write_text(text)
    assert "SIT011" in run("check", "sensors/a.yaml").out
    Path("sitscad.toml").write_text('profiles = "shops"\n')
    assert run("check", "sensors", "--hints", "none").code == 0
    assert run("estimate", "sensors/a.yaml").code == 0
    assert run("build", "sensors", "--only", "gerber", "-o", "one").code == 0
    assert (tmp_path / "one/good-coil/spec/ourshop.yaml").read_text().startswith("name: ours")
    Path("sitscad.toml").unlink()
    assert run("build", "one/good-coil/spec/a.yaml", "--only", "gerber", "-o", "two").code == 0
    for path in (tmp_path / "one/good-coil/fpc").rglob("*.gbr"):
        assert path.read_bytes() == (tmp_path / "two" / path.relative_to(tmp_path / "one")).read_bytes()
    (tmp_path / "sensors" / "ourshop.yaml").write_text("name: nearer\nbased_on: nowhere\n")
    Path("sitscad.toml").write_text('profiles = "shops"\n')
    assert run("check", "sensors/a.yaml").code == 2, "what lies beside the spec comes first"


# --------------------------------------------------------------------------------------------------------- baseline


def test_baseline_findings_do_not_fail_and_new_findings_do(run, tmp_path):
    known = run("check", "weak.yaml", "--hints", "none", "--format", "json").out
    Path("known.json").write_text(known)
    done = run("check", "weak.yaml", "--hints", "none", "--baseline", "known.json")
    assert done.code == 0 and "(baseline: known before (known.json))" in done.out
    text = Path("weak.yaml").read_text()
    Path("weak.yaml").write_text("# moved\n\n" + text.replace("trace_width: 100 um", "trace_width: 60 um"))
    spec = spec_of(run, "weak.yaml", "--baseline", "known.json")
    assert "SIT101" in rules_of(spec), "a new one"
    assert "SIT203" not in rules_of(spec), "a known one on another line, with another number"
    (tmp_path / "weak2.yaml").write_text(text)
    assert run("check", "weak2.yaml", "--baseline", "known.json", "--hints", "none").code == 1


def test_baseline_finding_with_higher_severity_is_new(run):
    document = json.loads(run("check", "weak.yaml", "--hints", "none", "--format", "json").out)
    errors = [f for f in document["specs"][0]["findings"] if f["severity"] == "error"]
    errors[0]["severity"] = "warning"
    Path("known.json").write_text(json.dumps(document))
    spec = spec_of(run, "weak.yaml", "--baseline", "known.json")
    assert {f["rule"] for f in spec["findings"] if f["severity"] == "error"} == {errors[0]["rule"]}


TIGHT = """\
sitscad: 1
name: tight
coil: {shape: circle, outer_diameter: 10, turns: 13, layers: 2, trace_width: 160 um, trace_spacing: 90 um}
"""


def known_of_tight(run, change=lambda finding: None) -> dict:
    """The baseline of a spacing of 90 um, each finding changed; what the spec says is then known."""
    Path("tight.yaml").write_text(TIGHT)
    document = json.loads(run("check", "tight.yaml", "--hints", "none", "--format", "json").out)
    (spec,) = document["specs"]
    assert "SIT102" in rules_of(spec) and not document["ok"]
    for finding in spec["findings"]:
        change(finding)
    Path("known.json").write_text(json.dumps(document))
    return document


@pytest.mark.slow
def test_baseline_error_with_worse_value_is_new(run):
    known_of_tight(run)
    assert run("check", "tight.yaml", "--baseline", "known.json").code == 0
    for spacing, code in (("95 um", 0), ("89 um", 1), ("2 um", 1)):
        Path("tight.yaml").write_text(TIGHT.replace("90 um", spacing))
        done = run("build", "tight.yaml", "--only", "firmware", "--baseline", "known.json")
        assert done.code == code and ("SIT102 error" in done.err) == bool(code), spacing


@pytest.mark.parametrize("figure", [float("nan"), -1e99, None, True, "0"])
def test_baseline_without_measured_value_silences_nothing(run, figure):
    known_of_tight(run, lambda finding: finding.update(measured=figure))
    assert run("check", "tight.yaml", "--baseline", "known.json", "--hints", "none").code == 1


def test_smaller_margin_to_limit_is_not_covered_by_baseline(run):
    """Of what is told because it comes near its limit, less room is worse: of what is beyond it, more is."""
    text = dict(key="coil.turns", limit=1.8)
    for before, now, keeps, is_known in (
        (1.7, 1.6, True, True), (1.7, 1.75, True, False), (1.9, 1.95, False, False), (1.9, 1.85, False, True),
        (1.7, 1.85, False, False), (1.9, 1.7, True, False),
    ):
        entry = BaselineFinding(Severity.WARNING, before, 1.8, keeps_limit=before < 1.8 and keeps)
        finding = Finding("SIT204", "", Severity.WARNING, "", measured=now, keeps_limit=keeps, **text)
        assert entry.covers(finding) == is_known, (before, now, keeps)


def test_fixed_finding_keeps_other_findings_of_same_key_in_baseline(run):
    """Findings of one rule at one key are told apart by their turn: the second is the first once that is mended."""
    figures = {
        "SIT102\0coil.turns\0\0" + turn: BaselineFinding(Severity.ERROR, value, 1.0) for turn,
        value in (("1", 0.9), ("2", 0.5))
    }
    baseline = Baseline("known.json", {(str(Path("a.yaml").absolute()), "a"): figures})

    def told(*values):
        return [Finding("SIT102", "", Severity.ERROR, "", key="coil.turns", measured=v, limit=1.0) for v in values]

    assert baseline.covered("a.yaml", "a", told(0.5)) == [True]
    assert baseline.covered("a.yaml", "a", told(0.9, 0.4)) == [True, False]
    assert baseline.covered("a.yaml", "a", told(0.5, 0.5)) == [False, True]


@pytest.mark.slow
def test_baseline_identifies_spec_by_relative_path_and_name(run, tmp_path, monkeypatch):
    known_of_tight(run)
    here = Path.cwd()
    other = here / "other"
    other.mkdir()
    (other / "tight.yaml").write_text(TIGHT)
    assert run("check", "other/tight.yaml", "--baseline", "known.json").code == 1
    monkeypatch.chdir(other)
    done = run("check", "tight.yaml", "--baseline", "../known.json")
    assert done.code == 1 and "holds no spec named tight at this path" in done.err
    assert run("check", "../tight.yaml", "--baseline", "../known.json").code == 0
    (here / "tight.yaml").write_text(TIGHT.replace("name: tight", "name: another"))
    assert run("check", "../tight.yaml", "--baseline", "../known.json").code == 1


@pytest.mark.parametrize("text", ["", "[]", '{"specs": [{}]}', '{"specs": 3}', "\x00"])
def test_invalid_baseline_prints_one_sentence_and_exits_2(run, text):
    Path("known.json").write_text(text)
    done = run("check", "good.yaml", "--baseline", "known.json")
    assert done.code == 2 and "known.json is no baseline" in done.err and "Traceback" not in done.err


# ------------------------------------------------------------------------------------------------- folders and stdin


@pytest.mark.slow
def test_check_of_folder_checks_all_specs_in_it(run, tmp_path):
    folder = tmp_path / "sensors"
    (folder / "deep").mkdir(parents=True)
    (folder / ".hidden").mkdir()
    (folder / "package" / "spec").mkdir(parents=True)
    (folder / "package" / "manifest.json").write_text("{}")
    text = Path("good.yaml").read_text()
    for name in ("b.yaml", "a.yml", "deep/c.yaml", ".hidden/d.yaml", "package/spec/e.yaml"):
        (folder / name).write_text(text)
    (folder / "shop.yaml").write_text("name: a profile\nbased_on: generic-flex\n")
    document = json.loads(run("check", "sensors", "--hints", "none", "--format", "json").out)
    assert [spec["spec"] for spec in document["specs"]] == ["sensors/a.yml", "sensors/b.yaml", "sensors/deep/c.yaml"]
    done = run("check", "sensors/.hidden/..", "sensors/package")
    assert done.code in (0, 2)
    (tmp_path / "empty").mkdir()
    done = run("check", "empty")
    assert done.code == 2 and "there is no spec in this folder" in done.err


@pytest.mark.parametrize(("name", "code"), [("good", 0), ("weak", 1), ("broken", 2)])
def test_check_reads_spec_from_standard_input(run, monkeypatch, name, code):
    text = Path(f"{name}.yaml").read_bytes()
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text)))
    done = run("check", "-", "--hints", "none", "--format", "json")
    (spec,) = json.loads(done.out)["specs"]
    assert (done.code, spec["spec"]) == (code, "-")
    assert all(finding["line"] for finding in spec["findings"] if finding["key"])


@pytest.mark.parametrize(("on", "code"), [("note", 1), ("warning", 1), ("error", 0)])
def test_fail_on_option_sets_failing_severity(run, on, code):
    done = run("check", "good.yaml", "--fail-on", on, "--hints", "none")
    assert done.code == code and (f"--fail-on {on}" in done.err) == bool(code)
    assert run("check", "good.yaml", "--fail-on", "nothing").code == 2


def test_check_with_two_processes_prints_equal_output(run):
    request = ("check", "good.yaml", "weak.yaml", "broken.yaml", "absent.yaml", "--hints", "none", "--format", "json")
    item, two = run(*request, "--jobs", "1"), run(*request, "--jobs", "2")
    assert item == two and item.code == 2


# ------------------------------------------------------------------------------------------------------------ build


def package_of(run, *arguments: str) -> tuple[int, dict, Path]:
    done = run("build", *arguments, "--only", "firmware,report")
    folder = Path("outputs") / Path(arguments[0]).stem.replace("good", "good-coil").replace("weak", "weak-coil")
    manifest = json.loads((folder / "manifest.json").read_text()) if done.code == 0 else {}
    return done.code, manifest, folder


def test_build_with_ignored_fabricator_rule_needs_no_force(run):
    Path("sitscad.toml").write_text('[severity]\nSIT103 = "error"\n')
    assert package_of(run, "good.yaml")[0] == 1
    Path("sitscad.toml").write_text('[severity]\nSIT103 = "error"\n[ignore]\nSIT103 = "their quotation of 3 May"\n')
    code, manifest, folder = package_of(run, "good.yaml")
    assert code == 0 and not manifest["forced"] and not list(folder.rglob("FORCED.txt"))
    assert manifest["configuration"]["reasons"] == {"SIT103": "their quotation of 3 May"}
    assert "their quotation of 3 May" in (folder / "report.html").read_text()
    findings = json.loads((folder / "findings.json").read_text())["specs"][0]
    assert ignored_of(findings) == {"SIT103": ("configuration", "their quotation of 3 May")}


def test_build_with_ignored_physics_rule_is_marked(run):
    assert package_of(run, "weak.yaml")[0] == 1
    Path("sitscad.toml").write_text('[ignore]\nSIT2 = "we know better"\n')
    code, manifest, folder = package_of(run, "weak.yaml")
    assert code == 0 and manifest["forced"]
    note = (folder / "FORCED.txt").read_text()
    assert "with rules silenced" in note and "(silenced)" in note
    assert "silenced: do not order this" in (folder / "report.html").read_text()


@pytest.mark.parametrize(
    "configuration", ['ignore = ["SIT2"]', 'select = ["SIT1"]', '[severity]\nSIT2 = "warning"', '[ignore]\nSIT2 = "x"']
)
def test_physics_rule_silenced_by_any_configuration_marks_package(run, configuration):
    Path("sitscad.toml").write_text(configuration + "\n")
    code, manifest, _ = package_of(run, "weak.yaml")
    assert code == 0 and manifest["forced"]


def test_physics_rule_silenced_by_baseline_marks_package(run):
    Path("known.json").write_text(run("check", "weak.yaml", "--hints", "none", "--format", "json").out)
    code, manifest, _ = package_of(run, "weak.yaml", "--baseline", "known.json")
    assert code == 0 and manifest["forced"]


def test_changed_ignore_reason_rebuilds_check_and_report(run):
    assert package_of(run, "good.yaml")[0] == 0
    Path("sitscad.toml").write_text('[ignore]\nSIT103 = "one"\n')
    assert "made check, report" in run("build", "good.yaml", "--only", "firmware,report").out
    assert "made" not in run("build", "good.yaml", "--only", "firmware,report").out
    Path("sitscad.toml").write_text('[ignore]\nSIT103 = "another"\n')
    assert "made check, report" in run("build", "good.yaml", "--only", "firmware,report").out


@pytest.mark.slow
def test_example_repository_of_ci_page_passes_with_baseline(run, tmp_path, good):
    """Its configuration, with a profile that a spec names without the folder, a waiver, and a baseline."""
    page = (Path(__file__).parents[2] / "docs" / "ci.md").read_text(encoding="utf-8")
    (tmp_path / "sitscad.toml").write_text(page.partition("```toml\n")[2].partition("```")[0])
    for folder in ("shops", "sensors"):
        (tmp_path / folder).mkdir()
    (tmp_path / "shops/ourshop.yaml").write_text("based_on: generic-flex\ntrace_width: 5 mm\n")
    (tmp_path / "sensors/thumb.yaml").write_text(good.read_text() + "fpc: {rules: ourshop.yaml}\n")
    (spec,) = json.loads(run("check", "sensors", "--format", "json").out)["specs"]
    assert "SIT101" in rules_of(spec)
    assert "`rules: ourshop.yaml`, without the folder" in page
    command = "sitscad check --format json sensors > known.json"
    assert command in page
    (tmp_path / "known.json").write_text(run(*command.partition(" > ")[0].split()[1:]).out)
    assert run("check", "sensors").code == 1 and run("check", "--baseline", "known.json", "sensors").code == 0


def test_no_fix_is_tried_for_ignored_findings(run, tmp_path, monkeypatch):
    """A check of a sound spec took a third of its time for hints of findings that its comments silence."""
    from sitscad.checks.trials import Trials

    tried = []
    monkeypatch.setattr(Trials, "mending", lambda self, finding, outcome: tried.append(finding.rule) or Search())
    waived = templates.read("grasper_4layer")
    (tmp_path / "plain.yaml").write_text(waived.replace("# sitscad: ignore", "# ignored for"))
    (tmp_path / "waived.yaml").write_text(waived)
    run("check", "plain.yaml")
    assert "SIT103" in tried
    (tmp_path / "sitscad.toml").write_text('ignore = ["SIT103"]\n')
    tried.clear()
    run("check", "plain.yaml")
    (tmp_path / "sitscad.toml").unlink()
    run("check", "waived.yaml")
    assert "SIT103" not in tried
