"""Hexahedra of a bonded pad that fan out at its edges, for `elements.pad`.

The pad under the plate is a picture frame in three dimensions: an inner box, and six blocks between its faces and the
pad's. Every edge of the bonded faces is then shared by two elements of 45 degrees (by three where a rim or a skin lies
beside the plate), which can open as the bulging side swings past the board's plane; a plain grid inverts there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sitscad.record import record

Array = NDArray[np.float64]

PAD, SKIN = 1, 2
"""What an element is made of."""

BOARD, PLATE, MIDDLE, FREE = "board", "plate", "middle", "free"
"""What a face of the mesh is: glued to the board, to the rigid plate, on the plane of symmetry y = 0, or free."""


@record
class Solid:
    """A plate glued on a pad, glued on a board: widths (m) along x and y of the plate and of what reaches beyond it.

    `rim` is by how much the pad is wider than the plate to each side, `skin` how thick a film stands round the pad, its
    foot glued to the board and its upper end to the plate's sides (only without a rim). `is_round`: a disc of the first
    width, whose mesh is that of the square about it, to be rounded by who solves.
    """

    width_x: float
    width_y: float
    thickness: float
    is_round: bool = False
    rim: float = 0.0
    skin: float = 0.0


@record(eq=False)
class Mesh:
    """Corners (n, 3), hexahedra (m, 8) as bottom and top faces run round, their materials (m,), and the outer faces by
    what they are: quadrangles (k, 4).
    """

    points: np.ndarray
    elements: np.ndarray
    materials: np.ndarray
    faces: dict[str, np.ndarray]


def fanned(solid: Solid, cells: int, layers: int = 2, depth: float = 0.3, ratio: float = 0.4) -> Mesh:
    """Half of a pad (y >= 0): `cells` elements through the inner box's height, and `layers` of them in the frame, its
    thickness `depth` of the pad's, each layer's bounds `ratio` as far from the face as the one inside it.
    """
    frame = depth * min(solid.thickness, 0.5 * solid.width_x, 0.5 * solid.width_y)
    bounds = frame * np.append(ratio ** np.arange(layers), 0.0)
    half = 0.5 * np.array([solid.width_x, solid.width_y, solid.thickness])
    inner = [_lines(side - frame, solid.thickness, cells) for side in half]
    inner[1] = inner[1][inner[1] > -1e-12]
    blocks = [(_box(inner), PAD)]
    blocks += [(_frustum(inner, half, bounds, axis, sign), PAD) for axis in range(3) for sign in (-1, 1)
               if (axis, sign) != (1, -1)]  # fmt: skip
    for width, material in ((solid.rim, PAD), (solid.skin, SKIN)):
        if width:
            blocks += [(_beside(inner, half, bounds, axis, sign, _outwards(width, solid, material, cells)), material)
                       for axis, sign in ((0, -1), (0, 1), (1, 1))]  # fmt: skip
    points, elements, materials = _joined(blocks, 1e-6 * solid.thickness)
    outside = _faces(points, elements, solid)
    points = points + np.array([0.0, 0.0, half[2]])
    return Mesh(points, elements, materials, outside)


def _lines(side: float, thickness: float, cells: int) -> np.ndarray:
    # Lines of the inner box along one axis, an even number of cells, wider in the middle of a flat pad.
    count = 2 * max(1, round(0.5 * cells * min(3.0, (2.0 * side / thickness) ** 0.75)))
    if side < 0.5 * thickness * 0.99:
        count = 2 * max(1, round(0.5 * cells))
    even = np.linspace(-1.0, 1.0, count + 1)
    return side * (0.5 * even + 0.5 * np.sin(0.5 * np.pi * even))


def _box(inner: list[np.ndarray]) -> np.ndarray:
    return np.stack(np.meshgrid(*inner, indexing="ij"), axis=-1)


def _frustum(inner: list[np.ndarray], half: np.ndarray, layers: np.ndarray, axis: int, sign: int) -> np.ndarray:
    # Points (layers, n, m, 3) between a face of the inner box and that of the pad.
    grids = []
    across = [k for k in range(3) if k != axis]
    for layer in layers:
        shrink = [(half[k] - layer) / np.abs(inner[k]).max() for k in across]
        one, other = np.meshgrid(*(s * inner[k] for s, k in zip(shrink, across, strict=True)), indexing="ij")
        grid = np.empty((*one.shape, 3))
        grid[..., across[0]], grid[..., across[1]] = one, other
        grid[..., axis] = sign * (half[axis] - layer)
        grids.append(grid)
    return np.stack(grids)


def _outwards(width: float, solid: Solid, material: int, cells: int) -> np.ndarray:
    # Distances from the plate's edge, growing outwards in a rim, even in a film.
    if material == SKIN:
        return width * np.linspace(0.0, 1.0, 2 + cells // 2)
    count = max(2, round(cells * (1.0 + width / solid.thickness)))
    return width * np.linspace(0.0, 1.0, count + 1) ** 1.7


def _beside(inner: list[np.ndarray], half: np.ndarray, layers: np.ndarray, axis: int, sign: int,
            outwards: np.ndarray) -> np.ndarray:  # fmt: skip
    # A block beside the pad's outermost face: the face's own grid moved outwards, and widened with it.
    face = _frustum(inner, half, layers, axis, sign)[-1]
    other = 1 - axis
    grids = []
    for distance in outwards:
        grid = face.copy()
        grid[..., axis] += sign * distance
        grid[..., other] *= (half[other] + distance) / half[other]
        grids.append(grid)
    return np.stack(grids)


def _joined(blocks: list[tuple[np.ndarray, int]], near: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """All blocks' points (m), each once, and their elements, right-handed."""
    places = np.concatenate([block.reshape(-1, 3) for block, _ in blocks])
    _, first, numbers = np.unique(np.round(places / near).astype(np.int64), axis=0, return_index=True,
                                  return_inverse=True)  # fmt: skip
    numbers, start, elements, materials = numbers.ravel(), 0, [], []
    for block, material in blocks:
        grid = numbers[start : start + block[..., 0].size].reshape(block.shape[:3])
        start += grid.size
        corners = [_corner(grid, *place) for place in CORNERS]
        elements.append(np.stack([corner.ravel() for corner in corners], axis=1))
        materials.append(np.full(len(elements[-1]), material))
    points, hexahedra = places[first], np.concatenate(elements)
    origin = points[hexahedra[:, 0]]
    edges = [points[hexahedra[:, k]] - origin for k in (1, 3, 4)]
    turned = np.einsum("ij,ij->i", np.cross(edges[0], edges[1]), edges[2]) < 0.0
    hexahedra[turned] = hexahedra[turned][:, [4, 5, 6, 7, 0, 1, 2, 3]]
    return points, hexahedra, np.concatenate(materials)


CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
"""Where the corners of an element lie in its block, in the order in which they are told."""


def _corner(grid: np.ndarray, a: int, b: int, c: int) -> np.ndarray:
    i, j, k = grid.shape
    return grid[a : i - 1 + a, b : j - 1 + b, c : k - 1 + c]


SIDES = np.array([(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)])
"""The faces of a hexahedron, seen from outside."""


def _faces(points: np.ndarray, elements: np.ndarray, solid: Solid) -> dict[str, np.ndarray]:
    """The outer faces (n, 4; numbers of points, no unit) by what they are: BOARD, PLATE, MIDDLE or FREE."""
    quads = elements[:, SIDES].reshape(-1, 4)
    _, first, count = np.unique(np.sort(quads, axis=1), axis=0, return_index=True, return_counts=True)
    outer = quads[first[count == 1]]
    x, y, z = np.moveaxis(points[outer], 2, 0)
    near, half = 1e-6 * solid.thickness, 0.5 * solid.thickness
    reach = 0.5 * np.array([solid.width_x, solid.width_y]) + solid.skin + near
    bottom, top, middle = (z < -half + near).all(1), (z > half - near).all(1), (y < near).all(1)
    under = (np.abs(x) < reach[0]).all(1) & (y < reach[1]).all(1)
    kinds = {BOARD: bottom, PLATE: top & under, MIDDLE: middle}
    return {name: outer[which] for name, which in (kinds | {FREE: ~(bottom | (top & under) | middle)}).items()}
