"""The tables of keys in docs/spec.md, made from the declarations that read the spec; ``pages.py`` writes them."""

from __future__ import annotations

import re
from collections.abc import Iterator

from sitscad.basics.units import show
from sitscad.checks.usual_ranges import COMPUTED_VALUES, usual_ranges
from sitscad.spec import presets
from sitscad.spec.circuit import LayerKind, Stackup
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.format.kinds import (
    Boolean,
    Choice,
    Either,
    FileName,
    Kind,
    Layers,
    Number,
    NumberOrList,
    Pair,
    Preset,
    ProfileName,
    Several,
    Sourced,
    Special,
    Text,
    UnitValue,
)
from sitscad.spec.format.section import Key, ListOf, NameOr, Part, Section, section_of
from sitscad.spec.profiles import installed_rules
from sitscad.spec.sensor import SpecDocument
from sitscad.spec.thermistor import ThermistorPart


def reference() -> str:
    """Return the tables of keys: main sections, the figures of presets, then deeper sections."""
    places = places_of(SpecDocument)
    parts = {section: f"## {_title(section, places)}\n\n{_about(section, paths)}\n\n{_table(section, places)}\n"
             for section, paths in places.items()}
    first = [part for section, part in parts.items() if "." not in places[section][0]]
    return "\n".join((*first, *_presets_in_figures(), *(part for part in parts.values() if part not in first)))


def _presets_in_figures() -> Iterator[str]:
    """Yield one table of figures for each kind of preset: silicones, stack-ups, fabricators and jaws."""
    silicones = [presets.elastomer(name) for name in presets.names("elastomer")]
    yield _figures(
        "Silicones with a preset",
        "Names for `elastomer.material` and `encapsulation.material`, the softest first. The modulus is the mean of "
        "data sheet and measurement if both were found.",
        ("name", "shear modulus", "one sigma", "Ogden exponent", "Shore hardness"),
        [(m.name, show(m.shear_modulus, "Pa", 3), f"{100.0 * m.shear_modulus_sigma:.0f} %",
          f"{m.ogden_exponent:.2f}", m.hardness)
         for m in sorted(silicones, key=lambda m: (m.shear_modulus, m.name))],
    )
    stackups = [presets.stackup(name) for name in presets.names("stackup")]
    yield _figures(
        "Stack-ups with a preset",
        "Names for `fpc.stackup`, with their layers from the top. Finished copper assumes the plain build: its outer "
        "layers are plated once over the whole panel. If only holes and pads are plated, it is the foil. OSH Park does "
        "not state whether its 35 um include plating.",
        ("name", "foil", "finished copper", "dielectric between", "in all"),
        [(s.name, _foils(s), _thicknesses(s, LayerKind.COPPER), _thicknesses(s, LayerKind.DIELECTRIC),
          show(s.thickness, "m", 4))
         for s in stackups],
    )
    houses = [installed_rules(name) for name in presets.names("rules")]
    yield _figures(
        "Fabricators with a profile",
        "Names for `fpc.rules`. The figures were read from the named pages on the stated day; ask before you order. "
        "Minimum track and gap apply to the thinnest listed copper. The column for coils lists its minimum for each "
        "copper: a coil below it is an error (binding) or a warning (warns) of SIT103. Figures that a fabricator does "
        "not state come from generic-flex. SIT131 compares the board with the offer of the fabricator if it is stated. "
        "Every finding names the source of its figure.",
        ("name", "who", "made in", "track / gap", "coil track / gap by foil", "copper layers", "copper",
         "cover, stiffener, finish", "date of reading"),
        [_house(rules) for rules in houses],
    )
    yield _figures(
        "Temperature sensors with a preset",
        "Names for `readout.thermistor.part`. The figures are from memory (unverified): compare with the data sheet.",
        ("name", "product", "package", "resistance at 25 degC", "largest error", "noise, one sigma"),
        [_sensor_figures(presets.thermistor(name)) for name in presets.names("thermistor")],
    )
    jaws = [presets.jaw(name) for name in presets.names("jaw")]
    yield _figures(
        "Jaws with a preset",
        "Names for `mount.jaw`. The figures are typical: measure your own jaw.",
        ("name", "width", "length", "height", "port", "metal"),
        [(j.name, *(show(size, "m") for size in (j.width, j.length, j.height, j.port_diameter)), j.material.name)
         for j in jaws],
    )


def _sensor_figures(part: ThermistorPart) -> tuple[str, ...]:
    """Return the row of one temperature sensor."""
    if part.resistance is None:
        return part.name, part.product, part.package, "-", f"{part.error:g} K", f"{1e3 * part.noise:.3g} mK"
    law = (f"{show(part.resistance, 'ohm')} +-{100.0 * part.resistance_tolerance:g} %, B {part.b:g} K "
           f"+-{100.0 * part.b_tolerance:g} %")
    return part.name, part.product, part.package, law, "-", f"{1e3 * part.noise:.3g} mK"


def _house(rules: DesignRules) -> tuple[str, ...]:
    """Return the row of one fabricator, with a dash for each figure that its page does not state."""
    lines = f"{show(rules.trace_width, 'm', 3)} / {show(rules.trace_spacing, 'm', 3)}"
    counts, foils = rules.layer_counts, rules.foils
    layers = "-" if counts is None else f"{counts[0]} to {counts[-1]}" if len(counts) > 1 else f"{counts[0]}"
    copper = "-" if foils is None else ", ".join(f"{foil * 1e6:g}" for foil in foils) + " um"
    listed = (rules.covers, rules.stiffeners, rules.finishes)
    said = ["no stiffener" if each == () else " or ".join(each) for each in listed if each is not None]
    who = rules.house or "no fabricator: figures that several fabricators publish"
    where = f"{rules.sources['house'] if rules.house else 'one page for each figure'}, {rules.checked_on}"
    return rules.name, who, rules.country or "-", lines, _in_coils(rules), layers, copper, "; ".join(said) or "-", where


def _in_coils(rules: DesignRules) -> str:
    """Return the least track and gap of coiled tracks by the copper they are stated for, and whether they bind."""
    rows = [(line.width, line.spacing, f" at {line.copper * 1e6:g} um") for line in rules.coil_lines]
    if not rows and rules.coil_trace_width is not None and rules.coil_trace_spacing is not None:
        rows = [(rules.coil_trace_width, rules.coil_trace_spacing, "")]
    said = "; ".join(f"{show(width, 'm', 3)} / {show(gap, 'm', 3)}{at}" for width, gap, at in rows)
    return f"{said}, {'binding' if rules.coil_rule_binding else 'warns'}" if said else "-"


def _figures(title: str, about: str, heads: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = [heads, ("---",) * len(heads), *rows]
    return f"## {title}\n\n{about}\n\n" + "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _thicknesses(stackup: Stackup, kind: LayerKind) -> str:
    return ", ".join(f"{layer.thickness * 1e6:.4g}" for layer in stackup.layers if layer.kind is kind) + " um"


def _foils(stackup: Stackup) -> str:
    if not stackup.is_plating_stated:
        return "not stated"
    return ", ".join(f"{layer.foil * 1e6:.4g}" for layer in stackup.copper) + " um"


Places = dict[type[Section], list[str]]


def places_of(section: type[Section], path: str = "", found: Places | None = None) -> Places:
    """Every section with the dotted paths at which it may stand, in the order of the format."""
    found = {} if found is None else found
    found.setdefault(section, []).append(path)
    for name, key in section.keys.items():
        inner = section_of(key.kind)
        if inner is not None:
            places_of(inner, f"{path}.{name}".strip("."), found)
    return found


def _title(section: type[Section], places: Places) -> str:
    paths = places[section]
    if len(paths) == 1:
        return paths[0] or "Top level"
    name = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", section.form.removesuffix("Document")).lower()
    return f"{'An' if name[0] in 'aeiou' else 'A'} {name} written out"


def _about(section: type[Section], paths: list[str]) -> str:
    about = " ".join(section.about().split())
    return about if len(paths) == 1 else f"{about} For {', '.join(f'`{path}`' for path in paths)}."


def _table(section: type[Section], places: Places) -> str:
    rows = ["| key | value | default | meaning |", "| --- | --- | --- | --- |"]
    for name, key in section.keys.items():
        value = _value(key.kind, places).replace("|", "\\|") + _usually(name, places[section])
        rows.append(f"| `{name}` | {value} | {_default(key, _stand_in(section, name))} | {key.about} |")
    for like in section.alike.values():
        rows.append(f"| `{like.example}` and the like | {_value(like.kind, places)} |  | {like.about} |")
    return "\n".join(rows)


def _usually(name: str, paths: list[str]) -> str:
    """Return the usual range of a key. SIT134 warns of values outside of this range."""
    keys = {f"{path}.{name}".strip(".") for path in paths}
    words = [row.words for row in usual_ranges() if row.key in keys and row.value not in COMPUTED_VALUES]
    return f"; usually {words[0]}" if words else ""


def _stand_in(section: type[Section], name: str) -> str:
    """Return the keys that can replace another key, as text. Empty if there are none."""
    other, replaced = section.stands_in
    is_required = name in section.keys and section.keys[name].is_required
    alone = section.alone[:1] if is_required or name in replaced else ()
    return "` or `".join((*((other,) if name in replaced else ()), *alone))


def _default(key: Key, stand_in: str) -> str:
    if key.is_required or stand_in:
        return "**required**" + (f", or `{stand_in}`" if stand_in else "")
    if key.default is None or key.default == "":
        return ""
    return "see its keys" if key.default == {} else f"`{key.default}`"


def _value(kind: Kind, places: Places) -> str:
    """Return the permitted values of a key as text."""
    if isinstance(kind, UnitValue):
        return f"{kind.dimension}, {kind.low} to {kind.high}"
    if isinstance(kind, Pair):
        lengths = f"{kind.length.low} to {kind.length.high} each"
        return f"one length, or `[x, y]`, {lengths}" if kind.single else f"`[x, y]`, {lengths}"
    if isinstance(kind, Number):
        return f"{'whole ' if kind.whole else ''}number, {kind.low:g} to {kind.high:g}"
    if isinstance(kind, NumberOrList):
        return f"{_value(kind.number, places)}, or a list of them, one a layer"
    if isinstance(kind, Several):
        return f"{_value(kind.one, places)}, or a list of them"
    if isinstance(kind, Text):
        return f"text, at most {kind.longest} characters" + (f": {kind.like}" if kind.like else "")
    if isinstance(kind, Choice):
        return ", ".join(f"`{word}`" for word in kind.allowed)
    if isinstance(kind, Preset):
        return ", ".join(f"`{word}`" for word in presets.names(kind.kind))
    if isinstance(kind, ProfileName):
        none = "; `none`" if kind.or_none else ""
        return f"{_value(Preset('rules'), places)}, or a file like `ourshop.yaml`{none}"
    if isinstance(kind, Sourced):
        return _value(kind.figure, places)
    if isinstance(kind, Boolean):
        return "`true` or `false`"
    if isinstance(kind, Layers):
        return f"a count from the top, or a list like `[1, 2]`, up to {kind.most}"
    if isinstance(kind, Either):
        return f"`{kind.word}`, or {_value(kind.other, places)}"
    if isinstance(kind, FileName):
        return "the name of a file in the spec's folder or below"
    if isinstance(kind, Special):
        constant = kind.schema().get("const")
        if any("maxLength" in each for each in kind.schema().get("anyOf", ())):
            return "`[x, y, z]`, or a name"
        if kind.schema().get("type") == "array":
            return "`[columns, rows]`" if "number" not in str(kind.schema()) else "`[lowest, highest]`"
        return f"`{constant}`" if constant is not None else "whole number, or `[nx, ny]`"
    return _section_value(kind, places)


def _section_value(kind: Kind, places: Places) -> str:
    if isinstance(kind, Part):
        title = _title(kind.section, places)
        return f"[{title}](#{re.sub(r'[^a-z0-9 _-]', '', title.lower()).replace(' ', '-')})"
    if isinstance(kind, ListOf):
        return f"list of {_value(kind.entry, places)}"
    assert isinstance(kind, NameOr), kind
    return f"{_value(kind.preset, places)}, or {_value(kind.written, places)}"
