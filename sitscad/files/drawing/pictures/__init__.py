"""Pictures of board and assembly, drawn on sheets."""
