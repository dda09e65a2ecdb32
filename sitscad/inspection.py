"""A spec as a path leads to it, checked: what is wrong with it, whether it could be read or not, and its picture."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from sitscad.checks import RULES, mended
from sitscad.design import Design
from sitscad.finding import Finding, NotChecked, Remedy
from sitscad.record import record
from sitscad.remedy.budget import DECISIVE
from sitscad.remedy.mending import Applied, mended_text
from sitscad.report.findings import CheckedSpec, checked_spec, numbered_places
from sitscad.review import Review
from sitscad.spec.format.reading import decoded
from sitscad.spec.load import load, load_text, read_text
from sitscad.spec.rules import SpecError
from sitscad.spec.sensor import SensorSpec

SHOWN = 1 << 18
"""Bytes of an unreadable spec that are read to show its lines: as many as a spec may have."""


@record
class Inspection:
    """One spec after its checks; ``design`` is None where it could not be read."""

    checked: CheckedSpec
    design: Design | None = None

    @property
    def picture(self) -> str:
        """The board in text with the findings' numbers at their places; empty where there is none."""
        if self.design is None:
            return ""
        from sitscad.drawing.board_picture import Mark
        from sitscad.drawing.dots import dot_picture  # nobody else shows text where a picture should be

        numbered = ((number, finding.place) for number, finding in numbered_places(self.checked.findings))
        marks = [Mark(place.x, place.y, str(number), "") for number, place in numbered if place is not None]
        return dot_picture(self.design.layout, marks)


def inspect(path: str, hints: str = DECISIVE) -> Inspection:
    """Load and check one spec; what keeps it from being read is a finding too.

    `hints` is what is tried for hints, as in `check`.
    """
    try:
        spec = load(path)
    except SpecError as error:
        return Inspection(unreadable(path, error, hints))
    return _inspected(spec, hints)


def inspect_text(text: str, path: str, hints: str = DECISIVE) -> Inspection:
    """Check a spec's text as it would stand at a path."""
    plain = decoded(text.encode("utf-8"))
    try:
        spec = load_text(plain, path)
    except SpecError as error:
        return Inspection(unreadable(path, error, hints, plain))
    return _inspected(spec, hints)


def _inspected(spec: SensorSpec, hints: str) -> Inspection:
    design = Design(spec)
    result = Review(design, hints).result
    return Inspection(checked_spec(spec, result.findings, result.not_checked, result.signals, result.fit), design)


@record(eq=False)
class MendedSpec:
    """A spec with the fixes of its findings written into it: its text before and after, what is said of it then, and
    the fixes, in the order in which they were made.
    """

    path: str
    before: str
    after: str
    inspection: Inspection
    applied: tuple[Applied, ...] = ()

    @property
    def diff(self) -> str:
        """The difference of both texts as a patch; empty where there is none."""
        import difflib  # only those who ask

        before, after = (re.findall(r"[^\n]*\n|[^\n]+", text) for text in (self.before, self.after))
        found = difflib.unified_diff(before, after, self.path, self.path)
        return "".join(line if line.endswith("\n") else f"{line}\n{NO_LINE_END}\n" for line in found)

    @property
    def words(self) -> str:
        """What was mended, a line a fix."""
        return "\n".join(
            f"{one.finding.rule} mended: {'; '.join(edit.words for edit in one.remedy.edits)}" for one in self.applied
        )


NO_LINE_END = "\\ No newline at end of file"


def mend(path: str, may: Callable[[Finding, Remedy], bool], hints: str = DECISIVE) -> MendedSpec:
    """A spec with every fix that may be made, and makes it better; nothing is written. A path of ``-`` is standard
    input. One that is no text is only inspected.
    """
    try:
        text = read_text(path)
    except SpecError as error:
        return MendedSpec(path, "", "", Inspection(unreadable(path, error, hints)))

    def said(of: str) -> CheckedSpec:
        return inspect_text(of, path, hints).checked

    def verdict(of: str) -> CheckedSpec:
        return inspect_text(of, path, "none").checked

    found = mended_text(text, said, may, verdict)
    return MendedSpec(path, text, found.text, Inspection(found.said), found.applied)


def unreadable(path: str, error: SpecError, hints: str = DECISIVE, text: str | None = None) -> CheckedSpec:
    """The findings of a spec that could not be loaded; every other rule is listed as not checked. Its text is read from
    its file unless it is given.
    """
    reported = {finding.rule for finding in error.findings}
    skipped = (rule.id for rule in RULES if rule.id not in reported)
    not_checked = tuple(NotChecked(rule, "the spec could not be read") for rule in skipped)
    shown = _beginning(path) if text is None else text
    return CheckedSpec(path, shown, mended(error, hints), not_checked, error.texts)


def _beginning(path: str) -> str:
    """What a spec may hold at most, to show a line of it; nothing of what is no plain file (a pipe would never end)."""
    try:
        if not Path(path).is_file():
            return ""
        with Path(path).open("rb") as stream:
            return stream.read(SHOWN).decode("utf-8", errors="replace")
    except (OSError, ValueError):
        return ""
