"""SIT301 to SIT303 and SIT314: does the sensor, as it is glued together, fit the jaw and its port."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import islice

from sitscad.checks.assembly.fit import GRAIN, ROUNDING, jaw_of, unverified
from sitscad.checks.cases import Case
from sitscad.checks.rules import Rule, Undecided, Verdict
from sitscad.design import Design
from sitscad.finding import Severity
from sitscad.geometry.path import bounding_box
from sitscad.layout.routing.lanes import coils_breadth
from sitscad.remedy.fix import Fix
from sitscad.remedy.moves import narrower, other_ends
from sitscad.remedy.search import Left, named, ways
from sitscad.scene.bodies import MOUNT_PIECES, Body, above_board, board_heights, seat_spans
from sitscad.scene.column import GLUE
from sitscad.scene.fit import CLOSED_PAIR, LENGTH, OVERHANG, Measure
from sitscad.scene.jaws import POCKET_CLEARANCE, PartsError, rim, section, shield_that_fits
from sitscad.scene.printing import print_limit
from sitscad.spec.sensor import Jaw, Mount, SensorSpec
from sitscad.units import show

SMALLEST_MEASURED_PORT = 1.1
"""5 mm trocars measure 5.5 mm inside at the least (Limperg 2024): that much more than the nominal port."""


def sensor_width(design: Design) -> Iterator[Verdict]:
    """Board, elastomer and target across the jaw, whose middle lies under the body's."""
    jaw, body = jaw_of(design), design.layout.body_size[1]
    if body > jaw.width + ROUNDING:
        less = _less_margin(design.spec, 1, body - jaw.width)
        yield BODY_TOO_WIDE.found(
            "fpc.margin" if less else "coil.outer_diameter",
            body,
            jaw.width,
            "m",
            advice=None if less else lambda left: _narrower_body(design, left),
            shares=_shares(design),
            unverified=unverified(jaw),
            excess=body - jaw.width,
            remedy=less or "a smaller part",
        )
    for slab in above_board(design.spec):
        yield from _across_jaw(design, jaw, slab)
    if body <= jaw.width + ROUNDING:
        yield from _overhang(design, jaw)
    yield from _in_pocket(design, jaw, body)
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
    yield PLATE_TOO_WIDE.found(
        f"{slab.name}.{'offset' if aside else 'size'}",
        needed,
        jaw.width,
        "m",
        name=slab.name,
        width=width,
        beside=beside,
        unverified=unverified(jaw),
        excess=(needed - jaw.width) / 2,
        side="that" if aside else "each",
        middle=", one that stands in the middle" if aside else "",
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
    spec, jaw = design.spec, jaw_of(design)
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
        if layout.body_size[1] <= jaw_of(design).width + ROUNDING:
            yield fix


def _through_port(design: Design) -> Iterator[Verdict]:
    jaw, (_, low, _, high) = jaw_of(design), bounding_box((design.layout.outline,))
    across = high - low
    is_body = across <= design.layout.body_size[1] + ROUNDING
    if across > jaw.port_diameter + ROUNDING:
        yield WIDER_THAN_PORT.found(
            "coil.outer_diameter" if is_body else "fpc.tail",
            across,
            jaw.port_diameter,
            "m",
            unverified=unverified(jaw),
            remedy="the body decides, make it narrower"
            if is_body
            else "a straight tail, fewer contacts, a finer connector",
        )


def _in_pocket(design: Design, jaw: Jaw, body: float) -> Iterator[Verdict]:
    """A board below the rims of a pad pocket has to go into it."""
    mount = design.spec.mount
    if jaw.pocket is None or mount is None:
        return
    length = jaw.pocket[0] - 2.0 * POCKET_CLEARANCE
    if design.layout.body_size[0] > length + ROUNDING:
        long = design.layout.body_size[0]
        yield LONGER_THAN_POCKET.found(design.distance_key, long, length, "m", unverified=unverified(jaw))
    if mount.standoff > jaw.recess - ROUNDING:
        return
    room = jaw.pocket[1] - 2.0 * POCKET_CLEARANCE
    if body > room + ROUNDING:
        yield WIDER_THAN_POCKET.found(
            "mount.standoff",
            body,
            room,
            "m",
            below=jaw.recess - mount.standoff,
            unverified=unverified(jaw),
            over=jaw.recess * 1e3,
        )


def _overhang(design: Design, jaw: Jaw) -> Iterator[Verdict]:
    """The board beside the jaw's true face, which is the chord of its half-round back."""
    over = _measured(design, OVERHANG)
    if over is None or over.worst <= ROUNDING:
        return
    severity = _severity(over)
    if severity is None and over.nominal <= ROUNDING:
        return
    face = section(rim(jaw)).face
    carried = f"the {show(over.limit, 'm', 3)} of plastic under it" if over.limit else "nothing under it"
    yield (HELD_BY_PLASTIC if severity is None else BODY_OVER_FACE).found(
        "coil.outer_diameter",
        over.measured,
        over.limit,
        "m",
        severity=severity,
        over=max(0.0, over.nominal),
        face=face,
        unverified=unverified(jaw),
        beyond=_beyond(over),
        carried=carried,
    )


def _measured(design: Design, name: str) -> Measure | None:
    """One of the design's measures; None where it was not taken."""
    return next((measure for measure in design.fit if measure.name == name), None)


def _severity(measure: Measure) -> Severity | None:
    """An error where it is too much nominally or by root-sum-square, a warning where it is at worst."""
    if max(measure.nominal, measure.root_sum_square) > measure.limit + ROUNDING:
        return Severity.ERROR
    return Severity.WARNING if measure.worst > measure.limit + ROUNDING else None


def _beyond(measure: Measure) -> str:
    """What tolerances make of a size, in words."""
    likely, worst = (show(value, "m", 4) for value in (measure.root_sum_square, measure.worst))
    return f" ({likely} by root-sum-square of all tolerances, {worst} at worst)"


def sensor_length(design: Design) -> Iterator[Verdict]:
    """The board's body along the jaw."""
    jaw, measure = jaw_of(design), _measured(design, LENGTH)
    severity = None if measure is None else _severity(measure)
    if measure is None or severity is None:
        return
    excess = measure.worst - jaw.length
    less = _less_margin(design.spec, 0, excess)
    many = len(design.spec.array.placements) > 1
    yield BODY_TOO_LONG.found(
        "fpc.margin" if less else design.distance_key,
        measure.measured,
        jaw.length,
        "m",
        severity=severity,
        nominal=measure.nominal,
        beyond=_beyond(measure),
        unverified=unverified(jaw),
        excess=excess,
        remedy=less or f"fewer or smaller coils{', or a smaller pitch' if many else ''}",
    )


def stack_height(design: Design) -> Iterator[Verdict]:
    """The closed pair of jaws with the whole stack between them, glue and tolerances included, inside the port."""
    try:
        shield_that_fits(design.spec)
    except PartsError as error:
        yield Undecided(str(error))
        return
    pair, jaw = _measured(design, CLOSED_PAIR), jaw_of(design)
    severity = None if pair is None else _severity(pair)
    if pair is None or severity is None:
        return
    over = pair.measured - jaw.port_diameter
    yield PAIR_TOO_HIGH.found(
        "mount.standoff",
        pair.measured,
        jaw.port_diameter,
        "m",
        severity=severity,
        nominal=pair.nominal,
        beyond=_beyond(pair),
        decided_by=pair.decided_by,
        glue=_glue(pair),
        unverified=unverified(jaw),
        measured_ports=_measured_ports(pair),
        remedy=f"{show(over, 'm', 3)} too much: a narrower board, or less height: {_thinner(design)}"
        if "board" in pair.decided_by
        else f"take {show(over, 'm', 3)} off: {_thinner(design)}",
        widest=_widest(pair),
    )


def _glue(pair: Measure) -> float:
    return math.fsum(share.nominal for share in pair.parts if share.part.startswith(GLUE))


def _measured_ports(pair: Measure) -> str:
    """Whether ports as they were measured would let it through."""
    wider = SMALLEST_MEASURED_PORT * pair.limit
    if pair.measured > wider + ROUNDING:
        return ""
    return f". It would pass {show(wider, 'm')}, the smallest measured port of that nominal size"


def _widest(pair: Measure) -> str:
    """The parts that tolerances change most, and the key that narrows them where yours are better."""
    found = sorted(pair.parts, key=lambda share: (-share.tolerance, share.part))[:3]
    named_parts = ", ".join(f"{share.part} +-{show(share.tolerance, 'm', 3)}" for share in found)
    return f"{named_parts} (assembly.tolerances, where yours are measured)"


def printed_wall(design: Design) -> Iterator[Verdict]:
    """The mount's pieces are thick enough to be made."""
    mount = design.spec.mount
    assert mount is not None
    limit = print_limit(mount.process, "wall")
    for name, thickness, is_spacer in _pieces(design.spec, mount):
        if thickness < limit.value - ROUNDING:
            yield TOO_THIN_TO_PRINT.found(
                "shield.gap" if is_spacer else "mount.standoff",
                thickness,
                limit.value,
                "m",
                hint=_thicker(design.spec, is_spacer, limit.value),
                source=limit.source,
                name=name,
                process=mount.process,
            )


def _pieces(spec: SensorSpec, mount: Mount) -> list[tuple[str, float, bool]]:
    """The printed pieces under the board, each with its thickness, and whether it lies between shield and board; a
    bench plate's floor has a least thickness of its own.
    """
    try:
        sheet = shield_that_fits(spec)
    except PartsError:
        return []
    spans = seat_spans(board_heights(spec)[0], mount.standoff, sheet)
    found = [
        (name, upper - lower, sheet is not None and lower > sheet[0])
        for name, (lower, upper) in zip(MOUNT_PIECES, spans, strict=False)
    ]
    return [piece for piece in found if mount.kind == "grasper-pad" or piece[2]]


def _thicker(spec: SensorSpec, is_spacer: bool, wall: float) -> str:
    """How the piece is made thick enough, or left out."""
    if spec.shield is None:
        return f"mount.standoff: {wall * 1e3:.6g}, or 0: the board on the metal itself (SIT201 to SIT203 judge that)"
    on_metal = spec.shield.gap + spec.shield.thickness
    if is_spacer:
        return f"shield.gap: {wall * 1e3:.6g} or more"
    return (
        f"mount.standoff: {on_metal * 1e3:.6g} lays the shield on the metal, {(on_metal + wall) * 1e3:.6g} leaves room "
        "for a piece that can be made"
    )


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


JAW_SOURCE = "the jaw's figures (mount.jaw); thesis of Jones 2.5: jaw about 5 mm wide, sensing body 5 x 10 mm"

BODY_TOO_WIDE = Case(
    "the board's body is {measured:m} wide{shares}, the jaw {limit:m}{unverified}",
    hint="{excess:m} too much: {remedy}, or a wider jaw",
)

PLATE_TOO_WIDE = Case(
    "the {name} is {width:m} wide{beside}, the jaw {limit:m}{unverified}",
    hint="{excess:m} too much on {side} side: a smaller part{middle}, or a wider jaw",
)

WIDER_THAN_PORT = Case(
    "the whole board is {measured:m} wide where it is laid flat, its tail and contacts included; "
    "the port leaves {limit:m}{unverified}",
    hint="it goes through the port rolled or from behind only: {remedy}",
    severity=Severity.WARNING,
)

LONGER_THAN_POCKET = Case(
    "the board's body is {measured:m} long, and what lies under it has {limit:m} in the jaw's pocket{unverified}",
    "a shorter board (fewer or smaller coils), or a jaw with a longer pocket",
)

WIDER_THAN_POCKET = Case(
    "the board's body is {measured:m} wide and lies {below:m,3} below the rims of the jaw's pocket, which leaves "
    "{limit:m}{unverified}",
    "mount.standoff: {over:.6g} or more lays it over the rims, or a narrower board",
)

_BODY_OVER_FACE = (
    "the board's body stands {over:m,3} over each side of the jaw's face, which is {face:m} wide, the chord of its "
    "half-round back{unverified}{beyond}; "
)

BODY_OVER_FACE = Case(
    _BODY_OVER_FACE + "it is to be held by {carried}",
    "a narrower board, a thicker seat (mount.standoff), or a jaw with a wider face",
)

HELD_BY_PLASTIC = Case(
    _BODY_OVER_FACE + "held by {carried}",
    "nothing has to be changed for that: the mount is cut back to the port's circle; a narrower board would lie on "
    "metal "
    "altogether",
    Severity.NOTE,
)

BODY_TOO_LONG = Case(
    "the board's body is {nominal:m} long{beyond}, the jaw {limit:m}{unverified}",
    hint="{excess:m} too much at worst: {remedy}",
)

PAIR_TOO_HIGH = Case(
    "the closed jaws with the sensor glued between them need a circle of {nominal:m}{beyond}; the"
    " {decided_by} decides, and glue lines are {glue:m,3} of it. The port's is "
    "{limit:m}{unverified}{measured_ports}",
    hint="{remedy}; or narrower tolerances: {widest}",
)

TOO_THIN_TO_PRINT = Case(
    "the {name} is {measured:m,3} thick, which {process} does not make: {limit:m,3} at least",
)


ROOM_IN_JAW_RULES: tuple[Rule, ...] = (
    Rule(
        "SIT301", "sensor-width", Severity.ERROR,
        "The board's body, the elastomer and the target are not wider than the jaw (errors); what of the board stands "
        "over the jaw's true face, the chord of its half-round back, is held by at least as much plastic below it (an "
        "error nominally or by root-sum-square of the tolerances, a warning at worst, a note where it is held); nor is "
        "the whole board, its tail and contacts included, wider than the port (a warning).",
        "What overhangs is cut off or torn by the port (the board of Jones, thesis, Leeds, overhung by its connector).",
        "A smaller coil or target, narrower leads, or a wider jaw.",
        JAW_SOURCE, ("jaw",), sensor_width,
    ),
    Rule(
        "SIT302", "sensor-length", Severity.ERROR,
        "The board's body is not longer than the jaw: nominally and by root-sum-square of both tolerances (errors), "
        "nor at worst (a warning).",
        "The body must lie flat; only the tail may go through the hinge.",
        "Fewer or smaller coils, or a smaller pitch.",
        JAW_SOURCE, ("jaw",), sensor_length,
    ),
    Rule(
        "SIT303", "stack-height", Severity.ERROR,
        "The closed jaws, with the sensor's whole stack and every glue line between them, pass the port's circle: "
        "nominally and by root-sum-square of all tolerances (errors), and at worst (a warning).",
        "Pieces are glued, and none is as thick as it is drawn. Ports are named by a nominal size, 5.0 mm taken "
        "strictly here; 5 mm ports measure 5.5 to 7.4 mm inside: write mount.jaw.port_diameter where yours is known. "
        "The pad is taken at rest: what it gives way in the port is not counted on.",
        "A thinner elastomer, standoff or target, narrower tolerances, or a jaw with more metal taken away.",
        "Limperg 2024 (JMIG, 10.1016/j.jmig.2024.01.008) for measured ports; tolerances: the report's table of fit; "
        + JAW_SOURCE, ("jaw",), stack_height,
    ),
    Rule(
        "SIT314", "printed-wall", Severity.ERROR,
        "Each piece of the mount is as thick as its process (mount.process) can make it.",
        "A standoff a little larger than the shield needs prints a sheet of a few hundredths of a millimetre.",
        "A standoff that lays the shield on the metal, a larger one, or another process.",
        "sitscad/data/print_limits.csv", ("mount",), printed_wall,
    ),
)  # fmt: skip
