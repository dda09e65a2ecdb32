"""How each printed piece is made, and whether its process makes it: ``mount/print.json``."""

from __future__ import annotations

import json

from sitscad.parts.printable import as_json, printable
from sitscad.parts.solid import Solid, of_role
from sitscad.scene.bodies import BodyRole
from sitscad.scene.column import print_limit
from sitscad.spec.sensor import SensorSpec

FIGURES = ("wall", "free_wall", "hole", "clearance", "pin", "groove")


def render(solids: tuple[Solid, ...], aids: tuple[Solid, ...], spec: SensorSpec) -> dict[str, bytes]:
    """The measured pieces of mount, jig and moulds with their process's limits; nothing without a mount."""
    if spec.mount is None:
        return {}
    process = spec.mount.process
    pieces = [printable(piece, process) for piece in (*of_role(solids, BodyRole.MOUNT), *aids)]
    limits = {figure: print_limit(process, figure) for figure in FIGURES}
    document = {
        "process": process,
        "limits_m": {name: limit.value for name, limit in limits.items()},
        "sources": {name: limit.source for name, limit in limits.items()},
        "can_be_made": not any(piece.faults for piece in pieces),
        "pieces": [as_json(piece, process) for piece in pieces],
    }
    return {"mount/print.json": (json.dumps(document, indent=1) + "\n").encode("utf-8")}
