"""What every piece weighs and where its middle is, from its exact volume and its material's density."""

from __future__ import annotations

import math
from functools import cache

from sitscad.data import cited, rows
from sitscad.layout.board import Layout
from sitscad.parts.solid import Solid, require
from sitscad.parts.whole import copper_in_films
from sitscad.record import record
from sitscad.scene.bodies import BodyRole
from sitscad.scene.state import Vector
from sitscad.spec.materials import ElastomerMaterial

CARRIERS = (BodyRole.JAW, BodyRole.OPPOSING_JAW, BodyRole.OPPOSING_PAD)
"""What the sensor is put into, and is no part of."""


@record
class Weight:
    """A piece's volume (m3), density (kg/m3), mass (kg) and centre of mass (m); mass and density None where no density
    is known. ``share`` is how much of the volume is the material: a coil's ring is tracks and gaps. ``copper`` (m3) is
    what of it is copper in a film of another material, leads and contacts; it is in the mass.
    """

    name: str
    material: str
    volume: float
    density: float | None
    mass: float | None
    centre: Vector
    source: str
    share: float = 1.0
    is_carrier: bool = False
    copper: float = 0.0


@record
class Balance:
    """Mass (kg) and centre (m) of several pieces, and the names of those that could not be weighed."""

    mass: float
    centre: Vector
    unknown: tuple[str, ...]


def weigh(layout: Layout, solids: tuple[Solid, ...]) -> tuple[Weight, ...]:
    """Every piece of the whole assembly, in its order, without a finger and metal behind, which are drawn in part."""
    # Densities (kg/m3) of the spec's silicones, with their sources
    spec = layout.spec
    parts = (spec.elastomer, spec.encapsulation)
    silicones: list[ElastomerMaterial] = [part.material for part in parts if part is not None]
    known = {each.name: (each.density, each.source) for each in silicones if each.density is not None}
    leads = copper_in_films(layout, frozenset(s.name for s in solids if s.role is BodyRole.COPPER))
    return tuple(_weight(layout, solid, known, leads.get(solid.name, 0.0)) for solid in solids
                 if solid.role not in (BodyRole.FINGER, BodyRole.METAL_BEHIND))


def balance(weights: tuple[Weight, ...]) -> Balance:
    """The mass and the centre of all pieces together."""
    known = [(w, w.mass) for w in weights if w.mass is not None]
    mass = math.fsum(m for _, m in known)
    centre = [math.fsum(m * w.centre[axis] for w, m in known) / mass if mass else 0.0 for axis in range(3)]
    return Balance(mass, (centre[0], centre[1], centre[2]), tuple(w.name for w in weights if w.mass is None))


@cache
def density(material: str) -> tuple[float, str] | None:
    """A material's density (kg/m3) and its source; None where the data have none."""
    of = (row for row in rows("densities") if row["material"] == material)
    return next(((float(row["density"]), cited(row)) for row in of), None)


def _weight(layout: Layout, solid: Solid, own: dict[str, tuple[float, str]], copper: float) -> Weight:
    """A solid's mass (kg), `copper` (m3) of it copper, and its centre (m); no mass, and why, without a density."""
    x, y, z = (float(value) * 1e-3 for value in solid.shape.center(require("build123d").CenterOf.MASS))
    share = track_share(layout, solid) if solid.role is BodyRole.COPPER else 1.0
    found, of_copper = own.get(solid.material) or density(solid.material), density("copper")
    assert of_copper is not None
    mass = None if found is None else (solid.volume * share - copper) * found[0] + copper * of_copper[0]
    value, source = found or (None, "no density is known: weigh it")
    is_carrier = solid.role in CARRIERS
    return Weight(solid.name, solid.material, solid.volume, value, mass, (x, y, z), source, share, is_carrier, copper)


def track_share(layout: Layout, solid: Solid) -> float:
    """How much of a coil's ring its tracks fill: their length times their width over its area."""
    _, number, name = solid.name.split("-", 2)
    coil = next(coil for coil in layout.coils if coil.name == name)
    winding = next(winding for winding in coil.windings if winding.layer == int(number))
    tracks = winding.path.length * layout.spec.coil.trace_width * winding.thickness
    return min(1.0, tracks / solid.volume)
