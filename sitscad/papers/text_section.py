"""A section of a readme: a heading, and rows of a name and a text."""

from __future__ import annotations

from collections.abc import Iterable
from textwrap import wrap

TEXT_WIDTH = 100


def section(title: str, rows: Iterable[tuple[str, str]]) -> list[str]:
    """A heading and rows of a name and a text, the text wrapped beside its name."""
    lines = [title, "-" * len(title)]
    pairs = list(rows)
    indent = max(len(name) for name, _ in pairs) + 2
    for name, text in pairs:
        first, *rest = wrap(text, TEXT_WIDTH - indent, break_long_words=False, break_on_hyphens=False) or [""]
        lines += [f"{name:<{indent}}{first}".rstrip(), *(" " * indent + more for more in rest)]
    return [*lines, ""]
