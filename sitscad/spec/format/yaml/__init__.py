"""YAML as a spec is written in it: read with places, and written back with comments and order kept."""
