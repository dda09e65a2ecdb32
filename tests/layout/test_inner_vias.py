"""How many places inside a coil are looked at until its inner vias are found, or known to find no room."""

import tracemalloc

import numpy as np
import pytest

from sitscad.basics.finding import Missing
from sitscad.layout import lay_out, windings
from sitscad.spec.load import load_text

RACETRACK = """
sitscad: 1
name: inside
coil: {shape: racetrack, outer_diameter: [7.05, 6.46], turns: 2.5, layers: 6, trace_width: 0.25, trace_spacing: 0.15}
fpc: {rules: osh-park-flex}
"""


def joins_of(monkeypatch, text):
    """How many joins were worked out for a spec, and whether all were placed."""
    looked, join = [], windings._Candidates._join

    def counted(self, place):
        looked.append(place)
        return join(self, place)

    windings._inner_joins.cache_clear()
    monkeypatch.setattr(windings._Candidates, "_join", counted)
    layout = lay_out(load_text(text, "inside.yaml"))
    return len(looked), not any(short.what is Missing.INNER_ROOM for short in layout.shortfalls)


def test_number_of_tried_via_places_is_limited(monkeypatch):
    """Every join was worked out at all 726 places, and then a sixth of them compared."""
    looked, placed = joins_of(monkeypatch, RACETRACK)
    assert placed
    assert looked <= 3 * windings.MOST


def test_missing_room_for_holes_is_detected_before_stub_search():
    far = [0b10, 0b01]
    assert windings.one_of_each([2, 2], {(0, 1): far}) == ([0, 1], True)
    assert windings.one_of_each([2, 2, 2], {(0, 1): far, (0, 2): far, (1, 2): far}) == (None, True)
    line = 1e-3 * np.array([(0.0, 0.0), (0.5, 0.0), (1.0, 0.0)])
    assert windings.holes_fit(line, 2, 1e-3) and not windings.holes_fit(line, 3, 0.6e-3)


STACK = """
sitscad: 1
name: stack
coil: {shape: racetrack, outer_diameter: [32.88, 15.1], turns: 15.0, layers: 8, trace_width: 150 um,
       trace_spacing: 76 um, start_angle: 45 deg}
fpc: {rules: huayue}
"""


@pytest.mark.slow
def test_via_places_of_many_layers_take_little_memory():
    """All places were compared with all points of all layers at once: 180 MB."""
    windings._inner_joins.cache_clear()
    tracemalloc.start()
    lay_out(load_text(STACK, "stack.yaml"))
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 30e6


def test_layers_with_equal_outline_share_stub_search(monkeypatch):
    """Stubs of all eight layers were looked for, of which four lie as others do."""
    tried, admits = [], windings._StubRoom.admits

    def counted(self, end, corners):
        tried.append(end.layer)
        return admits(self, end, corners)

    windings._inner_joins.cache_clear()
    monkeypatch.setattr(windings._StubRoom, "admits", counted)
    layout = lay_out(load_text(STACK, "stack.yaml"))
    assert not any(short.what is Missing.INNER_ROOM for short in layout.shortfalls)
    assert len(set(tried)) == 4
