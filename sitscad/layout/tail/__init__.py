"""The tail: its frame and tracks, where it turns and bends, and its end with the contacts."""
