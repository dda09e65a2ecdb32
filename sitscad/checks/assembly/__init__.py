"""SIT3xx: rules for pad, target and mount, for the signal that a force causes, and for the sensor's fit in the jaw."""
