"""Converters: what they can drive, how they time and count, what to write into their registers."""
