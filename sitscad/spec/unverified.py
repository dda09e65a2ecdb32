"""Which figures of a design stand on a source that nobody has seen: what the data mark so, and the design uses."""

from __future__ import annotations

import re
from collections.abc import Iterator

from sitscad import data
from sitscad.record import record
from sitscad.spec import presets
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.section import WRITTEN_SOURCE
from sitscad.spec.sensor import SensorSpec
from sitscad.units import show

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
        if not data.is_unverified(source) or _OF_A_FOIL.search(field):
            continue
        value = getattr(rules, field, None)
        between = " x " if field in ("part_size", "panel_size") else ", "
        values = value if isinstance(value, tuple) else (value,)
        text = between.join(show(each, "m") if isinstance(each, float) else str(each or "") for each in values)
        yield UnverifiedFigure(f"{rules.name} {field}", text, source.removeprefix(data.UNVERIFIED))


def _of_presets(spec: SensorSpec) -> Iterator[UnverifiedFigure]:
    fpc, mount = spec.fpc, spec.mount
    jaw, holes = (mount.jaw, mount.holes) if mount is not None else (None, None)
    metals = [part.material for part in (spec.target, spec.shield) if part is not None]
    metals += [mount.metal] if mount is not None and mount.metal is not None else []
    soft = [part.material for part in (spec.elastomer, spec.encapsulation) if part is not None]
    glue = spec.assembly.adhesive if any((spec.target, spec.elastomer, mount)) else None
    used = [
        ("stackup", fpc.stackup.name),
        ("connector", fpc.tail.connector.name if fpc.tail is not None else ""),
        ("chip", spec.readout.chip.name if spec.readout.chip is not None else ""),
        ("jaw", jaw.preset if jaw is not None else ""),
        ("hole pattern", holes.name if holes is not None else ""),
        *(("conductor", name) for name in dict.fromkeys(m.name for m in metals if m.source != WRITTEN_SOURCE)),
        *(("elastomer", name) for name in dict.fromkeys(m.name for m in soft if m.source != WRITTEN_SOURCE)),
        ("adhesive", glue.name if glue is not None else ""),
        *(("dielectric", name) for name in dict.fromkeys(layer.material for layer in fpc.stackup.layers)),
    ]
    for kind, name in used:
        for field, value, source in presets.unverified_rows(kind, name):  # none of a name without a preset
            if kind == "jaw" and jaw is not None and field in jaw.written:
                continue
            if kind == "conductor":  # both figures that every response and loss near it depend on
                metal = presets.conductor(name)
                value = f"{metal.conductivity / 1e6:.4g} MS/m, relative permeability {metal.relative_permeability:g}"
            yield UnverifiedFigure(f"{kind} {name} {field}".strip(), value, source)
