"""Loads by finite elements, at will for one design: near the law, and a plain word where they cannot be asked."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from tolerance import approx

from sitscad import NoResponse
from sitscad.estimates.response.pad import pushed, pushed_by_elements
from sitscad.spec.load import load_text

TEXT = """\
sitscad: 1
name: pushed
coil: {shape: circle, outer_diameter: 6, turns: 8, layers: 2, trace_width: 100 um, trace_spacing: 100 um}
array: {pattern: line, count: 2, pitch: 7}
target: {shape: square, size: 4, thickness: 0.2, material: copper}
elastomer: {material: ecoflex-00-30, shape: square, size: 4, thickness: 2}
"""


@pytest.mark.slow
def test_elements_and_law_agree_on_a_load():
    pytest.importorskip("ngsolve")
    spec = load_text(TEXT)
    loads, held = np.array([[0.3, 0.03, 0.0], [0.3, 0.0, 0.03], [0.4, 0.1, 0.0]]), np.array([False, False, True])
    found, notes = pushed_by_elements(spec, loads, held)
    law, _ = pushed(spec, loads, held)
    assert found[:, 2] == approx(law[:, 2], rel=0.04)
    assert found[[0, 2], 0] == approx(law[[0, 2], 0], rel=0.12)  # pressed by a fifth, shear is soft
    assert found[0, 4] == approx(law[0, 4], rel=0.12)
    assert found[1, [1, 3]] == approx([found[0, 0], -found[0, 4]], rel=1e-6)
    assert "finite elements" in notes[0]


def test_what_elements_do_not_know_is_said():
    pytest.importorskip("ngsolve")
    free = np.zeros(1, dtype=bool)
    with pytest.raises(NoResponse, match="not both"):
        pushed_by_elements(load_text(TEXT), np.array([[0.3, 0.1, 0.1]]), free)
    disc = TEXT.replace("shape: square, size: 4, thickness: 0.2", "shape: circle, size: 4.2, thickness: 0.2")
    with pytest.raises(NoResponse, match="what lies between"):
        pushed_by_elements(load_text(disc), np.array([[0.3, 0.0, 0.0]]), free)


def test_a_missing_solver_is_named_with_what_mends_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "ngsolve", None)
    with pytest.raises(NoResponse, match=r"pip install 'sitscad\[fe\]'"):
        pushed_by_elements(load_text(TEXT), np.array([[0.3, 0.0, 0.0]]), np.zeros(1, dtype=bool))
