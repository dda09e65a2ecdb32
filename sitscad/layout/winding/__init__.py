"""The windings of every coil, and how their layers are joined inside."""
