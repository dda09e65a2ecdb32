"""Sensors of soft inductive coils, from one YAML spec to files that can be ordered.

The public names below are loaded on first use, so that ``import sitscad`` costs nothing and ``check`` never pulls in
a CAD kernel. The flow is ``load`` -> ``lay_out`` -> ``estimate`` -> ``check`` -> ``build``; ``verify`` reads a package
back.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from sitscad.version import __version__

_HOMES = {
    "load": "sitscad.spec.load",
    "load_text": "sitscad.spec.load",
    "SpecError": "sitscad.spec.load",
    "json_schema": "sitscad.spec.sensor",
    "SensorSpec": "sitscad.spec.sensor",
    "lay_out": "sitscad.layout",
    "Layout": "sitscad.layout.board",
    "estimate": "sitscad.estimates",
    "Estimates": "sitscad.estimates",
    "METHODS": "sitscad.estimates",
    "Design": "sitscad.design",
    "respond": "sitscad.design",
    "respond_to": "sitscad.design",
    "read_motions": "sitscad.scene.motions",
    "LOAD_METHODS": "sitscad.scene.motions",
    "frequency_of": "sitscad.scene.motions",
    "MotionError": "sitscad.scene.motions",
    "Motions": "sitscad.scene.motions",
    "Response": "sitscad.estimates.response.values",
    "NoResponse": "sitscad.estimates.response.pad",
    "Calibration": "sitscad.calibration",
    "InverseMap": "sitscad.calibration",
    "calibrate": "sitscad.calibration",
    "map_of": "sitscad.calibration",
    "BenchError": "sitscad.calibration.bench_data",
    "calibration_files": "sitscad.package.calibration_files",
    "write_calibration": "sitscad.package.calibration_files",
    "calibration_text": "sitscad.report.calibration",
    "Review": "sitscad.review",
    "check": "sitscad.checks",
    "CheckResult": "sitscad.checks",
    "mended": "sitscad.checks",
    "HINTS": "sitscad.checks",
    "RULES": "sitscad.checks",
    "Rule": "sitscad.checks.rules",
    "Complaint": "sitscad.checks.rules",
    "Undecided": "sitscad.checks.rules",
    "Writer": "sitscad.writer",
    "Plugin": "sitscad.plugins",
    "PluginError": "sitscad.plugins",
    "use_plugin": "sitscad.plugins",
    "use_installed_plugins": "sitscad.plugins",
    "all_rules": "sitscad.checks",
    "Finding": "sitscad.finding",
    "AxisPerformance": "sitscad.estimates.performance.values",
    "Performance": "sitscad.estimates.performance.values",
    "Reached": "sitscad.measured",
    "NotChecked": "sitscad.finding",
    "Severity": "sitscad.finding",
    "field_mesh": "sitscad.formats.tetrahedra.field",
    "pad_mesh": "sitscad.formats.tetrahedra.pad",
    "MissingExtra": "sitscad.parts",
    "PartsError": "sitscad.parts",
    "Solid": "sitscad.parts",
    "solids": "sitscad.parts",
    "whole": "sitscad.parts.whole",
    "Area": "sitscad.interchange",
    "CentreLine": "sitscad.interchange",
    "CurrentPath": "sitscad.interchange",
    "areas": "sitscad.interchange",
    "as_build123d": "sitscad.interchange",
    "as_cadquery": "sitscad.interchange",
    "as_cadquery_assembly": "sitscad.interchange",
    "centre_lines": "sitscad.interchange",
    "copper_solids": "sitscad.interchange",
    "current_paths": "sitscad.interchange",
    "build": "sitscad.package",
    "verify": "sitscad.package",
    "BuildResult": "sitscad.package",
    "PackageError": "sitscad.package",
    "STAGES": "sitscad.package",
    "list_templates": "sitscad.package",
    "require_distinct_names": "sitscad.package",
    "stale": "sitscad.package",
    "write_template": "sitscad.package",
    "write_schema": "sitscad.package",
    "write_file": "sitscad.package",
    "CheckedSpec": "sitscad.report.findings",
    "checked_spec": "sitscad.report.findings",
    "FINDING_FORMATS": "sitscad.report.findings",
    "Manner": "sitscad.report.findings",
    "job_summary": "sitscad.report.findings.github",
    "Inspection": "sitscad.inspection",
    "inspect": "sitscad.inspection",
    "MendedSpec": "sitscad.inspection",
    "mend": "sitscad.inspection",
    "unreadable": "sitscad.inspection",
    "SCHEMAS": "sitscad.schemas",
    "RULE_FORMATS": "sitscad.report.rules",
    "Baseline": "sitscad.policy",
    "Policy": "sitscad.policy",
    "PolicyError": "sitscad.policy",
    "nearest_policy": "sitscad.policy",
    "read_baseline": "sitscad.policy",
    "stands_for": "sitscad.policy",
    "as_configured": "sitscad.inspection",
    "Held": "sitscad.inspection",
    "opened": "sitscad.opening",
    "policy_for": "sitscad.opening",
    "specs_in": "sitscad.opening",
    "each_of": "sitscad.processes",
    "ESTIMATE_FORMATS": "sitscad.report.numbers",
    "RESPONSE_FILES": "sitscad.report.response",
    "RESPONSE_FORMATS": "sitscad.report.response",
    "response_file": "sitscad.report.response",
}

__all__ = [
    "ESTIMATE_FORMATS",
    "FINDING_FORMATS",
    "HINTS",
    "LOAD_METHODS",
    "METHODS",
    "RESPONSE_FILES",
    "RESPONSE_FORMATS",
    "RULES",
    "RULE_FORMATS",
    "SCHEMAS",
    "STAGES",
    "Area",
    "AxisPerformance",
    "Baseline",
    "BenchError",
    "BuildResult",
    "Calibration",
    "CentreLine",
    "CheckResult",
    "CheckedSpec",
    "Complaint",
    "CurrentPath",
    "Design",
    "Estimates",
    "Finding",
    "Held",
    "Inspection",
    "InverseMap",
    "Layout",
    "Manner",
    "MendedSpec",
    "MissingExtra",
    "MotionError",
    "Motions",
    "NoResponse",
    "NotChecked",
    "PackageError",
    "PartsError",
    "Performance",
    "Plugin",
    "PluginError",
    "Policy",
    "PolicyError",
    "Reached",
    "Response",
    "Review",
    "Rule",
    "SensorSpec",
    "Severity",
    "Solid",
    "SpecError",
    "Undecided",
    "Writer",
    "__version__",
    "all_rules",
    "areas",
    "as_build123d",
    "as_cadquery",
    "as_cadquery_assembly",
    "as_configured",
    "build",
    "calibrate",
    "calibration_files",
    "calibration_text",
    "centre_lines",
    "check",
    "checked_spec",
    "copper_solids",
    "current_paths",
    "each_of",
    "estimate",
    "field_mesh",
    "frequency_of",
    "inspect",
    "job_summary",
    "json_schema",
    "lay_out",
    "list_templates",
    "load",
    "load_text",
    "map_of",
    "mend",
    "mended",
    "nearest_policy",
    "opened",
    "pad_mesh",
    "policy_for",
    "read_baseline",
    "read_motions",
    "require_distinct_names",
    "respond",
    "respond_to",
    "response_file",
    "solids",
    "specs_in",
    "stale",
    "stands_for",
    "unreadable",
    "use_installed_plugins",
    "use_plugin",
    "verify",
    "whole",
    "write_calibration",
    "write_file",
    "write_schema",
    "write_template",
]

if TYPE_CHECKING:
    from sitscad.calibration import Calibration, InverseMap, calibrate, map_of
    from sitscad.calibration.bench_data import BenchError
    from sitscad.checks import HINTS, RULES, CheckResult, all_rules, check, mended
    from sitscad.checks.rules import Complaint, Rule, Undecided
    from sitscad.design import Design, respond, respond_to
    from sitscad.estimates import METHODS, Estimates, estimate
    from sitscad.estimates.performance.values import AxisPerformance, Performance
    from sitscad.estimates.response.pad import NoResponse
    from sitscad.estimates.response.values import Response
    from sitscad.finding import Finding, NotChecked, Severity
    from sitscad.formats.tetrahedra.field import field_mesh
    from sitscad.formats.tetrahedra.pad import pad_mesh
    from sitscad.inspection import (
        Held,
        Inspection,
        MendedSpec,
        as_configured,
        inspect,
        mend,
        unreadable,
    )
    from sitscad.interchange import (
        Area,
        CentreLine,
        CurrentPath,
        areas,
        as_build123d,
        as_cadquery,
        as_cadquery_assembly,
        centre_lines,
        copper_solids,
        current_paths,
    )
    from sitscad.layout import lay_out
    from sitscad.layout.board import Layout
    from sitscad.measured import Reached
    from sitscad.opening import opened, policy_for, specs_in
    from sitscad.package import (
        STAGES,
        BuildResult,
        PackageError,
        build,
        list_templates,
        require_distinct_names,
        stale,
        verify,
        write_file,
        write_schema,
        write_template,
    )
    from sitscad.package.calibration_files import calibration_files, write_calibration
    from sitscad.parts import MissingExtra, PartsError, Solid, solids
    from sitscad.parts.whole import whole
    from sitscad.plugins import Plugin, PluginError, use_installed_plugins, use_plugin
    from sitscad.policy import Baseline, Policy, PolicyError, nearest_policy, read_baseline, stands_for
    from sitscad.processes import each_of
    from sitscad.report.calibration import calibration_text
    from sitscad.report.findings import FINDING_FORMATS, CheckedSpec, Manner, checked_spec
    from sitscad.report.findings.github import job_summary
    from sitscad.report.numbers import ESTIMATE_FORMATS
    from sitscad.report.response import RESPONSE_FILES, RESPONSE_FORMATS, response_file
    from sitscad.report.rules import RULE_FORMATS
    from sitscad.review import Review
    from sitscad.scene.motions import LOAD_METHODS, MotionError, Motions, frequency_of, read_motions
    from sitscad.schemas import SCHEMAS
    from sitscad.spec.load import load, load_text
    from sitscad.spec.rules import SpecError
    from sitscad.spec.sensor import SensorSpec, json_schema
    from sitscad.writer import Writer


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'sitscad' has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})
