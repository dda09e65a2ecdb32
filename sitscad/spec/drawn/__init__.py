"""Drawn coils: copper read from KiCad files, and the conductor followed through it."""
