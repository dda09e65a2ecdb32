"""Differences between manufactured units, with their tolerance bands and sources."""
