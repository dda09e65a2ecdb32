"""Coils, leads and capacitor as tanks of a converter, and how far they may be off."""
