"""Studies: search for the designs that meet given requirements best, by varying keys of a base spec."""
