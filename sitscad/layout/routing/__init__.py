"""How coils are led out: the ways round one coil, the search for them, mazes between coils, the routing of all."""
