"""Comments in a spec that silence rules: ``turns: 9   # sitscad: ignore SIT103 their quotation of 3 May``.

Such a comment is for the findings whose key starts on its line: of a flow mapping all its keys, of a section's line the
section alone. Several rules are separated by commas; the reason is required. Another comment may stand before.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from sitscad.finding import Finding
from sitscad.record import record
from sitscad.spec.source import SpecSource

RULE = "SIT020"
_WORDS = re.compile(r"#\s*sitscad:\s*ignore\b(.*)", re.IGNORECASE)
_RULES = re.compile(r"\s*([A-Za-z]+[0-9]+(?:\s*,\s*[A-Za-z]+[0-9]+)*)(?:[\s:]+(.*))?")


@record
class Comment:
    """One comment: where it stands, the rules that it names, its reason; ``fault`` says why it counts for nothing."""

    line: int
    column: int
    rules: tuple[str, ...] = ()
    reason: str = ""
    fault: str = ""

    def covers(self, finding: Finding, source: SpecSource) -> bool:
        """Whether a finding is of a rule that it names, at a key that starts on its line."""
        if finding.rule not in self.rules or finding.file is not None:
            return False
        return finding.line == self.line or self.line in _lines_of(finding.key or "", source)


def _lines_of(key: str, source: SpecSource) -> set[int]:
    """The lines on which a key stands, or the brackets begin that it stands in."""
    lines = {source.keys[key][0]} if key in source.keys else set()
    while key:
        if key in source.values and source.line(source.values[key][0])[source.values[key][1] - 1 :][:1] in ("{", "["):
            lines.add(source.values[key][0])
        key = key.rpartition(".")[0]
    return lines


def comments(text: str, known: Iterable[str]) -> tuple[Comment, ...]:
    """The comments of a spec that silence rules; `known` are the identifiers of all rules."""
    if "sitscad:" not in text.lower():
        return ()
    rules = frozenset(known)
    found = []
    for number, line in enumerate(text.splitlines(), 1):
        start = _comment_start(line)
        match = _WORDS.search(line, start) if start is not None else None
        if match is not None:
            found.append(_comment(number, match.start() + 1, match[1], rules))
    return tuple(found)


def _comment(line: int, column: int, words: str, known: frozenset[str]) -> Comment:
    """The comment that words say: rules and reason, or what is wrong with it."""
    match = _RULES.fullmatch(words.rstrip())
    if match is None:
        return Comment(line, column, fault="it names no rule; write # sitscad: ignore SIT103 and the reason")
    rules = tuple(rule.strip().upper() for rule in match[1].split(","))
    reason = " ".join((match[2] or "").split())
    unknown = [rule for rule in rules if rule not in known]
    if unknown:
        return Comment(line, column, fault=f"there is no rule {', '.join(unknown)}")
    if any(rule.startswith("SIT0") for rule in rules):
        return Comment(line, column, fault="what a spec is read by (SIT0xx) cannot be ignored")
    if not reason:
        return Comment(line, column, fault="it gives no reason: who said so, and when?")
    return Comment(line, column, rules, reason)


def _comment_start(line: str) -> int | None:
    """Where the comment of a line begins: a # after a blank, outside of quotes."""
    quote = ""
    for index, character in enumerate(line):
        if quote:
            quote = "" if character == quote and line[index - 1 : index] != "\\" else quote
        elif character in "\"'" and (index == 0 or line[index - 1] in " \t[{,:"):
            quote = character
        elif character == "#" and (index == 0 or line[index - 1] in " \t"):
            return index
    return None
