"""Mechanics of the soft parts."""
