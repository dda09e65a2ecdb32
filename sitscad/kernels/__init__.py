"""Pure functions of arrays: geometry, electromagnetics, mechanics, converters."""
