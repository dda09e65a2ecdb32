"""Inductance, resistance and capacitance of windings and leads, without metal around them."""
