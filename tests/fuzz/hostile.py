"""Texts that no person would write, and what may be said of them: findings, in seconds, and nothing else."""

from __future__ import annotations

import random
import string
from pathlib import Path

from sitscad.spec import templates

BROKEN = Path(__file__).parents[1] / "report" / "broken"
TEXTS = [templates.read(name) for name in templates.names()] + [
    path.read_text(encoding="utf-8") for path in sorted(BROKEN.glob("SIT*.yaml"))
]
"""What is spoilt: the templates, and one design that breaks every rule."""

PIECES = [
    "{", "}", "[", "]", ":", ": ", "- ", "&a ", "*a", "!!python/object:os.system ", "|\n", ">\n", "\t",
    "\x00", "\ufeff",
    "\u202e", "\ud7ff", "'", '"', "#", "# sitscad: ignore SIT103 x", "? ", "---\n", "...\n", "%YAML 1.1\n", "~", "null",
    "1e400", "-1e-400", ".inf", ".nan", "0x41", "1_000", "1:30", "99999999999999999999", "-0", "5 parsec", "5 mm mm",
    "mm", "yes", "2001-01-01", "../../etc/passwd", "/dev/zero", "shop.yaml", "\n", "  ", "\r\n", "\x85", "\u2028",
]
VALUES = [
    "0", "-1", "1e-12", "1e12", "1 um", "100 m", "[]", "{}", "[1, 2]", "[[1]]", "none", "auto", "x",
    "''", "200", "0.25",
    "1 kohm", "-5 degC", "1e5 1/K", "[8, 7, 6, 5, 4, 3, 2, 1]", "square", "racetrack", "64", "500",
]


def mutated(rng: random.Random) -> str:
    """One of `TEXTS` with some of its characters, lines or values replaced, swapped, doubled or taken out."""
    text = rng.choice(TEXTS)
    for _ in range(rng.choice((1, 1, 1, 2, 3, 8))):
        text = rng.choice((_value, _value, _value, _piece, _line, _cut, _letters))(text, rng)
    return text


def _value(text: str, rng: random.Random) -> str:
    lines = text.split("\n")
    keyed = [i for i, line in enumerate(lines) if ": " in line and not line.lstrip().startswith("#")]
    if keyed:
        number = rng.choice(keyed)
        lines[number] = lines[number].split(": ", 1)[0] + ": " + rng.choice(VALUES)
    return "\n".join(lines)


def _piece(text: str, rng: random.Random) -> str:
    at = rng.randrange(len(text) + 1)
    return text[:at] + rng.choice(PIECES) * rng.choice((1, 1, 1, 40)) + text[at:]


def _line(text: str, rng: random.Random) -> str:
    lines = text.split("\n")
    one, other = rng.randrange(len(lines)), rng.randrange(len(lines))
    lines[one] = rng.choice((lines[other], "  " + lines[one], lines[one].lstrip(), lines[one] + "\n" + lines[one], ""))
    return "\n".join(lines)


def _cut(text: str, rng: random.Random) -> str:
    start = rng.randrange(len(text) + 1)
    return text[:start] + text[start + rng.randrange(1, 200) :]


def _letters(text: str, rng: random.Random) -> str:
    at = rng.randrange(len(text) + 1)
    word = "".join(rng.choice(string.printable) for _ in range(rng.randrange(1, 9)))
    return text[:at] + word + text[at + len(word) :]
