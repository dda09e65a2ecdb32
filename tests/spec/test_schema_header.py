"""The line in every template from which editors find the schema: it leads to a file, and the template keeps to it."""

from __future__ import annotations

import json
import re

import jsonschema
import pytest
from ruamel.yaml import YAML

from sitscad.package.example_specs import write_schema, write_template

MODELINE = re.compile(r"# yaml-language-server:\s*\$schema=(\S+)")
"""How the YAML language server of editors reads it."""


@pytest.mark.slow
def test_written_template_names_schema_and_validates_against_it(template, tmp_path):
    written = write_template(template.stem, tmp_path / "sensor.yaml")
    write_schema(tmp_path)
    header = written.read_text(encoding="utf-8").splitlines()[1]
    match = MODELINE.fullmatch(header)
    assert match, header
    schema = json.loads((tmp_path / match[1]).read_text(encoding="utf-8"))
    document = YAML(typ="safe").load(written.read_text(encoding="utf-8"))
    jsonschema.validate(document, schema)
    document["coil"]["trns"] = 3
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(document, schema)


def test_existing_schema_file_is_not_overwritten(tmp_path):
    assert write_schema(tmp_path) == tmp_path / "sitscad.schema.json"
    (tmp_path / "sitscad.schema.json").write_text("mine")
    assert write_schema(tmp_path) is None
    assert (tmp_path / "sitscad.schema.json").read_text() == "mine"
