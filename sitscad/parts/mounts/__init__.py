"""What carries the sensor, one module a kind: a seat in a jaw, a plate on the bench, a cap on a finger."""
