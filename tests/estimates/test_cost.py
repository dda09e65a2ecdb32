"""What an estimate holds in memory at a time: it does not grow with the square of the turns."""

from __future__ import annotations

import tracemalloc

from sitscad.estimates import estimate
from sitscad.layout import lay_out
from sitscad.spec.load import load_text

SPEC = """
sitscad: 1
name: cost
coil: {shape: racetrack, outer_diameter: [12, 8], turns: 12, layers: 4, trace_width: 0.1, trace_spacing: 0.1}
"""


def test_many_turns_take_a_bounded_amount_of_memory():
    """The field along 48 turns with 2,700 chords was worked out for all places at once: 95 MB."""
    layout = lay_out(load_text(SPEC, "cost.yaml"))
    tracemalloc.start()
    estimate(layout)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 25e6
