"""The board as letters: to scale, inside its columns, every turn of a coil across its middle."""

from __future__ import annotations

import pytest

import sitscad
from sitscad.files.drawing.pictures.layout_picture import COLUMNS, PicturePoint, dot_picture

SPEC = """\
sitscad: 1
name: one
coil: {shape: circle, outer_diameter: 10, turns: 5.5, layers: 2, trace_width: 150 um, trace_spacing: 450 um}
"""


@pytest.fixture(scope="module")
def layout():
    return sitscad.lay_out(sitscad.load_text(SPEC))


def raster(picture: str) -> list[list[bool]]:
    """The dots of a picture, row by row, by the bits of Unicode's braille letters."""
    bits = ((0, 3), (1, 4), (2, 5), (6, 7))
    rows = []
    for line in picture.splitlines():
        codes = [ord(letter) - 0x2800 for letter in line]
        assert all(0 <= code < 256 for code in codes)
        rows += [[bool(code >> bit & 1) for code in codes for bit in row] for row in bits]
    return rows


def test_dot_picture_has_requested_width_and_true_proportions(layout):
    for columns in (40, COLUMNS):
        lines = dot_picture(layout, columns=columns).splitlines()
        length, width = layout.body_size
        assert columns - 1 <= max(map(len, lines)) <= columns
        assert abs(len(lines) * 4 / (2 * columns) - width / length) < 0.1


def test_row_through_coil_centre_crosses_every_turn(layout):
    dots = raster(dot_picture(layout))
    x0, _, x1, y1 = layout.body
    step = (x1 - x0) / (2 * COLUMNS - 1)
    centre = layout.coils[0].centre
    row = dots[round((y1 - centre.y) / step)]
    left = row[: round((centre.x - x0) / step)]
    crossings = sum(here and not before for before, here in zip([False, *left], left, strict=False))
    assert 5 <= crossings - 1 <= 6  # the outline, and 5.5 turns


def test_marks_are_drawn_at_their_positions_and_omitted_outside(layout):
    centre = layout.coils[0].centre
    points = [PicturePoint(centre.x, centre.y, "7", "error"), PicturePoint(1.0, 0.0, "9", "note")]
    lines = dot_picture(layout, points).splitlines()
    (row,) = [i for i, line in enumerate(lines) if "7" in line]
    assert "9" not in "".join(lines)
    x0, _, x1, y1 = layout.body
    step = (x1 - x0) / (2 * COLUMNS - 1)
    assert (lines[row].index("7"), row) == (int((centre.x - x0) / step) // 2, int((y1 - centre.y) / step) // 4)
