"""Layouts made by hand for formats and papers: small, realistic, and independent of the program's own routing.

`two_coils` is a board of two circular coils on two layers with a tail, four contacts and a stiffener: half circles
whose radius steps at every half turn make the spirals, so that every corner of the copper is known exactly.
"""

from __future__ import annotations

import math
from dataclasses import replace

from sitscad.kernels.geometry.path import Arc, Path, Point, Region, circle, polyline, rectangle, rounded_polygon
from sitscad.layout.board import Coil, Layout, Pad, Role, Stiffener, Trace, Via, Winding
from sitscad.spec import presets
from sitscad.spec.circuit import Connector, FpcSpec, LayerKind, PanelSpec, StackLayer, Stackup, Tail
from sitscad.spec.coil import ArraySpec, CoilPlacement, CoilSpec
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.sensor import ReadoutSpec, Requirements, SensorSpec
from sitscad.spec.yaml.source import SpecSource

MM, UM = 1e-3, 1e-6
WIDTH = SPACING = 100 * UM
PITCH = WIDTH + SPACING
DIAMETER = 3.5 * MM
COIL_PITCH = 4.5 * MM
TAIL_END = 16.0 * MM

RULES = DesignRules(
    name="by-hand",
    trace_width=100 * UM,
    trace_spacing=100 * UM,
    via_drill=150 * UM,
    annular_ring=100 * UM,
    coil_trace_width=None,
    coil_trace_spacing=None,
    coil_rule_binding=False,
    hole_to_hole=200 * UM,
    drill_to_copper=150 * UM,
    copper_to_edge=200 * UM,
    coverlay_web=200 * UM,
    coverlay_opening_to_trace=100 * UM,
    part_size=(4 * MM, 8 * MM),
    static_bend_ratio={1: 6.0, 2: 10.0, 4: 20.0},
    dynamic_bend_ratio={1: 20.0, 2: 40.0},
    source="by hand, for tests",
)

ZIF = Connector(
    name="zif-0.5mm",
    kind="zif",
    pitch=0.5 * MM,
    contact_width=0.3 * MM,
    contact_length=3.0 * MM,
    edge_margin=0.5 * MM,
    insertion_thickness=0.3 * MM,
    insertion_thickness_tolerance=0.03 * MM,
    stiffener_length=5.0 * MM,
    source="by hand, for tests",
)


def stackup(copper: int = 2) -> Stackup:
    """Coverlay, `copper` layers of 35 um between 25 um of polyimide, coverlay."""
    layers = [StackLayer(LayerKind.COVERLAY, 27.5 * UM, "polyimide-coverlay", 3.5)]
    for number in range(copper):
        if number:
            layers.append(StackLayer(LayerKind.DIELECTRIC, 25 * UM, "polyimide", 3.4))
        layers.append(StackLayer(LayerKind.COPPER, 35 * UM, "copper"))
    layers.append(StackLayer(LayerKind.COVERLAY, 27.5 * UM, "polyimide-coverlay", 3.5))
    return Stackup(f"flex-{copper}l-35um", tuple(layers), source="by hand, for tests")


def sensor_spec(copper: int = 2, tail: bool = True, name: str = "two-coils") -> SensorSpec:
    """A spec of two circular coils with nothing above or below the board."""
    placements = tuple(CoilPlacement(f"C{i + 1}", (x, 0.0)) for i, x in enumerate((-COIL_PITCH / 2, COIL_PITCH / 2)))
    end = Tail(11 * MM, ZIF, layers=copper, turn_radius=2e-3) if tail else None
    return SensorSpec(
        name=name,
        coil=CoilSpec(
            "circle", (DIAMETER, DIAMETER), 4.5, layers=(1, copper), trace_width=WIDTH, trace_spacing=SPACING,
        ),
        array=ArraySpec("line", placements, COIL_PITCH),
        fpc=FpcSpec(stackup=stackup(copper), rules=RULES, tail=end, panel=PanelSpec(), teardrops="none"),
        target=None,
        elastomer=None,
        encapsulation=None,
        mount=None,
        shield=None,
        readout=ReadoutSpec(presets.converter("ldc1614"), None, "converter", None, None, 40e6, 100.0),
        requirements=Requirements(),
        source=SpecSource("two-coils.yaml", "sitscad: 1\n"),
    )


def half_circle_spiral(centre: Point, ccw: bool, half_turns: int = 9) -> Path:
    """A spiral of half circles from the outside at angle 0 inwards; each half turn's radius is half a pitch smaller.

    The half circles stand on the x axis through the centre alternately about two centres half a step apart, so that
    one joins the next with the same tangent.
    """
    segments = []
    here = Point(centre.x + (DIAMETER - WIDTH) / 2, centre.y)
    for i in range(half_turns):
        towards = -1.0 if i % 2 == 0 else 1.0
        radius = (DIAMETER - WIDTH) / 2 - PITCH / 4 * (2 * i + 1)
        middle = Point(here.x + towards * radius, here.y)
        there = Point(here.x + 2 * towards * radius, here.y)
        segments.append(Arc(here, there, middle, ccw))
        here = there
    return Path(tuple(segments))


def _coil(number: int, copper: int, spec: SensorSpec) -> tuple[Coil, list[Trace], list[Via]]:
    """One coil with its leads: contact A leaves on layer 1, contact B on the last layer and comes up in the tail."""
    placement = spec.array.placements[number]
    net, centre = placement.name, Point(*placement.centre)
    top, bottom = half_circle_spiral(centre, ccw=True), half_circle_spiral(centre, ccw=False)
    lane_a, lane_b = (0.75 * MM, 0.25 * MM) if number else (-0.75 * MM, -0.25 * MM)
    change, far = Point(10 * MM, lane_b), TAIL_END - 1.5 * MM
    via, out = Via(centre, 150 * UM, 350 * UM, net), Via(change, 150 * UM, 350 * UM, net)
    around = [] if number else [Point(-0.35 * MM, -1.95 * MM), Point(4.4 * MM, -1.95 * MM)]
    turn = 7.0 * MM if number else 8.4 * MM
    inner_top = Trace(polyline([top.end, centre]), WIDTH, 1, net, Role.STUB)
    inner_bottom = Trace(polyline([centre, bottom.end]), WIDTH, copper, net, Role.STUB)
    winding_top = Trace(top, WIDTH, 1, net, Role.WINDING)
    winding_bottom = Trace(bottom.reversed(), WIDTH, copper, net, Role.WINDING)
    lead_a = polyline([Point(far, lane_a), Point(turn, lane_a), *reversed(around), top.start])
    lead_b = polyline([bottom.start, *around, Point(turn, lane_b), change])
    a = Trace(lead_a, WIDTH, 1, net, Role.LEAD)
    b = Trace(lead_b, WIDTH, copper, net, Role.LEAD)
    c = Trace(polyline([change, Point(far, lane_b)]), WIDTH, 1, net, Role.TAIL)
    first, last = spec.coil_copper
    windings = (
        Winding(1, first.z, first.thickness, 0.0, +1, True, top),
        Winding(copper, last.z, last.thickness, 0.0, -1, False, bottom.reversed()),
    )
    series = (a, winding_top, inner_top, via, inner_bottom, winding_bottom, b, out, c)
    traces = [item for item in series if isinstance(item, Trace)]
    return Coil(placement, net, windings, series, True), traces, [via, out]


def two_coils(copper: int = 2, tail: bool = True, name: str = "two-coils") -> Layout:
    """The board of the module's description, with `copper` layers (the coils are on the first and the last)."""
    spec = sensor_spec(copper, tail, name)
    coils, traces, vias = [], [], []
    for number in range(2):
        coil, its_traces, its_vias = _coil(number, copper, spec)
        coils.append(coil)
        traces += its_traces
        vias += its_vias
    rows = ((-0.75, "C1", "A"), (-0.25, "C1", "B"), (0.25, "C2", "B"), (0.75, "C2", "A"))
    pads = tuple(
        Pad(Point(TAIL_END - 1.5 * MM, y * MM), (3.0 * MM, 0.3 * MM), 1, net, f"{net}.{end}", i + 1)
        for i, (y, net, end) in enumerate(rows)
    )
    x0, x1, half = -4.4 * MM, 5.0 * MM, 2.35 * MM
    corners = [
        Point(x0, -half),
        Point(x1, -half),
        Point(8.5 * MM, -1.25 * MM),
        Point(TAIL_END, -1.25 * MM),
        Point(TAIL_END, 1.25 * MM),
        Point(8.5 * MM, 1.25 * MM),
        Point(x1, half),
        Point(x0, half),
    ]
    outline = rounded_polygon(corners, [0.5 * MM, 0.5 * MM, 1.0 * MM, 0.0, 0.0, 1.0 * MM, 0.5 * MM, 0.5 * MM])
    opening = Region(rectangle(TAIL_END - 3.1 * MM, -1.25 * MM, TAIL_END + 0.2 * MM, 1.25 * MM))
    plate = Region(
        rectangle(TAIL_END - 5.0 * MM, -1.25 * MM, TAIL_END, 1.25 * MM, 0.2 * MM),
        (circle(Point(TAIL_END - 4.5 * MM, 0.0), 0.2 * MM),),
    )
    return Layout(
        spec=spec,
        coils=tuple(coils),
        traces=tuple(traces),
        vias=tuple(vias),
        pads=pads if tail else (),
        outline=outline,
        body=(x0, -half, x1, half),
        top_openings=(opening,) if tail else (),
        bottom_openings=(),
        stiffener=Stiffener(plate, 0.2 * MM, "polyimide") if tail else None,
        bend_zone=(10.5 * MM, 11.0 * MM) if tail else None,
    )


def thin_tail(board: Layout, layers: int = 2) -> Layout:
    """A board whose tail has only its first copper layers; the leads of the last layer are taken out."""
    tail = replace(board.spec.fpc.tail, layers=layers)
    spec = replace(board.spec, fpc=replace(board.spec.fpc, tail=tail))
    stored = tuple(t for t in board.traces if t.layer <= layers or t.role not in (Role.LEAD, Role.TAIL))
    vias = tuple(replace(v, lowest=layers) if v.centre.x > board.body[2] else v for v in board.vias)
    return replace(board, spec=spec, traces=stored, vias=vias)


def rotated_arcs(count: int = 24) -> tuple[Arc, ...]:
    """Arcs of many sizes, sweeps and awkward places, for the rounding of centres; true arcs to machine precision."""
    arcs = []
    for i in range(count):
        radius = 0.05 * MM * 1.37**i
        start, sweep = 0.7 * i, (-1) ** i * math.radians(3.0 + 350.0 * i / count)
        centre = Point(1.234567891 * MM * i, -0.987654321 * MM * i)
        ends = [
            Point(centre.x + radius * math.cos(angle), centre.y + radius * math.sin(angle))
            for angle in (start, start + sweep)
        ]
        arcs.append(Arc(ends[0], ends[1], centre, sweep > 0))
    return tuple(arcs)


def order_set(layout: Layout, panel=None, forced: str = "", coupon_estimates=None) -> dict[str, bytes]:
    """Every file of the order as `build` makes them: formats and papers of its stage, one after another."""
    from sitscad.files.documents import PAPERS
    from sitscad.files.formats import WRITERS

    files: dict[str, bytes] = {}
    values = {
        "layout": layout,
        "panel": panel,
        "forced": forced,
        "coupon_estimates": coupon_estimates,
        "estimates": None,
        "bench_estimates": None,
        "files": files,
    }
    for writer in (*WRITERS, *PAPERS):
        if writer.stage == "gerber":
            files |= writer.render(*(dict(files) if name == "files" else values[name] for name in writer.takes))
    return files
