"""Presets read from `sitscad/data` by name: stack-ups, design rules, connectors, jaws and materials.

A new preset needs no code: it is a file in that folder, or for materials a row of a table. Each figure has a source and
a status: `verified` if somebody has checked the source, else `unverified`. The source of an unverified figure is marked
as such. Functions raise KeyError for an unknown name. The module also lists the unverified figures that a design uses.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cache
from typing import Any

from sitscad.basics.record import record
from sitscad.basics.units import parse_quantity, show
from sitscad.data import UNVERIFIED, DataError, Row, cited, cited_by_field
from sitscad.data import is_unverified as is_unseen
from sitscad.data import rows as read_rows
from sitscad.kernels.converters.conversion import conversion_law
from sitscad.kernels.converters.converter import Converter
from sitscad.spec.circuit import MASK, Chip, Connector, LayerKind, Plating, StackLayer, Stackup
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.format.kinds import FOLDERS, TABLES
from sitscad.spec.format.kinds import names as names
from sitscad.spec.format.section import WRITTEN_SOURCE
from sitscad.spec.materials import (
    AT_DOUBLE,
    NEO_HOOKEAN,
    TO_30_PERCENT,
    Adhesive,
    Casting,
    Conductor,
    ElastomerMaterial,
    Finish,
    neo_hookean_ratio,
)
from sitscad.spec.mount import LEVEL, Hole, HolePattern, Jaw
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.thermistor import DigitalRegisters, ThermistorPart

ADHESIVE_PER_COPPER = 25.0 / 35.0
"""Smallest thickness of a coverlay's adhesive, divided by the thickness of the copper that it embeds.

The rule is a thousandth of an inch (25 um) for each ounce of copper (35 um): SMT007 Magazine, August 2019, page 55,
American Standard Circuits. PCBWay lays 25 um on 18 and 35 um foil (Stack-up for FPC).
"""

COVERLAY_FILM = "polyimide-coverlay"
"""Material name of a coverlay that is a polyimide film with adhesive."""


def least_adhesive(copper: float) -> float:
    """Return the smallest adhesive thickness (m) of a coverlay over copper of thickness `copper` (m)."""
    return ADHESIVE_PER_COPPER * copper


@cache
def coverlay_films() -> tuple[tuple[float, float], ...]:
    """Return (polyimide, adhesive), both thicknesses in m, of the coverlays in stock, the thinnest coverlay first."""
    stock = [(_length(row, "film"), _length(row, "adhesive")) for row in read_rows("coverlays")]
    return tuple(sorted(stock, key=lambda pair: (sum(pair), pair[0])))


def film_text(film: float, adhesive: float) -> str:
    """Return a text that describes a coverlay. `film` and `adhesive` are the thicknesses (m) of its two parts."""
    return f"{show(film, 'm')} polyimide + {show(adhesive, 'm')} adhesive"


def best_film(least: float) -> tuple[float, float]:
    """Return (polyimide, adhesive; m) of the thinnest coverlay in stock with at least `least` (m) of adhesive.

    If none has enough adhesive, return the coverlay with the most adhesive.
    """
    filling = [pair for pair in coverlay_films() if pair[1] >= least - 1e-9]
    return filling[0] if filling else max(coverlay_films(), key=lambda pair: pair[1])


def with_stock_coverlays(stackup: Stackup) -> Stackup:
    """Return the stack-up with film coverlays replaced by stock films that suit the copper below them.

    `best_film` chooses each film. Coverlays of other materials are not changed.
    """
    layers = list(stackup.layers)
    for side, layer, copper in stackup.covers:
        if layer.material == COVERLAY_FILM:
            film, adhesive = best_film(least_adhesive(copper.thickness))
            layers[0 if side == "top" else -1] = replace(
                layer, thickness=film + adhesive, adhesive=adhesive, made_of=film_text(film, adhesive)
            )
    return replace(stackup, layers=tuple(layers))


@cache
def stackup(name: str) -> Stackup:
    """Return the stack-up that has the preset name `name`, plated in one step, with coverlay films from stock.

    In the preset's table, row ``plated`` names the method of plating. Rows ``copper`` state the thickness of the foil.
    If the fabricator's plating is not verified, they state the thickness of the finished copper.
    """
    rows = _rows("stackup", name)
    extra = {row["kind"]: row for row in rows if row["kind"] in ("plating", "plated", "note")}
    layers = []
    for row in rows:
        kind, material = row["kind"], row["material"]
        if kind not in extra:
            relative = None if kind == "copper" else permittivity(material)
            thickness = 0.0 if row["thickness"] == "auto" else _length(row, "thickness")
            layers.append(StackLayer(LayerKind(kind), thickness, material, relative, row["made_of"]))
    sources = "; ".join(dict.fromkeys(cited(row) for row in rows))
    is_stated = extra["plating"]["status"] == "verified"
    method = Plating(extra["plated"]["made_of"]) if "plated" in extra else Plating.PANEL
    foils = Stackup(name, tuple(layers), sources, _length(extra["plating"], "thickness"), is_stated)
    return with_stock_coverlays(foils.built(method, 0, finished=not is_stated))


@cache
def connector(name: str) -> Connector:
    """Return the connector at the end of the tail that has the preset name `name`."""
    fields = _fields("connector", name)
    lengths = {field: _length(row) for field, row in fields.items() if field not in ("kind", "positions")}
    # numbers of contacts are a list like 4-6 8, which is 4, 5, 6 and 8
    ends = [part.partition("-") for part in fields["positions"]["value"].split()] if "positions" in fields else []
    positions = tuple(number for first, _, last in ends for number in range(int(first), int(last or first) + 1))
    kind, source = fields["kind"]["value"], cited_by_field(fields)
    return Connector(name=name, kind=kind, **lengths, positions=positions, source=source)


@cache
def chip(name: str) -> Chip:
    """Return the land pattern of the chip that has the preset name `name`."""
    row = _table("chips")[name]
    lengths = {field: _length(row, field) for field in ("pad_along", "pad_across", "pitch")}
    return Chip(name, **lengths, source=cited(row), model=row["model"])


BUS_ADDRESSES = range(0x08, 0x78)
"""The 7-bit addresses of I2C that are not reserved (NXP UM10204, 3.1.12)."""


@cache
def converter(name: str) -> Converter:
    """Return the converter that has the preset name `name`.

    Raises `DataError` if the data tables about it contradict each other: its row, the figures of its family, and the
    register map and conversion law that they name.
    """
    row = _table("converters")[name]
    try:
        channels, addresses = int(row["channels"]), tuple(int(each, 16) for each in row["bus_addresses"].split())
    except ValueError as error:
        raise DataError(f"data/converters.csv, {name}: {error}") from error
    if channels < 1 or not addresses or len(set(addresses)) < len(addresses):
        raise DataError(f"data/converters.csv, {name}: no channel, no address, or one address twice")
    if strange := [f"0x{each:02X}" for each in addresses if each not in BUS_ADDRESSES]:
        raise DataError(f"data/converters.csv, {name}: {', '.join(strange)} cannot be a device's address on an I2C bus")
    result = Converter(name, row["family"], channels, addresses, row["package"], cited(row))
    if len(addresses) > len(result.address_nets):
        raise DataError(f"data/converters/{result.family}.csv, address_nets: {len(result.address_nets)} nets for the "
                        f"{len(addresses)} addresses of {name} in data/converters.csv")
    conversion_law(result.source_of("conversion"))
    if result.has_registers and result.covered_flags:
        flags = ", ".join(result.covered_flags)
        raise DataError(f"{result.part}: results of {result.bits} bits take the bits of {flags}: "
                        f"{result.source_of('register_map')} is not the register map of {result.family}")
    return result


@cache
def jaw(name: str) -> Jaw:
    """Return the grasper's jaw that has the preset name `name`."""
    fields = _fields("jaw", name)
    figures: dict[str, Any] = dict(LEVEL)
    for field, row in fields.items():
        if field == "material":
            figures[field] = conductor(row["value"])
        elif field == "opening":
            figures[field] = parse_quantity(row["value"], "angle")
        elif field in ("pocket", "fenestration", "opposing_pocket"):
            length, _, width = row["value"].partition(" x ")
            figures[field] = parse_quantity(length, "length"), parse_quantity(width, "length")
        else:
            figures[field] = _length(row)
    return Jaw(name=name, **figures, source=cited_by_field(fields), preset=name)


def jaw_source(name: str, written: tuple[str, ...]) -> str:
    """Return the text with the sources of a jaw preset's figures, without the figures that a spec states itself.

    `written` are the keys of these figures.
    """
    return cited_by_field({field: row for field, row in _fields("jaw", name).items() if field not in written})


@cache
def hole_pattern(name: str) -> HolePattern:
    """Return the holes of the bench plate that has the preset name `name`.

    If the plate has a grid of holes or holes at its corners, the pattern has a single hole at the origin. Its sizes
    apply to all holes.
    """
    fields = _fields("hole pattern", name)
    grid = _length(fields["grid"]) if "grid" in fields else None
    places: list[tuple[float, float]] = [(0.0, 0.0)]  # for a grid or corners: one hole with its sizes, placed later
    if "circle" in fields:
        radius, count = _length(fields["circle"]) / 2, int(fields["count"]["value"])
        turns = [2.0 * math.pi * i / count for i in range(count)]
        places = [(radius * math.cos(turn), radius * math.sin(turn)) for turn in turns]
    holes = tuple(Hole(place, _length(fields["hole"]), _length(fields["head"])) for place in places)
    return HolePattern(name, holes, grid, fields["thread"]["value"], cited_by_field(fields))


@cache
def conductor(name: str) -> Conductor:
    """Return the metal or magnetic sheet that has the preset name `name`."""
    row = _table("conductors")[name]
    conductivity, permeability = parse_quantity(row["conductivity"], "conductivity"), row["relative_permeability"]
    coefficient = parse_quantity(row["temperature_coefficient"], "temperature coefficient")
    young = parse_quantity(row["young_modulus"], "pressure") if row["young_modulus"] else None
    return Conductor(name, conductivity, float(permeability), coefficient, young, cited(row))


UNKNOWN_METAL = "#b4bac0"
"""Drawing colour of a conductor that a spec writes out: grey."""


def metal_colour(name: str) -> str:
    """Return the drawing colour (``#rrggbb``) of a conductor."""
    row = _table("conductors").get(name)
    return UNKNOWN_METAL if row is None else row["colour"]


@cache
def elastomer(name: str) -> ElastomerMaterial:
    """Return a silicone.

    Notes
    -----
    If the table has a modulus from the maker's data sheet and a measured modulus, the result has their geometric mean.
    Its relative standard deviation is half the logarithm of their ratio, so that mean * exp(+-sigma) gives both moduli.
    Both moduli were determined with a neo-Hookean law. If the silicone has an Ogden exponent, they are converted to the
    modulus at small strain.
    """
    row = _table("elastomers")[name]
    exponent = float(row["ogden_exponent"] or NEO_HOOKEAN)
    moduli = [
        parse_quantity(row[field], "pressure") / neo_hookean_ratio(exponent, stretches)
        for field, stretches in (("datasheet_shear_modulus", AT_DOUBLE), ("measured_shear_modulus", TO_30_PERCENT))
        if row[field]
    ]
    mean = math.sqrt(moduli[0] * moduli[-1])
    sigma = float(row["relative_sigma"]) if row["relative_sigma"] else abs(math.log(moduli[0] / moduli[-1])) / 2
    bulk, density = parse_quantity(row["bulk_modulus"], "pressure"), float(row["density"]) if row["density"] else None
    normal, shear, creep = (float(row[field]) for field in ("hysteresis_normal", "hysteresis_shear", "creep"))
    softening, expansion = (
        parse_quantity(row[field], "temperature coefficient")
        for field in ("modulus_temperature_coefficient", "expansion")
    )
    losses = (normal, creep, softening, expansion, shear)
    sources = (cited(row), row["loss_source"])
    return ElastomerMaterial(name, mean, sigma, bulk, row["hardness"], exponent, *losses, density, *sources)


@cache
def casting(name: str) -> Casting | None:
    """Return mixing ratio, pot time and cure time of the silicone `name`. None if the table does not list them."""
    row = _table("casting").get(name)
    if row is None:
        return None
    units = {"pot_min": 60.0, "cure_h": 3600.0}
    pot, cure = (float(row[field]) * unit if row[field] else None for field, unit in units.items())
    return Casting(row["mix"], pot, cure, cited(row))


@cache
def finish(name: str) -> Finish:
    """Return the finish of bare contacts that has the preset name `name`."""
    row = _table("finishes")[name]
    electrolytic, plugged, soldered = (row[field] == "yes" for field in ("electrolytic", "plugged", "soldered"))
    return Finish(name, row["job_name"], row["words"], electrolytic, plugged, soldered, cited(row))


@cache
def adhesive(name: str) -> Adhesive:
    """Return the adhesive for gluing the pieces that has the preset name `name`."""
    row = _table("adhesives")[name]
    viscosity, open_time, set_time = (
        float(row[field]) if row[field] else None for field in ("viscosity_pa_s", "open_s", "set_s"))
    return Adhesive(name, row["product"], _length(row, "line"), _length(row, "tolerance"), row["primer"],
                    row["bonds_silicone"] == "yes", viscosity, open_time, set_time, float(row["cure_s"]),
                    row["inhibitor"], cited(row))


@cache
def thermistor(name: str) -> ThermistorPart:
    """Return the temperature sensor that has the preset name `name`."""
    row = _table("thermistors")[name]
    resistance = parse_quantity(row["resistance"], "resistance") if row["resistance"] else None
    relative, b_relative, error = (float(row[each] or 0.0) for each in ("resistance_tolerance", "b_tolerance", "error"))
    address, temperature, identity, identity_value = (
        int(row[each] or "0", 0) for each in ("address", "temperature", "identity", "identity_value"))
    registers = (DigitalRegisters(address, temperature, float(row["scale"]), identity, identity_value)
                 if row["scale"] else None)
    return ThermistorPart(name, resistance, relative, float(row["b"]) if row["b"] else None, b_relative, error,
                          float(row["noise"]), registers, row["package"], row["product"],
                          chip(row["chip"]) if row["chip"] else None,
                          parse_quantity(row["height"], "length") if row["height"] else 0.0, cited(row))


@cache
def compensation_figure(name: str) -> float:
    """Return the value of the row `name` of `data/temperature_compensation.csv`, in the unit of this row."""
    return float(_table("temperature_compensation")[name]["value"])


@cache
def cures_by_platinum(name: str) -> bool:
    """Whether a platinum catalyst cures the silicone `name`. False for silicones that are not in the table.

    Amines, tin and sulphur prevent the cure of such a silicone.
    """
    row = _table(TABLES["elastomer"]).get(name)
    return row is not None and row["cure"] == "platinum"


@cache
def stock_stiffeners() -> tuple[tuple[float, float], ...]:
    """Return (film, adhesive), both thicknesses in m, of all polyimide stiffeners in stock, the thinnest first.

    Each film is combined with each adhesive.
    """
    rows = read_rows("stiffeners")
    films, adhesives = (
        [_length(row, "thickness") for row in rows if row["part"] == part] for part in ("film", "adhesive")
    )
    return tuple(sorted(((film, glue) for film in films for glue in adhesives), key=lambda pair: (sum(pair), pair[1])))


def permittivity(material: str) -> float:
    """Return the relative permittivity of a dielectric."""
    return float(_table("dielectrics")[material]["relative_permittivity"])


@cache
def dielectric_roles(material: str) -> tuple[str, ...]:
    """Return the uses of a dielectric. A material that is not in the table has all uses except ``rigid``.

    * ``base``: carries copper
    * ``bond``: joins layers
    * ``cover``: lies over the outer copper
    * ``rigid``: does not bend
    """
    row = _table("dielectrics").get(material)
    return ("base", "bond", "cover") if row is None else tuple(row["roles"].split())


def is_rigid(stackup: Stackup) -> bool:
    """Whether the stack-up contains a dielectric that does not bend, like FR4."""
    films = (layer.material for layer in stackup.layers if layer.kind is LayerKind.DIELECTRIC)
    return any("rigid" in dielectric_roles(material) for material in films)


def stackups_with_copper_layers(copper: int, rigid: bool) -> list[str]:
    """Return the names of the installed rigid or flexible stack-ups with at least `copper` copper layers."""
    return [name for name in names("stackup")
            if len(stackup(name).copper) >= copper and is_rigid(stackup(name)) is rigid]


def board_kind(stackup: Stackup) -> str:
    """Return "rigid" or "flexible", the word by which documents describe boards with this stack-up."""
    return "rigid" if is_rigid(stackup) else "flexible"


def cover_name(stackup: Stackup) -> str:
    """Return "solder mask" if all coverlays of a stack-up are solder mask, else "coverlay"."""
    covers = {layer.material for layer in stackup.layers if layer.kind is LayerKind.COVERLAY}
    return "solder mask" if covers == {MASK} else "coverlay"


def unverified_rows(kind: str, name: str) -> tuple[tuple[str, str, str], ...]:
    """Return (field, value, source) of the unverified rows of a preset. Empty if there is no such preset.

    `kind` is the kind of the preset, such as ``stackup``.
    """
    if name not in names(kind):
        return ()
    rows = _rows(kind, name) if kind in FOLDERS else (_table(TABLES[kind])[name],)
    return tuple((row.get("field") or row.get("kind") or "", row.get("value") or row.get("thickness") or "",
                  row["source"]) for row in rows if row.get("status", "verified") != "verified")


def _length(row: Mapping[str, str], field: str = "value") -> float:
    return parse_quantity(row[field], "length")


@cache
def _rows(kind: str, name: str) -> tuple[Row, ...]:
    if name not in names(kind):
        raise KeyError(name)
    return read_rows(f"{FOLDERS[kind]}/{name}")


def _fields(kind: str, name: str) -> dict[str, Row]:
    return {row["field"]: row for row in _rows(kind, name)}


@cache
def _table(stem: str) -> dict[str, Row]:
    return {row["name"]: row for row in read_rows(stem)}


_OF_A_FOIL = re.compile(r"_\d+um$")
"""Pattern of names that end with a foil thickness, such as ``_35um``.

Lists of unverified values omit these names: the value in use has a name without a foil thickness.
"""


@record
class UnverifiedFigure:
    """An unverified figure in three texts: name of preset and field, value (empty if there is none), and source."""

    what: str
    value: str
    source: str


def is_unverified(rules: DesignRules, field: str) -> bool:
    """Whether the value in a field of the fabricator's rules is unverified: nobody has seen its source."""
    return is_unseen(rules.sources.get(field, ""))


def unverified_figures(spec: SensorSpec) -> tuple[UnverifiedFigure, ...]:
    """Return the unverified values that a spec uses, from its design rules and all its presets."""
    rules, figures = spec.fpc.rules, []
    for field, source in rules.sources.items():
        if is_unverified(rules, field) and not _OF_A_FOIL.search(field):
            value = getattr(rules, field, None)
            between = " x " if field in ("part_size", "panel_size", "largest_part") else ", "
            values = value if isinstance(value, tuple) else (value,)
            text = between.join(show(each, "m") if isinstance(each, float) else str(each or "") for each in values)
            figures.append(UnverifiedFigure(f"{rules.name} {field}", text, source.removeprefix(UNVERIFIED)))
    return (*figures, *_unverified_preset_figures(spec))


def _unverified_preset_figures(spec: SensorSpec) -> Iterator[UnverifiedFigure]:
    fpc, mount = spec.fpc, spec.mount
    jaw, holes = spec.jaw, None if mount is None else mount.holes
    metals = [part.material for part in (spec.target, spec.shield) if part is not None]
    metals += [] if spec.metal is None else [spec.metal]
    soft = [part.material for part in (spec.elastomer, spec.encapsulation) if part is not None]
    glue = spec.assembly.adhesive if any((spec.target, spec.elastomer, mount)) else None
    used = [
        ("stackup", fpc.stackup.name),
        ("connector", fpc.tail.connector.name if fpc.tail is not None else ""),
        ("chip", spec.readout.chip.name if spec.readout.chip is not None else ""),
        ("thermistor", spec.readout.thermistor.part.name if spec.readout.thermistor is not None else ""),
        ("jaw", jaw.preset if jaw is not None else ""),
        ("hole pattern", holes.name if holes is not None else ""),
        *(("conductor", name) for name in dict.fromkeys(m.name for m in metals if m.source != WRITTEN_SOURCE)),
        *(("elastomer", name) for name in dict.fromkeys(m.name for m in soft if m.source != WRITTEN_SOURCE)),
        ("adhesive", glue.name if glue is not None else ""),
        *(("dielectric", name) for name in dict.fromkeys(layer.material for layer in fpc.stackup.layers)),
    ]
    for kind, name in used:
        for field, value, source in unverified_rows(kind, name):  # empty for a name without a preset
            if kind == "jaw" and jaw is not None and field in jaw.written:
                continue
            if kind == "conductor":  # the two figures that all responses and losses depend on
                metal = conductor(name)
                value = f"{metal.conductivity / 1e6:.4g} MS/m, relative permeability {metal.relative_permeability:g}"
            yield UnverifiedFigure(f"{kind} {name} {field}".strip(), value, source)
