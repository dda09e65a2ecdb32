"""What differs from unit to unit, with its band and its source."""
