"""Converters: channels and limits, conversion settings and times, register values."""
