"""Fabricators' profiles as files beside the spec: inheritance, sources by line, and every way to get one wrong."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import fields, replace
from pathlib import Path

import pytest
from click.testing import CliRunner
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from one_rule import findings_of
from tolerance import approx

from sitscad.checks.findings import as_text, checked_spec
from sitscad.checks.judging import check
from sitscad.cli import cli
from sitscad.data import FOLDER
from sitscad.estimates.design import without_text
from sitscad.files.documents import order_notes as fabrication_notes
from sitscad.files.formats.kicad import project_files as kicad_rules
from sitscad.layout import lay_out
from sitscad.package.manifest import hash_inputs
from sitscad.spec import presets, profiles
from sitscad.spec.design_rules import RulesDocument
from sitscad.spec.format import kinds
from sitscad.spec.load import load, load_text
from sitscad.spec.profiles import installed_rules
from sitscad.spec.reading import SpecError
from sitscad.spec.sensor import json_schema

COIL = "coil: {shape: circle, outer_diameter: 7, turns: 5, layers: 2, trace_width: 0.15, trace_spacing: 0.15}"
ROOT = Path(__file__).parents[3]


@pytest.fixture
def folder(tmp_path):
    inside = tmp_path / "specs"
    inside.mkdir()
    return inside


def write(folder, rules, stackup="flex-2l-18um", **profiles):
    """A spec with these rules, and profiles by name, written into a folder."""
    for name, text in profiles.items():
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    spec = folder / "sensor.yaml"
    spec.write_text(f"sitscad: 1\nname: x\n{COIL}\nfpc: {{stackup: {stackup}, rules: {rules}}}\n", encoding="utf-8")
    return spec


def rules_of(folder, text, rules="ours.yaml", **more):
    return load(write(folder, rules, ours=text, **more)).fpc.rules


def refused(spec):
    with pytest.raises(SpecError) as caught:
        load(spec)
    return caught.value


def test_profile_values_override_base_and_cite_file_line(folder):
    rules = rules_of(
        folder,
        "based_on: jselectronic\nsource: their quotation\nvia_drill: 0.15\n"
        "annular_ring: {value: 90 um, source: on the telephone, status: unverified}\nstatic_bend_2: 12\n"
        "stiffened_tolerance_fr4: 80 um\npart_size: [6, 12]\nchecked_on: 2026-11-20\nfile_naming: kicad\n",
    )
    base = installed_rules("jselectronic")
    assert (rules.name, rules.via_drill, rules.annular_ring) == ("ours", 150e-6, approx(90e-6, rel=1e-6))
    assert rules.hole_to_hole == base.hole_to_hole and rules.sources["hole_to_hole"] == base.sources["hole_to_hole"]
    assert rules.sources["via_drill"] == "ours.yaml line 3: their quotation"
    assert rules.sources["annular_ring"] == "unverified: ours.yaml line 4: on the telephone"
    assert rules.static_bend_ratio == {**base.static_bend_ratio, 2: 12.0}
    assert rules.stiffened_tolerance["fr4"] == 80e-6
    assert rules.stiffened_tolerance["polyimide"] == base.stiffened_tolerance["polyimide"]
    assert rules.part_size == (6e-3, 12e-3) and rules.panel_size == base.panel_size
    assert (rules.checked_on, rules.file_naming, rules.coil_rule_binding) == ("2026-11-20", "kicad", True)
    assert rules.source == "their quotation; the rest from jselectronic"


@pytest.mark.parametrize("name", ["./ours.yaml", "ours.yaml", "shops/near.yaml", "shops/../ours.yaml"])
def test_profile_paths_are_relative_to_naming_file(folder, name):
    (folder / "shops").mkdir()
    (folder / "shops" / "near.yaml").write_text("based_on: nearer.yml\n")
    (folder / "shops" / "nearer.yml").write_text("via_drill: 0.11\n")
    assert rules_of(folder, "via_drill: 0.11\n", rules=name).via_drill == approx(110e-6, rel=1e-6)


def test_spec_overrides_profile_and_profile_overrides_its_base(folder):
    rules = rules_of(
        folder,
        "based_on: theirs.yaml\ntrace_width: 90 um\n",
        rules="{name: mine, based_on: ours.yaml, copper_to_edge: 0.4}",
        theirs="based_on: generic-fine\ntrace_width: 95 um\ntrace_spacing: 85 um\n",
    )
    assert (rules.name, rules.trace_width, rules.trace_spacing) == (
        "mine",
        approx(90e-6, rel=1e-6),
        approx(85e-6, rel=1e-6),
    )
    assert rules.copper_to_edge == approx(0.4e-3, rel=1e-6)
    assert rules.sources["trace_width"] == "ours.yaml line 2"
    assert rules.sources["trace_spacing"] == "theirs.yaml line 3"
    assert rules.sources["copper_to_edge"] == "the spec"
    assert rules.sources["coverlay_web"] == installed_rules("generic-fine").sources["coverlay_web"]


@pytest.mark.parametrize(("stackup", "wanted"), [("flex-2l-18um", 80e-6), ("flex-2l-35um", 120e-6)])
@pytest.mark.parametrize("kind", ["trace", "coil_trace"])
def test_profile_trace_limits_are_chosen_by_foil_thickness(folder, kind, stackup, wanted):
    text = "".join(
        f"{kind}_{what}_{foil}um: {size} um\n" for foil, size in ((18, 80), (35, 120)) for what in ("width", "spacing")
    )
    rules = rules_of(folder, text, stackup=stackup)
    assert getattr(rules, f"{kind}_width") == getattr(rules, f"{kind}_spacing") == approx(wanted, rel=1e-6)
    assert rules.sources[f"{kind}_width"] == f"ours.yaml line {1 if wanted < 100e-6 else 3}"


@pytest.mark.parametrize("kind", ["trace", "coil_trace"])
@pytest.mark.parametrize("base", ["hkgalaxy", "shop.yaml"])
@pytest.mark.parametrize("foil", [12, 18])
def test_profile_limit_for_thin_foil_keeps_base_limit_for_thick_foil(folder, kind, base, foil):
    rows = "".join(f"{kind}_{what}_{foil}um: 70 um\n" for what in ("width", "spacing"))
    shop = "based_on: hkgalaxy\n" + "".join(
        f"{kind}_{what}_{copper}um: {size} um\n"
        for copper, size in ((18, 90), (35, 130))
        for what in ("width", "spacing")
    )
    text = f"based_on: {base}\n{rows}"
    thick = rules_of(folder, text, stackup="flex-2l-35um", shop=shop)
    wanted = getattr(installed_rules("hkgalaxy").for_foil(35e-6), f"{kind}_width") if base == "hkgalaxy" else 130e-6
    assert getattr(thick, f"{kind}_width") == getattr(thick, f"{kind}_spacing") == approx(wanted, rel=1e-6)
    assert getattr(thick.for_foil(foil * 1e-6), f"{kind}_width") == approx(70e-6, rel=1e-6)


def test_plain_profile_limit_replaces_base_table_for_all_copper(folder):
    rules = rules_of(
        folder, "based_on: hkgalaxy\ntrace_width: 70 um\ncoil_trace_width: 75 um\n", stackup="flex-2l-35um"
    )
    base = installed_rules("hkgalaxy").for_foil(35e-6)
    assert (rules.trace_width, rules.coil_trace_width) == (approx(70e-6, rel=1e-6), approx(75e-6, rel=1e-6))
    assert (rules.trace_spacing, rules.coil_trace_spacing) == (base.trace_spacing, base.coil_trace_spacing)
    assert rules.for_foil(70e-6).trace_width == approx(70e-6, rel=1e-6)


@pytest.mark.parametrize(
    ("text", "binding"),
    [
        ("via_drill: 0.2\n", False),
        ("coil_trace_width: 0.2\n", True),
        ("coil_trace_width: 0.2\ncoil_rule_binding: false\n", False),
        ("based_on: hkgalaxy\ncoil_rule_binding: false\n", False),
        ("coil_rule_binding: true\n", True),
    ],
)
def test_written_coil_limits_are_binding_unless_profile_states_otherwise(folder, text, binding):
    assert rules_of(folder, text).coil_rule_binding is binding


def test_check_uses_profile_limit_and_cites_its_line(folder):
    spec = load(write(folder, "ours.yaml", ours="name: our shop\ntrace_width: 0.2\n"))
    found = findings_of("SIT101", spec)
    assert found and all("our shop" in f.message and f.source == "ours.yaml line 2" for f in found)
    assert found[0].limit == approx(200e-6, rel=1e-6) and found[0].key == "coil.trace_width" and found[0].file is None


def messages(spec, *rules):
    return {f.rule: f.message for f in check(spec).findings if f.rule in rules}


@pytest.mark.slow
def test_finding_names_profile_that_states_the_limit(folder):
    """With the one that is based on it, where that is what the spec names; a user's with file and line."""
    message = {name: messages(load(write(folder, name)), "SIT103")["SIT103"] for name in ("wellpcb", "generic-flex")}
    assert "minimum 152.4 um (wellpcb (which takes that from generic-flex))" in message["wellpcb"]
    assert "minimum 152.4 um (generic-flex)" in message["generic-flex"]
    loop = "coil_trace_width: 0.2\ncoil_trace_spacing: 0.2\n"
    own = load(write(folder, "ours.yaml", ours="based_on: shop.yaml\nvia_drill: 0.2\n", shop=f"name: a shop\n{loop}"))
    assert "minimum 200 um (a shop (shop.yaml line 3))" in messages(own, "SIT103")["SIT103"]
    inline = load(write(folder, "{coil_trace_width: 0.2, coil_trace_spacing: 0.2}"))
    assert "minimum 200 um (the spec (line 4))" in messages(inline, "SIT103")["SIT103"]
    assert own.fpc.rules.holders["via_drill"] == "ours (ours.yaml line 2)"
    assert own.fpc.rules.holders["hole_to_hole"] == "generic-flex"
    table = "trace_width_18um: 0.2\ntrace_spacing_18um: 0.25\n"
    rows = messages(load(write(folder, "ours.yaml", ours=table)), "SIT101", "SIT102")
    assert "minimum 200 um (ours (ours.yaml line 1))" in rows["SIT101"]
    assert "minimum 250 um (ours (ours.yaml line 2))" in rows["SIT102"]


def test_every_installed_limit_names_the_profile_that_states_it():
    for name in presets.names("rules"):
        rules = installed_rules(name)
        assert set(rules.holders.values()) <= set(presets.names("rules")) and set(rules.sources) <= {
            *rules.holders,
            "trace_width",
            "trace_spacing",
            "coil_trace_width",
            "coil_trace_spacing",
        }
        for field, source in rules.sources.items():
            assert source.count("(from ") <= 1
            assert (f"(from {rules.holders[field]})" in source) == (rules.holders[field] != name), (name, field)


def test_console_marks_unverified_limits_and_cites_profile_line(folder):
    """What decides a finding and was not verified says so where people read it, not only in the JSON."""
    text = "trace_width: {value: 0.2, source: on the telephone, status: unverified}\nstatic_bend_2: 800\n"
    spec = write(folder, "ours.yaml", ours=text)
    spec.write_text(spec.read_text().replace("rules:", "tail: {length: 30, bend: static}, rules:"))
    shown = CliRunner().invoke(cli, ["check", str(spec)], standalone_mode=False).output
    assert re.search(r"SIT101 error .* 200 um \(ours \(ours.yaml line 1\) \(unverified\)\)", shown)
    assert re.search(r"\b800\b.* \(ours \(ours.yaml line 2\)\)", shown)
    assert re.search(r"SIT106 error .* \(generic-flex \(unverified\)\)", _tight(folder))


def _tight(folder):
    """What the check prints of a board whose holes stand close together, by a figure that nobody has seen."""
    layout = lay_out(load(write(folder, "generic-flex")))
    item = layout.vias[0]
    near = replace(item, centre=item.centre.shifted(item.drill + 0.1e-3, 0.0))
    findings = check(layout.spec, replace(layout, vias=(*layout.vias, near)))
    return as_text([checked_spec(layout.spec.name, layout.spec.source, findings.findings, findings.not_checked)])


def foil(thickness):
    """A stack-up of two layers of foil of a thickness in micrometres, each with the usual 12 um of plating on it."""
    copper, film = f"{{copper: {thickness + 12} um}}", "{dielectric: 25 um}"
    return f"[{{coverlay: 25 um}}, {copper}, {film}, {copper}, {{coverlay: 25 um}}]"


def of_tracks(spec):
    """Findings on widths and gaps of tracks and coiled tracks."""
    return [each for rule in ("SIT101", "SIT102", "SIT103") for each in findings_of(rule, spec)]


def unknown(found, copper):
    """The rules that miss a figure for the copper (um), with their severities: it is thicker than any with a figure."""
    rows = [f for f in found if f.rule in ("SIT101", "SIT102", "SIT103") and f.limit < f.measured]
    return {(f.rule, f.severity.value) for f in rows if f.measured == approx(1e-6 * copper, rel=1e-6)}


@pytest.mark.parametrize(("thickness", "is_said"), [(18, False), (35, False), (36, True), (210, True)])
@pytest.mark.parametrize("base", ["generic-flex", "generic-fine", "osh-park-flex", "lab-circuits", "wellpcb"])
def test_copper_thicker_than_stated_limits_yields_errors(folder, thickness, is_said, base):
    """Also for a generic figure: 100 um between tracks of 210 um copper is etched by nobody."""
    findings = of_tracks(load(write(folder, base, stackup=foil(thickness))))
    message = {("SIT101", "error"), ("SIT102", "error"), ("SIT103", "warning")}
    assert unknown(findings, thickness) == (message if is_said else set())


@pytest.mark.slow
def test_user_limits_for_thick_copper_yield_no_unknown_limit_errors(folder):
    """A plain figure holds whatever the copper; one for 70 um holds there, and not beyond."""
    plain = "trace_width: 0.1\ntrace_spacing: 0.1\ncoil_trace_width: 0.1\ncoil_trace_spacing: 0.1\n"
    findings = of_tracks(load(write(folder, "ours.yaml", stackup=foil(210), ours=plain)))
    assert unknown(findings, 210) == set()
    thick = "trace_width_70um: 0.1\ntrace_spacing_70um: 0.1\n"
    findings = {t: of_tracks(load(write(folder, "ours.yaml", stackup=foil(t), ours=thick))) for t in (70, 105)}
    assert unknown(findings[70], 70) == {("SIT103", "warning")}
    assert unknown(findings[105], 105) == {("SIT101", "error"), ("SIT102", "error"), ("SIT103", "warning")}


def test_output_files_mark_limits_not_valid_for_copper_thickness(folder):
    """A board built in spite of the errors: KiCad's rules and the order's readme do not pass it off as the house's."""
    files = {}
    for thickness in (35, 210):
        layout = lay_out(load(write(folder, "generic-flex", stackup=foil(thickness))))
        files[thickness] = kicad_rules.custom_rules(layout.spec.fpc.rules), fabrication_notes.order_readme(layout)
    rules, notes = files[210]
    assert rules.count("(for copper up to 35 um: nothing is stated for 210 um)") == 2
    assert "these widths are for copper up to 35 um, not for 210 um" in " ".join(notes.split())
    assert not any("copper up to" in text for text in files[35])


def test_changed_profile_changes_package_inputs(folder):
    spec = write(folder, "ours.yaml", ours="copper_to_edge: 0.3\n")
    before = hash_inputs(without_text(load(spec)))
    (folder / "ours.yaml").write_text("copper_to_edge: 0.31\n")
    assert hash_inputs(without_text(load(spec))) != before


FAULTS = {
    "unknown key": ("trace_widht: 0.1\n", "SIT002", 1, 1),
    "not a number": ("via_drill: 0.2\ntrace_width: .nan\n", "SIT006", 2, 14),
    "infinite": ("trace_width: .inf\n", "SIT006", 1, 14),
    "out of range": ("trace_width: 1 um\n", "SIT006", 1, 14),
    "a unit of something else": ("\n\ntrace_width: 100 ohm\n", "SIT005", 3, 14),
    "no value": ("trace_width:\n", "SIT004", 1, 1),
    "a list": ("trace_width: [1, 2]\n", "SIT004", 1, 14),
    "yes is a text": ("coil_rule_binding: yes\n", "SIT004", 1, 20),
    "a misspelt mark": ("via_drill: {value: 0.2, status: seen}\n", "SIT007", 1, 12),
    "a figure without value": ("via_drill: {source: them}\n", "SIT003", 1, 12),
    "an unknown word of a figure": ("via_drill: {value: 0.2, sorce: them}\n", "SIT002", 1, 12),
    "an unknown base": ("via_drill: 0.2\nbased_on: generic-flexx\n", "SIT007", 2, 11),
    "width without spacing": ("trace_width_18um: 0.1\n", "SIT003", 1, 19),
    "one figure and a table": ("trace_width: 0.1\ntrace_width_18um: 0.1\ntrace_spacing_18um: 0.1\n", "SIT009", 1, 14),
    "no date": ("checked_on: yesterday\n", "SIT006", 1, 13),
    "empty": ("", "SIT001", 1, 1),
    "a word": ("trace_width\n", "SIT001", 1, 1),
    "twice": ("trace_width: 0.1\ntrace_width: 0.2\n", "SIT012", 2, 1),
    "an alias": ("trace_width: &a 0.1\ntrace_spacing: *a\n", "SIT013", 1, 14),
    "an object": ("name: !!python/object/apply:os.system ['true']\n", "SIT013", 1, 7),
    "two documents": ("trace_width: 0.1\n---\ntrace_width: 0.2\n", "SIT013", 2, 1),
    "deep": ("trace_width: " + "[" * 500, "SIT010", 1, 25),
    "large": ("# " + "x" * 300_000, "SIT010", 1, 1),
    "a spec": (f"sitscad: 1\nname: x\n{COIL}\n", "SIT002", 1, 1),
    "its own base": ("via_drill: 0.2\nbased_on: ours.yaml\n", "SIT018", 2, 11),
    "a missing base": ("based_on: theirs.yaml\n", "SIT011", 1, 11),
    "a base outside": ("based_on: ../theirs.yaml\n", "SIT017", 1, 11),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_profile_fault_is_reported_at_line_of_profile_file(folder, fault):
    text, rule, line, column = FAULTS[fault]
    (folder.parent / "theirs.yaml").write_text("via_drill: 0.3\n")
    spec = write(folder, "ours.yaml", ours=text)
    error = refused(spec)
    first = error.findings[0]
    assert (first.rule, first.line, first.column) == (rule, line, column), first
    assert first.file == str(folder / "ours.yaml") and error.texts[first.file] == (text if fault != "large" else "")
    assert first.message and "fpc.rules" not in first.message


def test_invalid_utf8_in_profile_is_reported_with_line_and_column(folder):
    spec = write(folder, "ours.yaml")
    (folder / "ours.yaml").write_bytes(b"name: x\nsource: \xff\n")
    (findings,) = refused(spec).findings
    assert (findings.rule, findings.line, findings.column) == ("SIT011", 2, 9) and "0xFF" in findings.message


@pytest.mark.parametrize(
    ("name", "rule", "words"),
    [
        ("gone.yaml", "SIT011", "not there"),
        ("shops.yaml", "SIT011", "not a file"),
        ("pipe.yaml", "SIT011", "not a file"),
        ("loop.yaml", "SIT011", "loop.yaml"),
        ("../theirs.yaml", "SIT017", "outside"),
        ("shops.yaml/../../theirs.yaml", "SIT017", "outside"),
        ("link.yaml", "SIT017", "outside"),
        ("/etc/passwd.yaml", "SIT017", "not a path below"),
        ("'C:\\x.yaml'", "SIT017", "not a path below"),
        ("'..\\theirs.yaml'", "SIT017", "not a path below"),
        ('"a\\0.yaml"', "SIT006", "form"),
        ("/etc/passwd", "SIT007", "not known"),
        ("ourshop", "SIT007", "not known"),
        ("generic-flex.yaml", "SIT011", "not there"),
    ],
)
def test_unreadable_or_forbidden_profile_is_reported_at_fpc_rules(folder, name, rule, words):
    import os

    (folder.parent / "theirs.yaml").write_text("via_drill: 0.3\n")
    (folder / "link.yaml").symlink_to(folder.parent / "theirs.yaml")
    (folder / "loop.yaml").symlink_to(folder / "loop.yaml")
    (folder / "shops.yaml").mkdir()
    os.mkfifo(folder / "pipe.yaml")
    (findings,) = refused(write(folder, name)).findings
    assert (findings.rule, findings.key, findings.line, findings.file) == (rule, "fpc.rules", 4, None)
    assert words in findings.message and findings.hint
    if rule == "SIT007":
        assert "ourshop.yaml" in findings.hint


@pytest.mark.parametrize("name", ["ours.YAML", "Ours.Yml", "ours.YML"])
def test_profile_suffix_in_capitals_is_accepted(folder, name):
    (folder / name).write_text("via_drill: 0.3\n")
    spec = load(write(folder, name))
    assert spec.fpc.rules.via_drill == approx(0.3e-3, rel=1e-6) and spec.fpc.rules.holders["via_drill"].endswith(
        f"({name} line 1)"
    )
    (gone,) = refused(write(folder, "gone.Yaml")).findings
    assert gone.rule == "SIT011" and name in gone.hint
    files = [each["pattern"] for each in _all(json_schema()) if each.get("examples") == ["ourshop.yaml"]]
    assert files and all(re.search(pattern, name) for pattern in files)


def _all(schema):
    """A schema and every one within it."""
    if isinstance(schema, dict):
        yield schema
        for value in schema.values():
            yield from _all(value)
    elif isinstance(schema, list):
        for value in schema:
            yield from _all(value)


def test_circular_profile_bases_are_reported_with_all_files(folder):
    spec = write(
        folder, "a.yaml", a="based_on: b.yaml\n", b="based_on: c.yaml\n", c="via_drill: 0.2\nbased_on: b.yaml\n"
    )
    (findings,) = refused(spec).findings
    assert findings.rule == "SIT018" and "b.yaml -> c.yaml -> b.yaml" in findings.message
    assert (Path(findings.file).name, findings.line) == ("c.yaml", 2)


def test_chain_of_40_profiles_is_refused_at_limit(folder):
    spec = write(folder, "p0.yaml", **{f"p{i}": f"based_on: p{i + 1}.yaml\n" for i in range(40)})
    (findings,) = refused(spec).findings
    assert findings.rule == "SIT010" and Path(findings.file).name == "p7.yaml"


def test_faults_of_spec_and_profile_are_reported_together(folder):
    spec = write(folder, "ours.yaml", ours="trace_widht: 0.1\n")
    spec.write_text(spec.read_text().replace("turns: 5", "turns: 50"))
    assert [(f.rule, f.file is None) for f in refused(spec).findings] == [("SIT016", True), ("SIT002", False)]


def test_spec_text_without_path_cannot_name_profile_file(folder, monkeypatch):
    spec = write(folder, "ours.yaml", ours="via_drill: 0.3\n")
    monkeypatch.chdir(folder)
    with pytest.raises(SpecError) as caught:
        load_text(spec.read_text())
    assert [f.rule for f in caught.value.findings] == ["SIT017"]
    assert load("sensor.yaml").fpc.rules.via_drill == approx(0.3e-3, rel=1e-6)


def test_check_prints_profile_line_and_json_states_profile_path(folder):
    spec = write(folder, "ours.yaml", ours="# our shop\ntrace_widht: 0.1\n")
    shown = CliRunner().invoke(cli, ["check", str(spec)], standalone_mode=False)
    assert f"{folder / 'ours.yaml'}:2:1 SIT002 error" in shown.output
    assert "    2 | trace_widht: 0.1" in shown.output and "did you mean trace_width?" in shown.output
    shown = CliRunner().invoke(cli, ["check", "--format", "json", str(spec)], standalone_mode=False)
    assert json.loads(shown.output)["specs"][0]["findings"][0]["file"] == str(folder / "ours.yaml")


def test_profile_example_of_spec_page_loads(folder):
    text = (ROOT / "docs" / "spec.md").read_text(encoding="utf-8")
    (profile,) = re.findall(r"^```yaml profile\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    rules = rules_of(folder, profile)
    assert (rules.name, rules.trace_width, rules.coil_rule_binding) == ("our shop", approx(80e-6, rel=1e-6), False)
    line = next(n for n, row in enumerate(profile.splitlines(), 1) if row.startswith("annular_ring"))
    assert rules.sources["annular_ring"] == f"unverified: ours.yaml line {line}: on the telephone"
    assert f"`ourshop.yaml line {line}: on the telephone`" in text


@pytest.mark.parametrize("name", presets.names("rules"))
def test_installed_profile_equals_its_text_loaded_as_user_profile(folder, name):
    text = (FOLDER / "fabricators" / f"{name}.yaml").read_text(encoding="utf-8")
    installed = installed_rules(name).for_foil(18e-6)
    rules = rules_of(folder, text)
    figures = [f.name for f in fields(rules) if f.name not in ("name", "source", "sources", "holders", "beyond")]
    bare = {"coil_lines": (), "track_lines": ()}
    ours, theirs = replace(rules, **bare), replace(installed, **bare)
    assert [getattr(ours, f) for f in figures] == [getattr(theirs, f) for f in figures]
    for table in ("coil_lines", "track_lines"):
        rows, others = getattr(rules, table), getattr(installed, table)
        assert [(r.copper, r.width, r.spacing) for r in rows] == [(r.copper, r.width, r.spacing) for r in others]
    marked = {field for field, source in installed.sources.items() if source.startswith("unverified: ")}
    assert {field for field, source in rules.sources.items() if source.startswith("unverified: ")} == marked


YESTERDAYS = """\
name: our shop
based_on: generic-flex            # an installed profile, or another file in this folder
source: their quotation of 2026-11-20
checked_on: 2026-11-20
trace_width_18um: 80 um           # by the copper: the coil's foil decides which pair holds
trace_spacing_18um: {value: 80 um, source: their page on fine lines}
trace_width_35um: 120 um
trace_spacing_35um: 120 um
annular_ring: {value: 0.1, source: on the telephone, status: unverified}
coil_trace_width: 0.1
coil_trace_spacing: 0.1
coil_rule_binding: false          # their minimum for coils warns, and is no error
static_bend_2: 12                 # times the thickness
part_size: [5, 10]
"""


def test_profile_of_first_version_gives_unchanged_rules(folder):
    rules = rules_of(folder, YESTERDAYS)
    assert (rules.name, rules.trace_width, rules.trace_spacing) == ("our shop", 80e-6, 80e-6)
    assert [(row.copper, row.width) for row in rules.track_lines] == [(18e-6, 80e-6), (35e-6, 120e-6)]
    assert rules.sources["trace_width"] == "ours.yaml line 5: their quotation of 2026-11-20"
    assert rules.sources["trace_spacing"] == "ours.yaml line 6: their page on fine lines"
    assert rules.sources["annular_ring"] == "unverified: ours.yaml line 9: on the telephone"
    assert (rules.coil_trace_width, rules.coil_lines, rules.coil_rule_binding) == (100e-6, (), False)
    assert (rules.static_bend_ratio[2], rules.part_size) == (12.0, (5e-3, 10e-3))
    assert rules.holder("trace_width") == "our shop (ours.yaml line 5)"
    assert rules.source == "their quotation of 2026-11-20; the rest from generic-flex"


NINE = """\
based_on: hkgalaxy
tracks:
  - {copper: 9 um, width: {value: 40 um, source: page}, spacing: {value: 45 um, source: a call, status: unverified}}
  - copper: 18 um
    width: 3 mil
    spacing: 3 mil
"""
NINE_MICROMETRES = "[{coverlay: 25 um}, {copper: 9 um}, {dielectric: 25 um}, {copper: 9 um}, {coverlay: 25 um}]"


def test_fabricator_of_9_um_foil_is_added_by_profile_file(folder):
    rules = rules_of(folder, NINE, stackup=NINE_MICROMETRES)
    assert (rules.trace_width, rules.trace_spacing) == (approx(40e-6, rel=1e-6), approx(45e-6, rel=1e-6))
    assert rules.sources["trace_width"] == "ours.yaml line 3: page"
    assert rules.sources["trace_spacing"] == "unverified: ours.yaml line 3: a call"
    assert rules.holder("trace_spacing") == "ours (ours.yaml line 3)"
    thicker = rules_of(folder, NINE, stackup=NINE_MICROMETRES.replace("9 um", "27 um"))
    assert (thicker.trace_width, thicker.sources["trace_width"]) == (approx(76.2e-6, rel=1e-6), "ours.yaml line 5")


def test_profile_table_replaces_base_table_and_reports_thicker_foil(folder):
    spec = write(folder, "ours.yaml", stackup="flex-2l-35um", ours=NINE)
    rules = load(spec).fpc.rules
    assert [row.copper for row in rules.track_lines] == [9e-6, 18e-6]
    assert rules.beyond["trace_width"] == 18e-6 and "nothing is stated for 35 um" in rules.sources["trace_width"]


def test_installed_fabricator_of_9_um_foil_is_added_by_file(folder, tmp_path, monkeypatch):
    data = tmp_path / "data"
    shutil.copytree(FOLDER, data)
    (data / "fabricators" / "nine.yaml").write_text(NINE, encoding="utf-8")
    for module in (kinds, profiles):
        monkeypatch.setattr(module, "FOLDER", data)
    caches = (kinds.names, profiles.installed_rules)
    try:
        for each in caches:
            each.cache_clear()
        rules = load(write(folder, "nine", stackup=NINE_MICROMETRES)).fpc.rules
    finally:
        for each in caches:
            each.cache_clear()
    assert (rules.name, rules.trace_width, rules.sources["trace_width"]) == ("nine", approx(40e-6, rel=1e-6), "page")
    assert rules.sources["trace_spacing"] == "unverified: a call"
    assert rules.sources["via_drill"].endswith("(from hkgalaxy)")


@pytest.mark.parametrize(
    ("text", "rule", "key"),
    [
        ("tracks: []\n", "SIT006", "tracks"),
        ("tracks: [{copper: 9 um, width: 40 um}]\n", "SIT003", "tracks.0.spacing"),
        ("tracks: [{copper: 0.1 um, width: 40 um, spacing: 40 um}]\n", "SIT006", "tracks.0.copper"),
        ("tracks: [{copper: 9 um, width: 40 um, spacing: 40 um, via: 1}]\n", "SIT002", "tracks.0.via"),
        (
            "tracks: [{copper: 9 um, width: 40 um, spacing: 1}, {copper: 9 um, width: 1, spacing: 1}]\n",
            "SIT009",
            "tracks.1.copper",
        ),
        ("tracks: [{copper: 9 um, width: 1, spacing: 1}]\ntrace_width: 0.1\n", "SIT009", "trace_width"),
        (
            "tracks: [{copper: 9 um, width: 1, spacing: 1}]\ntrace_width_9um: 1\ntrace_spacing_9um: 1\n",
            "SIT009",
            "trace_width_9um",
        ),
        ("coil_trace_width_9um: 1\n", "SIT003", "coil_trace_width_9um"),
        ("trace_width_9um: 90 mm\ntrace_spacing_9um: 1\n", "SIT006", "trace_width_9um"),
        ("trace_width_9: 0.1\n", "SIT002", "trace_width_9"),
        ("based_on: none\nvia_drill: 0.2\n", "SIT003", "based_on"),
    ],
)
def test_contradictory_profile_tables_are_reported_at_their_line(folder, text, rule, key):
    findings = refused(write(folder, "ours.yaml", ours=text)).findings
    assert (rule, key) in [(finding.rule, finding.key) for finding in findings]
    assert all(finding.file and finding.file.endswith("ours.yaml") and finding.line for finding in findings)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.dictionaries(st.sampled_from([*RulesDocument.keys, "trace_width_9um", "coil_trace_spacing_18um"]), st.one_of(
    st.none(), st.booleans(), st.floats(), st.integers(), st.text(max_size=8),
    st.dictionaries(st.sampled_from(["value", "source", "status", "x"]), st.one_of(st.floats(), st.text(max_size=5))),
), max_size=5))
def test_random_profile_values_give_rules_or_findings(folder, values):
    spec = write(folder, "ours.yaml", ours=json.dumps(values))
    try:
        rules = load(spec).fpc.rules
    except SpecError as error:
        assert error.findings and all(finding.file and finding.line for finding in error.findings)
    else:
        assert rules.trace_width > 0
