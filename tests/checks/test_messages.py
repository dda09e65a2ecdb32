"""Templates of messages (`data/messages.csv`): their length, their values, and the calls that use them."""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path
from string import Formatter

import pytest

import sitscad.checks
from sitscad.apps.study import answer_text
from sitscad.basics import finding
from sitscad.basics.messages import templates, text_of
from sitscad.basics.units import quantity_as
from sitscad.checks.judging import RULES
from sitscad.checks.rules import violation_of

MOST_WORDS = 30
PARTS = ("message", "hint", "detail")
FUNCTIONS = (ast.FunctionDef, ast.Lambda)
FIELDS = {"key", "measured", "limit", "unit", "hint", "details", "severity", "source", "place", "sigma", "fixes",
          "keeps_limit"}
"""Keywords of `violation_of` that are no values."""

ALWAYS = {"key", "measured", "limit", "measured_text", "limit_text"}
"""Names that every template has."""


def names(case, parts=PARTS):
    """The named values of a case with their forms."""
    return [(name, form) for part in parts for _, name, form, _ in Formatter().parse(templates()[case][part]) if name]


@cache
def modules():
    return {path: ast.parse(path.read_text(encoding="utf-8"))
            for path in sorted(Path(sitscad.checks.__file__).parent.rglob("*.py"))}


def keywords(call):
    return {each.arg: each.value for each in call.keywords if each.arg}


def called(node):
    return node.func.id if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) else ""


@cache
def helpers():
    """Functions by name that may return cases for details."""
    result = {}
    for tree in modules().values():
        for node in ast.walk(tree):
            kind = ast.unparse(node.returns) if isinstance(node, ast.FunctionDef) and node.returns else ""
            if kind == "str" or kind.startswith(("tuple[str, ", "_")):
                result.setdefault(node.name, []).append(node)
    return result


@cache
def makers():
    """Functions that pass a case to `violation_of`, with the values that they add and their own parameters."""
    result = {"violation_of": (frozenset(), frozenset(FIELDS)), "not_checked": (frozenset(), frozenset())}
    for _ in range(3):  # makers that call makers
        for tree in modules().values():
            for function in ast.walk(tree):
                if isinstance(function, ast.FunctionDef) and "case" in [each.arg for each in function.args.args]:
                    inner = [node for node in ast.walk(function) if called(node) in result]
                    added = {name for node in inner for name in {*keywords(node), *result[called(node)][0]}}
                    own = {each.arg for each in (*function.args.args, *function.args.kwonlyargs)}
                    if inner and function.name not in ("violation_of", "not_checked"):
                        result[function.name] = frozenset(added), frozenset(own)
    return result


@cache
def module_of(function):
    return next(tree for tree in modules().values() if function in ast.walk(tree))


def texts_in(node, function):
    """The text constants of an expression, and those that the function or its module assigns to its names."""
    assigned = {}
    for each in (*ast.walk(function), *module_of(function).body):
        targets = each.targets if isinstance(each, ast.Assign) else [each.target] if isinstance(
            each, (ast.AugAssign, ast.For, ast.AnnAssign, ast.NamedExpr)) else []
        value = each.iter if isinstance(each, ast.For) else getattr(each, "value", None)
        for name in (part.id for target in targets for part in ast.walk(target) if isinstance(part, ast.Name)):
            assigned.setdefault(name, []).append(value)
    result, seen, open_ = set(), set(), [node]
    while open_:
        for part in ast.walk(open_.pop()):
            if isinstance(part, ast.Constant) and isinstance(part.value, str):
                result.add(part.value)
            if isinstance(part, ast.Name) and part.id not in seen:
                seen.add(part.id)
                open_ += filter(None, assigned.get(part.id, []))
                open_ += [each for other in functions_of(function) if other.name == part.id for each in returned(other)]
            open_ += helpers().get(called(part), [])
    return result


def returned(function):
    return [each.value for each in ast.walk(function) if isinstance(each, ast.Return) and each.value is not None]


def functions_of(tree):
    return [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]


@cache
def calls():
    """Every call that makes a finding of a case: module, function, call, its cases, and the values that it gives."""
    result = []
    for path, tree in modules().items():
        module_texts = {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant)
                        and isinstance(node.value, str) and node.value in templates()}
        for function in functions_of(tree):
            for node in ast.walk(function):
                if called(node) not in makers() or not node.args or any(
                        node in ast.walk(inner) for inner in functions_of(function) if inner is not function):
                    continue
                if isinstance(node.args[0], ast.Name) and node.args[0].id == "case" and any(
                        each.arg == "case" for each in function.args.args):
                    continue  # a maker itself
                given = keywords(node)
                cases = texts_in(node.args[0], function) & set(templates())
                is_open = not cases  # the case comes from another function of the module
                cases = cases or module_texts
                more = {text for name in ("hint", "details") if name in given
                        for text in texts_in(given[name], function) & set(templates())}
                result.append((path, function, node, frozenset(cases), frozenset(more), is_open))
    return result


def test_every_call_names_cases_with_messages():
    unknown = [f"{path.name}:{node.lineno}" for path, _, node, cases, _, _ in calls()
               if not any(templates()[case]["message"] for case in cases)]
    assert calls() and not unknown


def test_every_message_case_is_used():
    others = [ast.parse(Path(module.__file__).read_text(encoding="utf-8")) for module in (finding, answer_text)]
    used = {node.value for tree in (*modules().values(), *others) for node in ast.walk(tree)
            if isinstance(node, ast.Constant) and isinstance(node.value, str)}
    assert sorted(set(templates()) - used) == []


def test_every_message_value_is_supplied_by_calls():
    flaws = []
    for path, function, node, cases, more, is_open in calls():
        added, _ = makers()[called(node)]
        given = {*keywords(node), *added} - FIELDS | ALWAYS
        needed = {name for case in cases for name, _ in names(case, ("message", "detail"))}
        needed |= {name for case in more for name, _ in names(case, ("hint", "detail"))}
        if not more:
            needed |= {name for case in cases for name, _ in names(case, ("hint",))}
        if not is_open and needed - given:
            flaws.append(f"{path.name}:{node.lineno} {function.name} lacks {sorted(needed - given)}")
    assert not flaws


def test_every_supplied_value_appears_in_template():
    flaws = []
    for path, function, node, cases, more, is_open in calls():
        _, own = makers()[called(node)]
        supplied = set(keywords(node)) - own - FIELDS
        named = {name for case in cases | more for name, _ in names(case)}
        if not is_open and supplied - named:
            flaws.append(f"{path.name}:{node.lineno} {function.name} gives {sorted(supplied - named)} to no template")
    assert not flaws


@pytest.mark.parametrize("case", templates())
def test_template_has_at_most_30_words_and_valid_forms(case):
    row = templates()[case]
    assert all(rule in {each.id for each in RULES} for rule in row["rule"].split())
    for part in ("message", "hint"):
        words = "".join(text + (" 0 m" if form else " x" if name else "")
                        for text, name, form, _ in Formatter().parse(row[part])).split()
        assert len(words) <= MOST_WORDS, (part, len(words))
    for name, form in names(case):
        joined = form.split()[-1:] in (["and"], ["or"], ["list"], ["x"])
        value = "text" if not form or form in ("and", "or", "list", "x") else 1.0
        assert quantity_as([value] if joined else value, form), name


def test_missing_message_value_gives_key_error():
    with pytest.raises(KeyError):
        text_of("via-drill", "message", {})


@pytest.mark.parametrize(("value", "form"), [(1.0, ""), (1.0, "parsec"), ("C1", "m"), (1.0, "m and"), (None, "m")])
def test_value_with_unknown_form_gives_value_error(value, form):
    with pytest.raises(ValueError, match=r"form|unit|sequence"):
        quantity_as(value, form)


@pytest.mark.parametrize(("value", "form", "text"), [
    (2.34e-7, "m", "234 nm"), (2.34e-7, "um", "0.234 um"), (2.34e-7, "um 2", "0.23 um"), (0.125, "%", "12.5 %"),
    (1, "count coil", "1 coil"), (3, "count coil", "3 coils"), (["a", "b", "c"], "and", "a, b and c"),
    ([1e-3, 2e-3], "m x", "1 mm x 2 mm"), ([], "list", "none"), (["a"], "or", "a"), (2.0, "number", "2"),
])
def test_form_formats_value_as_text(value, form, text):
    assert quantity_as(value, form) == text


def test_hint_is_computed_only_when_requested():
    request = []
    result = violation_of("trace-width", measured=1e-4, limit=2e-4, house="us",
                         hint=lambda: request.append(1) or "finer-rules", finer=lambda: request.append(2) or ["a", "b"])
    assert result.text("message") and not request
    assert result.text("hint") and request == [1, 2]


def test_empty_hint_function_gives_hint_of_case():
    result = violation_of("annular-ring", measured=1e-4, limit=2e-4, house="us", net="C1", pad=4e-4, hint=lambda: "")
    assert "0.4 mm" in result.text("hint") or "400 um" in result.text("hint")


KEY_AND_VALUE = re.compile(r"(?:\w+\.)+\w+: (?!a |an |that |less |plastic )")
"""A key of the spec and the value that a hint writes for it."""

BY_HAND = {
    "jaw-file-assumed-face": "a build finds it on solids, and `check --fix` has none",
    **dict.fromkeys(("change-offset", "change-rate", "change-bits"), "no force is required, or a fix is given"),
    "part-size": "a note: the order asks for a panel of the fabricator's own",
    "loop-width": "the fabricator confirms it first",
    "loop-spacing": "the fabricator confirms it first",
    **dict.fromkeys(("positions-others-coils", "positions-others-written"), "who buys a plug knows which it is"),
    **dict.fromkeys(("panel-size", "panel-size-parts", "panel-usual"), "who orders decides on a panel"),
}
"""Cases whose hints name a value that no program can vouch for, and why."""


def test_hint_with_key_and_value_has_fix():
    without = []
    for path, _, node, cases, more, is_open in calls():
        added, _ = makers()[called(node)]
        if "fixes" in {*keywords(node), *added} or is_open:
            continue
        without += [f"{path.name}:{node.lineno} {case}" for case in cases | more
                    if KEY_AND_VALUE.search(templates()[case]["hint"]) and case not in BY_HAND]
    assert not without
