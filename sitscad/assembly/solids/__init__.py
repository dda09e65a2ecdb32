"""Solids and meshes of the sensor: board, pad, target, encapsulation, shield, jaw and mount.

The import of this package is fast, because build123d, cadquery, manifold3d, trimesh and gmsh are imported only when
needed. If one is missing, functions raise `MissingExtra` with the install command.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from sitscad.assembly.places.bodies import BodyRole
from sitscad.assembly.solids.pieces import assemble
from sitscad.assembly.solids.solid import MissingExtra, PartsError, Solid
from sitscad.assembly.solids.tooling import jig, mould, skin_mould
from sitscad.basics.arguments import checked_arguments

if TYPE_CHECKING:
    from sitscad.layout.board import Layout

__all__ = ["BodyRole", "MissingExtra", "PartsError", "Solid", "assembly_aids", "solids"]


@checked_arguments
def solids(layout: Layout) -> tuple[Solid, ...]:
    """Return all solids of the spec in place: jaw first, then upwards to the encapsulation.

    Parameters
    ----------
    layout
        The layout of a sensor.

    Returns
    -------
    tuple of Solid
        Solids with name, material and shape (mm).

    Raises
    ------
    MissingExtra
        without a CAD kernel
    PartsError
        if a part cannot exist, like a shield that does not fit into the standoff
    """
    return assemble(layout)


def assembly_aids(layout: Layout) -> tuple[Solid, ...]:
    """Return the parts of the assembly jig, and the moulds for pad and skin.

    Raises `MissingExtra` without a CAD kernel.
    """
    skin = skin_mould(layout)
    return (*jig(layout), *mould(layout), *((skin,) if skin is not None else ()))
