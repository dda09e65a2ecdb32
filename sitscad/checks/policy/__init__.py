"""A project's policy for its specs: selected rules, waivers with a reason, changed severities and a baseline.

The policy changes which findings are reported, and their severities. It never changes the design.
"""

from __future__ import annotations

from sitscad.checks.policy.configuration import (
    Policy,
    PolicyError,
    matches_rule,
    nearest_policy,
    policy_from_manifest,
    selected_rules,
)
from sitscad.checks.policy.judgement import (
    Baseline,
    apply_policy,
    baseline_findings,
    baseline_from_manifest,
    make_ignored_test,
    read_baseline,
)

__all__ = [
    "Baseline",
    "Policy",
    "PolicyError",
    "apply_policy",
    "baseline_findings",
    "baseline_from_manifest",
    "make_ignored_test",
    "matches_rule",
    "nearest_policy",
    "policy_from_manifest",
    "read_baseline",
    "selected_rules",
]
