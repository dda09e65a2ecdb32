"""Loads on a pad, the pad's deformation, and the range of loads for which a sensor is computed."""
