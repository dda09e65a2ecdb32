"""How far each method's winding inductance can be from the truth: bounds fitted to converged volume integrals.

The relative error of a method grows with how crowded, wide, thick and near each other the tracks are, each by some
power: its bound is a product of such powers. The powers are data, `sitscad/data/inductance_bounds.csv`, fitted to
random designs of every shape (`tests/validation/fit_bounds.py`) so that the bound lies above every error by a margin.
"""

from __future__ import annotations

import math
from functools import cache
from itertools import pairwise

from sitscad.data import rows
from sitscad.geometry.shapes import nearest_sides
from sitscad.record import record

FEW_TURNS, ONE_TURN = 5.0, 1.5  # Below so many turns errors grow faster, and again below so many
STACKED, WIDE_STACKED = 3.0, 12.0  # So do they where tracks are so many times as wide as the layers are apart
CROWDED = 0.1  # And where they are so wide against the inner radius
THICK = 4e-4  # Added for each time that a track is thicker than wide: the designs that were fitted are not


LEAST = 1e-6
"""No bound is below this: of narrow tracks in many turns a fit may promise more than its references are good for."""


@record
class Crowding:
    """What the error of a winding's inductance depends on; lengths in metres, `apart` between nearest mid-planes.

    `sides` are those of a polygon (0: round, or with round ends where it `is_long`), `corner_radius` 0 for sharp ones.
    """

    turns: float
    width: float
    pitch: float
    thickness: float
    inner_radius: float
    size: float
    heights: tuple[float, ...]
    corner_radius: float = 0.0
    sides: int = 0
    is_long: bool = False

    @property
    def apart(self) -> float:
        """Distance (m) of the nearest layers' mid-planes; infinite for one layer."""
        heights = sorted(self.heights)
        return min((b - a for a, b in pairwise(heights)), default=math.inf)

    def features(self) -> dict[str, float]:
        """Logarithms of what a bound is a product of powers of, by the columns of the table."""
        few = max(0.0, math.log(FEW_TURNS / self.turns))
        inner = math.log(self.width / self.inner_radius)
        found = {
            "constant": 1.0,
            "inner": inner,
            "crowded": max(0.0, inner - math.log(CROWDED)),
            "fill": math.log(self.width / self.pitch),
            "aspect": math.log(min(1.0, self.thickness / self.width)),
            "size": math.log(self.width / self.size),
            "turns": -math.log(self.turns),
            "few": few,
            "one": max(0.0, math.log(ONE_TURN / self.turns)),
        }
        if len(self.heights) > 1:
            near = math.log(self.width / self.apart)
            stacked = max(0.0, near - math.log(STACKED))
            found |= {
                "near": near,
                "layers": math.log(len(self.heights)),
                "stacked": stacked,
                "stacked_few": stacked * few,
                "wide_stacked": max(0.0, near - math.log(WIDE_STACKED)),
            }
        if self.corner_radius:
            found["corner"] = math.log(self.corner_radius / self.width)
        return found


def error_bound(method: str, crowding: Crowding) -> float:
    """Relative error that a method does not exceed. Of a polygon whose number of sides was not fitted, the larger of
    the bounds of those with fewer and with more, `UNFITTED` times: the corner's angle lies between theirs.

    Raises KeyError where the table has no such method for the outline.
    """
    features, stack = crowding.features(), "one" if len(crowding.heights) == 1 else "more"
    table, fitted = _bounds()
    outlines, margin = [ROUNDED], 1.0
    if not crowding.corner_radius:
        outlines = [outline_key(sides, crowding.is_long) for sides in nearest_sides(fitted, crowding.sides)]
        margin = 1.0 if crowding.sides in fitted else UNFITTED
    products = [math.exp(math.fsum(table[outline, method, stack][name] * value for name, value in features.items()))
                for outline in outlines]
    return margin * max(*products, LEAST) + THICK * max(0.0, crowding.thickness / crowding.width - 1.0)


@cache
def _bounds() -> tuple[dict[tuple[OutlineKey, str, str], dict[str, float]], frozenset[int]]:
    """The fitted bounds by outline, method and stack, and the sides of the sharp polygons among them."""
    table = {
        ((row["sides"], row["long"], row["rounded"]), row["method"], row["stack"]): {
            name: float(value or 0.0) for name, value in row.items() if name not in NAMES
        }
        for row in rows("inductance_bounds")
    }
    return table, frozenset(int(sides) for (sides, _, rounded), _, _ in table if rounded == "no")


UNFITTED = 5.0
"""Of pentagons, with which this was tried, one of 40 exceeded the larger bound by a factor of 3.05, the others kept it
(the volume integral, as for those that were fitted)."""

OutlineKey = tuple[str, str, str]
"""Sides, whether it is long, whether its corners are rounded, as the table writes them."""

ROUNDED: OutlineKey = ("any", "any", "yes")


def outline_key(sides: int, is_long: bool) -> OutlineKey:
    """How the table writes an outline with sharp corners or none."""
    return str(sides), "yes" if is_long else "no", "no"


NAMES = ("sides", "long", "rounded", "method", "stack", "status", "source")
