"""The soft pad under load: a bonded rubber block, its shape factor and its compression. SI units throughout."""

from __future__ import annotations

import math

from sitscad.record import record

VALID_STRAIN = 0.30
"""Compressive strain up to which the bonded-block formula is trusted; beyond it the answer is an extrapolation."""

SHAPE_COEFFICIENT = 2.0
"""beta in Ea = E (1 + beta S^2) for square, round and moderately oblong unfilled rubber (Gent & Lindley 1959)."""

SOURCE = (
    "Gent & Lindley 1959 (cited in Strojniski vestnik 60 (2014) 506): Ea = E(1 + 2 S^2), 1/Ea = "
    "1/[E(1 + 2 S^2)] + 1/B; "
    "large strain F = (Ea A/3)(1/lambda^2 - lambda) (Lindley; from memory, unverified)"
)


@record
class Compression:
    """A pad under a force: engineering strain (0 to 1), the thickness that is left (m), the shape factor, the apparent
    modulus (Pa), and whether the strain lies where the formula is trusted; `note` says so in words.
    """

    strain: float
    gap: float
    shape_factor: float
    apparent_modulus: float
    valid: bool
    note: str


def loaded_area(width_x: float, width_y: float, circular: bool = False) -> float:
    """Loaded area (m2) of a rectangular pad, or of an elliptic one (a disc when both widths are its diameter)."""
    return (math.pi / 4.0 if circular else 1.0) * width_x * width_y


def shape_factor(width_x: float, width_y: float, thickness: float, circular: bool = False) -> float:
    """Loaded area over force-free area: ab/(2h(a + b)) for a rectangle, d/(4h) for a disc (dimensionless)."""
    if circular:
        return loaded_area(width_x, width_y, True) / (_ellipse_perimeter(width_x, width_y) * thickness)
    return width_x * width_y / (2.0 * thickness * (width_x + width_y))


def apparent_modulus(shape: float, shear_modulus: float, bulk_modulus: float = math.inf) -> float:
    """Compression modulus (Pa) of a bonded block: 1/Ea = 1/[3 mu (1 + 2 S^2)] + 1/B (Gent & Lindley 1959)."""
    incompressible = 3.0 * shear_modulus * (1.0 + SHAPE_COEFFICIENT * shape * shape)
    return 1.0 / (1.0 / incompressible + 1.0 / bulk_modulus)


def compress(
    width_x: float,
    width_y: float,
    thickness: float,
    shear_modulus: float,
    bulk_modulus: float,
    force: float,
    circular: bool = False,
) -> Compression:
    """How far a bonded pad gives way under a normal force.

    Widths and thickness in metres, moduli in pascals, force in newtons (0 or more, compressive). The stretch lambda
    solves F = (Ea A/3)(1/lambda^2 - lambda) (Lindley), which is F = Ea A e for small strains e = 1 - lambda and the
    neo-Hookean bar for slender pads. Raises ValueError for sizes or moduli that are not positive or a negative force.
    """
    if not all(value > 0.0 for value in (width_x, width_y, thickness, shear_modulus, bulk_modulus)):
        raise ValueError("a pad needs positive widths, thickness and moduli")
    if not force >= 0.0:
        raise ValueError("the compressive force must be 0 or more")
    shape = shape_factor(width_x, width_y, thickness, circular)
    modulus = apparent_modulus(shape, shear_modulus, bulk_modulus)
    load = force / (modulus * loaded_area(width_x, width_y, circular))
    strain = _strain(load)
    valid = strain <= VALID_STRAIN
    return Compression(strain, thickness * (1.0 - strain), shape, modulus, valid, _note(strain, valid))


def force_for_strain(
    strain: float,
    width_x: float,
    width_y: float,
    thickness: float,
    shear_modulus: float,
    bulk_modulus: float,
    circular: bool = False,
) -> float:
    """The force (N) that compresses the pad by an engineering strain (0 to below 1): the inverse of `compress`."""
    if not 0.0 <= strain < 1.0:
        raise ValueError("a compressive strain lies from 0 to below 1")
    shape = shape_factor(width_x, width_y, thickness, circular)
    modulus = apparent_modulus(shape, shear_modulus, bulk_modulus)
    stretch = 1.0 - strain
    return modulus * loaded_area(width_x, width_y, circular) / 3.0 * (stretch**-2 - stretch)


def _strain(load: float) -> float:
    """Strain that solves (lambda^-2 - lambda)/3 = load (dimensionless), to rounding.

    The unknown is e = 1 - lambda itself, so small loads lose no digits: g(e) = e (3 - 3e + e^2) - 3 load (1 - e)^2 = 0
    rises on [0, 1], bends at most once, and is bracketed: Newton, safeguarded by bisection.
    """
    low, high = 0.0, 1.0
    strain = min(load, 0.5)
    for _ in range(80):
        value = strain * (3.0 - 3.0 * strain + strain * strain) - 3.0 * load * (1.0 - strain) ** 2
        low, high = (strain, high) if value < 0.0 else (low, strain)
        slope = 3.0 * (1.0 - strain) ** 2 + 6.0 * load * (1.0 - strain)
        step = strain - value / slope if slope > 0.0 else 0.5 * (low + high)
        step = step if low <= step <= high else 0.5 * (low + high)
        if abs(step - strain) <= 1e-16 + 1e-15 * strain:
            return step
        strain = step
    return strain


def _note(strain: float, valid: bool) -> str:
    """What to think of the number."""
    if valid:
        return "bonded block (Gent & Lindley), within its range"
    return (
        f"extrapolated: {100.0 * strain:.0f} % strain is beyond the {100.0 * VALID_STRAIN:.0f} % "
        "up to which the bonded-block formula is trusted"
    )


def _ellipse_perimeter(a: float, b: float) -> float:
    """Perimeter (m) of an ellipse with diameters a and b; exact for a circle (Ramanujan 1914, error below 5e-4)."""
    h = ((a - b) / (a + b)) ** 2
    return math.pi / 2.0 * (a + b) * (1.0 + 3.0 * h / (10.0 + math.sqrt(4.0 - 3.0 * h)))
