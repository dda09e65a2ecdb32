"""What can be wrong with the spec itself: the table behind `sitscad rules` and `sitscad explain` for SIT0xx."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from sitscad.data import rows
from sitscad.finding import Finding, Severity
from sitscad.record import record
from sitscad.spec.source import SpecSource

if TYPE_CHECKING:
    from sitscad.spec.sensor import SensorSpec


@record
class SpecRule:
    """One rule of the spec: what it asks for, why, and how to mend a breach."""

    id: str
    name: str
    summary: str
    why: str
    mend: str
    severity: Severity


SPEC_RULES = tuple(
    SpecRule(row["id"], row["name"], row["summary"], row["why"], row["mend"], Severity(row["severity"]))
    for row in rows("spec_rules")
)
RULE_NAMES = {rule.id: rule.name for rule in SPEC_RULES}

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
