"""Materials, by name or written out (metals, silicones, finishes, adhesives, each with its source), and the plates that
are made of them. SI units.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from sitscad.basics.record import record
from sitscad.kernels.geometry.shapes import PLATES, Outline
from sitscad.spec.format.kinds import Angle, Choice, Gap, Kerf, Label, Number, Offset, Pair, Size, Thickness, UnitValue
from sitscad.spec.format.section import WRITTEN_SOURCE, Section, key, preset_or

TemperatureCoefficient = UnitValue("temperature coefficient", "-0.005 1/K", "0.012 1/K")  # conducts, -60 to 200 degC


@record
class Conductor(Section):
    """A metal, or a magnetic sheet, written out.

    Conductivity in S/m, temperature coefficient of the resistivity in 1/K at 20 C, Young's modulus in Pa (None where it
    is not known, from memory for the presets').
    """

    name: str = key(Label, "what to call it", "written out")
    conductivity: float = key(UnitValue("conductivity", "0 S/m", "100 MS/m"), "at 20 C, like 58 MS/m")
    relative_permeability: float = key(Number(1, 100000), "1 for non-magnetic metals", 1)
    temperature_coefficient: float = key(TemperatureCoefficient, "of the resistivity, like 3930 ppm/K", "0 1/K")
    young_modulus: float | None = key(
        UnitValue("pressure", "1 MPa", "1000 GPa"), "for how far a thin target bends, like 69 GPa", None
    )
    source: str = ""


NEO_HOOKEAN = 2.0
"""The exponent of an Ogden material that is neo-Hookean."""


@record
class ElastomerMaterial(Section):
    """A silicone, written out.

    Small-strain shear modulus (Pa) with its relative uncertainty (one sigma), bulk modulus (Pa), and the exponent alpha
    of W = (2 mu / alpha^2) (sum of the stretches to the power alpha - 3) (Ogden). What its force is off by beside its
    modulus is carried as an error and never corrected: hysteresis (largest distance of loading from unloading) and
    creep, in parts of the full scale of force, what the modulus grows by with temperature, and the linear expansion
    (1/K).
    """

    name: str = key(Label, "what to call it", "written out")
    shear_modulus: float = key(
        UnitValue("pressure", "100 Pa", "100 MPa"), "at small strain, like 24 kPa; a third of Young's modulus"
    )
    shear_modulus_sigma: float = key(Number(0, 2), "relative, one sigma", 0.3, written="uncertainty")
    bulk_modulus: float = key(
        UnitValue("pressure", "1 MPa", "100 GPa"), "stiffness against change of volume", "1.5 GPa")
    hardness: str = key(Label, "Shore hardness, for the bill of materials", "")
    ogden_exponent: float = key(
        Number(1, 8), "alpha of a one-term Ogden material, whose modulus is that at small strain; 2 is neo-Hookean", 2
    )
    hysteresis_normal: float = key(
        Number(0, 1), "loading from unloading, in parts of the full scale of force", 0.1, written="hysteresis"
    )
    creep: float = key(Number(0, 1), "drift of the first minutes under a load, in parts of full scale", 0.05)
    modulus_temperature_coefficient: float = key(TemperatureCoefficient, "of the modulus", "3411 ppm/K")
    expansion: float = key(
        UnitValue("temperature coefficient", "0 1/K", "0.002 1/K"), "linear, by temperature", "300 ppm/K"
    )
    hysteresis_shear: float = 0.1
    density: float | None = None
    source: str = ""
    loss_source: str = "unverified"

    def written(self) -> ElastomerMaterial:
        """The silicone as it is written: one hysteresis for both ways, and the spec as the source of all."""
        loss = self.hysteresis_normal
        return replace(self, hysteresis_shear=loss, source=WRITTEN_SOURCE, loss_source=WRITTEN_SOURCE)


@record
class Casting:
    """Mixing ratio of a silicone in words, times for which it can be poured and until it is cured (s, at room
    temperature; None if unknown), and the source.
    """

    mix: str
    pot_time: float | None
    cure_time: float | None
    source: str


ConductorChoice = preset_or("conductor", Conductor)
ElastomerChoice = preset_or("elastomer", ElastomerMaterial, ElastomerMaterial.written)

AT_DOUBLE, TO_30_PERCENT = (2.0,), tuple(1.0 + 0.01 * k for k in range(1, 31))
"""Stretches at which neo-Hookean moduli are told: a data sheet's 100 % modulus, and a fit of 30 % of tension."""


def tension(exponent: float, stretch: float) -> float:
    """Force over the first section of a pulled bar of Ogden's rubber of one term over its modulus at rest (Ogden 1972):
    no unit.
    """
    return 2.0 / exponent * (stretch ** (exponent - 1.0) - stretch ** (-0.5 * exponent - 1.0))


def stiffened(exponent: float, stretches: Sequence[float]) -> float:
    """The modulus that a neo-Hookean law finds by least squares of a bar's stress at some stretches, over the modulus
    at rest of the Ogden rubber (no unit) that it is made of: 1 for a neo-Hookean one.
    """
    plain = [tension(NEO_HOOKEAN, stretch) for stretch in stretches]
    given = [tension(exponent, stretch) for stretch in stretches]
    return sum(a * b for a, b in zip(plain, given, strict=True)) / sum(a * a for a in plain)


@record
class Finish:
    """What is on the bare contacts: its name in job files and in words; whether it is plated by a current, and whether
    it serves contacts that are plugged in, or soldered to.
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
    """What pieces are glued with: the thickness of one glue line and its tolerance in metres.

    ``product`` is one that can be bought, ``primer`` what it needs on silicone (empty: nothing). `bonds_silicone` is
    False if it does not hold on silicone at all. ``viscosity`` (Pa s) is None for a tape. ``open_time``, ``set_time``
    and ``cure_time`` (s) are how long it flows between two faces, until pieces may be let go, and until full strength;
    the first two are None for a tape. ``inhibitor`` says what of it keeps a platinum silicone from curing on it (empty:
    nothing known).
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

    Lengths are metres. Shape and size are None only until they are worked out. ``webs`` are those of one cell's pad:
    their width and, where there are any, their lengths at its sides -x, +x, -y and +y, 0 at a side without one.
    """

    material: ElastomerMaterial = key(ElastomerChoice, "a silicone, or written out", "dragon-skin-10")
    shape: str = key(PlateShape, SHAPE, None)
    size: tuple[float, float] = key(
        PlateSize, "side or diameter; rectangle: [x, y]; as large as it must be to carry the target if left out", None
    )
    thickness: float = key(Thickness, "unloaded", 1)
    kerf: float = key(Kerf, "width of the laser's cut", 0.15)
    offset: tuple[float, float] = key(Pair(Offset), OFFSET, [0, 0])
    webs: tuple[float, ...] = ()

    @property
    def outline(self) -> Outline:
        """What its shape is."""
        return PLATES[self.shape]


@record
class Cells(Section):
    """Coils with a target and a pad of their own: ``coils`` in a row of the array's order are one cell. Target and
    elastomer say sizes and offsets of one cell, from the mean of its coils' centres. Without
    ``web`` pads stand apart.
    """

    coils: int = key(Number(1, 4, whole=True), "of one cell, in the order of the array: 1, or a group of 2 to 4", 1)
    web: float | None = key(
        Thickness, "width of strips that join neighbouring pads in rows and columns, as thick as these: one piece", None
    )


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
