"""What is ordered: the archive for the fabricator and its notes, the parts list, places of parts, a shop's notes."""
