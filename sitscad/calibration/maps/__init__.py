"""From readings to forces: forms of maps and their fits, arrays in and arrays out."""
