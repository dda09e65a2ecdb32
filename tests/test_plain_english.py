"""Plain sentences in docstrings, in texts of rules and in pages: each unit of prose is judged by patterns of grammar.

tests/plain_english.csv lists the files with sentences that still offend. Their numbers may only fall.
`python tests/test_plain_english.py` prints all offences. With `--write` it lowers the numbers.
"""

from __future__ import annotations

import ast
import csv
import re
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
EXCEPTIONS = ROOT / "tests" / "plain_english.csv"

MOST_WORDS = 28
FIRST_WORDS = {"what", "how", "where", "which", "of", "as", "by", "when", "that", "those", "whose", "who"}
"""Words with which no summary of a docstring begins."""

PATTERNS = {
    "pronoun without its noun": re.compile(
        r"\b(?:the|this|another|each|every|such|other|same) ones?\b"
        r"(?! (?:of|coil|turn|layer|side|end|pole|hand|part|piece|solid|sigma|mapping))"
        r"|\b(?:that|which|only) ones?(?=[.,;:]|$| (?:that|which|with|is|are|in|on|for|by|to|at|from|and|or|has|if)\b)"
        r"|\bones (?:that|which|of|with)\b|\bone (?:that|which|with|whose)\b"),
    "relative clause without a noun": re.compile(
        r"\b(?:that of|those (?:of|that)|that which|of which|of whose|what (?:is|it|they|a|the))\b"),
    "vague reference": re.compile(
        r"\b(?:so many|as many as|so far as|so much of|alike|in question|the like)\b"
        r"|(?<!\ball )(?<!\bone )(?<!\bnone )(?<!\beach )(?<!\bhalf )(?<!\bpart )(?<!\bmost )(?<!\bsome )"
        r"(?<!\bany )(?<!\btwo )\bof (?:it|them)\b"),
    "code does not speak or feel": re.compile(
        r"\b(?:is|are|was|were|be) (?:told|said|asked|felt|known of|looked at|handed over|spoken)\b"
        r"|\b(?:tells|says|asks|feels|hears|speaks|gives? way)\b"),
    "absence: write 'None if' or 'Empty if'": re.compile(r"\b(?:[Nn]othing|[Nn]one) (?:where|without|there|of)\b"),
}

ITEM = re.compile(r"\s*(?:[*+-]|\d+\.) +")
UNDERLINE = re.compile(r"\s*(?:-{3,}|={3,})[\s=-]*$")
LISTED = {"Parameters", "Returns", "Yields", "Raises", "Attributes", "Other Parameters", "Warns"}
"""Numpydoc sections of names with indented descriptions."""


def units(text: str) -> Iterator[str]:
    """Yield the units of prose of a docstring or page: paragraphs, items of lists, descriptions of parameters.

    Code, tables, headings, comments and references are left out.
    """
    unit: list[str] = []
    is_code = is_literal = is_listed = is_skipped = is_printed = False
    lines = text.splitlines()
    for number, line in enumerate(lines):
        bare, indent = line.strip(), len(line) - len(line.lstrip())
        if bare.startswith(("```", "~~~")):
            is_code = not is_code
            bare = ""
        is_printed = bool(bare) and (is_printed or "\b" in line)  # a paragraph that click prints as it stands
        is_literal = is_literal and (indent > 0 or not bare)
        is_heading = bool(bare) and number + 1 < len(lines) and UNDERLINE.match(lines[number + 1]) is not None
        if is_heading:
            is_listed, is_skipped = bare in LISTED, bare in ("References", "Examples", "See Also")
        is_apart = (is_code or is_literal or is_printed or is_heading or is_skipped or UNDERLINE.match(line) is not None
                    or (is_listed and indent == 0) or bare.startswith(("|", "#", "<", "$", ">>>", "...", "[^", "!"))
                    or (indent >= 4 and not unit and not is_listed))
        item = ITEM.match(line)
        if (not bare or is_apart or item) and unit:
            yield " ".join(unit)
            unit = []
        if bare and not is_apart:
            unit.append(ITEM.sub("", line) if item else bare)
            is_literal = bare.endswith("::")
    if unit:
        yield " ".join(unit)


def sentences(unit: str) -> list[str]:
    """Return the sentences of a unit of prose. Code spans become a letter, and texts in parentheses are left out."""
    unit = re.sub(r"``.+?``|`[^`]*`", "X", unit)
    unit = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", unit)
    while (shorter := re.sub(r"\s*\([^()]*\)", "", unit)) != unit:
        unit = shorter
    return [each for each in re.split(r"(?<=[.!?:;])\s+(?=[A-Z*\"'X])", unit) if re.search(r"[a-z]", each)]


def faults(text: str, is_docstring: bool = False) -> Iterator[tuple[str, str]]:
    """Yield each fault of a text with its sentence."""
    for place, unit in enumerate(units(text)):
        for number, sentence in enumerate(sentences(unit)):
            words = re.findall(r"[A-Za-z'-]+", sentence)
            if is_docstring and place == number == 0 and words and words[0].lower() in FIRST_WORDS:
                yield f"begins with {words[0]}", sentence
            if len(words) > MOST_WORDS:
                yield f"{len(words)} words", sentence
            yield from ((fault, sentence) for fault, pattern in PATTERNS.items() if pattern.search(sentence))


def docstrings(path: Path) -> Iterator[tuple[int, str]]:
    """Yield line and text of each docstring of a module, also of its constants."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        body = getattr(node, "body", None)
        for before, own in zip([None, *body], body, strict=False) if isinstance(body, list) else ():
            if not isinstance(own, ast.Expr) or not isinstance(own.value, ast.Constant):
                continue
            if not isinstance(own.value.value, str):
                continue
            is_first = own is body[0] and isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef))
            if is_first or isinstance(before, (ast.Assign, ast.AnnAssign)):
                first, _, rest = own.value.value.partition("\n")
                yield own.lineno, f"{first.strip()}\n{textwrap.dedent(rest)}"


def texts() -> Iterator[tuple[str, int, str, bool]]:
    """Yield all texts: file, line, text, and whether it is a docstring."""
    for path in sorted((ROOT / "sitscad").rglob("*.py")):
        for line, text in docstrings(path):
            yield path.relative_to(ROOT).as_posix(), line, text, True
    with (ROOT / "sitscad/data/rules.csv").open(encoding="utf-8", newline="") as lines:
        for number, row in enumerate(csv.DictReader(lines), 2):
            for text in (row["summary"], row["why"], row["mend"], *row["severities"].split("; ")):
                yield "sitscad/data/rules.csv", number, text, False
    for path in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))):
        if path.stem != "rules":  # written from the texts of rules
            yield path.relative_to(ROOT).as_posix(), 1, path.read_text(encoding="utf-8"), False


def offences() -> dict[str, list[str]]:
    """Return the faulty sentences of each file."""
    result: dict[str, list[str]] = {}
    for file, line, text, is_docstring in texts():
        for fault, sentence in faults(text, is_docstring):
            result.setdefault(file, []).append(f"{file}:{line}: {fault}: {sentence[:150]}")
    return result


def exceptions() -> dict[str, tuple[int, str]]:
    """Return the number of sentences that may offend in each listed file, and the reason."""
    with EXCEPTIONS.open(encoding="utf-8", newline="") as lines:
        return {row["file"]: (int(row["sentences"]), row["reason"]) for row in csv.DictReader(lines)}


def test_no_file_has_more_faulty_sentences_than_listed():
    result, listed = offences(), exceptions()
    new = {file: text for file, text in result.items() if len(text) > listed.get(file, (0, ""))[0]}
    assert not new, "\n".join(line for text in new.values() for line in text)


def test_exception_list_names_existing_files_with_reasons():
    for file, (count, reason) in exceptions().items():
        assert (ROOT / file).is_file() and count > 0 and reason, file


@pytest.mark.parametrize(("text", "fault"), [
    ("What is told of a cell.", "begins with What"),
    ("Return the widths.\n\nA coil is compared with the one that is next.", "pronoun without its noun"),
    ("Return the parts.\n\n* The first item.\n* The loss is that of a sheet.", "relative clause without a noun"),
    ("Return a value.\n\nParameters\n----------\nx : float\n    The length, and none where it is open.",
     "absence: write 'None if' or 'Empty if'"),
    ("Return a value. " + "It has " + "more " * 30 + "words.", "33 words"),
    ("Return a value that the rule says.", "code does not speak or feel"),
    ("Return coils that are alike.", "vague reference"),
    ("Return drawings of it.", "vague reference"),
])
def test_faulty_sentence_is_detected(text, fault):
    assert fault in [each for each, _ in faults(text, is_docstring=True)]


@pytest.mark.parametrize("text", [
    "Return the widths of `what is` and ``that of``.",
    "Return a value.\n\nParameters\n----------\nalike : float\n    The length.\nRaises\n------\nError\n    If open.",
    "Return a table.\n\n| that of | alike |\n|---|---|\n| what is | of it |",
    "Solve it::\n\n    x = that of alike\n",
    "A list:\n\n" + "\n".join(f"* {'some words ' * 6}" for _ in range(9)),
    "```text\nsitscad says that of it\n```",
    "Return all of them, half of it, or one of them.",
    "Return the objects that one file draws, of only one kind.",
    "Print a table.\n\n\b\nNAME   that of it alike\nOTHER  what is",
    "Return it (that of the coil) and [that](https://that.of.it).",
])
def test_code_tables_and_list_items_are_not_reported(text):
    assert list(faults(text, is_docstring=True)) == []


def write() -> None:
    """Lower the numbers in the list of exceptions. Files without faults leave the list."""
    result, listed = offences(), exceptions()
    with EXCEPTIONS.open("w", encoding="utf-8", newline="") as lines:
        table = csv.writer(lines, lineterminator="\n")
        table.writerow(["file", "sentences", "reason"])
        for file, (count, reason) in sorted(listed.items()):
            if left := min(count, len(result.get(file, ()))):
                table.writerow([file, left, reason])


if __name__ == "__main__":
    if "--write" in sys.argv[1:]:
        write()
    else:
        print("\n".join(line for told in offences().values() for line in told))
