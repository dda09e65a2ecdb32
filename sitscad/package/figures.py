"""Comparison of files by value, because the last digits of a computed figure depend on the processor.

Processors add long sums in different order. In a file of computed figures, the text between the numbers must be equal,
and each number must agree within a tolerance (`agree`). All other files of a package are equal byte by byte.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from fnmatch import fnmatchcase
from pathlib import Path

from sitscad.package.manifest import Manifest, intact

FIGURES = (
    "estimate.json", "findings.json", "FORCED.txt", "fpc/FORCED.txt", "report.html", "live.html", "datasheet.*",
    "calibration/*", "firmware/*", "mount/*.json", "mount/assembly.txt", "mesh/*.json",
)
"""Patterns of the files that hold computed figures."""

EXACT = ("firmware/wiring/*",)
"""Patterns of files that match `FIGURES` but hold no computed figures, and are compared byte by byte."""

TOLERANCE = 1e-4
"""Largest relative difference of two equal figures: far below every stated error, far above what sums differ by."""

LIST_TOLERANCE = 1e-5
"""Largest difference of two equal figures in a list, relative to the largest figure of that list."""

WHOLE_TOLERANCE = 1e-6
"""Largest relative difference of two equal whole numbers: registers, codes and counts below a million are exact."""

LAST_DIGIT = 0.01
"""A rounded figure may differ by a unit of its last digit if that is at most this fraction of it."""

_NUMBER = re.compile(rb"(?<![\w.])[-+]?\d++(?:\.\d++)?+(?:[eE][-+]?\d++)?+(?!\.\d)")
_BETWEEN = re.compile(rb"f?[\s,\[\]{}]*")  # What stands between the numbers of a list
_PLACES = re.compile(rb"/Length \d+|\nxref\n.*", re.DOTALL)  # Where a PDF says how long its parts are


def has_figures(name: str) -> bool:
    """Whether a package's file holds computed figures, and so is compared by value."""
    return any(fnmatchcase(name, each) for each in FIGURES) and not any(fnmatchcase(name, each) for each in EXACT)


def figure_files(folder: Path, manifest: Manifest) -> dict[str, bytes]:
    """Return the content of each file of figures by name, without files that differ from their hash in the manifest."""
    named = {name: entry for name, entry in manifest.files.items() if has_figures(name)}
    found = ((name, intact(folder, {name: entry})) for name, entry in named.items())
    return {name: files[name] for name, files in found if files is not None}


def with_equal_figures(files: Mapping[str, bytes], old: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return the new files, each replaced by the `old` file of its name if the figures of both agree."""
    return {name: old[name] if name in old and agree(old[name], content) else content
            for name, content in files.items()}


def agree(one: bytes, other: bytes) -> bool:
    """Whether two files have equal text, and numbers that agree within their tolerances.

    A number may differ by `TOLERANCE`, in a list by `LIST_TOLERANCE` of the largest, a whole number by
    `WHOLE_TOLERANCE`. A figure may also differ by a unit of its last digit, if that is at most `LAST_DIGIT` of it.
    """
    if one == other:
        return True
    if one.startswith(b"%PDF"):
        one, other = (_PLACES.sub(b"", content) for content in (one, other))
    texts, others = (_NUMBER.split(content) for content in (one, other))
    if one == other or texts != others:
        return False
    pairs = list(zip(_NUMBER.findall(one), _NUMBER.findall(other), strict=True))
    return all(_near(a, b, scale) for (a, b), scale in zip(pairs, _scales(texts, pairs), strict=True) if a != b)


def _near(one: bytes, other: bytes, scale: float) -> bool:
    a, b = float(one), float(other)
    size, apart = max(abs(a), abs(b)), abs(a - b)
    if one.lstrip(b"+-").isdigit() and other.lstrip(b"+-").isdigit():
        return apart <= WHOLE_TOLERANCE * size
    unit = 1.001 * min(_unit(one), _unit(other))  # binary fractions of decimal digits
    return apart <= max(TOLERANCE * size, LIST_TOLERANCE * scale, min(unit, LAST_DIGIT * size))


def _unit(number: bytes) -> float:
    """Value of a unit in the last digit."""
    digits, _, power = number.lower().partition(b"e")
    return float(10.0 ** (int(power or 0) - len(digits.partition(b".")[2])))


def _scales(texts: list[bytes], pairs: list[tuple[bytes, bytes]]) -> Iterator[float]:
    """Yield, for each number, the largest magnitude in its list. Only commas, brackets and spaces separate them."""
    first = 0
    for k in range(1, len(pairs) + 1):
        if k == len(pairs) or not _BETWEEN.fullmatch(texts[k]):
            yield from [max((abs(float(a)) for a, _ in pairs[first:k]), default=0.0)] * (k - first)
            first = k
