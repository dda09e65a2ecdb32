"""Tables that a user hands in, as text."""

from __future__ import annotations

from pathlib import Path


class TableError(ValueError):
    """A file that holds no table; the text says why, without its name."""


def table_text(path: str, most: int) -> str:
    """The text of a file of at most so many bytes. Raises TableError for a larger one and for what is not UTF-8,
    OSError where it cannot be opened.
    """
    with Path(path).open("rb") as file:  # a device has no size and no end
        content = file.read(most + 1)
    if len(content) > most:
        raise TableError(f"is larger than {most // 1_000_000} MB")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise TableError("is not text in UTF-8") from error
