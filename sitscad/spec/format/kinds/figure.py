"""A figure with where it comes from."""

from __future__ import annotations

from typing import Any

from sitscad.record import record
from sitscad.spec.format.kinds.kind import Scalar
from sitscad.spec.format.kinds.refusal import described, did_you_mean, refuse
from sitscad.spec.format.kinds.word import Choice, Text


@record
class Figure:
    """A figure with where it comes from ("" for where the whole table comes from), and whether that was seen."""

    value: Any
    source: str = ""
    is_verified: bool = True


LONGEST_SOURCE = 500


@record
class Sourced(Scalar):
    """A value, or a section with the value, its source and whether that was seen."""

    figure: Scalar

    _OTHERS = ("source", "status")

    def read(self, value: Any) -> Figure:
        """The figure with its source."""
        if not isinstance(value, dict):
            return Figure(self.figure.read(value))
        unknown = [name for name in value if name not in ("value", *self._OTHERS)]
        if unknown:
            hint = did_you_mean(unknown[0], ("value", *self._OTHERS))
            refuse("SIT002", f"{described(unknown[0])} is no key of a figure", hint)
        if "value" not in value:
            refuse("SIT003", "the figure has no value", "write {value: 80 um, source: their page}")
        status = Choice(("verified", "unverified")).read(value.get("status", "verified"))
        return Figure(
            self.figure.read(value["value"]), Text(LONGEST_SOURCE).read(value.get("source", "")), status == "verified"
        )

    def schema(self) -> dict[str, Any]:
        """The value alone, or the section."""
        inner = self.figure.schema()
        named = {
            "type": "object",
            "additionalProperties": False,
            "required": ["value"],
            "properties": {
                "value": inner,
                "source": Text(LONGEST_SOURCE).schema(),
                "status": Choice(("verified", "unverified")).schema(),
            },
        }
        return {"anyOf": [*inner.get("anyOf", [inner]), named]}
