"""SIT308, SIT309 and SIT311: the tail's bend, the shield behind the board, and bare metal; a design's measures in its
jaw, as rules judge them: nominally, by root-sum-square of tolerances, at worst.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

from sitscad.check_values import Measure
from sitscad.checks.board.fabrication import house, source_of
from sitscad.checks.rules import Rule, Undecided, Verdict, Violation, rule_of
from sitscad.data import is_unverified
from sitscad.design import Design
from sitscad.finding import Severity
from sitscad.fixes.moves import higher_seat, plated_in_holes_alone, sealed, thinner_tails
from sitscad.fixes.search import Left, first_tried, in_vain, named, setting, ways
from sitscad.geometry.path import bounding_box
from sitscad.layout.bending import bend_figure, tail_thickness
from sitscad.layout.lanes import coils_breadth
from sitscad.scene.jaws import PartsError
from sitscad.scene.stack import shield
from sitscad.spec.circuit import Tail
from sitscad.spec.materials import ElastomerPad
from sitscad.spec.mount import Jaw, Mount
from sitscad.spec.sensor import SensorSpec
from sitscad.units import counted, show

ROUNDING = 1e-9

GRAIN = 10e-6
"""Sizes and margins that are named are whole multiples of it (m): nobody cuts finer."""


def tail_bend(design: Design) -> Iterator[Verdict]:
    """The tail's bend through a hinge: its layers, and the radius that it needs."""
    spec, tail, figure = design.spec, design.spec.fpc.tail, bend_figure(design.spec.fpc)
    assert tail is not None
    if tail.bend == "none":
        return
    if tail.bend == "dynamic" and tail.layers > 1:
        yield Violation(
            f"the tail bends at every grasp (dynamic) and has {tail.layers} copper layers",
            "fewer copper layers through the hinge (fpc.tail.layers), or one bend at assembly (bend: static)",
            "fpc.tail.layers", float(tail.layers), 2.0 if tail.layers > 2 else 1.0, "copper layers",
            severity=Severity.ERROR if tail.layers > 2 else Severity.WARNING, advice=lambda left: _calmer(spec, left),
        )
    if tail.bend == "dynamic" and spec.fpc.copper != "rolled-annealed":
        yield Violation(
            f"the tail bends at every grasp (dynamic), and its foil is {spec.fpc.copper}, which cracks after fewer "
            "bends", "fpc.copper: rolled-annealed, its grain along the tail; or bend it once (bend: static)",
            "fpc.copper", severity=Severity.WARNING,
        )
    if figure is None:
        yield Undecided(f"{spec.fpc.rules.name} states no bend radius for a {tail.bend} bend")
    else:
        yield from _bend_radius(design, tail, *figure)


def _bend_radius(design: Design, tail: Tail, field: str, ratio: float) -> Iterator[Verdict]:
    """The radius that is wanted, or that so thick a tail needs by a figure of the fabricator's, inside the port."""
    thickness, mount = tail_thickness(design.spec.fpc), design.spec.mount
    room = mount.jaw.port_diameter / 2.0 if mount is not None and mount.jaw is not None else None
    radius, stated = ratio * thickness, tail.bend_radius or 0.0
    if room is None:
        yield Undecided("no jaw: the room for the tail's bend is not known")
    elif stated > max(radius, room + ROUNDING):
        yield Violation(
            f"a bend of {show(stated, 'm', 3)} inside radius is wanted; inside the port there are {show(room, 'm', 3)}",
            f"fpc.tail.bend.radius: {show(max(radius, min(stated, room)), 'm', 3)}, or leave it out",
            "fpc.tail.bend.radius", stated, room, "m", severity=Severity.WARNING,
        )
    elif radius > room + ROUNDING:
        hint = ("a thinner tail, of fewer copper layers (fpc.tail.layers) or plated in its holes alone (fpc.plated: "
                "buttons), or no bend")
        yield Violation(
            f"a {tail.bend} bend of {counted(tail.layers, 'copper layer')} needs a radius of {show(radius, 'm', 3)} "
            f"({house(design.spec.fpc.rules, field)} asks {ratio:g} times the {show(thickness, 'm', 3)} tail); inside "
            f"the port there are {show(room, 'm', 3)}", hint, "fpc.tail.bend", radius, room, "m",
            severity=Severity.WARNING if tail.bend != "static" or tail.layers > 2 else Severity.NOTE,
            source=source_of(design.spec.fpc.rules, field), advice=lambda left: first_tried(
                [list(thinner_tails(design.spec)), list(plated_in_holes_alone(design.spec))], hint)(left),
        )


def _calmer(spec: SensorSpec, left: Left) -> str:
    # One copper layer through the hinge, or a bend made once: those that are possible; and two instead of more, which
    # are a warning yet.
    thinner, once = list(thinner_tails(spec))[::-1], [setting(spec, "fpc.tail.bend", "static", "static")]
    found = ways(([change] for change in (*thinner, *once)), left)
    milder = [f"{fix.words} leaves a warning" for fix in thinner if left(fix) == ("SIT308",)]
    if found:
        return "; or ".join((f"{named(found)} mends it", *milder)) + " (it was tried)"
    if left.is_cut_short:
        return ""
    return f"one copper layer through the hinge, or a bend made once: {in_vain((*thinner, *once), left)}"


def shield_gap(design: Design) -> Iterator[Verdict]:
    """The shield lies between the board and the jaw's metal, and under all coils, though the port may make it narrower
    than the body.
    """
    part, mount, (_, y0, _, y1) = design.spec.shield, design.spec.mount, design.layout.body
    assert part is not None and mount is not None
    with suppress(PartsError):  # it stands in the jaw's metal, which is said below
        sheet = shield(design.layout)
        assert sheet is not None
        (_, low, _, high), middle, coils = bounding_box((sheet.outline(),)), (y0 + y1) / 2, coils_breadth(design.spec)
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
    if needed > mount.standoff + ROUNDING:
        yield Violation(
            f"the shield ends {show(needed, 'm')} below the board's bottom, {'the jaw' if mount.jaw else 'the mount'} "
            f"begins at {show(mount.standoff, 'm')}",
            f"raise mount.standoff by {show(needed - mount.standoff, 'm')} at least, or bring the shield nearer to "
            "the board", "shield.gap", needed, mount.standoff, "m",
            advice=first_tried([[higher_seat(design.spec, needed)]], "a higher seat, or a nearer shield"),
        )


def bare_metal(design: Design) -> Iterator[Verdict]:
    """A target that touches tissue is sealed."""
    target = design.spec.target
    if design.spec.encapsulation is None:
        metal = "copper" if target is not None and target.material.name == "copper" else "metal"
        hint = "add a section encapsulation; a thick or stiff film, as one of PDMS, takes a good part of the signal"
        yield Violation(f"the {metal} target is not encapsulated, and in the jaw it touches tissue", hint, "target",
                        advice=first_tried([list(sealed(design.spec))], hint))


def jaw_of(mount: Mount | None) -> Jaw:
    """The jaw of a rule that needs one."""
    assert mount is not None and mount.jaw is not None
    return mount.jaw


def pad_of(spec: SensorSpec) -> ElastomerPad:
    """The elastomer of a rule that needs one."""
    assert spec.elastomer is not None
    return spec.elastomer


def unverified(jaw: Jaw) -> str:
    """What a finding has to add in its detail where the jaw's figures are not measured ones."""
    return "the jaw's figures are unverified: measure yours" if is_unverified(jaw.source) else ""


JAW_SOURCE = "the jaw's figures (mount.jaw); thesis of Jones 2.5: jaw about 5 mm wide, sensing body 5 x 10 mm"


def measure_of(design: Design, name: str) -> Measure | None:
    """One of the design's measures; None where it was not taken."""
    return next((measure for measure in design.fit if measure.name == name), None)


def weight_of(measure: Measure) -> Severity | None:
    """An error where it is too much nominally or by root-sum-square, a warning where it is at worst."""
    if max(measure.nominal, measure.root_sum_square) > measure.limit + ROUNDING:
        return Severity.ERROR
    return Severity.WARNING if measure.worst > measure.limit + ROUNDING else None


def with_tolerances(measure: Measure) -> str:
    """What tolerances make of a size, in words."""
    likely, worst = (show(value, "m", 4) for value in (measure.root_sum_square, measure.worst))
    return f" ({likely} by root-sum-square of all tolerances, {worst} at worst)"


RULES: tuple[Rule, ...] = (
    rule_of("SIT308", tail_bend, "tail"),
    rule_of("SIT309", shield_gap, "shield", "mount"),
    rule_of("SIT311", bare_metal, "target", "jaw"),
)
