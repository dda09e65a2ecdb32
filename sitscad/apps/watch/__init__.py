"""A spec that is looked at while it is edited: what a save changes, on the terminal and as a page."""
