"""Fabricators' design rules as a spec names them: a preset, a profile file in the spec's folder, or written out there.

Each is based on another one, down to a preset; a figure that is written lies over that of what it is based on.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

from sitscad.finding import Finding
from sitscad.record import record
from sitscad.spec.design_rules import DesignRules, FoilLines
from sitscad.spec.format.diagnosis import finding_from_flaw, finding_from_text
from sitscad.spec.format.kinds import Figure, is_profile_file
from sitscad.spec.format.reading import decoded, read_file, read_section
from sitscad.spec.format.remarks import Flaw, Remarks
from sitscad.spec.format.rules_document import RulesDocument
from sitscad.spec.format.yaml_text import TextError
from sitscad.spec.profiles import presets
from sitscad.spec.rules import SpecError
from sitscad.spec.source import SpecSource
from sitscad.units import parse_quantity

MOST_FILES = 8
"""Profile files, each based on the next."""

_FALLBACK = "generic-flex"


@record
class Place:
    """Where a profile is named or written out.

    ``source`` is the text, ``prefix`` the dotted key before its figures, ``folder`` the text's folder and ``root`` the
    spec's; ``chain`` are the files that led here from the spec, the last one being this text.
    """

    source: SpecSource
    prefix: str
    folder: Path | None
    root: Path | None
    chain: tuple[Path, ...] = ()

    @property
    def label(self) -> str:
        """The file's name below the spec's folder."""
        return self._below_root(self.chain[-1])

    def circle(self, path: Path) -> str:
        """The files from a path to here and back to it."""
        return " -> ".join(self._below_root(each) for each in (*self.chain[self.chain.index(path) :], path))

    def _below_root(self, path: Path) -> str:
        return path.relative_to(self.root).as_posix() if self.root else path.name

    def complain(self, remarks: Remarks, rule: str, key: str, message: str, hint: str) -> None:
        """Note something that is wrong at a key of this text."""
        flaw = Flaw(rule, key, message, hint)
        if not self.chain:
            remarks.flaws.append(flaw)
        else:
            remarks.texts[self.source.path] = self.source.text
            remarks.findings.append(replace(finding_from_flaw(flaw, self.source), file=self.source.path))


def spec_place(source: SpecSource, folder: Path | None) -> Place:
    """The spec itself as the place where rules are named: in its folder and below may be profile files."""
    return Place(source, "fpc.rules.", folder, None if folder is None else folder.resolve())


def resolve_rules(written: str | RulesDocument, foil: float, place: Place, remarks: Remarks) -> DesignRules:
    """The rules for a coil in foil of a thickness (m); faults of profile files are noted as findings."""
    if isinstance(written, RulesDocument):
        return _overlaid(written, foil, place, remarks)
    return _named(written, foil, place, place.prefix.rstrip("."), remarks)


def _named(name: str, foil: float, place: Place, key: str, remarks: Remarks) -> DesignRules:
    """The rules of a name that stands at a key of the place's text."""
    if not is_profile_file(name):
        return presets.design_rules(name).for_foil(foil)
    inner = _opened(name, place, key, remarks)
    if inner is None:
        return presets.design_rules(_FALLBACK).for_foil(foil)
    document, found = inner
    return _overlaid(document, foil, found, remarks)


def _opened(name: str, place: Place, key: str, remarks: Remarks) -> tuple[RulesDocument, Place] | None:
    """The profile in a file, or None with its faults noted."""
    path = _located(name, place, key, remarks)
    if path is None:
        return None
    shown = os.path.normpath(os.path.join(os.path.dirname(place.source.path), name))
    text = ""
    try:
        content = read_file(path)
        text = decoded(content).removeprefix("\ufeff")
        document, source = read_section(text, shown, RulesDocument, "based_on: generic-flex")
    except TextError as error:
        said = finding_from_text(error)
        _note(remarks, shown, text, (replace(said, message=said.message.replace(str(path), shown)),))
    except SpecError as error:
        _note(remarks, shown, text, error.findings)
    else:
        remarks.files |= dict.fromkeys(_names_of(name, path, place), content)
        return document, Place(source, "", path.parent, place.root, (*place.chain, path))
    return None


def _names_of(name: str, path: Path, place: Place) -> set[str]:
    """A profile's path from the spec's folder: as it is written, and where a link leads, if that is elsewhere."""
    assert place.folder is not None and place.root is not None
    written = Path(os.path.normpath(place.folder.resolve() / name))
    below = [each for each in (written, path) if each.is_relative_to(place.root)]
    return {each.relative_to(place.root).as_posix() for each in below}


def _note(remarks: Remarks, path: str, text: str, findings: tuple[Finding, ...]) -> None:
    remarks.texts[path] = text
    remarks.findings += [replace(finding, file=path) for finding in findings]


def _located(name: str, place: Place, key: str, remarks: Remarks) -> Path | None:
    """Where a profile file is, links resolved; None with the reason noted where it must not or cannot be read."""
    hint = "put the profile beside the spec and write its name alone, like ourshop.yaml"
    if place.folder is None or place.root is None:
        message = f"{name} is a profile file, and this spec is a text without a folder"
        place.complain(remarks, "SIT017", key, message, "load the spec from its file")
        return None
    if PurePosixPath(name).is_absolute() or PureWindowsPath(name).drive or "\\" in name:
        place.complain(remarks, "SIT017", key, f"{name} is not a path below the spec's folder", hint)
        return None
    try:
        path = (place.folder / name).resolve()
        is_there = path.is_file()
    except (OSError, ValueError, RuntimeError) as error:
        place.complain(remarks, "SIT011", key, f"cannot read {name}: {error}", "is the path right?")
        return None
    if not path.is_relative_to(place.root):
        place.complain(remarks, "SIT017", key, f"{name} lies outside the spec's folder", hint)
    elif not is_there:
        what = "is not a file" if path.exists() else "is not there"
        place.complain(remarks, "SIT011", key, f"the profile file {name} {what}", _beside(place.folder))
    elif path in place.chain:
        message = f"the profiles lead back to where they began: {place.circle(path)}"
        place.complain(remarks, "SIT018", key, message, "base one of them on an installed profile, like generic-flex")
    elif len(place.chain) >= MOST_FILES:
        message = f"more than {MOST_FILES} profile files are based on each other"
        place.complain(remarks, "SIT010", key, message, "base one of them on an installed profile, like generic-flex")
    else:
        return path
    return None


def _beside(folder: Path) -> str:
    """A hint with the YAML files of a folder."""
    there = sorted(path.name for path in folder.iterdir() if is_profile_file(path.name))[:6]
    return f"there are: {', '.join(there)}" if there else "there is no YAML file in that folder"


_PLAIN = (
    "trace_width", "trace_spacing", "via_drill", "annular_ring", "coil_trace_width", "coil_trace_spacing",
    "hole_to_hole", "drill_to_copper", "copper_to_edge", "coverlay_web", "coverlay_opening_to_trace",
    "outline_tolerance", "registration", "inside_radius", "finger_lap", "pad_lap", "coverlay_lap", "hole_to_step",
    "part_size", "panel_size",
)  # fmt: skip

_BY_COUNT: Mapping[str, tuple[str, Callable[[str], Any]]] = {
    "static_bend_": ("static_bend_ratio", int),
    "dynamic_bend_": ("dynamic_bend_ratio", int),
    "thickness_tolerance_": ("thickness_tolerance", int),
    "stiffened_tolerance_": ("stiffened_tolerance", str),
}
"""Beginnings of keys that are one entry of a table each, the table, and how its keys are read."""


def _overlaid(document: RulesDocument, foil: float, place: Place, remarks: Remarks) -> DesignRules:
    """What is written, over what it is based on."""
    base = _named(document.based_on, foil, place, f"{place.prefix}based_on", remarks)
    if place.chain and "based_on" not in place.source.keys:
        remarks.default("fpc.rules", f"{place.label} based on {document.based_on}")
    figures = {name: value for name, value in document.values().items() if isinstance(value, Figure)}
    sources = {**base.sources, **{name: _source(name, each, document, place) for name, each in figures.items()}}
    is_named = f"{place.prefix}name" in place.source.keys or not place.chain
    name = document.name if is_named else Path(place.label).stem
    holders = {**base.holders, **{field: _holder(field, name, place) for field in figures}}
    changed: dict[str, Any] = {field: each.value for field, each in figures.items() if field in _PLAIN}
    for beginning, (table, read) in _BY_COUNT.items():
        own = {read(name.removeprefix(beginning)): f.value for name, f in figures.items() if name.startswith(beginning)}
        changed |= {table: {**getattr(base, table), **own}} if own else {}
    lines = {kind: _lines(kind, figures, (sources, holders), place, remarks) for kind in ("trace", "coil_trace")}
    changed |= _ruled_lines(base, changed, lines)
    coil_rules = any(name.startswith("coil_trace_") for name in figures)
    binding = (coil_rules or base.coil_rule_binding) if document.coil_rule_binding is None else None
    if coil_rules and document.coil_rule_binding is None and not (base.coil_rule_binding or lines["coil_trace"]):
        changed["unbound"] = tuple(f for f in ("coil_trace_width", "coil_trace_spacing") if f not in changed)
    changed["coil_rule_binding"] = document.coil_rule_binding if binding is None else binding
    changed |= {"file_naming": document.file_naming} if document.file_naming else {}
    changed["checked_on"] = document.checked_on or ""  # the day on which the base was read says nothing of these
    changed["beyond"] = {name: most for name, most in base.beyond.items() if name not in figures}
    said = document.source if not place.chain or "source" in place.source.keys else place.label
    rules = replace(
        base, **changed, name=name, source=f"{said}; the rest from {base.name}", sources=sources, holders=holders
    )
    return rules.for_foil(foil) if any(lines.values()) else rules


def _ruled_lines(
    base: DesignRules, changed: Mapping[str, Any], lines: Mapping[str, tuple[FoilLines, ...]]
) -> dict[str, Any]:
    """Lines by foil: own rows over the base's, whose table goes only where a figure for every foil is written."""
    found: dict[str, Any] = {}
    for kind, table in (("trace", "track_lines"), ("coil_trace", "coil_lines")):
        is_plain = f"{kind}_width" in changed or f"{kind}_spacing" in changed
        rows = {} if is_plain else {row.copper: row for row in getattr(base, table)}
        rows |= {row.copper: row for row in lines[kind]}
        found[table] = tuple(rows[copper] for copper in sorted(rows))
        if is_plain and kind == "coil_trace":
            found["coil_copper"] = None
    return found


def _lines(
    kind: str,
    figures: Mapping[str, Figure],
    said: tuple[Mapping[str, str], Mapping[str, str]],
    place: Place,
    remarks: Remarks,
) -> tuple[FoilLines, ...]:
    """Widths and spacings by foil, from the thinnest, with what is `said` of them: their sources and their holders.

    One without the other, or beside a figure for all, is a flaw.
    """
    foils = {n.rpartition("_")[2] for n in figures if n.startswith((f"{kind}_width_", f"{kind}_spacing_"))}
    found = []
    for foil in foils:
        pair = (f"{kind}_width_{foil}", f"{kind}_spacing_{foil}")
        lone = [name for name in pair if name not in figures]
        if lone:
            other = pair[1] if lone[0] == pair[0] else pair[0]
            place.complain(
                remarks, "SIT003", f"{place.prefix}{other}", f"it goes with {lone[0]}, which is missing", "give both"
            )
            continue
        width, gap = (figures[name].value for name in pair)
        words = (texts[name] for texts in said for name in pair)
        found.append(FoilLines(parse_quantity(foil, "length"), width, gap, *words))
    doubled = [name for name in (f"{kind}_width", f"{kind}_spacing") if foils and name in figures]
    for name in doubled:
        message = f"it holds for every copper, and {kind}_width_{min(foils)} or its like for one"
        place.complain(remarks, "SIT009", f"{place.prefix}{name}", message, "keep one of the two")
    return tuple(sorted(found, key=lambda row: row.copper))


def _holder(field: str, name: str, place: Place) -> str:
    """The profile that a figure stands in, and its line there."""
    line = place.source.locate(f"{place.prefix}{field}")[0]
    if place.chain:
        return f"{name} ({place.label} line {line})"
    is_named = f"{place.prefix}name" in place.source.keys
    return f"{name if is_named else 'the spec'} (line {line})"


def _source(name: str, figure: Figure, document: RulesDocument, place: Place) -> str:
    """Where a figure comes from: what is said of it, after the file and line that it stands in; marked if not seen."""
    said = figure.source or document.source
    if place.chain:
        line = place.source.locate(name)[0]
        own = figure.source or (document.source if "source" in place.source.keys else "")
        said = f"{place.label} line {line}" + (f": {own}" if own else "")
    return said if figure.is_verified else f"unverified: {said}"
