"""Sensing performance of a sensor in newtons, by its response model. Values are computed at first use and cached."""

from __future__ import annotations

from functools import cached_property
from typing import Protocol

from sitscad.basics.record import record
from sitscad.estimates.coil_estimates import Estimates
from sitscad.estimates.loads.pad import NoResponse
from sitscad.estimates.performance.curves import Curves, curves
from sitscad.estimates.performance.points import SensingAnalysis, analyse_sensing, performance
from sitscad.estimates.performance_values import Loads, Performance
from sitscad.estimates.response.model import ResponseModel
from sitscad.layout.board import Layout


class SensorModel(Protocol):
    """A sensor without cells. Its response raises `NoResponse` if nothing can respond."""

    @property
    def layout(self) -> Layout:
        """Drawn layout."""

    @property
    def estimates(self) -> Estimates:
        """Electrical estimates."""

    @property
    def response(self) -> ResponseModel:
        """Coil readings as a function of the target's pose."""


@record(eq=False)
class Sensing:
    """Sensing performance of a sensor without cells."""

    sensor: SensorModel

    @cached_property
    def solved(self) -> SensingAnalysis:
        """Sensing performance by the full response model. Raises `NoResponse` if the sensor cannot respond."""
        return analyse_sensing(self.sensor.layout, self.sensor.estimates, self.sensor.response)

    @cached_property
    def analysis(self) -> SensingAnalysis | None:
        """Sensing performance for checks: `solved`, or at screen level by correction ratios of an infinite plate.

        None if the sensor cannot respond, or if its target is too large to be solved in a check.
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
        if self.analysis is None or not self.analysis.is_range_held:
            return None
        return self.analysis.working.ambiguous_loads(lambda: self.solved.bench)

    @cached_property
    def curves(self) -> Curves | None:
        """Curves of the data sheet. None if `performance` is empty."""
        return curves(self.solved) if self.performance else None

    @property
    def performance(self) -> tuple[Performance, ...]:
        """Sensing performance in newtons at rest, half and full load. Empty if the sensor cannot respond."""
        return self._performance[0]

    @property
    def no_performance(self) -> str:
        """Reason for an empty `performance`. Empty if the sensor has performance."""
        return self._performance[1]

    @cached_property
    def _performance(self) -> tuple[tuple[Performance, ...], str]:
        # The performance, and the reason if it is empty.
        try:
            return performance(self.solved, self.sensor.response, lambda: self.ambiguous_loads), ""
        except NoResponse as error:
            return (), str(error)
