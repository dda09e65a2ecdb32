"""SIT3xx: rules for the assembly of pad, target and sensor, for its signal by force and its fit in the jaw."""
