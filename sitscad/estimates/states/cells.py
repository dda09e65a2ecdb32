"""Crosstalk between cells through their targets, coils and webs, relative to a cell's own full signal.

If the pads are not joined, force could reach a neighbouring cell only through the board, and the board is fixed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from sitscad.assembly.places.state import REST
from sitscad.basics.arrays import Array
from sitscad.basics.record import record
from sitscad.basics.units import show
from sitscad.estimates.coil_estimates import CoilEstimate, Estimates
from sitscad.estimates.loads.pressing import pad_webs, pressed_pad, web_stiffness
from sitscad.estimates.loads.working_range import USUAL_STRAIN
from sitscad.estimates.performance_values import Performance, split_by_unit
from sitscad.estimates.states.solved_target import own_inductance_changes
from sitscad.kernels.electromagnetics.threads import one_thread
from sitscad.kernels.mechanics.surround_law import WEB_SIGMA
from sitscad.layout.board import Layout
from sitscad.spec.places import cell_specs
from sitscad.spec.sensor import SensorSpec

NEIGHBOUR_RADIUS = 1.5
"""Radius around a cell within which cells are neighbours, divided by the distance of the nearest neighbour.

It includes diagonal neighbours.
"""


WEB_DECAY, WEB_MEAN, WEB_EDGE = 0.95, 0.25, 1.2
"""Constants of the largest displacement of a target if a neighbouring cell, joined by a web, is pressed.

The web has width w and length g. It is as thick as the pads (h); b is the pads' side. The target's mean displacement is
at most WEB_MEAN w/b exp(-WEB_DECAY g/h), as a fraction of the pressed target's. The displacement of its edge has
WEB_EDGE in place of WEB_MEAN. Linear finite elements gave displacements 1.1 to 3 times smaller. For pads 2.5 times as
long as wide, joined end to end, they were 5 times smaller. Range: pads 3 to 10 times as wide as thick, gaps of 0.7 to 4
thicknesses, any width (tests/validation/test_webs.py).
"""


@record
class CellCrosstalk:
    """Upper limits of crosstalk between cells, relative to a coil's own full signal.

    ``target`` is caused by the pressed target of one neighbouring cell, ``targets`` by all neighbouring targets pressed
    at once. ``coils`` is caused by the idle, grounded coils of neighbours. ``webs`` is caused by webs, which displace
    the cell's own target. These four values are for the cell with the most crosstalk. ``each`` holds a value for each
    cell: its crosstalk by all causes, with all other cells pressed at once. An entry of ``pairs`` is (reading cell,
    pressed cell, crosstalk); cells are numbered from 1.
    """

    target: float
    targets: float
    coils: float
    webs: float = 0.0
    each: tuple[float, ...] = ()
    pairs: tuple[tuple[int, int, float], ...] = ()

    @property
    def total(self) -> float:
        """Crosstalk of the cell with the most crosstalk, by all causes, with all other cells pressed at once."""
        return max(self.each, default=0.0)


@record
class CellGroup:
    """Cells with identical pads and drive: their ``numbers`` (from 1), coils and common values.

    ``stiffer`` is the relative increase of the pads' stiffness by webs. ``strain`` is the pads' strain under the
    required force. ``crosstalk`` is the upper limit by all neighbours (None if no cell has a signal). ``signals`` are
    the relative signals of the cells. ``performance`` is the worst performance of the `extremes` at rest, half and full
    load. It is empty until it is computed.
    """

    numbers: tuple[int, ...]
    coils: tuple[str, ...]
    stiffer: float
    strain: float
    crosstalk: float | None
    signals: tuple[float, ...]
    performance: tuple[Performance, ...] = ()

    @property
    def numbers_text(self) -> str:
        """Text with the numbers of the cells: ``cells 1, 3, 7, 9``."""
        return f"cell{'s' * (len(self.numbers) > 1)} {', '.join(map(str, self.numbers))}"

    @property
    def extremes(self) -> tuple[int, ...]:
        """Numbers of the cells with the least and the most signal: two numbers, or one if both are the same cell."""
        order = sorted(range(len(self.numbers)), key=self.signals.__getitem__)
        return tuple(dict.fromkeys(self.numbers[k] for k in (order[0], order[-1])))

    def document(self) -> list[dict[str, Any]]:
        """Return the values of every cell of the group for JSON."""
        full, coils = self.performance[-1], len(self.coils) // len(self.numbers)
        axes = full.axes.items()
        group = {
            "alike": list(self.numbers), "webs_stiffen_by": self.stiffer, "strain_at_full_load": self.strain,
            "crosstalk": self.crosstalk, **split_by_unit("range_", "", {name: axis.range for name, axis in axes}),
            "limited_by": {name: axis.limited_by for name, axis in axes}, "overload_N": full.overload,
            "free_overload_N": full.free_overload,
            **split_by_unit("resolution_", "", {
                name: axis.resolution if math.isfinite(axis.resolution) else None for name, axis in axes}),
        }
        return [{"cell": number, "coils": list(self.coils[k * coils : (k + 1) * coils])} | group
                for k, number in enumerate(self.numbers)]

    def columns(self) -> list[tuple[float, str]]:
        """Return a rank and a text for each value in the group's table row, at full load.

        The largest rank is the worst value.
        """
        full = self.performance[-1]
        axes, loads = full.axes.values(), (full.overload, full.free_overload)
        overload = min(load for load in loads if load is not None)
        return [
            (0.0, show(100.0 * self.stiffer, "%", 2) if self.stiffer else "none"),
            (self.strain, show(100.0 * self.strain, "%", 3)),
            (-min(axis.range / axis.full_scale for axis in axes), " / ".join(
                f"{show(axis.range, 'N', 3)}, {axis.limited_by}" for axis in axes)),
            (-overload, show(overload, "N", 3)),
            (max(axis.resolution / axis.full_scale for axis in axes), " / ".join(
                show(axis.resolution, "N", 3) if math.isfinite(axis.resolution) else "none" for axis in axes)),
            (self.crosstalk or 0.0, "-" if self.crosstalk is None else show(100.0 * self.crosstalk, "%", 2)),
        ]


@record
class CellTable:
    """Cell groups with their performance, ordered from the softest to the stiffest pads.

    ``weakest`` is the number of the cell with the least signal, and ``coils`` are its coils. Curves and the response
    belong to this cell. The table has no groups if the sensor has no cells or no performance.
    """

    groups: tuple[CellGroup, ...] = ()
    weakest: int = 1
    coils: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of the cell with the least signal. Empty without cells."""
        return f"cell {self.weakest}" if self.groups else ""

    @property
    def rows(self) -> list[tuple[str, ...]]:
        """Heading and rows of the table, one row for each group.

        The worst value of each column is marked if groups differ.
        """
        columns = list(zip(*(group.columns() for group in self.groups), strict=True))
        worst = [max(column)[1] for column in columns]
        differs = [len({text for _, text in column}) > 1 for column in columns]
        marked = [[text + WORST * (k > 0 and text == worst[k] and differs[k])
                   for k, (_, text) in enumerate(group.columns())] for group in self.groups]
        return [HEAD, *((group.numbers_text, *line) for group, line in zip(self.groups, marked, strict=True))]

    def document(self) -> dict[str, Any]:
        """Return the table for JSON. Empty without groups."""
        if not self.groups:
            return {}
        each = (cell for group in self.groups for cell in group.document())
        return {
            "figures_are": FIGURES_ARE.format(pushed=self.weakest), "pushed_of": self.weakest, "webs_sigma": WEB_SIGMA,
            "each": sorted(each, key=lambda cell: cell["cell"]), "in_words": self.rows,
        }

    @property
    def note(self) -> str:
        """Explanation, in sentences, of the values in this table and in other tables of the sensor."""
        return f"In the other tables {FIGURES_ARE.format(pushed=self.weakest)}. {WEBS_KNOWN}"


NO_CELLS = CellTable()
"""Table of a sensor without cells, or of cells without performance."""


HEAD = ("cells", "webs: stiffer by", "pressed by", "range", "overload", "resolution", "neighbours: at most")
"""Heading of the table of cells."""
WORST = " (worst)"
"""Mark after the worst value of a column."""

FIGURES_ARE = (
    "each figure is the worst of the solved cells. Of each kind of cells, those with the least and the most signal are "
    "solved (for a force beside the middle, another cell of a kind was up to a tenth worse). Curves, the pushed sensor "
    "and errors from unit to unit are those of cell {pushed}, which has the least signal"
)
"""Explanation of the values in tables of a sensor with cells. `pushed` is the number of the weakest cell."""

WEBS_KNOWN = (
    "All at full load, neighbours all pressed at once. By how much webs make a pad stiffer is known to "
    f"{100.0 * WEB_SIGMA:.0f} % of it (one sigma)."
)
"""Explanation of the effect of webs."""


@one_thread
def cell_crosstalk(layout: Layout, estimates: Estimates) -> CellCrosstalk | None:
    """Return the crosstalk of a sensor's cells. None if no coil has a signal.

    Each cell is pressed as in the pressed state, or by `USUAL_STRAIN` of its pad if this state is missing.

    The effect of a neighbour's target is computed for a cell without a target. The cell's own target shields more than
    half of this effect, in a model of both targets by current loops (tests/validation/two_targets.py). A grounded idle
    coil reduces the inductance of a coil beside it by the fraction k^2, where k is the coupling of both coils. A
    relative change of the idle coil's inductance therefore changes the inductance of the other coil by k^2 times as
    much.
    """
    spec, cells = layout.spec, cell_specs(layout.spec)
    assert spec.elastomer is not None
    middles = np.array([cell.array.middle for cell in cells])
    apart = middles[None] - middles[:, None]
    distances = np.hypot(apart[..., 0], apart[..., 1])
    near = (distances > 0.0) & (distances < NEIGHBOUR_RADIUS * distances[distances > 0.0].min())
    steps, which = np.unique(np.round(apart[near], 9), axis=0, return_inverse=True)
    press = estimates.pressed_place
    press = -USUAL_STRAIN * spec.elastomer.thickness if press is None else press
    poses = np.zeros((2, 1 + len(steps), 6))
    poses[:, 1:, :2], poses[1, :, 2] = steps, press
    frequencies = [state.frequency for coil in estimates.coils for state in coil.states.values() if state.state == REST]
    if not frequencies:
        return None
    effects = own_inductance_changes(layout.cell(1), poses.reshape(-1, 6), max(frequencies)).real
    effects = effects.reshape(2, 1 + len(steps), -1)
    signal, *neighbours = np.abs(effects[1] - effects[0]).max(axis=-1)
    if not signal > 0.0:
        return None
    targets, webs = np.zeros_like(distances), web_crosstalk(spec)
    targets[near] = np.array(neighbours)[which.ravel()] / signal
    matrix, count = np.array(estimates.inductance_matrix), len(cells)
    squared = matrix**2 / np.outer(np.diag(matrix), np.diag(matrix))  # k^2
    coupled = squared.reshape(count, -1, count, len(matrix) // count).sum(axis=3)  # (cell, its coil, other cell)
    coupled[np.arange(count), :, np.arange(count)] = 0.0
    coils, pairs = coupled.sum(axis=2).max(axis=1), targets + webs + coupled.max(axis=1)
    each = targets.sum(axis=1) + webs.sum(axis=1) + coils
    return CellCrosstalk(
        float(targets.max()), float(targets.sum(axis=1).max()), float(coils.max()), float(webs.sum(axis=1).max()),
        tuple(each.tolist()), tuple((cell_number + 1, other + 1, float(pairs[cell_number, other]))
                                      for cell_number, other in np.argwhere(near).tolist()))


def web_crosstalk(spec: SensorSpec) -> Array:
    """Return upper limits of the displacement that webs transmit to the target of a neighbouring cell: (cells, cells).

    They are fractions of the pressed target's displacement. The first index is the displaced cell, the second the
    pressed cell. If cells have several coils, which also respond to tilt, limits are for the target's edge. If cells
    have a single coil, limits are for the target's middle.
    """
    pad, cells = spec.elastomer, cell_specs(spec)
    bounds = np.zeros((len(cells), len(cells)))
    if pad is None or spec.web is None:
        return bounds
    is_lone = len(cells[0].array.placements) == 1
    most = spec.web / min(pad.size) * (WEB_MEAN if is_lone else WEB_EDGE)
    for number, cell in enumerate(cells):
        for side, length in enumerate(cell.elastomer.webs[1:] if cell.elastomer is not None else ()):
            way = (length + pad.size[side // 2]) * (1 if side % 2 else -1)
            there = [place + way * (axis == side // 2) for axis, place in enumerate(cell.array.middle)]
            for other, neighbour in enumerate(cells):
                if length and math.dist(neighbour.array.middle, there) < 1e-8:
                    bounds[number, other] = most * math.exp(-WEB_DECAY * length / pad.thickness)
    return bounds


def cell_groups(
    spec: SensorSpec, coils: Sequence[CoilEstimate], drive_codes: Sequence[int], crosstalk: CellCrosstalk | None
) -> tuple[CellGroup, ...]:
    """Return cells grouped by identical pads and drive, softest pads first. Their performance is left empty.

    `drive_codes` are the codes of all channels, empty if all are equal. `crosstalk` is None if no cell has a signal.
    """
    signals, kinds = cell_signals(spec, coils), dict[object, list[int]]()
    specs, stiffness = cell_specs(spec), web_stiffness(spec)
    count = len(drive_codes) // len(specs)
    for k, cell in enumerate(specs):
        webs = pad_webs(cell)
        pad_key = (round(part, 9) for part in (stiffness[k], webs.left + webs.right, webs.front + webs.back))
        kinds.setdefault((*pad_key, *drive_codes[k * count : (k + 1) * count]), []).append(k)
    groups = []
    for kind in kinds.values():
        names = tuple(p.name for k in kind for p in specs[k].array.placements)
        largest = None if crosstalk is None else max(crosstalk.each[k] for k in kind)
        groups.append(CellGroup(tuple(k + 1 for k in kind), names, stiffness[kind[0]] - 1.0,
                               pressed_pad(specs[kind[0]]).strain, largest, tuple(signals[k] for k in kind)))
    return tuple(sorted(groups, key=lambda group: group.stiffer))


def cells_for_page(spec: SensorSpec, estimates: Estimates, crosstalk: CellCrosstalk | None) -> dict[str, Any]:
    """Return the values of each cell that a web page needs to show all cells.

    `table` is the number of the weakest cell; the page has only its response. `all` holds an entry for each cell: its
    coils, their frequencies at rest (Hz), and the offsets of the counts. `signal` is the cell's signal divided by the
    weakest cell's. `read_by` lists the neighbours that this cell disturbs: number, and upper limit of the crosstalk
    relative to the neighbour's signal.
    """
    signals, rows, coils = cell_signals(spec, estimates.coils), [], len(estimates.coils) // len(cell_specs(spec))
    weakest, pairs = weakest_cell(spec, estimates.coils), () if crosstalk is None else crosstalk.pairs
    for k, signal in enumerate(signals):
        part_of_cell = estimates.part(k * coils, (k + 1) * coils)
        assert part_of_cell.readout.conversion is not None
        rows.append({
            "coils": [coil.name for coil in part_of_cell.coils],
            "rest_Hz": [coil.states[REST].frequency if REST in coil.states else None for coil in part_of_cell.coils],
            "offsets": part_of_cell.readout.conversion.offsets, "signal": signal / signals[weakest - 1],
            "read_by": [[reader, part] for reader, other, part in pairs if other == k + 1],
        })
    return {"table": weakest, "all": rows}


@one_thread
def pad_signal_ratios(layout: Layout, frequency: float, is_rough: bool = False) -> list[float]:
    """Return each coil's signal under the required force with its own pad, divided by its signal with a mean pad.

    The mean is over the pads of all cells. If `is_rough`, the ratio is the ratio of the strains. The frequency (Hz) is
    near the frequencies of all coils.
    """
    spec, pad = layout.spec, layout.spec.elastomer
    assert pad is not None
    mean, strains = pressed_pad(spec).strain, [pressed_pad(cell).strain for cell in cell_specs(spec)]
    places, count = sorted(set(strains)), len(spec.array.placements) // len(strains)
    if is_rough or not math.isfinite(frequency):
        return [strain / mean for strain in strains for _ in range(count)]
    poses = np.zeros((2 + len(places), 6))
    poses[1:, 2] = [-pad.thickness * strain for strain in (mean, *places)]
    change = own_inductance_changes(layout.cell(1), poses, frequency).real
    ratios = (change[2:] - change[0]) / (change[1] - change[0])
    return [round(float(ratio), 6) for strain in strains for ratio in ratios[places.index(strain)]]


def weakest_cell(spec: SensorSpec, coils: Sequence[CoilEstimate]) -> int:
    """Return the number (from 1) of the cell with the least signal.

    Cells differ by the lengths of their leads, whose inductance the target does not change, and by their number of
    webs.
    """
    signals = cell_signals(spec, coils)
    return 1 + min(range(len(signals)), key=signals.__getitem__)


def cell_signals(spec: SensorSpec, coils: Sequence[CoilEstimate]) -> list[float]:
    """Return relative signals of all cells, to first order.

    A signal is the fraction of coil inductance outside the leads, summed over the cell's coils. This sum is divided by
    the ratio of the pad's stiffness with webs to its stiffness without webs.
    """
    assert spec.cells is not None
    parts = [1.0 - coil.lead_inductance / coil.terminal_inductance for coil in coils]
    windings = [math.fsum(parts[k : k + spec.cells.coils]) for k in range(0, len(parts), spec.cells.coils)]
    return [part / stiffer for part, stiffer in zip(windings, web_stiffness(spec), strict=True)]
