"""Texts, and words out of a few."""

from __future__ import annotations

import re
from typing import Any

from sitscad.record import record
from sitscad.spec.format.kinds.kind import Scalar
from sitscad.spec.format.kinds.refusal import described, did_you_mean, is_like, nearest, refuse


@record
class Text(Scalar):
    """A text of limited length that may have to match a pattern."""

    longest: int = 200
    pattern: str = ""
    like: str = ""

    def read(self, value: Any) -> str:
        """The text."""
        if not isinstance(value, str):
            refuse("SIT004", f"{described(value)} is no text", "put quotes around it" if self._fits(str(value)) else "")
        if len(value) > self.longest:
            message = f"{len(value)} characters are too many: at most {self.longest}"
            refuse("SIT006", message, "", measured=float(len(value)), limit=float(self.longest))
        if not self._fits(value):
            refuse("SIT006", f"{described(value)} does not have the form wanted", self.like)
        return value

    def _fits(self, text: str) -> bool:
        return re.fullmatch(self.pattern, text) is not None if self.pattern else text.isprintable()

    def schema(self) -> dict[str, Any]:
        """A string with its bounds."""
        pattern = {"pattern": f"^{self.pattern}$"} if self.pattern else {}
        return {"type": "string", "maxLength": self.longest, **pattern}


@record
class Choice(Scalar):
    """One of a few words."""

    allowed: tuple[str, ...]

    def read(self, value: Any) -> str:
        """The word."""
        if not isinstance(value, str):
            refuse("SIT004", f"{described(value)} is no name", f"allowed: {', '.join(self.allowed)}")
        if value not in self.allowed:
            near = nearest(value, self.allowed)
            facts = {"meant": near, "is_sure": is_like(value, near)} if near else {}
            refuse("SIT007", f"{described(value)} is not known here", did_you_mean(value, self.allowed), **facts)
        return value

    def schema(self) -> dict[str, Any]:
        """An enumeration."""
        return {"type": "string", "enum": list(self.allowed)}
