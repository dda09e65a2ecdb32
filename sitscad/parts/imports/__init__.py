"""Solids out of STEP files that a spec names."""
