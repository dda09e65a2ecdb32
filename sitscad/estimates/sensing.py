"""Sensing performance in newtons of a sensor, and of the cells of a skin, from their response models.

Values are computed at first use and cached.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Protocol

from sitscad.basics.record import record
from sitscad.estimates.coil_estimates import Estimates
from sitscad.estimates.loads.pad import NoResponse
from sitscad.estimates.performance.curves import Curves, curves
from sitscad.estimates.performance.points import SensingAnalysis, analyse_sensing, performance
from sitscad.estimates.performance_values import Loads, Performance, worst_performance
from sitscad.estimates.response.model import ResponseModel
from sitscad.estimates.states.cells import (
    NO_CELLS,
    CellCrosstalk,
    CellGroup,
    CellTable,
    cell_crosstalk,
    cell_groups,
    weakest_cell,
)
from sitscad.estimates.tolerances.scatter import production_limits
from sitscad.layout.board import Layout


class SensorModel(Protocol):
    """Values of a sensor without cells from which its sensing performance is computed.

    `response` raises `NoResponse` if no coil can respond to the target.
    """

    @property
    def layout(self) -> Layout:
        """Drawn layout."""

    @property
    def estimates(self) -> Estimates:
        """Electrical estimates of the layout."""

    @property
    def response(self) -> ResponseModel:
        """Coil readings as a function of the target's pose."""


@record(eq=False)
class Sensing:
    """Sensing performance of a sensor without cells, computed at first use from `sensor`."""

    sensor: SensorModel

    @cached_property
    def solved(self) -> SensingAnalysis:
        """Sensing performance from the sensor's response model. Raises `NoResponse` if the sensor cannot respond."""
        return analyse_sensing(self.sensor.layout, self.sensor.estimates, self.sensor.response)

    @cached_property
    def analysis(self) -> SensingAnalysis | None:
        """Sensing performance for checks, by the response model or by an approximation.

        Screening estimates use the approximation: the effect of an infinite plate, multiplied by correction ratios.
        None if the sensor cannot respond, or if its target is so large that the field solution takes too long for a
        check.
        """
        estimates = self.sensor.estimates
        try:
            if estimates.is_rough:
                return analyse_sensing(self.sensor.layout, estimates)
            return self.solved if estimates.is_solved else None
        except NoResponse:
            return None

    @cached_property
    def ambiguous_loads(self) -> tuple[Loads, Loads] | None:
        """Two loads (N) within the requirements that give equal readings. None if no such pair is found.

        Checks and documents share this result.
        """
        if self.analysis is None or not self.analysis.is_pad_stable_in_range:
            return None
        return self.analysis.working.ambiguous_loads(lambda: self.solved.bench)

    @cached_property
    def curves(self) -> Curves | None:
        """Curves of readings and errors for the data sheet. None if `performance` is empty."""
        return curves(self.solved) if self.performance else None

    @property
    def performance(self) -> tuple[Performance, ...]:
        """Sensing performance in newtons at rest, half and full load. Empty if the sensor cannot respond."""
        return self._performance[0]

    @property
    def reason_without_performance(self) -> str:
        """Reason why `performance` is empty. Empty text if the sensor has a performance."""
        return self._performance[1]

    @cached_property
    def _performance(self) -> tuple[tuple[Performance, ...], str]:
        # The performance, and the reason if it is empty.
        try:
            return performance(self.solved, self.sensor.response, lambda: self.ambiguous_loads), ""
        except NoResponse as error:
            return (), str(error)


class Cell(Protocol):
    """Sensing performance of one cell, computed as for a separate sensor."""

    @property
    def performance(self) -> tuple[Performance, ...]:
        """Sensing performance of the cell at rest, half and full load."""


@record(eq=False)
class Skin:
    """Values of all cells together: crosstalk, groups of identical cells, worst performance.

    Empty if the sensor has no cells.
    """

    layout: Layout
    estimates: Estimates
    cells: Sequence[Cell]

    @property
    def _has_cells(self) -> bool:
        return self.layout.spec.cells is not None

    @cached_property
    def weakest(self) -> int:
        """Number (from 1) of the cell with the least signal, which has the longest leads or the most webs."""
        return weakest_cell(self.layout.spec, self.estimates.coils) if self._has_cells else 1

    @cached_property
    def crosstalk(self) -> CellCrosstalk | None:
        """Upper limits of the false reading of each cell while its neighbours are loaded.

        None if there are no cells, or if no coil has a signal.
        """
        return cell_crosstalk(self.layout, self.estimates) if self._has_cells else None

    @cached_property
    def groups(self) -> tuple[CellGroup, ...]:
        """Cells grouped by identical pads and drive, without sensing performance. Empty if the sensor has no cells."""
        if not self._has_cells:
            return ()
        estimates = self.estimates
        return cell_groups(self.layout.spec, estimates.coils, estimates.readout.drive_codes, self.crosstalk)

    @cached_property
    def table(self) -> CellTable:
        """Groups of identical cells, each with the worst performance of its extreme cells.

        The computation takes seconds of processor time for each group. The table is empty if the sensor has no cells,
        or if a cell has no performance.
        """
        groups = []
        for group in self.groups:
            extremes = [self.cells[number - 1].performance for number in group.extremes]
            if not all(extremes):
                return NO_CELLS
            groups.append(replace(group, performance=tuple(map(worst_performance, zip(*extremes, strict=True)))))
        count = len(self.layout.coils) // len(self.cells)
        weakest = self.layout.coils[(self.weakest - 1) * count : self.weakest * count]
        return CellTable(tuple(groups), self.weakest, tuple(coil.name for coil in weakest))

    @property
    def performance(self) -> tuple[Performance, ...]:
        """Worst value of all cells, for each quantity and working point. Production limits are for all coils."""
        points = map(worst_performance, zip(*(group.performance for group in self.table.groups), strict=True))
        return tuple(replace(point, production=production_limits(self.estimates.coils)) for point in points)
