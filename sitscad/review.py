"""What is said of a design: its findings, what could not be checked and why, and what its coils feel."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

from sitscad.checks import CheckResult, judged
from sitscad.design import Design
from sitscad.finding import Finding, NotChecked
from sitscad.record import record
from sitscad.remedy.budget import DECISIVE

if TYPE_CHECKING:
    from sitscad.measured import Signal


@record
class Review:
    """The findings of a design, made when they are first asked for, and once; ``hints`` is what is tried for them:
    ``none``, ``decisive`` (about as much as the check itself costs, errors first) or ``full`` (minutes).
    """

    design: Design
    hints: str = DECISIVE

    @cached_property
    def result(self) -> CheckResult:
        """What every rule says, and what could not be checked."""
        return judged(self.design, self.hints)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What was found, in the order of rule and place."""
        return self.result.findings

    @property
    def not_checked(self) -> tuple[NotChecked, ...]:
        """What could not be checked, each with its reason."""
        return self.result.not_checked

    @property
    def signals(self) -> tuple[Signal, ...]:
        """What each coil's reading does from rest to the required force."""
        return self.result.signals

    @property
    def ok(self) -> bool:
        """Whether no error was found."""
        return self.result.ok
