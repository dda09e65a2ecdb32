"""The thesis that the sensor comes from (Jones, Leeds: tables 6.3 and 6.4, chapters 6 and 7) against our numbers.

    python tests/validation/test_jones_response.py

prints the table of docs/thesis.md. Two round coils of 7 mm, 2 x 12 turns, 8 mm apart; targets of 0.2 mm of copper at 5
MHz. The gap of each scan is not stated there: lateral ones at 0.95 mm and vertical ones from 0.2 to 1.06 mm, from the
middle of the copper, fit best.
"""

from __future__ import annotations

import numpy as np
import pytest

from sitscad import estimate, lay_out, load_text
from sitscad.estimates.response.plate import solved_plate
from sitscad.physics.eddy.target import turned

MM, FREQUENCY = 1e-3, 5e6
SCAN_GAP, NEAR, FAR = 0.95 * MM, 0.2 * MM, 1.06 * MM
SHIFTS = np.linspace(-2.0, 2.0, 9)
TABLES = {
    "3 x 7 mm": ("rectangle", (3, 7), 0.112, 0.248, 0.002, 0.077),
    "9 x 7 mm": ("rectangle", (9, 7), 0.058, 1.212, 0.122, 1.200),
    "15 x 7 mm": ("rectangle", (15, 7), 0.163, 0.350, 0.334, 2.563),
    "9 x 5 mm": ("rectangle", (9, 5), 0.031, 1.074, 0.254, 1.147),
    "9 x 9 mm": ("rectangle", (9, 9), 0.065, 1.226, 0.026, 1.201),
}
"""Ranges in uH: L1 + L2 and L1 - L2 over dx, L1 + L2 over dy and over dz."""

SHAPES = {"8 mm square": ("square", (8, 8), 1.14, 0.60), "8 mm circle": ("circle", (8, 8), 0.95, 0.48)}
"""Section 6.3.1: L1 - L2 over dx, L1 + L2 over dz."""


def sensor(coil="circle", pitch=8.0, target="rectangle", size=(9, 7), layers=2):
    sides = f"[{size[0]}, {size[1]}]" if target == "rectangle" else f"{size[0]}"
    return load_text(
        f"sitscad: 1\nname: thesis\ncoil: {{shape: {coil}, outer_diameter: 7, turns: 12, layers: {layers}, "
        "trace_width: 100 um, trace_spacing: 100 um}\n"
        f"array: {{pattern: line, count: 2, pitch: {pitch}}}\n"
        f"target: {{shape: {target}, size: {sides}, thickness: 0.2, material: copper}}\n"
        "elastomer: {shape: square, size: 8, thickness: 2}\n"
    )


def changes(spec, gaps, moves, turns=None):
    """Change of both coils (uH) with the near face's middle `gaps` (m) over the middle of the copper, moved along x and
    y (mm) and turned about x and y (rad): (poses, 2).
    """
    coils = lay_out(spec).coils
    middle = float(np.mean([winding.z for winding in coils[0].windings]))
    places = np.column_stack([np.asarray(moves, dtype=float) * MM, middle + np.broadcast_to(gaps, len(moves))])
    angles = np.zeros((len(moves), 3)) if turns is None else np.column_stack([turns, np.zeros(len(moves))])
    tilt = (
        0.5 * np.abs(np.sin(angles[:, 1])) * spec.target.size[0]
        + 0.5 * np.abs(np.sin(angles[:, 0])) * spec.target.size[1]
    )
    lowest = float((places[:, 2] - tilt).min())
    plate = solved_plate(spec, coils, (FREQUENCY, 1.05 * FREQUENCY), None, lowest, 9.0 * MM)
    return 1e6 * np.einsum("pcc->pc", plate.changes(turned(angles), places)[0][0].real)


def ranges(spec):
    """Of L1 + L2 and L1 - L2 over dx, of L1 + L2 over dy and over dz (uH)."""
    along = changes(spec, SCAN_GAP, [(s, 0.0) for s in SHIFTS])
    across = changes(spec, SCAN_GAP, [(0.0, s) for s in SHIFTS])
    up = changes(spec, [NEAR, FAR], [(0.0, 0.0)] * 2).sum(axis=1)
    return np.ptp(along.sum(axis=1)), np.ptp(along[:, 0] - along[:, 1]), np.ptp(across.sum(axis=1)), np.ptp(up)


def tilted(about):
    """Ranges of L1 + L2 and L1 - L2 (uH) of the 8 mm square over -5 to 5 degrees, its middle at the lateral gap."""
    angles = np.zeros((11, 2))
    angles[:, about] = np.radians(np.linspace(-5.0, 5.0, 11))
    found = changes(sensor(target="square", size=(8, 8)), SCAN_GAP, [(0.0, 0.0)] * 11, angles)
    return np.ptp(found.sum(axis=1)), np.ptp(found[:, 0] - found[:, 1])


def apart(coil, pitch):
    """Inductance (uH) of a coil with the 8 mm square target 2 mm over the middle of two, `pitch` mm apart."""
    spec = sensor(coil, pitch, "square", (8, 8))
    free = 1e6 * estimate(lay_out(spec)).coils[0].winding_inductance
    return free + changes(spec, 2.0 * MM, [(0.0, 0.0)])[0, 0]


def winding(coil="circle", layers=2):
    return estimate(lay_out(sensor(coil, layers=layers))).coils[0].winding_inductance


@pytest.mark.slow
@pytest.mark.parametrize("name", TABLES)
def test_ranges_of_tables_6_3_and_6_4(name):
    """Within 4 % where the plate covers coils and the range is large; the narrow one lies 6 and 13 % low."""
    shape, size, dx_normal, dx_shear, dy_normal, dz_normal = TABLES[name]
    ours, covers = ranges(sensor(target=shape, size=size)), size[0] > 3
    assert ours[1] == pytest.approx(dx_shear, rel=0.04 if covers else 0.08)
    assert ours[0] == pytest.approx(dx_normal, abs=0.012)
    assert ours[2] == pytest.approx(dy_normal, abs=0.006)
    assert ours[3] == pytest.approx(dz_normal, rel=0.04 if covers else 0.16)


@pytest.mark.slow
def test_square_coils_and_more_layers():
    """The thesis has 12 % and 330 %: its square coils are not like ours (docs/thesis.md)."""
    assert winding("square") / winding() == pytest.approx(4.0 / np.pi, rel=0.02)
    assert winding(layers=4) / winding() == pytest.approx(3.8, abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("coil", ["square", "circle"])
def test_coils_nearer_to_each_other_and_farther(coil):
    near, usual, far = (apart(coil, pitch) for pitch in (7.1, 8.0, 10.0))
    assert -0.02 < near / usual - 1.0 < -0.005
    assert 0.01 < far / usual - 1.0 < 0.03


@pytest.mark.slow
def test_a_tilt_along_the_coils_is_read_as_shear():
    normal, shear = tilted(1)
    assert shear == pytest.approx(0.185, rel=0.12)
    assert normal < 0.03
    assert max(tilted(0)) < 0.012


def main() -> None:
    print("| what | thesis | ours |\n|---|---|---|")
    for name, (shape, size, *theirs) in TABLES.items():
        ours = ranges(sensor(target=shape, size=size))
        for what, one, other in zip(("dx normal", "dx shear", "dy normal", "dz normal"), theirs, ours, strict=True):
            print(f"| {name}, {what} (uH) | {one:.3f} | {other:.3f} |", flush=True)
    for name, (shape, size, shear, normal) in SHAPES.items():
        ours = ranges(sensor(target=shape, size=size))
        print(f"| {name}, dx shear (uH) | {shear} | {ours[1]:.2f} |")
        print(f"| {name}, dz normal (uH) | {normal} | {ours[3]:.2f} |", flush=True)
    for about, theirs in enumerate(((0.012, 0.008), (0.030, 0.185))):
        normal, shear = tilted(about)
        print(f"| 8 mm square, +-5 deg about {'xy'[about]}, normal and shear (uH) | {theirs[0]}, {theirs[1]} | "
              f"{normal:.3f}, {shear:.3f} |", flush=True)  # fmt: skip
    for coil, theirs in (("square", (-1.7, 2.3)), ("circle", (-1.6, 2.6))):
        near, usual, far = (apart(coil, pitch) for pitch in (7.1, 8.0, 10.0))
        for where, one, other in (("0.1", theirs[0], near), ("3", theirs[1], far)):
            print(f"| {coil} coils, 1 to {where} mm apart (%) | {one} | {100 * (other / usual - 1):+.1f} |", flush=True)
    print(f"| square coil over round (%) | 12 | {100 * (winding('square') / winding() - 1):.0f} |")
    print(f"| 4 layers over 2 (%) | 330 | {100 * (winding(layers=4) / winding() - 1):.0f} |")


if __name__ == "__main__":
    main()
