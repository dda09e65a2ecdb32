"""Coil readings when the target moves: changes at any pose, terminal values, counts and their maps."""
