"""Fabricators, stack-ups, connectors, jaws and materials by name: installed ones, and those of users."""
