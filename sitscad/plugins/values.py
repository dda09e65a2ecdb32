"""What a plugin is, and what is raised where one cannot be used."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sitscad.record import record
from sitscad.writer import Writer

if TYPE_CHECKING:
    from sitscad.checks.rules import Rule


class PluginError(RuntimeError):
    """A plugin cannot be used, or went wrong where it was used; the text names it."""


@record
class Plugin:
    """A plugin in force: what it is called, its rules and writers, and the hash of the file that it stands in."""

    name: str
    rules: tuple[Rule, ...]
    writers: tuple[Writer, ...]
    sha256: str
