"""What stands on the board: the elastomer pad, the target on it, and the film that seals both."""

from __future__ import annotations

from typing import Any

from sitscad.layout.board import Layout
from sitscad.parts.prism import MM, box, one_solid, prism, top_edges
from sitscad.parts.solid import Solid
from sitscad.scene import bodies
from sitscad.scene.bodies import Body, BodyRole
from sitscad.scene.jaws import FILM_ROUNDING
from sitscad.spec.presets import metal_colour


def elastomer(layout: Layout) -> Solid | None:
    """The soft pad at its nominal size (the laser's kerf is the cut file's business), in its place."""
    return _solid(bodies.elastomer(layout.spec), "#e8d8c8")


def target(layout: Layout) -> Solid | None:
    """The conducting plate on the elastomer; on the board's face where there is no elastomer."""
    plate = bodies.target(layout.spec)
    return _solid(plate, metal_colour(plate.material) if plate else "")


def _solid(body: Body | None, colour: str) -> Solid | None:
    if body is None:
        return None
    return Solid(body.name, prism(body.outline(), *body.heights), body.material, colour, body.role)


def encapsulation(layout: Layout) -> Solid | None:
    """The film over the board's body, round the elastomer and over the target, its outer edges rounded.

    It is nowhere thinner than the spec's thickness over elastomer and target; contacts on the body stay open, the
    board's own edges and its bottom face are not covered.
    """
    film = layout.spec.encapsulation
    if film is None:
        return None
    shape = _board_film(layout, film.thickness)
    for cover in _covers(layout):
        shape = one_solid(shape + cover, "encapsulation")
    for inside in (elastomer(layout), target(layout)):
        if inside is not None:
            shape = one_solid(shape - inside.shape, "encapsulation")
    return Solid("encapsulation", shape, film.material.name, "#9fc5e8", BodyRole.ENCAPSULATION)


def _board_film(layout: Layout, thickness: float) -> Any:
    """The film on the body's top face, cut back to the body where the tail leaves it and open over contacts."""
    x0, y0, x1, y1 = layout.body
    film = prism(layout.outline, 0.0, thickness) & box(x0, y0, 0.0, x1, y1, thickness)
    for opening in layout.top_openings:
        film = film - prism(opening, -thickness, 2 * thickness)
    return one_solid(film, "encapsulation")


def _covers(layout: Layout) -> list[Any]:
    """Rounded blocks that leave the film's thickness around elastomer and target (one block where they are equal)."""
    spec = layout.spec
    pad, plate, film = bodies.elastomer(spec), bodies.target(spec), bodies.film_thickness(spec)
    if pad and plate and pad.footprint == plate.footprint:
        return [_rounded_block(plate, 0.0, bodies.top_height(spec), film)]
    blocks = []
    if pad:
        blocks.append(_rounded_block(pad, 0.0, pad.upper + film, film))
    if plate:
        blocks.append(_rounded_block(plate, max(0.0, plate.lower - film), bodies.top_height(spec), film))
    return blocks


def _rounded_block(body: Body, lower: float, upper: float, film: float) -> Any:
    block = prism(body.outline(film), lower, upper)
    return block.fillet(FILM_ROUNDING * film * MM, top_edges(block))
