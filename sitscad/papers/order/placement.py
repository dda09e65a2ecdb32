"""Where the tank capacitors on the tail stand: a table for whoever places them, in the coordinates of all files."""

from __future__ import annotations

import csv
import io

from sitscad.estimates.values import Estimates
from sitscad.fabrication.files import fabrication_path
from sitscad.layout.board import Layout
from sitscad.papers.capacitor import capacitance_text
from sitscad.units import in_mm

HEADER = ("Ref", "Val", "Package", "PosX", "PosY", "Rot", "Side")


def render(layout: Layout, estimates: Estimates | None) -> dict[str, bytes]:
    """``placement.csv`` with KiCad's columns (millimetres, degrees); nothing where the board carries no part.

    The rotation counts from a chip that lies along x with its first terminal at the left. The value is the capacitance
    that ``estimates`` chose, as in ``bom.csv``.
    """
    if not layout.capacitors:
        return {}
    value = capacitance_text(estimates.readout.capacitance if estimates is not None else None)
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(HEADER)
    for each in layout.capacitors:
        one, other = (pad.centre for pad in each.pads)
        dx, dy = other.x - one.x, other.y - one.y
        turned = (0 if dx > 0 else 180) if abs(dx) > abs(dy) else (90 if dy > 0 else 270)
        at = tuple(in_mm(place, 4, 4) for place in each.centre)
        rows.writerow([each.reference, value, each.package, *at, turned, "top"])
    return {fabrication_path(layout, "placement.csv"): text.getvalue().encode("ascii")}
