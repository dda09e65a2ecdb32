"""A change of the spec as a value: which keys take which values, and the spec with them."""

from __future__ import annotations

from sitscad.finding import Edit
from sitscad.record import record
from sitscad.spec.sensor import SensorSpec


@record
class Fix:
    """A change of a spec: its edits, and the spec with them applied.

    ``said`` is how it is told where that is not "key: value with key: value"; ``brings`` are rules that warn of the
    changed design and not, or of less, of the design as it stands.
    """

    edits: tuple[Edit, ...]
    spec: SensorSpec
    said: str = ""
    brings: tuple[str, ...] = ()

    @property
    def keys(self) -> tuple[str, ...]:
        """The keys that it changes."""
        return tuple(edit.key for edit in self.edits)

    def with_also(self, fix: Fix) -> Fix:
        """The same together with another fix, which was made for the spec that this one leaves."""
        told = " with ".join(words for words in (self.words, fix.words) if words)
        return Fix((*self.edits, *fix.edits), fix.spec, told)

    @property
    def words(self) -> str:
        """The keys and values as they are to be written, and what they bring."""
        told = self.said or " with ".join(f"{edit.key}: {edit.new}" for edit in self.edits)
        return f"{told} ({warn(self.brings)} then)" if self.brings else told


def fail(rules: tuple[str, ...]) -> str:
    """That rules fail, in words."""
    return f"{', '.join(rules)} fail{'s' if len(rules) == 1 else ''}"


def warn(rules: tuple[str, ...]) -> str:
    """That rules warn, in words."""
    return f"{', '.join(rules)} warn{'s' if len(rules) == 1 else ''}"
