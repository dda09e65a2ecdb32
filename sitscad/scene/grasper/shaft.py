"""What is behind the jaws: the pin that they turn about, and the tube that the tail leaves through."""

from __future__ import annotations

from sitscad.data import cited, rows
from sitscad.layout.board import Layout
from sitscad.layout.tail.thickness import Where, finished_thickness
from sitscad.record import record
from sitscad.scene.grasper.jaws import fitted_jaw, jaw_range
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
