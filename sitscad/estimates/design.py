"""A spec with all values derived from it, each computed at its first use and then cached."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar, cast

from sitscad.assembly.places.fit import closing_motion, measures
from sitscad.basics.arguments import checked_arguments
from sitscad.basics.late import late
from sitscad.basics.record import memo, record
from sitscad.estimates import estimate_layout
from sitscad.estimates.loads.gluing import hard_adhesive
from sitscad.estimates.loads.pad import NoResponse
from sitscad.layout import arrange, lay_out
from sitscad.spec.sensor import SensorSpec, without_text

if TYPE_CHECKING:

    from sitscad.assembly.solids.whole import Solids
    from sitscad.basics.check_results import Closing, Measure
    from sitscad.estimates import Estimates
    from sitscad.estimates.performance_values import Performance
    from sitscad.estimates.response.model import ResponseModel
    from sitscad.estimates.sensing import Sensing, Skin
    from sitscad.layout.board import Layout
    from sitscad.layout.routing.escape import SearchLimit

# a check of a single coil needs none of these, which saves 10 ms (3 %); solids load a CAD kernel
response_model = late("sitscad.estimates.response.model", "response_model")
reference_drift = late("sitscad.estimates.performance.warming", "reference_drift")
sensing_of = late("sitscad.estimates.sensing", "Sensing")
skin_of = late("sitscad.estimates.sensing", "Skin")
solids_of = late("sitscad.assembly.solids.whole", "Solids")

Value = TypeVar("Value")

ROOM_TEMPERATURE = 20.0
"""Temperature (degrees Celsius) at which boards are tested and sensors are switched on."""


@record
class Design:
    """A spec with its layout, fit and estimates, shared by checks, searches, packages and other programs.

    Each value is computed at its first use and then cached. ``given_layout`` and ``given_estimates`` are used if they
    are present; they must belong to the spec. ``of_board`` caches values that depend only on the board, for all designs
    with equal boards (`cached_per_board`). Other modules cache their values of a design with
    `sitscad.basics.record.memo`.
    """

    spec: SensorSpec
    given_layout: Layout | None = None
    given_estimates: Estimates | None = None
    of_board: dict[str, Any] = field(default_factory=dict, repr=False, compare=False)

    if not TYPE_CHECKING:  # copies call it without a spec

        @checked_arguments
        def __new__(
            cls, spec: SensorSpec = None, given_layout: Layout | None = None,
            given_estimates: Estimates | None = None, *_: object, **named: object,
        ) -> Design:
            """Check the types of the arguments. Without arguments, as in copies, check nothing."""
            return object.__new__(cls)

    @cached_property
    def layout(self) -> Layout:
        """Drawn layout."""
        return lay_out(self.spec) if self.given_layout is None else self.given_layout

    @cached_property
    def fit(self) -> tuple[Measure, ...]:
        """Distances measured for the sensor in its jaw. Empty without a jaw, or if the shield does not fit."""
        return measures(self.layout)

    @cached_property
    def closing(self) -> Closing | None:
        """Closing motion of the jaws. None if there is no jaw, or if the shield does not fit."""
        return closing_motion(self.layout) if self.fit else None

    @cached_property
    def estimates(self) -> Estimates:
        """Electrical estimates."""
        return estimate_layout(self.layout) if self.given_estimates is None else self.given_estimates

    @cached_property
    def cells(self) -> Cells:
        """All cells, each as a separate sensor. A sensor without cells is its own single cell."""
        return Cells(self)

    @cached_property
    def response(self) -> ResponseModel:
        """Coil readings as a function of the target's pose.

        Raises `NoResponse` if nothing can respond, and for a sensor with cells: each cell has a separate response.
        """
        if self.bare is not self:
            return self.bare.response
        if self.spec.array.reference is not None and self.spec.cells is None:
            return self.cells.weakest.response
        if self.spec.cells is not None:
            count = len(self.cells)
            raise NoResponse(f"the sensor has {count} cells, each with a target of its own: ask for one, --cell 1")
        return response_model(self.layout, self.estimates)

    @cached_property
    def sensing(self) -> Sensing:
        """Sensing performance by the response model. For cells, it belongs to the cell with the least signal."""
        sensor = self.bare.cells.weakest
        if sensor is not self:
            return sensor.sensing
        return sensing_of(self)

    @cached_property
    def performance(self) -> tuple[Performance, ...]:
        """Sensing performance in newtons at rest, half and full load.

        It is empty without a conducting target, without a pad that holds the target, or if no tank oscillates. It takes
        seconds of processor time, once for each design. For a sensor with cells, each figure is the worst of all cells
        (`Skin.table` has each cell), and production limits are for all coils.
        """
        return self.sensing.performance if self.spec.cells is None else self.cells.skin.performance

    @cached_property
    def solids(self) -> Solids:
        """Solids of the sensor. The first use imports a CAD kernel."""
        return solids_of(self.layout, hard_adhesive(self.layout))

    @cached_property
    def bare(self) -> Design:
        """This design without its spec's source text, with the same layout and estimates.

        Comments and the file name cannot change the drawing.
        """
        spec, source = without_text(self.spec), self.spec.source
        if (source, source.files) == (spec.source, spec.source.files):
            return self
        return Design(spec, replace(self.layout, spec=spec), self.estimates)

    def drawn(self, changed: SensorSpec, searches: SearchLimit | None = None) -> Design:
        """Return the design of a changed spec. It is drawn anew unless the board is unchanged."""
        if has_same_board(changed, self.spec):
            return Design(changed, replace(self.layout, spec=changed), of_board=self.of_board)
        return Design(changed, arrange(changed, searches))


@record(eq=False)
class Cells:
    """Cells of a sensor in order of their numbers, each as a separate sensor.

    `whole` is the design of the sensor. Every cell has the converters and capacitors of the whole sensor. A sensor
    without cells is its own single cell.
    """

    whole: Design

    @cached_property
    def reference_drift(self) -> float | None:
        """Drift (per K) of ln(frequency) of the reference coil by warming of metal.

        None if there is no reference coil.
        """
        alone, estimates = self.whole.layout.reference_alone, self.whole.estimates
        if alone is None:
            return None
        return reference_drift(alone, estimates.readout.capacitance, estimates.temperature, estimates.is_rough)

    def _with_reference(self, estimates: Estimates) -> Estimates:
        """Return the estimates of sensing coils with the drift of the reference coil."""
        spec = self.whole.spec
        return replace(estimates, reference_drift=self.reference_drift,
                       has_own_windings=spec.reference_coil is not spec.coil)

    @cached_property
    def parts(self) -> tuple[Design, ...]:
        """Designs of all cells, each as a separate sensor. The reference coil is left out."""
        whole = self.whole
        if whole.spec.cells is None:
            if whole.spec.array.reference is None:
                return (whole,)
            sensing = whole.layout.sensing
            estimates = self._with_reference(whole.estimates.sensing)
            return (Design(sensing.spec, sensing, estimates),)
        coils, cells = whole.spec.cells.coils, []
        for k in range(len(whole.spec.cell_placements)):
            layout = whole.layout.cell(k + 1)
            estimates = self._with_reference(whole.estimates.part(k * coils, (k + 1) * coils))
            readout = replace(layout.spec.readout, capacitance=estimates.readout.capacitance)
            spec = replace(layout.spec, readout=readout, name=f"{whole.spec.name}-cell-{k + 1}")
            cells.append(Design(spec, replace(layout, spec=spec), estimates))
        return tuple(cells)

    def __len__(self) -> int:
        return len(self.parts)

    def __iter__(self) -> Iterator[Design]:
        return iter(self.parts)

    def by_number(self, number: int) -> Design:
        """Return the design of a cell by its number, from 1. Raises ValueError if no cell has this number."""
        if not 1 <= number <= len(self):
            raise ValueError(f"there is no cell {number}: the sensor has {len(self)}")
        return self.parts[number - 1]

    @cached_property
    def skin(self) -> Skin:
        """Crosstalk, groups and worst performance of all cells. Empty if the sensor has no cells."""
        if self.whole.bare is not self.whole:
            return self.whole.bare.cells.skin
        return skin_of(self.whole.layout.sensing, self.whole.estimates.sensing, self.parts)

    @property
    def weakest_number(self) -> int:
        """Number (from 1) of the cell with the least signal, which has the longest leads or the most webs."""
        return 1 if self.whole.spec.cells is None else self.skin.weakest

    @property
    def weakest(self) -> Design:
        """Design of the cell with the least signal. Curves and solutions of a single cell use it."""
        return self.by_number(self.weakest_number)

    @property
    def extremes(self) -> dict[int, Design]:
        """Cells that checks examine in place of all cells, by number.

        The first has the least signal, the second the softest pad. Both may be the same cell.
        """
        if self.whole.spec.cells is None:
            return {1: self.weakest}
        softest = (group.extremes[0] for group in self.skin.groups[:1])
        return {number: self.by_number(number) for number in (self.weakest_number, *softest)}


def cached_per_board(design: Design, name: str, make: Callable[[], Value]) -> Value:
    """Return the result of `make`, computed once for all designs with equal boards (`has_same_board`).

    `name` identifies the result in the cache. For example, designs that differ only in their pads share copper shapes.
    """
    if name not in design.of_board:
        design.of_board[name] = make()
    return cast(Value, design.of_board[name])


def at_room_temperature(design: Design) -> Design:
    """Return the design at 20 degrees Celsius. It is `design` itself if its estimates are for 20 degrees Celsius."""
    if design.estimates.temperature == ROOM_TEMPERATURE:
        return design
    return memo(design, "at room temperature", lambda: Design(design.spec, design.layout, estimate_layout(
        design.layout, temperature=ROOM_TEMPERATURE, is_solved=design.estimates.is_solved)))


def has_same_board(first: SensorSpec, second: SensorSpec) -> bool:
    """Whether two specs have equal boards: coil, array, film, chips on the board, and length and width of the jaw."""
    return _board(first) == _board(second)


def _board(spec: SensorSpec) -> tuple[object, ...]:
    """Return the parts of a spec that determine the board, for comparison with another spec."""
    jaw = spec.jaw
    size = (jaw.length, jaw.width) if jaw is not None else None
    return spec.coil, spec.array, spec.fpc, spec.readout.chip, spec.soldered_thermistor, size
