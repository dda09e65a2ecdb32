"""Eddy currents on the closed surface of a target of finite size, and what they change of coils at any pose.

Unknown is the current's stream function on the surface, as Kameari (J. Comput. Phys. 42, 1981) has it on thin shells.
"""
