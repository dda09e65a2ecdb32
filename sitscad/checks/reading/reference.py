"""SIT223 and SIT224: the target's effect on the reference coil, and metal that affects only this coil."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from sitscad.assembly.places.state import PRESSED, REST
from sitscad.basics.finding import Severity
from sitscad.basics.late import late
from sitscad.checks.fixes.references import farther_references
from sitscad.checks.reading.metal import LITTLE, MUCH, THIN
from sitscad.checks.rules import Rule, Verdict, constant_limits, not_checked, rule_of, violation_of
from sitscad.estimates import estimate_layout
from sitscad.estimates.design import Design

reference_change = late("sitscad.estimates.states.other_jaw", "reference_change")
solved_signal = late("sitscad.estimates.states.reference", "reference_signal")
metal_change_ratio = late("sitscad.estimates.states.reference", "metal_change_ratio")

KEY = "array.reference.offset"


def reference_signal(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the required force changes the reference coil's reading too much.

    The change is compared with the change of another coil, by the limits `reference_signal` and
    `reference_signal_most` of ``data/own_limits.csv``.
    """
    if design.estimates.is_rough:
        return
    signal, limit = solved_signal(design.layout, design.estimates), constant_limits()["reference_signal"]
    if signal is None:
        yield not_checked("reference-unsolved", state=PRESSED)
    elif signal.share > limit.value:
        yield violation_of(
            "reference-signal", KEY, signal.share, limit.value, source=limit.source,
            severity=None if signal.share > constant_limits()["reference_signal_most"].value else Severity.WARNING,
            fixes=(partial(farther_references, design.spec),), coil=design.layout.coils[-1].name, other=signal.coil,
            change=abs(signal.reference), at_rest=abs(signal.at_rest),
        )


def reference_metal(design: Design) -> Iterator[Verdict]:
    """Yield findings on metal whose effect on the reference coil differs from its effect on the other coils.

    It is the metal of the other jaw, whose effect changes with the jaws' opening, and metal behind the reference coil.
    """
    estimates, layout = design.estimates, design.layout
    if estimates.is_rough or estimates.reference is None or REST not in estimates.reference.states:
        return
    name = estimates.reference.name
    signal = max((abs(coil.states[PRESSED].inductance - coil.states[REST].inductance)
                  for coil in estimates.coils if PRESSED in coil.states and REST in coil.states), default=0.0)
    closed, near = (
        reference_change(layout, estimates.reference, estimates.temperature, grasped) for grasped in (0.0, THIN))
    if closed is not None and near is not None and signal and abs(closed) >= LITTLE * signal:
        ratio = abs(near) / signal
        yield violation_of(
            "reference-front", "mount.jaw", ratio, MUCH, severity=None if ratio > MUCH else Severity.NOTE, coil=name,
            near=abs(near), closed=abs(closed), thin=THIN,
            share=abs(near) / estimates.reference.states[REST].inductance,
        )
    jaw = design.spec.jaw
    if jaw is not None and jaw.fenestration is not None:
        # the sensing coils without their target, before the same jaw
        bare = [estimate_layout(layout.without_target(coil)).coils[0] for coil in layout.sensing.coils[:1]]
        shares = metal_change_ratio(estimates.reference), metal_change_ratio(bare[0])
        difference = abs(shares[0] - shares[1])
        if difference > UNEQUAL * abs(shares[1]):
            yield violation_of(
                "reference-behind", KEY, difference / abs(shares[1]), UNEQUAL, severity=Severity.NOTE, coil=name,
                other=bare[0].name, by_reference=abs(shares[0]), by_other=abs(shares[1]))


UNEQUAL = 0.1
"""Largest relative difference between the effects of metal on the reference coil and on another coil.

The metal lies behind the coils. The difference of the two effects is divided by the effect on the other coil.
"""


RULES: tuple[Rule, ...] = (
    rule_of("SIT223", reference_signal, "reference", "target", "elastomer", "normal force",
            limit=100.0 * constant_limits()["reference_signal"].value,
            most=100.0 * constant_limits()["reference_signal_most"].value),
    rule_of("SIT224", reference_metal, "reference", "target", "jaw", much=f"{100.0 * MUCH:.0f} %",
            unequal=f"{100.0 * UNEQUAL:.0f} %"),
)
