"""The other commands: what they print, and how they leave."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from tolerance import approx

import sitscad
from sitscad import cli
from sitscad.estimates import METHODS
from sitscad.spec import templates
from sitscad.spec.profiles import installed_rules


def test_new_writes_each_template_and_refuses_existing_file(run, tmp_path):
    listed = [line.split()[0] for line in run("new", "--list").out.splitlines()]
    assert set(listed) >= {"bench_7mm", "grasper_3p5mm", "grasper_4layer", "single_coil"}
    message = {}
    for name in listed:
        done = run("new", name)
        assert (done.code, done.out) == (0, f"{name}.yaml\n")
        assert sitscad.load(tmp_path / f"{name}.yaml").name
        (message[name],) = (line for line in done.err.splitlines() if "fpc.rules: recommended" in line)
    # "to start from: recommended" stood under templates that this profile refuses
    assert "cannot be made (SIT112, SIT135)" in message["round_button_12mm"]
    page = (Path(__file__).parents[2] / "docs/fabricators.md").read_text(encoding="utf-8")
    made = re.findall(r"`(\w+)`", page.split("`recommended`. These\ncan: ")[1].split(". ")[0])
    assert made == [name for name, line in message.items() if "can be made with" in line]
    (tmp_path / "single_coil.yaml").write_text("mine")
    refused = run("new", "single_coil")
    assert (refused.code, refused.out) == (2, "")
    assert "--force" in refused.err
    assert (tmp_path / "single_coil.yaml").read_text() == "mine"
    assert run("new", "single_coil", "--force").code == 0
    assert "coil:" in (tmp_path / "single_coil.yaml").read_text()
    assert sorted(path.name for path in tmp_path.iterdir() if path.name.startswith(".")) == []


def test_new_without_template_writes_recommended_design(run, tmp_path):
    assert run("new", "-o", "sensor.yaml").code == 0
    spec, first = sitscad.load(tmp_path / "sensor.yaml"), sitscad.load_text(templates.read("grasper_4layer"))
    assert (spec.name, spec.coil, spec.target) == ("sensor", first.coil, first.target)


@pytest.mark.parametrize(("template", "rules"), [("single_coil", "generic-flex"), ("grasper_4layer", "generic-fine")])
def test_new_prints_fabricator_profile_and_its_purpose(run, template, rules):
    printed = run("new", template).err
    for name in (rules, "recommended"):
        assert f"{name} ({installed_rules(name).purpose})" in printed


def test_new_list_describes_each_template(run):
    for line in run("new", "--list").out.splitlines():
        assert re.fullmatch(r"\w+ +\S.{15,}", line)


@pytest.mark.parametrize(("name", "words"), [("single_cole", "single_coil"), ("../secret", "There is no template")])
def test_unknown_template_suggests_nearest_name(run, tmp_path, name, words):
    before = sorted(tmp_path.iterdir())
    done = run("new", name)
    assert (done.code, done.out) == (2, "")
    assert words in done.err
    assert sorted(tmp_path.iterdir()) == before


def test_new_with_other_file_name_sets_sensor_name(run, tmp_path):
    assert run("new", "single_coil", "-o", "my sensor_2.yaml").code == 0
    assert "\nname: my-sensor-2" in (tmp_path / "my sensor_2.yaml").read_text()


def test_new_into_missing_folder_exits_2(run):
    done = run("new", "single_coil", "-o", "absent/x.yaml")
    assert done.code == 2
    assert "cannot write" in done.err


def test_rules_lists_and_explain_describes_every_rule(run):
    listed = run("rules").out.splitlines()
    assert [line.split()[0] for line in listed] == sorted(rule.id for rule in sitscad.RULES)
    for rule in sitscad.RULES:
        done = run("explain", rule.id)
        assert done.code == 0
        for part in (rule.name, rule.summary, rule.why, rule.mend, rule.source):
            assert part in done.out, f"{rule.id} does not say {part!r}"
        assert run("explain", rule.name).out == done.out
    unknown = run("explain", "SIT999")
    assert (unknown.code, unknown.out) == (2, "")


def test_schema_command_prints_json_schema(run):
    schema = json.loads(run("schema").out)
    assert "coil" in schema["properties"]


def test_estimate_of_spec_with_errors_prints_numbers_and_exits_1(run):
    done = run("estimate", "weak.yaml", "--format", "json")
    document = json.loads(done.out)
    assert done.code == 1
    assert "sitscad check weak.yaml" in done.err
    assert document["sitscad"] == sitscad.__version__
    assert document["spec"] == "weak.yaml"
    coil = document["coils"][0]
    parts = coil["inductance_parts_H"]
    assert 0 < parts["winding"] == coil["winding_inductance_H"] < 1e-5
    assert parts["leads"] + parts["tail"] > 0 > parts["crowding"]
    assert sum(parts.values()) == approx(coil["terminal_inductance_H"], rel=1e-9)
    assert set(coil["states"]) == {"free"}, "nothing is above or behind this coil"
    assert len(document["inductance_matrix_H"]) == 1


def test_estimate_text_of_good_spec_has_expected_rows(run):
    done = run("estimate", "good.yaml")
    assert (done.code, done.err) == (0, "")
    for word in ("winding inductance", "uH", "free (coil alone)", "RCOUNT", "Cross-checks"):
        assert word in done.out


def test_estimate_of_invalid_spec_prints_json_with_findings(run):
    done = run("estimate", "broken.yaml", "--format", "json")
    document = json.loads(done.out)
    assert done.code == 2
    assert document["coils"] == []
    assert document["findings"][0]["key"] == "coil.shape"
    text = run("estimate", "broken.yaml").out
    assert re.search(r"^broken.yaml:\d+:\d+ SIT\d+ error .*shape", text, re.M) and "nothing was estimated" in text


def test_estimate_uses_tolerance_and_method_options(run):
    done = run("estimate", "good.yaml", "--format=json", "--tolerance", "1e-3")
    assert json.loads(done.out)["coils"][0]["inductance_error"] <= 1e-3
    assert run("estimate", "good.yaml", "--tolerance", "-1").code == 2
    unknown = run("estimate", "good.yaml", "--method", "guessing")
    assert (unknown.code, unknown.out) == (2, "")
    assert all(method.name in unknown.err for method in METHODS)


@pytest.mark.parametrize(
    "command", ["new", "check", "estimate", "response", "build", "explain", "rules", "schema", "verify"]
)
def test_help_of_every_command_has_example(run, command):
    done = run(command, "--help")
    assert done.code == 0
    assert re.search(rf"Example:\n +sitscad {command}", done.out)


def test_estimate_help_explains_terms_of_its_tables(run):
    text = run("estimate", "--help").out
    words = re.search(r"Words in the tables:\n(.*?)\n\n", text, re.DOTALL).group(1)
    for word in ("Q", "Rp", "step", "shape factor", "sigma"):
        assert re.search(rf"^    {word} {{2,}}", words, re.MULTILINE), word


def test_internal_error_prints_one_sentence_without_traceback(run, monkeypatch):
    def faulty(*_args, **_kwargs):
        raise ZeroDivisionError("oh")

    monkeypatch.setattr("sitscad.cli.checking.inspect", faulty)
    done = run("check", "good.yaml")
    assert done.code == 2
    assert "Traceback" not in done.err
    assert "SITSCAD_TRACEBACK=1" in done.err
    monkeypatch.setenv("SITSCAD_TRACEBACK", "1")
    with pytest.raises(ZeroDivisionError):
        cli.main(["check", "good.yaml"])


@pytest.mark.parametrize(("error", "code"), [(KeyboardInterrupt(), 130), (BrokenPipeError(), 141)])
def test_interrupted_command_has_its_own_exit_code(run, monkeypatch, error, code):
    def interrupted(*_args, **_kwargs):
        raise error

    monkeypatch.setattr("sitscad.cli.checking.inspect", interrupted)
    assert run("check", "good.yaml").code == code


def test_missing_extra_prints_one_sentence_with_install_command(run, monkeypatch):
    def missing(*_args, **_kwargs):
        raise sitscad.MissingExtra("solids need build123d: pip install 'sitscad[all]'")

    monkeypatch.setattr("sitscad.cli.building.build_package", missing)
    done = run("build", "good.yaml")
    assert done.code == 2
    assert done.err == "sitscad: solids need build123d: pip install 'sitscad[all]'\n"


def test_estimate_at_a_frequency_needs_no_target_or_tank(run):
    document = json.loads(run("estimate", "good.yaml", "--at", "13.56MHz", "--at", "100 kHz", "--format", "json").out)
    first, second = document["at_frequency"]
    assert (first["coil"], first["frequency_Hz"], second["frequency_Hz"]) == ("C1", 13.56e6, 1e5)
    for key in ("winding_inductance_H", "winding_inductance_error", "winding_resistance_ohm",
                "winding_resistance_error", "winding_quality_factor", "inductance_H", "resistance_ohm",
                "resistance_error", "quality_factor", "apparent_inductance_H", "apparent_resistance_ohm"):
        assert 0.0 < first[key] < 1e3
    assert "13.56 MHz" in run("estimate", "good.yaml", "--at", "13.56MHz").out
    assert "at_frequency" not in json.loads(run("estimate", "good.yaml", "--format", "json").out)


@pytest.mark.parametrize("frequency", ["13.56", "0 MHz", "nonsense", "99 MHz"])
def test_estimate_at_invalid_frequency_exits_2(run, frequency):
    done = run("estimate", "good.yaml", "--at", frequency)
    assert done.code == 2 and "--at" in done.err
