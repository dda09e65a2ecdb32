"""From the coils' outer ends to the tail: rings, lanes, mazes, and the search among them."""
