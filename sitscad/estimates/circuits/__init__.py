"""Electrical circuits of the coils: windings, leads, tank capacitor and converter, with error bounds."""
