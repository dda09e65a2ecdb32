"""Numbers that agree within what a test says, and within nothing else."""

from __future__ import annotations

from typing import Any

import pytest


def approx(expected: Any, *, rel: float | None = None, abs: float | None = None) -> Any:
    """What compares equal to numbers within ``rel`` of the expected ones, or within ``abs`` where that is wider.

    Takes what pytest's own takes: a number, a list, a dict or an array, None among them. Pytest's adds 1e-12 to a
    relative tolerance: a capacitance of 1 pF may then be off by all of itself.
    """
    if rel is None and abs is None:
        raise TypeError("say rel or abs: farads and metres have no tolerance in common")
    return pytest.approx(expected, rel=rel or 0, abs=abs or 0)
