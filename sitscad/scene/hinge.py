"""The jaws' hinge: the pin that they turn about, how near the tail comes to it, the tube behind, how the jaws close."""

from __future__ import annotations

import math

from sitscad.data import cited, rows
from sitscad.layout.board import Layout
from sitscad.layout.thickness import Where, finished_thickness, tail_thickness
from sitscad.measured import Closing
from sitscad.record import record
from sitscad.scene.fit import closed_section
from sitscad.scene.jaws import axis, fitted_jaw, jaw_range
from sitscad.scene.tail_path import tail_path
from sitscad.spec.sensor import SensorSpec
from sitscad.units import parse_quantity


@record
class Shaft:
    """The bore of the tube and the diameter of the hinge's pin (m), and where the figures come from."""

    bore: float
    pin: float
    source: str


def shaft(spec: SensorSpec) -> Shaft | None:
    """What is behind the spec's jaw: as the spec writes it, else what is usual for its port; None without a jaw."""
    jaw = spec.mount.jaw if spec.mount is not None else None
    if jaw is None:
        return None
    table = rows("shafts")
    row = next((row for row in table if jaw.port_diameter <= parse_quantity(row["up_to_port"], "length")), table[-1])
    own = spec.assembly
    bore = parse_quantity(row["bore"], "length") if own.shaft_bore is None else own.shaft_bore
    pin = parse_quantity(row["pin"], "length") if own.hinge_pin is None else own.hinge_pin
    if own.shaft_bore is not None and own.hinge_pin is not None:
        return Shaft(bore, pin, "the spec (assembly.shaft_bore, assembly.hinge_pin)")
    return Shaft(bore, pin, cited(row))


def end_section(layout: Layout) -> tuple[float, float]:
    """Width and thickness (m) of what of the tail lies behind the jaw, its end and the stiffener there included; zeros
    where nothing does, or without a jaw.
    """
    jaw = fitted_jaw(layout)
    if jaw is None:
        return 0.0, 0.0
    heel = jaw_range(layout, jaw)[1]
    ys = [point.y for point in layout.outline.flattened(1e-5) if point.x > heel]
    return (max(ys) - min(ys) if ys else 0.0), finished_thickness(layout, Where.CONTACT).nominal


@record
class PinGap:
    """How far the tail's nearest face runs from the pivot and the radius of the pin there (m), when, at which angle
    (rad) of the jaw, and where the pin's figure comes from.
    """

    when: str
    away: float
    pin: float
    angle: float
    source: str

    @property
    def is_free(self) -> bool:
        """Whether the tail passes the pin."""
        return self.away >= self.pin


def pin_gaps(layout: Layout) -> tuple[PinGap, ...]:
    """The tail at the pin, closed and wide open; nothing without a hinge, or a tail that is led along the jaw.

    Raises `PartsError` where the shield does not fit into the standoff.
    """
    jaw, behind, pair = fitted_jaw(layout), shaft(layout.spec), closed_section(layout)
    closed = tail_path(layout)
    if jaw is None or behind is None or pair is None or jaw.hinge is None or closed is None or closed.radius is None:
        return ()
    pivot = jaw_range(layout, jaw)[1] + jaw.hinge, pair.axis - jaw.pivot_offset
    half = (jaw.opening or 0.0) / 2
    ways = [("closed", 0.0, closed), (f"open by {math.degrees(2 * half):.3g} deg", half, tail_path(layout, half))]
    thick = tail_thickness(layout.spec)
    return tuple(
        PinGap(when, (way or closed).distance(*pivot) - thick / 2, behind.pin / 2, angle, behind.source)
        for when, angle, way in ways
    )


def closing(layout: Layout) -> Closing | None:
    """How the sensor's jaws close; None without a jaw. Raises `PartsError` where the shield does not fit.

    Backs that lie on the port's circle are parallel when the pair is as high as the port: what the closed pair with the
    sensor leaves of that is the tissue's.
    """
    jaw, pair = fitted_jaw(layout), closed_section(layout)
    if jaw is None or pair is None:
        return None
    heel = jaw_range(layout, jaw)[1]
    reach = None if jaw.hinge is None else heel + jaw.hinge - axis(layout).x
    return Closing(jaw.port_diameter - pair.height, reach, jaw.opening, jaw.pivot_offset)
