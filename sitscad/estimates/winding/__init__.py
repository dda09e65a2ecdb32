"""A winding by itself: its inductance, resistance and capacitance, each by a method that states its error."""
