"""Sensors of soft inductive coils, from one YAML spec to files that can be ordered.

The public names below are loaded on first use, so that ``import sitscad`` costs nothing and ``check`` never pulls in
a CAD kernel. The flow is ``load`` -> ``lay_out`` -> ``estimate`` -> ``check`` -> ``build``; ``verify`` reads a package
back.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from sitscad.basics.version import __version__ as __version__

if TYPE_CHECKING:
    # A line a module, in the order of the table below.
    # isort: off
    from sitscad.apps.coil.comparison import compare as compare
    from sitscad.apps.coil.drawn import DrawnCoil as DrawnCoil, drawn_coil as drawn_coil
    from sitscad.apps.coil.spiral import Spiral as Spiral, coil as coil
    from sitscad.apps.hardware.converter import SimulatedConverter as SimulatedConverter
    from sitscad.calibration import (
        Calibration as Calibration,
        InverseMap as InverseMap,
        calibrate as calibrate,
        map_of as map_of,
    )
    from sitscad.calibration.bench_data import BenchError as BenchError
    from sitscad.checks.judging import CheckResult as CheckResult, RULES as RULES, check as check, mended as mended
    from sitscad.checks.rules import Violation as Violation, Rule as Rule, Undecided as Undecided
    from sitscad.estimates.design import Design as Design
    from sitscad.estimates.requested_response import respond as respond
    from sitscad.estimates import Estimates as Estimates, estimate as estimate
    from sitscad.estimates.performance_values import Performance as Performance
    from sitscad.estimates.loads.pad import NoResponse as NoResponse
    from sitscad.estimates.response.response_arrays import Response as Response
    from sitscad.basics.finding import Finding as Finding, NotChecked as NotChecked, Severity as Severity
    from sitscad.files.formats.volume_mesh import field_mesh as field_mesh, pad_mesh as pad_mesh
    from sitscad.files.export import (
        Area as Area,
        CentreLine as CentreLine,
        CurrentPath as CurrentPath,
        areas as areas,
        as_build123d as as_build123d,
        as_cadquery as as_cadquery,
        as_cadquery_assembly as as_cadquery_assembly,
        centre_lines as centre_lines,
        copper_solids as copper_solids,
        current_paths as current_paths,
    )
    from sitscad.layout import lay_out as lay_out
    from sitscad.layout.board import Layout as Layout
    from sitscad.package.manifest import BuildResult as BuildResult
    from sitscad.package.folder import PackageError as PackageError
    from sitscad.package.building import build as build
    from sitscad.package.verification import verify as verify
    from sitscad.package.contents import write_calibration as write_calibration
    from sitscad.assembly.solids import (
        MissingExtra as MissingExtra,
        PartsError as PartsError,
        Solid as Solid,
        solids as solids,
    )
    from sitscad.assembly.solids.whole import whole as whole
    from sitscad.package.plugins import (
        PluginError as PluginError,
        use_installed_plugins as use_installed_plugins,
        use_plugin as use_plugin,
    )
    from sitscad.spec.reading import SpecError as SpecError
    from sitscad.spec.load import load as load, load_text as load_text
    from sitscad.spec.sensor import SensorSpec as SensorSpec, json_schema as json_schema
    from sitscad.apps.study.study import Study as Study
    from sitscad.apps.study.sweeping import measure as measure, sweep as sweep
    from sitscad.files.writer import Writer as Writer
    # isort: on

_HOMES = {
    "sitscad.apps.coil.comparison": "compare",
    "sitscad.apps.coil.drawn": "DrawnCoil drawn_coil",
    "sitscad.apps.coil.spiral": "Spiral coil",
    "sitscad.apps.hardware.converter": "SimulatedConverter",
    "sitscad.calibration": "Calibration InverseMap calibrate map_of",
    "sitscad.calibration.bench_data": "BenchError",
    "sitscad.checks.judging": "CheckResult RULES check mended",
    "sitscad.checks.rules": "Violation Rule Undecided",
    "sitscad.estimates.design": "Design",
    "sitscad.estimates.requested_response": "respond",
    "sitscad.estimates": "Estimates estimate",
    "sitscad.estimates.performance_values": "Performance",
    "sitscad.estimates.loads.pad": "NoResponse",
    "sitscad.estimates.response.response_arrays": "Response",
    "sitscad.basics.finding": "Finding NotChecked Severity",
    "sitscad.files.formats.volume_mesh": "field_mesh pad_mesh",
    "sitscad.files.export": "Area CentreLine CurrentPath areas as_build123d as_cadquery "
    "as_cadquery_assembly centre_lines copper_solids current_paths",
    "sitscad.layout": "lay_out",
    "sitscad.layout.board": "Layout",
    "sitscad.package.building": "build",
    "sitscad.package.folder": "PackageError",
    "sitscad.package.manifest": "BuildResult",
    "sitscad.package.verification": "verify",
    "sitscad.package.contents": "write_calibration",
    "sitscad.assembly.solids": "MissingExtra PartsError Solid solids",
    "sitscad.assembly.solids.whole": "whole",
    "sitscad.package.plugins": "PluginError use_installed_plugins use_plugin",
    "sitscad.spec.load": "SpecError load load_text",
    "sitscad.spec.sensor": "SensorSpec json_schema",
    "sitscad.apps.study.study": "Study",
    "sitscad.apps.study.sweeping": "measure sweep",
    "sitscad.files.writer": "Writer",
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names.split()}

__all__ = ["__version__", *_HOME_OF]


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'sitscad' has no attribute {name!r}")
    value = getattr(import_module(_HOME_OF[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)


def load_ipython_extension(ipython: Any) -> None:
    """Show values as pictures and tables in a notebook: ``%load_ext sitscad``."""
    from sitscad.apps.notebook import register

    register(ipython.display_formatter.formatters)
