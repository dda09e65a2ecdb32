"""Which figures of a design stand on a source that nobody has seen: what the data mark so, and the design uses."""

from __future__ import annotations

import re
from collections.abc import Iterator

from sitscad import data
from sitscad.record import record
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.materials import Adhesive
from sitscad.spec.profiles import presets
from sitscad.spec.sensor import SensorSpec
from sitscad.units import show

WRITTEN = "the spec"
"""Where a figure comes from that the user wrote."""

_OF_A_FOIL = re.compile(r"_\d+um$")
"""Rows for foils that the design may not have: the figure that holds stands without its foil."""


@record
class UnverifiedFigure:
    """A figure in words: whose it is, its value as far as it is one, and what its source says."""

    what: str
    value: str
    source: str


def unverified_figures(spec: SensorSpec) -> tuple[UnverifiedFigure, ...]:
    """The unverified figures of the design rules, stack-up, connector, chip, jaw and materials that a spec uses."""
    return (*_of_rules(spec.fpc.rules), *_of_presets(spec))


def is_unverified(rules: DesignRules, field: str) -> bool:
    """Whether one figure of the fabricator's rules stands on a source that was not seen."""
    return data.is_unverified(rules.sources.get(field, ""))


def _of_rules(rules: DesignRules) -> Iterator[UnverifiedFigure]:
    for field, source in rules.sources.items():
        if data.is_unverified(source) and not _OF_A_FOIL.search(field):
            value = getattr(rules, field, None)
            text = show(value, "m") if isinstance(value, float) else _sides(field, value)
            yield UnverifiedFigure(f"{rules.name} {field}", text, source.removeprefix(data.UNVERIFIED))


def _sides(field: str, value: object) -> str:
    if not isinstance(value, tuple):
        return str(value or "")
    between = " x " if field in ("part_size", "panel_size") else ", "
    return between.join(show(each, "m") if isinstance(each, float) else str(each) for each in value)


def _glue(spec: SensorSpec) -> Adhesive | None:
    """What the pieces are glued with, where anything is glued."""
    return spec.assembly.adhesive if any((spec.target, spec.elastomer, spec.mount)) else None


def _of_presets(spec: SensorSpec) -> Iterator[UnverifiedFigure]:
    """The figures of presets in use that nobody has verified."""
    fpc, mount = spec.fpc, spec.mount
    jaw = mount.jaw if mount is not None else None
    metals = [part.material for part in (spec.target, spec.shield) if part is not None]
    metals += [mount.metal] if mount is not None and mount.metal is not None else []
    soft = [part.material for part in (spec.elastomer, spec.encapsulation) if part is not None]
    used = [
        ("stackup", fpc.stackup.name),
        *(("connector", tail.connector.name) for tail in (fpc.tail,) if tail is not None),
        *(("chip", chip.name) for chip in (spec.readout.chip,) if chip is not None),
        *(("jaw", each.preset) for each in (jaw,) if each is not None and each.preset),
        *(("hole pattern", holes.name) for holes in (mount.holes if mount is not None else None,) if holes is not None),
        *(("conductor", name) for name in dict.fromkeys(m.name for m in metals if m.source != WRITTEN)),
        *(("elastomer", name) for name in dict.fromkeys(m.name for m in soft if m.source != WRITTEN)),
        *(("adhesive", glue.name) for glue in (_glue(spec),) if glue is not None),
        *(("dielectric", name) for name in dict.fromkeys(layer.material for layer in fpc.stackup.layers)),
    ]
    for kind, name in used:
        for field, value, source in presets.unverified_rows(kind, name):
            if kind == "jaw" and jaw is not None and field in jaw.written:
                continue
            taken = value if kind != "conductor" else _metal(name)
            yield UnverifiedFigure(f"{kind} {name} {field}".strip(), taken, source)


def _metal(name: str) -> str:
    """What a metal is taken as: both figures that every response and loss near it depend on."""
    metal = presets.conductor(name)
    return f"{metal.conductivity / 1e6:.4g} MS/m, relative permeability {metal.relative_permeability:g}"
