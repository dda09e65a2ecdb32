"""SIT2xx: what the converter reads of every coil, and how long it takes."""
