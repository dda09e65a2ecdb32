"""Coil readings when the target moves: changes at any pose, terminal values, counts, and maps of them."""
