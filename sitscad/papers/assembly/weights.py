"""What the assembly weighs, piece by piece: ``mount/assembly.json``."""

from __future__ import annotations

import json
from typing import Any

from sitscad.layout.board import Layout
from sitscad.parts.solid import Solid
from sitscad.parts.whole.mass import Balance, Weight, balance, weigh
from sitscad.scene.tail_path import tail_path


def render(layout: Layout, solids: tuple[Solid, ...]) -> dict[str, bytes]:
    """The JSON, in kilograms, metres and cubic metres, axes as in ``mount/assembly.step``."""
    weights = weigh(layout, solids)
    sensor = tuple(weight for weight in weights if not weight.is_carrier)
    path = tail_path(layout)
    document = {
        "axes": "x along the jaw towards the handle, y across, z = 0 at the board's top face, metres",
        "sensor": _balance(balance(sensor)),
        "with_jaws": _balance(balance(weights)),
        "tail_drawn_straight_because": path.reason if path is not None and path.reason else None,
        "pieces": [_piece(weight) for weight in weights],
    }
    return {"mount/assembly.json": (json.dumps(document, indent=1) + "\n").encode("utf-8")}


def _balance(found: Balance) -> dict[str, Any]:
    return {
        "mass_kg": _rounded(found.mass, 12),
        "centre_m": [_rounded(value, 9) for value in found.centre],
        "not_weighed": list(found.unknown),
    }


def _piece(weight: Weight) -> dict[str, Any]:
    """One piece as plain values for JSON, rounded."""
    return {
        "name": weight.name,
        "is_carrier": weight.is_carrier,
        "material": weight.material,
        "volume_m3": _rounded(weight.volume, 16),
        "share_of_volume": _rounded(weight.share, 6),
        "copper_m3": _rounded(weight.copper, 16),
        "density_kg_per_m3": weight.density,
        "mass_kg": None if weight.mass is None else _rounded(weight.mass, 12),
        "centre_m": [_rounded(value, 9) for value in weight.centre],
        "density_source": weight.source,
    }


def _rounded(value: float, digits: int) -> float:
    """What lies below is the kernel's rounding, and differs between machines."""
    return round(value, digits) + 0.0
