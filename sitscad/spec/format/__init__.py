"""Building blocks that declare the format of a spec: kinds of value and sections of keys."""
