"""Sensing performance in newtons: range, resolution, crosstalk, and every error by its cause."""
