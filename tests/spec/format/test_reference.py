"""docs/spec.md: every key of the format, and examples that load."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from tolerance import approx

from sitscad.basics.finding import Severity
from sitscad.checks.judging import check
from sitscad.spec import presets
from sitscad.spec.load import load_text
from sitscad.spec.reading import SpecError
from sitscad.spec.sensor import json_schema

DOCS = Path(__file__).parents[3] / "docs"
TEXT = (DOCS / "spec.md").read_text(encoding="utf-8")


def tables():
    """The keys of every table, by the heading above it."""
    result = {}
    for block in re.split(r"^## ", TEXT, flags=re.MULTILINE)[1:]:
        result[block.splitlines()[0]] = re.findall(r"^\| `(\w+)` \|", block, re.MULTILINE)
    return {title: keys for title, keys in result.items() if keys}


def test_reference_page_lists_keys_of_each_section_in_schema_order():
    schema = json_schema()
    wanted = sorted([list(node["properties"]) for node in (schema, *schema["$defs"].values())])
    assert sorted(tables().values()) == wanted
    assert tables()["Top level"] == list(schema["properties"])


def test_reference_page_contains_every_enumerated_schema_value():
    def words(node):
        if isinstance(node, dict):
            yield from node.get("enum", ())
            for inner in node.values():
                yield from words(inner)
        elif isinstance(node, list):
            for inner in node:
                yield from words(inner)

    assert all(f"`{word}`" in TEXT for word in words(json_schema()))


@pytest.mark.parametrize("kind", ["elastomer", "stackup", "jaw"])
def test_reference_page_has_row_with_numbers_for_each_preset(kind):
    rows = {line.split("|")[1].strip(): line for line in TEXT.splitlines() if line.startswith("| ")}
    for name in presets.names(kind):
        assert re.search(r"\d", rows[name].removeprefix(f"| {name} |")), name
    assert "27.5 kPa | 37 %" in rows["ecoflex-00-50"] and "30, 18, 18, 30 um" in rows["flex-4l"]
    assert "4.8 mm | 20 mm" in rows["generic-5mm"]


def test_every_link_in_reference_page_targets_a_heading():
    slugs = {
        re.sub(r"[^a-z0-9 _-]", "", title.lower()).replace(" ", "-") for title in re.findall(r"^## (.+)$", TEXT, re.M)
    }
    links = re.findall(r"\]\(#([^)]+)\)", TEXT)
    assert links and set(links) <= slugs


def test_example_of_reference_page_loads_and_passes_check():
    (text,) = re.findall(r"^```yaml\n(.*?)^```", TEXT, re.DOTALL | re.MULTILINE)
    spec = load_text(text, "written-out.yaml")
    assert (spec.fpc.rules.name, spec.mount.jaw.name) == ("my fabricator", "my grasper")
    assert (spec.target.material.name, spec.elastomer.material.name) == ("CuBe2", "my silicone")
    assert [layer.thickness for layer in spec.fpc.stackup.copper] == approx([47e-6, 47e-6], rel=1e-6)
    assert not [f for f in check(spec, hints="none").findings if f.severity is not Severity.NOTE]


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("fpc: {rules: oshpark}", ["any of name, based_on, source, trace_width"]),
        ("fpc: {stackup: my-build}", ["a list of sections with coverlay, copper, dielectric"]),
        ("mount: {jaw: mine}", ["any of name, based_on, width, length, height, port_diameter"]),
        ("target: {material: gold}", ["conductivity and, if wanted"]),
        ("elastomer: {material: mine}", ["shear_modulus and, if wanted, name, uncertainty"]),
    ],
)
def test_unknown_preset_name_hint_shows_how_to_write_values_out(line, words):
    coil = "coil: {shape: circle, outer_diameter: 8, turns: 8, trace_width: 0.15, trace_spacing: 0.15}"
    with pytest.raises(SpecError) as caught:
        load_text(f"sitscad: 1\nname: x\n{coil}\n{line}\n")
    (findings,) = caught.value.findings
    assert findings.rule == "SIT007" and "allowed: " in findings.hint
    for part in (*words, "or write it out", "docs/spec.md"):
        assert part in findings.hint
