"""Routing of the coils: paths round one coil, their search, mazes between coils, and the routing of all coils."""
