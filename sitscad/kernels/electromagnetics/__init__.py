"""Electromagnetic kernels of planar coils: arrays in, arrays out, SI units, numpy alone."""
