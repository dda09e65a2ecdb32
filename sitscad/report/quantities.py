"""Numbers as estimate and report print them."""

from __future__ import annotations

import math

from sitscad.units import show

NONE = "-"


def quantity(value: float | None, unit: str, digits: int = 4) -> str:
    """A number with its unit, or a dash for what is absent or not finite."""
    return show(value, unit, digits) if value is not None and math.isfinite(value) else NONE


def plus_minus(value: float, sigma: float | None, unit: str, per: str = "", digits: int = 3) -> str:
    """A number and one sigma of it, in the number's unit unless sigma is far below it: ``1.15 +- 0.087 mm``."""
    shown = quantity(value, unit, digits)
    if sigma is None or not math.isfinite(sigma) or shown == NONE:
        return shown + (per if shown != NONE else "")
    number, _, name = shown.partition(" ")
    scatter, _, other = quantity(sigma, unit, 2).partition(" ")
    if name == other:
        return f"{number} +- {scatter} {name}{per}"
    if sigma < 0.01 * abs(value) or not float(number):
        return f"{shown}{per} +- {scatter} {other}{per}"
    scale = 10.0 ** round(math.log10(float(number) / value))
    return f"{number} +- {float(f'{sigma * scale:.2g}'):.7g} {name}{per}"
