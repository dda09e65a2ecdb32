"""Metals and silicones, by name or written out."""

from __future__ import annotations

from sitscad.spec.format.kinds.number import Number
from sitscad.spec.format.kinds.preset import Preset
from sitscad.spec.format.kinds.quantity import Quantity
from sitscad.spec.format.kinds.word import Text
from sitscad.spec.format.section import NameOr, Part, Section, key

Label = Text(64)
ShearModulus = Quantity("pressure", "100 Pa", "100 MPa")
BulkModulus = Quantity("pressure", "1 MPa", "100 GPa")
Conductivity = Quantity("conductivity", "0 S/m", "100 MS/m")
Expansion = Quantity("temperature coefficient", "0 1/K", "0.002 1/K")
TemperatureCoefficient = Quantity("temperature coefficient", "-0.005 1/K", "0.012 1/K")  # conducts from -60 to 200 degC


class ConductorDocument(Section):
    """A metal, or a magnetic sheet, written out."""

    name: str = key(Label, "what to call it", "written out")
    conductivity: float = key(Conductivity, "at 20 C, like 58 MS/m")
    relative_permeability: float = key(Number(1, 100000), "1 for non-magnetic metals", 1)
    temperature_coefficient: float = key(TemperatureCoefficient, "of the resistivity, like 3930 ppm/K", "0 1/K")


class ElastomerDocument(Section):
    """A silicone, written out."""

    name: str = key(Label, "what to call it", "written out")
    shear_modulus: float = key(ShearModulus, "at small strain, like 24 kPa; a third of Young's modulus")
    uncertainty: float = key(Number(0, 2), "relative, one sigma", 0.3)
    bulk_modulus: float = key(BulkModulus, "stiffness against change of volume", "1.5 GPa")
    hardness: str = key(Label, "Shore hardness, for the bill of materials", "")
    ogden_exponent: float = key(
        Number(1, 8), "alpha of a one-term Ogden material, whose modulus is that at small strain; 2 is neo-Hookean", 2
    )
    hysteresis: float = key(Number(0, 1), "loading from unloading, in parts of the full scale of force", 0.1)
    creep: float = key(Number(0, 1), "drift of the first minutes under a load, in parts of full scale", 0.05)
    modulus_temperature_coefficient: float = key(TemperatureCoefficient, "of the modulus", "3411 ppm/K")
    expansion: float = key(Expansion, "linear, by temperature", "300 ppm/K")


ConductorChoice = NameOr(Preset("conductor"), Part(ConductorDocument))
ElastomerChoice = NameOr(Preset("elastomer"), Part(ElastomerDocument))
