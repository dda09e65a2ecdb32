"""What uses all of it: one coil without a spec, studies, boards on the bench, the page that follows a spec."""
