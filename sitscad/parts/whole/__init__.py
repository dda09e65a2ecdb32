"""The whole assembly as it is glued, closed in its jaws: every film of the board, copper, glue, the tail as it runs."""

from __future__ import annotations

from dataclasses import replace

from sitscad.layout.board import Layout
from sitscad.parts.assembly import assemble
from sitscad.parts.jaw import opposing
from sitscad.parts.pad import encapsulation
from sitscad.parts.solid import Solid
from sitscad.parts.whole.films import films
from sitscad.parts.whole.glue import glue_lines
from sitscad.parts.whole.lift import glued
from sitscad.parts.whole.tail import stiffener_on
from sitscad.scene.bodies import BodyRole, target_lines
from sitscad.scene.tail_path import tail_path


def whole(layout: Layout, pieces: tuple[Solid, ...] | None = None) -> tuple[Solid, ...]:
    """Every piece in its place, from the jaw upwards: jaw, seat, shield, the board's films with each coil's copper as a
    ring on every layer, stiffener, elastomer, target, glue lines between them, film, the other jaw closed.

    `pieces` are those of `sitscad.parts.assembly.assemble` where somebody has them already. Heights are those of the
    glued assembly, z = 0 the board's top face. Raises `PartsError` where a part cannot exist,
    `MissingExtra` without a CAD kernel.
    """
    alone = assemble(layout) if pieces is None else pieces
    pieces = glued(layout, (*alone, *opposing(layout)))
    path = tail_path(layout)
    cover = _film(layout)
    board = films(layout, path)
    plate = stiffener_on(layout, path)
    kept = [s for s in pieces if s.role not in (BodyRole.BOARD, BodyRole.STIFFENER, BodyRole.ENCAPSULATION)]
    glue = glue_lines(layout, tuple(kept))
    found = [*kept, *board, *glue, *([plate] if plate else []), *([cover] if cover else [])]
    return tuple(sorted(found, key=lambda s: round(s.shape.bounding_box().min.Z, 6)))


def _film(layout: Layout) -> Solid | None:
    """The encapsulation over pieces that glue lifts: that of a pad so much thicker."""
    pad, lines = layout.spec.elastomer, target_lines(layout.spec)
    if pad is None or not lines:
        return encapsulation(layout)
    return encapsulation(
        replace(layout, spec=replace(layout.spec, elastomer=replace(pad, thickness=pad.thickness + lines)))
    )
