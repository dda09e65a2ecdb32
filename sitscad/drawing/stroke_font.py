"""Letters as strokes, for writing in Gerber files: capitals, digits and a few signs on a grid of 4 by 6."""

from __future__ import annotations

from collections.abc import Iterator

from sitscad.geometry.path import Path, Point, polyline

ADVANCE = 6.0
HEIGHT = 6.0

# Each glyph is strokes, each stroke its corners, each corner its two digits: column 0 to 4, row 0 to 6.
_GLYPHS = {
    "0": "0040460600 0046", "1": "152620 1030", "2": "064643030040", "3": "06464000 0343", "4": "060343 4640",
    "5": "460603434000", "6": "460600404303", "7": "064620", "8": "0040460600 0343", "9": "430306464000",
    "A": "0004264440 0343", "B": "00063645443303 3342413000", "C": "46060040", "D": "00062644422000",
    "E": "46060040 0333", "F": "460600 0333", "G": "460600404323", "H": "0006 4046 0343", "I": "1030 2026 1636",
    "J": "4641301001", "K": "0006 460340", "L": "060040", "M": "0006234640", "N": "00064046", "O": "0040460600",
    "P": "0006464303", "Q": "0040460600 2240", "R": "0006464303 2340", "S": "460603434000", "T": "0646 2620",
    "U": "06004046", "V": "062046", "W": "0610243046", "X": "0046 0640", "Y": "062346 2320", "Z": "06460040",
    "-": "1333", ".": "2021", "_": "0040", "/": "0046", "=": "0242 0444", "+": "0343 2125", ":": "2122 2425",
    ",": "2110", "(": "36252130", ")": "16252110",
}  # fmt: skip


def strokes(text: str, at: Point, height: float) -> Iterator[Path]:
    """The strokes of a text whose lower left corner is `at`, capitals `height` high (m); small letters are capitals.

    Raises KeyError for a character that the font has not; a space is one advance.
    """
    unit = height / HEIGHT
    for i, character in enumerate(text.upper()):
        if character == " ":
            continue
        left = at.x + i * ADVANCE * unit
        for stroke in _GLYPHS[character].split():
            corners = zip(stroke[::2], stroke[1::2], strict=True)
            yield polyline([Point(left + int(x) * unit, at.y + int(y) * unit) for x, y in corners])


def length(text: str, height: float) -> float:
    """How long a text is (m), without the gap after its last character."""
    return (len(text) * ADVANCE - 2.0) * height / HEIGHT
