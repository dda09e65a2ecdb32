"""Two numbers agree within what a test says: none of its own is added."""

from __future__ import annotations

import numpy as np
import pytest
from tolerance import approx


def test_relative_tolerance_has_no_absolute_minimum():
    assert approx(1e-13, rel=0.01) != 1.02e-13
    assert approx(1e-13, rel=0.01) == 1.005e-13
    assert approx(0.0, rel=0.5) != 1e-13
    assert approx(1e-13, abs=1e-14) == 1.02e-13 and approx(1e-13, rel=1e-3, abs=1e-14) == 1.02e-13
    assert approx([1e-13, 2.1e-13], rel=0.01) != [1e-13, 2e-13]
    assert np.array([1e-13, 2e-13]) != approx(np.array([1e-13, 2.1e-13]), rel=0.01)
    assert approx({"C_F": 2e-13}, rel=0.01) != {"C_F": 1e-13}


def test_approx_compares_none_and_text_by_equality():
    assert approx({"C_F": None, "name": "C1"}, rel=0.01) == {"C_F": None, "name": "C1"}
    assert approx([None, 1.001], rel=0.01) == [None, 1.0] and approx([None, 1.02], rel=0.01) != [None, 1.0]
    assert approx(None, abs=1.0) != 0.0


def test_approx_without_tolerance_raises_type_error():
    with pytest.raises(TypeError, match="say rel or abs"):
        approx(1.0)
