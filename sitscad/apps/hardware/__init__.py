"""Test bench: simulated and real converters, simulated faults of a board, and the diagnosis of a board."""
