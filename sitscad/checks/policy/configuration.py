"""A project's policy as a value, and the search for the nearest configuration file above a spec.

The file is ``sitscad.toml``, or ``pyproject.toml`` with a table ``[tool.sitscad]``. Only the nearest file counts. ::

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
from dataclasses import field
from functools import lru_cache
from pathlib import Path
from typing import Any

from sitscad.basics.errors import ExpectedError
from sitscad.basics.finding import Severity
from sitscad.basics.record import record
from sitscad.checks.findings import RuleTexts


class PolicyError(ExpectedError, ValueError):
    """Raised for a configuration or baseline that cannot be used. The message gives the place and the reason."""


@record
class Policy:
    """The policy for a spec.

    ``select`` and ``ignore`` are patterns of rules (`matches_rule`); an empty ``select`` means all rules. ``reasons``
    maps ignored patterns to reasons. ``severity`` maps patterns to the severities of their findings. ``profiles`` is
    the folder of fabricators' profiles. ``file_name`` is the name of the configuration file in reports, empty if there
    is no file.
    """

    select: tuple[str, ...] = ()
    ignore: tuple[str, ...] = ()
    reasons: Mapping[str, str] = field(default_factory=dict)
    severity: Mapping[str, Severity] = field(default_factory=dict)
    profiles: str | None = None
    file_name: str = ""

    @property
    def changes_findings(self) -> bool:
        """Whether the policy changes the findings of any spec."""
        return bool(self.select or self.ignore or self.reasons or self.severity)

    def as_json(self) -> dict[str, object]:
        """Return the policy without ``profiles`` as a dictionary for JSON.

        The order of patterns does not change, because the last pattern that matches a rule applies.
        """
        return {
            "select": list(self.select),
            "ignore": [*self.ignore],
            "reasons": dict(self.reasons),
            "severity": {pattern: severity.value for pattern, severity in self.severity.items()},
            "named": self.file_name if self.changes_findings else "",
        }


def policy_from_manifest(stored: Mapping[str, Any]) -> Policy:
    """Return the policy stored in a manifest (`Policy.as_json`).

    Raises ValueError, TypeError or KeyError if the values are no policy.
    """
    reasons, severity = dict(stored["reasons"]), dict(stored["severity"])
    for text in (*stored["select"], *stored["ignore"], *reasons, *reasons.values(), *severity, stored["named"]):
        if not isinstance(text, str):
            raise TypeError(f"{text!r} is no text")
    weights = {pattern: Severity(word) for pattern, word in severity.items()}
    return Policy(tuple(stored["select"]), tuple(stored["ignore"]), reasons, weights, None, stored["named"])


def matches_rule(pattern: str, rule: str, name: str) -> bool:
    """Whether a pattern such as SIT1, SIT103, 103 or ``coil-trace`` matches a rule.

    `rule` is the rule's identifier and `name` its name. A pattern is a name, or the start of an identifier with or
    without the letters SIT.
    """
    identifier = f"SIT{pattern}" if pattern.isdecimal() else pattern.upper()
    return rule.startswith(identifier) or name == pattern.lower().replace("_", "-")


def selected_rules(rules: Iterable[RuleTexts], select: tuple[str, ...], ignore: tuple[str, ...]) -> frozenset[str]:
    """Return the identifiers of the rules that match a pattern in `select` and no pattern in `ignore`.

    An empty `select` selects all rules. Rules of the spec itself (SIT0xx) are always included.
    """

    def is_wanted(rule: RuleTexts) -> bool:
        is_selected = not select or any(matches_rule(pattern, rule.id, rule.name) for pattern in select)
        is_ignored = any(matches_rule(pattern, rule.id, rule.name) for pattern in ignore)
        return rule.id.startswith("SIT0") or (is_selected and not is_ignored)

    return frozenset(rule.id for rule in rules if is_wanted(rule))


KEYS = ("select", "ignore", "severity", "profiles")
KEYS_OF_OTHER_TOOLS = {
    **dict.fromkeys(
        ("allow", "disable", "exclude", "silence", "skip", "suppress", "waive", "waiver", "waivers"), "ignore"
    ),
    **dict.fromkeys(("enable", "include", "only", "rules"), "select"),
    **dict.fromkeys(("levels", "severities"), "severity"),
    **dict.fromkeys(("fabricators", "profile", "shops"), "profiles"),
}
"""Configuration keys of other tools, each with the key of sitscad that an error message proposes instead."""
MAX_BYTES = 1 << 20
"""Largest size of a configuration file in bytes."""


def nearest_policy(folder: Path, rules: Iterable[RuleTexts]) -> Policy:
    """Return the policy of the nearest configuration in a folder or above it. Empty if there is none.

    Raises
    ------
    PolicyError
        For a configuration that cannot be read, or has keys, rules or severities that do not exist.
    """
    whole = folder.resolve()
    for each in (whole, *whole.parents):
        for name, has_table in (("sitscad.toml", True), ("pyproject.toml", False)):
            path = each / name
            if path.is_file() and (has_table or b"sitscad" in _read_bytes(path)):
                table = _table(path, has_table)
                if table is not None:
                    return _parse_policy(table, path, tuple(rules))
    return Policy()


def _read_bytes(path: Path) -> bytes:
    """Return a file's bytes. Raises PolicyError if the file cannot be read or is too large."""
    try:
        with path.open("rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except OSError as error:
        raise PolicyError(f"cannot read {path}: {error.strerror or error}") from error
    if len(content) > MAX_BYTES:
        raise PolicyError(f"{path} is too large for a configuration")
    return content


@lru_cache(maxsize=8)
def _parse_toml(content: bytes) -> dict[str, Any]:
    """Return the tables in a TOML file's content. Equal content is parsed once. Raises ValueError if it is no TOML."""
    import tomllib  # imported only if there is a file

    return tomllib.loads(content.decode("utf-8"))


def _table(path: Path, has_table: bool) -> Mapping[str, Any] | None:
    try:
        document = _parse_toml(_read_bytes(path))
    except (ValueError, RecursionError) as error:
        raise PolicyError(f"{path} is not TOML: {error}") from error
    if has_table:
        return document
    tools = document.get("tool")
    table = tools.get("sitscad") if isinstance(tools, dict) else None
    if table is not None and not isinstance(table, dict):
        raise PolicyError(f"{path}: tool.sitscad is no table")
    return table


def _parse_policy(table: Mapping[str, Any], path: Path, rules: tuple[RuleTexts, ...]) -> Policy:
    """Return the policy in the configuration table of the file `path`. Raises PolicyError for unknown keys and values.

    `rules` are all rules, with which the patterns are checked.
    """
    for key in table:
        message = f"{key!r} is no key of sitscad's configuration, which are {', '.join(KEYS)}"
        _require(key in KEYS, path, message, KEYS_OF_OTHER_TOOLS.get(key.lower(), key), KEYS)
    ignored, reasons = table.get("ignore", []), {}
    if isinstance(ignored, dict):
        for pattern, reason in ignored.items():
            if not isinstance(reason, str) or not reason.strip():
                raise PolicyError(f'{path}: ignore.{pattern} has no reason; write {pattern} = "why"')
            reasons[pattern] = " ".join(reason.split())
        ignored = []
    severity = table.get("severity", {})
    _require(isinstance(severity, dict), path, "severity is no table of rules and severities")
    severities = [each.value for each in Severity]
    for pattern, word in severity.items():
        _require(word in severities, path, f"severity.{pattern} is one of {', '.join(severities)}, not {word!r}")
    profiles = table.get("profiles")
    if profiles is not None:  # a configuration that is passed on must not read files elsewhere
        is_text = isinstance(profiles, str) and "\0" not in profiles
        is_below = is_text and (path.parent / profiles).resolve().is_relative_to(path.parent.resolve())
        _require(is_below, path, "profiles is no folder beside this file, or below")
    policy = Policy(
        _parse_patterns(table.get("select", []), "select", path, rules),
        _parse_patterns(ignored, "ignore", path, rules),
        dict(zip(_parse_patterns(list(reasons), "ignore", path, rules), reasons.values(), strict=True)),
        {pattern: Severity(word) for pattern, word in severity.items()},
        None if profiles is None else str(path.parent / profiles), path.name,
    )
    _parse_patterns(list(severity), "severity", path, rules)
    return policy


def _parse_patterns(value: object, key: str, path: Path, rules: tuple[RuleTexts, ...]) -> tuple[str, ...]:
    """Return the patterns of rules in a list, the `value` at `key` of the file `path`.

    Raises PolicyError if the value is not a list of texts, or if a pattern does not match any of the `rules`.
    """
    if not isinstance(value, list) or not all(isinstance(entry, str) and entry for entry in value):
        raise PolicyError(f"{path}: {key} is no list of rules")
    rule_words = [word for rule in rules for word in (rule.id, rule.name)]
    for pattern in value:
        is_known = any(matches_rule(pattern, rule.id, rule.name) for rule in rules)
        _require(is_known, path, f"{key}: there is no rule {pattern!r}", pattern, rule_words)
        is_spec = not pattern.isdecimal() and pattern.upper().startswith("SIT0")
        _require(not is_spec or key == "select", path, f"{key}: {pattern}: what a spec is read by holds always")
    return tuple(value)


def _require(holds: bool, path: Path, message: str, word: str = "", choices: Iterable[str] = ()) -> None:
    if not holds:
        near = difflib.get_close_matches(word, list(choices), n=1)
        raise PolicyError(f"{path}: {message}" + (f"; did you mean {near[0]}?" if near else ""))
