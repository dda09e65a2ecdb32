"""What is asked for: the spec's values, its loader and the data behind its presets."""
