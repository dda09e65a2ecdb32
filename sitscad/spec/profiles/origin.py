"""Where a profile is named or written out: in the spec, in a file beside it, or among the installed ones."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from sitscad.record import record
from sitscad.spec.format.diagnosis import finding_from_flaw
from sitscad.spec.format.remarks import Flaw, Remarks
from sitscad.spec.source import SpecSource


@record
class Origin:
    """Where a profile is named or written out.

    ``source`` is the text, ``prefix`` the dotted key before its figures, ``folder`` the text's folder and ``root`` the
    spec's; ``chain`` are the files that led here from the spec, the last one being this text. ``installed`` is the name
    of a profile that sitscad brings along.
    """

    source: SpecSource
    prefix: str
    folder: Path | None
    root: Path | None
    chain: tuple[Path, ...] = ()
    installed: str = ""

    @property
    def label(self) -> str:
        """The file's name below the spec's folder."""
        return self._below_root(self.chain[-1])

    def circle(self, path: Path) -> str:
        """The files from a path to here and back to it."""
        return " -> ".join(self._below_root(each) for each in (*self.chain[self.chain.index(path) :], path))

    def _below_root(self, path: Path) -> str:
        return path.relative_to(self.root).as_posix() if self.root else path.name

    def complain(self, remarks: Remarks, rule: str, key: str, message: str, hint: str) -> None:
        """Note something that is wrong at a key of this text."""
        flaw = Flaw(rule, key, message, hint)
        if not self.chain:
            remarks.flaws.append(flaw)
        else:
            remarks.texts[self.source.path] = self.source.text
            remarks.findings.append(replace(finding_from_flaw(flaw, self.source), file=self.source.path))


def spec_origin(source: SpecSource, folder: Path | None) -> Origin:
    """The spec itself as the place where rules are named: in its folder and below may be profile files."""
    return Origin(source, "fpc.rules.", folder, None if folder is None else folder.resolve())
