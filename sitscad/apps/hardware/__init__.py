"""The bench: simulated converters that a driver runs on, what can be wrong with a board, what is said of it."""
