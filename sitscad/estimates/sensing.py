"""What a sensor feels by its response, in newtons, each thing worked out when it is first asked for, and once."""

from __future__ import annotations

from functools import cached_property
from typing import Protocol

from sitscad.basics.record import record
from sitscad.estimates.coil_estimates import Estimates
from sitscad.estimates.loads.pad import NoResponse
from sitscad.estimates.performance.curves import Curves, curves
from sitscad.estimates.performance.points import Felt, feel, performance
from sitscad.estimates.performance_values import Loads, Performance
from sitscad.estimates.response.model import ResponseModel
from sitscad.layout.board import Layout


class Sensor(Protocol):
    """A sensor without cells. Its response raises `NoResponse` if nothing can respond."""

    @property
    def layout(self) -> Layout:
        """The sensor as drawn."""

    @property
    def estimates(self) -> Estimates:
        """The electrical numbers."""

    @property
    def response(self) -> ResponseModel:
        """What the coils read when the target moves."""


@record(eq=False)
class Sensing:
    """What a sensor without cells feels."""

    sensor: Sensor

    @cached_property
    def solved(self) -> Felt:
        """What the sensor feels by its response; raises `NoResponse` where there is nothing to feel."""
        return feel(self.sensor.layout, self.sensor.estimates, self.sensor.response)

    @cached_property
    def felt(self) -> Felt | None:
        """What the sensor feels, for checks: `solved`, or at the screen level by shares.

        None if it feels nothing, or if its target is too large to be solved in a check.
        """
        estimates = self.sensor.estimates
        try:
            if estimates.is_rough:
                return feel(self.sensor.layout, estimates)
            return self.solved if estimates.is_solved else None
        except NoResponse:
            return None

    @cached_property
    def twins(self) -> tuple[Loads, Loads] | None:
        """Two loads (N) within what is required that give one reading, None where none are found: said alike by checks
        and papers.
        """
        if self.felt is None or not self.felt.is_range_held:
            return None
        return self.felt.working.twins(lambda: self.solved.bench)

    @cached_property
    def curves(self) -> Curves | None:
        """What a data sheet draws of the sensor; None where `performance` is nothing."""
        return curves(self.solved) if self.performance else None

    @property
    def performance(self) -> tuple[Performance, ...]:
        """What the sensor feels, in newtons, at rest, half and full load; empty if it feels nothing."""
        return self._performance[0]

    @property
    def no_performance(self) -> str:
        """Reason why the sensor has no `performance`; empty if it has one."""
        return self._performance[1]

    @cached_property
    def _performance(self) -> tuple[tuple[Performance, ...], str]:
        # The performance, and the reason why there is none.
        try:
            return performance(self.solved, self.sensor.response, lambda: self.twins), ""
        except NoResponse as error:
            return (), str(error)
