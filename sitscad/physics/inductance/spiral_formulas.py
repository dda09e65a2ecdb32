"""Closed formulas for single-layer planar spirals: Mohan, Hershenson, Boyd, Lee, IEEE JSSC 34(10), 1999, 1419-1424.

Fits to a field solver for on-chip spirals, 1 to 20 turns, track spacing up to three widths. They are cross-checks: for
several layers they need a coupling factor that nobody has for flexible circuits, so k = 1 is an upper bound.
"""

from __future__ import annotations

import math

from sitscad.physics.constants import MU0
from sitscad.record import record


@record
class SheetCoefficients:
    """Constants of the current-sheet formula (c1..c4), of the modified Wheeler formula (K1, K2), of the monomial fit.

    The monomial's are (beta, a1..a5) for lengths in micrometres and nanohenries. None where the paper tabulates none.
    """

    sheet: tuple[float, float, float, float]
    wheeler: tuple[float, float] | None
    monomial: tuple[float, float, float, float, float, float] | None


COEFFICIENTS: dict[int, SheetCoefficients] = {
    4: SheetCoefficients((1.27, 2.07, 0.18, 0.13), (2.34, 2.75), (1.62e-3, -1.21, -0.147, 2.40, 1.78, -0.030)),
    6: SheetCoefficients((1.09, 2.23, 0.00, 0.17), (2.33, 3.82), (1.28e-3, -1.24, -0.174, 2.47, 1.77, -0.049)),
    8: SheetCoefficients((1.07, 2.29, 0.00, 0.19), (2.25, 3.55), (1.33e-3, -1.21, -0.163, 2.43, 1.75, -0.049)),
    0: SheetCoefficients((1.00, 2.46, 0.00, 0.20), None, None),
}
"""By the number of sides; 0 is the circle."""


@record
class SpiralOutline:
    """What the closed formulas know of a layer: turns, outer diameter across copper edges, width, spacing (m)."""

    turns: float
    outer_diameter: float
    width: float
    spacing: float

    @property
    def inner_diameter(self) -> float:
        """d_in = d_out - 2 n w - 2 (n - 1) s, as the paper defines it (m)."""
        return self.outer_diameter - 2.0 * self.turns * self.width - 2.0 * (self.turns - 1.0) * self.spacing

    @property
    def mean_diameter(self) -> float:
        """d_avg = (d_out + d_in) / 2 (m)."""
        return 0.5 * (self.outer_diameter + self.inner_diameter)

    @property
    def fill(self) -> float:
        """Rho = (d_out - d_in) / (d_out + d_in), no unit."""
        return (self.outer_diameter - self.inner_diameter) / (self.outer_diameter + self.inner_diameter)

    @property
    def is_covered(self) -> bool:
        """Whether the outline lies where the fits were made: 1 to 20 turns, s <= 3 w, fill 0.1 to 0.9."""
        return 1.0 <= self.turns <= 20.0 and self.spacing <= 3.0 * self.width and 0.1 <= self.fill <= 0.9


def current_sheet(sides: int, outline: SpiralOutline) -> float:
    """Equation (4): mu0 n^2 d_avg c1 / 2 (ln(c2/rho) + c3 rho + c4 rho^2) (H); KeyError for other sides."""
    c1, c2, c3, c4 = COEFFICIENTS[sides].sheet
    rho = outline.fill
    bracket = math.log(c2 / rho) + c3 * rho + c4 * rho * rho
    return 0.5 * MU0 * outline.turns**2 * outline.mean_diameter * c1 * bracket


def modified_wheeler(sides: int, outline: SpiralOutline) -> float | None:
    """Equation (1): K1 mu0 n^2 d_avg / (1 + K2 rho) (H); None where the paper gives no constants."""
    constants = COEFFICIENTS[sides].wheeler
    if constants is None:
        return None
    return constants[0] * MU0 * outline.turns**2 * outline.mean_diameter / (1.0 + constants[1] * outline.fill)


def monomial(sides: int, outline: SpiralOutline) -> float | None:
    """Equation (5): beta d_out^a1 w^a2 d_avg^a3 n^a4 s^a5 (um, nH), in henries; None without constants."""
    constants = COEFFICIENTS[sides].monomial
    if constants is None:
        return None
    beta, a1, a2, a3, a4, a5 = constants
    um = 1e6
    return 1e-9 * (beta * (outline.outer_diameter * um) ** a1 * (outline.width * um) ** a2
                   * (outline.mean_diameter * um) ** a3 * outline.turns**a4 * (outline.spacing * um) ** a5)  # fmt: skip
