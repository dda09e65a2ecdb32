"""SIT104 to SIT106 and SIT116: holes and parts against what the fabricator can make."""

from __future__ import annotations

from collections.abc import Iterator

from sitscad.checks.cases import Case
from sitscad.checks.rules import Rule, Verdict
from sitscad.data import is_unverified
from sitscad.design import Design
from sitscad.finding import Place, Severity
from sitscad.layout.panel import FEWEST_BRIDGES, bridges, is_wanted, least_size, narrower_bridge
from sitscad.units import show

ROUNDING = 1e-9
"""Lengths that differ by less than this (m) are equal: a nanometre is rounding, not a breach."""

FABRICATOR = "the fabricator's design rules (fpc.rules)"


def via_drill(design: Design) -> Iterator[Verdict]:
    """Every drill against the fabricator's smallest."""
    rules = design.spec.fpc.rules
    for via in design.layout.vias:
        if via.drill < rules.via_drill - ROUNDING:
            yield TOO_FINE_A_DRILL.found(
                "fpc.rules", via.drill, rules.via_drill, "m", source=source_of(design, "via_drill"),
                place=Place(*via.centre, nets=(via.net,)), net=via.net, house=house(design, "via_drill"),
            )


def annular_ring(design: Design) -> Iterator[Verdict]:
    """The copper left round every drill."""
    rules = design.spec.fpc.rules
    for via in design.layout.vias:
        ring = (via.pad - via.drill) / 2.0
        if ring < rules.annular_ring - ROUNDING:
            yield NARROW_RING.found("fpc.rules", ring, rules.annular_ring, "m",
                                    source=source_of(design, "annular_ring"), place=Place(*via.centre, nets=(via.net,)),
                                    net=via.net, house=house(design, "annular_ring"),
                                    wanted=via.drill + 2.0 * rules.annular_ring)


def hole_to_hole(design: Design) -> Iterator[Verdict]:
    """The wall between every two drilled holes."""
    rules, vias = design.spec.fpc.rules, design.layout.vias
    for k, via in enumerate(vias):
        for other in vias[k + 1 :]:
            wall = via.centre.distance(other.centre) - (via.drill + other.drill) / 2.0
            if wall < rules.hole_to_hole - ROUNDING:
                yield HOLES_TOO_NEAR.found(
                    "coil.turns", wall, rules.hole_to_hole, "m", source=source_of(design, "hole_to_hole"),
                    place=Place((via.centre.x + other.centre.x) / 2.0, (via.centre.y + other.centre.y) / 2.0,
                                nets=tuple(sorted({via.net, other.net}))), net=via.net, net2=other.net,
                    house=house(design, "hole_to_hole"), missing=rules.hole_to_hole - wall,
                )


def part_size(design: Design) -> Iterator[Verdict]:
    """The whole outline against the smallest part that the fabricator handles."""
    rules = design.spec.fpc.rules
    x0, y0, x1, y1 = outline_box(design)
    have, need = sorted((x1 - x0, y1 - y0)), sorted(rules.part_size)
    for size, smallest in zip(have, need, strict=True):
        if size < smallest - ROUNDING:
            in_panel = is_wanted(design.layout)
            yield (SMALL_BUT_IN_PANEL if in_panel else SMALL).found(
                "fpc.rules" if in_panel else "fpc.panel", size, smallest, "m", source=source_of(design, "part_size"),
                name=design.spec.name, length=have[1], width=have[0], house=house(design, "part_size"),
                least_length=need[1], least_width=need[0],
            )
            break
    if is_wanted(design.layout):
        yield from _panel_size(design, LARGE_PANEL, least_size(design.layout))
        yield from _too_few_bridges(design)
    elif not is_unverified(source_of(design, "panel_size")):
        yield from _panel_size(design, LARGE_BOARD, (x1 - x0, y1 - y0))


def _too_few_bridges(design: Design) -> Iterator[Verdict]:
    """Bridges too wide for the part's edge find too few places, and the part drops out of its panel."""
    layout, width = design.layout, design.spec.fpc.panel.bridge
    count = len(bridges(layout))
    if count >= FEWEST_BRIDGES:
        return
    least = narrower_bridge(layout)
    held = {0: "no bridge holds", 1: "only 1 bridge holds"}.get(count, f"only {count} bridges hold")
    yield TOO_FEW_BRIDGES.found(
        "fpc.panel.bridge",
        float(count),
        float(FEWEST_BRIDGES),
        None,
        hint=f"fpc.panel.bridge: {least * 1e3:.1f} mm finds places enough (it was tried)"
        if least
        else "no narrower bridge finds places enough either: a larger board, or fpc.panel: none",
        source="two bridges are a hinge, three hold a part in its plane",
        held=held,
        width=width,
        fewest_bridges=FEWEST_BRIDGES,
    )


def _panel_size(design: Design, case: Case, size: tuple[float, float]) -> Iterator[Verdict]:
    """A complaint where what is delivered (m) is larger than the fabricator's panel."""
    rules, have, most = design.spec.fpc.rules, sorted(size), sorted(design.spec.fpc.rules.panel_size)
    for side, largest in zip(have, most, strict=True):
        if side > largest + ROUNDING:
            yield case.found("fpc.rules" if case is LARGE_BOARD else "fpc.panel", side, largest, "m",
                             source=source_of(design, "panel_size"), length=size[0], width=size[1],
                             house=house(design, "panel_size"), most_length=rules.panel_size[0],
                             most_width=rules.panel_size[1])
            return


def outline_box(design: Design) -> tuple[float, float, float, float]:
    """(x_min, y_min, x_max, y_max) in metres of the whole board."""
    points = [point for segment in design.layout.outline for point in segment.flattened(1e-6)]
    xs, ys = [p.x for p in points], [p.y for p in points]
    return min(xs), min(ys), max(xs), max(ys)


def um(length: float) -> str:
    """A length for people."""
    return show(length, "m")


def house(design: Design, field: str) -> str:
    """Who asks for one figure: the profile that it stands in, a user's with file and line; marked if not verified."""
    rules = design.spec.fpc.rules
    mark = " (unverified)" if is_unverified(source_of(design, field)) else ""
    return rules.holder(field) + mark


def source_of(design: Design, field: str) -> str:
    """Where one figure of the fabricator's rules comes from."""
    rules = design.spec.fpc.rules
    return rules.sources.get(field) or rules.source or FABRICATOR


def gap_asked_by(design: Design, asked: float) -> tuple[str, str]:
    """Who asks for a gap between copper (m), and where that stands: the spec itself where it is its turns' own spacing,
    which is narrower than the fabricator's.
    """
    if asked < design.spec.fpc.rules.trace_spacing - ROUNDING:
        return "the spec (coil.trace_spacing)", "coil.trace_spacing in the spec"
    return house(design, "trace_spacing"), source_of(design, "trace_spacing")


TOO_FINE_A_DRILL = Case("a via of {net} is drilled {measured:m}; {house} drills {limit:m} and larger",)

NARROW_RING = Case(
    "a via of {net} has an annular ring of {measured:m}; {house} asks {limit:m}", hint="a pad of {wanted:m} is needed",
)

HOLES_TOO_NEAR = Case(
    "two holes ({net}, {net2}) leave {measured:m} between them; {house} asks {limit:m}",
    hint="move them {missing:m} apart: a larger inner diameter gives the room",
)

SMALL = Case(
    "the board is {length:m} x {width:m}; {house} handles parts from {least_length:m} x {least_width:m}, and it is not "
    "in a panel", hint="fpc.panel: auto puts it in a panel, held by bridges", severity=Severity.WARNING,
)

SMALL_BUT_IN_PANEL = Case(
    "the board is {length:m} x {width:m}; {house} handles parts from {least_length:m} x {least_width:m}: so it is put "
    "in a panel, which is ordered instead",
    hint="send fpc/{name}-order.zip, which holds the panel and not the single board (its drawing is "
    "fpc/panel/{name}-panel-drawing.pdf), and cut the parts out yourself", severity=Severity.NOTE,
)

TOO_FEW_BRIDGES = Case(
    "{held} the part in its panel: the edge has no more places for bridges {width:m} wide off contacts, stiffener and "
    "bend; {fewest_bridges} are needed", severity=Severity.ERROR,
)

LARGE_PANEL = Case(
    "the panel becomes at least {length:m} x {width:m}; {house} makes panels of {most_length:m} x {most_width:m}",
    hint="fewer parts a panel, a shorter tail, or fpc.panel: none", severity=Severity.WARNING,
)

LARGE_BOARD = Case(
    "the board is {length:m} x {width:m}; {house} makes panels of {most_length:m} x {most_width:m}, out of which a "
    "board that is sold singly is cut, too", hint="a smaller board or a shorter tail, or a fabricator of larger panels",
    severity=Severity.WARNING,
)


FABRICATION_RULES: tuple[Rule, ...] = (
    Rule("SIT104", "via-drill", Severity.ERROR, "Every via is drilled at least as large as the fabricator drills.",
         "A smaller hole is not plated through.", "Use the fabricator's smallest drill or larger.", FABRICATOR,
         apply=via_drill),
    Rule("SIT105", "annular-ring", Severity.ERROR, "Every via keeps the fabricator's copper ring round its hole.",
         "Drill and image are not in register: too small a ring is broken through and the joint is open.",
         "Enlarge the pad, or use a smaller drill.", FABRICATOR, apply=annular_ring),
    Rule("SIT106", "hole-to-hole", Severity.ERROR, "Drilled holes leave the fabricator's wall between them.",
         "A thinner wall tears, or the drill runs into the neighbouring hole.",
         "Give the vias more room: fewer turns, a larger coil, or fewer layers.", FABRICATOR, apply=hole_to_hole),
    Rule(
        "SIT116", "part-size", Severity.ERROR,
        "The board is not smaller than the smallest part that the fabricator handles, nor it or its panel too large "
        "for a panel size that is known, and at least three bridges hold it there.",
        "Smaller parts fall through the machines: they are refused, or left in a panel on bridges (fpc.panel: auto "
        "makes one: a note). A part on fewer than three bridges tilts or drops out of its panel: that is an error.",
        "Order in a panel or with bridges narrow enough, and cut the parts out yourself.", FABRICATOR, apply=part_size,
    ),
)
