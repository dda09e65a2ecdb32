"""Windings on a board of nothing else, for papers that give capacitance or resonance of one."""

from __future__ import annotations

from sitscad.estimates import estimate
from sitscad.estimates.windings.own_capacitance import self_capacitance
from sitscad.kernels.electromagnetics.resonator import resonance_frequency
from sitscad.layout import lay_out
from sitscad.spec.load import load_text


def of(coil, stackup):
    """Capacitance of a winding, its inductance and both together as a resonance."""
    layout = lay_out(load_text(f"sitscad: 1\nname: c\ncoil: {coil}\nfpc: {{stackup: {stackup}}}\n", "c.yaml"))
    own = self_capacitance(layout.coils[0], layout.spec.coil, layout.spec.fpc.stackup)
    inductance = estimate(layout).coils[0].winding_inductance
    return own, inductance, resonance_frequency(inductance, own)
