"""Effect of a target on the coils under it."""
