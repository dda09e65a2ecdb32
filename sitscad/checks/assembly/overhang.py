"""SIT307, SIT317 and SIT318: the target lies on the elastomer and that on the board's body, each in its place, and what
would do; parts lie on the sheet that they are cut from, and the board on the finger that carries it.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

from sitscad.checks.assembly import room_in_jaw, transduction
from sitscad.checks.assembly.fit import GRAIN, ROUNDING
from sitscad.checks.assembly.plates import (
    MOST_MARGIN,
    PROPORTIONS,
    carried,
    cut_to_board,
    grown,
    lies,
    lowest,
    more_margin,
    moved,
    pair,
)
from sitscad.checks.rules import Case, Rule, Verdict, apply_rule, rule_of
from sitscad.design import Design
from sitscad.finding import Edit, Severity
from sitscad.geometry.convex import beyond
from sitscad.geometry.path import Path
from sitscad.layout.laser_sheet import CutPart, cut_parts, nests, sheet_needed
from sitscad.layout.outline import edge_of_body
from sitscad.remedy.moves import larger_body
from sitscad.remedy.search import Fix, Left
from sitscad.scene.bodies import Body, elastomer, film_thickness, target
from sitscad.scene.jaws import PartsError
from sitscad.scene.stack import ground, shield_part
from sitscad.spec.materials import Cutting
from sitscad.spec.places import cell_specs
from sitscad.units import show

QUICK = ("SIT301", "SIT302", "SIT303", "SIT304", "SIT312")
"""Other rules that look at plates or body and need no electrical numbers; and SIT306, which looks at the target."""

TRIES = 3
"""Margins that are tried: one is enough unless a short jaw keeps the body from growing about the coils."""

ENDS = ("far end", "lower side", "tail's end", "upper side")
"""The sides of a body in the order of a bounding box."""


UNSUPPORTED = "an unsupported edge bends and tilts the target"
UNBONDED = "what hangs over is neither bonded nor supported"


def overhang(design: Design) -> Iterator[Verdict]:
    """What hangs over what it lies on: the target over the elastomer, the lower of both or its film over the body."""
    spec, body = design.spec, ground(design.layout)
    pad, plate, round_it = elastomer(spec), target(spec), film_thickness(spec)
    if pad is not None and plate is not None and (over := plate.footprint.hangs_over(pad.outline())) > ROUNDING:
        yield TARGET_OVER_ELASTOMER.found(
            "elastomer.size", over, 0.0, "m", severity=_severity(plate, pad.outline()),
            advice=lambda left: f"{UNSUPPORTED}: {_in_words(design, left)}", length=_length(over),
            where=_where(plate.footprint.box, pad.footprint.box, "corners"), in_words=_in_words(design),
        )
    lows = [found for cell in cell_specs(spec) if (found := lowest(cell)) is not None]
    low = max(lows, key=lambda one: one.footprint.hangs_over(body), default=None)
    if low is None or low.footprint.hangs_over(body) + round_it <= ROUNDING:
        return
    beside = 0.0 if low.footprint.hangs_over(body) > ROUNDING else round_it
    over = low.footprint.hangs_over(body) + beside
    yield PLATE_OVER_BODY.found(
        f"{low.name}.size", over, 0.0, "m", severity=_severity(low, body),
        advice=lambda left: f"{UNBONDED}: {_in_words(design, left)}", film="encapsulation round the " if beside else "",
        name=low.name, length=_length(over),
        where=_where(grown(low.footprint.box, beside), design.layout.body, "corners"),
        jaw_in_the_way=_jaw_in_the_way(design), in_words=_in_words(design),
    )


def _severity(body: Body, carrier: Path) -> Severity:
    """An error where the middle of a piece lies beside what carries it: it falls off, and no number is that of it."""
    return Severity.ERROR if beyond(carrier, body.footprint.centre) > 0.0 else Severity.WARNING


def _length(over: float) -> str:
    return show(over, "m", 3)


def _where(box: tuple[float, ...], on: tuple[float, ...], corners: str) -> str:
    """At which sides of what it lies on a box stands out, and how far; at the corners where it does at no side."""
    out = [sign * (on[i] - box[i]) for i, sign in enumerate((1.0, 1.0, -1.0, -1.0))]
    sides = [f"{_length(by)} at the {end}" for by, end in zip(out, ENDS, strict=True) if by > ROUNDING]
    if len(sides) < 2:
        return f"at the {next((e for by, e in zip(out, ENDS, strict=True) if by > ROUNDING), corners)}"
    return f"({', '.join(sides)})"


def _jaw_in_the_way(design: Design) -> str:
    """That the body stops growing about the coils at the jaw's end or sides, where it does."""
    (x0, y0, x1, y1), (x, y), mount = design.layout.body, design.spec.array.middle, design.spec.mount
    beside = [abs((x0 + x1) / 2 - x), abs((y0 + y1) / 2 - y)]
    if mount is None or mount.jaw is None or max(beside) < GRAIN:
        return ""
    word, size = ("long", mount.jaw.length) if beside[0] >= beside[1] else ("wide", mount.jaw.width)
    return (
        f"; the body's middle stands {_length(max(beside))} beside the mean of the coils' centres, because the jaw, "
        f"{show(size, 'm')} {word}, leaves it no room to grow to the other side"
    )


def _in_words(design: Design, left: Left | None = None) -> str:
    """Changes with which everything lies on what carries it, and what else then complains; with a larger body where
    that may be drawn.
    """
    drawn = "drawn anew" if left else "as it is drawn"
    return design.once(f"plates on the board {drawn}", lambda: _told(design, left))


def _told(design: Design, left: Left | None) -> str:
    """What makes the plates lie on the board's body, and where nothing does, what comes nearest; in words."""
    before, body = _other_complaints(design), ground(design.layout)
    larger = [c for c in carried(design.spec) if lies(c.spec, body)]
    aside = [c for c in moved(design.spec) if lies(c.spec, body)]
    cut = [c for c in cut_to_board(design.spec, body) if lies(c.spec, body)]
    found: list[str] = []
    broken: list[tuple[tuple[str, ...], Fix]] = []
    for way in (larger, aside, [] if larger or left is None else list(_widened(design, left)), [] if larger else cut):
        for change in way:
            layout = design.drawn(change.spec).layout if left is None else left.drawn(change.spec)
            if layout is None:
                continue
            breaks = tuple(sorted(_other_complaints(Design(change.spec, layout)) - before))
            if not breaks:
                found.append(change.words)
                if left is not None:
                    left.mends(change)
                break
            broken.append((breaks, change))
    if found:
        return f"{'; or '.join(found)} fits on the board's body"
    if not broken:
        return f"move it onto the body, or make the body larger ({design.spec.fpc.body_key})"
    breaks, change = broken[-1]
    softer = "; take a stiffer elastomer with it" if {"SIT304", "SIT312"} & set(breaks) else ""
    larger_body = f"; a larger body ({design.spec.fpc.body_key}) may carry them as they are" if left is None else ""
    return (
        f"{change.words} fits on the board's body, but the smaller plates break {', '.join(breaks)}, and none larger "
        f"lies on it{softer}{larger_body}"
    )


def _widened(design: Design, left: Left) -> Iterator[Fix]:
    """The body made larger all round until what lies on it has room, the elastomer carrying the target."""
    changed, also = design.spec, tuple[Edit, ...]()
    for fix in carried(design.spec):
        changed, also = fix.spec, fix.edits
        break
    layout, low = design.layout, lowest(changed)
    if changed.fpc.body is not None and low is not None:
        over = low.footprint.hangs_over(ground(layout)) + film_thickness(changed)
        fix = larger_body(changed, GRAIN * math.ceil(over / GRAIN))
        edge = edge_of_body(fix.spec)
        if fix.edits and edge is not None and lies(fix.spec, edge):
            yield replace(fix, edits=(*fix.edits, *also))
        return
    for _ in range(TRIES):
        margin = more_margin(changed, layout.body)
        if max(margin) > MOST_MARGIN:
            return
        changed = replace(changed, fpc=replace(changed.fpc, margin=margin))
        wider = left.drawn(changed)
        if wider is None:
            return
        layout = wider
        if lies(changed, ground(layout)):
            said = f"{margin[0] * 1e3:.6g}" if margin[0] == margin[1] else pair(margin)
            yield Fix((Edit("fpc.margin", said), *also), changed)
            return


def _other_complaints(design: Design) -> Counter[str]:
    """How often those rules complain that look at plates or body and need no electrical numbers."""
    asked = (rule for rule in (*room_in_jaw.RULES, *transduction.RULES) if rule.id in QUICK)
    said = (finding for rule in (*asked, PROPORTIONS) for finding in apply_rule(rule, design)[0])
    return Counter(finding.rule for finding in said if finding.severity is not Severity.NOTE)


TARGET_OVER_ELASTOMER = Case(
    "the target overhangs the elastomer by {length} {where}",
    hint="an unsupported edge bends and tilts the target: {in_words}",
)

PLATE_OVER_BODY = Case(
    "the {film}{name} hangs over the board's body by {length} {where}{jaw_in_the_way}",
    hint="what hangs over is neither bonded nor supported: {in_words}",
)


def laser_sheet(design: Design) -> Iterator[Verdict]:
    """Elastomer, target and shield, each with its kerf and the coupon beside it, on the sheet; and something between
    two copies that lie side by side.
    """
    spec = design.spec
    if (spec.fpc.boards or 1) == 1 and spec.cutting == Cutting():
        return  # one part is its own drawing, and nothing is said of sheets
    for plate in _cut(design):
        needed = sheet_needed(plate.size, plate.kerf)
        for needs, has in zip(needed, spec.cutting.sheet, strict=True):
            if needs > has + ROUNDING:
                wanted = [max(pair) * 1e3 for pair in zip(needed, spec.cutting.sheet, strict=True)]
                yield SHEET_TOO_SMALL.found("cutting.sheet", needs, has, "m", name=plate.part, x=wanted[0], y=wanted[1])
                break
        else:
            copies = nests(plate.size, plate.kerf, spec.cutting, plate.count * (spec.fpc.boards or 1))
            if copies[0].count > 1 and spec.cutting.gap <= plate.kerf + ROUNDING:
                yield CUTS_MEET.found("cutting.gap", spec.cutting.gap, plate.kerf, "m", name=plate.part)


def _cut(design: Design) -> tuple[CutPart, ...]:
    """What is cut out of sheets; without a shield that does not fit, which is said by another rule."""
    try:
        return (*cut_parts(design.spec), *shield_part(design.layout))
    except PartsError:
        return cut_parts(design.spec)


def finger_carries(design: Design) -> Iterator[Verdict]:
    """The board's body across the finger that a cap slips over."""
    mount = design.spec.mount
    finger = mount.finger if mount is not None else None
    width, endless = design.layout.body_size[1], ", and the estimate takes its metal as endless"
    if finger is not None and width > finger.size[0] + ROUNDING:
        yield WIDER_THAN_FINGER.found("mount.finger.size", width, finger.size[0], "m",
                                      over=(width - finger.size[0]) / 2, thin=endless if mount and mount.metal else "")


SHEET_TOO_SMALL = Case(
    "the {name} with its kerf and the coupon beside it take {measured:m,4} of a sheet that has {limit:m,4} there",
    "cutting.sheet: [{x:.6g}, {y:.6g}] or larger, the size of yours",
)

CUTS_MEET = Case(
    "copies of the {name} lie so near each other that their cuts are {measured:m} apart, and the beam takes {limit:m}: "
    "nothing stays between them, and an edge is cut twice",
    "leave sheet between them that holds: cutting.gap 1.5 or more",
)

WIDER_THAN_FINGER = Case(
    "the board's body is {measured:m,3} wide, the finger {limit:m,3}: the cap carries {over:m,3} of it on each side "
    "beyond the finger, where it bends under load{thin}", "a wider finger (mount.finger.size), or a narrower board",
)


RULES: tuple[Rule, ...] = (
    rule_of("SIT307", overhang, "plate"),
    rule_of("SIT317", laser_sheet),
    rule_of("SIT318", finger_carries, "mount"),
)
