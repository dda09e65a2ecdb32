"""What stands on the board: the elastomer pad, the target on it, and the film that seals both."""

from __future__ import annotations

from typing import Any

from sitscad.layout.board import Layout
from sitscad.parts.prism import MM, box, one_solid, prism, top_edges
from sitscad.parts.solid import Solid, SolidRole
from sitscad.scene import slabs
from sitscad.scene.slabs import Slab
from sitscad.scene.stack import FILM_ROUNDING, Stack, stack
from sitscad.spec.profiles.presets import metal_colour


def elastomer(layout: Layout) -> Solid | None:
    """The soft pad at its nominal size (the laser's kerf is the cut file's business), in its place."""
    return _solid(slabs.elastomer(layout.spec), "#e8d8c8", SolidRole.ELASTOMER)


def target(layout: Layout) -> Solid | None:
    """The conducting plate on the elastomer; on the board's face where there is no elastomer."""
    plate = slabs.target(layout.spec)
    return _solid(plate, metal_colour(plate.material) if plate else "", SolidRole.TARGET)


def _solid(slab: Slab | None, colour: str, role: SolidRole) -> Solid | None:
    return None if slab is None else Solid(slab.name, prism(slab.outline(), *slab.heights), slab.material, colour, role)


def encapsulation(layout: Layout) -> Solid | None:
    """The film over the board's body, round the elastomer and over the target, its outer edges rounded.

    It is nowhere thinner than the spec's thickness over elastomer and target; contacts on the body stay open, the
    board's own edges and its bottom face are not covered.
    """
    film = layout.spec.encapsulation
    if film is None:
        return None
    shape = _board_film(layout, film.thickness)
    for cover in _covers(stack(layout)):
        shape = one_solid(shape + cover, "encapsulation")
    for inside in (elastomer(layout), target(layout)):
        if inside is not None:
            shape = one_solid(shape - inside.shape, "encapsulation")
    return Solid("encapsulation", shape, film.material.name, "#9fc5e8", SolidRole.ENCAPSULATION)


def _board_film(layout: Layout, thickness: float) -> Any:
    """The film on the body's top face, cut back to the body where the tail leaves it and open over contacts."""
    x0, y0, x1, y1 = layout.body
    film = prism(layout.outline, 0.0, thickness) & box(x0, y0, 0.0, x1, y1, thickness)
    for opening in layout.top_openings:
        film = film - prism(opening, -thickness, 2 * thickness)
    return one_solid(film, "encapsulation")


def _covers(levels: Stack) -> list[Any]:
    """Rounded blocks that leave the film's thickness around elastomer and target (one block where they are equal)."""
    pad, plate, film = levels.elastomer, levels.target, levels.film
    if pad and plate and pad.footprint == plate.footprint:
        return [_rounded_block(plate, 0.0, levels.top, film)]
    blocks = []
    if pad:
        blocks.append(_rounded_block(pad, 0.0, pad.upper + film, film))
    if plate:
        blocks.append(_rounded_block(plate, max(0.0, plate.lower - film), levels.top, film))
    return blocks


def _rounded_block(slab: Slab, lower: float, upper: float, film: float) -> Any:
    block = prism(slab.outline(film), lower, upper)
    return block.fillet(FILM_ROUNDING * film * MM, top_edges(block))
