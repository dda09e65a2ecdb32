"""Plugins: rules and writers from a Python file, or from an installed package with an entry point ``sitscad.plugins``.

A plugin is a module with ``RULES`` (values of `Rule`), with ``WRITERS`` (values of `Writer` with a `function`), or
both. Once activated, it stays active until the process ends. Its rules are applied, listed, selected and suppressed
like sitscad's own rules. The files of its writers are part of packages and their manifests. If a plugin changes,
packages that were made with it are made again.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path

from sitscad.basics.arguments import checked_arguments
from sitscad.basics.late import late
from sitscad.package.plugins.plugin import GROUP, Plugin, PluginError

__all__ = ["GROUP", "Plugin", "PluginError", "use_installed_plugins", "use_plugin"]

# they load every rule
use_file = late("sitscad.package.plugins.force", "use_file")
use_installed = late("sitscad.package.plugins.force", "use_installed")


@checked_arguments
def use_plugin(path: str | Path) -> Plugin:
    """Activate the plugin of a Python file. An unchanged plugin that is active already stays as it is.

    Parameters
    ----------
    path
        A Python file with rules in ``RULES``, or writers in ``WRITERS``.

    Returns
    -------
    Plugin
        The active plugin.

    Raises
    ------
    PluginError
        if the file cannot be read or run, or one of its rules or writers is invalid
    """
    return use_file(Path(path))


def use_installed_plugins() -> tuple[Plugin, ...]:
    """Activate all plugins that are installed with entry points in ``sitscad.plugins``, in order of their names.

    Returns
    -------
    tuple of Plugin
        The active plugins.

    Raises
    ------
    PluginError
        if a plugin cannot be loaded
    """
    heading = f"[{GROUP}]".encode()
    if not any(heading in text for folder in dict.fromkeys(sys.path) for text in _entry_points_in(folder or ".")):
        return ()
    return use_installed()


def _entry_points_in(folder: str) -> Iterator[bytes]:
    """Yield the content of ``entry_points.txt`` of each distribution that is installed in a folder."""
    try:
        names = os.listdir(folder)
    except OSError:  # an archive, or missing
        return
    for name in names:
        if name.endswith("-info"):
            try:
                with open(f"{folder}/{name}/entry_points.txt", "rb") as file:
                    yield file.read()
            except OSError:
                continue
