"""Specification of a sensor: values, loader, and data of the presets."""
