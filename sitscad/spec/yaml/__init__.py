"""Reader and editor of a spec's YAML text, with the position of every value."""
