"""Activation of a plugin after a check of its rules and writers. Errors in their code are reported with its name.

A plugin that runs for a long time is reported on standard error.
"""

from __future__ import annotations

import logging
import re
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from importlib.metadata import entry_points
from pathlib import Path
from types import FrameType, ModuleType
from typing import Any, TypeVar

from sitscad.basics.digest import sha256
from sitscad.basics.finding import Place, Severity
from sitscad.checks.judging import add_rules, all_rules
from sitscad.checks.rules import NEEDS, Rule, Undecided, Verdict, Violation
from sitscad.estimates.design import Design
from sitscad.files.writer import STAGES, TAKES, Writer, add_writers, added_writers, marks
from sitscad.package.plugins.plugin import GROUP, Plugin, PluginError

Row = TypeVar("Row", Rule, Writer)
Made = TypeVar("Made")

_ID = re.compile("[A-Z]{2,8}[0-9]{1,4}")
_NAME = re.compile("[a-z][a-z0-9]*(-[a-z0-9]+)*")


def use_file(path: Path) -> Plugin:
    """Activate the plugin of a Python file, unless it is active already."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise PluginError(f"plugin {path}: {error.strerror or error}") from error
    digest = sha256(content).hexdigest()
    module = ModuleType(f"sitscad_plugin_{digest[:16]}")
    module.__file__ = str(path)
    sys.modules[module.__name__] = module
    with reported_plugin_call(f"plugin {path}", module.__file__):
        exec(compile(content, str(path), "exec"), module.__dict__)
        return activate_plugin(path.name, module, digest)


def use_installed() -> tuple[Plugin, ...]:
    """Activate all installed plugins, in order of their names."""
    plugins = []
    for point in sorted(entry_points(group=GROUP), key=lambda point: point.name):
        with reported_plugin_call(f"plugin {point.name} ({point.value})"):
            module = point.load()  # an error in the module has its own traceback with the line
            digest = sha256(Path(str(module.__file__)).read_bytes()).hexdigest()
            plugins.append(activate_plugin(point.name, module, digest))
    return tuple(plugins)


def activate_plugin(name: str, module: ModuleType, digest: str) -> Plugin:
    """Activate the rules and writers of a module, and return the plugin. Raises PluginError if they are invalid.

    `digest` is the hash of the plugin's file.
    """
    rules = _plugin_rows(name, module, "RULES", Rule)
    writers = _plugin_rows(name, module, "WRITERS", Writer)
    if not rules and not writers:
        raise PluginError(f"plugin {name}: it has neither RULES nor WRITERS")
    plugin = Plugin(name, rules, writers, digest)
    if (name, digest) in marks():
        return plugin
    for rule in rules:
        _require_valid_rule(name, rule)
    for writer in writers:
        _require_valid_writer(name, writer)
    add_rules(tuple(replace(rule, apply=_guarded_rule(name, rule, module.__file__)) for rule in rules))
    add_writers(tuple(_guarded_writer(name, writer, module.__file__) for writer in writers), (name, digest))
    return plugin


def _plugin_rows(name: str, module: ModuleType, attribute: str, kind: type[Row]) -> tuple[Row, ...]:
    listed = getattr(module, attribute, ())
    if isinstance(listed, (list, tuple)) and all(isinstance(row, kind) for row in listed):
        return tuple(listed)
    raise PluginError(f"plugin {name}: {attribute} is no list of values of sitscad.{kind.__name__}")


def _require_valid_rule(name: str, rule: Rule) -> None:
    """Raise PluginError for a rule with the id or name of another rule, or with an invalid field."""
    rival = next((other for other in all_rules() if rule.id == other.id or rule.name == other.name), None)
    texts = (rule.summary, rule.why, rule.mend, rule.source)
    for is_wrong, why in (
        (not _ID.fullmatch(str(rule.id)) or str(rule.id).startswith("SIT"), "its id is not like LAB001 (SIT is ours)"),
        (not _NAME.fullmatch(str(rule.name)), "its name is not like coil-mass"),
        (rival is not None, f"{rival.id} {rival.name} is there already" if rival else ""),
        (not isinstance(rule.severity, Severity), "its severity is no sitscad.Severity"),
        (not all(isinstance(text, str) and text for text in texts), "summary, why, mend and source are texts"),
        (not set(rule.needs) <= set(NEEDS), f"it may need {', '.join(NEEDS)}"),
        (not callable(rule.apply), "apply is no function"),
    ):
        if is_wrong:
            raise PluginError(f"plugin {name}: rule {rule.id}: {why}")


def _require_valid_writer(name: str, writer: Writer) -> None:
    """Raise PluginError for a writer with an unknown stage, unknown arguments, a name that exists, or no function."""
    names = {other.name for other in added_writers()}
    for is_wrong, why in (
        (not isinstance(writer.name, str) or not writer.name or writer.name in names, "its name is missing or taken"),
        (writer.stage not in STAGES, f"its stage is none of {', '.join(STAGES)}"),
        (
            not isinstance(writer.takes, tuple) or not set(writer.takes) <= set(TAKES),
            f"it takes others than {', '.join(TAKES)}",
        ),
        (not callable(writer.function), "function is none"),
    ):
        if is_wrong:
            raise PluginError(f"plugin {name}: writer {writer.name}: {why}")


def _guarded_rule(name: str, rule: Rule, file: str | None) -> Callable[[Design], list[Verdict]]:
    """Return a rule's function in a wrapper that reports errors with the plugin's name. `file` is the plugin's file."""

    def apply(design: Design) -> list[Verdict]:
        """Return the rule's findings without fixes. Raises PluginError for any error in the rule."""
        with reported_plugin_call(f"plugin {name}: rule {rule.id}", file):
            return [_valid_verdict(verdict) for verdict in (rule.apply(design) if rule.apply else None) or ()]

    return apply


def _valid_verdict(verdict: object) -> Verdict:
    """Return a rule's result without its fixes. Raises TypeError if it has another type, or fields of another type."""
    if isinstance(verdict, Undecided) and isinstance(verdict.reason, str):
        return verdict
    if not isinstance(verdict, Violation):
        raise TypeError(f"it gives a {type(verdict).__name__}, no Violation and no Undecided")
    for field, kinds in _FIELDS.items():
        value = getattr(verdict, field)
        if not isinstance(value, kinds) or isinstance(value, bool):
            raise TypeError(f"the {field} of its Violation is a {type(value).__name__}")
    return replace(verdict, fixes=())


_TEXT, _NUMBER = (str, type(None)), (int, float, type(None))
_FIELDS: dict[str, Any] = {
    **{"message": str, "hint": str, "severity": (Severity, type(None)), "place": (Place, type(None))},
    **dict.fromkeys(("key", "unit", "source"), _TEXT),
    **dict.fromkeys(("measured", "limit", "sigma"), _NUMBER),
}
"""Types of the fields of a `Violation`, by the field's name."""


def _guarded_writer(name: str, writer: Writer, file: str | None) -> Writer:
    """Return a writer whose functions have a wrapper that reports errors with the plugin's name and its `file`."""

    def told(function: Callable[..., Made], *values: object) -> Made:
        with reported_plugin_call(f"plugin {name}: writer {writer.name}", file):
            return function(*values)

    def render(*values: object) -> dict[str, bytes]:
        files = writer.function(*values) if writer.function else {}
        if not all(isinstance(path, str) and isinstance(content, bytes) for path, content in files.items()):
            raise TypeError("it gives no dictionary of paths with the bytes of files")
        return dict(files)

    return replace(
        writer, module=f"plugin {name}", function=partial(told, render), applies=partial(told, writer.applies)
    )


SLOW = 10.0
"""Time (s) after which a plugin that still runs is reported. The time doubles for each further report."""


class Interrupted(KeyboardInterrupt):
    """An interruption by the user, as distinct from a KeyboardInterrupt that a plugin raises."""


@contextmanager
def reported_plugin_call(what: str, file: str | None = None) -> Iterator[None]:
    """Run a part of a plugin in this context. `what` is its description for messages.

    `file` is the plugin's file, for line numbers in errors.

    Raises PluginError with `what` for any error, also for exceptions that end the program (SystemExit,
    KeyboardInterrupt, GeneratorExit). An end of the process itself (``os._exit``, a signal) cannot be caught.
    """
    done = threading.Event()
    threading.Thread(target=_warn_while_running, args=(what, done), daemon=True).start()
    try:
        with _own_interruption():
            yield
    except (Interrupted, PluginError):
        raise
    except BaseException as error:
        try:
            text = str(error)
        except BaseException:  # the text comes from the plugin's code, too
            text = ""
        line = _line_in(file, error)
        where = f"{what}: line {line}" if line else what
        raise PluginError(f"{where}: {type(error).__name__}{f': {text}' if text else ''}") from error
    finally:
        done.set()


def _line_in(file: str | None, error: BaseException) -> int | None:
    """Return the last line of `file` that ran before an error was raised. None if no line of the file ran."""
    if isinstance(error, SyntaxError) and error.filename == file:
        return error.lineno
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == file]
    return lines[-1] if lines else None


def _warn_while_running(what: str, done: threading.Event) -> None:
    """Log warnings that the part `what` of a plugin is still running, until `done` is set.

    The first warning comes after `SLOW` seconds. The time before each further warning is the total time so far. By
    default, the log is written to standard error.
    """
    passed, wait = 0.0, SLOW
    while not done.wait(wait):
        passed += wait
        logging.getLogger("sitscad").warning("%s has been at work for %.3g s", what, passed)
        wait = passed


@contextmanager
def _own_interruption() -> Iterator[None]:
    """Raise `Interrupted` instead of KeyboardInterrupt if the user interrupts.

    This has an effect only if Python's own signal handler is active.
    """
    is_ours = threading.current_thread() is threading.main_thread()
    if not is_ours or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return

    def interrupt(number: int, frame: FrameType | None) -> None:
        raise Interrupted

    signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
