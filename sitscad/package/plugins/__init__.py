"""Rules and writers from outside: a Python file, or an installed package with an entry point in ``sitscad.plugins``.

A plugin is a module with ``RULES`` (values of `Rule`), with ``WRITERS`` (values of `Writer` with a `function`), or
both. Once used it is in force for the whole process: its rules are applied, listed, selected and waived as ours are,
its writers' files are in packages and their manifests. A package made with plugins is made anew when one changes.
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
"""The entry points of installed plugins: each names a module."""


@checked_arguments
def use_plugin(path: str | Path) -> Plugin:
    """Put the plugin of a Python file in force; one that is in force already, unchanged, stays as it is.

    Raises
    ------
    PluginError
        where the file cannot be read or run, or a rule or a writer of it cannot be taken.
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
    import hashlib  # loads OpenSSL, which is of use only where there are plugins

    return hashlib.sha256(content).hexdigest()


def use_installed_plugins() -> tuple[Plugin, ...]:
    """Put all plugins in force that are installed with entry points in ``sitscad.plugins``, in order of their names.

    Raises `PluginError` where one cannot be loaded.
    """
    wanted = f"[{GROUP}]".encode()
    if not any(wanted in text for folder in dict.fromkeys(sys.path) for text in _entry_points_in(folder or ".")):
        return ()
    from importlib.metadata import entry_points  # slow to import, and seldom needed

    from sitscad.package.plugins.force import in_force

    found = []
    for point in sorted(entry_points(group=GROUP), key=lambda point: point.name):
        with at_work(f"plugin {point.name} ({point.value})"):
            module = point.load()  # the line of an error in it is in the error's own traceback
            found.append(in_force(point.name, module, _digest(Path(str(module.__file__)).read_bytes())))
    return tuple(found)


def _entry_points_in(folder: str) -> Iterator[bytes]:
    """The entry points of all distributions in a folder, as they are written."""
    try:
        names = os.listdir(folder)
    except OSError:  # an archive, or not there
        return
    for name in names:
        if name.endswith("-info"):
            try:
                with open(f"{folder}/{name}/entry_points.txt", "rb") as file:
                    yield file.read()
            except OSError:
                continue
