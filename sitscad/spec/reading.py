"""Reader of a YAML file into a validated section. All errors become findings with position and hint.

It reads at most `MAX_BYTES` and constructs only plain values from the text.
"""

from __future__ import annotations

import difflib
from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

from sitscad.basics.arguments import checked_arguments
from sitscad.basics.finding import Edit, Finding, Remedy, Severity
from sitscad.basics.record import record
from sitscad.data import rows
from sitscad.spec.format.kinds import InvalidKey, describe, is_misspelling
from sitscad.spec.format.section import Part, Section, section_of
from sitscad.spec.yaml.source import MAX_BYTES, SpecSource, TextError, dotted, key_text, read_yaml

if TYPE_CHECKING:
    from sitscad.spec.sensor import SensorSpec

Form = TypeVar("Form", bound=Section)

RULE_TEXTS = {row["id"]: row for row in rows("rules")}
"""Texts of each rule (requirement, reason and remedy) by its number. Rules of the spec itself are SIT0xx."""

RULE_NAMES = {number: row["name"] for number, row in RULE_TEXTS.items() if number.startswith("SIT0")}
"""Names of the rules of the spec itself, which can fail while it is read."""

ROOM_RULES = ("SIT014", "SIT016")
"""Rules of the spec that fail if coils or their turns lack room."""


class SpecError(ValueError):
    """The spec cannot be used. `findings` lists all errors in the order of the file.

    The text of the error has the message and the hint of each finding.

    ``texts`` are the texts of other files with findings, by path. ``lacking_room`` is the spec if its only errors are a
    lack of room for turns or coils (`ROOM_RULES`), so that other sizes can repair it. Otherwise it is None. ``source``
    is the text of the spec. None if no text could be read.
    """

    @checked_arguments
    def __init__(
        self, findings: tuple[Finding, ...], texts: Mapping[str, str] | None = None,
        lacking_room: SensorSpec | None = None, source: SpecSource | None = None,
    ) -> None:
        super().__init__("\n".join(finding.advised_message for finding in findings))
        self.findings = findings
        self.texts = dict(texts or {})
        self.lacking_room = lacking_room
        self.source = source


KINDS = {"sitscad": ("spec", "`sitscad new --study` writes a study, whose `base` this spec can be"),
         "sitscad_study": ("study", "`sitscad design` takes it")}
"""Kind of a file, and the hint for a file of this kind in place of another. The keys are the files' first keys."""


@record
class Flaw:
    """An error at a dotted key of the spec, before it becomes a finding.

    ``edits`` are changes of the spec that correct the error. Empty if none are known.
    """

    rule: str
    key: str
    message: str
    hint: str = ""
    measured: float | None = None
    limit: float | None = None
    unit: str | None = None
    edits: tuple[Edit, ...] = ()


@dataclass
class Remarks:
    """Remarks of the resolver: errors at keys of the spec (`flaws`), and defaults that were filled in.

    * ``findings``: findings in other files that the spec names
    * ``texts``: texts of these files, by path
    * ``files``: bytes of all files in use, by path relative to the spec's folder
    """

    flaws: list[Flaw] = field(default_factory=list)
    defaults: list[str] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    texts: dict[str, str] = field(default_factory=dict)
    files: dict[str, bytes] = field(default_factory=dict)

    def flaw(self, rule: str, key: str, message: str, hint: str = "", **facts: Any) -> None:
        """Record an error at a dotted key of the spec, which becomes a finding of the rule with number `rule`.

        `facts` are further fields of `Flaw`: the value `measured`, its `limit`, their `unit`, and `edits` that correct
        the error.
        """
        self.flaws.append(Flaw(rule, key, message, hint, **facts))

    def default(self, key: str, value: str, why: str = "the default") -> None:
        """Record that a key which the spec omits has the given value, and the reason for this value."""
        self.defaults.append(f"{key}: {value}, {why}")


def read_file(path: Path, called: str | None = None) -> bytes:
    """Return the bytes of a file. Raises `TextError` if it is missing, unreadable or too large.

    Messages call the file `called`. If that is None, they state its path.
    """
    name = called or str(path)
    try:
        if path.exists() and not path.is_file():
            raise TextError("SIT011", f"{name} is not a file", "name the YAML file itself")
        with path.open("rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise TextError("SIT011", f"cannot read {name}: {reason}", "check the path") from None
    if len(content) > MAX_BYTES:
        raise TextError("SIT010", f"{name} is larger than {MAX_BYTES // 1024} KiB", "check that it is the right file")
    return content


def decode_text(content: bytes) -> str:
    """Return the text of a file's bytes with line feeds as line ends. Raises `TextError` if it is not UTF-8."""
    try:
        return content.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        before = content[: error.start]
        line = before.count(b"\n") + 1
        column = len(before[before.rfind(b"\n") + 1 :].decode("utf-8", "replace")) + 1
        message = f"not UTF-8 text: byte 0x{content[error.start]:02X}"
        raise TextError("SIT011", message, "save the file as UTF-8", (line, column)) from None


def read_section(text: str, path: str, form: type[Form], begins: str) -> tuple[Form, SpecSource]:
    """Read a text as a section. Return the section and the source with the positions of its keys.

    `begins` is the usual first line of such a text, for messages.

    Raises
    ------
    SpecError
        with all errors in its keys and values.
    """
    try:
        yaml_text = read_yaml(text)
        if not isinstance(yaml_text.data, dict):
            raise TextError("SIT001", "the file is not a mapping of keys to values", f"begin it with `{begins}`")
        is_other = begins.partition(":")[0] not in yaml_text.data
        for word, (kind, hint) in KINDS.items() if is_other else ():
            if word in yaml_text.data:
                message = f"the file is a {kind}, not a file that begins with `{begins}`"
                raise TextError("SIT002", message, hint, yaml_text.keys[word])
    except TextError as error:
        raise SpecError((finding_from_text(error),)) from None
    source = SpecSource(path, text, yaml_text.keys, yaml_text.values)
    return section_of_data(yaml_text.data, source, form, yaml_text.flaws), source


def section_of_data(data: Any, source: SpecSource, form: type[Form], flaws: Iterable[TextError] = ()) -> Form:
    """Read plain values as a section. `source` has the positions of their keys in the text.

    `flaws` are errors that the reader has already found in the text. Raises `SpecError` with these and all new errors.
    """
    findings = [finding_from_text(flaw) for flaw in flaws]
    data, empty = _without_nulls(data, "")
    for key in empty:
        place, message = source.keys.get(key, (1, 1)), f"{key_text(key)}: has no value"
        findings.append(
            finding_from_text(TextError("SIT004", message, "give it one, or leave the key out", place, key))
        )
    invalid_keys: list[InvalidKey] = []
    document = Part(form).read_at("", data, invalid_keys)
    if invalid_keys:
        # lists with empty entries have a finding already
        lists = {parent for parent, _, last in (key.rpartition(".") for key in empty) if last.isdigit()}
        findings += [_invalid_key_finding(invalid, source, form) for invalid in invalid_keys
                     if invalid.key not in {*empty, *lists}]
        findings = [finding for finding in findings if finding.rule == "SIT008"] or findings
    if isinstance(data, dict) and all(finding.rule != "SIT008" for finding in findings):
        findings += (invalid for invalid in _replaced_key_findings(data, source, form) if invalid.key not in empty)
    if findings:
        raise SpecError(in_order(findings), source=source)
    return cast(Form, document)


def _replaced_key_findings(
    data: dict[str, Any], source: SpecSource, form: type[Section], path: str = ""
) -> Iterable[Finding]:
    """Yield findings if a section has too many or too few keys of a group in which one key can replace another.

    `Section.stands_in` declares such groups. `data` are the plain values of the section, `form` is its class, and
    `path` its dotted key, which is empty for the whole text. Sections inside the section are included.
    """
    for key_name, section in ((name, section_of(key.kind)) for name, key in form.keys.items()):
        written, name = data.get(key_name), dotted(path, key_name)
        if section is None or not isinstance(written, dict):
            continue
        yield from _replaced_key_findings(written, source, section, name)
        if not section.stands_in[0] or (section.alone and section.alone[0] in written):
            continue
        other, replaced = section.stands_in
        missing = [key for key in replaced if key not in written]
        if other in written and not missing:
            message = f"{name}.{other}: {', '.join(replaced)} and {other} cannot all be written"
            hint = "remove one of them: it follows from the others"
            yield _finding("SIT009", message, hint, f"{name}.{other}", source.locate(f"{name}.{other}"))
        for key in missing if other not in written else missing[1:]:
            hint = f"add {key}: to {name}" if other in written else f"add {key}: to {name}, or {other}: in its place"
            hint = hint if len(missing) == 1 or other in written else f"add {key}: to {name}"
            yield _finding("SIT003", f"{name} has no {key}", hint, f"{name}.{key}", source.keys.get(name, (1, 1)))


def _without_nulls(data: Any, key: str) -> tuple[Any, list[str]]:
    # Return the values without keys that have no value, and the dotted keys of these. Entries of lists stay, so that
    # indices do not change.
    if not isinstance(data, (dict, list)):
        return data, []
    empty: list[str] = []
    entries: list[tuple[Any, Any]] = []
    for name, value in data.items() if isinstance(data, dict) else enumerate(data):
        inner_key = dotted(key, name)
        inner, inner_empty = _without_nulls(value, inner_key)
        empty += [inner_key] if value is None else inner_empty
        if value is not None or isinstance(data, list):
            entries.append((name, inner))
    return (dict(entries) if isinstance(data, dict) else [value for _, value in entries]), empty


def in_order(findings: list[Finding]) -> tuple[Finding, ...]:
    """Return the findings sorted by line, column and rule."""
    return tuple(sorted(findings, key=lambda finding: (finding.line or 0, finding.column or 0, finding.rule)))


def finding_from_text(error: TextError) -> Finding:
    """Return the finding for a `TextError`: the text cannot be read as YAML, or a value in it is refused."""
    return _finding(error.rule, error.message, error.hint, error.key, error.place)


def finding_from_flaw(flaw: Flaw, source: SpecSource) -> Finding:
    """Return the finding for a flaw, with the line and column that its key has in `source`."""
    facts: dict[str, Any] = {"measured": flaw.measured, "limit": flaw.limit, "unit": flaw.unit}
    facts["fixes"] = (Remedy(flaw.edits),) if flaw.edits else ()
    message = f"{key_text(flaw.key)}: {flaw.message}"
    return _finding(flaw.rule, message, flaw.hint, flaw.key, source.locate(flaw.key), **facts)


def _finding(
    rule: str, message: str, hint: str, key: str | None, place: tuple[int | None, int | None], **facts: Any
) -> Finding:
    shown = key_text(key) if key else None
    return Finding(rule, RULE_NAMES[rule], Severity.ERROR, message, hint.strip(), shown, *place, **facts)


MOST_LISTED = 16
"""Maximum number of keys of a section that a hint lists."""


def _invalid_key_finding(invalid: InvalidKey, source: SpecSource, form: type[Section]) -> Finding:
    """Return the finding for a key that cannot be read. `form` is the section class of the whole text."""
    key, refusal = invalid.key, invalid.refusal
    parent, _, name = key.rpartition(".")
    if invalid.section is not None:
        return _unknown_key(invalid, parent, source, form)
    if refusal is None:
        where, place = parent or "the spec", source.keys.get(parent, (1, 1))
        return _finding("SIT003", f"{where} has no {name}", f"add {name}: to {where}", key, place)
    facts = {name: refusal.facts.get(name) for name in ("measured", "limit", "unit")}
    suggestion, is_sure = refusal.facts.get("meant"), refusal.facts.get("is_sure", True)
    if suggestion and not isinstance(invalid.value, (list, dict)):  # a suggestion replaces a single value only
        facts["fixes"] = (Remedy((Edit(key, suggestion),), is_sure=is_sure),)
    message = f"{key_text(key)}: {refusal.message}"
    return _finding(refusal.rule, message, refusal.hint, key, source.locate(key), **facts)


def _unknown_key(invalid: InvalidKey, parent: str, source: SpecSource, form: type[Section]) -> Finding:
    key, word, allowed = invalid.key, str(invalid.value), tuple(cast(type[Section], invalid.section).keys)
    close = difflib.get_close_matches(word[:64].lower().replace("-", "_"), allowed, 1, 0.6)
    elsewhere = _sections_of_keys(cast(Hashable, form)).get(word) if not close and form.is_whole else None
    hint = f"did you mean {close[0]}? " if close else f"did you mean {elsewhere}? " if elsewhere else ""
    message = f"{describe(word)} is no key {f'in {parent}' if parent else 'at the top'}"
    listed = ", ".join(allowed[:MOST_LISTED]) + (", ... (all: docs/spec.md)" if len(allowed) > MOST_LISTED else "")
    fixes: tuple[Remedy, ...] = ()
    if close and dotted(parent, close[0]) not in source.keys:
        fixes = (Remedy((Edit(key, close[0], what="name"),), is_sure=is_misspelling(word, close[0])),)
    place = source.keys.get(key, (1, 1))
    return _finding("SIT002", message, f"{hint}allowed: {listed}", key, place, fixes=fixes)


@cache
def _sections_of_keys(form: Hashable) -> dict[str, str]:
    """Return the dotted key of each key name that occurs in only one section, for hints on misplaced keys."""
    homes: dict[str, str] = {}
    doubled: set[str] = set()
    for top, key in cast(type[Section], form).keys.items():
        section = section_of(key.kind)
        for name in section.keys if section else ():
            doubled |= {name} & homes.keys()
            homes[name] = f"{top}.{name}"
    return {name: home for name, home in homes.items() if name not in doubled}
