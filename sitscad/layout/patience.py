"""How much the searches of one board may try: counted, not timed, so that every machine finds the same board."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

TRIALS_OF_A_WAVE = 50
"""What it takes to find the ways through the array to one coil, in trials."""

BUDGET = 16_000
"""All searches of one board together give up after this many trials of branches: some seconds."""

TRIALS_OF_CHANGES = 2 * BUDGET
"""And all those of changed specs together, where it is tried what would help."""

TRIALS_OF_ONE_CHANGE = 10_000
"""One of them after this many: the next change may be easier."""


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

    @contextmanager
    def share(self, most: int) -> Iterator[Patience]:
        """A part of it, at most so many; what is spent of the part is spent of the whole."""
        part = Patience(min(most, self.left))
        before = part.left
        yield part
        self.left -= before - part.left
