"""The list of places that a panel comes with: what its frame, its cuts and its copies are held against."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sitscad.extraction.artwork import ExtractionError
from sitscad.record import record

Place = tuple[int, int]

LARGEST = 1e4
"""No panel is so large (mm)."""


@record
class PanelList:
    """Where everything on a panel is to be. Lengths in nanometres, from the panel's lower left corner.

    ``boards`` and ``coupons`` are how far the origin of each copy is moved; ``bridges`` and ``coupon_bridges`` are the
    two ends of every place where the cut round a copy stops, from that origin.
    """

    size: Place
    boards: tuple[Place, ...]
    coupons: tuple[Place, ...]
    bridges: tuple[tuple[Place, Place], ...]
    coupon_bridges: tuple[tuple[Place, Place], ...]
    tooling_holes: tuple[Place, ...]
    tooling_hole: int
    fiducials: tuple[Place, ...]
    fiducial: int
    fiducial_opening: int


def read_panel_list(panel: Path) -> PanelList:
    """The one list of a panel's folder. Raises ExtractionError where there is none, several, or it cannot be read."""
    lists = sorted(panel.glob("*.json"))
    if len(lists) != 1:
        raise ExtractionError(f"the panel has {len(lists)} lists of places, where one is expected")
    try:
        document = json.loads(lists[0].read_text(encoding="utf-8"))
        if document["unit"] != "mm":
            raise ValueError("its unit is not mm")
        found = PanelList(
            size=_place(document["size"]),
            boards=_places(document["parts"]),
            coupons=_places(document["coupons"]),
            bridges=_bridges(document["bridges"]),
            coupon_bridges=_bridges(document["coupon_bridges"]),
            tooling_holes=_places(document["tooling_holes"]),
            tooling_hole=_length(document["tooling_hole_diameter"]),
            fiducials=_places(document["fiducials"]),
            fiducial=_length(document["fiducial_diameter"]),
            fiducial_opening=_length(document["fiducial_opening"]),
        )
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError) as error:
        raise ExtractionError(f"{lists[0].name} is no list of places: {type(error).__name__}: {error}") from error
    if not found.boards:
        raise ExtractionError(f"{lists[0].name} names no board")
    return found


def _length(millimetres: Any) -> int:
    found = float(millimetres)
    if not abs(found) < LARGEST:
        raise ValueError(f"{found:g} mm is no place on a panel")
    return round(found * 1e6)


def _place(values: Sequence[Any]) -> Place:
    x, y = values
    return _length(x), _length(y)


def _places(values: Sequence[Any]) -> tuple[Place, ...]:
    return tuple(map(_place, values))


def _bridges(values: Sequence[Any]) -> tuple[tuple[Place, Place], ...]:
    return tuple((_place(begin), _place(end)) for begin, end in values)
