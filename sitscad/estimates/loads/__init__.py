"""Loads on a pad, its deformation, and the range of loads that is computed."""
