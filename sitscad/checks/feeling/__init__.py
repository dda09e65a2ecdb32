"""SIT4xx: whether the sensor feels forces as finely and as truly as the spec requires, by the quick method."""
