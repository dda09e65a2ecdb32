"""What is cut out: parts of a panel at the fabricator, pad and target on a laser."""
