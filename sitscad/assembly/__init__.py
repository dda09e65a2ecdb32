"""Places of the sensor's pieces, their CAD solids, and their fit."""
