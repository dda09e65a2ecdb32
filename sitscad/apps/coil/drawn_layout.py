"""Layout and capacitance of a coil that is drawn in a file, without a spec. Its turns must have a known shape."""

from __future__ import annotations

from sitscad.apps.coil.variants import PLAIN_COIL
from sitscad.basics.record import replace
from sitscad.estimates.windings.leads import estimate_leads
from sitscad.estimates.windings.own_capacitance import self_capacitance
from sitscad.kernels.electromagnetics.loss.resistance import conductivity_at
from sitscad.layout import arrange
from sitscad.layout.board import Layout
from sitscad.spec.circuit import Stackup
from sitscad.spec.drawn.copper import DrawnCopper
from sitscad.spec.drawn.follow import DrawnConductor
from sitscad.spec.drawn.spiral import recognised
from sitscad.spec.sensor import SensorSpec


def layout_of_drawing(
    copper: DrawnCopper, conductor: DrawnConductor, stackup: Stackup, temperature: float
) -> Layout:
    """Return the layout of a drawn coil alone, at a copper temperature in degrees Celsius.

    `stackup` has the same number of copper layers as the file. Raises DrawnCoilError if the turns have no known shape.
    """
    plain = SensorSpec.from_mapping({"name": "coil", "coil": PLAIN_COIL})
    coil = recognised(conductor, copper.names_for(len(stackup.copper)), plain.coil)
    return arrange(replace(
        plain, coil=coil, fpc=replace(plain.fpc, stackup=stackup),
        requirements=replace(plain.requirements, temperature=temperature)))


def terminal_capacitance(layout: Layout) -> float:
    """Return the capacitance (F) of a drawn coil between its terminals: winding and leads."""
    (coil,), spec = layout.coils, layout.spec
    leads = estimate_leads(coil, spec.fpc.stackup, conductivity_at(spec.requirements.temperature))
    return self_capacitance(coil, spec.coil, spec.fpc.stackup) + leads.capacitance
