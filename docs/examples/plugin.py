"""A plugin: a rule of one's own laboratory, and a file that its field program reads.

sitscad check sensor.yaml --plugin docs/examples/plugin.py
sitscad build sensor.yaml --plugin docs/examples/plugin.py
"""

import json
from collections.abc import Iterator

import sitscad

LONGEST = 0.5
"""Track (m) that our coil winder can follow without a pause."""


def track_length(design: sitscad.Design) -> Iterator[sitscad.Violation]:
    """A complaint about each coil whose track is too long; a rule may look at all that a design has."""
    for coil in design.layout.coils:
        length = sum(winding.path.length for winding in coil.windings)
        if length > LONGEST:
            message = (
                f"the track of {coil.name} is {length * 1e3:.0f} mm long; the winder stops at {LONGEST * 1e3:.0f} mm"
            )
            yield sitscad.Violation(message, key="coil.turns", measured=length, limit=LONGEST, unit="m")


def filaments(layout: sitscad.Layout, estimates: sitscad.Estimates) -> dict[str, bytes]:
    """The coils' layers as polylines with their inductance, in metres and henries."""
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
        summary="A coil's track is no longer than our winder can follow.",
        why="It stops to be filled again, and the joint is seen in the resistance.",
        mend="Fewer turns or layers.",
        source="our winder's manual, page 12",
        apply=track_length,
    ),
)

WRITERS = (sitscad.Writer("filaments", "", "report", ("layout", "estimates"), function=filaments),)
