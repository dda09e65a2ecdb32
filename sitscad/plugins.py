"""Rules and writers from outside: a Python file, or an installed package with an entry point in ``sitscad.plugins``.

A plugin is a module with ``RULES`` (values of `Rule`), with ``WRITERS`` (values of `Writer` with a `function`), or
both. Once used it is in force for the whole process: its rules are applied, listed, selected and waived as ours are,
its writers' files are in packages and their manifests. A package made with plugins is made anew when one changes.
"""

from __future__ import annotations

import hashlib
import os
import re
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import TypeVar

from sitscad.checks import add_rules, all_rules
from sitscad.checks.rules import NEEDS, Complaint, Rule, Undecided, Verdict
from sitscad.design import Design
from sitscad.finding import Severity
from sitscad.record import record
from sitscad.writer import STAGES, TAKES, Writer, add_writers, added_writers, marks

Row = TypeVar("Row", Rule, Writer)
Made = TypeVar("Made")

GROUP = "sitscad.plugins"
"""The entry points of installed plugins: each names a module."""

_ID = re.compile("[A-Z]{2,8}[0-9]{1,4}")
_NAME = re.compile("[a-z][a-z0-9]*(-[a-z0-9]+)*")


class PluginError(RuntimeError):
    """A plugin cannot be used, or went wrong where it was used; the text names it."""


@record
class Plugin:
    """A plugin in force: what it is called, its rules and writers, and the hash of the file that it stands in."""

    name: str
    rules: tuple[Rule, ...]
    writers: tuple[Writer, ...]
    sha256: str


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
    digest = hashlib.sha256(content).hexdigest()
    module = ModuleType(f"sitscad_plugin_{digest[:16]}")
    module.__file__ = str(path)
    sys.modules[module.__name__] = module
    try:
        exec(compile(content, str(path), "exec"), module.__dict__)
    except Exception as error:
        raise PluginError(f"plugin {path}: {type(error).__name__}: {error}") from error
    return _in_force(name, module, digest)


def use_installed_plugins() -> tuple[Plugin, ...]:
    """Put all plugins in force that are installed with entry points in ``sitscad.plugins``, in order of their names.

    Raises `PluginError` where one cannot be loaded.
    """
    if not _are_installed():
        return ()
    from importlib.metadata import entry_points  # slow to import, and seldom needed

    found = []
    for point in sorted(entry_points(group=GROUP), key=lambda point: point.name):
        try:
            module = point.load()
            content = Path(str(module.__file__)).read_bytes()
        except Exception as error:
            raise PluginError(f"plugin {point.name} ({point.value}): {type(error).__name__}: {error}") from error
        found.append(_in_force(point.name, module, hashlib.sha256(content).hexdigest()))
    return tuple(found)


def _are_installed() -> bool:
    """Whether any installed distribution has such entry points: looked up in the files themselves, in a few ms."""
    wanted = f"[{GROUP}]".encode()
    return any(wanted in text for folder in dict.fromkeys(sys.path) for text in _entry_points_in(folder or "."))


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


def _in_force(name: str, module: ModuleType, digest: str) -> Plugin:
    """A plugin whose rules and writers are now in force; PluginError where it does not fit."""
    rules = _listed(name, module, "RULES", Rule)
    writers = _listed(name, module, "WRITERS", Writer)
    if not rules and not writers:
        raise PluginError(f"plugin {name}: it has neither RULES nor WRITERS")
    plugin = Plugin(name, rules, writers, digest)
    if (name, digest) in marks():
        return plugin
    for rule in rules:
        _require_fit(name, rule)
    for writer in writers:
        _require_writable(name, writer)
    add_rules(tuple(replace(rule, apply=_guarded(name, rule)) for rule in rules))
    add_writers(tuple(_checked(name, writer) for writer in writers), (name, digest))
    return plugin


def _listed(name: str, module: ModuleType, attribute: str, wanted: type[Row]) -> tuple[Row, ...]:
    listed = getattr(module, attribute, ())
    if isinstance(listed, (list, tuple)) and all(isinstance(one, wanted) for one in listed):
        return tuple(listed)
    raise PluginError(f"plugin {name}: {attribute} is no list of values of sitscad.{wanted.__name__}")


def _require_fit(name: str, rule: Rule) -> None:
    """Refuse a rule that cannot be told from others, needs what no spec has, or does nothing."""
    taken = next((other for other in all_rules() if rule.id == other.id or rule.name == other.name), None)
    texts = (rule.summary, rule.why, rule.mend, rule.source)
    for is_wrong, why in (
        (not _ID.fullmatch(str(rule.id)) or str(rule.id).startswith("SIT"), "its id is not like LAB001 (SIT is ours)"),
        (not _NAME.fullmatch(str(rule.name)), "its name is not like coil-mass"),
        (taken is not None, f"{taken.id} {taken.name} is there already" if taken else ""),
        (not isinstance(rule.severity, Severity), "its severity is no sitscad.Severity"),
        (not all(isinstance(text, str) and text for text in texts), "summary, why, mend and source are texts"),
        (not set(rule.needs) <= set(NEEDS), f"it may need {', '.join(NEEDS)}"),
        (not callable(rule.apply), "apply is no function"),
    ):
        if is_wrong:
            raise PluginError(f"plugin {name}: rule {rule.id}: {why}")


def _require_writable(name: str, writer: Writer) -> None:
    """Refuse a writer of a stage or of arguments that there are not."""
    known = {other.name for other in added_writers()}
    for is_wrong, why in (
        (not isinstance(writer.name, str) or not writer.name or writer.name in known, "its name is missing or taken"),
        (writer.stage not in STAGES, f"its stage is none of {', '.join(STAGES)}"),
        (not isinstance(writer.takes, tuple) or not set(writer.takes) <= set(TAKES),
         f"it takes others than {', '.join(TAKES)}"),
        (not callable(writer.function), "function is none"),
    ):  # fmt: skip
        if is_wrong:
            raise PluginError(f"plugin {name}: writer {writer.name}: {why}")


def _guarded(name: str, rule: Rule) -> Callable[[Design], Iterator[Verdict]]:
    """A rule's function; what goes wrong in it is told as the plugin's."""

    def apply(design: Design) -> Iterator[Verdict]:
        """The rule's verdicts, without searches; PluginError for whatever goes wrong in it."""
        try:
            for verdict in (rule.apply(design) if rule.apply else None) or ():
                if not isinstance(verdict, (Complaint, Undecided)):
                    raise TypeError(f"it gives a {type(verdict).__name__}, no Complaint and no Undecided")
                yield replace(verdict, advice=None) if isinstance(verdict, Complaint) else verdict
        except Exception as error:
            raise PluginError(f"plugin {name}: rule {rule.id}: {type(error).__name__}: {error}") from error

    return apply


def _checked(name: str, writer: Writer) -> Writer:
    """A writer whose functions tell what goes wrong in them as the plugin's."""

    def told(function: Callable[..., Made], *values: object) -> Made:
        try:
            return function(*values)
        except Exception as error:
            raise PluginError(f"plugin {name}: writer {writer.name}: {type(error).__name__}: {error}") from error

    def render(*values: object) -> dict[str, bytes]:
        made = writer.function(*values) if writer.function else {}
        if not all(isinstance(path, str) and isinstance(content, bytes) for path, content in made.items()):
            raise TypeError("it gives no dictionary of paths with the bytes of files")
        return dict(made)

    return replace(writer, function=partial(told, render), applies=partial(told, writer.applies))
