"""Sequence of bonding, drilling, plating and etching for a board of several copper layers."""

from __future__ import annotations

from itertools import pairwise

from sitscad.basics.units import show
from sitscad.layout.board import Layout
from sitscad.spec.circuit import Plating, StackLayer, Stackup
from sitscad.spec.presets import is_rigid


def tail_holes(layout: Layout) -> int:
    """Return the number of holes that end above the last copper layer. The tail then has fewer layers than the body."""
    return sum(layout.lowest_layer(via) < layout.copper_layers for via in layout.vias)


def cores(stackup: Stackup) -> list[list[int]]:
    """Return the copper layers (numbers from 1) of each laminate in a stack-up, the uppermost laminate first.

    Layers belong to one laminate if no bonding film lies between them.
    """
    laminates = [[1]]
    for upper, lower in pairwise(layer.number for layer in stackup.copper):
        if is_bonded(stackup.between(upper, lower)):
            laminates.append([lower])
        else:
            laminates[-1].append(lower)
    return laminates


def is_bonded(films: tuple[StackLayer, ...]) -> bool:
    """Whether the films between two copper layers are added when laminates are bonded.

    False for the single film inside a laminate.
    """
    return len(films) != 1 or films[0].material == "bondply"


def lamination_text(layout: Layout) -> str:
    """Return the fabrication steps of a flexible board with several laminates, or with fewer layers in the tail.

    Empty for other boards.
    """
    last, count, stackup = layout.spec.fpc.tail_copper, layout.copper_layers, layout.spec.fpc.stackup
    if is_rigid(stackup) or (last == count and len(cores(stackup)) == 1):
        return ""

    def thickened(layer: int) -> str:
        plated = show(stackup.plating_thickness, "m")
        in_pads = stackup.plating is Plating.BUTTONS
        return f"{plated} in holes and pads alone" if in_pads else f"copper 1 and {layer} get {plated}"

    def bonds(first: int, end: int) -> str:
        pairs = pairwise(range(first, end + 1))
        return ", ".join(f"copper {a} to {b}" for a, b in pairs if b == last + 1 or is_bonded(stackup.between(a, b)))

    def made(first: int, end: int) -> str:
        """Describe copper layers that are bonded with each other. The inner layers are etched before."""
        numbers = f"copper {first} to {end}" if end > first else f"copper {first}"
        inner = bonds(first, end)
        if not inner:
            return f"{numbers} on a core of its own"
        etched = ", ".join(map(str, range(first + 1, end)))
        return f"{numbers} on their cores, copper {etched} etched on them, bonded in one lamination ({inner})"

    closing = (
        f"holes drilled and plated through all layers ({thickened(count)}), the outer copper etched, the outer "
        "coverlay laid"
    )
    if last == count:
        return f"one lamination. {made(1, count)[0].upper()}{made(1, count)[1:]}; then {closing}"
    first = [made(1, last)]
    if tail_holes(layout):
        first.append(f"the tail's holes drilled there and plated ({thickened(last)})")
    first.append(f"copper {last} etched" if last > 1 else "nothing of it etched yet")
    first += ["the tail's own coverlay laid"] * layout.spec.fpc.has_tail_coverlay
    lower, etched = f"copper {last + 1}", ""
    if last + 1 < count:
        numbers = ", ".join(map(str, range(last + 1, count)))
        lower, etched = f"copper {last + 1} to {count}", f" with copper {numbers} etched on its cores"
    many = "three" if bonds(1, last) else "two"
    return (
        f"{many} laminations. First {', '.join(first)}; then {lower}{etched}, cut out where the tail is, bonded under "
        f"it in one lamination ({bonds(last, count)}); then the body's {closing}"
    )
