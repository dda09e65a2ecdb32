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


def test_the_dialect_and_the_required_keys():
    schema = json_schema()
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert schema["fileMatch"] == ["*.sensor.yaml"]
    assert schema["required"] == ["sitscad", "name", "coil"]
    assert section("coil")["required"] == []
    ways = [set(way["required"]) for way in section("coil")["oneOf"]]
    four, always = {"turns", "inner_diameter", "trace_width", "trace_spacing"}, {"shape", "outer_diameter"}
    assert sorted(map(sorted, ways)) == sorted([["drawn"], *(sorted(always | four - {one}) for one in four)])
    assert schema["additionalProperties"] is False


def test_every_schema_has_a_name_of_its_own(capsys):
    names = []
    for document in ("spec", "check", "calibration", "study"):
        assert run(["schema", "--of", document]) == 0
        names.append(json.loads(capsys.readouterr().out)["$id"])
    assert names == [f"urn:sitscad:{name}:1" for name in ("spec", "check", "calibration", "study")]


def test_it_is_json_and_the_same_every_time():
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
def test_presets_are_enumerated(key, kind):
    names = [option["enum"] for option in options(section(key)) if "enum" in option]
    assert names == [list(presets.names(kind))]


def test_every_key_is_described():
    schema = json_schema()
    for name, part in [("", schema), *schema["$defs"].items()]:
        for key, node in part["properties"].items():
            assert node.get("description"), f"{name}.{key}"


def test_null_is_no_value_anywhere():
    assert "null" not in json.dumps(json_schema())


def test_it_has_the_keys_that_the_loader_reads():
    assert list(json_schema()["properties"]) == list(SpecDocument.keys)


@pytest.mark.few(4)
@pytest.mark.parametrize("name", templates.names())
def test_templates_are_valid(name):
    jsonschema = pytest.importorskip(
        "jsonschema", reason="jsonschema is not installed: the schema is not tried on templates"
    )
    jsonschema.Draft202012Validator.check_schema(json_schema())
    jsonschema.Draft202012Validator(json_schema()).validate(read_yaml(templates.read(name)).data)


def test_a_wrong_unit_is_invalid():
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
