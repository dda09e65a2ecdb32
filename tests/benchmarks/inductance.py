"""Every method for a coil's inductance, and for the mutual inductance of two coils, against the volume integral.

The references are those of tests/validation (random_designs.csv, coil_pairs.csv): random designs of every shape.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from types import SimpleNamespace

import coil_pairs
import designs
import write_references
from measure import Growth, Measured, growth, peak, timed

from sitscad.estimates.windings.methods import METHODS, Method, WindingGeometry
from sitscad.estimates.windings.neighbours import mutual_error, winding_pair_inductance
from sitscad.kernels.geometry.path import Point
from sitscad.kernels.geometry.shapes import SHAPES
from sitscad.spec.coil import CoilSpec

TURNS, LAYERS = (12.0, 25.0, 50.0, 100.0, 200.0), (1, 2, 4, 8)
WINDING, MUTUAL = "inductance of a coil", "mutual inductance of two coils"


def geometry(design: designs.Design) -> WindingGeometry:
    """The design as the methods want it."""
    return WindingGeometry(design.spec, design.spirals, design.drawn)


def methods(shape: str) -> list[Method]:
    """Every method for a shape, closed formulas too."""
    return [method for method in METHODS if method.serves(SHAPES[shape])]


def measured(each: int) -> Iterator[Measured]:
    """Every method on `each` small and `each` large designs a family, and the mutual inductance of `each` pairs."""
    for family in designs.FAMILIES:
        for series in ("small", "large"):
            rows = [r for r in write_references.read() if r["family"] == family and r["series"] == series]
            for row in rows[:: max(1, len(rows) // each)][:each]:
                yield from _on_design(row)
        rows = [row for row in coil_pairs.read() if row["family"] == family]
        for row in rows[:: max(1, len(rows) // each)][:each]:
            yield _on_pair(row)


def _on_design(row: dict[str, str]) -> Iterator[Measured]:
    design = designs.design(row["family"], int(row["number"]), row["series"] == "large")
    coil, exact = geometry(design), float(row["inductance_H"])
    name = f"{row['family']} {row['number']} ({row['series']}): {row['layers']} x {row['turns']}"
    for method in methods(design.spec.shape):
        if method.is_valid(coil) and (result := method.solve(coil)) is not None:
            work = partial(method.solve, coil)
            yield Measured(WINDING, method.name, name, *timed(work), peak(work), abs(result / exact - 1.0),
                           method.error(coil))


def _on_pair(row: dict[str, str]) -> Measured:
    two = coil_pairs.pair(row["family"], int(row["number"]))
    item, other = (
        (SimpleNamespace(centre=Point(*centre)), geometry(design))
        for design, centre in ((two.first, (0.0, 0.0)), (two.second, two.centre))
    )
    work = partial(winding_pair_inductance, item, other)
    result, exact = work(), float(row["mutual_inductance_H"])
    return Measured(MUTUAL, "side by side", f"{row['family']} {row['number']}", *timed(work), peak(work),
                    abs(result.inductance / exact - 1.0), mutual_error(result, two.first.spec) / abs(exact))


def grown(turns: tuple[float, ...] = TURNS, layers: tuple[int, ...] = LAYERS) -> Iterator[Growth]:
    """How the methods of every shape grow with turns and with layers."""
    for shape in designs.SHAPES:
        for method in methods(shape):
            if method.is_cross_check:
                continue
            what = f"{method.name}, {shape}"
            yield growth(what, "turns", [(n, partial(method.solve, _coil(shape, n, 2))) for n in turns])
            yield growth(what, "layers", [(n, partial(method.solve, _coil(shape, 24.0, n))) for n in layers])


def _coil(shape: str, turns: float, layers: int) -> WindingGeometry:
    size = 4e-3 + 2.0 * 80e-6 * turns
    long = 1.5 * size if shape in ("rectangle", "racetrack") else size
    spec = CoilSpec(shape=shape, size=(long, size), turns=turns, layers=tuple(range(1, layers + 1)),
                    trace_width=40e-6, trace_spacing=40e-6)
    return geometry(designs.built(spec, tuple(-60e-6 * k for k in range(layers)), 18e-6))
