"""The picture of the assembly beside the STEP files: exploded, and in section across the jaw."""

from __future__ import annotations

from sitscad.drawing.pictures.assembly import assembly_svg
from sitscad.parts.solid import Solid
from sitscad.spec.sensor import SensorSpec


def render(solids: tuple[Solid, ...], spec: SensorSpec) -> dict[str, bytes]:
    """``mount/assembly.svg``; nothing without a mount."""
    if spec.mount is None:
        return {}
    return {"mount/assembly.svg": assembly_svg(solids, spec).encode("utf-8")}
