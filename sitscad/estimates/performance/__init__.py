"""What the sensor feels, in newtons: range, resolution, crosstalk, and every error by its cause."""
