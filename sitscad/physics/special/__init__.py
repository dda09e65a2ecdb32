"""Special functions and quadrature, as far as numpy lacks them or takes long to load."""
