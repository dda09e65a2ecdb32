"""Metal in front of and behind a coil: the coil's waves, their reflection by infinite plates, and finite plates."""
