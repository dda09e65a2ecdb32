"""Fabricators' design rules as a spec names them: an installed profile, a file in the spec's folder, or written out.

All are read alike. Each is based on another one, down to one that stands alone; a figure that is written lies over that
of what it is based on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from sitscad.data import UNVERIFIED
from sitscad.spec.design_rules import DesignRules, FoilLines
from sitscad.spec.format.documents.fabricator import RulesDocument, TrackRowDocument
from sitscad.spec.format.kinds.figure import Figure
from sitscad.spec.format.kinds.preset import is_profile_file
from sitscad.spec.format.reading import read_section
from sitscad.spec.format.remarks import Remarks
from sitscad.spec.profiles.files import opened
from sitscad.spec.profiles.names import DATA, names
from sitscad.spec.profiles.origin import Origin
from sitscad.units import parse_quantity

_FALLBACK = "generic-flex"
_BEGINS = f"based_on: {_FALLBACK}"


@cache
def installed_rules(name: str) -> DesignRules:
    """An installed fabricator's design rules, for its thinnest copper; raises KeyError where there is none so called.

    What a house does not state comes from the profile that it is based on, and says so in its source.
    """
    if name not in names("rules"):
        raise KeyError(name)
    path = DATA / "fabricators" / f"{name}.yaml"
    document, source = read_section(path.read_text(encoding="utf-8"), path.name, RulesDocument, _BEGINS)
    return _overlaid(document, None, Origin(source, "", None, None, installed=name), Remarks())


def resolve_rules(written: str | RulesDocument, foil: float, place: Origin, remarks: Remarks) -> DesignRules:
    """The rules for a coil in foil of a thickness (m); faults of profile files are noted as findings."""
    if isinstance(written, RulesDocument):
        return _overlaid(written, foil, place, remarks)
    return _named(written, foil, place, place.prefix.rstrip("."), remarks)


def _named(name: str, foil: float | None, place: Origin, key: str, remarks: Remarks) -> DesignRules:
    """The rules of a name that stands at a key of a text, for a foil (m; None: the thinnest listed)."""
    inner = None
    if is_profile_file(name):
        inner = opened(name, RulesDocument, _BEGINS, place, key, remarks)
        name = _FALLBACK
    if inner is None:
        rules = installed_rules(name)
        return _whose(rules) if foil is None else rules.for_foil(foil)
    return _overlaid(inner[0], foil, inner[1], remarks)


def _whose(rules: DesignRules) -> DesignRules:
    """The rules with their own figures' sources saying whose they are, for a profile that takes them over."""

    def said(source: str, holder: str) -> str:
        return f"{source} (from {holder})" if holder == rules.name else source

    def row(lines: FoilLines) -> FoilLines:
        width, spacing = said(lines.width_source, lines.width_holder), said(lines.spacing_source, lines.spacing_holder)
        return replace(lines, width_source=width, spacing_source=spacing)

    return replace(
        rules,
        sources={field: said(source, rules.holders[field]) for field, source in rules.sources.items()},
        coil_lines=tuple(map(row, rules.coil_lines)),
        track_lines=tuple(map(row, rules.track_lines)),
    )


_PLAIN = (
    "trace_width", "trace_spacing", "via_drill", "annular_ring", "coil_trace_width", "coil_trace_spacing",
    "hole_to_hole", "drill_to_copper", "copper_to_edge", "coverlay_web", "coverlay_opening_to_trace",
    "outline_tolerance", "registration", "inside_radius", "finger_lap", "pad_lap", "coverlay_lap", "hole_to_step",
    "part_size", "panel_size", "file_naming", "layer_counts", "foils", "cores", "covers", "stiffeners", "finishes",
    "order_multiple", "one_process", "house", "country",
)  # fmt: skip

_BY_COUNT: Mapping[str, tuple[str, Callable[[str], Any]]] = {
    "static_bend_": ("static_bend_ratio", int),
    "dynamic_bend_": ("dynamic_bend_ratio", int),
    "annular_ring_": ("annular_rings", int),
    "thickness_tolerance_": ("thickness_tolerance", int),
    "stiffened_tolerance_": ("stiffened_tolerance", str),
}
"""Beginnings of keys that are one entry of a table each, the table, and how its keys are read."""

_TABLES = {"trace": ("tracks", "track_lines"), "coil_trace": ("coil_tracks", "coil_lines")}
"""Beginnings of keys of lines, the key of their rows by foil, and the table of the rules."""

_NEEDED = (
    "via_drill", "annular_ring", "hole_to_hole", "drill_to_copper", "copper_to_edge", "coverlay_web",
    "coverlay_opening_to_trace", "part_size",
)  # fmt: skip


def _overlaid(document: RulesDocument, foil: float | None, place: Origin, remarks: Remarks) -> DesignRules:
    """What is written, over what it is based on, for a foil (m; None: the thinnest listed)."""
    figures = {name: value for name, value in document.values().items() if isinstance(value, Figure)}
    base = _base(document, figures, foil, place, remarks)
    if place.chain and "based_on" not in place.source.keys:
        remarks.default("fpc.rules", f"{place.label} based on {document.based_on}")
    name = _name(document, place)
    rows = {kind: _lines(kind, document, figures, name, place, remarks) for kind in _TABLES}
    own = {*figures, *document.by_foil, *(kind for kind in rows if rows[kind])}
    changed: dict[str, Any] = {field: each.value for field, each in figures.items() if field in _PLAIN}
    for beginning, (table, read) in _BY_COUNT.items():
        entries = {read(n.removeprefix(beginning)): f.value for n, f in figures.items() if n.startswith(beginning)}
        changed |= {table: {**getattr(base, table), **entries}} if entries else {}
    if "annular_ring" in figures:  # a ring for every board takes the place of what the base asks by layers
        by_layers = {name: figure for name, figure in figures.items() if name.startswith("annular_ring_")}
        changed["annular_rings"] = {int(name.rpartition("_")[2]): figure.value for name, figure in by_layers.items()}
    changed |= _tables(base, document, changed, rows)
    changed |= _binding(base, figures, any(field.startswith("coil_trace") for field in own), changed, rows)
    # the day on which the base was read says nothing of these
    changed["checked_on"] = figures["checked_on"].value if "checked_on" in figures else ""
    changed["beyond"] = {name: most for name, most in base.beyond.items() if name not in figures}
    changed["sources"] = {**base.sources, **{n: _source(n, each, document, place) for n, each in figures.items()}}
    changed["holders"] = {**base.holders, **{field: _holder(field, name, place) for field in figures}}
    rules = replace(base, **changed, name=name, source=_said(document, base, place))
    if foil is None and (thinnest := (rules.track_lines or rules.coil_lines)[:1]):
        foil = thinnest[0].copper
    return rules.for_foil(foil) if foil is not None and any(rows.values()) else rules


def _base(
    document: RulesDocument, figures: Mapping[str, Figure], foil: float | None, place: Origin, remarks: Remarks
) -> DesignRules:
    """What a profile is based on; of one that stands alone, rules of its own figures and no others."""
    if document.based_on != "none":
        return _named(document.based_on, foil, place, f"{place.prefix}based_on", remarks)
    lacking = [name for name in _NEEDED if name not in figures]
    has_lines = document.tracks or {"trace_width", "trace_spacing"} <= figures.keys() or document.by_foil
    lacking += [] if has_lines else ["tracks"]
    if lacking:
        message = f"a profile that is based on none states every figure, and not {', '.join(lacking)}"
        place.complain(remarks, "SIT003", f"{place.prefix}based_on", message, f"add them, or {_BEGINS}")
        return installed_rules(_FALLBACK)
    needed: dict[str, Any] = {name: figures[name].value for name in _NEEDED}
    return DesignRules(
        name="", trace_width=0.0, trace_spacing=0.0, coil_trace_width=None, coil_trace_spacing=None,
        coil_rule_binding=False, **needed,
    )  # fmt: skip


def _name(document: RulesDocument, place: Origin) -> str:
    if place.installed:
        return place.installed
    is_named = f"{place.prefix}name" in place.source.keys or not place.chain
    return document.name if is_named else Path(place.label).stem


def _said(document: RulesDocument, base: DesignRules, place: Origin) -> str:
    """Where the whole profile comes from."""
    if place.installed:
        return f"design rules {place.installed}, each figure with its own source"
    own = document.source if not place.chain or "source" in place.source.keys else place.label
    return f"{own}; the rest from {base.name}" if base.name else own


def _binding(
    base: DesignRules,
    figures: Mapping[str, Figure],
    has_coil_rules: bool,
    changed: Mapping[str, Any],
    rows: Mapping[str, tuple[FoilLines, ...]],
) -> dict[str, Any]:
    """Whether the minimums of coils are errors: where that is written, else those that are written here are."""
    if "coil_rule_binding" in figures:
        return {"coil_rule_binding": figures["coil_rule_binding"].value}
    found: dict[str, Any] = {"coil_rule_binding": has_coil_rules or base.coil_rule_binding}
    if has_coil_rules and not (base.coil_rule_binding or rows["coil_trace"]):
        found["unbound"] = tuple(f for f in ("coil_trace_width", "coil_trace_spacing") if f not in changed)
    return found


def _tables(
    base: DesignRules,
    document: RulesDocument,
    changed: Mapping[str, Any],
    rows: Mapping[str, tuple[FoilLines, ...]],
) -> dict[str, Any]:
    """Lines by foil: a table that is written is the whole one, rows in keys of their own lie over the base's; the table
    goes where a figure for every foil is written.
    """
    found: dict[str, Any] = {}
    for kind, (key, table) in _TABLES.items():
        is_plain = f"{kind}_width" in changed or f"{kind}_spacing" in changed
        is_whole = getattr(document, key) is not None
        kept = {} if is_plain or is_whole else {row.copper: row for row in getattr(base, table)}
        kept |= {row.copper: row for row in rows[kind]}
        found[table] = tuple(kept[copper] for copper in sorted(kept))
        if is_plain and kind == "coil_trace":
            found["coil_copper"] = None
    return found


def _lines(
    kind: str,
    document: RulesDocument,
    figures: Mapping[str, Figure],
    name: str,
    place: Origin,
    remarks: Remarks,
) -> tuple[FoilLines, ...]:
    """Widths and spacings by foil, from the thinnest; what contradicts itself is a flaw."""
    key = _TABLES[kind][0]
    written: list[TrackRowDocument] | None = getattr(document, key)
    older = [each for each in document.by_foil if each.rpartition("_")[0] in (f"{kind}_width", f"{kind}_spacing")]
    like = (
        key
        if written is not None
        else f"{kind}_width_{min(each.rpartition('_')[2] for each in older)}"
        if older
        else ""
    )
    for one in (f"{kind}_width", f"{kind}_spacing"):
        if like and one in figures:
            said = f"{like} or its like" if older else like
            message = f"it holds for every copper, and {said} for one"
            place.complain(remarks, "SIT009", f"{place.prefix}{one}", message, "keep one of the two")
    if written is not None:
        for each in older:
            message = f"it is a row of {key}, which is given too"
            place.complain(remarks, "SIT009", f"{place.prefix}{each}", message, f"move it into {key}")
        found = list(_rows(key, written, document, name, place, remarks))
    else:
        found = list(_older_rows(kind, older, document, name, place, remarks))
    return tuple(sorted(found, key=lambda row: row.copper))


def _rows(
    key: str, written: list[TrackRowDocument], document: RulesDocument, name: str, place: Origin, remarks: Remarks
) -> Iterator[FoilLines]:
    """The rows of a table."""
    seen: set[float] = set()
    if not 1 <= len(written) <= 20:
        message = f"{len(written)} rows are out of range: 1 to 20"
        place.complain(remarks, "SIT006", f"{place.prefix}{key}", message, "one row a foil, or leave it out")
    for number, row in enumerate(written):
        if row.copper in seen:
            where = f"{place.prefix}{key}.{number}.copper"
            place.complain(remarks, "SIT009", where, "a second row for the same copper", "keep one of the two")
        seen.add(row.copper)
        pair = {f"{key}.{number}.{what}": getattr(row, what) for what in ("width", "spacing")}
        yield _row(row.copper, pair, document, name, place)


def _older_rows(
    kind: str, keys: list[str], document: RulesDocument, name: str, place: Origin, remarks: Remarks
) -> Iterator[FoilLines]:
    """Rows that are written as two keys each, with the foil in their names."""
    for foil in dict.fromkeys(key.rpartition("_")[2] for key in keys):
        pair = (f"{kind}_width_{foil}", f"{kind}_spacing_{foil}")
        lone = [each for each in pair if each not in document.by_foil]
        if lone:
            other = pair[1] if lone[0] == pair[0] else pair[0]
            message = f"it goes with {lone[0]}, which is missing"
            place.complain(remarks, "SIT003", f"{place.prefix}{other}", message, "give both")
            continue
        figures = {each: document.by_foil[each] for each in pair}
        yield _row(parse_quantity(foil, "length"), figures, document, name, place)


def _row(copper: float, pair: Mapping[str, Figure], document: RulesDocument, name: str, place: Origin) -> FoilLines:
    """A row of width and spacing, each by the key that it stands at."""
    width, spacing = (figure.value for figure in pair.values())
    sources = (_source(key, figure, document, place) for key, figure in pair.items())
    return FoilLines(copper, width, spacing, *sources, *(_holder(key, name, place) for key in pair))


def _holder(field: str, name: str, place: Origin) -> str:
    """The profile that a figure stands in, and its line there if it is a user's."""
    if place.installed:
        return name
    line = place.source.locate(f"{place.prefix}{field}")[0]
    if place.chain:
        return f"{name} ({place.label} line {line})"
    is_named = f"{place.prefix}name" in place.source.keys
    return f"{name if is_named else 'the spec'} (line {line})"


def _source(key: str, figure: Figure, document: RulesDocument, place: Origin) -> str:
    """Where a figure comes from: what is said of it, after the file and line that it stands in; marked if not seen."""
    said = figure.source or document.source
    if place.chain:
        line = place.source.locate(key)[0]
        own = figure.source or (document.source if "source" in place.source.keys else "")
        said = f"{place.label} line {line}" + (f": {own}" if own else "")
    return said if figure.is_verified else UNVERIFIED + said
