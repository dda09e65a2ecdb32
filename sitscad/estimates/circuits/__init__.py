"""Coils, leads and capacitor as tanks of a converter, with error bounds."""
