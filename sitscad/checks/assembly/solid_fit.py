"""SIT320 to SIT326: what is measured of the assembly in three dimensions, and the tail on its way through the hinge.

`check` loads no CAD kernel, so it says of the first four and the last that they are not checked. `build` measures the
solids (`sitscad.parts.proof`), writes what it measured into ``mount/fit.json``, and these rules judge that.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from sitscad.checks.assembly.fit import jaw_of
from sitscad.checks.rules import Rule, Undecided, Verdict, Violation, located, named, rule_of
from sitscad.design import Design
from sitscad.finding import Finding, Place, Severity
from sitscad.layout.bending import tail_thickness
from sitscad.scene.fit import closed_section, end_section, pin_gaps, shaft
from sitscad.scene.jaws import PartsError
from sitscad.scene.stack import BODY
from sitscad.scene.tail_path import tail_path
from sitscad.spec.sensor import SensorSpec
from sitscad.units import show


def on_solids(design: Design) -> Iterator[Verdict]:
    """Nothing can be said without solids."""
    yield Undecided("measured on the solids by sitscad build (mount/fit.json), not by check")


def tail_past_pin(design: Design) -> Iterator[Verdict]:
    """The tail on its way past the hinge's pin, closed and wide open, and the room for its bend there."""
    layout, jaw = design.layout, jaw_of(design.spec.mount)
    try:
        pair, closed = closed_section(layout), tail_path(layout)
    except PartsError:
        yield Undecided("the shield does not fit into the standoff")
        return
    if jaw.hinge is None or closed is None or pair is None:
        yield Undecided("no hinge: mount.jaw.hinge is not known" if jaw.hinge is None else "no tail behind the jaws")
        return
    if closed.radius is None:
        yield Undecided(f"the tail is taken as straight: {closed.reason}")
        return
    for gap in pin_gaps(layout):
        if not gap.is_free:
            yield Violation(
                f"{gap.when}, the tail runs {show(gap.away, 'm', 3)} from the pivot, and the hinge's pin is "
                f"{show(2.0 * gap.pin, 'm', 3)} thick ({gap.source})",
                "write your instrument's pin (assembly.hinge_pin), lead the tail beside it, or lay it lower (a larger "
                "mount.standoff)", "mount.standoff", gap.away, gap.pin, "m",
            )
    half = (jaw.opening or 0.0) / 2
    needed = (closed.radius + tail_thickness(design.spec.fpc) / 2) * math.tan(half / 2)
    if needed > jaw.hinge:
        yield Violation(
            f"the tail's bend of {show(closed.radius, 'm', 3)} inside radius begins {show(needed, 'm', 3)} before the "
            f"pivot, where the jaw's face still is: from its heel to the pivot there are {show(jaw.hinge, 'm', 3)}",
            "a thinner tail, a tighter bend, or a jaw that opens less", "fpc.tail.bend", needed, jaw.hinge, "m",
        )


def end_through_shaft(design: Design) -> Iterator[Verdict]:
    """What of the tail lies behind the jaw, with its end and the stiffener, drawn through the tube there."""
    layout, behind = design.layout, shaft(design.spec)
    assert behind is not None
    width, thick = end_section(layout)
    across = math.hypot(width, thick)
    if across > behind.bore:
        yield Violation(
            f"the tail's end is {show(width, 'm', 3)} wide and {show(thick, 'm', 3)} thick, {show(across, 'm', 3)} "
            f"from corner to corner; the tube behind the jaws leaves {show(behind.bore, 'm', 3)} ({behind.source})",
            "write your instrument's bore (assembly.shaft_bore); else a connector of finer pitch, fewer coils, or "
            "wires soldered behind the jaws", "fpc.tail.connector", across, behind.bore, "m",
        )


def judged_on_solids(document: Mapping[str, Any], spec: SensorSpec) -> tuple[Finding, ...]:
    """The findings of what `build` measured, out of ``mount/fit.json``; nothing for what is not such a document."""
    found = []
    for each in document.get("measured", ()):
        if not each["kept"]:
            rule, key = JUDGED_BY[each["what"]]
            said = replace(_fault(each), key=key, measured=each["value"], limit=each["limit"], unit=each["unit"],
                           place=Place(*each["where_m"][:2]))
            found.append(located(named(_RULES[rule], said, spec.readout.device), spec))
    return tuple(found)


def _fault(each: Mapping[str, Any]) -> Violation:
    first, second, value, limit = each["first"], each["second"], each["value"], each["limit"]
    x, y, z = (1e3 * along for along in each["where_m"])
    match each["what"]:
        case "interference":
            return Violation(
                f"{first} and {second} stand in each other: both take {1e9 * value:.3g} mm3 about x = {x:.2f}, y = "
                f"{y:.2f}, z = {z:.2f} mm of the board's drawing",
                "give one of them other sizes; mount/fit.json says how much (build --force), assembly.step where",
            )
        case "port":
            return Violation(
                f"the {first} reaches {show(value, 'm')} from the closed pair's axis, the port {show(limit, 'm')}",
                "a lower stack or a narrower piece; SIT303 says by how much",
            )
        case "opening":
            when = f" ({each['when']})" if each["when"] else ""
            return Violation(
                f"the jaws cannot open: the {second} runs into the {first}{when}, {1e9 * value:.3g} mm3 of it",
                "what stands at the sensor's heel has to be lower or shorter, or the jaw's hinge is not where it says",
            )
        case "travel":
            return Violation(
                f"under {each['when']} the {first} comes to lie on the {second}, which does not give way: the force "
                "beyond that is not felt", "more room beside the pad, a smaller target, or a stiffer pad",
            )
        case "bulge":
            return Violation(
                f"under {each['when']} the elastomer's sides bulge against the {second}, and the pad is stiffer than "
                "computed", "a smaller pad, or more room beside it", severity=Severity.WARNING,
            )
    under = f"the {BODY}" if first == BODY else f"the board under the {first}"
    return Violation(
        f"{under} is carried on {1e6 * value:.3g} mm2, as far as the solids go; it takes {1e6 * limit:.3g} mm2",
        "more of the mount under the board: a STEP file's datum is the middle of the face that the board is glued on",
        severity=Severity.WARNING if each["what"] == "support" else Severity.ERROR,
    )


def settles(document: Mapping[str, Any]) -> frozenset[str]:
    """The rules that a document decides."""
    return frozenset(JUDGED_BY[each["what"]][0] for each in document.get("measured", ()))


JUDGED_BY = {"interference": ("SIT320", "mount"), "port": ("SIT321", "mount"), "opening": ("SIT322", "mount"),
             "travel": ("SIT323", "requirements"), "bulge": ("SIT323", "requirements"), "support": ("SIT326", "mount"),
             "no support": ("SIT326", "mount")}
"""By kind of measurement: the rule that judges it, and the key that it points at."""

RULES: tuple[Rule, ...] = (
    rule_of("SIT320", on_solids, "jaw"), rule_of("SIT321", on_solids, "jaw"), rule_of("SIT322", on_solids, "jaw"),
    rule_of("SIT323", on_solids, "jaw"), rule_of("SIT324", tail_past_pin, "jaw", "tail"),
    rule_of("SIT325", end_through_shaft, "jaw", "tail"), rule_of("SIT326", on_solids, "mount"),
)

_RULES = {rule.id: rule for rule in RULES}
