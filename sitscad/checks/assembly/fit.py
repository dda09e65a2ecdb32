"""SIT308, SIT309, SIT311, SIT320 to SIT326, SIT332, SIT333: tail bend, shield, bare metal, measures of solids.

`check` loads no CAD kernel, so it reports SIT320 to SIT323, SIT326, SIT332 and SIT333 as not checked. `build` measures
the solids (`sitscad.assembly.solids.proof`, `sitscad.assembly.solids.step_parts`) and writes the values into
``mount/fit.json``. These rules then judge the values.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any

from sitscad.assembly.places.fit import closed_section, end_section, pin_gaps, shaft
from sitscad.assembly.places.jaws import PartsError
from sitscad.assembly.places.stack import BODY, shield
from sitscad.assembly.places.tail_path import bends_at_every_grasp, tail_path
from sitscad.basics.finding import Finding, Place, Severity
from sitscad.basics.units import counted, show
from sitscad.checks.board.fabrication import house
from sitscad.checks.fixes.moves import plated_in_holes_alone, read_anew, sealed, thinner_tails
from sitscad.checks.fixes.search import setting
from sitscad.checks.rules import ROUNDING, Rule, Undecided, Verdict, Violation, finding_of, joined, located, rule_of
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
"""Step (m) of sizes and margins that hints name: the finest step that can be cut."""


def tail_bend(design: Design) -> Iterator[Verdict]:
    """Yield findings on the tail's bend through a hinge: its layers, its foil and its radius."""
    spec, tail, figure = design.spec, design.spec.fpc.tail, bend_figure(design.spec.fpc)
    assert tail is not None
    if tail.bend == "none":
        return
    if is_rigid(spec.fpc.stackup):
        hint = "fpc.tail.bend: none; or a flexible stack-up"
        yield Violation(
            f"the tail bends ({tail.bend}), and a board of {spec.fpc.stackup.name} with FR4 breaks", hint,
            "fpc.tail.bend", fixes=(lambda: read_anew(spec, "fpc.tail.bend", "none"),),
        )
        return
    if tail.bend == "static" and bends_at_every_grasp(spec.fpc.tail, spec.jaw):
        yield _moved(spec, tail)
    if tail.bend == "dynamic":
        yield from _moving(spec, tail)
    if figure is None:
        yield Undecided(f"{spec.fpc.rules.name} states no bend radius for a {tail.bend} bend")
    else:
        yield from _bend_radius(spec, tail, *figure)


def _moved(spec: SensorSpec, tail: Tail) -> Violation:
    """Return the finding on a bend that moves with the hinge although the spec calls it a bend at assembly.

    It is a warning if the tail breaks a limit of moving bends, or if the fabricator states no such limit.
    """
    dynamic = setting(spec, "fpc.tail.bend", "dynamic", "dynamic")
    moving, figure = replace(tail, bend="dynamic"), bend_figure(dynamic.spec.fpc)
    radius = [Undecided("")] if figure is None else _bend_radius(dynamic.spec, moving, *figure)
    wrong = [*_moving(dynamic.spec, moving), *radius]
    broken = [one.message for one in wrong if isinstance(one, Violation)]
    return Violation(
        "the tail leads through the jaw's hinge and bends at every grasp; fpc.tail.bend: static means one bend at "
        "assembly",
        f"fpc.tail.bend: dynamic{', which shows what such a tail needs' if wrong else ''}; or a jaw that stands "
        "still in the shaft", "fpc.tail.bend", severity=Severity.WARNING if wrong else Severity.NOTE,
        fixes=() if wrong else (lambda: [dynamic],),
        detail=joined(*broken, "" if figure else f"{spec.fpc.rules.name} states no radius of a bend that moves"),
    )


def _moving(spec: SensorSpec, tail: Tail) -> Iterator[Violation]:
    """Yield findings on layers and foil of a tail that bends at every grasp. In a hinge, every bend moves."""
    in_hinge = bends_at_every_grasp(spec.fpc.tail, spec.jaw)
    if tail.layers > 1:
        yield Violation(
            f"the tail bends at every grasp (dynamic) and has {tail.layers} copper layers",
            "fewer copper layers through the hinge (fpc.tail.layers)"
            f"{'' if in_hinge else ', or one bend at assembly (bend: static)'}",
            "fpc.tail.layers", float(tail.layers), 2.0 if tail.layers > 2 else 1.0, "copper layers",
            severity=Severity.ERROR if tail.layers > 2 else Severity.WARNING,
            fixes=(lambda: [*thinner_tails(spec)][::-1],
                   lambda: [] if in_hinge else [setting(spec, "fpc.tail.bend", "static", "static")]),
        )
    if spec.fpc.copper != "rolled-annealed":
        yield Violation(
            f"the tail bends at every grasp (dynamic), and its foil is {spec.fpc.copper}, which cracks after fewer "
            "bends", "fpc.copper: rolled-annealed, its grain along the tail"
            f"{'' if in_hinge else '; or bend it once (bend: static)'}", "fpc.copper", severity=Severity.WARNING,
            fixes=(lambda: read_anew(spec, "fpc.copper", "rolled-annealed"),),
        )


def _bend_radius(spec: SensorSpec, tail: Tail, field: str, ratio: float) -> Iterator[Verdict]:
    """Yield findings on a bend radius larger than the room in the port.

    The radius is the spec's own or the fabricator's ratio times the tail's thickness.
    """
    thickness, jaw = tail_thickness(spec.fpc), spec.jaw
    room = None if jaw is None else jaw.port_diameter / 2.0
    radius, stated = ratio * thickness, tail.bend_radius or 0.0
    if room is None:
        yield Undecided("no jaw: the room for the tail's bend is not known")
    elif stated > max(radius, room + ROUNDING):
        tightest = round(1e3 * max(radius, min(stated, room)), 6)
        yield Violation(
            f"a bend of {show(stated, 'm', 3)} inside radius is wanted; inside the port there are {show(room, 'm', 3)}",
            f"fpc.tail.bend.radius: {tightest:.6g}, or leave it out",
            "fpc.tail.bend.radius", stated, room, "m", severity=Severity.WARNING,
            fixes=(lambda: read_anew(spec, "fpc.tail.bend.radius", tightest),),
        )
    elif radius > room + ROUNDING:
        hint = ("a thinner tail, of fewer copper layers (fpc.tail.layers) or plated in its holes alone (fpc.plated: "
                "buttons), or no bend")
        yield Violation(
            f"a {tail.bend} bend of {counted(tail.layers, 'copper layer')} needs a radius of {show(radius, 'm', 3)} "
            f"({house(spec.fpc.rules, field)} asks {ratio:g} times the {show(thickness, 'm', 3)} tail); inside "
            f"the port there are {show(room, 'm', 3)}", hint, "fpc.tail.bend", radius, room, "m",
            severity=Severity.WARNING if tail.bend != "static" or tail.layers > 2 else Severity.NOTE,
            source=spec.fpc.rules.source_of(field),
            fixes=(lambda: thinner_tails(spec), lambda: plated_in_holes_alone(spec)),
        )


def shield_gap(design: Design) -> Iterator[Verdict]:
    """Yield findings on a shield that does not fit between board and jaw metal, or that does not cover all coils.

    The port may make the shield narrower than the body.
    """
    part, mount, (_, y0, _, y1) = design.spec.shield, design.spec.mount, design.layout.body
    assert part is not None and mount is not None
    with suppress(PartsError):  # a shield in the jaw's metal is reported below
        sheet = shield(design.layout)
        assert sheet is not None
        (_, low, _, high), middle = bounding_box((sheet.outline(), )), (y0 + y1) / 2
        coils = coils_breadth(design.spec.array.placements, design.spec.coil)
        width, across = high - low, 2.0 * max(middle - coils.low, coils.high - middle)
        if across > width + ROUNDING:
            yield Violation(
                f"the shield is {show(width, 'm', 3)} wide, as the port leaves it room, and the coils reach "
                f"{show(across, 'm', 3)} across: {show((across - width) / 2, 'm', 3)} of them on each side see the jaw "
                "beside it, and the estimate takes it as endless",
                "bring it nearer to the closed pair's middle (a smaller shield.gap, a lower stack), or take smaller "
                "coils", "shield.gap", width, across, "m", severity=Severity.WARNING,
            )
    needed = part.gap + part.thickness
    high = round(math.ceil(needed * 1e6 - 1e-3) * 1e-6, 9)  # rounded as written
    if needed > mount.standoff + ROUNDING:
        yield Violation(
            f"the shield ends {show(needed, 'm')} below the board's bottom, {'the jaw' if mount.jaw else 'the mount'} "
            f"begins at {show(mount.standoff, 'm')}",
            f"raise mount.standoff by {show(needed - mount.standoff, 'm')} at least, or bring the shield nearer to "
            "the board", "shield.gap", needed, mount.standoff, "m",
            fixes=(lambda: [setting(design.spec, "mount.standoff", high, f"{1e3 * high:.6g}")],),
        )


def bare_metal(design: Design) -> Iterator[Verdict]:
    """Yield a finding on a target that touches tissue without a film."""
    target = design.spec.target
    if design.spec.encapsulation is None:
        metal = "copper" if target is not None and target.material.name == "copper" else "metal"
        hint = "add a section encapsulation; a thick or stiff film, as one of PDMS, takes a good part of the signal"
        yield Violation(f"the {metal} target is not encapsulated, and in the jaw it touches tissue", hint, "target",
                        fixes=(lambda: sealed(design.spec),))


def jaw_of(jaw: Jaw | None) -> Jaw:
    """Return the jaw for a rule that needs one."""
    assert jaw is not None
    return jaw


def pad_of(elastomer: ElastomerPad | None) -> ElastomerPad:
    """Return the elastomer for a rule that needs one."""
    assert elastomer is not None
    return elastomer


def unverified(jaw: Jaw) -> str:
    """Return a note for a finding's detail if the jaw's dimensions were not measured. Otherwise empty."""
    return "the jaw's figures are unverified: measure yours" if is_unverified(jaw.source) else ""


def on_solids(design: Design) -> Iterator[Verdict]:
    """Yield the reason that the rule needs solids, which only `build` makes."""
    yield Undecided("measured on the solids by sitscad build (mount/fit.json), not by check")


def tail_past_pin(design: Design) -> Iterator[Verdict]:
    """Yield findings on the tail's distance from the hinge's pin and the room for its bend, closed and wide open."""
    layout, jaw = design.layout, jaw_of(design.spec.jaw)
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
    """Yield a finding if the tail's end, with its stiffener, does not pass through the tube behind the jaw."""
    layout, behind = design.layout, shaft(design.spec.assembly, design.spec.jaw)
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


def judged_on_solids(document: Mapping[str, Any], device: Converter, source: SpecSource) -> tuple[Finding, ...]:
    """Return the findings on values measured by `build`, from ``mount/fit.json``. Empty for any other document."""
    found = []
    for each in document.get("measured", ()):
        if not each["kept"]:
            rule, key = JUDGED_BY[each["what"]]
            said = replace(_fault(each), key=each.get("key", key))
            if each["unit"]:
                said = replace(said, measured=each["value"], limit=each["limit"], unit=each["unit"],
                               place=Place(*each["where_m"][:2]))
            found.append(located(finding_of(_RULES[rule], said, device), source))
    return tuple(found)


def _fault(each: Mapping[str, Any]) -> Violation:
    """Return the finding on one measured value of the solids."""
    found = _contact_finding(each) or _file_finding(each)
    if found is not None:
        return found
    first, value, limit = each["first"], each["value"], each["limit"]
    under = f"the {BODY}" if first == BODY else f"the board under the {first}"
    return Violation(
        f"{under} is carried on {1e6 * value:.3g} mm2, as far as the solids go; it takes {1e6 * limit:.3g} mm2",
        "more of the mount under the board: a STEP file's datum is the middle of the face that the board is glued on",
        severity=Severity.WARNING if each["what"] == "support" else Severity.ERROR,
    )


def _contact_finding(each: Mapping[str, Any]) -> Violation | None:
    """Return the finding on two parts that meet or on a part that protrudes. None for other values."""
    first, second, value, limit = each["first"], each["second"], each["value"], each["limit"]
    x, y, z = (1e3 * along for along in each["where_m"])
    match each["what"]:
        case "interference":
            return Violation(
                f"{first} and {second} stand in each other: both take {1e9 * value:.3g} mm3 about x = {x:.2f}, y = "
                f"{y:.2f}, z = {z:.2f} mm of the board's drawing",
                "give one of them other sizes; mount/fit.json says how much (build --force), assembly.step where",
            )
        case "bend":
            return Violation(
                f"the mount reaches under the tail's bend at x = {x:.2f} mm: it takes {1e9 * value:.3g} mm3 of the rod "
                "that the tail is bent over", "end the part before it, cut it away below, or bend farther out "
                "(at, in fpc.tail.bend)", severity=Severity.WARNING,
            )
        case "port":
            return Violation(
                f"the {first} reaches {show(value, 'm')} from the closed pair's axis, the port {show(limit, 'm')}: "
                f"{show(value - limit, 'm', 3)} too far at x = {x:.2f}, y = {y:.2f}, z = {z:.2f} mm of the board's "
                "drawing", _to_round(first, value - limit),
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
    return None


def _file_finding(each: Mapping[str, Any]) -> Violation | None:
    """Return the finding on a STEP file that differs from the spec. None for other values."""
    value, limit, when = each["value"], each["limit"], each["when"]
    match each["what"]:
        case "step file":
            lacks_datum = each.get("key", "").endswith("datum")
            return Violation(when, "write the name as the file has it, or datum: [x, y, z]" if lacks_datum else "")
        case "jaw file":
            return _jaw_differs(each)
        case "jaw back" | "jaw back with room":
            return Violation(
                f"the back of the jaw in its STEP file reaches {show(value, 'm')} from the closed pair's axis, the "
                f"round back that the fit assumes {show(limit, 'm')}: SIT303 and the line fit know nothing of "
                f"{show(value - limit, 'm', 3)}", "round the file's back to the port's circle, or count on so much "
                "less room in the port", detail=when,
                severity=Severity.NOTE if each["what"] == "jaw back with room" else Severity.WARNING,
            )
        case "jaw metal" | "few jaw metal":
            return Violation(
                f"the jaw's STEP file has {1e6 * value:.3g} mm2 of metal under the coils, the estimates count "
                f"{1e6 * limit:.3g} mm2", "write the window as mount.jaw.fenestration, or mend datum, along and up",
                detail=when, severity=Severity.WARNING if each["what"] == "jaw metal" else Severity.ERROR,
            )
    return None


def _to_round(piece: str, excess: float) -> str:
    """Return the hint for a piece with a corner that protrudes from the port by a length (m)."""
    less = show(excess, "m", 3)
    if piece in ("jaw", "opposing-jaw"):
        return f"take {less} off that edge of the jaw (round its back to the port's circle), or a wider port"
    return f"take {less} off that corner: a narrower {piece}, or a lower stack"


def _jaw_differs(each: Mapping[str, Any]) -> Violation:
    """Return the finding on a dimension of a jaw's STEP file that differs from the spec.

    Its detail has the place and the solid's size.
    """
    name, detail = each["first"], each["when"]
    value, limit = (show(each[field], "m", 3) for field in ("value", "limit"))
    hint = "write what the file has, or mend the file's unit, datum, along and up"
    match name:
        case "no metal":
            message = "the jaw's STEP file has no metal under the coils"
        case "face":
            side = "above" if each["value"] > 0.0 else "below"
            value, limit = (words.removeprefix("-") for words in (value, limit))
            message = f"the face in the jaw's STEP file lies {value} {side} the face in the spec, {limit} at most"
        case "distance from the middle":
            message = f"the jaw's STEP file has its middle {value} beside the board's, {limit} at most"
        case "tip" | "heel":
            side, value = "short of" if each["value"] > 0.0 else "beyond", value.removeprefix("-")
            message = f"the {name} of the jaw in its STEP file is {value} {side} the written length's, {limit} at most"
        case "assumed face":
            return Violation(
                f"the face in the jaw's STEP file is {value} wide; a back as round as the port would leave {limit}, "
                "which the fit assumes", f"mount.jaw.face: {1e3 * each['value']:.6g}", detail=detail,
                severity=Severity.WARNING,
            )
        case "rim":
            message = f"the rim in the jaw's STEP file stands {value} above the face, the spec says {limit}"
        case _:
            message = f"the {name} of the jaw in its STEP file is {value}, the spec says {limit}"
    return Violation(message, hint, detail=detail)


def settles(document: Mapping[str, Any]) -> frozenset[str]:
    """Return the rules that a document decides."""
    return frozenset(JUDGED_BY[each["what"]][0] for each in document.get("measured", ()))


JUDGED_BY = {"interference": ("SIT320", "mount"), "bend": ("SIT320", "mount"),
             "port": ("SIT321", "mount"), "opening": ("SIT322", "mount"),
             "travel": ("SIT323", "requirements"), "bulge": ("SIT323", "requirements"), "support": ("SIT326", "mount"),
             "no support": ("SIT326", "mount"), "jaw file": ("SIT332", "mount.jaw"),
             "jaw back": ("SIT332", "mount.jaw.step"), "jaw back with room": ("SIT332", "mount.jaw.step"),
             "jaw metal": ("SIT332", "mount.jaw.step"), "few jaw metal": ("SIT332", "mount.jaw.step"),
             "step file": ("SIT333", "mount")}
"""Rule and key for each kind of measured value."""

RULES: tuple[Rule, ...] = (
    rule_of("SIT308", tail_bend, "tail"),
    rule_of("SIT309", shield_gap, "shield", "mount"),
    rule_of("SIT311", bare_metal, "target", "jaw"),
    rule_of("SIT320", on_solids, "jaw"), rule_of("SIT321", on_solids, "jaw"), rule_of("SIT322", on_solids, "jaw"),
    rule_of("SIT323", on_solids, "jaw"), rule_of("SIT324", tail_past_pin, "jaw", "tail"),
    rule_of("SIT325", end_through_shaft, "jaw", "tail"), rule_of("SIT326", on_solids, "mount"),
    rule_of("SIT332", on_solids, "jaw file"), rule_of("SIT333", on_solids, "STEP file"),
)

_RULES = {rule.id: rule for rule in RULES}
