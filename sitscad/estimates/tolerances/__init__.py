"""Differences between units, with their bands and sources."""
