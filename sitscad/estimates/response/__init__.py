"""Coil readings when the target moves: inductance changes at any pose, values at the contacts, counts and maps."""
