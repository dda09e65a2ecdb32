"""Plane geometry without coils: points, lines, arcs, paths and regions, in metres."""
