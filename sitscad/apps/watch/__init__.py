"""A spec watched while it is edited: the changes by each save, on the terminal and as a page."""
