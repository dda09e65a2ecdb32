"""Electrical values of a single coil without a sensor: inductance, resistance, quality factor and self-resonance."""
