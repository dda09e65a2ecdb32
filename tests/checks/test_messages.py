"""What the messages of rules hold, and what they leave to the detail."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import sitscad.checks


def texts(field, place):
    """The source of one argument of every `Violation` in the room."""
    for path in Path(sitscad.checks.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Violation":
                yield from (ast.unparse(each) for each in node.args[place : place + 1])
                yield from (ast.unparse(each.value) for each in node.keywords if each.arg == field)


def test_where_figures_come_from_is_no_part_of_a_message():
    """Every finding about a jaw had the same aside in its one line."""
    assert any("unverified(" in text for text in texts("detail", 13))
    assert not [text for text in texts("message", 0) if "unverified(" in text]


KEY_AND_VALUE = re.compile(r"(?:^|[;,] (?:or )?|or |\()(?:\w+\.)+\w+: (?!a |an |that |less |plastic )")
"""A key of the spec and the value that a hint writes for it."""

BY_HAND = {
    "_moved": "a bend that moves shows what such a tail needs, and clears nothing",
    "counted_metal": "metal behind a mount of one's own is measured by whoever made it",
    "laser_sheet": "the size of a sheet is a fact of a workshop",
    "connector_positions": "which plug is bought is known to whoever buys it",
    "other_jaw_metal": "a pad on the other jaw is a part of another instrument, and tares with it are a habit",
    "_jaw_differs": "a build finds it on solids, and `check --fix` has none",
}
"""Functions whose hints name a value that no program can vouch for, and why."""


def hinted_without_fixes():
    """Functions with a finding whose hint names key and value, and which give no fix with it."""
    for path in sorted(Path(sitscad.checks.__file__).parent.rglob("*.py")):
        functions = [node for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
                     if isinstance(node, ast.FunctionDef)]
        for function in functions:
            assigned = {name.id: node.value for node in ast.walk(function) if isinstance(node, ast.Assign)
                        for target in node.targets for name in ast.walk(target) if isinstance(name, ast.Name)}
            for node in ast.walk(function):
                if not (isinstance(node, ast.Call) and getattr(node.func, "id", "") in MAKES_FINDINGS):
                    continue
                known = [assigned.get(part.id, part) for part in ast.walk(node) if isinstance(part, ast.Name)]
                called = {part.func.id for each in (node, *known) for part in ast.walk(each)
                          if isinstance(part, ast.Call) and isinstance(part.func, ast.Name)}
                own = [one for one in functions if one.name in called - MAKES_FINDINGS]
                words = [part.value for each in (node, *known, *own) for part in ast.walk(each)
                         if isinstance(part, ast.Constant) and isinstance(part.value, str)]
                has_fix = any(each.arg == "fixes" for each in node.keywords)
                if not has_fix and function.name not in BY_HAND and any(map(KEY_AND_VALUE.match, words)):
                    yield f"{path.name}: {function.name}"


MAKES_FINDINGS = {"Violation", "_too_little", "_complaint"}


def test_hint_that_names_a_key_and_its_value_comes_with_a_fix():
    """A hint said "fpc.stackup: flex-2l-osh-park is offered", and --fix that no fix is known."""
    assert list(hinted_without_fixes()) == []
