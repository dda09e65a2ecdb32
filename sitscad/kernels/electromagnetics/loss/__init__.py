"""Resistance: direct current at corners and ends, skin and proximity effect."""
