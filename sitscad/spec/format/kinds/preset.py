"""Names of presets, and of profiles in files beside the spec."""

from __future__ import annotations

from typing import Any

from pydantic_core import PydanticCustomError

from sitscad.record import record
from sitscad.spec.format.kinds.kind import Scalar
from sitscad.spec.format.kinds.word import Choice, Text
from sitscad.spec.profiles.names import names


@record
class Preset(Scalar):
    """The name of a preset of one kind (see `profiles.names`)."""

    kind: str

    def read(self, value: Any) -> str:
        """The name."""
        return Choice(names(self.kind)).read(value)

    def schema(self) -> dict[str, Any]:
        """An enumeration of the presets that are installed."""
        return Choice(names(self.kind)).schema()


@record
class ProfileName(Scalar):
    """A fabricator's design rules by name: a preset, or a file beside the spec, told apart by the file's ending; with
    `or_none` also the word none.
    """

    or_none: bool = False

    def read(self, value: Any) -> str:
        """The name; whether a file is there is looked up later."""
        if is_profile_file(value):
            return str(Text(200).read(value))
        try:
            return Choice(self._names).read(value)
        except PydanticCustomError as error:
            context = dict(error.context or {})
            word = value if isinstance(value, str) and value.isidentifier() else "ourshop"
            own = f"a profile of your own: write the name of its file beside the spec with the ending, like {word}.yaml"
            context["hint"] = f"{context.get('hint', '')}; or {own}"
            raise PydanticCustomError(error.type, error.message_template, context) from None

    def schema(self) -> dict[str, Any]:
        """A preset that is installed, or a file's name."""
        file = {"type": "string", "maxLength": 200, "pattern": r"\.[yY][aA]?[mM][lL]$", "examples": ["ourshop.yaml"]}
        return {"anyOf": [Choice(self._names).schema(), file]}

    @property
    def _names(self) -> tuple[str, ...]:
        return (*names("rules"), "none") if self.or_none else names("rules")


def is_profile_file(name: Any) -> bool:
    """Whether a name of design rules is that of a file and not of a preset."""
    return isinstance(name, str) and name.lower().endswith((".yaml", ".yml"))
