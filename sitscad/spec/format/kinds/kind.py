"""The kinds of value that a spec holds (a length, a choice, a preset's name).

Each kind reads a plain YAML value, or refuses it with the id of the rule that it breaks, what was read and what is
allowed; and each describes itself for the JSON Schema.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import Any

from pydantic_core import core_schema

from sitscad.record import record


class Kind(ABC):
    """A kind of value: how pydantic's core reads it, and the JSON Schema of what may be written."""

    @abstractmethod
    def schema(self) -> dict[str, Any]:
        """JSON Schema of what may be written."""

    @abstractmethod
    def validator(self) -> core_schema.CoreSchema:
        """How pydantic's core reads such a value."""


class Scalar(Kind):
    """A kind whose values are read in one step: `read` turns the YAML value into the spec's."""

    @abstractmethod
    def read(self, value: Any) -> Any:
        """The value for the spec; refuses by raising."""

    def validator(self) -> core_schema.CoreSchema:
        """How pydantic's core reads such a value."""
        return core_schema.no_info_plain_validator_function(self.read)


@record
class Either(Scalar):
    """A word with a meaning of its own, or any value of another kind."""

    word: str
    other: Scalar

    def read(self, value: Any) -> Any:
        """None for the word, else what the other kind reads."""
        return None if value == self.word else self.other.read(value)

    def schema(self) -> dict[str, Any]:
        """The word or the other kind."""
        return {"anyOf": [{"const": self.word}, self.other.schema()]}


@record(eq=False)
class Special(Scalar):
    """A value read by a function, with its JSON Schema given."""

    reader: Callable[[Any], Any]
    described_as: Mapping[str, Any]

    def read(self, value: Any) -> Any:
        """What the function makes of the value."""
        return self.reader(value)

    def schema(self) -> dict[str, Any]:
        """The schema given."""
        return dict(self.described_as)
