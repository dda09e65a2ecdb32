"""One coil without a sensor: inductance, resistance, quality factor and self-resonance of a planar spiral."""
