"""The proof that it fits, on the solids themselves: what the plane tier says of figures, measured on meshes of the
pieces as they are glued together and closed, and the jaws opened about their hinge.

The two know nothing of each other but the spec: `sitscad.scene.fit` adds figures up, this measures triangles.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from sitscad.layout.board import Layout
from sitscad.parts import fit
from sitscad.parts.assembly import closed_pair
from sitscad.parts.extras import require
from sitscad.parts.mesh import CHORD, manifold, tessellate
from sitscad.parts.prism import MM
from sitscad.parts.solid import PartsError, Solid
from sitscad.record import record
from sitscad.scene.bodies import MOUNT_PIECES, BodyRole, board_heights, seat_spans, shield_heights
from sitscad.scene.column import column, levels
from sitscad.scene.fit import closed_section
from sitscad.scene.jaws import axis, fitted_jaw, jaw_range, shield_that_fits

STEPS = 6
"""Positions between closed and wide open that the jaws are tried in."""
SLIVER = 1e-12
"""Volumes (m3) below this are where two chord meshes of one touching round face overlap: 10 um by 0.3 mm by 0.3 mm."""


@record
class Proof:
    """What was measured of the closed pair as it is glued: the radius (m) of the circle about its axis that holds it,
    by meshes and by the plane tier, the port's; the pieces that share a volume, closed and while opening; the least gap
    (m) of every two pieces; how far (rad) the jaws were opened (None: the hinge is not known).
    """

    radius: float
    plane_radius: float
    port_radius: float
    interferences: tuple[fit.Interference, ...]
    clearances: tuple[fit.Clearance, ...]
    opened: float | None

    @property
    def fits(self) -> bool:
        """Whether the pair passes its port, within the meshes' chord error, and nothing stands in anything."""
        return not self.interferences and self.radius <= self.port_radius + CHORD / MM


def prove(layout: Layout) -> Proof | None:
    """Measure the solids; None without a jaw. Raises `PartsError` where the shield does not fit, `MissingExtra`."""
    jaw, plane = fitted_jaw(layout), closed_section(layout)
    if jaw is None or plane is None:
        return None
    pair = glued(layout, closed_pair(layout))
    opened = jaw.opening if jaw.hinge is not None else None
    found = list(fit.interferences(pair))
    if opened is not None:
        found += _while_opening(layout, pair, opened)
    radius = fit.envelope_radius(pair)
    return Proof(radius, plane.radius, jaw.port_diameter / 2, tuple(found), fit.clearances(pair), opened)


def require_proof(layout: Layout) -> Proof | None:
    """As `prove`; raises `PartsError` where pieces stand in each other, which no build goes on with."""
    proof = prove(layout)
    if proof is not None and proof.interferences:
        first = proof.interferences[0]
        raise PartsError(
            f"{first.first} and {first.second} stand in each other: {first.volume * 1e9:.3g} mm3 (and "
            f"{len(proof.interferences) - 1} more pairs)"
        )
    return proof


def glued(layout: Layout, solids: tuple[Solid, ...]) -> tuple[Solid, ...]:
    """The solids lifted by the glue lines below them, the board staying where it is."""
    bd = require("build123d")
    lifts = _lifts(layout)
    return tuple(
        replace(s, shape=s.shape.moved(bd.Location((0, 0, lifts.get(s.name, 0.0) * MM)))) if lifts.get(s.name) else s
        for s in solids
    )


def _lifts(layout: Layout) -> dict[str, float]:
    """By how much glue lifts every piece (m): its lower face in the plane tier, less that of the solids."""
    at = levels(column(layout))
    board = at["board"][0].nominal - board_heights(layout.spec)[0]
    stands = {part: lower.nominal - board for part, (lower, _) in at.items()}
    bare = _bare_heights(layout)
    found = {part: stands[part] - lower for part, lower in bare.items() if part in stands}
    return found | {"encapsulation": found.get("target", found.get("elastomer", 0.0))}


def _bare_heights(layout: Layout) -> dict[str, float]:
    """The lower faces (m) of the pieces alone."""
    spec = layout.spec
    bottom, here = board_heights(spec)[0], 0.0
    found = {"board": bottom}
    mount = spec.mount
    assert mount is not None and mount.jaw is not None
    sheet = shield_that_fits(spec)
    for name, (lower, _) in zip(MOUNT_PIECES, seat_spans(bottom, mount.standoff, sheet), strict=False):
        found[name] = lower
    levels_of_sheet = shield_heights(spec)
    if levels_of_sheet is not None:
        found["shield"] = levels_of_sheet[0]
    found["jaw"] = bottom - mount.standoff - mount.jaw.height
    above = (
        ("elastomer", spec.elastomer.thickness if spec.elastomer else None),
        ("target", spec.target.thickness if spec.target else None),
        ("encapsulation", spec.encapsulation.thickness if spec.encapsulation else None),
        ("opposing-pad", mount.jaw.opposing_pad_thickness or None),
        ("opposing-jaw", mount.jaw.height),
    )
    for name, thickness in above:
        if thickness is not None:
            found[name] = here
            here += thickness
    return found


def _while_opening(layout: Layout, pair: tuple[Solid, ...], opening: float) -> list[fit.Interference]:
    """What the other jaw, turned about the hinge by steps up to `opening` (rad) against this one, stands in."""
    bodies = [(solid, manifold(tessellate(solid))) for solid in pair]
    moving = [entry for entry in bodies if entry[0].role in (BodyRole.OPPOSING_JAW, BodyRole.OPPOSING_PAD)]
    still = [entry for entry in bodies if entry not in moving]
    found: dict[tuple[str, str], float] = {}
    for step in range(1, STEPS + 1):
        for solid, body in moving:
            turned = _turned(layout, body, opening * step / STEPS)
            for other, fixed in still:
                shared = float((turned ^ fixed).volume()) * 1e-9
                if shared > SLIVER:
                    key = (other.name, solid.name)
                    found[key] = max(shared, found.get(key, 0.0))
    return [fit.Interference(first, second, volume) for (first, second), volume in sorted(found.items())]


def _turned(layout: Layout, body: Any, angle: float) -> Any:
    """A mesh turned about the hinge's pivot by an angle (rad), so that its tip goes up."""
    jaw, plane = fitted_jaw(layout), closed_section(layout)
    assert jaw is not None and jaw.hinge is not None and plane is not None
    x, z = (jaw_range(layout, jaw)[1] + jaw.hinge) * MM, plane.axis * MM
    y = axis(layout).y * MM
    return body.translate((-x, -y, -z)).rotate((0.0, math.degrees(angle), 0.0)).translate((x, y, z))
