"""Endless plates before and behind a coil: its waves, what they reflect, and a target's finite size."""
