"""Draw the field of a coil at rest and pressed, in section.

    python docs/sensing.py templates/bench_7mm.yaml PICTURE.svg

The field lines belong to rings before a perfect conductor. The printed figures belong to the design.
"""

from __future__ import annotations

import sys

import numpy as np
from contourpy import contour_generator

import sitscad
from sitscad.basics.units import show
from sitscad.files.drawing.sheet import Pen, Sheet
from sitscad.files.drawing.svg import svg
from sitscad.kernels.electromagnetics.special_functions import coaxial_rings
from sitscad.kernels.geometry.path import Path, Point, polyline, rectangle

SIZE, MIDDLES, BOARD = (210.0, 62.0), (52.0, 158.0), 26.0
"""Size of the sheet, centres of both pictures, and height of the board's top face on the sheet (mm)."""
HALF, LOW, SCALE = 6.0, -2.3, 7.2
"""Half of the visible width and the lowest visible height (mm of the sensor); scale (mm of paper per mm)."""
TURN, THINNEST = 0.09, 0.2
"""Half the drawn width of a turn, and the smallest drawn thickness of a plate (mm)."""
FIELD, EDGE, ARROW = Pen(0.25, "#2471a3"), Pen(0.15, "#2c3e50", round_corners=False), Pen(0.9, "#c0392b")
LEVELS = np.linspace(0.1, 0.9, 7)
"""Levels of the field lines, relative to the largest flux through a ring in the board."""


NAMES = {"target": 2.9, "soft pad": 1.4, "coil on": 0.25, "its board": -0.4}
"""Labels between the pictures, with their heights (mm of the sensor)."""


def flux(turns: list[tuple[float, float]], plate: float, r: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return the flux (arbitrary unit) through a ring of radius r at z; its contours are field lines.

    The flux is the mutual inductance of the ring with every turn, and with the images of the turns behind the plate,
    which carry the opposite current. It is zero above the plate.
    """
    found = np.zeros(np.broadcast(r, z).shape)
    for radius, height in turns:
        for at, sign in ((height, 1.0), (2.0 * plate - height, -1.0)):
            apart = (r - radius) ** 2 + (z - at) ** 2
            found += sign * coaxial_rings(np.full_like(found, radius), r + 0.0 * z, np.maximum(apart, 0.03**2))
    return np.where(z > plate, 0.0, found)


def panel(sheet: Sheet, design: sitscad.Design, middle: float, newtons: float) -> None:
    """Draw one state in section: board, turns, pad, plate and field, with the readings below."""

    def at(x: float, z: float) -> Point:
        return Point(middle + x * SCALE, BOARD + z * SCALE)

    def box(x: float, half: float, low: float, high: float) -> Path:
        a, b = at(x - half, low), at(x + half, high)
        return rectangle(a.x, a.y, b.x, b.y)

    spec = design.spec
    assert spec.target is not None and spec.elastomer is not None
    read = sitscad.respond(design, loads=[(newtons, 0.0, 0.0)])
    rest = 1e3 * spec.elastomer.thickness
    gap = rest + 1e3 * float(read.poses[0, 2])
    pad, plate = 5e2 * spec.elastomer.size[0], 5e2 * spec.target.size[0]
    sheet.draw([box(0.0, pad * (rest / gap) ** 0.5, 0.0, gap)], EDGE, "#cfe4ee")
    sheet.draw([box(0.0, HALF, -1e3 * spec.fpc.stackup.thickness, 0.0)], EDGE, "#f0dfb0")
    heights = [layer.z for layer in spec.fpc.stackup.copper]
    pitch = 1e3 * (spec.coil.trace_width + spec.coil.trace_spacing)
    outermost = 5e2 * (spec.coil.size[0] - spec.coil.trace_width)
    turns = [(outermost - pitch * (i + 0.5), 1e3 * z) for i in range(int(spec.coil.turns)) for z in heights]
    r, z = np.meshgrid(np.linspace(1e-3, plate, 120), np.linspace(LOW, gap, 120))
    largest = flux(turns, rest, r, 0.0 * z).max()
    lines = contour_generator(r, z, flux(turns, gap, r, z))
    for line in (line for level in LEVELS * largest for line in lines.lines(level)):
        for side in (1.0, -1.0):
            sheet.draw([polyline([at(side * x, y) for x, y in line])], FIELD)
    for x, y in turns:
        sheet.draw([box(side * x, TURN, y - TURN / 2, y + TURN / 2) for side in (1.0, -1.0)], None, "#a04000")
    sheet.draw([box(0.0, plate, gap, gap + max(1e3 * spec.target.thickness, THINNEST))], EDGE, "#b9c2c9")
    if newtons:
        foot, head = at(0.0, gap + THINNEST + 0.15), at(0.0, gap + 1.9)
        sheet.draw([polyline([head, foot]), polyline([Point(foot.x - 1.4, foot.y + 2.4), foot,
                    Point(foot.x + 1.4, foot.y + 2.4)])], ARROW)
    told = f"{show(read.inductance.item(), 'H', 4)}, {show(read.frequency.item(), 'Hz', 4)}"
    sheet.text(middle, 5.0, f"{'pressed with ' + show(newtons, 'N') if newtons else 'at rest'}: {told}", 4.0, "middle")


def picture(spec: sitscad.SensorSpec) -> Sheet:
    """Return the sheet with both states and the labels."""
    sheet = Sheet("A press brings the target nearer, and the coil's field has less room", SIZE, decimals=2)
    design = sitscad.Design(spec)
    for middle, newtons in zip(MIDDLES, (0.0, spec.requirements.normal_force), strict=True):
        panel(sheet, design, middle, newtons)
    for name, height in NAMES.items():
        sheet.text(sum(MIDDLES) / 2, BOARD + height * SCALE, name, 3.6, "middle")
    return sheet


if __name__ == "__main__":
    spec, target = sys.argv[1:]
    with open(target, "w", encoding="utf-8") as file:
        file.write(svg(picture(sitscad.load(spec))))
