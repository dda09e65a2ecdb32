"""A wrong and a right spec for each rule that a spec alone can break, and the texts of the findings on the wrong specs.

`python tests/samples/rule_examples.py` writes these texts into tests/checks/messages.txt. Run it after a change of
messages or hints, and read the difference.
"""

from __future__ import annotations

import io
import sys
from itertools import groupby
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from sitscad.basics.finding import Finding, NotChecked
from sitscad.checks.judging import RULES
from sitscad.checks.rules import apply_rule
from sitscad.data import Row, rows
from sitscad.estimates.design import Design
from sitscad.package.inspection import inspect
from sitscad.spec.load import load_text
from sitscad.spec.reading import SpecError

TESTS = Path(__file__).parents[1]
BROKEN, MESSAGES = TESTS / "report" / "broken", TESTS / "checks" / "messages.txt"

_EXAMPLES = (row for row in rows("rule_examples") if not row["reason"])
CHANGES: dict[str, tuple[Row, ...]] = {
    rule: tuple(changes) for rule, changes in groupby(_EXAMPLES, key=lambda row: row["rule"])
}
"""Rows of the examples that the package shows, by rule."""

HEAD = """\
# Severity, key, message and hint of each finding of a rule on its wrong example (tests/report/broken).
# Write this file again with `python tests/samples/rule_examples.py`. tests/checks/test_rule_examples.py compares it.
"""


def wrong_text(rule: str) -> str:
    """Return the spec that breaks a rule."""
    return (BROKEN / f"{rule}.yaml").read_text(encoding="utf-8")


def right_text(rule: str) -> str:
    """Return the spec that breaks a rule with the values of the right example."""
    text, document = wrong_text(rule), None
    for change in CHANGES[rule]:
        if not change["key"]:
            assert text.count(change["wrong"]) == 1, "the wrong spec has other lines than the example"
            text = text.replace(change["wrong"], change["right"])
            continue
        document = document or value(text)
        *parents, last = change["key"].split(".")
        section = document
        for parent in parents:
            section = section.setdefault(parent, {})
        wrong = section.pop(last, None)
        assert wrong == (value(change["wrong"]) if change["wrong"] else None), "the wrong spec has another value"
        if change["right"]:
            section[last] = value(change["right"])
    if document is None:
        return text
    written = io.StringIO()
    YAML(typ="safe").dump(document, written)
    return written.getvalue()


def value(text: str) -> Any:
    """Return the value of a text in YAML."""
    return YAML(typ="safe").load(text)


def findings(rule: str, text: str, folder: Path) -> tuple[list[Finding], list[NotChecked]]:
    """Return the findings of one rule on a spec, and what the rule cannot check. An unreadable spec has all its errors.

    The spec is read as of a file in `folder`, which must be empty.
    """
    if rule == "SIT020":
        path = folder / "sensor.yaml"
        path.write_text(text, encoding="utf-8")
        return [result for result in inspect(str(path), "none").checked.findings if result.rule == rule], []
    try:
        spec = load_text(text, str(folder / "sensor.yaml"))
    except SpecError as error:
        return list(error.findings), []
    return apply_rule(next(each for each in RULES if each.id == rule), Design(spec))


def messages(rule: str, found: list[Finding]) -> str:
    """Return severity, key, message and hint of the findings of a rule as a block of text."""
    lines = [rule]
    for each in found:
        if each.rule == rule:
            lines += [f"  {each.severity.value} {each.key or ''}".rstrip(), f"    {each.message}"]
            lines += [f"    hint: {each.hint}"] if each.hint else []
    return "\n".join(lines) + "\n"


def stored_messages() -> dict[str, str]:
    """Return the blocks of the stored file by rule."""
    blocks = MESSAGES.read_text(encoding="utf-8").removeprefix(HEAD).split("\n\n")
    return {block.split()[0]: block.strip("\n") + "\n" for block in blocks}


def write_messages(folder: Path) -> None:
    """Write the texts of all findings on wrong specs into the stored file."""
    blocks = [messages(rule, findings(rule, wrong_text(rule), folder)[0]) for rule in CHANGES]
    MESSAGES.write_text(f"{HEAD}\n" + "\n".join(blocks), encoding="utf-8")


if __name__ == "__main__":
    import tempfile

    with tempfile.TemporaryDirectory() as place:
        write_messages(Path(place))
    sys.exit(0)
