"""The presets: stack-ups, fabricators' rules, connectors, jaws and materials, read from `sitscad/data` by name.

A new preset is a file (or, for materials, a row) in that directory and no code. Every figure there names its source,
and says whether that source was seen (`verified`) or not (`unverified`); unverified ones are marked in the values.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from typing import Any

from sitscad.data import cited, cited_by_field
from sitscad.spec.converter import Converter
from sitscad.spec.materials import (
    AT_DOUBLE,
    NEO_HOOKEAN,
    TO_30_PERCENT,
    Adhesive,
    Conductor,
    ElastomerMaterial,
    Finish,
    Losses,
    stiffened,
)
from sitscad.spec.pieces.mounting import Hole, HolePattern, Jaw
from sitscad.spec.profiles.names import DATA as DATA
from sitscad.spec.profiles.names import FOLDERS, TABLES, read_table
from sitscad.spec.profiles.names import names as names
from sitscad.spec.sensor import Chip, Connector
from sitscad.spec.stackup import LayerKind, Plating, StackLayer, Stackup
from sitscad.units import parse_quantity

Row = Mapping[str, str]


@cache
def stackup(name: str) -> Stackup:
    """A stack-up preset, plated in one step as its rows say; raises KeyError where there is none of that name.

    Rows of copper give its foil. Where it is not verified how much a fabricator plates, they give his finished copper.
    """
    rows = _rows("stackup", name)
    extra = {row["kind"]: row for row in rows if row["kind"] in ("plating", "plated", "note")}
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
    sources = "; ".join(dict.fromkeys(cited(row) for row in rows))
    wall = parse_quantity(extra["plating"]["thickness"], "length")
    is_stated = extra["plating"]["status"] == "verified"
    stackup = Stackup(name, layers, sources, wall, is_stated)
    method = Plating(extra["plated"]["made_of"]) if "plated" in extra else Plating.PANEL
    return stackup.built(method, 0, finished=not is_stated)


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
    return Connector(name=name, kind=rows["kind"]["value"], **lengths, positions=positions, source=cited_by_field(rows))


def _numbers(text: str) -> tuple[int, ...]:
    """Whole numbers as a row lists them: ``4-6 8`` is 4, 5, 6 and 8."""
    ends = [part.partition("-") for part in text.split()]
    return tuple(number for first, _, last in ends for number in range(int(first), int(last or first) + 1))


@cache
def chip(name: str) -> Chip:
    """The land pattern of a chip; raises KeyError where there is none of that name."""
    row = _table("chips")[name]
    lengths = {field: parse_quantity(row[field], "length") for field in ("pad_along", "pad_across", "pitch")}
    return Chip(name, **lengths, source=cited(row), model=row["model"])


@cache
def converter(name: str) -> Converter:
    """A converter; raises KeyError where there is none of that name."""
    row = _table("converters")[name]
    addresses = tuple(int(address, 16) for address in row["bus_addresses"].split())
    return Converter(name, row["family"], int(row["channels"]), addresses, row["package"], cited(row))


@cache
def jaw(name: str) -> Jaw:
    """A grasper's jaw; raises KeyError where there is no such preset."""
    rows = _fields("jaw", name)
    figures = {field: _jaw_figure(field, row["value"]) for field, row in rows.items() if field != "material"}
    material = conductor(rows["material"]["value"])
    return Jaw(name=name, material=material, **figures, source=cited_by_field(rows), preset=name)


def jaw_source(name: str, written: tuple[str, ...]) -> str:
    """Where the figures of a jaw's preset come from that a spec does not write itself."""
    return cited_by_field({field: row for field, row in _fields("jaw", name).items() if field not in written})


@cache
def hole_pattern(name: str) -> HolePattern:
    """The holes of a bench plate; raises KeyError where there is no such preset."""
    rows = _fields("hole pattern", name)
    sizes = {field: parse_quantity(rows[field]["value"], "length") for field in ("hole", "head")}
    grid = parse_quantity(rows["grid"]["value"], "length") if "grid" in rows else None
    places: list[tuple[float, float]] = [(0.0, 0.0)]  # of a grid or the corners: one hole's sizes, placed later
    if "circle" in rows:
        radius, count = parse_quantity(rows["circle"]["value"], "length") / 2, int(rows["count"]["value"])
        turns = [2.0 * math.pi * i / count for i in range(count)]
        places = [(radius * math.cos(turn), radius * math.sin(turn)) for turn in turns]
    holes = tuple(Hole(place, sizes["hole"], sizes["head"]) for place in places)
    return HolePattern(name, holes, grid, rows["thread"]["value"], cited_by_field(rows))


def _jaw_figure(field: str, value: str) -> Any:
    """One figure of a jaw: an angle, a length and a width, or a length."""
    if field == "opening":
        return parse_quantity(value, "angle")
    if field in ("pocket", "fenestration", "opposing_pocket"):
        length, _, width = value.partition(" x ")
        return parse_quantity(length, "length"), parse_quantity(width, "length")
    return parse_quantity(value, "length")


@cache
def conductor(name: str) -> Conductor:
    """A metal or magnetic sheet; raises KeyError where there is no such material."""
    row = _table("conductors")[name]
    return Conductor(
        name,
        parse_quantity(row["conductivity"], "conductivity"),
        float(row["relative_permeability"]),
        parse_quantity(row["temperature_coefficient"], "temperature coefficient"),
        cited(row),
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
    is half the logarithm of their ratio, so that mean * exp(+-sigma) are the two. Both are told as if the silicone were
    neo-Hookean: of one with an Ogden exponent they have stiffened, and the value is what they were at rest.
    """
    row = _table("elastomers")[name]
    exponent = float(row["ogden_exponent"] or NEO_HOOKEAN)
    found = [
        parse_quantity(row[field], "pressure") / stiffened(exponent, stretches)
        for field, stretches in (("datasheet_shear_modulus", AT_DOUBLE), ("measured_shear_modulus", TO_30_PERCENT))
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
        cited(row),
        exponent,
        _losses(row),
    )


def _losses(row: Row) -> Losses:
    """Hysteresis, creep and what temperature does to a silicone."""
    normal, shear, creep = (float(row[field]) for field in ("hysteresis_normal", "hysteresis_shear", "creep"))
    modulus, expansion = (
        parse_quantity(row[field], "temperature coefficient")
        for field in ("modulus_temperature_coefficient", "expansion")
    )
    return Losses(normal, shear, creep, modulus, expansion, row["loss_source"])


@cache
def finish(name: str) -> Finish:
    """A finish of bare contacts; raises KeyError where there is none of that name."""
    row = _table("finishes")[name]
    electrolytic, plugged, soldered = (row[field] == "yes" for field in ("electrolytic", "plugged", "soldered"))
    return Finish(name, row["job_name"], row["words"], electrolytic, plugged, soldered, cited(row))


@cache
def adhesive(name: str) -> Adhesive:
    """What pieces are glued with; raises KeyError where there is none of that name."""
    row = _table("adhesives")[name]
    line, tolerance = (parse_quantity(row[field], "length") for field in ("line", "tolerance"))
    return Adhesive(name, row["product"], line, tolerance, row["primer"], cited(row))


@cache
def stock_stiffeners() -> tuple[tuple[float, float], ...]:
    """Films of polyimide and adhesives (m) that stiffeners are made of: every film with every adhesive, thin first."""
    rows = read_table(DATA / "stiffeners.csv")
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
    rows = _rows(kind, name) if kind in FOLDERS else (_table(TABLES[kind])[name],)
    return tuple(
        (row.get("field") or row.get("kind") or "", row.get("value") or row.get("thickness") or "", row["source"])
        for row in rows
        if row.get("status", "verified") != "verified"
    )


@cache
def _rows(kind: str, name: str) -> tuple[Row, ...]:
    if name not in names(kind):
        raise KeyError(name)
    return read_table(DATA / FOLDERS[kind] / f"{name}.csv")


def _fields(kind: str, name: str) -> dict[str, Row]:
    return {row["field"]: row for row in _rows(kind, name)}


@cache
def _table(stem: str) -> dict[str, Row]:
    return {row["name"]: row for row in read_table(DATA / f"{stem}.csv")}
