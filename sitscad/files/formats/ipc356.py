"""IPC-D-356A netlist for the bare-board test: one record per contact and one per via.

Metric (``UNITS CUST 1``: micrometres and degrees), with fields at the fixed columns of the standard. A coil is one
piece of copper. Its two contacts therefore belong to one net, and the test checks continuity between them.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from sitscad.files.order_facts.files import NO_NET, fabrication_path, has_coverlay
from sitscad.kernels.geometry.path import Point, Region
from sitscad.layout.board import Layout, Pad, Via
from sitscad.spec.circuit import Stackup

NET_NAME_LENGTH = 14


def render(layout: Layout) -> dict[str, bytes]:
    """Return the netlist by its path in the package.

    Raises ValueError for values too long for a field of the format.
    """
    text = "\n".join(_records(layout)) + "\n"
    return {fabrication_path(layout.spec.name, "netlist.d356"): text.encode("ascii")}


def _records(layout: Layout) -> Iterator[str]:
    name, issue = layout.spec.name, layout.spec.issue
    yield "C  Bare-board netlist, in the coordinates of the Gerber and drill files"
    yield "C  A net is one coil: its contacts .A and .B are the two ends of one conductor"
    yield from ([f"C  {issue.title}"] if issue.rows else [])
    yield from (f"P  JOB   {name}", "P  CODE  00", "P  UNITS CUST 1", f"P  TITLE {name}")
    yield from (f"P  NUM   {issue.part_number or 1}", f"P  REV   {issue.revision or '-'}")
    yield from ("P  VER   IPC-D-356A", "P  IMAGE PRIMARY")
    openings = layout.bottom_openings, layout.spec.fpc.stackup, layout.top_openings
    layers = layout.copper_layers
    for net in layout.nets:
        yield from (_contact(layers, pad, _covered(*openings, pad.centre)) for pad in layout.all_pads if pad.net == net)
        for via in (via for via in layout.vias if via.net == net):
            yield _via(via, layout.lowest_layer(via) == layers, _covered(*openings, via.centre))
    yield from (_contact(layers, pad, _covered(*openings, pad.centre)) for pad in layout.pads if pad.is_unused)
    yield "999"


def _contact(copper_layers: int, pad: Pad, covered: int) -> str:
    """Return the record of a surface contact (operation 327), which the tester reaches from the contact's own side.

    `covered` is the code of the sides under coverlay.
    """
    bottom = pad.layer == copper_layers and pad.layer > 1
    size = f"X{_number(pad.size[0], 4)}Y{_number(pad.size[1], 4)}"
    access = f"A{pad.layer if bottom else 1:02d}"
    return _record("327", pad.net or NO_NET, pad.reference, str(pad.number), "", access, pad.centre, size, covered)


def _via(via: Via, is_through: bool, covered: int) -> str:
    """Return the record of a plated hole (operation 317). `covered` is the code of the sides under coverlay.

    The tester reaches a hole that ends on an inner layer from the top (01), as in KiCad.
    """
    size = f"X{_number(via.pad, 4)}Y0000"
    hole = f"MD{_number(via.drill, 4)}P"
    access = "A00" if is_through else "A01"
    return _record("317", via.net, "VIA", "", hole, access, via.centre, size, covered)


def _record(
    operation: str, net: str, component: str, pin: str, hole: str, access: str, at: Point, size: str, covered: int
) -> str:
    """Return one test record; `covered` is the code of the sides under coverlay (0 to 3).

    Columns: 1-3 operation, 4-17 net, 21-26 component, 28-31 pin, 32-38 hole, 39-41 access, 42-57 place, 58-67 size,
    68-71 rotation, 73-74 covered sides.
    """
    if len(net) > NET_NAME_LENGTH:
        raise ValueError(f"net name {net!r} is longer than the {NET_NAME_LENGTH} characters of IPC-D-356A")
    dash = "-" if pin else " "
    x, y = (("-" if round(value * 1e6) < 0 else "+") + _number(abs(value), 6) for value in at)
    place = f"X{x}Y{y}"
    return f"{operation}{net:<14}   {component:<6}{dash}{pin:<4}{hole:<7}{access}{place}{size}R000 S{covered}"


def _covered(bottom_openings: tuple[Region, ...], stackup: Stackup, top_openings: tuple[Region, ...], at: Point) -> int:
    """Return the code of the covered sides: 0 none, 1 top, 2 bottom, 3 both."""
    top, bottom = has_coverlay(stackup)
    top = top and not any(_holds(region, at) for region in top_openings)
    bottom = bottom and not any(_holds(region, at) for region in bottom_openings)
    return int(top) + 2 * int(bottom)


def _holds(region: Region, at: Point) -> bool:
    """Return whether a point lies inside a region (crossing number of the outline, then of the holes)."""
    return _inside(region.outline.flattened(1e-6), at) and not any(_inside(h.flattened(1e-6), at) for h in region.holes)


def _inside(corners: list[Point], at: Point) -> bool:
    inside = False
    for a, b in pairwise(corners):
        if (a.y > at.y) != (b.y > at.y) and at.x < a.x + (at.y - a.y) / (b.y - a.y) * (b.x - a.x):
            inside = not inside
    return inside


def _number(length: float, digits: int) -> str:
    microns = round(length * 1e6)
    if not 0 <= microns < 10**digits:
        raise ValueError(f"a length of {length * 1e3:.3f} mm does not fit {digits} digits of IPC-D-356A")
    return f"{microns:0{digits}d}"
