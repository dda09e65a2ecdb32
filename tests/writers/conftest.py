"""Fixtures of the writers' tests: layouts made by hand, and the independent programs that read what is written."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import layouts


@pytest.fixture(params=[2, 4], ids=["2 layers", "4 layers"])
def board(request):
    """The hand-made board of two coils, with two and with four copper layers."""
    return layouts.two_coils(request.param)
