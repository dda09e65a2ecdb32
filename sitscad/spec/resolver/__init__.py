"""Conversion of the sections as written into values of the spec: presets, defaults and checks between parts."""
