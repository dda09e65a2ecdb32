"""Layouts made by hand: what the parts read of one (outline, body, openings, stiffener and the spec), no copper."""

from __future__ import annotations

import functools
import math
from dataclasses import replace

from sitscad.assembly import solids as parts
from sitscad.assembly.solids import Solid
from sitscad.kernels.geometry.path import Point, Region, rectangle, rounded_polygon
from sitscad.layout.board import Layout, Stiffener
from sitscad.spec import presets
from sitscad.spec.circuit import FpcSpec, LayerKind, PanelSpec, StackLayer, Stackup
from sitscad.spec.coil import ArraySpec, CoilPlacement, CoilSpec
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.materials import Conductor, ElastomerMaterial, ElastomerPad, Encapsulation, Shield, Target
from sitscad.spec.mount import LEVEL, Jaw, Mount
from sitscad.spec.sensor import ReadoutSpec, Requirements, SensorSpec
from sitscad.spec.yaml.source import SpecSource

COPPER = Conductor("copper", 5.8e7)
STEEL = Conductor("stainless-304", 1.4e6)
SOFT = ElastomerMaterial("dragon-skin-10", 90e3, 0.3, 1.5e9)
PDMS = ElastomerMaterial("pdms", 600e3, 0.3, 1.5e9)


def jaw(width=4.8e-3, height=1.2e-3, pad=0.0, length=16e-3) -> Jaw:
    """A jaw for a 5 mm port."""
    return Jaw("test-5mm", None, width, length, height, 5e-3, STEEL, **(LEVEL | {"opposing_pad_thickness": pad}))


def sensor(name="hand-made", pitch=4.5e-3, layers=4, **parts) -> SensorSpec:
    """A sensor of two coils along x; `parts` replaces target, elastomer, encapsulation, mount or shield."""
    stackup = Stackup("hand", tuple(StackLayer(LayerKind.COPPER, 50e-6, "copper") for _ in range(layers)))
    rules = DesignRules("hand", 1e-4, 1e-4, 2e-4, 1e-4, None, None, False, *[1e-4] * 5, (1e-3, 1e-3))
    places = (CoilPlacement("C1", (-pitch / 2, 0.0)), CoilPlacement("C2", (pitch / 2, 0.0)))
    nothing = dict.fromkeys(("target", "elastomer", "encapsulation", "mount", "shield"))
    return SensorSpec(
        name=name,
        coil=CoilSpec("circle", (4e-3, 4e-3), 7.75, layers=(1, 2, 3, 4), trace_width=8e-5, trace_spacing=8e-5),
        array=ArraySpec("line", places, pitch),
        fpc=FpcSpec(stackup=stackup, rules=rules, panel=PanelSpec(), teardrops="none"),
        readout=ReadoutSpec(presets.converter("ldc1614"), None, "converter", None, None, 40e6, 500.0),
        requirements=Requirements(),
        source=SpecSource("hand.yaml", ""),
        **{**nothing, **parts},
    )


def board(spec: SensorSpec, body=(9.0e-3, 4.4e-3), tail=12e-3, tail_width=1.6e-3, end_width=3.0e-3) -> Layout:
    """A body with round corners, a tail that widens to its contacts, a stiffener under these."""
    x, y, t, e = body[0] / 2, body[1] / 2, tail_width / 2, end_width / 2
    end = x + tail
    upper = [Point(end, e), Point(end - 4e-3, e), Point(end - 5e-3, t), Point(x, t), Point(x, y), Point(-x, y)]
    corners = [Point(p.x, -p.y) for p in reversed(upper)] + upper
    radii = [0.5e-3, 0.5e-3, 0.4e-3, 0.4e-3, 0.4e-3, 0.1e-3]
    plate = Stiffener(Region(rectangle(end - 3e-3, -e, end, e)), 0.15e-3, "polyimide")
    return Layout(
        spec=spec,
        coils=(),
        traces=(),
        vias=(),
        pads=(),
        outline=rounded_polygon(corners, [*radii, *reversed(radii)]),
        body=(-x, -y, x, y),
        top_openings=(Region(rectangle(end - 1.5e-3, -e, end, e)),),
        bottom_openings=(),
        stiffener=plate,
        bend_zone=None,
    )


def jaw_sensor(**changes) -> Layout:
    """A four-layer jaw sensor with everything: shield, seat, jaw, elastomer, target and film."""
    parts = {
        "elastomer": ElastomerPad(SOFT, "square", (4e-3, 4e-3), 1e-3, 0.15e-3),
        "target": Target("square", (4e-3, 4e-3), 0.2e-3, COPPER),
        "encapsulation": Encapsulation(PDMS, 0.1e-3),
        "mount": Mount("grasper-pad", jaw(), 1.0e-3),
        "shield": Shield(COPPER, 0.1e-3, 0.6e-3),
    }
    return board(sensor(**{**parts, **changes}))


def bench_sensor(**changes) -> Layout:
    """A bench prototype of 7 mm coils on a plate, elastomer and target 8 mm square, wider than the board."""
    parts = {
        "elastomer": ElastomerPad(SOFT, "square", (8e-3, 8e-3), 2e-3, 0.15e-3),
        "target": Target("square", (8e-3, 8e-3), 0.2e-3, COPPER),
        "mount": Mount("bench-plate", None, 2.0e-3),
    }
    spec = sensor("bench", pitch=8e-3, layers=2, **{**parts, **changes})
    return board(spec, body=(16e-3, 7.6e-3), tail=30e-3, tail_width=2e-3)


def bare(**changes) -> Layout:
    """A board with nothing on it."""
    return board(sensor("bare", **changes))


def with_solder_pads(layout: Layout) -> Layout:
    """The same sensor without a tail, contacts open on the body."""
    x0, y0, x1, y1 = layout.body
    opening = Region(rectangle(x1 - 0.8e-3, -1e-3, x1 - 0.2e-3, 1e-3))
    return replace(layout, outline=rectangle(x0, y0, x1, y1, 0.5e-3), top_openings=(opening,), stiffener=None)


def round_sensor() -> Layout:
    """A round pad under a smaller round target."""
    return jaw_sensor(
        elastomer=ElastomerPad(SOFT, "circle", (4e-3, 4e-3), 1e-3, 0.15e-3),
        target=Target("circle", (3e-3, 3e-3), 0.2e-3, COPPER),
    )


def overhanging_sensor() -> Layout:
    """A target that reaches over its pad along the jaw and leaves it free across."""
    return jaw_sensor(
        elastomer=ElastomerPad(SOFT, "square", (3e-3, 3e-3), 1e-3, 0.15e-3),
        target=Target("rectangle", (5e-3, 2.4e-3), 0.2e-3, COPPER),
        shield=None,
    )


def oblique_sensor() -> Layout:
    """A target that is offset and turned on a pad that is offset too, in the jaw."""
    return jaw_sensor(
        elastomer=ElastomerPad(SOFT, "rectangle", (5e-3, 3.6e-3), 1e-3, 0.15e-3, (0.6e-3, 0.1e-3)),
        target=Target("rectangle", (4e-3, 1.2e-3), 0.2e-3, COPPER, 0.0, (0.9e-3, 0.2e-3), math.radians(30.0)),
    )


SENSORS = {
    "jaw": jaw_sensor,
    "solder-pads": lambda: with_solder_pads(jaw_sensor()),
    "round": round_sensor,
    "overhanging": overhanging_sensor,
    "oblique": oblique_sensor,
    "bench": bench_sensor,
    "bench-shielded": lambda: bench_sensor(shield=Shield(COPPER, 0.1e-3, 0.6e-3)),
    "bare": bare,
}
"""Sensors of every kind that the parts know."""


@functools.cache
def layout(name: str) -> Layout:
    """One of `SENSORS`, laid out once a process."""
    return SENSORS[name]()


@functools.cache
def solids(name: str) -> tuple[Solid, ...]:
    """The solids of one of `SENSORS`, built once a process."""
    return parts.solids(layout(name))


def bounds(solid: Solid) -> tuple[float, ...]:
    """Bounding box in metres: x0, y0, z0, x1, y1, z1."""
    box = solid.shape.bounding_box()
    return tuple(1e-3 * v for v in (*box.min, *box.max))


def piece(sensor: str, name: str) -> Solid:
    """One solid of one of `SENSORS` by its name."""
    return next(solid for solid in solids(sensor) if solid.name == name)
