"""Positions of the sensor's parts, their CAD solids, and their fit in the instrument."""
