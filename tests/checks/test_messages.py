"""What the messages of rules hold, and what they leave to the detail."""

from __future__ import annotations

import ast
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
