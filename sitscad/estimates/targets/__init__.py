"""What a target changes of the coils under it."""
