"""Design rules of fabricators: an installed profile, a file in the spec's folder or below, or written out in the spec.

All three are read in the same way. A profile can be based on another profile: its figures replace the figures of the
base. The last base of such a chain states all figures.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, replace
from functools import cache
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any, TypeVar

from sitscad.basics.finding import Finding
from sitscad.basics.record import record
from sitscad.basics.units import parse_quantity
from sitscad.data import FOLDER, UNVERIFIED
from sitscad.spec.design_rules import DesignRules, FoilLines, RulesDocument
from sitscad.spec.format.kinds import Figure, is_profile_file, names
from sitscad.spec.format.section import Section
from sitscad.spec.reading import (
    Flaw,
    Remarks,
    SpecError,
    decode_text,
    finding_from_flaw,
    finding_from_text,
    read_file,
    read_section,
)
from sitscad.spec.yaml.source import SpecSource, TextError

Form = TypeVar("Form", bound=Section)

_FALLBACK = "generic-flex"
_BEGINS = f"based_on: {_FALLBACK}"

MOST_FILES = 8
"""Maximum number of profile files in a chain, each based on the next."""


@record
class Origin:
    """The text that names or contains a profile: the spec, a file beside it, or an installed profile.

    * ``source``: the text
    * ``prefix``: dotted key of the profile's section in the text, with a dot at the end. Empty if the text is the
      profile.
    * ``folder``: folder of the text
    * ``root``: folder of the spec
    * ``chain``: paths of the profile files from the spec to this text, which is the last
    * ``installed``: name of an installed profile. Empty for other texts.
    """

    source: SpecSource
    prefix: str
    folder: Path | None
    root: Path | None
    chain: tuple[Path, ...] = ()
    installed: str = ""

    @property
    def label(self) -> str:
        """The file's path relative to the spec's folder."""
        return self._below_root(self.chain[-1])

    def _below_root(self, path: Path) -> str:
        return path.relative_to(self.root).as_posix() if self.root else path.name

    def record_error(self, remarks: Remarks, rule: str, key: str, message: str, hint: str) -> None:
        """Record an error at a key of this text, with a hint for its correction.

        If the text is the spec, the error is added to the flaws of `remarks`. If it is a profile file, the error is
        added to the findings of `remarks`.
        """
        flaw = Flaw(rule, key, message, hint)
        if not self.chain:
            remarks.flaws.append(flaw)
        else:
            remarks.texts[self.source.path] = self.source.text
            remarks.findings.append(replace(finding_from_flaw(flaw, self.source), file=self.source.path))

    def relative_paths(self, name: str, path: Path) -> set[str]:
        """Return the path of a file relative to the spec's folder, as `name` states it and with links resolved.

        `path` is the absolute path with links resolved. The set has one entry if both are equal. Paths outside the
        spec's folder are left out.
        """
        assert self.folder is not None and self.root is not None
        written = Path(os.path.normpath(self.folder.resolve() / name))
        below = [each for each in (written, path) if each.is_relative_to(self.root)]
        return {each.relative_to(self.root).as_posix() for each in below}

    def find_file(
        self, name: str, key: str, remarks: Remarks, what: str = "profile", like: str = "ourshop.yaml"
    ) -> Path | None:
        """Return the path of a file that this text names, with links resolved.

        None if the file is not allowed or not readable. The reason is then recorded in `remarks` as an error at `key`.
        For messages, `what` states the kind of file, and `like` is an example of its name.
        """
        hint = f"put the {what} beside the spec and write its name alone, like {like}"
        if self.folder is None or self.root is None:
            message = f"{name} is a {what} file, and this spec is a text without a folder"
            self.record_error(remarks, "SIT017", key, message, "load the spec from its file")
            return None
        if PurePosixPath(name).is_absolute() or PureWindowsPath(name).drive or "\\" in name:
            self.record_error(remarks, "SIT017", key, f"{name} is not a path below the spec's folder", hint)
            return None
        try:
            path = (self.folder / name).resolve()
            is_there = path.is_file()
        except (OSError, ValueError, RuntimeError) as error:
            self.record_error(remarks, "SIT011", key, f"cannot read {name}: {error}", "is the path right?")
            return None
        installed = "base one of them on an installed profile, like generic-flex"
        if not path.is_relative_to(self.root):
            self.record_error(remarks, "SIT017", key, f"{name} lies outside the spec's folder", hint)
        elif not is_there:
            state = "is not a file" if path.exists() else "is not there"
            hint = _similar_files_hint(self.folder, like)
            self.record_error(remarks, "SIT011", key, f"the {what} file {name} {state}", hint)
        elif path in self.chain:
            files = (self._below_root(each) for each in (*self.chain[self.chain.index(path) :], path))
            message = f"the profiles lead back to where they began: {' -> '.join(files)}"
            self.record_error(remarks, "SIT018", key, message, installed)
        elif len(self.chain) >= MOST_FILES:
            message = f"more than {MOST_FILES} profile files are based on each other"
            self.record_error(remarks, "SIT010", key, message, installed)
        else:
            return path
        return None

    def read_named_file(
        self, name: str, key: str, remarks: Remarks, what: str, like: str, most: int, smaller: str
    ) -> tuple[bytes, set[str]] | None:
        """Read a file that the spec names. Return its bytes and its paths relative to the spec's folder.

        None if it is not allowed, not readable or larger than `most` bytes. The reason is then recorded in `remarks` as
        an error at `key`. For messages, `what` states the kind of file, `like` is an example of its name, and `smaller`
        is the hint for a file that is too large.
        """
        path = self.find_file(name, key, remarks, what, like)
        if path is None:
            return None
        try:
            with path.open("rb") as stream:
                content = stream.read(most + 1)
        except OSError as error:
            remarks.flaw("SIT011", key, f"cannot read {name}: {error.strerror or error}", "is the path right?")
            return None
        if len(content) > most:
            remarks.flaw("SIT010", key, f"{name} is larger than {most // 2**20} MiB", smaller)
            return None
        return content, self.relative_paths(name, path)

    def read_profile_file(
        self, name: str, form: type[Form], begins: str, key: str, remarks: Remarks
    ) -> tuple[Form, Origin] | None:
        """Read a profile file that this text names at `key`. Return its section, and the origin of its own keys.

        None if it has errors, which are recorded in `remarks`. `form` is the section class, and `begins` the usual
        first line of such a file, for messages.
        """
        path = self.find_file(name, key, remarks)
        if path is None:
            return None
        shown = os.path.normpath(os.path.join(os.path.dirname(self.source.path), name))
        text = ""
        findings: tuple[Finding, ...] = ()
        try:
            content = read_file(path, shown)
            text = decode_text(content).removeprefix("\ufeff")
            document, source = read_section(text, shown, form, begins)
        except TextError as error:
            findings = (finding_from_text(error),)
        except SpecError as error:
            findings = error.findings
        else:
            remarks.files |= dict.fromkeys(self.relative_paths(name, path), content)
            return document, Origin(source, "", path.parent, self.root, (*self.chain, path))
        remarks.texts[shown] = text
        remarks.findings += [replace(finding, file=shown) for finding in findings]
        return None


FILES = {"YAML": (".yaml", ".yml"), "STEP": (".step", ".stp"), "DXF": (".dxf",), "KiCad": (".kicad_mod", ".kicad_pcb")}
"""Kinds of file that a spec can name, with their endings."""


def _similar_files_hint(folder: Path, like: str) -> str:
    """Return a hint that lists up to six files in a folder. They have the same kind as the example name `like`."""
    kind, endings = next((kind, endings) for kind, endings in FILES.items() if like.endswith(endings))
    there = sorted(path.name for path in folder.iterdir() if path.name.lower().endswith(endings))[:6]
    return f"there are: {', '.join(there)}" if there else f"there is no {kind} file in that folder"


@cache
def installed_rules(name: str) -> DesignRules:
    """Return the design rules of an installed fabricator profile, for the thinnest foil that it lists.

    Values that the profile lacks come from its base profile, and their source names the base. Raises KeyError if no
    installed profile has the name.
    """
    if name not in names("rules"):
        raise KeyError(name)
    path = FOLDER / "fabricators" / f"{name}.yaml"
    document, source = read_section(path.read_text(encoding="utf-8"), path.name, RulesDocument, _BEGINS)
    return _Profile(document, Origin(source, "", None, None, installed=name), Remarks()).rules(None)


def resolve_rules(written: str | RulesDocument, foil: float, place: Origin, remarks: Remarks) -> DesignRules:
    """Return the design rules for copper foil of thickness `foil` (m).

    `written` is the name of a profile, or the rules that the spec itself contains. `place` is the text with the name or
    rules. Errors in profile files become findings in `remarks`.
    """
    if isinstance(written, RulesDocument):
        return _Profile(written, place, remarks).rules(foil)
    return _load_rules(written, foil, place, place.prefix.rstrip("."), remarks)


def _load_rules(name: str, foil: float | None, place: Origin, key: str, remarks: Remarks) -> DesignRules:
    """Return the design rules that a text names at `key`: an installed profile or a profile file.

    Track widths and spacings are for copper foil of thickness `foil` (m). If it is None, they are for the thinnest
    listed foil. Errors in a profile file are recorded in `remarks`, and the rules of the profile generic-flex are then
    returned.
    """
    inner = None
    if is_profile_file(name):
        inner = place.read_profile_file(name, RulesDocument, _BEGINS, key, remarks)
        name = _FALLBACK
    if inner is None:
        rules = installed_rules(name)
        return _with_named_sources(rules) if foil is None else rules.for_foil(foil)
    return _Profile(*inner, remarks).rules(foil)


def _with_named_sources(rules: DesignRules) -> DesignRules:
    """Return the rules with " (from NAME)" added to the source of each value that this profile itself states.

    NAME is the name of the profile. In a profile that is based on it, the source then names this origin.
    """

    def said(source: str, holder: str) -> str:
        return f"{source} (from {holder})" if holder == rules.name else source

    def row(lines: FoilLines) -> FoilLines:
        width, spacing = said(lines.width_source, lines.width_holder), said(lines.spacing_source, lines.spacing_holder)
        return replace(lines, width_source=width, spacing_source=spacing)

    return replace(
        rules, sources={field: said(source, rules.holders[field]) for field, source in rules.sources.items()},
        coil_lines=tuple(map(row, rules.coil_lines)), track_lines=tuple(map(row, rules.track_lines)),
    )


_PLAIN = {one.name for one in fields(DesignRules)} & RulesDocument.keys.keys() - {"coil_rule_binding", "checked_on"}
"""Keys of a profile whose values become the fields of `DesignRules` with equal names."""

_BY_COUNT: Mapping[str, tuple[str, Callable[[str], Any]]] = {
    "static_bend_": ("static_bend_ratio", int),
    "dynamic_bend_": ("dynamic_bend_ratio", int),
    "annular_ring_": ("annular_rings", int),
    "thickness_tolerance_": ("thickness_tolerance", int),
    "stiffened_tolerance_": ("stiffened_tolerance", str),
}
"""Profile keys that become entries of a table in `DesignRules`: (name of the table's field, type of the table's keys).

They are listed by their prefix. The part of the profile key after the prefix is the key in the table.
"""

_TABLES = {"trace": ("tracks", "track_lines"), "coil_trace": ("coil_tracks", "coil_lines")}
"""Tables of track widths and spacings by foil thickness: (key in the profile, field of `DesignRules`).

They are listed by the prefix of profile keys that state a single width or spacing, such as ``trace_width``.
"""

_NEEDED = ("via_drill", "annular_ring", "hole_to_hole", "drill_to_copper", "copper_to_edge", "coverlay_web",
           "coverlay_opening_to_trace", "part_size")


class _Profile:
    """A profile: its keys, the text that contains them, and the remarks to which errors are added."""

    def __init__(self, document: RulesDocument, place: Origin, remarks: Remarks) -> None:
        self.document, self.place, self.remarks = document, place, remarks
        self.figures = {name: value for name, value in document.values().items() if isinstance(value, Figure)}
        base = "" if document.based_on == "none" else f", based on {document.based_on}"
        default_name = Path(place.label).stem if place.chain else f"the spec's rules{base}"
        self.name = place.installed or document.name or default_name

    def _record_error(self, rule: str, key: str, message: str, hint: str) -> None:
        self.place.record_error(self.remarks, rule, f"{self.place.prefix}{key}", message, hint)

    def rules(self, foil: float | None) -> DesignRules:
        """Return the rules of this profile. Values that it does not state are taken from its base.

        Track widths and spacings are for copper foil of thickness `foil` (m), or for the thinnest listed foil if it is
        None.
        """
        figures, base = self.figures, self._base(foil)
        if self.place.chain and "based_on" not in self.place.source.keys:
            self.remarks.default("fpc.rules", f"{self.place.label} based on {self.document.based_on}")
        rows = {kind: self._lines(kind) for kind in _TABLES}
        changed: dict[str, Any] = {field: each.value for field, each in figures.items() if field in _PLAIN}
        for beginning, (table, read) in _BY_COUNT.items():
            entries = {read(n.removeprefix(beginning)): f.value for n, f in figures.items() if n.startswith(beginning)}
            changed |= {table: {**getattr(base, table), **entries}} if entries else {}
            if table == "annular_rings" and "annular_ring" in figures:  # it replaces the base's rings
                changed[table] = entries
        changed |= self._tables(base, changed, rows) | self._binding_fields(base, changed, rows)
        # the date of the base does not apply to these figures
        changed["checked_on"] = figures["checked_on"].value if "checked_on" in figures else ""
        changed["beyond"] = {name: most for name, most in base.beyond.items() if name not in figures}
        changed["sources"] = {**base.sources, **{name: self._source_text(name, each) for name, each in figures.items()}}
        changed["holders"] = {**base.holders, **{name: self._holder_text(name) for name in figures}}
        is_said = not self.place.chain or "source" in self.place.source.keys
        source = self.document.source if is_said else self.place.label
        source += f"; the rest from {base.name}" if base.name else ""
        if self.place.installed:
            source = f"design rules {self.name}, each figure with its own source"
        rules = replace(base, **changed, name=self.name, source=source)
        if foil is None and (thinnest := (rules.track_lines or rules.coil_lines)[:1]):
            foil = thinnest[0].copper
        return rules.for_foil(foil) if foil is not None and any(rows.values()) else rules

    def _base(self, foil: float | None) -> DesignRules:
        """Return the rules of the base. If there is no base, return rules with only the figures of this profile.

        `foil` is as in `rules`.
        """
        document, figures = self.document, self.figures
        if document.based_on != "none":
            return _load_rules(document.based_on, foil, self.place, f"{self.place.prefix}based_on", self.remarks)
        lacking = [name for name in _NEEDED if name not in figures]
        has_lines = document.tracks or {"trace_width", "trace_spacing"} <= figures.keys() or document.by_foil
        lacking += [] if has_lines else ["tracks"]
        if lacking:
            message = f"a profile that is based on none states every figure, and not {', '.join(lacking)}"
            self._record_error("SIT003", "based_on", message, f"add them, or {_BEGINS}")
            return installed_rules(_FALLBACK)
        needed: dict[str, Any] = {name: figures[name].value for name in _NEEDED}
        return DesignRules(
            name="", trace_width=0.0, trace_spacing=0.0, coil_trace_width=None, coil_trace_spacing=None,
            coil_rule_binding=False, **needed,
        )

    def _binding_fields(
        self, base: DesignRules, changed: Mapping[str, Any], rows: Mapping[str, tuple[FoilLines, ...]]
    ) -> dict[str, Any]:
        """Return ``coil_rule_binding`` and ``unbound``: whether coil tracks below the minimums are errors or warnings.

        The profile's key ``coil_rule_binding`` decides. Without this key, they are errors if the profile itself has
        minimums for coil tracks, or if they are errors in its base.

        `base` are the rules of the base, `changed` the fields that this profile replaces, and `rows` the rows by foil.
        """
        if "coil_rule_binding" in self.figures:
            return {"coil_rule_binding": self.figures["coil_rule_binding"].value}
        own_keys = {*self.figures, *self.document.by_foil, *(kind for kind in rows if rows[kind])}
        has_coil_rules = any(field.startswith("coil_trace") for field in own_keys)
        binding: dict[str, Any] = {"coil_rule_binding": has_coil_rules or base.coil_rule_binding}
        if has_coil_rules and not (base.coil_rule_binding or rows["coil_trace"]):
            binding["unbound"] = tuple(f for f in ("coil_trace_width", "coil_trace_spacing") if f not in changed)
        return binding

    def _tables(
        self, base: DesignRules, changed: Mapping[str, Any], rows: Mapping[str, tuple[FoilLines, ...]]
    ) -> dict[str, Any]:
        # Lines by foil: a written table replaces the base's table, and rows in separate keys replace single rows. A
        # figure for all foils removes the table.
        tables: dict[str, Any] = {}
        for kind, (key, table) in _TABLES.items():
            is_plain = f"{kind}_width" in changed or f"{kind}_spacing" in changed
            is_whole = getattr(self.document, key) is not None
            merged = {} if is_plain or is_whole else {row.copper: row for row in getattr(base, table)}
            merged |= {row.copper: row for row in rows[kind]}
            tables[table] = tuple(merged[copper] for copper in sorted(merged))
            if is_plain and kind == "coil_trace":
                tables["coil_copper"] = None
        return tables

    def _lines(self, kind: str) -> tuple[FoilLines, ...]:
        """Return the widths and spacings of tracks for each listed foil, the thinnest foil first.

        `kind` is "trace" or "coil_trace". Keys that contradict each other are recorded as errors.
        """
        key, pair = _TABLES[kind][0], (f"{kind}_width", f"{kind}_spacing")
        is_table = getattr(self.document, key) is not None
        older = [each for each in self.document.by_foil if each.rpartition("_")[0] in pair]
        like = key if is_table else f"{pair[0]}_{min(each.rpartition('_')[2] for each in older)}" if older else ""
        for plain_key in pair:
            if like and plain_key in self.figures:
                place = f"{like} or its like" if older else like
                message = f"it holds for every copper, and {place} for one"
                self._record_error("SIT009", plain_key, message, "keep one of the two")
        for each in older if is_table else ():
            self._record_error("SIT009", each, f"it is a row of {key}, which is given too", f"move it into {key}")
        lines = self._rows(key) if is_table else self._older_rows(kind, older)
        return tuple(sorted(lines, key=lambda row: row.copper))

    def _rows(self, key: str) -> Iterator[FoilLines]:
        foils: set[float] = set()
        written = getattr(self.document, key)
        if not 1 <= len(written) <= 20:
            message = f"{len(written)} rows are out of range: 1 to 20"
            self._record_error("SIT006", key, message, "one row a foil, or leave it out")
        for number, row in enumerate(written):
            if row.copper in foils:
                where = f"{key}.{number}.copper"
                self._record_error("SIT009", where, "a second row for the same copper", "keep one of the two")
            foils.add(row.copper)
            yield self._row(row.copper, {f"{key}.{number}.{what}": getattr(row, what) for what in ("width", "spacing")})

    def _older_rows(self, kind: str, keys: list[str]) -> Iterator[FoilLines]:
        """Yield the rows in the older format: two keys whose names end with the foil, like ``trace_width_18um``.

        `kind` is "trace" or "coil_trace", and `keys` are the keys in this format.
        """
        for foil in dict.fromkeys(key.rpartition("_")[2] for key in keys):
            pair = (f"{kind}_width_{foil}", f"{kind}_spacing_{foil}")
            lone = [each for each in pair if each not in self.document.by_foil]
            if lone:
                other = pair[1] if lone[0] == pair[0] else pair[0]
                self._record_error("SIT003", other, f"it goes with {lone[0]}, which is missing", "give both")
                continue
            yield self._row(parse_quantity(foil, "length"), {each: self.document.by_foil[each] for each in pair})

    def _row(self, copper: float, pair: Mapping[str, Figure]) -> FoilLines:
        """Return the row for a foil of thickness `copper` (m).

        `pair` has two entries by profile key: first the width, then the spacing.
        """
        width, spacing = (figure.value for figure in pair.values())
        sources = (self._source_text(key, figure) for key, figure in pair.items())
        return FoilLines(copper, width, spacing, *sources, *(self._holder_text(key) for key in pair))

    def _holder_text(self, field: str) -> str:
        """Return the text that names this profile as the origin of a key's value.

        If the profile is not installed, the text has the line of the key. For a profile file, it also has the path.
        """
        place = self.place
        if place.installed:
            return self.name
        line = place.source.locate(f"{place.prefix}{field}")[0]
        if place.chain:
            return f"{self.name} ({place.label} line {line})"
        return f"{self.document.name or 'the spec'} (line {line})"

    def _source_text(self, key: str, figure: Figure) -> str:
        """Return the source of a value. For a profile file, the file's path and the key's line come first.

        If nobody has checked the source, the text begins with `UNVERIFIED`.
        """
        source, place = figure.source or self.document.source, self.place
        if place.chain:
            line = place.source.locate(key)[0]
            own_source = figure.source or (self.document.source if "source" in place.source.keys else "")
            source = f"{place.label} line {line}" + (f": {own_source}" if own_source else "")
        return source if figure.is_verified else UNVERIFIED + source
