"""Eddy currents on the closed surface of a target of finite size, and the changes that they make in nearby coils.

The unknown is a stream function on the surface (Kameari, J. Comput. Phys. 42, 1981, uses stream functions on thin
shells). Outside the target, its surface currents have the same field as the currents in its volume. `body` computes how
the metal inside responds to the field along the surface.
"""
