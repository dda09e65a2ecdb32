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


LOST = 4_000
"""They give up after so many since a try last led out more coils than those before it, while two or more have no way.
Of 112 boards of four layers or more that found ways for all coils (random_boards.py, seeds 0 to 449) none went on after
more than 3,209.
"""


class SearchLimit:
    """How many branches the searches of one board may still try."""

    def __init__(self, budget: int = BUDGET) -> None:
        self.left = budget
        self._missing, self._since = 0, budget

    def begin(self, coils: int) -> None:
        """A board with so many coils is to be routed."""
        self._missing, self._since = coils, self.left

    def led_out(self, coils: int, of: int) -> None:
        """A try has led out so many coils of all."""
        if of - coils < self._missing:
            self._missing, self._since = of - coils, self.left

    @property
    def is_lost(self) -> bool:
        """Whether two coils or more have found no way for long."""
        return self._missing > 1 and self._since - self.left >= LOST

    @property
    def is_spent(self) -> bool:
        """Whether no search may begin any more."""
        return self.left <= 0 or self.is_lost

    @property
    def is_overdrawn(self) -> bool:
        """Whether a search that is going on has to end."""
        return self.left < 0 or self.is_lost

    @contextmanager
    def at_most(self, most: int) -> Iterator[None]:
        """The searches that go on with it may try so many more and no more."""
        kept = max(0, self.left - most)
        self.left -= kept
        yield
        self.left += kept
