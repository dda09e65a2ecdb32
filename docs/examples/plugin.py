"""A plugin with a rule of a laboratory, and with a file for its field program.

sitscad check sensor.yaml --plugin docs/examples/plugin.py
sitscad build sensor.yaml --plugin docs/examples/plugin.py
"""

import json
from collections.abc import Iterator

import sitscad

LONGEST = 0.5
"""Longest track (m) that our coil winder winds without a pause."""


def track_length(design: sitscad.Design) -> Iterator[sitscad.Violation]:
    """Yield a finding for each coil whose track is too long."""
    for coil in design.layout.coils:
        length = sum(winding.path.length for winding in coil.windings)
        if length > LONGEST:
            message = (
                f"the track of {coil.name} is {length * 1e3:.0f} mm long; the winder stops at {LONGEST * 1e3:.0f} mm"
            )
            yield sitscad.Violation(message, key="coil.turns", measured=length, limit=LONGEST, unit="m")


def filaments(layout: sitscad.Layout, estimates: sitscad.Estimates) -> dict[str, bytes]:
    """Return a file with the layers of the coils as polylines (m) and their inductance (H)."""
    coils = [
        {
            "name": estimate.name,
            "inductance_H": estimate.winding_inductance,
            "layers_m": [
                line.points(1e-5).round(9).tolist()
                for line in sitscad.centre_lines(layout)
                if line.coil == estimate.name
            ],
        }
        for estimate in estimates.coils
    ]
    return {"field/filaments.json": json.dumps(coils, indent=1).encode()}


RULES = (
    sitscad.Rule(
        id="LAB001",
        name="winder-track",
        severity=sitscad.Severity.WARNING,
        summary="A coil's track must not be longer than our winder's limit.",
        why="The winder stops to be refilled, and the joint increases the resistance.",
        mend="Use fewer turns or layers.",
        source="our winder's manual, page 12",
        apply=track_length,
    ),
)

WRITERS = (sitscad.Writer("filaments", "", "report", ("layout", "estimates"), function=filaments),)
