"""Which issue of a design something belongs to: its revision, part number and date, as every paper states them."""

from __future__ import annotations

import os

from sitscad.record import record

UNNUMBERED = "unnumbered"
"""What formats say that must name a revision, for a design that has none."""


@record
class Issue:
    """The revision, the part number and the date that a spec gives: texts, empty where it does not."""

    revision: str = ""
    part_number: str = ""
    date: str = ""

    @property
    def day(self) -> str:
        """The spec's date; where it gives none, the day of SOURCE_DATE_EPOCH; empty without either."""
        return self.date or (creation_date() or "").partition("T")[0]

    @property
    def rows(self) -> tuple[tuple[str, str], ...]:
        """What is known of it, each with its name."""
        known = (("Part number", self.part_number), ("Revision", self.revision), ("Date", self.day))
        return tuple((name, text) for name, text in known if text)

    @property
    def words(self) -> str:
        """The same in one line: ``part number A-17, revision B, 2026-11-22``; empty where nothing is known."""
        return ", ".join(text if name == "Date" else f"{name.lower()} {text}" for name, text in self.rows)


def creation_date() -> str | None:
    """The date of SOURCE_DATE_EPOCH (seconds since 1970) in ISO 8601, UTC; None where it is not set or not a number."""
    seconds = os.environ.get("SOURCE_DATE_EPOCH", "")
    if not seconds.isdecimal():
        return None
    from datetime import UTC, datetime  # only papers ask

    return datetime.fromtimestamp(int(seconds), UTC).isoformat()
