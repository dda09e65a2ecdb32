"""Base class of the errors that the user can resolve."""


class ExpectedError(Exception):
    """An error whose text names the cause and the remedy. A command prints the text only."""
