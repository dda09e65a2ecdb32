"""The tail before it is turned: its frame, and its tracks down to the contacts."""
