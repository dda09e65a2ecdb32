"""What presses on a pad, how far it gives, and up to where that is looked at."""
