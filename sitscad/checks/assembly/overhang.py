"""SIT307, SIT317 and SIT318: target on elastomer, elastomer on board, parts on their sheet, board on the finger."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import replace
from functools import partial

from sitscad.assembly.places.bodies import Body, PartsError, film_thickness, plates_of
from sitscad.assembly.places.stack import shield_part
from sitscad.basics.finding import Edit, Severity
from sitscad.basics.units import show
from sitscad.checks.assembly.fit import GRAIN
from sitscad.checks.assembly.plates import (
    MOST_MARGIN,
    cut_to_board,
    grow_box,
    larger_pad,
    lowest_plates,
    more_margin,
    pad_under_target,
    pair_text,
    plates_lie_on_body,
)
from sitscad.checks.fixes.moves import larger_body, reread_changes
from sitscad.checks.fixes.search import Family, Fix
from sitscad.checks.rules import ROUNDING, Rule, Verdict, Violation, rule_of, violation_of
from sitscad.estimates.design import Design
from sitscad.kernels.geometry.convex import signed_distance
from sitscad.kernels.geometry.path import Path
from sitscad.layout.laser_sheet import cut_parts, is_laser_cut, laser_limit, nests, sheet_needed
from sitscad.spec.materials import Cutting
from sitscad.spec.mount import Mount
from sitscad.spec.sensor import SensorSpec

FACTORS = (1, 2, 3)
"""Factors by which the computed increase of the body's margin is multiplied, in the order of trial.

Factor 1 is sufficient, unless the jaw is so short that the body can grow on one side only.
"""

ENDS = ("far end", "lower side", "tail's end", "upper side")
"""Names of a body's sides, in the order of a box (x_min, y_min, x_max, y_max)."""


def overhang(design: Design) -> Iterator[Verdict]:
    """Yield findings on a target that extends beyond its elastomer, and on lowest plates that extend beyond the body.

    The lowest plates are the elastomers, or the targets if there are no elastomers. The plates with the film around
    them are compared with the body's outline.
    """
    spec, body = design.spec, design.layout.body_outline
    pad, plate, round_it = plates_of(spec).elastomer, plates_of(spec).target, film_thickness(spec.encapsulation)

    def complaint(case: str, low: Body, carrier: Path, key: str, over: float, box: tuple[float, ...],
                  on: tuple[float, ...], details: tuple[str, ...] = ()) -> Violation:
        # an error if a piece's middle lies beside its support: it falls off, and the numbers do not apply
        beside = signed_distance(carrier, low.footprint.centre) > 0.0
        sides = _overhang_texts(box, on)
        (x0, y0, x1, y1), (x, y), jaw = design.layout.body, spec.array.middle, spec.jaw
        offset = [abs((x0 + x1) / 2 - x), abs((y0 + y1) / 2 - y)]
        # direction in which the jaw limits the body's growth
        limits = "overhang-jaw-length" if offset[0] >= offset[1] else "overhang-jaw-width"
        is_limited = case != "overhang-target" and jaw is not None and max(offset) >= GRAIN
        return violation_of(
            case, key, over, 0.0, "m", details=("overhang-sides" if sides else "overhang-corners",
                                                *[limits] * is_limited),
            severity=Severity.ERROR if beside else Severity.WARNING, fixes=_fixes_that_fit_plates_on_body(design),
            sides=sides, part=low.role.value, body_key=spec.fpc.body_key, aside=max(offset),
            length=0.0 if jaw is None else jaw.length, width=0.0 if jaw is None else jaw.width,
        )

    if pad is not None and plate is not None and (over := plate.footprint.overhang_beyond(pad.outline())) > ROUNDING:
        yield complaint("overhang-target", plate, pad.outline(), "elastomer.size", over, plate.footprint.box,
                        pad.footprint.box)
    low = max(lowest_plates(plates_of(spec)), key=lambda each: each.footprint.overhang_beyond(body), default=None)
    overlap = -math.inf if low is None else low.footprint.overhang_beyond(body)
    if low is None or overlap + round_it <= ROUNDING:
        return
    beside, name = 0.0 if overlap > ROUNDING else round_it, low.role.value
    yield complaint("overhang-film" if beside else "overhang-plate", low, body, f"{name}.size", overlap + beside,
                    grow_box(low.footprint.box, beside), design.layout.body)


def _overhang_texts(box: tuple[float, ...], on: tuple[float, ...]) -> list[str]:
    """Return a text for each side at which `box` extends beyond the box `on` below it, with the excess length.

    Boxes are (x_min, y_min, x_max, y_max; m). Empty if the box extends only beyond rounded corners.
    """
    out = [sign * (on[i] - box[i]) for i, sign in enumerate((1.0, 1.0, -1.0, -1.0))]
    return [f"{show(by, 'm', 3)} at the {end}" for by, end in zip(out, ENDS, strict=True) if by > ROUNDING]


def _fixes_that_fit_plates_on_body(design: Design) -> tuple[Family, ...]:
    """Return families of changes after which target and pad lie completely on the body.

    The first families leave the body as it is: a larger pad, and a pad moved under the target. A larger body and
    smaller plates follow.
    """
    spec, body = design.spec, design.layout.body_outline

    def lying(fixes: Iterable[Fix]) -> Iterator[Fix]:
        for fix in fixes:
            if plates_lie_on_body(plates_of(fix.spec), film_thickness(fix.spec.encapsulation), body):
                yield fix

    return (lambda: lying(larger_pad(spec)), lambda: lying(pad_under_target(spec)), lambda: _larger_bodies(design),
            lambda: lying(cut_to_board(spec, body)))


def _larger_bodies(design: Design) -> Iterator[Fix]:
    """Yield changes to a body large enough for the plates.

    If the elastomer does not carry the whole target, each change also enlarges the elastomer.
    """
    first = next(larger_pad(design.spec), Fix((), design.spec))
    changed, also = first.spec, first.edits
    layout, lows, film = design.layout, lowest_plates(plates_of(changed)), film_thickness(changed.encapsulation)
    if changed.fpc.body is not None and lows:
        over = max(low.footprint.overhang_beyond(layout.body_outline) for low in lows) + film
        fix = larger_body(changed, GRAIN * math.ceil(over / GRAIN))
        edge = fix.spec.body_outline
        if fix.edits and edge is not None and plates_lie_on_body(plates_of(fix.spec), film, edge):
            yield replace(fix, edits=(*fix.edits, *also))
        return
    now, places = changed.fpc.margin, [low.footprint for low in lows]
    needed = more_margin(places, film, changed.fpc, changed.coil.trace_width, layout.body)
    for factor in FACTORS:
        margin = tuple(round(present + factor * (more - present), 9) for present, more in zip(now, needed, strict=True))
        if max(margin) <= MOST_MARGIN:
            x, y = margin
            written = f"{x * 1e3:.6g}" if x == y else pair_text((x, y))
            yield Fix((Edit("fpc.margin", written), *also), replace(changed, fpc=replace(changed.fpc, margin=(x, y))))


def laser_sheet(design: Design) -> Iterator[Verdict]:
    """Yield findings on cut parts (pad, target, shield) that do not fit on the sheet from which they are cut.

    The width of the cut (kerf) and a test piece for it (kerf coupon) need room on the sheet, too. Further findings are
    on a gap between copies of a part that is no wider than the cut, and on metal that no known laser cuts.
    """
    spec, cutting, boards = design.spec, design.spec.cutting, design.spec.fpc.boards or 1
    yield from _uncut_target(spec)
    if boards == 1 and cutting == Cutting():
        return  # a single part has its own drawing and no sheet
    cut = [*cut_parts(spec)]
    with suppress(PartsError):  # another rule reports a shield that does not fit
        cut += shield_part(design.layout)
    for plate in cut:
        needed = sheet_needed(plate.size, plate.kerf)
        short = next(((needs, has) for needs, has in zip(needed, cutting.sheet, strict=True)
                      if needs > has + ROUNDING), None)
        if short is not None:
            x, y = (max(pair) * 1e3 for pair in zip(needed, cutting.sheet, strict=True))
            yield violation_of("sheet-size", "cutting.sheet", *short, "m", part=plate.part, x=f"{x:.6g}", y=f"{y:.6g}")
        elif (nests(plate.size, plate.kerf, cutting, plate.count * boards)[0].count > 1
              and cutting.gap <= plate.kerf + ROUNDING):
            yield violation_of("sheet-gap", "cutting.gap", cutting.gap, plate.kerf, "m", part=plate.part,
                               fixes=(partial(reread_changes, spec, "cutting.gap", [1.5]),))


def _uncut_target(spec: SensorSpec) -> Iterator[Violation]:
    """Yield a note if no laser service known to sitscad cuts the target's metal at the target's thickness."""
    plate = spec.target
    if plate is None or is_laser_cut(plate.material.name, plate.thickness):
        return
    most, name = laser_limit(plate.material.name), plate.material.name
    assert most is not None
    yield violation_of(
        "laser-metal", "target.thickness", plate.thickness, most, "m", severity=Severity.NOTE, metal=name,
        most=f"{1e3 * most:.3g}",
        fixes=(partial(reread_changes, spec, "target.thickness", [float(f"{1e3 * most:.3g}")]),),
    )


def finger_carries(body_size: tuple[float, float], mount: Mount | None) -> Iterator[Verdict]:
    """Yield a finding if the board's body is wider than the finger on which the mount's cap is put."""
    width = body_size[1]
    if mount is not None and mount.finger is not None and width > mount.finger.size[0] + ROUNDING:
        has = mount.finger.size[0]
        yield violation_of("finger-width", "mount.finger.size", width, has, "m", beside=(width - has) / 2,
                           missing=width - has, details=("finger-metal",) if mount.finger.material else ())


RULES: tuple[Rule, ...] = (
    rule_of("SIT307", overhang, "plate"), rule_of("SIT317", laser_sheet),
    rule_of("SIT318", lambda design: finger_carries(design.layout.body_size, design.spec.mount), "mount"),
)
