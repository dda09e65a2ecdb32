"""Places of the sensor's pieces, seen from above and in height. No other package computes them."""
