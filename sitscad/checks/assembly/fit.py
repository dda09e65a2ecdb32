"""SIT308, SIT309, SIT311, SIT320 to SIT326, SIT332, SIT333: tail bend, shield, bare metal, measures of solids.

`check` loads no CAD kernel, so it reports SIT320 to SIT323, SIT326, SIT332 and SIT333 as not checked. `build` measures
the solids (`sitscad.assembly.solids.proof`, `sitscad.assembly.solids.step_parts`) and writes the values into
``mount/fit.json``. These rules then check the values.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any

from sitscad.assembly.places.bodies import PartsError
from sitscad.assembly.places.fit import closed_section, pin_gaps, shaft, tail_section_size
from sitscad.assembly.places.stack import BODY, shield
from sitscad.assembly.places.tail_path import bends_at_every_grasp, tail_path
from sitscad.basics.finding import Finding, Place, Severity
from sitscad.checks.board.fabrication import limit_document
from sitscad.checks.fixes.moves import hole_plating_only, reread_change, thinner_tails
from sitscad.checks.fixes.pads import with_film
from sitscad.checks.fixes.search import with_value
from sitscad.checks.rules import (
    ROUNDING,
    Rule,
    Verdict,
    Violation,
    finding_from_violation,
    join_texts,
    locate_finding,
    not_checked,
    rule_of,
    violation_of,
)
from sitscad.data import is_unverified
from sitscad.estimates.design import Design
from sitscad.kernels.converters.converter import Converter
from sitscad.kernels.geometry.path import bounding_box
from sitscad.layout.bending import bend_figure, tail_thickness
from sitscad.layout.lanes import coils_breadth
from sitscad.spec.circuit import Tail
from sitscad.spec.materials import ElastomerPad
from sitscad.spec.mount import Jaw
from sitscad.spec.presets import is_rigid
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.yaml.source import SpecSource

GRAIN = 10e-6
"""Rounding step (m) of the sizes and margins that hints propose: the finest step that can be cut."""


def tail_bend(design: Design) -> Iterator[Verdict]:
    """Yield findings on a tail that is bent: its stack-up, its copper layers, its foil and its bend radius.

    A rigid board cannot be bent. A tail that bends at every grasp must have few layers and rolled-annealed foil. The
    bend radius is compared with half of the port's diameter.
    """
    spec, tail, figure = design.spec, design.spec.fpc.tail, bend_figure(design.spec.fpc)
    assert tail is not None
    if tail.bend == "none":
        return
    if is_rigid(spec.fpc.stackup):
        yield violation_of("bend-rigid", "fpc.tail.bend", bend=tail.bend, stackup=spec.fpc.stackup.name,
                           fixes=(lambda: reread_change(spec, "fpc.tail.bend", "none"),))
        return
    if tail.bend == "static" and bends_at_every_grasp(spec.fpc.tail, spec.jaw):
        yield _repeated_bend_finding(spec, tail)
    if tail.bend == "dynamic":
        yield from _repeated_bend_materials(spec, tail)
    if figure is None:
        yield not_checked("no-bend-radius", profile=spec.fpc.rules.name, bend=tail.bend)
    else:
        yield from _bend_radius(spec, tail, *figure)


def _repeated_bend_finding(spec: SensorSpec, tail: Tail) -> Violation:
    """Return the finding on a tail with ``bend: static`` that in fact bends at every grasp.

    It is a warning if the tail does not suit repeated bends, or if the fabricator states no bend radius for them.
    Otherwise it is a note.
    """
    dynamic = with_value(spec, "fpc.tail.bend", "dynamic", "dynamic")
    moving, figure = replace(tail, bend="dynamic"), bend_figure(dynamic.spec.fpc)
    results = [*_repeated_bend_materials(dynamic.spec, moving),
               *(_bend_radius(dynamic.spec, moving, *figure) if figure else ())]
    is_wrong = bool(results) or figure is None
    return violation_of(
        "bend-static", "fpc.tail.bend", hint="bend-static-wrong" if is_wrong else "",
        details=() if figure else ("no-moving-radius",), severity=Severity.WARNING if is_wrong else Severity.NOTE,
        fixes=() if is_wrong else (lambda: [dynamic],), rules=spec.fpc.rules.name,
        broken=join_texts(*(each.text("message") for each in results if isinstance(each, Violation))),
    )


def _repeated_bend_materials(spec: SensorSpec, tail: Tail) -> Iterator[Violation]:
    """Yield findings on the number of copper layers and the type of foil of a tail that bends repeatedly.

    One layer has no finding, two layers have a warning, and more layers an error. Foil that is not rolled-annealed has
    a warning.
    """
    in_hinge = bends_at_every_grasp(spec.fpc.tail, spec.jaw)
    if tail.layers > 1:
        yield violation_of(
            "moving-layers", "fpc.tail.layers", float(tail.layers), 2.0 if tail.layers > 2 else 1.0, "copper layers",
            hint="moving-layers-hinge" if in_hinge else "",
            severity=Severity.ERROR if tail.layers > 2 else Severity.WARNING,
            fixes=(lambda: [*thinner_tails(spec)][::-1],
                   lambda: [] if in_hinge else [with_value(spec, "fpc.tail.bend", "static", "static")]),
        )
    if spec.fpc.copper != "rolled-annealed":
        yield violation_of(
            "moving-foil", "fpc.copper", hint="moving-foil-hinge" if in_hinge else "", severity=Severity.WARNING,
            fixes=(lambda: reread_change(spec, "fpc.copper", "rolled-annealed"),), foil=spec.fpc.copper,
        )


def _bend_radius(spec: SensorSpec, tail: Tail, field: str, ratio: float) -> Iterator[Verdict]:
    """Yield a finding if the tail's bend radius exceeds half of the port's diameter.

    The radius is the larger of two values: the radius in the spec, and `ratio` times the tail's thickness. `field` is
    the key of the fabricator's design rules for `ratio`, the least bend radius divided by the thickness.
    """
    thickness, jaw = tail_thickness(spec.fpc), spec.jaw
    room = None if jaw is None else jaw.port_diameter / 2.0
    radius, spec_radius = ratio * thickness, tail.bend_radius or 0.0
    if room is None:
        yield not_checked("no-bend-room")
    elif spec_radius > max(radius, room + ROUNDING):
        tightest = round(1e3 * max(radius, min(spec_radius, room)), 6)
        yield violation_of("bend-radius-port", "fpc.tail.bend.radius", spec_radius, room, "m",
                           severity=Severity.WARNING,
                           fixes=(lambda: reread_change(spec, "fpc.tail.bend.radius", tightest),),
                           radius=f"{tightest:.6g}")
    elif radius > room + ROUNDING:
        yield violation_of(
            "bend-port", "fpc.tail.bend", radius, room, "m", source=spec.fpc.rules.source_of(field), bend=tail.bend,
            severity=Severity.WARNING if tail.bend != "static" or tail.layers > 2 else Severity.NOTE,
            layers=tail.layers, house=limit_document(spec.fpc.rules, field), ratio=ratio, thickness=thickness,
            fixes=(lambda: thinner_tails(spec), lambda: hole_plating_only(spec)),
        )


def shield_gap(design: Design) -> Iterator[Verdict]:
    """Yield findings on a shield that is too high for the standoff, or too narrow to cover all coils.

    The height is the gap between shield and board plus the shield's thickness. Its limit is the standoff, the distance
    of the board from the jaw's metal. The port's diameter may limit the shield's width.
    """
    part, mount, (_, y0, _, y1) = design.spec.shield, design.spec.mount, design.layout.body
    assert part is not None and mount is not None
    with suppress(PartsError):  # a shield in the jaw's metal is reported below
        sheet = shield(design.layout)
        assert sheet is not None
        (_, low, _, high), middle = bounding_box((sheet.outline(), )), (y0 + y1) / 2
        coils = coils_breadth(design.spec.all_placements, design.spec.coil)
        width, across = high - low, 2.0 * max(middle - coils.low, coils.high - middle)
        if across > width + ROUNDING:
            yield violation_of("shield-narrow", "shield.gap", width, across, "m", severity=Severity.WARNING,
                               missing=(across - width) / 2)
    needed = part.gap + part.thickness
    high = round(math.ceil(needed * 1e6 - 1e-3) * 1e-6, 9)  # rounded as written
    if needed > mount.standoff + ROUNDING:
        yield violation_of(
            "shield-low", "shield.gap", needed, mount.standoff, "m", base="jaw" if mount.jaw else "mount",
            missing=needed - mount.standoff,
            fixes=(lambda: [with_value(design.spec, "mount.standoff", high, f"{1e3 * high:.6g}")],),
        )


def bare_metal(design: Design) -> Iterator[Verdict]:
    """Yield a finding on a target that touches tissue without a film."""
    target = design.spec.target
    if design.spec.encapsulation is None:
        metal = "copper" if target is not None and target.material.name == "copper" else "metal"
        yield violation_of("bare-target", "target", fixes=(lambda: with_film(design.spec),), metal=metal)


def require_jaw(jaw: Jaw | None) -> Jaw:
    """Return the jaw, for rules that only apply if the spec has a jaw."""
    assert jaw is not None
    return jaw


def require_pad(elastomer: ElastomerPad | None) -> ElastomerPad:
    """Return the elastomer, for rules that only apply if the spec has an elastomer."""
    assert elastomer is not None
    return elastomer


def unmeasured_jaw_case(jaw: Jaw) -> tuple[str, ...]:
    """Return a tuple with the key in ``data/messages.csv`` of the remark that the jaw's dimensions were not measured.

    Empty if they were measured.
    """
    return ("jaw-unverified",) if is_unverified(jaw.source) else ()


def measured_on_solids(design: Design) -> Iterator[Verdict]:
    """Yield the reason why `check` cannot apply the rule: only `build` makes the solids that the rule measures."""
    yield not_checked("on-solids")


def tail_past_pin(design: Design) -> Iterator[Verdict]:
    """Yield findings if the tail is too near to the hinge's pin, or if its bend begins too far before the pivot.

    The distance from the pivot is checked with closed and with fully open jaws; the limit is half of the pin. The bend
    lies around the pivot and must not reach back to the jaw's face. Its length follows from bend radius and opening
    angle.
    """
    layout, jaw = design.layout, require_jaw(design.spec.jaw)
    try:
        pair, closed = closed_section(layout), tail_path(layout)
    except PartsError:
        yield not_checked("shield-unfit")
        return
    if jaw.hinge is None or closed is None or pair is None:
        yield not_checked("no-hinge" if jaw.hinge is None else "no-tail-behind")
        return
    if closed.radius is None:
        yield not_checked("straight-tail", reason=closed.reason)
        return
    for gap in pin_gaps(layout):
        if not gap.is_free:
            yield violation_of("tail-past-pin", "mount.standoff", gap.away, gap.pin, "m", when=gap.when, pin=gap.source)
    half = (jaw.opening or 0.0) / 2
    needed = (closed.radius + tail_thickness(design.spec.fpc) / 2) * math.tan(half / 2)
    if needed > jaw.hinge:
        yield violation_of("bend-before-pivot", "fpc.tail.bend", needed, jaw.hinge, "m", radius=closed.radius)


def end_through_shaft(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the tail's end, with its stiffener, is larger than the tube behind the jaw.

    The diagonal of the end's cross-section is compared with the inner diameter of the tube.
    """
    layout, behind = design.layout, shaft(design.spec.assembly, design.spec.jaw)
    assert behind is not None
    width, thick = tail_section_size(layout)
    across = math.hypot(width, thick)
    if across > behind.bore:
        yield violation_of("tail-through-shaft", "fpc.tail.connector", across, behind.bore, "m", width=width,
                           thick=thick, bore=behind.source)


def findings_on_solids(document: Mapping[str, Any], device: Converter, source: SpecSource) -> tuple[Finding, ...]:
    """Return the findings on values in the document ``mount/fit.json`` that do not meet their limits.

    `document` is the content of this JSON file of the build. For other files, the result is empty. `device` is the
    spec's converter, and `source` the spec's text with its keys.
    """
    findings = []
    for each in document.get("measured", ()):
        if not each["kept"]:
            rule, key = MEASUREMENT_RULES[each["what"]]
            violation = _solid_violation(each, each.get("key", key))
            findings.append(locate_finding(finding_from_violation(_RULES[rule], violation, device), source))
    return tuple(findings)


def _solid_violation(each: Mapping[str, Any], key: str) -> Violation:
    """Return the violation for `each`, an entry of ``mount/fit.json`` with one measured value of the solids.

    `key` is the key of the spec to which the finding points.
    """
    first, value, limit = each["first"], each["value"], each["limit"] or 0.0
    case, hint, details, severity = _SOLID_CASES.get(each["what"], ("", "", (), None))
    match each["what"]:
        case "support" | "no support" if first == BODY:
            case, hint = "solids-body", "solids-support"
        case "port" if first in ("jaw", "opposing-jaw"):
            hint = "solids-port-jaw"
        case "step file" if each.get("key", "").endswith("datum"):
            hint = "step-file-datum"
        case "jaw file":
            case, hint = _jaw_case(first, value), "jaw-file"
            if case == "jaw-file-assumed-face":
                hint, severity = case, Severity.WARNING
    has_unit = bool(each["unit"])
    return violation_of(
        case, key, value if has_unit else None, each["limit"] if has_unit else None, each["unit"] or None, hint=hint,
        details=details, severity=severity, place=Place(*each["where_m"][:2]) if has_unit else None, first=first,
        second=each["second"], value=abs(value), least=abs(limit), excess=value - limit, at=each["where_m"],
        x=each["where_m"][0], when=each["when"], face=f"{1e3 * value:.6g}",
    )


def _jaw_case(name: str, value: float) -> str:
    """Return the key in ``data/messages.csv`` for a dimension that differs between the jaw's STEP file and the spec.

    `name` is the dimension's name in ``mount/fit.json``. `value` is the difference (m); its sign selects the text.
    """
    match name:
        case "no metal":
            return "jaw-file-no-metal"
        case "face":
            return "jaw-file-face-above" if value > 0.0 else "jaw-file-face-below"
        case "distance from the middle":
            return "jaw-file-middle"
        case "tip" | "heel":
            return "jaw-file-short" if value > 0.0 else "jaw-file-long"
        case "assumed face":
            return "jaw-file-assumed-face"
        case "rim":
            return "jaw-file-rim"
    return "jaw-file-size"


_SOLID_CASES: dict[str, tuple[str, str, tuple[str, ...], Severity | None]] = {
    "interference": ("interference", "", (), None),
    "bend": ("mount-under-bend", "", (), Severity.WARNING),
    "port": ("solids-port", "", (), None),
    "opening": ("jaws-open", "", ("solids-when",), None),
    "travel": ("target-on-part", "", (), None),
    "bulge": ("pad-bulges", "", (), Severity.WARNING),
    "support": ("solids-support", "", (), Severity.WARNING),
    "no support": ("solids-support", "", (), Severity.ERROR),
    "jaw file": ("jaw-file", "", ("solids-when",), None),
    "jaw back": ("jaw-file-back", "", ("solids-when",), Severity.WARNING),
    "jaw back with room": ("jaw-file-back", "", ("solids-when",), Severity.NOTE),
    "jaw metal": ("jaw-file-metal", "", ("solids-when",), Severity.WARNING),
    "few jaw metal": ("jaw-file-metal", "", ("solids-when",), Severity.ERROR),
    "step file": ("step-file", "", (), None),
}
"""Texts and severity of the finding for each kind of measured value in ``mount/fit.json``.

Columns are the key of the message, the key of the hint (empty if it is the key of the message), the keys of the
details, and the severity. Keys are those in ``data/messages.csv``. If the severity is None, the rule's severity is
used.
"""


def rules_in_fit_file(document: Mapping[str, Any]) -> frozenset[str]:
    """Return the identifiers of the rules whose values are in the document ``mount/fit.json``."""
    return frozenset(MEASUREMENT_RULES[each["what"]][0] for each in document.get("measured", ()))


MEASUREMENT_RULES = {"interference": ("SIT320", "mount"), "bend": ("SIT320", "mount"),
                     "port": ("SIT321", "mount"), "opening": ("SIT322", "mount"),
                     "travel": ("SIT323", "requirements"), "bulge": ("SIT323", "requirements"),
                     "support": ("SIT326", "mount"),
                     "no support": ("SIT326", "mount"), "jaw file": ("SIT332", "mount.jaw"),
                     "jaw back": ("SIT332", "mount.jaw.step"), "jaw back with room": ("SIT332", "mount.jaw.step"),
                     "jaw metal": ("SIT332", "mount.jaw.step"), "few jaw metal": ("SIT332", "mount.jaw.step"),
                     "step file": ("SIT333", "mount")}
"""Rule, and key of the spec to which its finding points, for each kind of measured value in ``mount/fit.json``."""

RULES: tuple[Rule, ...] = (
    rule_of("SIT308", tail_bend, "tail"),
    rule_of("SIT309", shield_gap, "shield", "mount"),
    rule_of("SIT311", bare_metal, "target", "jaw"),
    rule_of("SIT320", measured_on_solids, "jaw"), rule_of("SIT321", measured_on_solids, "jaw"),
    rule_of("SIT322", measured_on_solids, "jaw"),
    rule_of("SIT323", measured_on_solids, "jaw"), rule_of("SIT324", tail_past_pin, "jaw", "tail"),
    rule_of("SIT325", end_through_shaft, "jaw", "tail"), rule_of("SIT326", measured_on_solids, "mount"),
    rule_of("SIT332", measured_on_solids, "jaw file"), rule_of("SIT333", measured_on_solids, "STEP file"),
)

_RULES = {rule.id: rule for rule in RULES}
