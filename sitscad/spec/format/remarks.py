"""What resolving a spec has to say besides its values: what does not fit, and what was filled in."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from sitscad.finding import Edit, Finding
from sitscad.record import record


@record
class Flaw:
    """Something that does not fit, under a dotted key, with the facts of the finding to be, and the edits that mend it
    where somebody can tell.
    """

    rule: str
    key: str
    message: str
    hint: str = ""
    measured: float | None = None
    limit: float | None = None
    unit: str | None = None
    edits: tuple[Edit, ...] = ()


@dataclass
class Remarks:
    """What resolving has to say besides its values: flaws of the spec, and the defaults it filled in.

    ``findings`` are those about other files that the spec names, ``texts`` what those files hold, by path; ``files``
    are the bytes of those that were used, by their paths from the spec's folder.
    """

    flaws: list[Flaw] = field(default_factory=list)
    defaults: list[str] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    texts: dict[str, str] = field(default_factory=dict)
    files: dict[str, bytes] = field(default_factory=dict)

    def flaw(self, rule: str, key: str, message: str, hint: str = "", **facts: Any) -> None:
        """Note something that does not fit."""
        self.flaws.append(Flaw(rule, key, message, hint, **facts))

    def default(self, key: str, value: str, why: str = "the default") -> None:
        """Note a value that was filled in."""
        self.defaults.append(f"{key}: {value}, {why}")
