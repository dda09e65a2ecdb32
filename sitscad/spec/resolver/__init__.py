"""From what is written to SI values: defaults filled in, names looked up, parts held against each other."""
