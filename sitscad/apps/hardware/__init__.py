"""The bench: simulated and real converters, faults of a board, and the diagnosis of a board."""
