"""What a sensor is made of, as frozen values in SI units; `spec.sensor` puts them together."""
