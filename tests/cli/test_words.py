"""What a newcomer types and reads: names of rules in every form, severities, tolerances, a light installation."""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest

import sitscad
from sitscad.spec import templates


@pytest.mark.parametrize("word", ["SIT103", "sit103", "103", "coil-trace", "Coil-Trace", "coil_trace"])
def test_explain_accepts_rule_identifier_number_and_name(run, word):
    done = run("explain", word)
    assert done.code == 0
    assert done.out.startswith("SIT103 coil-trace (warning, error)\n")


def test_explain_accepts_several_rules_and_prefixes_without_duplicates(run):
    alone, both, all_of_them = (run("explain", *words) for words in (["SIT103"], ["SIT204", "103", "SIT204"], ["SIT2"]))
    assert both.out.endswith(f"\n\n\n{alone.out}") and both.out.startswith("SIT204 ")
    named = [line.split()[0] for line in all_of_them.out.splitlines() if line.startswith("SIT")]
    assert {"SIT201", "SIT219"} <= set(named) and all(name.startswith("SIT2") for name in named)


@pytest.mark.parametrize("word", ["999", "SIT999", "nonsense", "coil-trase"])
def test_unknown_rule_suggests_rules_command(run, word):
    done = run("explain", word)
    assert (done.code, done.out) == (2, "")
    assert "`sitscad rules`" in done.err
    assert ("Did you mean coil-trace?" in done.err) == (word == "coil-trase")


def test_check_selects_rules_by_number(run):
    done = run("check", "weak.yaml", "--select", "203")
    assert "SIT203" in done.out and done.code == 1


def test_rules_show_every_severity(run):
    lines = {line.split()[0]: line for line in run("rules").out.splitlines()}
    assert " warning, error " in lines["SIT103"]
    assert " note, warning, error " in lines["SIT308"]
    assert " error " in lines["SIT101"] and "warning" not in lines["SIT101"]


@pytest.mark.parametrize(("tolerance", "said"), [("1e-9", True), ("1e-2", False)])
def test_tolerance_below_all_methods_is_reported(run, tolerance, said):
    """It was said on stderr alone: a program that read the JSON and the exit code learnt nothing of it."""
    done = run("estimate", "good.yaml", "--format", "json", "--tolerance", tolerance)
    assert done.code == int(said)
    assert ("no method meets a tolerance of 1e-09" in done.err) == said
    notes = json.loads(done.out)["notes"]
    assert any("no method meets a tolerance of 1e-09" in note for note in notes) == said


def test_response_note_reports_error_above_tolerance():
    design = sitscad.Design(sitscad.load_text(templates.read("bench_7mm"), "bench_7mm.yaml"))
    pose = np.array([[0.0, 0.0, -1e-4, 0.0, 0.0, 0.0]])
    for tolerance, message in ((1e-9, True), (0.5, False), (None, False)):
        notes = sitscad.respond(design, pose, tolerance=tolerance).notes[0]
        assert any("tolerance of 1e-09" in note for note in notes) == message


def test_chosen_method_above_tolerance_is_reported(run):
    done = run("estimate", "good.yaml", "--method", "spiral-neumann", "--tolerance", "1e-9")
    assert "the method spiral-neumann does not meet a tolerance of 1e-09" in done.err


def test_error_count_is_printed_without_plural_bracket(run):
    done = run("estimate", "weak.yaml")
    assert done.code == 1
    assert "(s)" not in done.err and "the checks found " in done.err


@pytest.mark.parametrize("package", ["gerbonara", "shapely"])
def test_verify_without_gerber_reader_prints_install_command(run, monkeypatch, package):
    assert run("build", "good.yaml", "--only", "gerber").code == 0
    readers = [name for name in sys.modules if "extraction" in name or name.endswith("production_files")]
    for name in [*readers, *(name for name in sys.modules if name.split(".")[0] == package)]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    monkeypatch.delattr(sitscad, "extraction", raising=False)
    done = run("verify", "outputs/good-coil")
    assert (done.code, done.out) == (2, "")
    assert done.err == f"sitscad: reading Gerber files back needs {package}: pip install 'sitscad[all]'\n"


def test_resistances_in_recommended_template_comment_match_estimates():
    """Its comment gave the resistance at rest for the pressed state, too."""
    text = templates.read("grasper_4layer")
    coil = sitscad.estimate(sitscad.lay_out(sitscad.load_text(text, "it.yaml"))).coils[0]
    free, rest, pressed = (f"{coil.states[s].parallel_resistance / 1e3:.1f}" for s in ("free", "rest", "pressed"))
    words = " ".join(text.replace("\n# ", " ").split())
    assert f"{free} kohm free, {rest} kohm at rest and {pressed} kohm pressed" in words


def test_estimate_help_cites_equation_of_resonance_frequency(run):
    assert "equation 1" in " ".join(run("estimate", "--help").out.split())


def test_file_name_with_control_characters_is_printed_escaped(run, tmp_path):
    """Names in a folder that somebody else filled: of studies, of specs, of what is no spec."""
    for text in ("sitscad_study: 1\n", "sitscad: 1\n", "nothing\n"):
        (tmp_path / f"\x1b[2J\x07{text[:9]}\nok: no findings\r.yaml").write_text(text)
    done = run("check", ".")
    message = done.out + done.err
    assert done.code == 2
    assert all(letter.isprintable() or letter == "\n" for letter in message), message
    assert not any(line.startswith("ok") for line in message.splitlines())
