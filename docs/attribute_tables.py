"""The tables of attributes in docs/library.md, made from the classes; ``pages.py`` writes them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import fields
from functools import cached_property
from typing import Any, get_args, get_type_hints

import spec_reference

from sitscad.basics.units import SI_UNITS
from sitscad.layout.board import Capacitor, Coil, Layout, Pad, Stiffener, Trace, Via, Winding
from sitscad.spec.coil import ArraySpec, CoilPlacement
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.format.kinds import Kind, Pair, UnitValue
from sitscad.spec.format.section import SpecValue
from sitscad.spec.sensor import SensorSpec, SpecDocument

ELSEWHERE = (
    ("sitscad", "no attribute: the version of the format is always 1"),
    ("array.centres.0", "`spec.array.placements[0].centre`"),
    ("assembly.tolerances.board", "`spec.assembly.tolerance('board')`: None if the part's process sets it"),
    ("fpc.stackup.0.copper", "`spec.fpc.stackup.layers[0].thickness`, `.kind`, `.material`"),
    ("fpc.tail.bend.at, .angle, .direction, .radius", "`spec.fpc.tail.bend_at`, `.bend_angle`, `.bend_direction`, "
     "`.bend_radius`; `.bend` is the kind"),
    ("fpc.rules.trace_width.source", "`spec.fpc.rules.sources['trace_width']`"),
    ("fpc.rules.trace_width_18um", "`spec.fpc.rules.track_lines`, `.coil_lines`"),
    ("loads.press.normal", "`spec.loads[0].normal`: load cases by their `name`"),
    ("mount.holes.0.diameter", "`spec.mount.holes.holes[0].diameter`"),
    ("mount.datum, mount.jaw.datum", "as written; `spec.mount.step.datum` has the value in use"),
)
"""Keys whose values lie in tuples and other objects, and where each is read."""

HELD = {
    "source": "`text`, `path`, `defaults`: the file as read",
    "issue": "`revision`, `part_number`, `date`",
    "loads": "load cases: `name`, `normal` (N), `shear` (N), `offset` (m), `opening` (rad)",
}
"""Contents of fields of a spec that are no section."""

DRAWN: tuple[type, ...] = (Coil, Winding, CoilPlacement, Trace, Via, Pad, Capacitor, Stiffener)
"""Classes of the parts of a layout."""


def tables() -> str:
    """Return the tables of attributes of `SensorSpec` and `Layout`, and of keys that are read elsewhere."""
    parts = (
        ("Attributes of a spec", "Every key of [the format](spec.md) is an attribute under its own name, in SI units, "
         "unless the next table names it. A section that is left out is None.", _of_spec()),
        ("Keys that are read elsewhere", "These keys have another attribute. Python's error for the expected name "
         "also states it.", _elsewhere()),
        ("Attributes of a layout", "Lengths are in metres.", _of_layout()),
        ("Attributes of the parts of a layout", "The docstrings state the units.", _of_drawn()),
    )
    return "\n".join(f"## {title}\n\n{about}\n\n{_table(rows)}" for title, about, rows in parts)


def _table(rows: Iterator[tuple[str, ...]]) -> str:
    heads, *rest = rows
    return "".join(f"| {' | '.join(row)} |\n" for row in (heads, ("---",) * len(heads), *rest))


def _of_spec() -> Iterator[tuple[str, ...]]:
    """Each field of a spec with the attributes that it has."""
    yield "attribute", "holds"
    for one in fields(SensorSpec):
        key = SpecDocument.keys.get(one.name)
        section = spec_reference.section_of(key.kind) if key is not None and one.name != "loads" else None
        if one.name == "array":
            held = ", ".join(f"`{field.name}`" for field in fields(ArraySpec))
        elif section is not None:
            held = ", ".join(f"`{attribute}`{_unit(section.keys[name].kind)}"
                             for name, attribute in section.attributes.items() if attribute != "written_inner")
        else:
            held = HELD.get(one.name, key.about if key is not None else "")
        yield f"`spec.{one.name}`", held


def _unit(kind: Kind) -> str:
    """Return the SI unit of a quantity in brackets. Empty if the value is none."""
    inner = getattr(kind, "other", kind)
    inner = getattr(inner, "entry", None) or inner
    inner = inner.length if isinstance(inner, Pair) else inner
    return f" ({SI_UNITS[inner.dimension]})" if isinstance(inner, UnitValue) else ""


def _elsewhere() -> Iterator[tuple[str, ...]]:
    """Each key whose attribute has another name or place."""
    yield "key", "read"
    places = spec_reference.places_of(SpecDocument)
    owners: dict[type[SpecValue], str] = {SensorSpec: "", ArraySpec: "array.", DesignRules: "fpc.rules."}
    for owner, path in owners.items():
        for key, where in owner.read_instead.items():
            yield f"`{path}{key}`", f"`{where}`"
    for section, (path, *_) in places.items():
        for key, attribute in section.read_instead.items():
            if attribute != "written_inner":
                yield f"`{path}.{key}`", f"`spec.{path.replace('loads.', 'loads[0].')}.{attribute}`"
    for key, where in ELSEWHERE:
        yield f"`{key}`", where


def _of_layout() -> Iterator[tuple[str, ...]]:
    yield "attribute", "holds"
    for one in fields(Layout):
        yield f"`layout.{one.name}`", _type(get_type_hints(Layout)[one.name])
    for name, about in _properties(Layout):
        yield f"`layout.{name}`", about


def _of_drawn() -> Iterator[tuple[str, ...]]:
    yield "class", "attributes"
    for one in DRAWN:
        names = [*(field.name for field in fields(one)), *(name for name, _ in _properties(one))]
        yield f"`{one.__name__}`", ", ".join(f"`{name}`" for name in names)


def _properties(owner: type) -> Iterator[tuple[str, str]]:
    """Each public property of a class with the first sentence of its docstring."""
    for name, value in vars(owner).items():
        if isinstance(value, (property, cached_property)) and (text := value.__doc__):
            yield name, re.split(r"(?<=[.;])\s", " ".join(text.split()))[0].rstrip(";")


def _type(hint: Any) -> str:
    """Describe a type in words: ``tuple[Coil, ...]`` is "`Coil`, several"."""
    inner = [one for one in get_args(hint) if one not in (type(None), Ellipsis)]
    if hint == tuple[float, float, float, float]:
        return "x0, y0, x1, y1 (m)"
    if not inner:
        return f"`{hint.__name__}`{' (m)' if hint is float else ''}"
    if getattr(hint, "__origin__", None) is tuple and Ellipsis in get_args(hint):
        return f"`{inner[0].__name__}`, several"
    words = _type(inner[0]) if len(inner) == 1 else "from, to (m)"
    return f"{words}, or None" if type(None) in get_args(hint) else words

