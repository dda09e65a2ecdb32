"""The drawing vocabulary, and the views of board, contacts and solids that are drawn with it."""
