"""Excellon drill files in the XNC manner: metric, explicit decimal points, drilling only, X2 attributes in comments."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from sitscad.fabrication.files import DrilledHole, millimetres, tools_of


def drill_text(
    title: str, function: str, attributes: Iterable[tuple[str, ...]], holes: Sequence[DrilledHole], use: str
) -> bytes:
    """A drill file: ``function`` is its X2 file function, ``use`` what the holes are for (``ViaDrill``)."""
    return ("\n".join(_lines(title, function, attributes, holes, use)) + "\n").encode("ascii")


def _lines(
    title: str, function: str, attributes: Iterable[tuple[str, ...]], holes: Sequence[DrilledHole], use: str
) -> Iterator[str]:
    """The lines of the file: header, tools, holes."""
    plating, *_, kind = function.split(",")
    tools = tools_of(holes)
    yield from ("M48", f"; {title}, tool sizes are finished holes")
    for attribute in (*attributes, (".FileFunction", function)):
        yield f"; #@! TF{','.join(attribute)}"
    yield from ("METRIC", ";TYPE=PLATED" if plating == "Plated" else ";TYPE=NON_PLATED")
    for code, (diameter, _) in enumerate(tools, 1):
        yield from (f"; #@! TA.AperFunction,{plating},{kind},{use}", f"T{code}C{millimetres(diameter, 3)}")
    yield from ("%", "G05")
    for code, (_, drilled) in enumerate(tools, 1):
        yield f"T{code}"
        yield from (f"X{millimetres(hole.x)}Y{millimetres(hole.y)}" for hole in drilled)
    yield "M30"
