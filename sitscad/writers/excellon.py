"""Excellon drill file in the XNC manner: metric, explicit decimal points, drilling only, X2 attributes in comments."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby

from sitscad.layout.board import Layout, Via
from sitscad.writers._fabrication_files import FabricationFile, drill_files, project_attributes


def render(layout: Layout) -> dict[str, bytes]:
    """The drill file by its path in the package; nothing where the layout has no hole.

    All holes of a layout are plated and go through the whole board; the tools' diameters are the finished holes'.
    """
    return {file.path: ("\n".join(_lines(layout, file)) + "\n").encode("ascii") for file in drill_files(layout)}


def _lines(layout: Layout, file: FabricationFile) -> Iterator[str]:
    tools = _tools(layout.vias)
    yield from ("M48", f"; {layout.spec.name}: {file.title}, tool sizes are finished holes")
    for attribute in (*project_attributes(layout), (".FileFunction", file.function)):
        yield f"; #@! TF{','.join(attribute)}"
    yield from ("METRIC", ";TYPE=PLATED")
    for code, (diameter, _) in enumerate(tools, 1):
        yield from ("; #@! TA.AperFunction,Plated,PTH,ViaDrill", f"T{code}C{diameter}")
    yield from ("%", "G05")
    for code, (_, holes) in enumerate(tools, 1):
        yield f"T{code}"
        yield from (f"X{_mm(via.centre.x)}Y{_mm(via.centre.y)}" for via in holes)
    yield "M30"


def _tools(vias: tuple[Via, ...]) -> list[tuple[str, list[Via]]]:
    """The holes grouped by finished diameter, small ones first, in the layout's order within a tool."""
    ordered = sorted(vias, key=lambda via: _nanometres(via.drill))
    return [(_mm(d * 1e-9, 3), list(group)) for d, group in groupby(ordered, key=lambda via: _nanometres(via.drill))]


def _nanometres(length: float) -> int:
    return round(length * 1e9)


def _mm(length: float, least: int = 1) -> str:
    """A length (m) in millimetres, to the nanometre as the Gerber files have it, with `least` decimals kept."""
    whole, _, decimals = f"{_nanometres(length) / 1e6:.6f}".partition(".")
    return f"{'0' if whole == '-0' and not decimals.strip('0') else whole}.{decimals.rstrip('0').ljust(least, '0')}"
