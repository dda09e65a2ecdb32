"""Neumann's integral over spirals and over tracks of sides and arcs."""
