"""The import map on two levels: which wing may know which, and no two neighbours in a folder know each other."""

from __future__ import annotations

import ast
import re
import shutil
import subprocess
import sys
from collections.abc import Collection, Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "sitscad"

WINGS = (
    "data", "basics", "kernels", "spec", "layout", "assembly", "estimates", "calibration", "checks", "files", "package",
    "apps", "cli", "__main__",
)
"""The wings of `sitscad` from the ground up: each may import those before it, and none of those after it."""

NEEDLESS = {
    "kernels": {"spec"}, "calibration": {"layout"}, "checks": {"calibration"},
}
"""Wings that lie below another one, and that it does without all the same."""

PUBLIC = {"cli", "apps", "__main__"}
"""Wings that may use the public names of `sitscad`."""


def wing_of(path: Path, package: Path = PACKAGE) -> str:
    return path.relative_to(package).parts[0].removesuffix(".py")


def imported_modules(path: Path, package: Path = PACKAGE) -> Iterator[str]:
    """Every module that a file imports, wherever in the file that stands; names out of a module count as modules."""
    here = ["sitscad", *path.relative_to(package).parts[:-1]]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"), str(path))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = here[: len(here) + 1 - node.level] if node.level else []
            module = ".".join([*base, *(node.module or "").split(".")]).strip(".")
            yield from (f"{module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "late":
            yield ast.literal_eval(node.args[0])


def imported_wings(path: Path, package: Path = PACKAGE) -> set[str]:
    """The wings that a file imports from, without its own; "" stands for the public names of `sitscad` itself."""
    wings = set()
    for module in imported_modules(path, package):
        top, _, rest = module.partition(".")
        if top == "sitscad":
            wing = rest.split(".")[0]
            wings.add(wing if wing in WINGS else "")
    return wings - {wing_of(path, package)}


MODULES = sorted(path for path in PACKAGE.rglob("*.py") if "firmware" not in path.parts)


def test_package_top_level_consists_of_wings():
    entries = {path.relative_to(PACKAGE).parts[0].removesuffix(".py") for path in PACKAGE.rglob("*.py")}
    assert entries == {*WINGS, "__init__"}
    assert len(entries) <= 15


@pytest.mark.parametrize("path", MODULES, ids=[str(path.relative_to(PACKAGE)) for path in MODULES])
def test_wing_imports_only_lower_wings(path):
    wing = wing_of(path)
    if wing == "__init__":
        return  # the public names come from every wing
    below = {*WINGS[: WINGS.index(wing)], *([""] if wing in PUBLIC else [])} - NEEDLESS.get(wing, set())
    beyond = imported_wings(path) - below
    assert not beyond, f"{path.relative_to(PACKAGE)} imports {', '.join(sorted(beyond))}"


def known_as(module: str, known: Collection[str]) -> str | None:
    """The module that an import loads: itself, or the one that holds the name; None where it is none of ours."""
    return next((name for name in (module, module.rpartition(".")[0]) if name in known), None)


def imports_of_modules(package: Path = PACKAGE) -> dict[str, set[str]]:
    """Every module of the package, and those of them that it imports, type-checking imports among them."""
    paths = {
        ".".join(["sitscad", *path.relative_to(package).with_suffix("").parts]).removesuffix(".__init__"): path
        for path in package.rglob("*.py")
    }
    loaded = {
        name: {known_as(module, paths) for module in imported_modules(path, package)} for name, path in paths.items()
    }
    return {name: {other for other in result if other not in (None, name)} for name, result in loaded.items()}


def neighbours_that_import_each_other(imports: dict[str, set[str]]) -> set[tuple[str, str]]:
    """Pairs of folders or modules of one folder, at any level, that import from each other."""
    arrows = set()
    for module, others in imports.items():
        mine = module.split(".")
        for other in others:
            theirs = other.split(".")
            shared = next((k for k, (a, b) in enumerate(zip(mine, theirs, strict=False)) if a != b), None)
            if shared is not None:
                arrows.add((".".join(mine[: shared + 1]), ".".join(theirs[: shared + 1])))
    return {tuple(sorted(arrow)) for arrow in arrows if arrow[::-1] in arrows}


def test_sibling_packages_do_not_import_each_other():
    assert not neighbours_that_import_each_other(imports_of_modules())


def test_mutually_importing_sibling_packages_are_detected(tmp_path):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "__init__.py").write_text("")
    (tmp_path / "a" / "low.py").write_text("value = 1\n")
    (tmp_path / "a" / "high.py").write_text("from sitscad.b.middle import value\n")
    (tmp_path / "b" / "middle.py").write_text("from sitscad.a.low import value\n")
    (tmp_path / "__init__.py").write_text("")
    assert neighbours_that_import_each_other(imports_of_modules(tmp_path)) == {("sitscad.a", "sitscad.b")}


def reached_from(module: str, imports: dict[str, set[str]]) -> set[str]:
    """All modules that a module imports, itself or through others."""
    reached: set[str] = set()
    waiting = [module]
    while waiting:
        for other in imports[waiting.pop()] - reached:
            reached.add(other)
            waiting.append(other)
    return reached


def rings(imports: dict[str, set[str]]) -> set[frozenset[str]]:
    """The sets of modules each of which imports every other, itself or through others."""
    reached = {module: reached_from(module, imports) for module in imports}
    return {
        frozenset(other for other in result if module in reached[other])
        for module, result in reached.items()
        if module in result
    }


@pytest.mark.slow
def test_modules_have_no_circular_imports():
    """Not even for type checkers: what two modules need of each other belongs into a third."""
    assert not rings(imports_of_modules())


def test_circular_imports_are_detected(tmp_path):
    (tmp_path / "a.py").write_text("from sitscad.b import value\n")
    (tmp_path / "b.py").write_text("def late():\n    import sitscad.c\n")
    (tmp_path / "c.py").write_text("if TYPE_CHECKING:\n    from sitscad import a\n")
    (tmp_path / "d.py").write_text("from sitscad import a\n")
    (tmp_path / "__init__.py").write_text("")
    assert rings(imports_of_modules(tmp_path)) == {frozenset({"sitscad.a", "sitscad.b", "sitscad.c"})}


def test_formats_and_documents_do_not_import_each_other():
    """Each has a module with a `render`; what several of them need stands in modules without one."""
    for room in ("formats", "documents"):
        modules = sorted((PACKAGE / "files" / room).rglob("*.py"))
        named = {path: ".".join(["sitscad", *path.relative_to(PACKAGE).with_suffix("").parts]) for path in modules}
        written = {named[path] for path in modules if "\ndef render(" in path.read_text(encoding="utf-8")}
        assert written
        for path in modules:
            used = {module.rpartition(".")[0] for module in imported_modules(path)} | set(imported_modules(path))
            assert not used & written, path.name


LATE = {
    "__init__.py": {"sitscad.apps.notebook"},
    "checks/assembly/transduction.py": {"sitscad.kernels.mechanics.plate_bending"},
    "checks/findings/__init__.py": {"sitscad.checks.findings.ci"},
    "checks/opening.py": {"sitscad.checks.judging", "sitscad.checks.pool"},
    "checks/reading/metal.py": {"sitscad.estimates.states.other_jaw"},
    "checks/reading/reference.py": {"sitscad.estimates.states.other_jaw", "sitscad.estimates.states.reference"},
    "estimates/design.py": {
        "sitscad.assembly.solids.whole", "sitscad.estimates.performance.warming", "sitscad.estimates.response.model",
        "sitscad.estimates.sensing",
    },
    "estimates/states/steps.py": {"sitscad.estimates.states.cells", "sitscad.estimates.states.solved_target"},
    "estimates/windings/methods.py": {"sitscad.kernels.electromagnetics.inductance.tracks"},
    "estimates/windings/neighbours.py": {"sitscad.kernels.electromagnetics.inductance.side_by_side"},
    "layout/laser_sheet.py": {"sitscad.kernels.geometry.areas"},
    "package/building.py": {"sitscad.package.cached_solutions", "sitscad.package.stages"},
    "package/inspection.py": {"sitscad.package.check_pictures"},
    "package/plugins/__init__.py": {"sitscad.package.plugins.force"},
    "package/verification.py": {"sitscad.package.production_files"},
    "spec/resolver/coils.py": {"sitscad.spec.drawn.spiral"},
}
"""Modules of ours that are imported at the first call of one of their functions (`basics/late.py`), by file.

Solvers of responses, targets and cells take 10 ms of a check (3 %). Areas and pictures load shapely, solids a CAD
kernel. To load a spec, and to build an unchanged package, takes no NumPy.
"""

FOREIGN = {
    "OCP", "distributed", "ezdxf", "matplotlib", "pymoo", "scipy", "serial", "skrf", "smbus2", "threadpoolctl",
    "fcntl", "resource", "hashlib", "importlib.metadata", "tomllib",
}
NUMPY = {"kernels/converters/conversion.py"}
"""Modules of others that a function may import: packages of the extras, modules of POSIX, and modules of the standard
library that take 2 ms (`tomllib`), 3 ms (`hashlib`) and 14 ms (`importlib.metadata`). Files of `NUMPY` may import
NumPy, too, because a spec is read without it.
"""


def imports_in_functions(path: Path) -> Iterator[tuple[str, str]]:
    """The name of each function that has an import in it, and the imported module."""
    for function in ast.walk(ast.parse(path.read_text(encoding="utf-8"), str(path))):
        if isinstance(function, (ast.FunctionDef, ast.AsyncFunctionDef)):
            for node in ast.walk(function):
                if isinstance(node, ast.Import):
                    yield from ((function.name, alias.name) for alias in node.names)
                elif isinstance(node, ast.ImportFrom):
                    yield function.name, "." * node.level + (node.module or "")


def test_imports_in_functions_are_only_the_listed_ones():
    """In a function only if they keep a heavy package, or a measured part of a check's time, out of `check`."""
    late = {}
    for path in MODULES:
        name, imports = str(path.relative_to(PACKAGE)), {module for _, module in imports_in_functions(path)}
        ours = {module for module in imports if module.startswith(("sitscad", "."))}
        allowed = FOREIGN | ({"numpy"} if name in NUMPY else set())
        others = {module for module in imports - ours if not {module, module.partition(".")[0]} & allowed}
        assert not others, f"{name} imports {', '.join(sorted(others))} in a function"
        ours |= set(re.findall(r'\blate\("([\w.]+)", ', path.read_text(encoding="utf-8")))
        if ours:
            late[name] = ours
    assert late == LATE


def test_imports_in_functions_are_detected(tmp_path):
    module = tmp_path / "late.py"
    module.write_text(
        "import os\nclass A:\n    def one(self):\n        from sitscad.layout import board\n"
        "async def two():\n    if os:\n        import json, csv\ndef three():\n    from . import rings\n"
    )
    assert set(imports_in_functions(module)) == {
        ("one", "sitscad.layout"), ("two", "json"), ("two", "csv"), ("three", "."),
    }


def test_import_search_detects_every_import_form(tmp_path):
    wing = tmp_path / "kernels"
    wing.mkdir()
    module = wing / "rings.py"
    module.write_text(
        "import sitscad.layout.board\nfrom sitscad.spec import load\nfrom .. import checks\n"
        "from ..basics.units import show\n"
        "def late():\n    from sitscad import build\n    from sitscad.data import rows\n"
        "sarif = late('sitscad.checks.findings.ci', 'sarif')\n"
    )
    assert imported_wings(module, tmp_path) == {"layout", "spec", "checks", "basics", "data", ""}
    assert "sitscad.checks.findings.ci" in imported_modules(module, tmp_path)


@pytest.mark.slow
def test_check_estimate_and_build_work_without_apps_package(tmp_path):
    """The core runs where study, hardware and watch are gone from the disk."""
    shutil.copytree(PACKAGE, tmp_path / "sitscad", ignore=shutil.ignore_patterns("__pycache__", "apps"))
    template = PACKAGE.parent / "templates" / "single_coil.yaml"
    code = (
        "import sys, sitscad\n"
        "spec = sitscad.load(sys.argv[1])\n"
        "assert sitscad.check(spec).ok and sitscad.estimate(sitscad.lay_out(spec)).coils\n"
        "assert sitscad.build(spec, 'out', only=('gerber', 'laser', 'report')).written\n"
        "assert not [name for name in sys.modules if name.startswith('sitscad.apps')]\n"
        "print(sitscad.__file__)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(template)], cwd=tmp_path, capture_output=True, text=True, check=False,
    )
    assert done.returncode == 0, done.stderr
    assert Path(done.stdout.strip()).is_relative_to(tmp_path)

