"""What rules can find stands in rows: every row is found somewhere, with a value for each of its words."""

from __future__ import annotations

import ast
import importlib
from pathlib import Path
from string import Formatter

import pytest

import sitscad.checks
from sitscad.checks.rules import Case, worded
from sitscad.finding import Severity

ROOM = Path(sitscad.checks.__file__).parent
MODULES = sorted(path for path in ROOM.rglob("*.py") if path.stem not in ("cases", "__init__"))
GIVEN = {"key", "measured", "limit", "unit", "hint", "severity", "source", "place", "sigma", "advice", "is_grave",
         "keeps_limit"}  # fmt: skip


def named(path):
    name = ".".join(["sitscad.checks", *path.relative_to(ROOM).with_suffix("").parts])
    return importlib.import_module(name)


def cases_of(node, module):
    """The rows that an expression may stand for."""
    if isinstance(node, ast.IfExp):
        return cases_of(node.body, module) + cases_of(node.orelse, module)
    found = getattr(module, node.id, None) if isinstance(node, ast.Name) else None
    return [found] if isinstance(found, Case) else []


def uses(path):
    """Every place where a row is found: the rows that it may be, and the call."""
    module = named(path)
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "found":
            yield from ((case, node) for case in cases_of(node.func.value, module))


def words(template):
    return {name for _, name, _, _ in Formatter().parse(template) if name is not None}


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.stem)
def test_every_word_of_a_row_has_a_value_and_every_value_a_word(path):
    by_call: dict[ast.Call, list[Case]] = {}
    for case, call in uses(path):
        by_call.setdefault(call, []).append(case)
    for call, cases in by_call.items():
        keywords = {keyword.arg for keyword in call.keywords}
        has_hint = "hint" in keywords
        asked = [words(case.message + case.detail + ("" if has_hint else case.hint)) for case in cases]
        if None not in keywords:  # some values come as a mapping
            assert set().union(*asked) - {"measured", "limit"} == keywords - GIVEN, ast.unparse(call)
        assert all(case.grave is not None for case in cases) or "is_grave" not in keywords


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.stem)
def test_every_row_is_used(path):
    module, source = named(path), path.read_text(encoding="utf-8")
    tree = ast.parse(source)
    rows = [name for name, value in vars(module).items() if isinstance(value, Case)]
    loads = [node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)]
    assert set(rows) <= set(loads)


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.stem)
def test_where_figures_come_from_is_no_part_of_a_message(path):
    """Every finding about a jaw had the same aside in its one line."""
    cases = {name: value for name, value in vars(named(path)).items() if isinstance(value, Case)}
    assert not [name for name, case in cases.items() if "unverified" in words(case.message)]


def test_quantities_and_shares_are_told_as_people_write_them():
    values = {"gap": 76e-6, "level": 3.14159e-7, "share": 0.0625, "count": 3.0, "net": "C1"}
    assert worded("{net}: {gap:m}, {level:H,3}", values) == "C1: 76 um, 314 nH"
    assert worded("{share:%.1f} % of {count:.0f} {{all}}", values) == "6.2 % of 3 {all}"


def test_a_row_weighs_what_it_says_unless_it_is_grave():
    case = Case("{measured:m} of {limit:m}", "take {wanted:m}", Severity.NOTE, Severity.ERROR)
    found = case.found("coil.turns", 1e-3, 2e-3, "m", wanted=3e-3)
    assert (found.message, found.hint, found.severity) == ("1 mm of 2 mm", "take 3 mm", Severity.NOTE)
    assert case.found("coil.turns", 1e-3, 2e-3, "m", wanted=0.0, is_grave=True).severity is Severity.ERROR
    assert case.found(measured=1e-3, limit=2e-3, hint="no").hint == "no"
