"""Pass a coil to a field program as polylines, and compute its field by Biot and Savart's law.

    python docs/examples/field.py [SPEC]

The field program is twenty lines of numpy. The script compares two results with sitscad's estimate: the mutual
inductance of neighbouring coils, and the inductance of one coil. Both use Neumann's integral over filaments. For one
coil, the filaments are separated by the mean distance between points of the copper's cross-section.
"""

import sys
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

import sitscad

Array = NDArray[np.float64]
MU0 = 4e-7 * np.pi


def field(paths: tuple[sitscad.CurrentPath, ...], places: Array) -> Array:
    """Return the flux density (n, 3; T) at places (n, 3; m) of straight current segments (Biot and Savart)."""
    found = np.zeros_like(places)
    for path in paths:
        for start, end in pairwise(path.points):
            a, b = places - start, places - end
            cross = np.cross(a, b)
            la, lb = np.linalg.norm(a, axis=1), np.linalg.norm(b, axis=1)
            along = la * lb + np.einsum("ij,ij->i", a, b)
            found += (MU0 * path.current / (4.0 * np.pi) * (la + lb) / (la * lb * along))[:, None] * cross
    return found


def neumann(one: Array, other: Array, apart: float = 0.0) -> float:
    """Return Neumann's double integral (H) of two polylines (n, 3; m) whose filaments are separated by `apart` (m)."""
    middles, steps = ([0.5 * (p[1:] + p[:-1]), np.diff(p, axis=0)] for p in (one, other))
    total = 0.0
    for place, step in zip(*middles, strict=True):
        distance = np.sqrt(np.sum((steps[0] - place) ** 2, axis=1) + apart**2)
        total += float(np.sum(steps[1] @ step / distance))
    return MU0 / (4.0 * np.pi) * total


def cut(points: Array, longest: float) -> Array:
    """Return the polyline with segments no longer than `longest` (m)."""
    rows = [points[:1]]
    for a, b in pairwise(points):
        count = max(1, int(np.ceil(np.linalg.norm(b - a) / longest)))
        rows.append(a + (b - a) * np.arange(1, count + 1)[:, None] / count)
    return np.vstack(rows)


def inductances(layout: sitscad.Layout) -> tuple[float, float]:
    """Return the inductance of the first coil and its mutual inductance with the second (H), by filaments."""
    paths = sitscad.current_paths(layout, leads=False, tolerance=2e-7)
    lines = {(line.coil, line.layer): line for line in sitscad.centre_lines(layout)}
    first, second = (coil.name for coil in layout.coils[:2])
    own = mutual = 0.0
    for one in (path for path in paths if path.coil == first):
        track = lines[one.coil, one.layer or 0]
        mean_distance = 0.2235 * (track.width + track.thickness)
        for other in paths:
            fine = [cut(path.points, 0.3 * mean_distance if other.coil == first else 60e-6) for path in (one, other)]
            found = neumann(*fine, apart=mean_distance if other is one else 0.0)
            own += found if other.coil == first else 0.0
            mutual += found if other.coil == second else 0.0
    return own, mutual


def main() -> dict[str, float]:
    """Print both results beside the estimate."""
    spec = sitscad.load(sys.argv[1] if len(sys.argv) > 1 else "templates/grasper_3p5mm.yaml")
    layout = sitscad.lay_out(spec)
    own, mutual = inductances(layout)
    estimates = sitscad.estimate(layout)
    x, y = layout.coils[0].centre
    above = np.array([[x, y, z * 1e-3] for z in (0.5, 1.0, 2.0)])
    flux = field(tuple(path for path in sitscad.current_paths(layout, current=1e-3) if path.coil == "C1"), above)
    for place, value in zip(above, flux, strict=True):
        print(f"1 mA in C1, {place[2] * 1e3:g} mm above it: {value[2] * 1e6:.2f} uT upwards")
    matrix = estimates.inductance_matrix
    for name, ours, theirs in (("C1", matrix[0][0], own), ("C1 and C2", matrix[0][1], mutual)):
        print(f"{name}: {ours * 1e9:.3f} nH by sitscad, {theirs * 1e9:.3f} nH by filaments")
    return {"own": own, "mutual": mutual, "own_here": matrix[0][0], "mutual_here": matrix[0][1],
            "field_T": float(flux[1, 2])}


if __name__ == "__main__":
    main()
