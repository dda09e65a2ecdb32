"""Converters: what they can drive, how they time their conversions, what to write into their registers."""

from __future__ import annotations

from sitscad.readout import ldc161x
from sitscad.readout.family import Family

FAMILIES: dict[str, Family] = {"ldc161x": ldc161x}
"""The families by the name that ``data/converters.csv`` gives every part."""
