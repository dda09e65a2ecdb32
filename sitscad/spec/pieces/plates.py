"""What lies over the coils: the target, the elastomer under it, the film round both."""

from __future__ import annotations

from sitscad.geometry.shapes import PLATES, Outline
from sitscad.record import record
from sitscad.spec.materials import Conductor, ElastomerMaterial


@record
class Target:
    """The conducting plate over the coils: size [x, y], thickness and kerf (0: drawn as it is) in metres.

    ``offset`` (m, along and across) is from the mean of the coils' centres, ``rotation`` (rad, counter-clockwise) how
    it is turned about its own centre at rest.
    """

    shape: str
    size: tuple[float, float]
    thickness: float
    material: Conductor
    kerf: float = 0.0
    offset: tuple[float, float] = (0.0, 0.0)
    rotation: float = 0.0

    @property
    def outline(self) -> Outline:
        """What its shape is."""
        return PLATES[self.shape]


@record
class ElastomerPad:
    """The soft pad between board and target: size [x, y], thickness, laser kerf and offset from the mean of the coils'
    centres in metres.
    """

    material: ElastomerMaterial
    shape: str
    size: tuple[float, float]
    thickness: float
    kerf: float
    offset: tuple[float, float] = (0.0, 0.0)

    @property
    def outline(self) -> Outline:
        """What its shape is."""
        return PLATES[self.shape]


@record
class Encapsulation:
    """The film that seals the sensor against tissue: thickness in metres."""

    material: ElastomerMaterial
    thickness: float


@record
class Cutting:
    """The sheets that elastomer and target are cut from: size [x, y], and what is left between two cuts (m)."""

    sheet: tuple[float, float] = (0.1, 0.1)
    gap: float = 1.5e-3
