"""Findings made by hand, as the tests of every form tell them: two specs, one of them unreadable; hostile texts."""

from __future__ import annotations

import sitscad
from sitscad.basics.finding import Finding, Ignored, NotChecked, Place, Severity
from sitscad.checks.findings import CheckedSpec, OutputOptions

TEXT = """\
sitscad: 1
name: x
coil: {shape: circle, turns: 6.5, layers: [1, 2]}  # 3 % more
fpc:
  tail: {bend: "static # not dynamic"}
"""

TURNS = Finding(
    "SIT201", "inductance-floor", Severity.ERROR, "too weak: 70 % of it", "more turns", "coil.turns", 3, 30, 1.4e-7,
    2e-7, "H", "TI", sigma=2.5,
)
AGAIN = Finding("SIT201", "inductance-floor", Severity.WARNING, "and pressed", "", "coil.turns", 3, 30)
LAYERS = Finding(
    "SIT206",
    "self-resonance",
    Severity.WARNING,
    "near",
    "fewer layers",
    "coil.layers",
    3,
    43,
    detail="one sigma is 3 %",
)
BEND = Finding("SIT308", "tail-bend", Severity.NOTE, "a | b <b>::error::\n* c", "", "fpc.tail.bend", 5, 16)
PLACED = Finding("SIT108", "copper-spacing", Severity.NOTE, "there", place=Place(1e-3, 0.0, 2, ("C1",)))
WAIVED = Finding("SIT103", "coil-trace", Severity.WARNING, "narrow", "", "coil", 3, 1)
UNREAD = Finding("SIT001", "not-yaml", Severity.ERROR, "a \x1b[31m tab\there", "mend it", None, 2, 1)

FIRST = CheckedSpec(
    "sensors/first, 100%: new.yaml",
    TEXT,
    (TURNS, AGAIN, LAYERS, BEND, PLACED),
    (NotChecked("SIT301", "no mount in the spec"), NotChecked("SIT302", "no mount in the spec")),
    ignored=(Ignored(WAIVED, "their quotation of 3 May", "comment"),),
)
SECOND = CheckedSpec(
    "second.yaml", "sitscad: 1\n\ta: b\n", (UNREAD,), (NotChecked("SIT002", "the spec could not be read"),)
)
BOTH = (FIRST, SECOND)
OUTPUT = OutputOptions(rules=tuple(sitscad.RULES))
