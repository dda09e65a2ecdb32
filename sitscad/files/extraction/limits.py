"""Limits on the files of a package from a stranger: a file beyond a limit raises an error instead of taking minutes.

The limits are far above the needs of a flexible circuit: the files of a board with 64 coils have some thousand objects.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from shapely import STRtree

MAX_BYTES = 16_000_000
"""Largest size (bytes) of one file."""

MAX_LAYERS = 64
"""Largest number of copper layers of one board."""

MAX_STATEMENT = 2000
"""Longest statement of a Gerber file, or line of a drill file, in characters. Reading time grows with the square."""

MAX_DIGITS = 10
"""Largest number of digits of a whole number: enough for 10 m in nanometres."""

MAX_OBJECTS = 100_000
"""Largest number of objects that one file draws."""

MAX_LINES = 300_000
"""Largest number of lines of a drill file: enough for a panel of a thousand boards with 300 holes each."""

MAX_POINTS = 10_000_000
"""Largest number of corners of all objects of one file together, with arcs as chords."""

MAX_PAIRS = 1_000_000
"""Largest number of pairs of objects of one file whose bounding boxes overlap. Each pair takes about 10 us to join."""

MAX_DISTANCE = 1e3
"""Largest distance (m) of any point from the origin, centres of arcs included."""

MAX_CORNERS = 12
"""Largest number of corners of a polygon aperture: the Gerber format's limit (specification 2024.05, section 4.4.5)."""


class ExtractionError(ValueError):
    """Files that cannot be read, or that do not make up one board."""


@contextmanager
def reading(what: str) -> Iterator[None]:
    """Turn any error that a malformed file causes in a parser into an `ExtractionError` that names the file."""
    try:
        yield
    except (ExtractionError, ImportError, OSError):
        raise
    except Exception as error:  # the readers of Gerber, JSON and ZIP raise almost anything
        raise ExtractionError(f"{what}: {type(error).__name__}: {error}") from error


def content_of(path: Path) -> bytes:
    """Return the bytes of a file. Raises ExtractionError for a file that is too large, or no regular file."""
    if not path.is_file():
        raise ExtractionError(f"{path.name} is no regular file")
    if path.stat().st_size > MAX_BYTES:
        raise ExtractionError(f"{path.name} has more than {MAX_BYTES // 1_000_000} MB, the maximum of one file")
    return path.read_bytes()


_COMMENTS = re.compile(r"%T[FAOD][^%]*%|G0?4[^*]*\*")
"""Attributes and comments of a Gerber file: they draw nothing."""

_UNSUPPORTED = {"SR": "step and repeat", "AB": "block apertures", "IF": "other files"}
"""First letters of Gerber statements that repeat or include other objects, which is not supported here."""

_POLYGON = re.compile(r"ADD\d+P,[^X]*X?([^X]*)")
_MACRO = re.compile(r"%AM[^%]*%")
_PRIMITIVE = re.compile(r"\*\s*([567]),[^,*]*,?([^,*]*)")

_LONG_NUMBER = re.compile(rf"(?<![\d.])\d{{{MAX_DIGITS + 1},}}")


def require_gerber(path: Path) -> str:
    """Return the text of a Gerber file. Raises ExtractionError if it exceeds a limit or has unsupported statements."""
    text = content_of(path).decode("utf-8", errors="replace")
    _require_short(path, re.split(r"[*%]", text), "statement")
    statements = _COMMENTS.sub("", text)
    for statement in map(str.strip, re.split(r"[*%]", statements)):
        if (what := _UNSUPPORTED.get(statement[:2])) and len(statement) > 2:
            raise ExtractionError(f"{path.name} has {what} ({statement[:20]}), which sitscad does not support")
        if match := _POLYGON.match(statement):
            _require_corners(path, match[1])
    for macro in _MACRO.findall(statements):
        for code, corners in _PRIMITIVE.findall(macro):
            if code != "5":
                raise ExtractionError(f"{path.name} has a macro with primitive {code}, which sitscad does not support")
            _require_corners(path, corners)
    _require_small_numbers(path, statements)
    return text


def require_drill(path: Path) -> str:
    """Return the text of a drill file. Raises ExtractionError if it exceeds a limit or repeats holes."""
    text = content_of(path).decode("utf-8", errors="replace")
    lines = text.splitlines()
    _require_short(path, lines, "line")
    statements = "\n".join(line for line in lines if not line.lstrip().startswith(";"))
    if match := re.search(r"(?m)^\s*(R\d|M0?2[XY]|M25)", statements):
        raise ExtractionError(f"{path.name} repeats holes ({match[1]}), which sitscad does not support")
    _require_small_numbers(path, statements)
    if len(lines) > MAX_LINES:
        raise ExtractionError(f"{path.name} has {len(lines)} lines, maximum {MAX_LINES}")
    return text


def _require_corners(path: Path, corners: str) -> None:
    count = corners.strip()
    if not re.fullmatch(r"\d\d?", count) or not 3 <= int(count) <= MAX_CORNERS:
        raise ExtractionError(f"{path.name} has a polygon of {count[:20] or 'no'} corners, not 3 to {MAX_CORNERS}")


def _require_short(path: Path, parts: Sequence[str], what: str) -> None:
    if (longest := max(map(len, parts), default=0)) > MAX_STATEMENT:
        raise ExtractionError(f"{path.name} has a {what} of {longest} characters, maximum {MAX_STATEMENT}")


def _require_small_numbers(path: Path, statements: str) -> None:
    if match := _LONG_NUMBER.search(statements):
        raise ExtractionError(
            f"{path.name} has a number of {len(match[0])} digits ({match[0][:12]}...), maximum {MAX_DIGITS}"
        )


def require_near(values: Iterable[float]) -> None:
    """Raise ExtractionError if a coordinate (m) is farther from the origin than `MAX_DISTANCE`."""
    if not all(abs(value) <= MAX_DISTANCE for value in values):
        raise ExtractionError(f"a point is farther than {MAX_DISTANCE:.0f} m from the origin")


def require_objects(count: int) -> None:
    """Raise ExtractionError if a file draws more objects than the limit."""
    if count > MAX_OBJECTS:
        raise ExtractionError(f"it draws {count} objects, maximum {MAX_OBJECTS}")


def require_few_overlaps(shapes: Sequence[Any]) -> None:
    """Raise ExtractionError if more pairs of shapes than `MAX_PAIRS` have overlapping bounding boxes."""
    tree, pairs = STRtree(shapes), 0
    step = max(1, MAX_PAIRS // max(1, len(shapes)))  # a chunk finds no more pairs than the limit
    for first in range(0, len(shapes), step):
        pairs += tree.query(shapes[first : first + step]).shape[1]
        if pairs > MAX_PAIRS:
            raise ExtractionError(f"more than {MAX_PAIRS} pairs of its objects overlap, the maximum")
