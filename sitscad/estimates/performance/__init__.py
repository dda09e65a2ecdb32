"""Sensing performance in newtons: range, resolution, crosstalk, and the error by each cause."""
