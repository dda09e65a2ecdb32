"""What lies over and under the coils: target, elastomer, film and shield, and the sheets that they are cut from."""

from __future__ import annotations

from sitscad.geometry.shapes import PLATES, Outline
from sitscad.record import record
from sitscad.spec.format.kinds import Angle, Choice, Gap, Kerf, Offset, Pair, Size, Thickness
from sitscad.spec.format.section import Section, key
from sitscad.spec.materials import Conductor, ConductorChoice, ElastomerChoice, ElastomerMaterial

PlateShape = Choice(tuple(PLATES))
PlateSize = Pair(Size, single=True)
SHAPE = "outline; square, or rectangle for a size of [x, y], if left out"
OFFSET = "[x, y] of its centre from the mean of the coils' centres, like [0.5, 0]"


@record
class Target(Section):
    """The conducting plate over the coils.

    Lengths are metres; ``offset`` is along and across, ``rotation`` (rad, counter-clockwise) how it is turned about its
    own centre at rest. Shape and size are None only until they are worked out.
    """

    shape: str = key(PlateShape, SHAPE, None)
    size: tuple[float, float] = key(
        PlateSize,
        "side or diameter; rectangle: [x, y]; as wide as the coils are far apart, and one coil at least, if left out",
        None,
    )
    thickness: float = key(Thickness, "of the plate", 0.2)
    material: Conductor = key(ConductorChoice, "a conductor, or written out", "copper")
    kerf: float = key(Kerf, "width of the cut; 0: drawn as it is", 0)
    offset: tuple[float, float] = key(Pair(Offset), OFFSET, [0, 0])
    rotation: float = key(Angle, "about its own centre, counter-clockwise, like 45 deg", "0 deg")

    @property
    def outline(self) -> Outline:
        """What its shape is."""
        return PLATES[self.shape]


@record
class ElastomerPad(Section):
    """The soft pad between board and target.

    Lengths are metres. Shape and size are None only until they are worked out.
    """

    material: ElastomerMaterial = key(ElastomerChoice, "a silicone, or written out", "dragon-skin-10")
    shape: str = key(PlateShape, SHAPE, None)
    size: tuple[float, float] = key(
        PlateSize, "side or diameter; rectangle: [x, y]; as large as it must be to carry the target if left out", None
    )
    thickness: float = key(Thickness, "unloaded", 1)
    kerf: float = key(Kerf, "width of the laser's cut", 0.15)
    offset: tuple[float, float] = key(Pair(Offset), OFFSET, [0, 0])

    @property
    def outline(self) -> Outline:
        """What its shape is."""
        return PLATES[self.shape]


@record
class Encapsulation(Section):
    """The film that seals the sensor against tissue."""

    material: ElastomerMaterial = key(ElastomerChoice, "a silicone, or written out", "pdms")
    thickness: float = key(Thickness, "of the film", 0.1)


@record
class Shield(Section):
    """A sheet between coil and jaw.

    ``kerf`` is what a laser takes (m; 0: drawn as it is).
    """

    material: Conductor = key(ConductorChoice, "copper, ferrite or another conductor, or written out", "copper")
    thickness: float = key(Thickness, "of the sheet", 0.1)
    gap: float = key(Gap, "from the board's bottom face down to the sheet; inside mount.standoff", 0.6)
    kerf: float = key(Kerf, "width of the cut; 0: drawn as it is", 0)


@record
class Cutting(Section):
    """The sheets that elastomer and target are cut from, and how copies lie on them (`fpc.boards` says how many)."""

    sheet: tuple[float, float] = key(
        Pair(Size), "[x, y] of the sheet, all of it; unverified: measure yours", [100, 100]
    )
    gap: float = key(Gap, "between the cuts of two copies, more than the kerf", 1.5)
