"""How a spec and its profiles are written: YAML text, kinds of values, sections, and what is said of faults."""
