"""What a form of telling findings may know besides them: colours, the rules' texts, and what counts as failed."""

from __future__ import annotations

import os
from pathlib import Path, PurePosixPath
from typing import Protocol
from urllib.parse import quote

from sitscad.finding import Severity
from sitscad.record import record


class RuleTexts(Protocol):
    """What is said of a rule, whoever applies it."""

    @property
    def id(self) -> str: ...  # noqa: D102
    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def severity(self) -> Severity: ...  # noqa: D102
    @property
    def summary(self) -> str: ...  # noqa: D102
    @property
    def why(self) -> str: ...  # noqa: D102
    @property
    def mend(self) -> str: ...  # noqa: D102
    @property
    def source(self) -> str: ...  # noqa: D102


@record
class Manner:
    """How findings are told.

    ``colour`` is whether a terminal's colours may be used, ``rules`` are all rules in the order of their identifiers,
    ``fail_on`` is the mildest severity that counts as failed, and ``root`` the folder that forms for machines name
    paths from (the repository's). ``named`` makes every line of the text name its spec though it is told alone;
    ``verbose`` makes the text tell all that there is, and ``width`` is the terminal's, at which its lines are folded.
    """

    colour: bool = False
    rules: tuple[RuleTexts, ...] = ()
    fail_on: Severity = Severity.ERROR
    root: str = "."
    named: bool = False
    verbose: bool = False
    width: int | None = None

    def path_from_root(self, path: str) -> str:
        """A spec's path from the root, with forward slashes; as it was typed where it lies elsewhere."""
        try:
            whole = Path(os.path.abspath(path))
            return PurePosixPath(whole.relative_to(os.path.abspath(self.root))).as_posix()
        except ValueError:
            return path.replace(os.sep, "/")

    def uri_from_root(self, path: str) -> str:
        """The same as a relative reference of RFC 3986, absolute where the path lies outside the root; the name's bytes
        are written as they are on the disk, no UTF-8 though they be.
        """
        name = self.path_from_root(path)
        if name.startswith(("/", "../")) or name == "..":
            return "file://" + quote(os.fsencode(os.path.abspath(path)))
        return quote(os.fsencode(name))
