"""How much the searches of one board may try: counted, not timed, so that every machine finds the same board."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

TRIALS_OF_A_WAVE = 50
"""What it takes to find the ways through the array to one coil, in trials."""

BUDGET = 16_000
"""All searches of one board together give up after this many trials of branches: some seconds. Of 329 random boards
that found their ways (tests/validation/random_boards.py, tests/benchmarks/check_times.py) ten took over 4,000, two over
8,000, one 13,699.
"""


class Patience:
    """How many branches the searches of one board may still try."""

    def __init__(self, budget: int = BUDGET) -> None:
        self.left = budget

    @property
    def is_spent(self) -> bool:
        """Whether no search may begin any more."""
        return self.left <= 0

    @contextmanager
    def at_most(self, most: int) -> Iterator[None]:
        """The searches that go on with it may try so many more and no more."""
        kept = max(0, self.left - most)
        self.left -= kept
        yield
        self.left += kept
