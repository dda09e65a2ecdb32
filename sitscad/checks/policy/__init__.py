"""A project's policy for its specs: selected rules, waivers with a reason, changed severities and a baseline.

The policy changes only which findings count and how much. It never changes the design.
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
