"""The outline of the body as written to a closed path about the mean of the coils' centres."""

from __future__ import annotations

from dataclasses import replace

from sitscad.spec.body import BodySpec
from sitscad.spec.format.reading import Remarks
from sitscad.spec.profiles import Origin
from sitscad.spec.resolver.drawn_body import drawn
from sitscad.units import show

USUAL_CORNER = 1e-3
"""Radius (m) of the corners of a rounded body where it is left out."""


def resolve_body(part: BodySpec | None, name: str, place: Origin, remarks: Remarks) -> BodySpec | None:
    """The body with its outline; what does not go together at its key (`name`) is a flaw."""
    if part is None:
        return None
    is_drawn, is_rounded = part.shape == "dxf", part.shape == "rounded"
    for key, belongs in (("size", not is_drawn), ("corner_radius", is_rounded), ("file", is_drawn)):
        if getattr(part, key) is not None and not belongs:
            remarks.flaw("SIT009", f"{name}.{key}", f"a body of shape {part.shape} has no {key}", "leave it out")
    if is_drawn:
        return drawn(part, name, place, remarks)
    size = part.size
    if size is None:
        hint = "write the diameter, like 12" if part.shape == "circle" else "write [x, y], like [12, 8]"
        remarks.flaw("SIT003", f"{name}.size", f"a body of shape {part.shape} has no size", hint)
        return None
    if part.shape == "circle" and size[0] != size[1]:
        remarks.flaw("SIT009", f"{name}.size", "a circle has one size, not [x, y]", "write its diameter")
    if is_rounded and part.corner_radius is None:
        part = replace(part, corner_radius=USUAL_CORNER)
        remarks.default(f"{name}.corner_radius", "1 mm")
    radius, most = part.corner_radius or 0.0, min(size) / 2
    if radius > most:
        message = f"corners of {show(radius, 'm')} take more than the body's sides"
        remarks.flaw("SIT009", f"{name}.corner_radius", message, f"at most {show(most, 'm')}")
    return part.sized(size)
