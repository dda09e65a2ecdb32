"""The JSON Schemas that are published: of what people write, and of what programs read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from sitscad.data import json_file
from sitscad.spec.sensor import json_schema


def check_schema() -> dict[str, Any]:
    """The schema (draft 2020-12) of the document of ``check --format json`` and of a package's ``findings.json``."""
    return json_file("check.schema")


def calibration_schema() -> dict[str, Any]:
    """The schema (draft 2020-12) of the document ``calibration.json`` that ``calibrate`` writes."""
    return json_file("calibration.schema")


SCHEMAS: Mapping[str, Callable[[], dict[str, Any]]] = {
    "spec": json_schema, "check": check_schema, "calibration": calibration_schema,
}  # fmt: skip
"""What `schema --of` takes."""
