"""Surroundings of the coils in each state: target, jaw, shield, and the pad under force."""
