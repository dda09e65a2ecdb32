"""Limits on finished files, so that no file costs minutes or gigabytes: each is refused in words before it is read.

The limits are far above what a flexible circuit needs: the files of a board of 64 coils have some thousand objects.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from shapely import STRtree

MAX_BYTES = 16_000_000
"""Bytes of one file."""

MAX_LAYERS = 64
"""Copper layers of one board."""

MAX_STATEMENT = 2000
"""Characters of one statement of a Gerber file, or of one line of a drill file. Reading costs their square."""

MAX_DIGITS = 10
"""Digits of a whole number: 10 m in nanometres."""

MAX_OBJECTS = 100_000
"""Objects that one file draws."""

MAX_LINES = 300_000
"""Lines of a drill file: a panel of a thousand boards of 300 holes each."""

MAX_POINTS = 10_000_000
"""Corners of all objects of one file, arcs as chords."""

MAX_PAIRS = 1_000_000
"""Pairs of objects of one file whose boxes overlap: joining their areas costs about 10 us each."""

FARTHEST = 1e3
"""Largest distance (m) of any point from the origin, centres of arcs included."""

MAX_CORNERS = 12
"""Corners of a regular polygon as an aperture: the Gerber format's own limit (specification 2024.05, section 4.4.5)."""


class ExtractionError(ValueError):
    """Files that cannot be read, or that do not make up one board."""


@contextmanager
def reading(what: str) -> Iterator[None]:
    """Turn whatever a hostile file makes of a reader into an `ExtractionError` that names the file."""
    try:
        yield
    except (ExtractionError, ImportError, OSError):
        raise
    except Exception as error:  # the readers of Gerber, JSON and ZIP raise almost anything
        raise ExtractionError(f"{what}: {type(error).__name__}: {error}") from error


def content_of(path: Path) -> bytes:
    """The bytes of a file. Raises ExtractionError if it is none (a pipe would wait), or too large."""
    if not path.is_file():
        raise ExtractionError(f"{path.name} is no file")
    if path.stat().st_size > MAX_BYTES:
        raise ExtractionError(f"{path.name} has more than {MAX_BYTES // 1_000_000} MB, the limit of one file")
    return path.read_bytes()


_UNDRAWN = re.compile(r"%T[FAOD][^%]*%|G0?4[^*]*\*")
"""Attributes and comments of a Gerber file: they draw nothing."""

_NOT_READ = {"SR": "step and repeat", "AB": "block apertures", "IF": "other files"}
"""Statements of a Gerber file that draw more than they say, by how they begin."""

_POLYGON = re.compile(r"ADD\d+P,[^X]*X?([^X]*)")
_MACRO = re.compile(r"%AM[^%]*%")
_PRIMITIVE = re.compile(r"\*\s*([567]),[^,*]*,?([^,*]*)")

_LONG_NUMBER = re.compile(rf"(?<![\d.])\d{{{MAX_DIGITS + 1},}}")


def require_gerber(path: Path) -> str:
    """The text of a Gerber file; raises ExtractionError if it is beyond the limits or repeats what it draws."""
    text = content_of(path).decode("utf-8", errors="replace")
    _require_short(path, re.split(r"[*%]", text), "statement")
    drawn = _UNDRAWN.sub("", text)
    for statement in map(str.strip, re.split(r"[*%]", drawn)):
        if (what := _NOT_READ.get(statement[:2])) and len(statement) > 2:
            raise ExtractionError(f"{path.name} has {what} ({statement[:20]}), which is not read here")
        if found := _POLYGON.match(statement):
            _require_corners(path, found[1])
    for macro in _MACRO.findall(drawn):
        for code, corners in _PRIMITIVE.findall(macro):
            if code != "5":
                raise ExtractionError(f"{path.name} has a macro of primitive {code}, which is not read here")
            _require_corners(path, corners)
    _require_small_numbers(path, drawn)
    return text


def require_drill(path: Path) -> str:
    """The text of a drill file; raises ExtractionError if it is beyond the limits or repeats holes."""
    text = content_of(path).decode("utf-8", errors="replace")
    lines = text.splitlines()
    _require_short(path, lines, "line")
    drawn = "\n".join(line for line in lines if not line.lstrip().startswith(";"))
    if found := re.search(r"(?m)^\s*(R\d|M0?2[XY]|M25)", drawn):
        raise ExtractionError(f"{path.name} repeats holes ({found[1]}), which is not read here")
    _require_small_numbers(path, drawn)
    if len(lines) > MAX_LINES:
        raise ExtractionError(f"{path.name} has {len(lines)} lines, {MAX_LINES} are the limit")
    return text


def _require_corners(path: Path, corners: str) -> None:
    count = corners.strip()
    if not re.fullmatch(r"\d\d?", count) or not 3 <= int(count) <= MAX_CORNERS:
        raise ExtractionError(f"{path.name} has a polygon of {count[:20] or 'no'} corners, not 3 to {MAX_CORNERS}")


def _require_short(path: Path, parts: Sequence[str], what: str) -> None:
    if (longest := max(map(len, parts), default=0)) > MAX_STATEMENT:
        raise ExtractionError(f"{path.name} has a {what} of {longest} characters, {MAX_STATEMENT} are the limit")


def _require_small_numbers(path: Path, drawn: str) -> None:
    if found := _LONG_NUMBER.search(drawn):
        raise ExtractionError(
            f"{path.name} has a number of {len(found[0])} digits ({found[0][:12]}...), {MAX_DIGITS} are the limit"
        )


def require_near(values: Iterable[float]) -> None:
    """Raise ExtractionError if a coordinate (m) is farther from the origin than any board reaches."""
    if not all(abs(value) <= FARTHEST for value in values):
        raise ExtractionError(f"a point is farther than {FARTHEST:.0f} m from the origin")


def require_objects(count: int) -> None:
    """Raise ExtractionError if a file draws more objects than the limit."""
    if count > MAX_OBJECTS:
        raise ExtractionError(f"it draws {count} objects, {MAX_OBJECTS} are the limit")


def require_points(count: int) -> None:
    """Raise ExtractionError if the objects of a file have more corners than the limit."""
    if count > MAX_POINTS:
        raise ExtractionError(f"its objects have more than {MAX_POINTS} corners")


def require_few_overlaps(shapes: Sequence[Any]) -> None:
    """Raise ExtractionError if more pairs of shapes than the limit overlap each other's boxes."""
    tree, pairs = STRtree(shapes), 0
    step = max(1, MAX_PAIRS // max(1, len(shapes)))  # a chunk finds no more pairs than the limit
    for first in range(0, len(shapes), step):
        pairs += tree.query(shapes[first : first + step]).shape[1]
        if pairs > MAX_PAIRS:
            raise ExtractionError(f"more than {MAX_PAIRS} pairs of its objects lie over each other")
