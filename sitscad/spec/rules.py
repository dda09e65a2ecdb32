"""The table behind `sitscad rules` and `sitscad explain`, and what is raised where a spec cannot be used."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from sitscad.data import rows
from sitscad.finding import Finding
from sitscad.spec.source import SpecSource

if TYPE_CHECKING:
    from sitscad.spec.sensor import SensorSpec


RULE_TEXTS = {row["id"]: row for row in rows("rules")}
"""What every rule asks for, why, and how to mend a breach, by its number; those of the spec itself are SIT0xx."""

RULE_NAMES = {number: row["name"] for number, row in RULE_TEXTS.items() if number.startswith("SIT0")}
"""The rules of the spec itself: what can be wrong with it while it is read."""

ROOM_RULES = ("SIT014", "SIT016")
"""The rules of the spec that say that coils or their turns have no room."""


class SpecError(ValueError):
    """The spec cannot be used; `findings` says everything that is wrong with it, in the order of the file.

    ``texts`` are the texts of other files that findings point into, by path. ``cramped`` is the spec as it was read
    where nothing is wrong with it but that turns or coils lack room (`ROOM_RULES`): it cannot be made, but mended.
    ``source`` is the text that was read, None where none could be.
    """

    def __init__(
        self,
        findings: tuple[Finding, ...],
        texts: Mapping[str, str] | None = None,
        cramped: SensorSpec | None = None,
        source: SpecSource | None = None,
    ) -> None:
        super().__init__("; ".join(finding.message for finding in findings))
        self.findings = findings
        self.texts = dict(texts or {})
        self.cramped = cramped
        self.source = source
