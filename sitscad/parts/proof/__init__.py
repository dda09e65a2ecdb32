"""Does it fit, on the solids themselves: what is measured of meshes, and what of that is to be looked at."""
