"""Applications: a coil without a spec, studies, boards on the bench, and a page that follows a spec."""
