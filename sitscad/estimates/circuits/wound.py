"""A layout with its solved windings and their surroundings: the input of circuits, states and responses."""

from __future__ import annotations

from sitscad.basics.arrays import Array
from sitscad.basics.record import record, replace
from sitscad.estimates.circuits.solved_winding import SolvedWinding
from sitscad.estimates.targets.assembly import AssemblyStates
from sitscad.layout.board import Layout
from sitscad.spec.sensor import SensorSpec


@record(eq=False)
class SolvedWindings:
    """Layout at a temperature (degrees Celsius), with the assembly of each state and the solved winding.

    `matrix` and `matrix_errors` (H) belong to the bare windings. The winding was solved with `method` and `tolerance`.
    """

    layout: Layout
    temperature: float
    assembly: AssemblyStates
    winding: SolvedWinding
    matrix: Array
    matrix_errors: Array
    method: str | None = None
    tolerance: float | None = None

    @property
    def spec(self) -> SensorSpec:
        """Spec with its metals at the temperature."""
        return self.layout.spec

    @property
    def has_target(self) -> bool:
        """Whether a target is over the coils in a state."""
        return any(around.above is not None for around in self.assembly.states)

    @property
    def first_cell(self) -> SolvedWindings:
        """First cell by itself. Without cells it is the whole sensor."""
        layout = self.layout.cell(1)
        count = len(layout.coils)
        return replace(self, layout=layout, matrix=self.matrix[:count, :count],
                       matrix_errors=self.matrix_errors[:count, :count])
