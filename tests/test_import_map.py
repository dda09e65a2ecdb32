"""The house's import map: which room may know which."""

from __future__ import annotations

import ast
from collections.abc import Collection, Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "sitscad"

MAY_IMPORT = {
    "record": set(),
    "arguments": set(),
    "arrays": set(),
    "solutions": set(),
    "version": set(),
    "data": set(),
    "units": set(),
    "quantities": {"units"},
    "finding": set(),
    "check_values": set(),
    "geometry": {"units"},
    "physics": {"units"},
    "readout": {"units"},
    "mechanics": {"units"},
    "spec": {"units", "finding", "geometry", "readout"},
    "layout": {"units", "finding", "geometry", "spec"},
    "scene": {"units", "finding", "check_values", "geometry", "spec", "layout"},
    "parts": {"units", "finding", "geometry", "spec", "layout", "scene"},
    "estimates": {"quantities", "units", "check_values", "spec", "geometry", "layout", "scene", "physics",
        "readout", "mechanics"},
    "fixes": {"units", "finding", "geometry", "spec", "layout"},
    "calibration": {"physics", "estimates", "scene", "mechanics", "readout", "spec", "design"},
    "bench": {"units", "readout", "estimates", "calibration", "scene", "spec", "design"},
    "design": {"check_values", "spec", "layout", "scene", "parts", "estimates", "readout"},
    "checks": {
        "units", "finding", "check_values", "geometry", "spec", "layout", "scene", "parts", "estimates", "readout",
        "mechanics",
        "physics", "design", "fixes", "fabrication",
    },
    "fabrication": {"units", "geometry", "spec", "layout", "scene"},
    "export": {"geometry", "spec", "layout", "scene", "parts"},
    "drawing": {"units", "geometry", "spec", "layout", "scene", "parts"},
    "writer": {"spec"},
    "formats": {"units", "readout", "estimates", "geometry", "spec", "layout", "scene", "parts", "fabrication",
                "drawing", "writer", "calibration"},
    "papers": {
        "quantities", "units", "finding", "check_values", "geometry", "spec", "layout", "scene", "parts",
        "estimates", "readout",
        "fabrication", "drawing", "writer", "calibration",
    },
    "report": {
        "quantities", "units", "finding", "check_values", "geometry", "spec", "layout", "scene", "parts",
        "estimates", "drawing",
        "calibration",
    },
    "extraction": {"units", "finding"},
    "package": {
        "units", "finding", "geometry", "spec", "layout", "scene", "parts", "estimates", "design",
        "drawing", "formats", "papers", "writer", "report", "extraction", "checks", "policy", "calibration",
    },
    "policy": {"finding", "spec", "report"},
    "opening": {"spec", "checks", "policy", "report"},
    "inspection": {
        "opening", "finding", "policy", "spec", "scene", "design", "checks", "fixes", "drawing", "papers", "report",
    },
    "plugins": {"finding", "design", "checks", "writer"},
    "study": {
        "quantities", "units", "finding", "check_values", "geometry", "spec", "layout", "scene", "estimates",
        "design", "checks",
        "fixes", "inspection", "opening", "physics", "mechanics", "readout", "drawing", "report",
        "policy", "parts",
    },
    "watch": {
        "quantities", "units", "finding", "scene", "parts", "design", "spec", "inspection", "opening",
        "policy", "checks", "package",
        "report", "papers", "formats", "drawing", "estimates", "layout", "study",
    },
    "cli": {
        "", "watch", "units", "finding", "opening", "inspection", "policy", "package", "report", "checks", "estimates",
        "design", "scene", "study", "bench",
    },
    "__main__": {"cli"},
    "__init__": {
        "finding", "check_values", "spec", "layout", "export", "parts", "estimates", "design", "checks", "formats",
        "package", "plugins", "writer", "calibration", "study", "bench",
    },
}
"""Rooms of `sitscad`, and the rooms that each may import; "" stands for the public names of `sitscad` itself.

What is `EVERYWHERE` is no room's and may be imported by all."""

EVERYWHERE = {"version", "record", "arguments", "data", "arrays", "solutions"}


def room_of(path: Path, package: Path = PACKAGE) -> str:
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


def imported_rooms(path: Path, package: Path = PACKAGE) -> set[str]:
    rooms = set()
    for module in imported_modules(path, package):
        top, _, rest = module.partition(".")
        room = rest.split(".")[0]
        if top == "sitscad" and room not in EVERYWHERE:
            rooms.add(room if room in MAY_IMPORT else "")
    return rooms - {room_of(path, package)}


MODULES = sorted(PACKAGE.rglob("*.py"))


@pytest.mark.parametrize("path", MODULES, ids=[str(path.relative_to(PACKAGE)) for path in MODULES])
def test_a_room_imports_only_what_it_may(path):
    beyond = imported_rooms(path) - MAY_IMPORT[room_of(path)]
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
    return {name: {other for other in found if other not in (None, name)} for name, found in loaded.items()}


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
        frozenset(other for other in found if module in reached[other])
        for module, found in reached.items()
        if module in found
    }


@pytest.mark.slow
def test_no_modules_import_each_other():
    """Not even for type checkers: what two modules need of each other belongs into a third."""
    assert not rings(imports_of_modules())


def test_rings_of_imports_are_seen(tmp_path):
    (tmp_path / "a.py").write_text("from sitscad.b import value\n")
    (tmp_path / "b.py").write_text("def late():\n    import sitscad.c\n")
    (tmp_path / "c.py").write_text("if TYPE_CHECKING:\n    from sitscad import a\n")
    (tmp_path / "d.py").write_text("from sitscad import a\n")
    (tmp_path / "__init__.py").write_text("")
    assert rings(imports_of_modules(tmp_path)) == {frozenset({"sitscad.a", "sitscad.b", "sitscad.c"})}


def test_no_format_imports_another_format_and_no_paper_another_paper():
    """Each has a module with a `render`; what several of them need stands in modules without one."""
    for room in ("formats", "papers"):
        modules = sorted((PACKAGE / room).rglob("*.py"))
        named = {path: ".".join(["sitscad", *path.relative_to(PACKAGE).with_suffix("").parts]) for path in modules}
        written = {named[path] for path in modules if "\ndef render(" in path.read_text(encoding="utf-8")}
        assert written
        for path in modules:
            used = {module.rpartition(".")[0] for module in imported_modules(path)} | set(imported_modules(path))
            assert not used & written, path.name


def test_the_walk_sees_every_way_to_import(tmp_path):
    room = tmp_path / "physics"
    room.mkdir()
    module = room / "rings.py"
    module.write_text(
        "import sitscad.layout.board\nfrom sitscad.spec import load\nfrom .. import checks\nfrom ..units import show\n"
        "def late():\n    from sitscad import build\n    from sitscad.version import __version__\n"
    )
    assert imported_rooms(module, tmp_path) == {"layout", "spec", "checks", "units", ""}
