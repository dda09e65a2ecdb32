"""Inductance, resistance and capacitance of the coils by themselves and of their leads."""
