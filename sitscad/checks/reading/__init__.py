"""SIT2xx, SIT305: rules for the converter's readings of every coil, and for the time that they take."""
