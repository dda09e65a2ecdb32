"""The tank capacitor that was chosen, as the list of parts and the table of places name it."""

from __future__ import annotations

import math

from sitscad.units import show


def capacitance_text(chosen: float | None) -> str:
    """The tank capacitor's value (F) for people, where one was found."""
    return show(chosen, "F") if chosen is not None and math.isfinite(chosen) else "none found"
