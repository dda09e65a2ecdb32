"""Pictures of board and assembly, drawn with the vocabulary of sheets."""
