"""Eddy currents on the closed surface of a target of finite size, and what they change of coils at any pose.

Unknown is a stream function on the surface, as Kameari (J. Comput. Phys. 42, 1981) has it on thin shells: of currents
that stand for the body outside of it. What its metal does within, in all of its volume, answers the field along it.
"""
