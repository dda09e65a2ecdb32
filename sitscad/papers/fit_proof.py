"""What was measured on the solids of the closed pair: ``mount/fit.json``. Pieces in each other stop a build."""

from __future__ import annotations

import json

from sitscad.layout.board import Layout
from sitscad.parts.proof import require_proof


def render(layout: Layout) -> dict[str, bytes]:
    """The proof as JSON, in metres; nothing without a jaw. Raises `PartsError` where pieces stand in each other."""
    proof = require_proof(layout)
    if proof is None:
        return {}
    document = {
        "closed_pair_radius_m": _rounded(proof.radius),
        "closed_pair_radius_from_figures_m": _rounded(proof.plane_radius),
        "port_radius_m": proof.port_radius,
        "fits": proof.fits,
        "opened_rad": proof.opened,
        "interferences": [],
        "clearances": [{"first": c.first, "second": c.second, "gap_m": _rounded(c.gap)} for c in proof.clearances],
    }
    return {"mount/fit.json": (json.dumps(document, indent=1) + "\n").encode("ascii")}


def _rounded(length: float) -> float:
    """To a nanometre: what lies below is the kernel's, and differs between machines."""
    return round(length, 9) + 0.0
