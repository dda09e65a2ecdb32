"""The coils by themselves, and the leads to them: inductance, resistance, capacitance."""
