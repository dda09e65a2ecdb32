"""The nearest configuration above a spec: ``sitscad.toml``, or ``[tool.sitscad]`` in ``pyproject.toml``.

One file decides, the nearest one; files further up are not looked at. ::

    [tool.sitscad]
    select = ["SIT1", "SIT2"]              # all rules if left out
    profiles = "shops"                     # fabricators' profiles, from this file's folder

    [tool.sitscad.ignore]                  # or a list, without reasons
    SIT103 = "their quotation of 3 May"

    [tool.sitscad.severity]
    SIT120 = "error"
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from sitscad.finding import Severity
from sitscad.policy.values import Policy, PolicyError, stands_for
from sitscad.report.findings import RuleTexts

KEYS = ("select", "ignore", "severity", "profiles")
MEANT = {
    **dict.fromkeys(
        ("allow", "disable", "exclude", "silence", "skip", "suppress", "waive", "waiver", "waivers"), "ignore"
    ),
    **dict.fromkeys(("enable", "include", "only", "rules"), "select"),
    **dict.fromkeys(("levels", "severities"), "severity"),
    **dict.fromkeys(("fabricators", "profile", "shops"), "profiles"),
}
"""What others call a key."""
MAX_BYTES = 1 << 20
"""A larger file is no configuration."""


def nearest_policy(folder: Path, rules: Iterable[RuleTexts]) -> Policy:
    """The policy of the nearest configuration in a folder or above it; an empty one where there is none.

    Raises
    ------
    PolicyError
        for a configuration that cannot be read, or has keys, rules or severities that do not exist.
    """
    whole = folder.resolve()
    for each in (whole, *whole.parents):
        for name, has_table in (("sitscad.toml", True), ("pyproject.toml", False)):
            path = each / name
            if path.is_file() and (has_table or b"sitscad" in _content(path)):
                table = _table(path, has_table)
                if table is not None:
                    return _policy(table, path, tuple(rules))
    return Policy()


def _content(path: Path) -> bytes:
    """A file's bytes; PolicyError where it cannot be read or is too large."""
    try:
        with path.open("rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except OSError as error:
        raise PolicyError(f"cannot read {path}: {error.strerror or error}") from error
    if len(content) > MAX_BYTES:
        raise PolicyError(f"{path} is too large for a configuration")
    return content


def _table(path: Path, has_table: bool) -> Mapping[str, Any] | None:
    """The configuration in a file; None where a pyproject.toml has none."""
    import tomllib  # only where there is a file

    try:
        document = tomllib.loads(_content(path).decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise PolicyError(f"{path} is not TOML: {error}") from error
    if has_table:
        return document
    tools = document.get("tool")
    table = tools.get("sitscad") if isinstance(tools, dict) else None
    if table is not None and not isinstance(table, dict):
        raise PolicyError(f"{path}: tool.sitscad is no table")
    return table


def _policy(table: Mapping[str, Any], path: Path, rules: tuple[RuleTexts, ...]) -> Policy:
    """The policy that a table says; PolicyError for what it does not know."""
    for key in table:
        message = f"{key!r} is no key of sitscad's configuration, which are {', '.join(KEYS)}"
        _require(key in KEYS, path, message, MEANT.get(key.lower(), key), KEYS)
    ignored, reasons = table.get("ignore", []), {}
    if isinstance(ignored, dict):
        reasons = {pattern: _reason(pattern, reason, path) for pattern, reason in ignored.items()}
        ignored = []
    severity = table.get("severity", {})
    _require(isinstance(severity, dict), path, "severity is no table of rules and severities")
    profiles = table.get("profiles")
    _require(profiles is None or _is_below(profiles, path), path, "profiles is no folder beside this file, or below")
    found = Policy(
        _patterns(table.get("select", []), "select", path, rules),
        _patterns(ignored, "ignore", path, rules),
        dict(zip(_patterns(list(reasons), "ignore", path, rules), reasons.values(), strict=True)),
        {pattern: _severity(pattern, word, path) for pattern, word in severity.items()},
        None if profiles is None else str(path.parent / profiles),
        path.name,
    )
    _patterns(list(severity), "severity", path, rules)
    return found


def _is_below(profiles: object, path: Path) -> bool:
    """Whether a folder lies beside a configuration or below: what is passed on must not read files elsewhere."""
    if not isinstance(profiles, str) or "\0" in profiles:
        return False
    return (path.parent / profiles).resolve().is_relative_to(path.parent.resolve())


def _patterns(value: object, key: str, path: Path, rules: tuple[RuleTexts, ...]) -> tuple[str, ...]:
    """The patterns of a list, each of which stands for a rule; PolicyError for others."""
    if not isinstance(value, list) or not all(isinstance(entry, str) and entry for entry in value):
        raise PolicyError(f"{path}: {key} is no list of rules")
    known = [word for rule in rules for word in (rule.id, rule.name)]
    for pattern in value:
        is_known = any(stands_for(pattern, rule.id, rule.name) for rule in rules)
        _require(is_known, path, f"{key}: there is no rule {pattern!r}", pattern, known)
        is_spec = not pattern.isdecimal() and pattern.upper().startswith("SIT0")
        _require(not is_spec or key == "select", path, f"{key}: {pattern}: what a spec is read by holds always")
    return tuple(value)


def _reason(pattern: str, reason: object, path: Path) -> str:
    if not isinstance(reason, str) or not reason.strip():
        raise PolicyError(f'{path}: ignore.{pattern} has no reason; write {pattern} = "why"')
    return " ".join(reason.split())


def _severity(pattern: str, word: object, path: Path) -> Severity:
    known = [severity.value for severity in Severity]
    _require(word in known, path, f"severity.{pattern} is one of {', '.join(known)}, not {word!r}")
    return Severity(str(word))


def _require(holds: bool, path: Path, message: str, word: str = "", known: Iterable[str] = ()) -> None:
    if not holds:
        near = difflib.get_close_matches(word, list(known), n=1)
        raise PolicyError(f"{path}: {message}" + (f"; did you mean {near[0]}?" if near else ""))
