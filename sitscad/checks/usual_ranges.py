"""SIT134: values of the spec against their usual ranges (`data/usual_ranges.csv`)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from itertools import groupby
from typing import Any

from sitscad.basics.record import record
from sitscad.basics.units import parse_quantity, show
from sitscad.checks.rules import Rule, Verdict, rule_of, violation_of
from sitscad.data import cited, rows
from sitscad.estimates.design import Design
from sitscad.spec.circuit import LayerKind, Stackup
from sitscad.spec.materials import ElastomerPad
from sitscad.spec.mount import Mount
from sitscad.spec.presets import dielectric_roles
from sitscad.spec.sensor import Requirements


@record
class UsualRange:
    """Usual range of the value at one key of the spec, a row of ``data/usual_ranges.csv``.

    ``key`` is the key to which the finding points. ``value`` is the dotted key of the value, or a name in
    `COMPUTED_VALUES`. ``called`` is the value's name in messages, and ``dimension`` its dimension, for example length.
    ``low`` and ``high`` are the ends of the range in SI units, infinite if an end is open. ``words`` is the range as
    text, and ``source`` its source.
    """

    key: str
    value: str
    called: str
    dimension: str
    low: float
    high: float
    words: str
    source: str


SI = {"length": "m", "inductance": "H", "capacitance": "F", "resistance": "ohm", "force": "N",
      "moment": "N m", "pressure": "Pa",
      "conductivity": "S/m"}
"""SI units of the dimensions that messages show with a prefix, such as mm or kPa."""


@cache
def usual_ranges() -> tuple[UsualRange, ...]:
    """Return all rows of ``data/usual_ranges.csv``."""
    ranges = []
    for row in rows("usual_ranges"):
        low, high, dimension = row["low"], row["high"], row["dimension"]
        bounds = (_parse_bound(low, dimension, -math.inf), _parse_bound(high, dimension, math.inf))
        range_text = f"{low} to {high}" if low and high else f"{high} at most" if high else f"{low} at least"
        value, key = row["value"] or row["key"], row["key"]
        called = COMPUTED_VALUES[value][0] if value in COMPUTED_VALUES else ""
        ranges.append(UsualRange(key, value, called or key, dimension, *bounds, range_text, cited(row)))
    return tuple(ranges)


def _parse_bound(text: str, dimension: str, otherwise: float) -> float:
    if not text:
        return otherwise
    return float(text) if dimension == "number" else parse_quantity(text, dimension)


def _thicknesses(stackup: Stackup, kind: LayerKind, rigid: bool = False) -> list[float]:
    """Return the thicknesses (m) of the stack-up's layers of one kind.

    For dielectrics, they are the rigid layers if `rigid`, otherwise the flexible layers.
    """
    return [layer.thickness for layer in stackup.layers if layer.kind is kind
            and (kind is LayerKind.COPPER or ("rigid" in dielectric_roles(layer.material)) is rigid)]


def _poisson_ratio(pad: ElastomerPad | None) -> float | None:
    """Return Poisson's ratio of the pad from its moduli. None if there is no pad.

    It is (3 K - 2 G) / (6 K + 2 G), with the bulk modulus K and the shear modulus G.
    """
    if pad is None:
        return None
    bulk, shear = pad.material.bulk_modulus, pad.material.shear_modulus
    return (3.0 * bulk - 2.0 * shear) / (6.0 * bulk + 2.0 * shear)


def _required_ratios(needs: Requirements) -> list[float]:
    """Return the ratio of each required error or resolution to the required force or moment of its axis."""
    normal = needs.normal_force
    moments = [each for each in needs.moments if each]
    tilts = {"normal": normal, "shear_x": needs.shear_force, "shear_y": needs.shear_force, "moment_x": needs.moment_x,
             "moment_y": needs.moment_y}
    pairs = [(needs.normal_resolution, normal), (needs.normal_error, normal), (needs.temperature_error, normal),
             (needs.shear_resolution, needs.shear_force), (needs.shear_error, needs.shear_force),
             (needs.moment_resolution, min(moments, default=None)), (needs.moment_error, min(moments, default=None)),
             *((error, normal if isinstance(needs.tilt_error, float) else tilts[name])
               for name, error in needs.tilt_limits().items())]
    return [error / force for error, force in pairs if error is not None and force]


def _hole_coordinates(mount: Mount | None) -> list[float]:
    """Return the coordinates (x, then y, of each hole; m) of a bench plate's holes, from the middle of the board."""
    return [each for hole in (mount.holes.holes if mount and mount.holes else ()) for each in hole.at]


COMPUTED_VALUES: dict[str, tuple[str, Callable[[Design], Any]]] = {
    "coverlays": ("a coverlay", lambda design: _thicknesses(design.spec.fpc.stackup, LayerKind.COVERLAY)),
    "copper": ("finished copper", lambda design: _thicknesses(design.spec.fpc.stackup, LayerKind.COPPER)),
    "dielectrics": ("a dielectric", lambda design: _thicknesses(design.spec.fpc.stackup, LayerKind.DIELECTRIC)),
    "rigid_dielectrics": ("a rigid dielectric",
                          lambda design: _thicknesses(design.spec.fpc.stackup, LayerKind.DIELECTRIC, rigid=True)),
    "foils": ("the copper's foil, before plating,",
              lambda design: [copper.foil for copper in design.spec.fpc.stackup.copper]),
    "board": ("the board's longer side", lambda design: design.layout.size),
    "tolerances": ("", lambda design: dict(design.spec.assembly.tolerances)),
    "poisson": ("Poisson's ratio of the pad by its bulk and shear modulus",
                lambda design: _poisson_ratio(design.spec.elastomer)),
    "plating": ("", lambda design: design.spec.fpc.stackup.plating_thickness or None),
    "permittivities": ("a layer's permittivity", lambda design: [
        one.relative_permittivity for one in design.spec.fpc.stackup.layers if one.relative_permittivity is not None
    ]),
    "asked": ("what an error may be, in parts of the required force,",
              lambda design: _required_ratios(design.spec.requirements)),
    "loads": ("a force of a load case", lambda design: [
        abs(each) for load in design.spec.loads for each in (load.normal or 0.0, *load.shear)
    ]),
    "holes": ("the place of a hole", lambda design: _hole_coordinates(design.spec.mount)),
}
"""Values that are computed from several values of the spec, by their name in the table.

Each has a name in messages (empty: its key) and a function that returns the values.
"""


def unusual_values(design: Design) -> Iterator[Verdict]:
    """Yield a finding for every value outside its usual range. All values of a fabricator's rules share one finding."""
    farthest = []
    for usual in usual_ranges():
        # of the remaining values, the farthest beyond its range
        worst = max(_values_at_key(design, usual.value), key=lambda value: _relative_excess(usual, value), default=None)
        if worst is not None and _relative_excess(usual, worst) > 1e-9:
            farthest.append((usual, worst))
    for section, pairs in groupby(farthest, key=lambda pair: pair[0].key.rpartition(".")[0]):
        if section == "fpc.rules":
            beyond = list(pairs)
            sources = "; ".join(dict.fromkeys(usual.source for usual, _ in beyond))
            yield violation_of(
                "unusual-rules", section, float(len(beyond)), 0.0, source=sources,
                values=[f"{usual.called} {_value_text(value, usual.dimension)} ({usual.words})"
                        for usual, value in beyond],
            )
            continue
        for usual, value in pairs:
            bound = usual.low if value < usual.low else usual.high
            yield violation_of("unusual", usual.key, value, bound, SI.get(usual.dimension), source=usual.source,
                               name=usual.called, value=_value_text(value, usual.dimension), range=usual.words)


def _relative_excess(usual: UsualRange, value: float) -> float:
    """Return the distance by which a value is outside its range, divided by the exceeded end of the range.

    The divisor is 1 if this end is 0. The result is negative if the value is inside the range.
    """
    passed = ((usual.low, usual.low - value), (usual.high, value - usual.high))
    return max(by / (abs(bound) or 1.0) for bound, by in passed if math.isfinite(bound))


def _values_at_key(design: Design, path: str) -> list[float]:
    """Return the numbers at the dotted key `path` of the spec, or the values of this name in `COMPUTED_VALUES`.

    Empty if the spec lacks a part of the key.
    """
    values: Any = design.spec
    if path in COMPUTED_VALUES:
        values = COMPUTED_VALUES[path][1](design)
    else:
        for name in path.split("."):
            values = getattr(values, name) if values is not None else None
    if isinstance(values, Mapping):
        return list(values.values())
    return [] if values is None else list(values) if isinstance(values, (tuple, list)) else [values]


def _value_text(value: float, dimension: str) -> str:
    if dimension in SI:
        return show(value, SI[dimension])
    texts = {"angle": f"{math.degrees(value):.4g} deg", "temperature": f"{value:g} degC",
              "temperature coefficient": f"{value * 1e6:.4g} ppm/K"}
    return texts.get(dimension, f"{value:.4g}")


RULES: tuple[Rule, ...] = (
    rule_of("SIT134", unusual_values),
)
