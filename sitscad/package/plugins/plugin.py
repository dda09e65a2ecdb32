"""Active plugins, and the error of a plugin that cannot be used."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sitscad.basics.errors import ExpectedError
from sitscad.basics.record import record

if TYPE_CHECKING:
    from sitscad.checks.rules import Rule
    from sitscad.files.writer import Writer


GROUP = "sitscad.plugins"
"""Group of entry points of installed plugins. Each entry point gives the name of a module."""


class PluginError(ExpectedError, RuntimeError):
    """Raised if a plugin cannot be used, or fails while it runs. The text names the plugin."""


@record
class Plugin:
    """An active plugin: its name, its rules and writers, and the hash of its file."""

    name: str
    rules: tuple[Rule, ...]
    writers: tuple[Writer, ...]
    sha256: str
