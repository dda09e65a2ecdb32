"""Eddy currents on the closed surface of a target of finite size, and the changes that they make in nearby coils.

The unknown is a stream function on the surface (Kameari, J. Comput. Phys. 42, 1981, uses one on thin shells). Seen from
outside, the surface currents stand for the whole body. `body` computes how the metal inside responds to the tangential
field.
"""
