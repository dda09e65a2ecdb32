"""Conversion of a written spec into values in SI units: presets and defaults are filled in, and parts are compared."""
