"""Rules and writers from outside: a Python file, or an installed package with an entry point in ``sitscad.plugins``.

A plugin is a module with ``RULES`` (values of `Rule`), with ``WRITERS`` (values of `Writer` with a `function`), or
both. Once loaded, it stays active for the whole process. Its rules are applied, listed, selected and waived like
sitscad's own. Its writers' files are in packages and their manifests. If a plugin changes, packages made with it are
made anew.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

from sitscad.basics.arguments import checked_arguments
from sitscad.package.plugins.guard import Plugin, PluginError, at_work

__all__ = ["GROUP", "Plugin", "PluginError", "use_installed_plugins", "use_plugin"]

GROUP = "sitscad.plugins"
"""Group of entry points of installed plugins. Each entry point names a module."""


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
    name = Path(path).name
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise PluginError(f"plugin {path}: {error.strerror or error}") from error
    digest = _digest(content)
    module = ModuleType(f"sitscad_plugin_{digest[:16]}")
    module.__file__ = str(path)
    sys.modules[module.__name__] = module
    with at_work(f"plugin {path}", module.__file__):
        exec(compile(content, str(path), "exec"), module.__dict__)
        from sitscad.package.plugins.force import in_force  # loads every rule

        return in_force(name, module, digest)


def _digest(content: bytes) -> str:
    import hashlib  # loads OpenSSL, which only plugins need

    return hashlib.sha256(content).hexdigest()


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
    from importlib.metadata import entry_points  # slow to import, and seldom needed

    from sitscad.package.plugins.force import in_force

    plugins = []
    for point in sorted(entry_points(group=GROUP), key=lambda point: point.name):
        with at_work(f"plugin {point.name} ({point.value})"):
            module = point.load()  # an error in the module has its own traceback with the line
            plugins.append(in_force(point.name, module, _digest(Path(str(module.__file__)).read_bytes())))
    return tuple(plugins)


def _entry_points_in(folder: str) -> Iterator[bytes]:
    """Yield the text of the entry points of all distributions in a folder."""
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
