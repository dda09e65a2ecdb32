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
from sitscad.checks.rules import Case, Rule, Undecided, Verdict, located, named, rule_of
from sitscad.design import Design
from sitscad.finding import Finding, Place, Severity
from sitscad.layout.bending import tail_thickness
from sitscad.scene.fit import closed_section, end_section, pin_gaps, shaft
from sitscad.scene.jaws import PartsError
from sitscad.scene.stack import BODY
from sitscad.scene.tail_path import tail_path
from sitscad.spec.sensor import SensorSpec

BY_BUILD = "measured on the solids by sitscad build (mount/fit.json), not by check"


def on_solids(design: Design) -> Iterator[Verdict]:
    """Nothing can be said without solids."""
    yield Undecided(BY_BUILD)


def tail_past_pin(design: Design) -> Iterator[Verdict]:
    """The tail on its way past the hinge's pin, closed and wide open, and the room for its bend there."""
    layout, jaw = design.layout, jaw_of(design)
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
            yield TAIL_IN_PIN.found("mount.standoff", gap.away, gap.pin, "m", when=gap.when, pin=2.0 * gap.pin,
                                    origin=gap.source)
    half = (jaw.opening or 0.0) / 2
    needed = (closed.radius + tail_thickness(design.spec) / 2) * math.tan(half / 2)
    if needed > jaw.hinge:
        yield BEND_BEFORE_HINGE.found("fpc.tail.bend", needed, jaw.hinge, "m", radius=closed.radius)


def end_through_shaft(design: Design) -> Iterator[Verdict]:
    """What of the tail lies behind the jaw, with its end and the stiffener, drawn through the tube there."""
    layout, behind = design.layout, shaft(design.spec)
    assert behind is not None
    width, thick = end_section(layout)
    across = math.hypot(width, thick)
    if across > behind.bore:
        yield END_TOO_WIDE.found("fpc.tail.connector", across, behind.bore, "m", width=width, thick=thick,
                                 origin=behind.source)


def judged_on_solids(document: Mapping[str, Any], spec: SensorSpec) -> tuple[Finding, ...]:
    """The findings of what `build` measured, out of ``mount/fit.json``; nothing for what is not such a document."""
    found = []
    for each in document.get("measured", ()):
        if not each["kept"]:
            rule, case, key = FAULTS[each["what"]]
            # what a measurement that is not kept says
            x, y, z = each["where_m"]
            volume = 1e9 * each["value"] if each["unit"] == "m3" else 0.0
            area = 1e6 * each["value"] if each["unit"] == "m2" else 0.0
            when = f" ({each['when']})" if each["when"] else ""
            values = {"first": each["first"], "second": each["second"], "when": when, "volume": volume, "area": area,
                      "wanted": 1e6 * each["limit"], "x": 1e3 * x, "y": 1e3 * y, "z": 1e3 * z}
            values["under"] = f"the {BODY}" if each["first"] == BODY else f"the board under the {each['first']}"
            complaint = case.found(key, each["value"], each["limit"], each["unit"], **values)
            found.append(located(named(_RULES[rule], replace(complaint, place=Place(x, y)), spec.readout.device), spec))
    return tuple(found)


def settles(document: Mapping[str, Any]) -> frozenset[str]:
    """The rules that a document decides."""
    kinds = {each["what"] for each in document.get("measured", ())}
    return frozenset(FAULTS[kind][0] for kind in kinds)


IN_EACH_OTHER = Case(
    "{first} and {second} stand in each other: both take {volume:.3g} mm3 about x = {x:.2f}, y = {y:.2f}, z = {z:.2f} "
    "mm of the board's drawing",
    hint="give one of them other sizes; mount/fit.json says how much (build --force), assembly.step where",
)

OUTSIDE_PORT = Case(
    "the {first} reaches {measured:m,4} from the closed pair's axis, the port {limit:m,4}",
    hint="a lower stack or a narrower piece; SIT303 says by how much",
)

HITS_WHILE_OPENING = Case(
    "the jaws cannot open: the {second} runs into the {first}{when}, {volume:.3g} mm3 of it",
    hint="what stands at the sensor's heel has to be lower or shorter, or the jaw's hinge is not where it says",
)

HITS_UNDER_LOAD = Case(
    "under {when} the {first} comes to lie on the {second}, which does not give way: the force beyond that is not felt",
    hint="more room beside the pad, a smaller target, or a stiffer pad",
)

BULGE_HITS = Case(
    "under {when} the elastomer's sides bulge against the {second}, and the pad is stiffer than computed",
    hint="a smaller pad, or more room beside it", severity=Severity.WARNING,
)

TAIL_IN_PIN = Case(
    "{when}, the tail runs {measured:m,3} from the pivot, and the hinge's pin is {pin:m,3} thick ({origin})",
    hint="write your instrument's pin (assembly.hinge_pin), lead the tail beside it, or lay it lower (a larger "
    "mount.standoff)",
)

BEND_BEFORE_HINGE = Case(
    "the tail's bend of {radius:m,3} inside radius begins {measured:m,3} before the pivot, where the jaw's face still "
    "is: from its heel to the pivot there are {limit:m,3}",
    hint="a thinner tail, a tighter bend, or a jaw that opens less",
)

END_TOO_WIDE = Case(
    "the tail's end is {width:m,3} wide and {thick:m,3} thick, {measured:m,3} from corner to corner; the tube behind "
    "the jaws leaves {limit:m,3} ({origin})",
    hint="write your instrument's bore (assembly.shaft_bore); else a connector of finer pitch, fewer coils, or wires "
    "soldered behind the jaws",
)

NOT_CARRIED = Case(
    "{under} is carried on {area:.3g} mm2, as far as the solids go; it takes {wanted:.3g} mm2",
    hint="more of the mount under the board: a STEP file's datum is the middle of the face that the board is glued on",
    severity=Severity.WARNING,
)

HARDLY_CARRIED = replace(NOT_CARRIED, severity=Severity.ERROR)

FAULTS = {"interference": ("SIT320", IN_EACH_OTHER, "mount"), "port": ("SIT321", OUTSIDE_PORT, "mount"),
          "opening": ("SIT322", HITS_WHILE_OPENING, "mount"), "travel": ("SIT323", HITS_UNDER_LOAD, "requirements"),
          "bulge": ("SIT323", BULGE_HITS, "requirements"), "support": ("SIT326", NOT_CARRIED, "mount"),
          "no support": ("SIT326", HARDLY_CARRIED, "mount")}
"""By kind of measurement: the rule that judges it, what it says, and the key that it points at."""

RULES: tuple[Rule, ...] = (
    rule_of("SIT320", on_solids, "jaw"),
    rule_of("SIT321", on_solids, "jaw"),
    rule_of("SIT322", on_solids, "jaw"),
    rule_of("SIT323", on_solids, "jaw"),
    rule_of("SIT324", tail_past_pin, "jaw", "tail"),
    rule_of("SIT325", end_through_shaft, "jaw", "tail"),
    rule_of("SIT326", on_solids, "mount"),
)

_RULES = {rule.id: rule for rule in RULES}
