"""Coils that somebody drew: copper read from KiCad files, and the conductor followed through it."""
