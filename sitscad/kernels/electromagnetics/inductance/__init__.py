"""Neumann's integral (1845) over spirals and over tracks of straight sides and arcs."""
