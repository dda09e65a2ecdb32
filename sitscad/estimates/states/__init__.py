"""States of a sensor (free, at rest, pressed) and the effect of target, jaw, shield and cells in each."""
