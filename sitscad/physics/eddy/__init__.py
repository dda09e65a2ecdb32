"""Eddy currents on the closed surface of a target of finite size, and what they change of coils at any pose."""
