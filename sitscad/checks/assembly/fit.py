"""SIT301 to SIT303, SIT308, SIT309 and SIT311: does the sensor fit the jaw, its port and its hinge."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import islice

from sitscad.checks.board.fabrication import house, source_of
from sitscad.checks.rules import Complaint, Rule, Undecided, Verdict
from sitscad.design import Design
from sitscad.finding import Severity
from sitscad.geometry.path import bounding_box
from sitscad.layout.routing.lanes import coils_breadth
from sitscad.layout.tail.bending import bend_figure
from sitscad.layout.tail.stiffening import tail_thickness
from sitscad.remedy.fix import Fix
from sitscad.remedy.moves import calmer_tail, narrower, other_ends
from sitscad.remedy.search import Left, in_vain, named, ways
from sitscad.scene.bodies import Body, above_board
from sitscad.scene.jaws import PartsError, closed_section
from sitscad.scene.stack import shield
from sitscad.spec.sensor import ElastomerPad, Jaw, SensorSpec
from sitscad.units import show

ROUNDING = 1e-9

GRAIN = 10e-6
"""Sizes and margins that are named are whole multiples of it (m): nobody cuts finer."""

SMALLEST_MEASURED_PORT = 1.1
"""5 mm trocars measure 5.5 mm inside at the least (Limperg 2024): that much more than the nominal port."""


def sensor_width(design: Design) -> Iterator[Verdict]:
    """Board, elastomer and target across the jaw, whose middle lies under the body's."""
    jaw, body = _jaw(design), design.layout.body_size[1]
    if body > jaw.width + ROUNDING:
        less = _less_margin(design.spec, 1, body - jaw.width)
        yield Complaint(
            f"the board's body is {show(body, 'm')} wide{_shares(design)}, the jaw "
            f"{show(jaw.width, 'm')}{_unverified(jaw)}",
            f"{show(body - jaw.width, 'm')} too much: {less or 'a smaller part'}, or a wider jaw",
            "fpc.margin" if less else "coil.outer_diameter",
            body,
            jaw.width,
            "m",
            advice=None if less else lambda left: _narrower_body(design, left),
        )
    for slab in above_board(design.spec):
        yield from _across_jaw(design, jaw, slab)
    yield from _through_port(design)


def _across_jaw(design: Design, jaw: Jaw, slab: Body) -> Iterator[Verdict]:
    """Elastomer or target across the jaw, each where it stands."""
    (_, low, _, high), (_, y0, _, y1) = slab.footprint.box, design.layout.body
    middle, width = (y0 + y1) / 2, high - low
    needed = 2.0 * max(high - middle, middle - low)
    if needed <= jaw.width + ROUNDING:
        return
    aside = needed - width > ROUNDING
    beside = f" and its middle {show((needed - width) / 2, 'm', 3)} beside the jaw's" if aside else ""
    yield Complaint(
        f"the {slab.name} is {show(width, 'm')} wide{beside}, the jaw {show(jaw.width, 'm')}{_unverified(jaw)}",
        f"{show((needed - jaw.width) / 2, 'm')} too much on {'that' if aside else 'each'} side: a smaller part"
        f"{', one that stands in the middle' if aside else ''}, or a wider jaw",
        f"{slab.name}.{'offset' if aside else 'size'}",
        needed,
        jaw.width,
        "m",
    )


def _shares(design: Design) -> str:
    """What the body's width is made of, where leads or vias beside the coils take a part of it."""
    spec, width = design.spec, design.layout.body_size[1]
    coils = 2.0 * coils_breadth(spec).half
    edges = 2.0 * spec.fpc.rules.copper_to_edge
    margin = 2.0 * spec.fpc.margin[1]
    beside = width - coils - edges - margin
    parts = [f"coils {show(coils, 'm')}", f"board's edges {show(edges, 'm')}"]
    if margin:
        parts.append(f"fpc.margin {show(margin, 'm')}")
    if beside > ROUNDING:
        parts.append(f"and {show(beside, 'm')} for leads and vias that pass beside the coils")
    return f" ({', '.join(parts)})" if len(parts) > 2 else ""


def _less_margin(spec: SensorSpec, axis: int, excess: float) -> str:
    """The margin with which the body is so much (m) smaller along an axis; nothing where it has too little."""
    margin = list(spec.fpc.margin)
    margin[axis] = GRAIN * math.floor((margin[axis] - 0.5 * excess + ROUNDING) / GRAIN)
    return f"fpc.margin: [{margin[0] * 1e3:.6g}, {margin[1] * 1e3:.6g}]" if margin[axis] >= 0.0 else ""


def _narrower_body(design: Design, left: Left) -> str:
    """Ends of the layers whose leads leave elsewhere, or smaller coils: the first of each that fits."""
    spec, jaw = design.spec, _jaw(design)
    excess = design.layout.body_size[1] - jaw.width
    found = ways((islice(_led_otherwise(design, left), 1), narrower(spec, excess)), left)
    if found:
        return f"{show(excess, 'm')} too much: {named(found)} fits (it was tried); or a wider jaw"
    return f"{show(excess, 'm')} too much: smaller coils, narrower leads and gaps (fpc.rules), or a wider jaw"


def _led_otherwise(design: Design, left: Left) -> Iterator[Fix]:
    """Other ends of the layers whose leads leave the body no wider than the jaw; as far as the budget goes."""
    for fix in other_ends(design.spec):
        layout = left.drawn(fix.spec)
        if layout is None:
            return
        if layout.body_size[1] <= _jaw(design).width + ROUNDING:
            yield fix


def _through_port(design: Design) -> Iterator[Verdict]:
    jaw, (_, low, _, high) = _jaw(design), bounding_box((design.layout.outline,))
    across = high - low
    is_body = across <= design.layout.body_size[1] + ROUNDING
    if across > jaw.port_diameter + ROUNDING:
        yield Complaint(
            f"the whole board is {show(across, 'm')} wide where it is laid flat, its tail and contacts included; the "
            f"port leaves {show(jaw.port_diameter, 'm')}{_unverified(jaw)}",
            "it goes through the port rolled or from behind only: "
            + (
                "the body decides, make it narrower"
                if is_body
                else "a straight tail, fewer contacts, a finer connector"
            ),
            "coil.outer_diameter" if is_body else "fpc.tail",
            across,
            jaw.port_diameter,
            "m",
            Severity.WARNING,
        )


def sensor_length(design: Design) -> Iterator[Verdict]:
    """The board's body along the jaw."""
    jaw, length = _jaw(design), design.layout.body_size[0]
    if length > jaw.length + ROUNDING:
        less = _less_margin(design.spec, 0, length - jaw.length)
        many = len(design.spec.array.placements) > 1
        yield Complaint(
            f"the board's body is {show(length, 'm')} long, the jaw {show(jaw.length, 'm')}{_unverified(jaw)}",
            f"{show(length - jaw.length, 'm')} too much: "
            + (less or f"fewer or smaller coils{', or a smaller pitch' if many else ''}"),
            "fpc.margin" if less else design.distance_key,
            length,
            jaw.length,
            "m",
        )


def stack_height(design: Design) -> Iterator[Verdict]:
    """The closed pair of jaws with the whole stack between them, inside the port's circle."""
    try:
        section = closed_section(design.layout)
    except PartsError as error:
        yield Undecided(str(error))
        return
    jaw = _jaw(design)
    if section is None or section.fits:
        return
    across = 2.0 * section.radius
    passes = across <= SMALLEST_MEASURED_PORT * jaw.port_diameter + ROUNDING
    yield Complaint(
        f"the closed jaws with the sensor between them need a circle of {show(across, 'm')} (the {section.decided_by} "
        f"decides; {show(section.height, 'm')} back to back); the port's is "
        f"{show(jaw.port_diameter, 'm')}{_unverified(jaw)}"
        + (
            f". It would pass {show(SMALLEST_MEASURED_PORT * jaw.port_diameter, 'm')}, the smallest measured port of "
            "that nominal size"
            if passes
            else ""
        ),
        (
            f"{show(across - jaw.port_diameter, 'm')} too much: a narrower board, or less height: {_thinner(design)}"
            if "board" in section.decided_by
            else f"take {show(across - jaw.port_diameter, 'm')} off: {_thinner(design)}"
        ),
        "mount.standoff",
        across,
        jaw.port_diameter,
        "m",
        Severity.WARNING if passes and _unverified(jaw) else Severity.ERROR,
    )


def tail_bend(design: Design) -> Iterator[Verdict]:
    """The tail's bend through a hinge: its layers, and the radius that it needs."""
    spec = design.spec
    tail, rules = spec.fpc.tail, spec.fpc.rules
    assert tail is not None
    if tail.bend == "none":
        return
    if tail.bend == "dynamic" and tail.layers > 1:
        yield Complaint(
            f"the tail bends at every grasp (dynamic) and has {tail.layers} copper layers",
            "run the tail on one layer through the hinge (fpc.tail.layers: 1), or bend it once (bend: static)",
            "fpc.tail.layers",
            float(tail.layers),
            2.0 if tail.layers > 2 else 1.0,
            "copper layers",
            Severity.ERROR if tail.layers > 2 else Severity.WARNING,
            advice=lambda left: _calmer(design, left),
        )
    figure = bend_figure(spec)
    if figure is None:
        yield Undecided(f"{rules.name} states no bend radius for a {tail.bend} bend")
        return
    field, ratio = figure
    thickness, room = tail_thickness(spec), _bend_room(design)
    radius, stated = ratio * thickness, tail.bend_radius or 0.0
    if room is None:
        yield Undecided("no jaw: the room for the tail's bend is not known")
    elif stated > max(radius, room + ROUNDING):
        yield Complaint(
            f"a bend of {show(stated, 'm', 3)} inside radius is wanted; inside the port there are {show(room, 'm', 3)}",
            f"fpc.tail.bend.radius: {show(max(radius, min(stated, room)), 'm', 3)}, or leave it out",
            "fpc.tail.bend.radius",
            stated,
            room,
            "m",
            Severity.WARNING,
        )
    elif radius > room + ROUNDING:
        yield Complaint(
            f"a {tail.bend} bend of {tail.layers} copper layer{'s' if tail.layers > 1 else ''} needs a radius of "
            f"{show(radius, 'm', 3)} ({house(design, field)} asks {ratio:g} times the {show(thickness, 'm', 3)} tail)"
            f"; inside the port there are {show(room, 'm', 3)}",
            f"a tail of {show(room / ratio, 'm', 3)} or thinner would do: fewer copper layers, or no bend",
            "fpc.tail.bend",
            radius,
            room,
            "m",
            Severity.NOTE if tail.bend == "static" and tail.layers <= 2 else Severity.WARNING,
            source_of(design, field),
        )


def _calmer(design: Design, left: Left) -> str:
    """One copper layer through the hinge, or a bend made once: those that are possible."""
    changes = list(calmer_tail(design.spec))
    found = ways(([change] for change in changes), left)
    if found:
        return f"{named(found)} mends it (it was tried)"
    if left.is_cut_short:
        return ""
    return f"one copper layer through the hinge, or a bend made once: {in_vain(changes, left)}"


def shield_gap(design: Design) -> Iterator[Verdict]:
    """The shield lies between the board and the jaw's metal, and under all coils."""
    shield, mount = design.spec.shield, design.spec.mount
    assert shield is not None and mount is not None
    yield from _uncovered_coils(design)
    needed = shield.gap + shield.thickness
    if needed > mount.standoff + ROUNDING:
        yield Complaint(
            f"the shield ends {show(needed, 'm')} below the board's bottom, "
            f"{'the jaw' if mount.jaw else 'the mount'} begins at "
            f"{show(mount.standoff, 'm')}",
            f"raise mount.standoff by {show(needed - mount.standoff, 'm')}, or bring the shield nearer to the board",
            "shield.gap",
            needed,
            mount.standoff,
            "m",
        )


def _uncovered_coils(design: Design) -> Iterator[Verdict]:
    """Coils that reach beyond a shield which the port makes narrower than the body."""
    spec, (_, y0, _, y1) = design.spec, design.layout.body
    try:
        sheet = shield(design.layout)
    except PartsError:
        return  # it stands in the jaw's metal, which is said below
    assert sheet is not None
    middle, (_, low, _, high) = (y0 + y1) / 2, bounding_box((sheet.outline(),))
    width, coils = high - low, coils_breadth(spec)
    across = 2.0 * max(middle - coils.low, coils.high - middle)
    if across > width + ROUNDING:
        yield Complaint(
            f"the shield is {show(width, 'm', 3)} wide, as the port leaves it room, and the coils reach "
            f"{show(across, 'm', 3)} across: {show((across - width) / 2, 'm', 3)} of them on each side see the jaw "
            "beside it, and the estimate takes it as endless",
            "bring it nearer to the closed pair's middle (a smaller shield.gap, a lower stack), or take smaller coils",
            "shield.gap",
            width,
            across,
            "m",
            Severity.WARNING,
        )


def bare_metal(design: Design) -> Iterator[Verdict]:
    """A target that touches tissue is sealed."""
    if design.spec.encapsulation is None:
        yield Complaint(
            "the copper target is not encapsulated, and in the jaw it touches tissue"
            if design.spec.target is not None and design.spec.target.material.name == "copper"
            else "the metal target is not encapsulated, and in the jaw it touches tissue",
            "add encapsulation: {material: pdms, thickness: 0.1}",
            "target",
        )


def _jaw(design: Design) -> Jaw:
    mount = design.spec.mount
    assert mount is not None and mount.jaw is not None
    return mount.jaw


def pad_of(design: Design) -> ElastomerPad:
    """The elastomer of a rule that needs one."""
    assert design.spec.elastomer is not None
    return design.spec.elastomer


def _unverified(jaw: Jaw) -> str:
    """A warning in brackets where the jaw's figures are not measured ones."""
    words = jaw.source.lower()
    return " (the jaw's figures are unverified: measure yours)" if "unverified" in words or "memory" in words else ""


def _thinner(design: Design) -> str:
    """The soft or empty heights that can give, largest first."""
    spec = design.spec
    standoff = "mount.standoff (from the metal's face up to the board's bottom face)"
    heights = [(standoff, spec.mount.standoff if spec.mount else 0.0)]
    if spec.elastomer is not None:
        heights.append(("elastomer.thickness", spec.elastomer.thickness))
    if spec.target is not None:
        heights.append(("target.thickness", spec.target.thickness))
    heights = [entry for entry in sorted(heights, key=lambda e: (-e[1], e[0])) if entry[1] > 0.0]
    return ", ".join(f"{key} is {show(height, 'm', 3)}" for key, height in heights)


def _bend_room(design: Design) -> float | None:
    mount = design.spec.mount
    return mount.jaw.port_diameter / 2.0 if mount is not None and mount.jaw is not None else None


JAW_SOURCE = "the jaw's figures (mount.jaw); thesis of Jones 2.5: jaw about 5 mm wide, sensing body 5 x 10 mm"

FIT_RULES: tuple[Rule, ...] = (
    Rule(
        "SIT301", "sensor-width", Severity.ERROR,
        "The board's body, the elastomer and the target are not wider than the jaw (errors), nor the whole board, its "
        "tail and contacts included, than the port (a warning).",
        "What overhangs is cut off or torn by the port (the board of Jones, thesis, Leeds, overhung by its connector).",
        "A smaller coil or target, narrower leads, or a wider jaw.",
        JAW_SOURCE, ("jaw",), sensor_width,
    ),
    Rule(
        "SIT302", "sensor-length", Severity.ERROR,
        "The board's body is not longer than the jaw.",
        "The body must lie flat; only the tail may go through the hinge.",
        "Fewer or smaller coils, or a smaller pitch.",
        JAW_SOURCE, ("jaw",), sensor_length,
    ),
    Rule(
        "SIT303", "stack-height", Severity.ERROR,
        "The closed jaws, with the sensor's whole stack between them, pass the port's circle.",
        "Ports are named by a nominal size, 5.0 mm taken strictly here; 5 mm ports measure 5.5 to 7.4 mm inside. A "
        "pair that passes 5.5 mm only is a warning while the jaw's figures are unverified, anything beyond an error. "
        "The pad is taken at rest: what it gives way in the port is not counted on.",
        "A thinner elastomer, standoff or target, or a jaw with more metal taken away.",
        "Limperg 2024 (JMIG, 10.1016/j.jmig.2024.01.008) for measured ports; " + JAW_SOURCE, ("jaw",), stack_height,
    ),
    Rule(
        "SIT308", "tail-bend", Severity.ERROR,
        "The tail can be bent as the spec says: one copper layer where it moves at every grasp (two are a warning, "
        "more an error), and a radius that half of the port leaves (a note for a static bend of up to two layers, "
        "else a warning).",
        "Several layers of copper crack in a hinge; bend radii are multiples of the thickness.",
        "One layer through the hinge, a thinner board, or no bend.",
        "fpc.rules: All Flex 6/10/20 times static; jselectronic 20 to 40 times dynamic; ship.ie one layer only when "
        "dynamic",
        ("tail",), tail_bend,
    ),
    Rule(
        "SIT309", "shield-gap", Severity.ERROR,
        "The shield lies inside the standoff between the board and the jaw, or the mount's plate (an error), and under "
        "all of every coil where the port makes it narrower than the board's body (a warning).",
        "A shield deeper than the standoff would stand in the jaw's metal; beside one that is too narrow the field "
        "enters the jaw, and the estimates take shields as endless.",
        "A larger standoff, or a smaller gap.",
        "geometry", ("shield", "mount"), shield_gap,
    ),
    Rule(
        "SIT311", "bare-metal", Severity.WARNING,
        "A target in a jaw is encapsulated.",
        "Open metal must not touch tissue; silicone is the candidate that the thesis names.",
        "Add an encapsulation.",
        "thesis of Jones 8.2", ("target", "jaw"), bare_metal,
    ),
)  # fmt: skip
