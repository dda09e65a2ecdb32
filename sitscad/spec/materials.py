"""Materials, by name or written out: metals, silicones, finishes, adhesives, each with its source. SI units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from sitscad.record import record
from sitscad.spec.format.kinds import Label, Number, Quantity
from sitscad.spec.format.section import WRITTEN_SOURCE, Section, key, preset_or

TemperatureCoefficient = Quantity("temperature coefficient", "-0.005 1/K", "0.012 1/K")  # conducts from -60 to 200 degC


@record
class Conductor(Section):
    """A metal, or a magnetic sheet, written out.

    Conductivity in S/m, temperature coefficient of the resistivity in 1/K at 20 C.
    """

    name: str = key(Label, "what to call it", "written out")
    conductivity: float = key(Quantity("conductivity", "0 S/m", "100 MS/m"), "at 20 C, like 58 MS/m")
    relative_permeability: float = key(Number(1, 100000), "1 for non-magnetic metals", 1)
    temperature_coefficient: float = key(TemperatureCoefficient, "of the resistivity, like 3930 ppm/K", "0 1/K")
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
        Quantity("pressure", "100 Pa", "100 MPa"), "at small strain, like 24 kPa; a third of Young's modulus"
    )
    shear_modulus_sigma: float = key(Number(0, 2), "relative, one sigma", 0.3, written="uncertainty")
    bulk_modulus: float = key(Quantity("pressure", "1 MPa", "100 GPa"), "stiffness against change of volume", "1.5 GPa")
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
        Quantity("temperature coefficient", "0 1/K", "0.002 1/K"), "linear, by temperature", "300 ppm/K"
    )
    hysteresis_shear: float = 0.1
    density: float | None = None
    source: str = ""
    loss_source: str = "unverified"

    def written(self) -> ElastomerMaterial:
        """The silicone as it is written: one hysteresis for both ways, and the spec as the source of all."""
        loss = self.hysteresis_normal
        return replace(self, hysteresis_shear=loss, source=WRITTEN_SOURCE, loss_source=WRITTEN_SOURCE)


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

    ``product`` is one that can be bought, ``primer`` what it needs on silicone (empty: nothing).
    """

    name: str
    product: str
    line: float
    tolerance: float
    primer: str = ""
    source: str = ""
