"""The picture of the assembly beside the STEP files: exploded, and in section across the jaw."""

from __future__ import annotations

from sitscad.drawing.assembly_picture import assembly_svg
from sitscad.parts.solid import Solid, of_role
from sitscad.scene.bodies import BodyRole
from sitscad.spec.sensor import SensorSpec


def render(solids: tuple[Solid, ...], spec: SensorSpec) -> dict[str, bytes]:
    """``mount/assembly.svg``; nothing without a mount."""
    if not of_role(solids, BodyRole.MOUNT, BodyRole.JAW):
        return {}
    return {"mount/assembly.svg": assembly_svg(solids, spec).encode("utf-8")}
