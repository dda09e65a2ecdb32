"""Layers between the backs of two closed jaws, with glue lines and tolerances.

Heights in `sitscad.assembly.places.bodies` are nominal and without glue. This module adds the glue, the tolerance of
each part, and the smallest features that each process can make. With these, `fit` decides whether the closed jaws pass
through their port (the tube into the body).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache, lru_cache
from itertools import chain

from sitscad.assembly.places.bodies import MOUNT_PIECES, Backing, backing_of, film_thickness
from sitscad.basics.record import memo, record
from sitscad.basics.units import parse_quantity
from sitscad.data import cited, rows
from sitscad.layout.bending import FinishedThickness, Where, finished_thickness
from sitscad.layout.board import Layout
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.materials import ElastomerPad, Encapsulation, Target
from sitscad.spec.mount import Assembly, Mount


@record
class Toleranced:
    """A length with the nominal value `nominal` (m) and several independent causes of deviation.

    `terms` lists (cause, deviation in m). Deviations are signed, so that a common cause of two lengths cancels in their
    difference.
    """

    nominal: float
    terms: tuple[tuple[str, float], ...] = ()

    @classmethod
    def of(cls, nominal: float, tolerance: float, cause: str) -> Toleranced:
        """Return the length `nominal` (m), with a deviation of plus or minus `tolerance` (m) from one cause."""
        return cls(nominal, ((cause, tolerance),) if tolerance else ())

    def __add__(self, other: Toleranced) -> Toleranced:
        """Return the sum of two lengths. Deviations are added by cause."""
        terms = dict(self.terms)
        for cause, change in other.terms:
            terms[cause] = terms.get(cause, 0.0) + change
        return Toleranced(self.nominal + other.nominal, tuple(terms.items()))

    def __mul__(self, factor: float) -> Toleranced:
        """Return the length and its deviations multiplied by a factor."""
        return Toleranced(factor * self.nominal, tuple([(cause, factor * change) for cause, change in self.terms]))

    def __sub__(self, other: Toleranced) -> Toleranced:
        """Return the difference of two lengths. Deviations are subtracted by cause."""
        return self + other * -1.0

    @property
    def spread(self) -> float:
        """Largest deviation (m) from nominal: the sum of the magnitudes of all deviations."""
        return math.fsum([abs(change) for _, change in self.terms])

    @property
    def root_sum_square(self) -> float:
        """Root of the sum of squared deviations (m): the usual deviation for independent causes."""
        return math.hypot(*[change for _, change in self.terms])


@record
class PrintLimit:
    """Smallest size `value` (m) that a manufacturing process can make, with the source of this value."""

    value: float
    source: str


@cache
def print_limit(process: str, figure: str) -> PrintLimit:
    """Return the smallest size (m) that a process can make for one kind of feature.

    `figure` is the kind: wall, free_wall, hole, clearance, pin, groove or escape. Raises KeyError if the table has no
    row for this process and kind.
    """
    for row in rows("print_limits"):
        if (row["process"], row["figure"]) == (process, figure):
            return PrintLimit(parse_quantity(row["value"], "length"), cited(row))
    raise KeyError((process, figure))


WRITTEN = "the spec (assembly.tolerances)"
GLUE = "glue under the "


@record
class SizeTolerance:
    """Half of the tolerance band of a size, with the source of this value.

    `band` is in metres or radians, or relative to the size.
    """

    band: float
    source: str

    @property
    def sigma(self) -> float:
        """Standard deviation of a uniform distribution over the band (GUM 4.3.7)."""
        return self.band / math.sqrt(3.0)


@record
class Layer:
    """A layer between the backs of the two jaws.

    `part` is its name, and `thickness` its thickness with its deviations. `source` is the source of the tolerance.
    """

    part: str
    thickness: Toleranced
    source: str

    @property
    def is_glue(self) -> bool:
        """Whether the layer is a glue line."""
        return self.part.startswith(GLUE)


_read = cache(rows)  # Tables by their name, read once: every size asks

Levels = dict[str, tuple[Toleranced, Toleranced]]


def column(layout: Layout) -> tuple[Layer, ...]:
    """Return the layers between the backs of the closed jaws, from the jaw's lowest point upwards.

    Empty if there is no jaw. The result is cached in the layout, because each part whose size depends on it uses it.
    """

    def stack_layers() -> tuple[Layer, ...]:
        spec, jaw, assembly = layout.spec, layout.spec.jaw, layout.spec.assembly
        if jaw is None:
            return ()
        stacked = [_layer("jaw", jaw.height, jaw_tolerance(assembly, jaw.height))]
        board = _board(finished_thickness(layout, Where.COIL), assembly)
        for layer in (*_layers_behind(backing_of(spec)), board, *_layers_above(assembly, spec.elastomer, spec.target)):
            stacked += [*_glue_layer(layer, assembly), layer]
        stacked += _film_layer(spec.encapsulation, assembly)
        if pad := jaw.opposing_pad_thickness:
            moulded = _tolerance(assembly, "opposing_pad", "opposing-pad", "moulded", pad)
            stacked.append(_layer("opposing-pad", pad, moulded))
        return (*stacked, _layer("opposing-jaw", jaw.height, jaw_tolerance(assembly, jaw.height)))

    return memo(layout, "_column", stack_layers)


def layers_on_board(layout: Layout) -> tuple[Layer, ...]:
    """Return the board and the layers glued onto it, from the board upwards. The spec need not have a jaw."""
    spec, assembly = layout.spec, layout.spec.assembly
    plates = _layers_above(assembly, spec.elastomer, spec.target)
    glued = chain.from_iterable((*_glue_layer(layer, assembly), layer) for layer in plates)
    return (_board(finished_thickness(layout, Where.COIL), assembly), *glued)


def sealed_height(layers: tuple[Layer, ...], film: Encapsulation, assembly: Assembly) -> Toleranced:
    """Return the height (m) of the encapsulation's upper face above the board's top face.

    `layers` come from `layers_on_board`.
    """
    at = layer_heights((*layers, *_film_layer(film, assembly)))
    return at["encapsulation"][1] - at["board"][1]


def _film_layer(encapsulation: Encapsulation | None, assembly: Assembly) -> tuple[Layer, ...]:
    """Return the encapsulation film over the parts as a layer without glue. Empty if the spec has no film."""
    thickness = film_thickness(encapsulation)
    return (_layer("encapsulation", thickness, film_tolerance(assembly, thickness)),) if thickness else ()


def layers_on_seat(layout: Layout) -> tuple[Layer, ...]:
    """Return the printed parts and the board glued onto them, from the face below the mount upwards."""
    board = _board(finished_thickness(layout, Where.COIL), layout.spec.assembly)
    return (*_layers_behind(backing_of(layout.spec)), *_glue_layer(board, layout.spec.assembly), board)


def _board(finished: FinishedThickness, assembly: Assembly) -> Layer:
    written = assembly.tolerance("board")
    tolerance = SizeTolerance(finished.maximum - finished.nominal, finished.source)
    return _layer("board", finished.nominal, tolerance if written is None else SizeTolerance(written, WRITTEN))


def _glue_layer(layer: Layer, assembly: Assembly) -> Iterator[Layer]:
    """Yield the glue line under a layer. Empty if the spec has no glue lines."""
    source = assembly.adhesive.source if assembly.adhesive is not None else "the spec (assembly)"
    if assembly.glue_line:
        yield _layer(f"{GLUE}{layer.part}", assembly.glue_line, SizeTolerance(assembly.glue_tolerance, source))


def layer_heights(layers: tuple[Layer, ...]) -> Levels:
    """Return the heights (m) of each layer's lower and upper face by name, above the lowest face of all layers."""
    heights: Levels = {}
    here = Toleranced(0.0)
    for layer in layers:
        heights[layer.part] = here, here + layer.thickness
        here = here + layer.thickness
    return heights


def worst_deviations(layout: Layout) -> tuple[float, float]:
    """Return two worst-case deviations (m) of a part that is made to fit into the port: sideways, and in height.

    Sideways, it is half of the mount's size tolerance plus the placement tolerance. In height, it is half of the sum of
    all glue lines and of all layer tolerances, because heights count from the middle of the closed jaws.
    """

    def add_up() -> tuple[float, float]:
        layers = column(layout)
        pair = sum((layer.thickness for layer in layers), Toleranced(0.0))
        glue = sum((layer.thickness for layer in layers if layer.is_glue), Toleranced(0.0)).nominal
        size = mount_tolerance(layout.spec.assembly, layout.spec.mount).band
        return 0.5 * size + placement_tolerance(layout.spec.assembly).band, 0.5 * (pair.spread + glue)

    return memo(layout, "_slack", add_up)


def placement_tolerance(assembly: Assembly) -> SizeTolerance:
    """Return the tolerance (m) of a glued part's position."""
    return _tolerance(assembly, "placement", "placement", "by ledges", 0.0)


def outline_tolerance(assembly: Assembly, rules: DesignRules) -> SizeTolerance:
    """Return the tolerance (m) of the board's length and width."""
    written = assembly.tolerance("outline")
    if written is not None:
        return SizeTolerance(written, WRITTEN)
    return SizeTolerance(rules.outline_tolerance, rules.sources.get("outline_tolerance") or rules.source)


def print_process(mount: Mount | None) -> str:
    """Return the manufacturing process of mount, assembly jig and moulds.

    Without a mount, jig and moulds are resin prints.
    """
    return mount.process if mount is not None else "resin"


def mount_tolerance(assembly: Assembly, mount: Mount | None) -> SizeTolerance:
    """Return the size tolerance of the printed or milled parts."""
    size = mount.standoff if mount is not None else 0.0
    return _tolerance(assembly, "mount", "mount", print_process(mount), size)


def metal_tolerances(assembly: Assembly, mount: Mount | None) -> tuple[SizeTolerance, SizeTolerance] | None:
    """Return tolerances of distance and thickness of `mount.metal_behind`. None if the spec has no such metal.

    If the spec states no tolerances, the distance has the tolerance of the mount's process, and the thickness the
    tolerance of rolled sheet.
    """
    if mount is None or mount.metal_behind is None:
        return None
    metal = mount.metal_behind
    distance = _tolerance(assembly, "metal_distance", "mount", print_process(mount), metal.distance)
    thick = sheet_tolerance(assembly, "metal_behind", metal.thickness)
    return SizeTolerance(min(distance.band, metal.distance), distance.source), thick


def jaw_tolerance(assembly: Assembly, size: float) -> SizeTolerance:
    """Return the tolerance of a jaw's dimension whose nominal value is `size` (m)."""
    return _tolerance(assembly, "jaw", "jaw", "machined", size)


def sheet_tolerance(assembly: Assembly, part: str, thickness: float) -> SizeTolerance:
    """Return the thickness tolerance of a rolled sheet with this thickness (m). `part` is "target" or "shield"."""
    tolerance = _tolerance(assembly, part, "sheet", "rolled", thickness)
    return SizeTolerance(min(tolerance.band, thickness), tolerance.source)


def film_tolerance(assembly: Assembly, thickness: float) -> SizeTolerance:
    """Return the thickness tolerance of an encapsulation with this thickness (m)."""
    tolerance = _tolerance(assembly, "encapsulation", "film", "coated", thickness)
    return SizeTolerance(min(tolerance.band, thickness), tolerance.source)


def plate_tolerance(assembly: Assembly, name: str, size: float) -> SizeTolerance:
    """Return the tolerance of a side of the pad or the target whose length is `size` (m)."""
    if name == "target":
        return _tolerance(assembly, "target_size", "edge", "cut", size)
    return elastomer_tolerance(assembly, "elastomer_size", "elastomer size")


def _layers_behind(backing: Backing) -> list[Layer]:
    """Return the printed parts and the shield between metal and board, from the metal upwards."""
    sheet, printed = backing.shield_heights, mount_tolerance(backing.assembly, backing.mount)
    spans = zip(MOUNT_PIECES, backing.spans, strict=False)
    layers = [(lower, _layer(name, upper - lower, printed)) for name, (lower, upper) in spans]
    if sheet is not None and backing.shield is not None:
        thickness = backing.shield.thickness
        layers.append((sheet[0], _layer("shield", thickness, sheet_tolerance(backing.assembly, "shield", thickness))))
    return [layer for _, layer in sorted(layers, key=lambda entry: entry[0])]


def _layers_above(assembly: Assembly, elastomer: ElastomerPad | None, target: Target | None) -> Iterator[Layer]:
    if elastomer is not None:
        tolerance = elastomer_tolerance(assembly, "elastomer", "elastomer thickness")
        yield _layer("elastomer", elastomer.thickness, tolerance)
    if target is not None:
        thickness = target.thickness
        yield _layer("target", thickness, sheet_tolerance(assembly, "target", thickness))


def _layer(part: str, thickness: float, tolerance: SizeTolerance) -> Layer:
    return Layer(part, Toleranced.of(thickness, min(tolerance.band, thickness), part), tolerance.source)


def elastomer_tolerance(assembly: Assembly, written: str, row: str) -> SizeTolerance:
    """Return the tolerance of a pad's size: the spec's value, or else the usual value.

    `written` is the key in ``assembly.tolerances``, and `row` the name in `usual_tolerances`.
    """
    written_band = assembly.tolerance(written)
    return usual_tolerances()[row] if written_band is None else SizeTolerance(written_band, WRITTEN)


@cache
def usual_tolerances() -> dict[str, SizeTolerance]:
    """Return the usual tolerances of fabricators by name (for example ``trace width``).

    They are relative or in metres, as the units in the table state.
    """
    return {row["name"]: SizeTolerance(float(row["half_width"]), cited(row)) for row in rows("tolerances")}


def _tolerance(assembly: Assembly, written: str, part: str, process: str, size: float) -> SizeTolerance:
    """Return the tolerance in the spec, or else the tolerance of the process for a size (m).

    `written` is the key in ``assembly.tolerances``. `part` and `process` select the rows of the table.
    """
    written_band = assembly.tolerance(written)
    return SizeTolerance(written_band, WRITTEN) if written_band is not None else process_tolerance(part, process, size)


@lru_cache(maxsize=256)
def process_tolerance(part: str, process: str, size: float) -> SizeTolerance:
    """Return the tolerance of a process for a kind of part with a size (m).

    Raises KeyError if the table has no such row. The first row whose `up_to` is at least the size is used, or else the
    last row.
    """
    fitting = [row for row in _read("process_tolerances") if (row["part"], row["process"]) == (part, process)]
    for row in fitting:
        if size <= parse_quantity(row["up_to"], "length") or row is fitting[-1]:
            band, _, unit = row["tolerance"].partition(" ")
            share = 0.01 * float(band) * size if unit == "%" else parse_quantity(row["tolerance"], "length")
            return SizeTolerance(share, cited(row))
    raise KeyError((part, process))
