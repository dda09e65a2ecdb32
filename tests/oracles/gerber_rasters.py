"""Gerber files as pixels: three renderers that are not ours draw the same file at the same scale.

``PYTHONPATH=. python tests/oracles/gerber_rasters.py`` prints by how much they differ, for every layer of every
template and for KiCad's own files of the same board.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from kicad_oracle import plots, write
from numpy.typing import NDArray

from sitscad.files.formats import gerber
from sitscad.files.formats.kicad import project_files as kicad
from sitscad.kernels.geometry.path import bounding_box
from sitscad.layout.board import Layout

DOTS = 50
"""Pixels a millimetre: the finest track of a template, 76 um, is four pixels wide."""

TENTH = 2.54
"""A tenth of an inch (mm)."""

EDGE = 1
"""So many pixels (20 um each) an edge may lie elsewhere: renderers round differently whether a pixel is covered."""

LIMIT = 1e-4
"""The share of the drawn pixels that may differ beside that. Nothing does; it is what one wrong via would be."""

Image = NDArray[np.bool_]


@dataclass(frozen=True)
class Frame:
    """What is drawn: the lower left corner, width and height in tenths of an inch (127 pixels).

    gerbv takes inches of few digits; so the pixels of all renderers agree.
    """

    x: int
    y: int
    width: int
    height: int

    @classmethod
    def round_board(cls, box: tuple[float, float, float, float]) -> Frame:
        """The frame round a box (metres) with half a millimetre or more on every side."""
        x0, y0 = (int(np.floor((v * 1e3 - 0.5) / TENTH)) for v in box[:2])
        x1, y1 = (int(np.ceil((v * 1e3 + 0.5) / TENTH)) for v in box[2:])
        return cls(x0, y0, x1 - x0, y1 - y0)

    @property
    def pixels(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return round(self.width * TENTH * DOTS), round(self.height * TENTH * DOTS)


def gerbv(path: Path, frame: Frame, finer: int = 1) -> Image:
    """What gerbv draws (its own parser, cairo), with so many times as many pixels a millimetre."""
    picture = path.with_suffix(".gerbv.png")
    inch = f"{frame.x / 10}x{frame.y / 10}", f"{frame.width / 10}x{frame.height / 10}"
    colours = ["-b", "#000000", "-f", "#ffffff"]
    place = ["-D", f"{finer * DOTS * 25.4:g}", "-B", "0", "-O", inch[0], "-W", inch[1]]
    command = ["gerbv", "-x", "png", "-a", *colours, *place, "-o", picture, path]
    subprocess.run(command, capture_output=True, check=True, timeout=60)
    return _in_frame(_read(picture), frame, finer)


def librsvg(path: Path, frame: Frame) -> Image:
    """What librsvg draws of the SVG that gerbonara makes of the file."""
    from gerbonara import GerberFile
    from gerbonara.utils import MM

    picture, drawing = path.with_suffix(".rsvg.png"), path.with_suffix(".svg")
    x, y = frame.x * TENTH, frame.y * TENTH
    bounds = (x, y), (x + frame.width * TENTH, y + frame.height * TENTH)
    drawing.write_text(str(GerberFile.open(path).to_svg(force_bounds=bounds, svg_unit=MM, fg="white", bg="black")))
    size = ["-w", str(frame.pixels[0]), "-h", str(frame.pixels[1])]
    subprocess.run(["rsvg-convert", *size, "-b", "black", "-o", picture, drawing], check=True, timeout=60)
    return _in_frame(_read(picture), frame)


def pygerber(path: Path, finer: int = 1) -> Image:
    """What pygerber draws (a third parser, Pillow), with so many times as many pixels; it states no frame, so only the
    drawn part is given, and it rounds every place and width to whole pixels.
    """
    picture = path.with_suffix(".pygerber.png")
    options = ["-t", "copper", "-d", str(finer * DOTS), "-o", picture]
    command = [sys.executable, "-m", "pygerber", "render", "raster", *options, path]
    subprocess.run(command, capture_output=True, check=True, timeout=120)
    return cropped(_read(picture))


def cropped(image: Image) -> Image:
    """The part of an image with something in it."""
    rows, columns = np.flatnonzero(image.any(axis=1)), np.flatnonzero(image.any(axis=0))
    return image[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1] if rows.size else image[:0, :0]


def differing(one: Image, other: Image, edge: int = EDGE) -> float:
    """The share of the drawn pixels that lie in one image and in the other one neither there nor `edge` beside it."""
    height, width = np.maximum(one.shape, other.shape)
    one, other = (np.pad(i, ((0, height - i.shape[0]), (0, width - i.shape[1]))) for i in (one, other))
    drawn = np.count_nonzero(one | other)
    wrong = np.count_nonzero((one & ~_grown(other, edge)) | (other & ~_grown(one, edge)))
    return wrong / drawn if drawn else 0.0


def _grown(image: Image, by: int) -> Image:
    for axis in (0, 1):
        wide = image.copy()
        for step in range(1, by + 1):
            for to, of in ((slice(step, None), slice(None, -step)), (slice(None, -step), slice(step, None))):
                index = (to, slice(None)) if axis == 0 else (slice(None), to)
                source = (of, slice(None)) if axis == 0 else (slice(None), of)
                wide[index] |= image[source]
        image = wide
    return image


def _read(picture: Path) -> Image:
    import matplotlib.image

    pixels = matplotlib.image.imread(picture)
    return np.asarray(pixels[..., 1] > 0.5)  # green: all three draw black on something with green in it


def _in_frame(image: Image, frame: Frame, finer: int = 1) -> Image:
    assert image.shape == tuple(finer * side for side in frame.pixels[::-1]), (image.shape, frame.pixels)
    return image


def written(layout: Layout, folder: Path) -> dict[str, Path]:
    """A board's own Gerber files in a folder, by layer."""
    files = {}
    for name, text in gerber.render(layout).items():
        file = folder / name.rpartition("/")[2]
        file.write_bytes(text)
        files[file.stem.removeprefix(f"{layout.spec.name}-")] = file
    return files


OUTLINED = ("Body_Layers", "Tail_Coverlay")
"""What KiCad's board shows by its outline alone."""


def pairs(layout: Layout, folder: Path) -> Iterator[tuple[str, str, Image, Image]]:
    """(layer, what is compared, two images) for every layer of a board's own files, and of KiCad's own files of it."""
    frame, ours = Frame.round_board(bounding_box([layout.outline])), written(layout, folder)
    theirs = plots(write(kicad.render(layout), folder))
    for layer, file in sorted(ours.items()):
        item = gerbv(file, frame)
        yield layer, "gerbv and librsvg", item, librsvg(file, frame)
        if layer in theirs and layer not in OUTLINED:
            yield layer, "KiCad's file by gerbv", item, gerbv(theirs[layer], frame)
            yield layer, "KiCad's file by librsvg", item, librsvg(theirs[layer], frame)


def _table() -> None:
    from sitscad.layout import lay_out
    from sitscad.spec.load import load

    worst: dict[str, tuple[float, float]] = {}
    for template in sorted((Path(__file__).parents[2] / "templates").glob("*.yaml")):
        layout = lay_out(load(template))
        with tempfile.TemporaryDirectory() as folder:
            for layer, what, item, other in pairs(layout, Path(folder)):
                shares = differing(item, other, 0), differing(item, other)
                print(f"| {template.stem} | {layer} | {what} | {shares[0]:.2%} | {shares[1]:.2g} |", flush=True)
                worst[what] = tuple(map(max, worst.get(what, shares), shares))  # type: ignore[assignment]
    for what, (every, beyond) in worst.items():
        print(f"worst, {what}: {every:.2%} of the drawn pixels, {beyond:.2g} beyond {EDGE} pixel of {1000 / DOTS:g} um")


if __name__ == "__main__":
    _table()
