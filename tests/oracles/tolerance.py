"""Numbers that agree within what a test says, and within nothing else."""

from __future__ import annotations

from typing import Any

import pytest


def approx(expected: Any, *, rel: float | None = None, abs: float | None = None) -> Any:
    """What compares equal to numbers within ``rel`` of the expected ones, or within ``abs`` where that is wider.

    Takes a number, a list, a dict or an array; None and text among them are what they are. Pytest's own adds 1e-12 to a
    relative tolerance: a capacitance of 1 pF may then be off by all of itself.
    """
    if rel is None and abs is None:
        raise TypeError("say rel or abs: farads and metres have no tolerance in common")
    if expected is None or isinstance(expected, str):
        return expected
    if isinstance(expected, dict):
        return {key: approx(value, rel=rel, abs=abs) for key, value in expected.items()}
    if isinstance(expected, (list, tuple)) and any(value is None for value in expected):
        return type(expected)(approx(value, rel=rel, abs=abs) for value in expected)
    return pytest.approx(expected, rel=rel or 0, abs=abs or 0)
