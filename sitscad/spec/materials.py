"""Materials as values: conductors, dielectrics and elastomers, each row of the data with its source."""

from __future__ import annotations

from collections.abc import Sequence

from sitscad.record import record


@record
class Conductor:
    """A metal or magnetic sheet: conductivity in S/m, relative permeability, temperature coefficient in 1/K at 20 C."""

    name: str
    conductivity: float
    relative_permeability: float = 1.0
    temperature_coefficient: float = 0.0
    source: str = ""


@record
class Losses:
    """What a silicone's force is off by beside its modulus, carried as error and never corrected.

    Hysteresis (largest distance of loading from unloading) and creep (drift of the first minutes under a load held),
    all in parts of the full scale of force; how the modulus grows with temperature, and the linear expansion (1/K).
    """

    hysteresis_normal: float = 0.0971
    hysteresis_shear: float = 0.0877
    creep: float = 0.05
    modulus_by_temperature: float = 1.0 / 293.15
    expansion: float = 300e-6
    source: str = "hysteresis of Ecoflex 00-30 (Jones thesis 7.3.2), creep and expansion from memory, unverified"


NEO_HOOKEAN = 2.0
"""The exponent of an Ogden material that is neo-Hookean."""


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
class ElastomerMaterial:
    """A silicone: small-strain shear modulus (Pa) with its relative uncertainty (one sigma), bulk modulus (Pa), the
    exponent alpha of W = (2 mu / alpha^2) (sum of the stretches to the power alpha - 3) (Ogden), and its losses.
    """

    name: str
    shear_modulus: float
    shear_modulus_sigma: float
    bulk_modulus: float
    hardness: str = ""
    density: float | None = None
    source: str = ""
    ogden_exponent: float = NEO_HOOKEAN
    losses: Losses = Losses()


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
