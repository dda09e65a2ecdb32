"""Materials, by name or written out, each with its source; and plates of these materials. SI units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from sitscad.basics.record import record
from sitscad.kernels.geometry.shapes import PLATES, Outline
from sitscad.spec.format.kinds import Angle, Choice, Gap, Kerf, Label, Number, Offset, Pair, Size, Thickness, UnitValue
from sitscad.spec.format.section import WRITTEN_SOURCE, Section, key, preset_or

# In this range the resistivity stays positive from -60 to 200 degC.
TemperatureCoefficient = UnitValue("temperature coefficient", "-0.005 1/K", "0.012 1/K")


@record
class Conductor(Section):
    """A metal, or a magnetic sheet, written out.

    Conductivity (S/m), temperature coefficient of the resistivity (1/K at 20 C) and Young's modulus (Pa). Young's
    modulus is None if unknown. Its values in the presets are from memory.
    """

    name: str = key(Label, "name of the material", "written out")
    conductivity: float = key(UnitValue("conductivity", "0 S/m", "100 MS/m"), "at 20 C, like 58 MS/m")
    relative_permeability: float = key(Number(1, 100000), "1 for non-magnetic metals", 1)
    temperature_coefficient: float = key(TemperatureCoefficient, "of the resistivity, like 3930 ppm/K", "0 1/K")
    young_modulus: float | None = key(
        UnitValue("pressure", "1 MPa", "1000 GPa"), "for the bending of a thin target, like 69 GPa", None
    )
    source: str = ""


NEO_HOOKEAN = 2.0
"""Ogden exponent at which the Ogden law equals the neo-Hookean law."""


@record
class ElastomerMaterial(Section):
    """A silicone, written out.

    * ``shear_modulus`` (Pa): at small strain
    * ``shear_modulus_sigma``: relative standard deviation of the shear modulus
    * ``bulk_modulus`` (Pa)
    * ``ogden_exponent``: alpha of an Ogden material, W = (2 mu / alpha^2) (sum of the stretches to the power alpha - 3)
    * ``hysteresis_normal`` and ``hysteresis_shear``: largest difference between loading and unloading, as a fraction of
      the full scale of force
    * ``creep``: drift under a load, as a fraction of the full scale of force
    * ``modulus_temperature_coefficient`` (1/K): relative change of the modulus with temperature
    * ``expansion`` (1/K): coefficient of linear thermal expansion

    sitscad does not correct hysteresis and creep. They count as errors of the force.
    """

    name: str = key(Label, "name of the material", "written out")
    shear_modulus: float = key(
        UnitValue("pressure", "100 Pa", "100 MPa"), "at small strain, like 24 kPa; a third of Young's modulus"
    )
    shear_modulus_sigma: float = key(
        Number(0, 2), "relative standard deviation of the modulus", 0.3, written="uncertainty",
    )
    bulk_modulus: float = key(
        UnitValue("pressure", "1 MPa", "100 GPa"), "stiffness against change of volume", "1.5 GPa")
    hardness: str = key(Label, "Shore hardness, for the bill of materials", "")
    ogden_exponent: float = key(
        Number(1, 8), "alpha of a one-term Ogden material with this small-strain modulus; 2 is neo-Hookean", 2
    )
    hysteresis_normal: float = key(
        Number(0, 1), "largest difference of loading and unloading, as a fraction of the full scale of force", 0.1,
        written="hysteresis",
    )
    creep: float = key(Number(0, 1), "drift in the first minutes under a load, as a fraction of full scale", 0.05)
    modulus_temperature_coefficient: float = key(TemperatureCoefficient, "of the modulus", "3411 ppm/K")
    expansion: float = key(
        UnitValue("temperature coefficient", "0 1/K", "0.002 1/K"), "linear thermal expansion", "300 ppm/K"
    )
    hysteresis_shear: float = 0.1
    density: float | None = None
    source: str = ""
    loss_source: str = "unverified"

    def written(self) -> ElastomerMaterial:
        """Return the silicone with the spec as source of all figures.

        The spec has a single key for hysteresis. It applies to normal force and shear.
        """
        loss = self.hysteresis_normal
        return replace(self, hysteresis_shear=loss, source=WRITTEN_SOURCE, loss_source=WRITTEN_SOURCE)


@record
class Casting:
    """Mixing ratio of a silicone as text, pot time and cure time (s), and their source.

    Times are at room temperature, and None if unknown.
    """

    mix: str
    pot_time: float | None
    cure_time: float | None
    source: str


ConductorChoice = preset_or("conductor", Conductor)
ElastomerChoice = preset_or("elastomer", ElastomerMaterial, ElastomerMaterial.written)

AT_DOUBLE, TO_30_PERCENT = (2.0,), tuple(1.0 + 0.01 * k for k in range(1, 31))
"""Stretches (length divided by length at rest) at which a neo-Hookean law is fitted to a measured stress.

`AT_DOUBLE` is used for a data sheet's modulus at 100 % elongation, and `TO_30_PERCENT` for a modulus that was fitted to
a measurement from 1 to 30 % elongation.
"""


def tension(exponent: float, stretch: float) -> float:
    """Return the tensile stress of a bar of one-term Ogden rubber, divided by its small-strain modulus (Ogden 1972).

    The stress is the force divided by the undeformed cross-section, and the modulus is the shear modulus. `exponent` is
    the Ogden exponent, and `stretch` the length divided by the length at rest.
    """
    return 2.0 / exponent * (stretch ** (exponent - 1.0) - stretch ** (-0.5 * exponent - 1.0))


def neo_hookean_ratio(exponent: float, stretches: Sequence[float]) -> float:
    """Return the fitted neo-Hookean shear modulus of an Ogden rubber, divided by its modulus at small strain.

    The neo-Hookean law is fitted by least squares to the tensile stress of a bar at `stretches`. The result is 1 if the
    rubber is neo-Hookean, that is, if `exponent` is 2.
    """
    plain = [tension(NEO_HOOKEAN, stretch) for stretch in stretches]
    ogden = [tension(exponent, stretch) for stretch in stretches]
    return sum(a * b for a, b in zip(plain, ogden, strict=True)) / sum(a * a for a in plain)


@record
class Finish:
    """A finish of bare contacts: its names in Gerber job files and in documents.

    The flags state whether an electric current plates it, and whether it suits contacts of plugs and solder pads.
    """

    name: str
    job_name: str
    words: str
    is_electrolytic: bool
    is_for_plugs: bool
    is_for_solder: bool
    source: str


@record
class Adhesive:
    """An adhesive, with the thickness of one glue line and its tolerance (m).

    * ``product``: a commercial product, as an example
    * ``primer``: primer that the adhesive needs on silicone. Empty if none is needed.
    * ``bonds_silicone``: False if the adhesive does not bond to silicone at all
    * ``viscosity`` (Pa s): None for a tape
    * ``open_time`` (s): time until it stops flowing between two faces. None for a tape.
    * ``set_time`` (s): time until the pieces can be released. None for a tape.
    * ``cure_time`` (s): time until full strength
    * ``inhibitor``: substance in the adhesive that keeps a platinum silicone from curing. Empty if none is known.
    """

    name: str
    product: str
    line: float
    tolerance: float
    primer: str = ""
    bonds_silicone: bool = True
    viscosity: float | None = None
    open_time: float | None = None
    set_time: float | None = None
    cure_time: float = 0.0
    inhibitor: str = ""
    source: str = ""


PlateShape = Choice(tuple(PLATES))
PlateSize = Pair(Size, single=True)
SHAPE = "outline; default square, or rectangle for a size of [x, y]"
OFFSET = "[x, y] of its centre from the mean of the coils' centres, like [0.5, 0]"


@record
class Target(Section):
    """The conducting plate over the coils.

    Lengths are metres. ``offset`` is the position of the target's centre along and across the jaw, from the mean of the
    coils' centres. ``rotation`` (rad, counter-clockwise) is about the target's centre, at rest. Shape and size can be
    None until the resolver computes them.
    """

    shape: str = key(PlateShape, SHAPE, None)
    size: tuple[float, float] = key(
        PlateSize,
        "side or diameter; rectangle: [x, y]; default the distance of the coils, but at least the size of a coil",
        None,
    )
    thickness: float = key(Thickness, "of the plate", 0.2)
    material: Conductor = key(ConductorChoice, "a conductor, or written out", "copper")
    kerf: float = key(Kerf, "width of the cut; 0: drawn without compensation", 0)
    offset: tuple[float, float] = key(Pair(Offset), OFFSET, [0, 0])
    rotation: float = key(Angle, "about its own centre, counter-clockwise, like 45 deg", "0 deg")

    @property
    def outline(self) -> Outline:
        """Outline of its shape."""
        return PLATES[self.shape]


@record
class ElastomerPad(Section):
    """The soft pad between board and target.

    Lengths are metres. Shape and size can be None until the resolver computes them. ``webs`` describes the silicone
    strips from this pad to the pads of neighbouring cells: their width, then their lengths at the sides -x, +x, -y and
    +y. A length of 0 means no web at this side. ``webs`` is empty if the pad has none.
    """

    material: ElastomerMaterial = key(ElastomerChoice, "a silicone, or written out", "dragon-skin-10")
    shape: str = key(PlateShape, SHAPE, None)
    size: tuple[float, float] = key(
        PlateSize, "side or diameter; rectangle: [x, y]; default the smallest size that carries the target", None
    )
    thickness: float = key(Thickness, "unloaded", 1)
    kerf: float = key(Kerf, "width of the laser's cut", 0.15)
    offset: tuple[float, float] = key(Pair(Offset), OFFSET, [0, 0])
    webs: tuple[float, ...] = ()

    @property
    def outline(self) -> Outline:
        """Outline of its shape."""
        return PLATES[self.shape]


@record
class CellsSpec(Section):
    """Groups of coils with their own target and pad; sizes and offsets in `target` and `elastomer` are for one cell.

    A cell consists of coils that follow each other in the array. Offsets are relative to the mean of the centres of the
    cell's coils. If ``web`` is None, the pads are separate.
    """

    coils: int = key(Number(1, 4, whole=True), "of one cell, in the order of the array: 1, or a group of 2 to 4", 1)
    web: float | None = key(
        Thickness,
        "width of strips of equal thickness that join neighbouring pads in rows and columns to one piece", None,
    )


@record
class Encapsulation(Section):
    """The film that seals the sensor against tissue."""

    material: ElastomerMaterial = key(ElastomerChoice, "a silicone, or written out", "pdms")
    thickness: float = key(Thickness, "of the film", 0.1)


@record
class Shield(Section):
    """A sheet between coil and jaw.

    ``kerf`` is the width (m) of the laser's cut. If it is 0, the cut file is not compensated for it.
    """

    material: Conductor = key(ConductorChoice, "copper, ferrite or another conductor, or written out", "copper")
    thickness: float = key(Thickness, "of the sheet", 0.1)
    gap: float = key(Gap, "from the board's bottom face down to the sheet; part of mount.standoff", 0.6)
    kerf: float = key(Kerf, "width of the cut; 0: drawn without compensation", 0)


@record
class Cutting(Section):
    """The sheets that elastomer and target are cut from, and the arrangement of copies.

    `fpc.boards` sets their number.
    """

    sheet: tuple[float, float] = key(
        Pair(Size), "[x, y] of the whole sheet; unverified: measure yours", [100, 100]
    )
    gap: float = key(Gap, "between the cuts of two copies, more than the kerf", 1.5)
