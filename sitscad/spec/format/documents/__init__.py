"""What a user may write: the spec, and the profiles and materials beside it, section by section."""
