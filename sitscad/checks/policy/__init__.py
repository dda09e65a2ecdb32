"""What a project holds against its specs: rules that are chosen, waived with a reason or weighed otherwise, and what
was known before. Rules find, the policy judges; nothing of it changes what is drawn.
"""

from __future__ import annotations

from sitscad.checks.policy.configuration import (
    Policy,
    PolicyError,
    chosen_rules,
    kept_policy,
    nearest_policy,
    stands_for,
)
from sitscad.checks.policy.judgement import Baseline, ignored_anyway, judged, kept_baseline, known_of, read_baseline

__all__ = [
    "Baseline", "Policy", "PolicyError", "chosen_rules", "ignored_anyway", "judged", "kept_baseline", "kept_policy",
    "known_of", "nearest_policy", "read_baseline", "stands_for",
]
