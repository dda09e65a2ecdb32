"""Designs to check: a sensor that passes, changes to it, and estimates made by hand."""

from __future__ import annotations

import json
from typing import Any

import pytest

from sitscad.basics.finding import Finding, NotChecked
from sitscad.checks.fixes.search import Budget
from sitscad.checks.judging import RULES
from sitscad.checks.rules import apply_rule, rule_outcomes
from sitscad.checks.trials import Trials
from sitscad.estimates.coil_estimates import CoilEstimate, Estimates, ReadoutEstimate, StateEstimate
from sitscad.estimates.design import Design
from sitscad.kernels.converters.reference_counter import ReferenceCounter
from sitscad.layout.board import Layout
from sitscad.spec import presets
from sitscad.spec.load import load_text
from sitscad.spec.sensor import SensorSpec

LDC1614 = presets.converter("ldc1614")

JAW = {"width": 4.8, "length": 20, "height": 1.3, "port_diameter": 6}
"""A jaw like generic-5mm, with a port that has been measured and is wide enough for glue and tolerances."""

GOOD: dict[str, Any] = {
    "sitscad": 1,
    "name": "jaw",
    "coil": {
        "shape": "circle",
        "outer_diameter": 4.0,
        "turns": 7.75,
        "layers": 4,
        "trace_width": "80 um",
        "trace_spacing": "80 um",
    },
    "array": {"pattern": "line", "count": 2, "pitch": 4.5},
    "fpc": {
        "stackup": "flex-4l",
        "rules": "generic-fine",
        "tail": {"length": 30, "connector": "zif-0.5mm", "layers": 2, "bend": "static"},
    },
    "target": {"shape": "square", "size": 4.5, "thickness": 0.2, "material": "copper"},
    "elastomer": {"material": "dragon-skin-30", "shape": "square", "size": 4.5, "thickness": 1, "kerf": 0.15},
    "encapsulation": {"material": "pdms", "thickness": 0.1},
    "mount": {"kind": "grasper-pad", "jaw": JAW, "standoff": 0.7},
    "shield": {"material": "copper", "thickness": 0.1, "gap": 0.6},
    "readout": {"device": "ldc1614", "capacitance": "220 pF", "clock": "40 MHz", "scan_rate": "500 Hz"},
    "requirements": {"normal_force": "4.8 N", "shear_force": "1 N", "bandwidth": "100 Hz"},
}
"""The four-layer jaw coil, stiff enough to bear its forces."""


def design(**changes: Any) -> SensorSpec:
    """The good design with dotted keys changed (``coil__turns=5``); None removes a key."""
    document = json.loads(json.dumps(GOOD))
    for key, value in changes.items():
        *parents, last = key.split("__")
        place = document
        for parent in parents:
            place = place.setdefault(parent, {})
        if value is None:
            del place[last]
        else:
            place[last] = value
    return load_text(json.dumps(document, indent=1), "jaw.yaml")


def estimates(
    spec: SensorSpec,
    inductance: float = 2.5e-6,
    frequency: float = 6.6e6,
    resistances: dict[str, float] | None = None,
    quality: float = 20.0,
    matrix: tuple[tuple[float, ...], ...] | None = None,
    self_resonance: float = 60e6,
    **readout: Any,
) -> Estimates:
    """Estimates by hand: one state for each entry of `resistances` (ohm), the same for every coil."""
    resistances = resistances or {"free": 2200.0, "rest": 1300.0, "pressed": 1100.0}
    working = [r for state, r in resistances.items() if state != "free"] or [resistances["free"]]
    code = readout.get("drive_code", LDC1614.drive_code(max(working)))
    states = {
        state: StateEstimate(state, inductance, 5.0, frequency, r, quality, LDC1614.amplitude(r, code))
        for state, r in resistances.items()
    }
    coils = tuple(
        CoilEstimate(
            placement.name, placement.centre, inductance, 1e-4, "hand", inductance, 0.0, 4.0, 5.0, 4.2, 230e-12, 2e-12,
            frequency, resistances["free"], quality, self_resonance, 0.2, states,
        )
        for placement in spec.array.placements
    )
    count = len(coils)
    matrix = matrix or tuple(
        tuple(inductance if i == j else -0.01 * inductance for j in range(count)) for i in range(count)
    )
    settings = {
        "device": spec.readout.device,
        "capacitance": 220e-12, "capacitance_reason": "", "drive_code": code, "drive_current": 1e-3,
        "clock": 40e6, "conversion": ReferenceCounter(spec.readout.device, count, 40e6, 1, 1, 2400, 8),
        "dwell_time": 1e-3, "scan_rate": 500.0, "high_current": False,
    } | readout
    return Estimates(coils, matrix, ReadoutEstimate(**settings), None, {}, (), ())


def verdicts(
    rule_id: str, spec: SensorSpec, layout: Layout | None = None, numbers: Estimates | None = None
) -> tuple[list[Finding], list[NotChecked]]:
    """Findings of one rule and what it could not check."""
    rule = next(rule for rule in RULES if rule.id == rule_id)
    return apply_rule(rule, Design(spec, layout, numbers or estimates(spec)))


def judge(*arguments: Any) -> list[Finding]:
    """Apply one rule: `judge("SIT201", spec, layout, estimates)` gives its findings."""
    return verdicts(*arguments)[0]


def advised(rule_id: str, spec: SensorSpec, layout: Layout | None = None) -> list[Finding]:
    """Findings of one rule with their hints, which this rule alone was tried for."""
    rule = next(rule for rule in RULES if rule.id == rule_id)
    subject = Design(spec, layout)
    result, _ = rule_outcomes(rule, subject)
    return Trials(subject, [rule], result, (), Budget.of("full")).advised()


# Test modules cannot import a conftest, so the helpers reach them as fixtures of the same names.


@pytest.fixture(name="design")
def _design():
    return design


@pytest.fixture(name="estimates")
def _estimates():
    return estimates


@pytest.fixture(name="verdicts")
def _verdicts():
    return verdicts


@pytest.fixture(name="judge")
def _judge():
    return judge


@pytest.fixture(name="advised")
def _advised():
    return advised
