"""The quick level: many designs at once, each figure with what it may be off by."""

from __future__ import annotations

from collections.abc import Sequence

from sitscad.spec.sensor import SensorSpec
from sitscad.study.evaluation import SCREEN, Evaluation
from sitscad.study.full import judged


def screened(specs: Sequence[SensorSpec], measures: Sequence[str]) -> list[Evaluation]:
    """What is said of every design; those of one batch share what they have in common."""
    return [judged(spec, measures, SCREEN) for spec in specs]
