"""`sitscad check`: text for a person, JSON for a program, and exit codes."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import pytest
from tolerance import approx

import sitscad


def test_check_of_good_spec_exits_0(run):
    done = run("check", "good.yaml")
    assert done.code == 0
    assert done.out.splitlines()[-1].startswith("ok: ")
    assert done.err == ""


def test_findings_print_spec_line_with_caret_and_hint(run):
    done = run("check", "weak.yaml")
    assert done.code == 1
    lines = done.out.splitlines()
    first = next(i for i, line in enumerate(lines) if re.match(r"weak\.yaml:\d+:\d+ SIT2\d\d error .+", line))
    number, column = map(int, lines[first].split(" ")[0].split(":")[1:])
    source = Path("weak.yaml").read_text().splitlines()[number - 1]
    assert lines[first + 1] == f"{number:>5} | {source}"
    assert lines[first + 2].index("^") == len("      | ") + column - 1
    assert any(line.strip().startswith("hint: ") for line in lines[first + 3 : first + 8])
    assert lines[-1].startswith("not ok: ")


def test_check_of_invalid_spec_prints_finding_and_exits_2(run):
    done = run("check", "broken.yaml")
    assert done.code == 2
    assert re.match(r"broken\.yaml:4:\d+ SIT0\d\d error .*circel", done.out)
    assert "circle" in done.out
    assert re.search(r"not checked: \d+ rules \(the spec could not be read\)", done.out)
    whole = run("check", "-v", "broken.yaml").out
    assert re.search(r"not checked: .*SIT101-SIT\d+.*\(the spec could not be read\)", whole)


def test_brief_check_output_names_verbose_option_for_the_rest(run):
    """Nothing is lost: every finding, hint and reason of the document stands in the whole text."""
    short, whole = run("check", "good.yaml").out, run("check", "-v", "good.yaml").out
    (spec,) = json.loads(run("check", "good.yaml", "--format", "json").out)["specs"]
    assert len(short.splitlines()) < 12 and max(map(len, short.splitlines())) < 150
    assert f"not checked: {len(spec['not_checked'])} rules (check -v says which and why)\n" in short
    assert "check -v shows" in short.splitlines()[-1] and "hint: " not in short and not re.search("SIT... note", short)
    for finding in spec["findings"]:
        assert f"{finding['rule']} {finding['severity']} {finding['message']}\n" in whole
        assert f"hint: {finding['hint']}\n" in whole
        assert (f"{finding['rule']} warning {finding['message']}\n" in short) == (finding["severity"] == "warning")
    left_out = [skipped for skipped in spec["not_checked"] if not skipped["reason"].startswith("no requirements")]
    assert left_out and all(f"({skipped['reason']})" in whole for skipped in left_out)


def test_check_text_is_wrapped_in_terminal_and_not_in_pipe(run, monkeypatch):
    monkeypatch.delenv("COLUMNS", raising=False)
    piped = run("check", "-v", "weak.yaml").out
    monkeypatch.setenv("COLUMNS", "60")
    folded = run("check", "-v", "weak.yaml").out
    assert max(map(len, folded.splitlines())) <= 60 < max(map(len, piped.splitlines()))


def test_json_output_has_documented_content_only(run):
    done = run("check", "--format", "json", "good.yaml", "weak.yaml", "broken.yaml", "absent.yaml")
    document = json.loads(done.out)
    assert (done.code, done.err) == (2, "")
    assert document["sitscad"] == sitscad.__version__
    assert document["ok"] is False
    assert [(spec["spec"], spec["ok"]) for spec in document["specs"]] == [
        ("good.yaml", True),
        ("weak.yaml", False),
        ("broken.yaml", False),
        ("absent.yaml", False),
    ]
    keys = {"rule", "name", "severity", "message", "hint", "key", "line", "column"}
    keys |= {"measured", "limit", "unit", "source"}
    for spec in document["specs"]:
        parts = {"findings", "ignored", "not_checked", "felt", "signal", "fit", "closing", "board"}
        assert set(spec) == {"spec", "name", "ok", *parts}
        for finding in spec["findings"]:
            assert keys <= set(finding)
            assert finding["severity"] in ("error", "warning", "note")
        for skipped in spec["not_checked"]:
            assert set(skipped) == {"rule", "reason"}
    broken = document["specs"][2]
    assert (broken["findings"][0]["key"], broken["findings"][0]["line"]) == ("coil.shape", 4)
    known = {rule.id for rule in sitscad.RULES}
    assert {s["rule"] for s in broken["not_checked"]} | {f["rule"] for f in broken["findings"]} >= known


def test_rules_without_needed_sections_are_listed_as_not_checked(run):
    document = json.loads(run("check", "good.yaml", "--format=json").out)
    skipped = {entry["rule"] for entry in document["specs"][0]["not_checked"]}
    assert any(rule.startswith("SIT3") for rule in skipped), "the spec has no jaw, so its rules cannot be applied"
    assert skipped <= {rule.id for rule in sitscad.RULES}


def test_select_and_ignore_choose_rules_and_are_reported(run):
    errors = {f["rule"] for f in json.loads(run("check", "weak.yaml", "--format=json").out)["specs"][0]["findings"]}
    ignored = run("check", "weak.yaml", "--ignore", "SIT2", "--format=json")
    document = json.loads(ignored.out)["specs"][0]
    assert not [f for f in document["findings"] if f["rule"].startswith("SIT2")]
    left_out = {entry["rule"] for entry in document["not_checked"] if "--ignore" in entry["reason"]}
    assert left_out == {rule.id for rule in sitscad.RULES if rule.id.startswith("SIT2")}
    item = sorted(rule for rule in errors if rule.startswith("SIT2"))[0]
    selected = json.loads(run("check", "weak.yaml", "--select", item, "--format=json").out)["specs"][0]
    assert {f["rule"] for f in selected["findings"]} == {item}
    name = next(rule.name for rule in sitscad.RULES if rule.id == item)
    assert json.loads(run("check", "weak.yaml", "--select", name, "--format=json").out)["specs"][0] == selected


def test_findings_of_invalid_spec_cannot_be_ignored(run):
    assert run("check", "broken.yaml", "--ignore", "SIT0").code == 2


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["check"], "Missing argument"),
        (["check", "good.yaml", "--format", "jsn"], "Did you mean json?"),
        (["check", "good.yaml", "--select", "SIT999"], "no rule 'SIT999'"),
        (["check", "good.yaml", "--nonsense"], "--nonsense"),
        (["chek", "good.yaml"], "check"),
    ],
)
def test_wrong_arguments_exit_2_with_one_message(run, arguments, words):
    done = run(*arguments)
    assert done.code == 2
    assert words in done.err
    assert done.out == ""


def test_control_characters_in_spec_are_not_printed(run, tmp_path):
    (tmp_path / "bad\x1b[31m.yaml").write_bytes(b'sitscad: 1\nname: "a\x1b]0;owned\x07b"\n\x1b[2Jcoil: 3\n')
    done = run("check", str(tmp_path / "bad\x1b[31m.yaml"))
    assert done.code == 2
    assert "\x1b" not in done.out + done.err
    assert "\x07" not in done.out + done.err


def test_output_without_terminal_has_no_colour(run):
    assert "\x1b" not in run("check", "weak.yaml").out


def test_strict_check_exits_1_on_warnings_with_equal_output(run):
    """For CI: exit codes without the switch, and what stands on stdout, stay as they are."""
    lenient, strict = (run("check", "good.yaml", "--format", "json", *more) for more in ((), ("--strict",)))
    severities = [f["severity"] for f in json.loads(strict.out)["specs"][0]["findings"]]
    assert "warning" in severities and "error" not in severities
    assert (lenient.code, strict.code) == (0, 1) and strict.out == lenient.out
    assert lenient.err == "" and f"--strict: {severities.count('warning')} warnings and no error" in strict.err


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (("good.yaml", "--select", "SIT203"), 0),  # a note or nothing
        (("good.yaml", "--ignore", "SIT103"), 0),
        (("weak.yaml",), 1),
        (("good.yaml", "broken.yaml"), 2),
    ],
)
def test_strict_option_changes_no_other_exit_code(run, arguments, code):
    done = run("check", *arguments, "--strict")
    assert done.code == code and "--strict" not in done.err


FORMS = ("text", "json", "sarif", "junit", "github")


@pytest.mark.parametrize(
    ("arguments", "code", "form"),
    [
        (("good.yaml",), 0, "text"),
        (("good.yaml", "--strict"), 1, "text"),
        (("weak.yaml",), 1, "text"),
        (("absent.yaml",), 2, "text"),
        *((("weak.yaml", "broken.yaml"), 2, form) for form in FORMS),
    ],
)
def test_exit_codes_are_equal_in_every_output_format(run, form, arguments, code):
    assert run("check", *arguments, "--hints", "none", "--format", form).code == code


def test_github_summary_shows_boards_and_is_the_only_file_written(run, monkeypatch, tmp_path):
    page = tmp_path / "page.md"
    page.write_text("before\n")
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(page))
    monkeypatch.setenv("GITHUB_WORKSPACE", str(tmp_path.parent))
    assert run("check", "good.yaml", "--format", "json").code == 0
    assert page.read_text() == "before\n"
    done = run("check", "good.yaml", "weak.yaml", "broken.yaml", "--hints", "none", "--format", "github")
    text = page.read_text(encoding="utf-8")
    assert text.startswith("before\n")
    pictures = re.findall(r"```text\n([^`]*)```", text)
    assert len(pictures) == 2, "what cannot be read has no picture"
    for picture in pictures:
        assert sum("\u2800" < letter <= "\u28ff" for letter in picture) > 300
    assert f"file={tmp_path.name}/broken.yaml,line=4" in done.out


def test_github_summary_is_limited_in_size(run, monkeypatch, tmp_path):
    page = tmp_path / "page.md"
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(page))
    monkeypatch.setattr("sitscad.cli.checking.SUMMARY_LIMIT", 4000)
    run("check", "good.yaml", "weak.yaml", "--hints", "none", "--format", "github")
    assert page.stat().st_size <= 4000 and "```text" not in page.read_text(encoding="utf-8")


def test_check_json_validates_against_published_schema(run):
    import jsonschema

    schema = json.loads(run("schema", "--of", "check").out)
    document = json.loads(run("check", "good.yaml", "weak.yaml", "broken.yaml", "--format", "json").out)
    jsonschema.validate(document, schema)
    assert json.loads(run("schema").out)["title"] == "sitscad spec"
    assert run("schema", "--of", "chek").code == 2


TALL = Path(__file__).parents[1] / "report/broken/SIT319.yaml"


def test_picture_shows_missing_height_in_jaw(run, tmp_path):
    message = run("check", "--hints", "none", "--picture", "pictures/why.svg", str(TALL))
    drawn = (tmp_path / "pictures/why.svg").read_text()
    assert message.code == 1 and "drawn in pictures/why.svg" in message.err
    assert "needs 7.095" in drawn and "carried 2.095" in drawn and "#b00000" in drawn


def test_pictures_of_several_specs_are_named_after_specs(run, tmp_path):
    shutil.copy(TALL, tmp_path / "tall.yaml")
    bare = "coil: {shape: circle, outer_diameter: 8, turns: 14, layers: 2, trace_width: 0.1, trace_spacing: 0.1}\n"
    (tmp_path / "bare.yaml").write_text(f"sitscad: 1\nname: bare\n{bare}")
    message = run("check", "--hints", "none", "--picture", "drawn", "tall.yaml", "bare.yaml")
    assert [path.name for path in (tmp_path / "drawn").iterdir()] == ["tall.svg"]
    assert "bare.yaml: nothing to draw, drawn/bare.svg was not written" in message.err


@pytest.mark.parametrize(
    ("options", "why"),
    [
        (["--picture", "one.svg", "good.yaml", "weak.yaml"], "name a folder"),
        (["--picture", "one.png", "good.yaml"], "ends in .svg"),
        (["--picture", "one.svg", "--diff", "good.yaml"], "leave --fix and --diff out"),
        (["--picture", "drawn", "good.yaml", "./good.yaml"], "two specs"),
    ],
)
def test_impossible_picture_option_exits_2(run, options, why):
    message = run("check", "--hints", "none", *options)
    assert message.code == 2 and why in message.err


def test_check_reports_board_size_of_layout(run):
    """A round coil's board is a rectangle: that was seen only after a build."""
    board = json.loads(run("check", "--format", "json", "good.yaml").out)["specs"][0]["board"]
    layout = sitscad.lay_out(sitscad.load("good.yaml"))
    assert (board["body_length_m"], board["body_width_m"]) == approx(layout.body_size, rel=1e-9)
    assert board["length_m"] == approx(layout.body_size[0] + layout.tail_length, rel=1e-6)
    body = " x ".join(f"{size * 1e3:.4g}" for size in layout.body_size)
    assert f"body {body} mm, " in run("check", "good.yaml").out
