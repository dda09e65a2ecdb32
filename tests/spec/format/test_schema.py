"""The JSON Schema describes what the loader reads: same keys, presets as enumerations, templates valid."""

from __future__ import annotations

import json

import pytest

from sitscad.cli import run
from sitscad.spec import presets, templates
from sitscad.spec.sensor import SpecDocument, json_schema
from sitscad.spec.yaml.source import read_yaml


def section(name):
    schema = json_schema()
    for part in name.split("."):
        node = schema["properties"][part]
        if "$ref" in node:
            node = json_schema()["$defs"][node["$ref"].rpartition("/")[2]]
        schema = node
    return schema


def options(node):
    return [option for entry in node.get("anyOf", node.get("oneOf", [node])) for option in [entry]]


def test_schema_states_dialect_file_pattern_and_required_keys():
    schema = json_schema()
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert schema["fileMatch"] == ["*.sensor.yaml"]
    assert schema["required"] == ["sitscad", "name", "coil"]
    assert section("coil")["required"] == []
    ways = [set(way["required"]) for way in section("coil")["oneOf"]]
    four, always = {"turns", "inner_diameter", "trace_width", "trace_spacing"}, {"shape", "outer_diameter"}
    assert sorted(map(sorted, ways)) == sorted([["drawn"], *(sorted(always | four - {item}) for item in four)])
    assert schema["additionalProperties"] is False


def test_each_schema_has_its_own_urn(capsys):
    names = []
    for document in ("spec", "check", "calibration", "study"):
        assert run(["schema", "--of", document]) == 0
        names.append(json.loads(capsys.readouterr().out)["$id"])
    assert names == [f"urn:sitscad:{name}:1" for name in ("spec", "check", "calibration", "study")]


def test_schema_is_json_and_repeatable():
    assert json.dumps(json_schema()) == json.dumps(json_schema())


@pytest.mark.parametrize(
    ("key", "kind"),
    [
        ("fpc.stackup", "stackup"),
        ("fpc.rules", "rules"),
        ("fpc.tail.connector", "connector"),
        ("mount.jaw", "jaw"),
        ("target.material", "conductor"),
        ("elastomer.material", "elastomer"),
    ],
)
def test_schema_enumerates_all_presets(key, kind):
    names = [option["enum"] for option in options(section(key)) if "enum" in option]
    assert names == [list(presets.names(kind))]


def test_every_schema_key_has_description():
    schema = json_schema()
    for name, part in [("", schema), *schema["$defs"].items()]:
        for key, node in part["properties"].items():
            assert node.get("description"), f"{name}.{key}"


def test_schema_allows_null_nowhere():
    assert "null" not in json.dumps(json_schema())


def test_schema_top_level_keys_equal_loader_keys():
    assert list(json_schema()["properties"]) == list(SpecDocument.keys)


@pytest.mark.few(4)
@pytest.mark.parametrize("name", templates.names())
def test_templates_validate_against_schema(name):
    jsonschema = pytest.importorskip(
        "jsonschema", reason="jsonschema is not installed: the schema is not tried on templates"
    )
    jsonschema.Draft202012Validator.check_schema(json_schema())
    jsonschema.Draft202012Validator(json_schema()).validate(read_yaml(templates.read(name)).data)


def test_wrong_unit_or_type_fails_schema_validation():
    jsonschema = pytest.importorskip(
        "jsonschema", reason="jsonschema is not installed: the schema is not tried on bad specs"
    )
    validator = jsonschema.Draft202012Validator(json_schema())
    data = read_yaml(templates.read("grasper_4layer")).data
    for section_name, key, value in (
        ("readout", "clock", "40 pF"),
        ("coil", "turns", "many"),
        ("coil", "trace_width", "1 N"),
    ):
        assert not validator.is_valid({**data, section_name: {**data[section_name], key: value}})
