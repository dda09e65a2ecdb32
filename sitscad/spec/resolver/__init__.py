"""The written sections to the values of the spec: presets looked up, defaults noted, pieces held against each other."""
