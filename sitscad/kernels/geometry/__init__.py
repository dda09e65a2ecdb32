"""Plane geometry that knows nothing of coils: points, lines, arcs, paths and regions, in metres."""
