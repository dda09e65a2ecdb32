"""A Gerber file repeated: the board's finished file drawn once for every copy, moved by whole nanometres.

What a copy shows is therefore exactly what the board's own file shows. Nets and pins, which would be the same in every
copy, are left out: the netlist belongs to the single board.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from sitscad.formats.gerber.image import grid
from sitscad.geometry.path import Point
from sitscad.record import record

_COORDINATES = re.compile(r"X(-?\d+)Y(-?\d+)")
_CODE = re.compile(r"(%AD|^)D(\d{2,})")
_FIRST_CODE = 10


@record
class Image:
    """What a file draws, without its head: its apertures with their attributes, and its plot commands."""

    apertures: tuple[str, ...]
    commands: tuple[str, ...]

    @property
    def codes(self) -> int:
        """How many aperture codes it takes from 10 on."""
        numbers = [int(found[2]) for line in self.apertures if (found := _CODE.match(line))]
        return max(numbers, default=_FIRST_CODE - 1) + 1 - _FIRST_CODE


def image_of(text: bytes) -> Image:
    """The image of one of sitscad's own files.

    Raises ValueError for a file that does not have their form.
    """
    lines = text.decode("ascii").splitlines()
    if "G75*" not in lines or lines[-1] != "M02*":
        raise ValueError("a Gerber file of another form cannot be repeated")
    body = lines[lines.index("G75*") + 1 : -1]
    last = max((i for i, line in enumerate(body) if line.startswith("%AD")), default=-1)
    apertures = [line for line in body[: last + 1] if line.startswith(("%AD", "%TA", "%TD"))]
    commands = [line for line in body if not line.startswith(("%AD", "%T"))]
    return Image(tuple([*apertures, "%TD*%"] if apertures else ()), tuple(commands))


def repeated(images: Iterable[tuple[Image, Iterable[Point]]]) -> Iterator[str]:
    """The apertures of some images, then each image at each of its places (moves in metres)."""
    placed, first = [], 0
    for image, places in images:
        yield from (_renumbered(line, first) for line in image.apertures)
        placed.append(([_renumbered(line, first) for line in image.commands], [grid(at) for at in places]))
        first += image.codes
    for commands, moves in placed:
        for dx, dy in moves:
            yield from (_moved(line, dx, dy) for line in commands)


def _renumbered(line: str, first: int) -> str:
    return _CODE.sub(lambda found: f"{found[1]}D{int(found[2]) + first}", line)


def _moved(line: str, dx: int, dy: int) -> str:
    return _COORDINATES.sub(lambda found: f"X{int(found[1]) + dx}Y{int(found[2]) + dy}", line)
