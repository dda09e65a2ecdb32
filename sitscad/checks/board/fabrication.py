"""SIT104 to SIT106 and SIT116: holes and parts against what the fabricator can make."""

from __future__ import annotations

from collections.abc import Iterator

from sitscad.checks.rules import Complaint, Rule, Verdict
from sitscad.design import Design
from sitscad.finding import Place, Severity
from sitscad.layout.cutting.bridges import FEWEST_BRIDGES, bridges, narrower_bridge
from sitscad.layout.cutting.panel import is_wanted, least_size
from sitscad.units import show

ROUNDING = 1e-9
"""Lengths that differ by less than this (m) are equal: a nanometre is rounding, not a breach."""

FABRICATOR = "the fabricator's design rules (fpc.rules)"


def via_drill(design: Design) -> Iterator[Verdict]:
    """Every drill against the fabricator's smallest."""
    rules = design.spec.fpc.rules
    for via in design.layout.vias:
        if via.drill < rules.via_drill - ROUNDING:
            yield Complaint(
                f"a via of {via.net} is drilled {um(via.drill)}; {house(design, 'via_drill')} drills "
                f"{um(rules.via_drill)} and larger",
                key="fpc.rules",
                measured=via.drill,
                limit=rules.via_drill,
                unit="m",
                source=source_of(design, "via_drill"),
                place=Place(*via.centre, nets=(via.net,)),
            )


def annular_ring(design: Design) -> Iterator[Verdict]:
    """The copper left round every drill."""
    rules = design.spec.fpc.rules
    for via in design.layout.vias:
        ring = (via.pad - via.drill) / 2.0
        if ring < rules.annular_ring - ROUNDING:
            yield Complaint(
                f"a via of {via.net} has an annular ring of {um(ring)}; {house(design, 'annular_ring')} asks "
                f"{um(rules.annular_ring)}",
                f"a pad of {um(via.drill + 2.0 * rules.annular_ring)} is needed",
                "fpc.rules",
                ring,
                rules.annular_ring,
                "m",
                source=source_of(design, "annular_ring"),
                place=Place(*via.centre, nets=(via.net,)),
            )


def hole_to_hole(design: Design) -> Iterator[Verdict]:
    """The wall between every two drilled holes."""
    rules, vias = design.spec.fpc.rules, design.layout.vias
    for k, via in enumerate(vias):
        for other in vias[k + 1 :]:
            wall = via.centre.distance(other.centre) - (via.drill + other.drill) / 2.0
            if wall < rules.hole_to_hole - ROUNDING:
                yield Complaint(
                    f"two holes ({via.net}, {other.net}) leave {um(wall)} between them; "
                    f"{house(design, 'hole_to_hole')} asks {um(rules.hole_to_hole)}",
                    f"move them {um(rules.hole_to_hole - wall)} apart: a larger inner diameter gives the room",
                    "coil.turns",
                    wall,
                    rules.hole_to_hole,
                    "m",
                    source=source_of(design, "hole_to_hole"),
                    place=Place(
                        (via.centre.x + other.centre.x) / 2.0,
                        (via.centre.y + other.centre.y) / 2.0,
                        nets=tuple(sorted({via.net, other.net})),
                    ),
                )


def part_size(design: Design) -> Iterator[Verdict]:
    """The whole outline against the smallest part that the fabricator handles."""
    rules = design.spec.fpc.rules
    x0, y0, x1, y1 = outline_box(design)
    have, need = sorted((x1 - x0, y1 - y0)), sorted(rules.part_size)
    for size, smallest in zip(have, need, strict=True):
        if size < smallest - ROUNDING:
            in_panel = is_wanted(design.layout)
            yield Complaint(
                f"the board is {show(have[1], 'm')} x {show(have[0], 'm')}; {house(design, 'part_size')} handles "
                f"parts from {show(need[1], 'm')} x {show(need[0], 'm')}"
                + (": so it is put in a panel, which is ordered instead" if in_panel else ", and it is not in a panel"),
                _panel_hint(design) if in_panel else "fpc.panel: auto puts it in a panel, held by bridges",
                "fpc.rules" if in_panel else "fpc.panel",
                size,
                smallest,
                "m",
                Severity.NOTE if in_panel else Severity.WARNING,
                source_of(design, "part_size"),
            )
            break
    if is_wanted(design.layout):
        yield from _panel_size(design)
        yield from _too_few_bridges(design)


def _panel_hint(design: Design) -> str:
    """What build makes of a part that is too small, and which file is sent."""
    name = design.spec.name
    return (
        f"send fpc/{name}-order.zip, which holds the panel and not the single board (its drawing is "
        f"fpc/panel/{name}-panel-drawing.pdf), and cut the parts out yourself"
    )


def _too_few_bridges(design: Design) -> Iterator[Verdict]:
    """Bridges too wide for the part's edge find too few places, and the part drops out of its panel."""
    layout, width = design.layout, design.spec.fpc.panel.bridge
    count = len(bridges(layout))
    if count >= FEWEST_BRIDGES:
        return
    least = narrower_bridge(layout)
    held = {0: "no bridge holds", 1: "only 1 bridge holds"}.get(count, f"only {count} bridges hold")
    yield Complaint(
        f"{held} the part in its panel: the edge has no more places for bridges {show(width, 'm')} wide off contacts, "
        f"stiffener and bend; {FEWEST_BRIDGES} are needed",
        f"fpc.panel.bridge: {least * 1e3:.1f} mm finds places enough (it was tried)"
        if least
        else "no narrower bridge finds places enough either: a larger board, or fpc.panel: none",
        "fpc.panel.bridge",
        float(count),
        float(FEWEST_BRIDGES),
        None,
        Severity.ERROR,
        "two bridges are a hinge, three hold a part in its plane",
    )


def _panel_size(design: Design) -> Iterator[Verdict]:
    rules, size = design.spec.fpc.rules, least_size(design.layout)
    have, most = sorted(size), sorted(rules.panel_size)
    for side, largest in zip(have, most, strict=True):
        if side > largest + ROUNDING:
            yield Complaint(
                f"the panel becomes at least {show(size[0], 'm')} x {show(size[1], 'm')}; "
                f"{house(design, 'panel_size')} makes panels of "
                f"{show(rules.panel_size[0], 'm')} x {show(rules.panel_size[1], 'm')}",
                "fewer parts a panel, a shorter tail, or fpc.panel: none",
                "fpc.panel",
                side,
                largest,
                "m",
                Severity.WARNING,
                source_of(design, "panel_size"),
            )
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
    mark = " (unverified)" if source_of(design, field).startswith("unverified") else ""
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


FABRICATION_RULES: tuple[Rule, ...] = (
    Rule(
        "SIT104", "via-drill", Severity.ERROR,
        "Every via is drilled at least as large as the fabricator drills.",
        "A smaller hole is not plated through.",
        "Use the fabricator's smallest drill or larger.",
        FABRICATOR, apply=via_drill,
    ),
    Rule(
        "SIT105", "annular-ring", Severity.ERROR,
        "Every via keeps the fabricator's copper ring round its hole.",
        "Drill and image are not in register: too small a ring is broken through and the joint is open.",
        "Enlarge the pad, or use a smaller drill.",
        FABRICATOR, apply=annular_ring,
    ),
    Rule(
        "SIT106", "hole-to-hole", Severity.ERROR,
        "Drilled holes leave the fabricator's wall between them.",
        "A thinner wall tears, or the drill runs into the neighbouring hole.",
        "Give the vias more room: fewer turns, a larger coil, or fewer layers.",
        FABRICATOR, apply=hole_to_hole,
    ),
    Rule(
        "SIT116", "part-size", Severity.ERROR,
        "The board is not smaller than the smallest part that the fabricator handles, nor its panel too large, and at "
        "least three bridges hold it there.",
        "Smaller parts fall through the machines: they are refused, or left in a panel on bridges (fpc.panel: auto "
        "makes one: a note). A part on fewer than three bridges tilts or drops out of its panel: that is an error.",
        "Order in a panel or with bridges narrow enough, and cut the parts out yourself.",
        FABRICATOR, apply=part_size,
    ),
)  # fmt: skip
