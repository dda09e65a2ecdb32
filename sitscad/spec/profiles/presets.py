"""The presets: stack-ups, fabricators' rules, connectors, jaws and materials, read from `sitscad/data` by name.

A new preset is a file (or, for materials, a row) in that directory and no code. Every figure there names its source,
and says whether that source was seen (`verified`) or not (`unverified`); unverified ones are marked in the values.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from sitscad.spec.converter import Converter
from sitscad.spec.design_rules import DesignRules, FoilLines
from sitscad.spec.materials import Conductor, ElastomerMaterial, Finish
from sitscad.spec.sensor import Chip, Connector, Jaw
from sitscad.spec.stackup import LayerKind, StackLayer, Stackup
from sitscad.units import parse_quantity

DATA = Path(__file__).parents[2] / "data"

Row = Mapping[str, str]

_FOLDERS = {"stackup": "stackups", "rules": "fabricators", "connector": "connectors", "jaw": "jaws"}
_TABLES = {
    "conductor": "conductors", "dielectric": "dielectrics", "elastomer": "elastomers", "chip": "chips",
    "converter": "converters",
}  # fmt: skip


@cache
def names(kind: str) -> tuple[str, ...]:
    """The presets of a kind, sorted: stackup, rules, connector, jaw, material kinds, chip, converter, file naming."""
    if kind == "file naming":
        return tuple(sorted({row["naming"] for row in _read(DATA / "archive_names.csv")}))
    if kind in _FOLDERS:
        return tuple(sorted(path.stem for path in (DATA / _FOLDERS[kind]).glob("*.csv")))
    return tuple(sorted(_table(_TABLES[kind])))


@cache
def stackup(name: str) -> Stackup:
    """A stack-up preset; raises KeyError where there is none of that name."""
    rows = _rows("stackup", name)
    extra = {row["kind"]: row for row in rows if row["kind"] in ("plating", "copper-sigma", "note")}
    layers = tuple(
        StackLayer(
            LayerKind(row["kind"]),
            parse_quantity(row["thickness"], "length"),
            row["material"],
            None if row["kind"] == "copper" else permittivity(row["material"]),
            row["made_of"],
        )
        for row in rows
        if row["kind"] not in extra
    )
    sources = "; ".join(dict.fromkeys(_source(row) for row in rows))
    return Stackup(name, layers, sources, _thickness(extra, "plating") or 0.0, _thickness(extra, "copper-sigma"))


def _thickness(rows: Mapping[str, Row], kind: str) -> float | None:
    return parse_quantity(rows[kind]["thickness"], "length") if kind in rows else None


_LENGTHS = (
    "trace_width", "trace_spacing", "via_drill", "annular_ring", "hole_to_hole", "drill_to_copper", "copper_to_edge",
    "coverlay_web", "coverlay_opening_to_trace", "outline_tolerance", "registration", "inside_radius",
    "finger_lap", "pad_lap", "coverlay_lap", "hole_to_step",
)  # fmt: skip


@cache
def design_rules(name: str) -> DesignRules:
    """A fabricator's design rules; raises KeyError where there is no such preset.

    What a house does not state comes from the profile that its row ``based_on`` names, and says so in its source.
    """
    rows, base = _fields("rules", name), None
    if "based_on" in rows:
        base = design_rules(rows["based_on"]["value"])
    found: dict[str, Any] = {
        field: parse_quantity(rows[field]["value"], "length") for field in _LENGTHS if field in rows
    }
    found |= {field: _sides(rows[field]["value"]) for field in ("part_size", "panel_size") if field in rows}
    found |= _ruled(name, rows, base)
    base = _as_base(base) if base else None
    found["holders"] = {**(base.holders if base else {}), **dict.fromkeys(rows, name)}
    own = {field: _source(row) for field, row in rows.items() if field != "based_on"}
    found["sources"] = {**(base.sources if base else {}), **own}
    found["source"] = f"design rules {name}, each figure with its own source"
    found["checked_on"] = rows["checked_on"]["value"]
    rules = replace(base, name=name, **found) if base else DesignRules(name=name, **found)
    thinnest = (rules.track_lines or rules.coil_lines)[:1]
    return rules.for_foil(thinnest[0].copper) if thinnest else rules


def _as_base(rules: DesignRules) -> DesignRules:
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


def _ruled(name: str, rows: Mapping[str, Row], base: DesignRules | None) -> dict[str, Any]:
    """What goes by copper thickness, by number of layers or by material, and the words; only what the rows state."""
    found: dict[str, Any] = {} if base else {"coil_trace_width": None, "coil_trace_spacing": None}
    found |= {f"{kind}_lines": lines for kind in ("track", "coil") if (lines := _lines(name, rows, kind))}
    if "track_lines" in found:
        thinnest = found["track_lines"][0]
        found |= {"trace_width": thinnest.width, "trace_spacing": thinnest.spacing}
    elif "trace_width" in rows:
        found["track_lines"] = ()
    for field, prefix in (("static_bend_ratio", "static_bend_"), ("dynamic_bend_ratio", "dynamic_bend_")):
        found[field] = {**(getattr(base, field) if base else {}), **_bend_ratios(rows, prefix)}
    for field, prefix, of in (
        ("thickness_tolerance", "thickness_tolerance_", int),
        ("stiffened_tolerance", "stiffened_tolerance_", str),
    ):
        stated = {
            of(name.removeprefix(prefix)): parse_quantity(row["value"], "length")
            for name, row in rows.items()
            if name.startswith(prefix)
        }
        found |= {field: {**(getattr(base, field) if base else {}), **stated}} if stated else {}
    if "coil_rule_binding" in rows:
        found["coil_rule_binding"] = rows["coil_rule_binding"]["value"] == "yes"
    return found | ({"file_naming": rows["file_naming"]["value"]} if "file_naming" in rows else {})


def _sides(text: str) -> tuple[float, float]:
    width, _, length = text.partition(" x ")
    return parse_quantity(width, "length"), parse_quantity(length, "length")


def _lines(name: str, rows: Mapping[str, Row], kind: str) -> tuple[FoilLines, ...]:
    """The rows ``coil_trace_width_18um``, ``coil_trace_spacing_18um`` and their like (tracks: without ``coil_``), from
    the thinnest copper.
    """
    prefix = "coil_trace_width_" if kind == "coil" else "trace_width_"
    found = []
    for field, width in rows.items():
        if field.startswith(prefix):
            spacing = rows[field.replace("_width_", "_spacing_")]
            foil, least, gap = (
                parse_quantity(text, "length")
                for text in (field.removeprefix(prefix), width["value"], spacing["value"])
            )
            found.append(FoilLines(foil, least, gap, _source(width), _source(spacing), name, name))
    return tuple(sorted(found, key=lambda row: row.copper))


def _bend_ratios(rows: Mapping[str, Row], prefix: str) -> dict[int, float]:
    return {
        int(field.removeprefix(prefix)): float(row["value"]) for field, row in rows.items() if field.startswith(prefix)
    }


@cache
def connector(name: str) -> Connector:
    """A tail's connector; raises KeyError where there is no such preset."""
    rows = _fields("connector", name)
    lengths = {
        field: parse_quantity(row["value"], "length")
        for field, row in rows.items()
        if field not in ("kind", "positions")
    }
    positions = _numbers(rows["positions"]["value"]) if "positions" in rows else ()
    return Connector(name=name, kind=rows["kind"]["value"], **lengths, positions=positions, source=_sources(rows))


def _numbers(text: str) -> tuple[int, ...]:
    """Whole numbers as a row lists them: ``4-6 8`` is 4, 5, 6 and 8."""
    ends = [part.partition("-") for part in text.split()]
    return tuple(number for first, _, last in ends for number in range(int(first), int(last or first) + 1))


@cache
def chip(name: str) -> Chip:
    """The land pattern of a chip; raises KeyError where there is none of that name."""
    row = _table("chips")[name]
    lengths = {field: parse_quantity(row[field], "length") for field in ("pad_along", "pad_across", "pitch")}
    return Chip(name, **lengths, source=_source(row), model=row["model"])


@cache
def converter(name: str) -> Converter:
    """A converter; raises KeyError where there is none of that name."""
    row = _table("converters")[name]
    addresses = tuple(int(address, 16) for address in row["bus_addresses"].split())
    return Converter(name, row["family"], int(row["channels"]), addresses, row["package"], _source(row))


@cache
def jaw(name: str) -> Jaw:
    """A grasper's jaw; raises KeyError where there is no such preset."""
    rows = _fields("jaw", name)
    lengths = {field: parse_quantity(row["value"], "length") for field, row in rows.items() if field != "material"}
    return Jaw(name=name, material=conductor(rows["material"]["value"]), **lengths, source=_sources(rows))


@cache
def conductor(name: str) -> Conductor:
    """A metal or magnetic sheet; raises KeyError where there is no such material."""
    row = _table("conductors")[name]
    return Conductor(
        name,
        parse_quantity(row["conductivity"], "conductivity"),
        float(row["relative_permeability"]),
        parse_quantity(row["temperature_coefficient"], "temperature coefficient"),
        _source(row),
    )


UNKNOWN_METAL = "#b4bac0"
"""What a conductor is drawn in that is written out in a spec: grey."""


def metal_colour(name: str) -> str:
    """The colour (``#rrggbb``) that a conductor is drawn in."""
    row = _table("conductors").get(name)
    return UNKNOWN_METAL if row is None else row["colour"]


@cache
def elastomer(name: str) -> ElastomerMaterial:
    """A silicone; raises KeyError where there is no such material.

    Where the maker's data sheet and a measurement both give a modulus, the value is their geometric mean and one sigma
    is half the logarithm of their ratio, so that mean * exp(+-sigma) are the two.
    """
    row = _table("elastomers")[name]
    found = [
        parse_quantity(row[field], "pressure")
        for field in ("datasheet_shear_modulus", "measured_shear_modulus")
        if row[field]
    ]
    sigma = float(row["relative_sigma"]) if row["relative_sigma"] else abs(math.log(found[0] / found[-1])) / 2
    return ElastomerMaterial(
        name,
        math.sqrt(found[0] * found[-1]),
        sigma,
        parse_quantity(row["bulk_modulus"], "pressure"),
        row["hardness"],
        float(row["density"]) if row["density"] else None,
        _source(row),
    )


@cache
def finish(name: str) -> Finish:
    """A finish of bare contacts; raises KeyError where there is none of that name."""
    row = _table("finishes")[name]
    electrolytic, plugged, soldered = (row[field] == "yes" for field in ("electrolytic", "plugged", "soldered"))
    return Finish(name, row["job_name"], row["words"], electrolytic, plugged, soldered, _source(row))


@cache
def stock_stiffeners() -> tuple[tuple[float, float], ...]:
    """Films of polyimide and adhesives (m) that stiffeners are made of: every film with every adhesive, thin first."""
    rows = _read(DATA / "stiffeners.csv")
    films, adhesives = (
        [parse_quantity(row["thickness"], "length") for row in rows if row["part"] == part]
        for part in ("film", "adhesive")
    )
    return tuple(sorted(((film, glue) for film in films for glue in adhesives), key=lambda pair: (sum(pair), pair[1])))


def permittivity(material: str) -> float:
    """Relative permittivity of a dielectric; raises KeyError where there is no such material."""
    return float(_table("dielectrics")[material]["relative_permittivity"])


def unverified_rows(kind: str, name: str) -> tuple[tuple[str, str, str], ...]:
    """Of a preset's rows those whose source was not seen: field, value, source; none for a name without a preset."""
    if name not in names(kind):
        return ()
    rows = _rows(kind, name) if kind in _FOLDERS else (_table(_TABLES[kind])[name],)
    return tuple(
        (row.get("field") or row.get("kind") or "", row.get("value") or row.get("thickness") or "", row["source"])
        for row in rows
        if row.get("status", "verified") != "verified"
    )


@cache
def _rows(kind: str, name: str) -> tuple[Row, ...]:
    if name not in names(kind):
        raise KeyError(name)
    return _read(DATA / _FOLDERS[kind] / f"{name}.csv")


def _fields(kind: str, name: str) -> dict[str, Row]:
    return {row["field"]: row for row in _rows(kind, name)}


@cache
def _table(stem: str) -> dict[str, Row]:
    return {row["name"]: row for row in _read(DATA / f"{stem}.csv")}


def _read(path: Path) -> tuple[Row, ...]:
    with path.open(encoding="utf-8", newline="") as stream:
        return tuple(csv.DictReader(stream))


def _source(row: Row) -> str:
    return row["source"] if row["status"] == "verified" else f"unverified: {row['source']}"


def _sources(rows: Mapping[str, Row]) -> str:
    return "; ".join(f"{field}: {_source(row)}" for field, row in rows.items())
