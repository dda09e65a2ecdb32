"""The quick level: many designs at once, each figure with what it may be off by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from sitscad.spec.sensor import SensorSpec
from sitscad.study.evaluation import SCREEN, Evaluation
from sitscad.study.full import judged


def screened(specs: Sequence[SensorSpec], measures: Sequence[str]) -> list[Evaluation]:
    """What is said of every design, whatever the others are; ``unknown`` are rules that `check` may decide."""
    return [replace(judged(spec, measures, SCREEN), unknown=()) for spec in specs]
