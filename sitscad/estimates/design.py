"""A spec with all values derived from it, each computed at its first use and then cached."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar, cast

from sitscad.assembly.places.fit import closing_motion, measures
from sitscad.basics.arguments import checked_arguments
from sitscad.basics.record import memo, record
from sitscad.estimates import estimated
from sitscad.estimates.loads.gluing import hard_adhesive
from sitscad.estimates.loads.pad import NoResponse
from sitscad.layout import arrange, lay_out
from sitscad.spec.sensor import SensorSpec, without_text

# Functions import the modules of response, performance and cells: a check of a single coil needs none of these modules,
# and a check of a jaw needs no performance. The assembly module is loaded only when solids are built.

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sitscad.assembly.places.motions import Motions
    from sitscad.assembly.solids.whole import Solids
    from sitscad.basics.arrays import Array
    from sitscad.basics.check_results import Closing, Measure
    from sitscad.estimates import Estimates
    from sitscad.estimates.performance_values import Performance
    from sitscad.estimates.response.model import ResponseModel
    from sitscad.estimates.response.response_arrays import Response
    from sitscad.estimates.sensing import Sensing, Skin
    from sitscad.layout.board import Layout
    from sitscad.layout.routing.escape import SearchLimit

Value = TypeVar("Value")

ROOM_TEMPERATURE = 20.0
"""The temperature (degrees Celsius) at which boards are tested and sensors are switched on."""


@record
class Design:
    """A spec with its layout, fit and estimates, shared by checks, searches, packages and other programs.

    Each value is computed at its first use and then cached. ``given_layout`` and ``given_estimates`` are used if they
    are present; they must belong to the spec. ``of_board`` caches values of the board alone, shared by designs with
    equal boards (`cached_per_board`). Other modules cache their values of a design with `sitscad.basics.record.kept`.
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
        return estimated(self.layout) if self.given_estimates is None else self.given_estimates

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
        from sitscad.estimates.response.model import response_model

        return response_model(self.layout, self.estimates)

    @cached_property
    def sensing(self) -> Sensing:
        """Sensing performance by the response model. For cells, it belongs to the cell with the least signal."""
        sensor = self.bare.cells.weakest
        if sensor is not self:
            return sensor.sensing
        from sitscad.estimates.sensing import Sensing

        return Sensing(self)

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
        from sitscad.assembly.solids.whole import Solids

        return Solids(self.layout, hard_adhesive(self.layout))

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

    Every cell has the converters and capacitors of the whole sensor. A sensor without cells is its own single cell.
    """

    whole: Design

    @cached_property
    def reference_drift(self) -> float | None:
        """Change (per K) of ln(frequency) of the reference coil by metal. None if there is no reference coil."""
        alone, estimates = self.whole.layout.reference_alone, self.whole.estimates
        if alone is None:
            return None
        from sitscad.estimates.performance.warming import reference_drift  # only for a reference coil

        return reference_drift(alone, estimates.readout.capacitance, estimates.temperature, estimates.is_rough)

    @cached_property
    def parts(self) -> tuple[Design, ...]:
        """Designs of all cells, without the reference coil."""
        whole = self.whole
        if whole.spec.cells is None:
            if whole.spec.array.reference is None:
                return (whole,)
            sensing = whole.layout.sensing
            estimates = replace(whole.estimates.sensing, reference_drift=self.reference_drift)
            return (Design(sensing.spec, sensing, estimates),)
        coils, cells = whole.spec.cells.coils, []
        for k in range(len(whole.spec.cell_placements)):
            layout, estimates = whole.layout.cell(k + 1), whole.estimates.part(k * coils, (k + 1) * coils)
            estimates = replace(estimates, reference_drift=self.reference_drift)
            readout = replace(layout.spec.readout, capacitance=estimates.readout.capacitance)
            spec = replace(layout.spec, readout=readout, name=f"{whole.spec.name}-cell-{k + 1}")
            cells.append(Design(spec, replace(layout, spec=spec), estimates))
        return tuple(cells)

    def __len__(self) -> int:
        return len(self.parts)

    def __iter__(self) -> Iterator[Design]:
        return iter(self.parts)

    def by_number(self, number: int) -> Design:
        """Return a cell by its number, from 1. Raises ValueError if no cell has this number."""
        if not 1 <= number <= len(self):
            raise ValueError(f"there is no cell {number}: the sensor has {len(self)}")
        return self.parts[number - 1]

    @cached_property
    def skin(self) -> Skin:
        """Properties that cells share, and their crosstalk. Empty without cells."""
        if self.whole.bare is not self.whole:
            return self.whole.bare.cells.skin
        from sitscad.estimates.sensing import Skin

        return Skin(self.whole.layout.sensing, self.whole.estimates.sensing, self.parts)

    @property
    def weakest_number(self) -> int:
        """Number of the cell with the least signal: the cell with the longest leads or the most webs."""
        return 1 if self.whole.spec.cells is None else self.skin.weakest

    @property
    def weakest(self) -> Design:
        """Cell with the least signal. Curves and solutions of a single cell use it."""
        return self.by_number(self.weakest_number)

    @property
    def extremes(self) -> dict[int, Design]:
        """Cells that stand for all cells in checks, by number: least signal first, then softest pad.

        Both may be the same cell.
        """
        if self.whole.spec.cells is None:
            return {1: self.weakest}
        softest = (group.extremes[0] for group in self.skin.groups[:1])
        return {number: self.by_number(number) for number in (self.weakest_number, *softest)}


def cached_per_board(design: Design, name: str, make: Callable[[], Value]) -> Value:
    """Return `make()` of the drawn board, computed once for all designs with equal boards.

    Designs that differ in their pad alone measure no copper anew (`has_same_board`).
    """
    if name not in design.of_board:
        design.of_board[name] = make()
    return cast(Value, design.of_board[name])


def at_room_temperature(design: Design) -> Design:
    """Return the design at 20 degrees Celsius. It is the same design if `requirements.temperature` is 20."""
    if design.estimates.temperature == ROOM_TEMPERATURE:
        return design
    return memo(design, "at room temperature", lambda: Design(design.spec, design.layout, estimated(
        design.layout, temperature=ROOM_TEMPERATURE, is_solved=design.estimates.is_solved)))


@checked_arguments
def respond(
    design: Design | SensorSpec,
    poses: ArrayLike | None = None,
    *,
    loads: ArrayLike | None = None,
    case: str | Sequence[str] | None = None,
    rotation: str | None = None,
    frequency: float | None = None,
    tolerance: float | None = None,
) -> Response:
    """Return the coil readings at target poses, under loads, or in named load cases.

    A `Design` caches its solutions.

    Parameters
    ----------
    design
        A design or a spec.
    poses
        Poses (n, 6) relative to rest: x, y, z (m), rx, ry, rz (rad). Axes are as in
        `sitscad.assembly.places.state.Pose`.
    loads
        Loads (n, 3; N): normal towards the board, shear along +x and +y. Or (n, 5), with moments (N m) about x
        and y on the middle of the outermost face.
    case
        A load case, or several, by their names in the spec's section `loads`. "all" selects every case.
    rotation
        For `loads` alone: "free" lets the target tilt (default); "held" keeps it level by a flat face, as in
        data sheets and calibrations. A case sets its own rotation.
    frequency
        Frequency (Hz) of inductances and resistances. If None, it is each coil's own tank frequency.
    tolerance
        Largest error of interpolation between many poses.

    Returns
    -------
    Response
        Inductance, resistance, frequency and counts of every coil at each point.

    Raises
    ------
    ValueError
        For other shapes or values, for none or several of poses, loads and case, for a rotation without loads,
        or for an unknown rotation.
    NoResponse
        If the design has no target, no elastomer for a load, no tank that oscillates, or no load case of this name.
        Also for an impossible pose: more than a metre away, turned over, or with the whole target inside the board.
        It is a ValueError.

    Examples
    --------
    >>> import sitscad
    >>> spec = sitscad.SensorSpec.from_mapping(
    ...     name="press", coil={"shape": "circle", "outer_diameter": 8, "turns": 14, "layers": 2,
    ...                         "trace_width": "100 um", "trace_spacing": "100 um"},
    ...     target={"thickness": 0.2}, elastomer={"material": "ecoflex-00-30", "thickness": 1})
    >>> response = sitscad.respond(spec, poses=[[0, 0, 0, 0, 0, 0], [0, 0, -0.1e-3, 0, 0, 0]])
    >>> bool(response.frequency[1, 0] > response.frequency[0, 0])
    True
    """
    import numpy as np

    from sitscad.assembly.places.motions import USUAL_ROTATION, is_held
    from sitscad.estimates.states.placed import require_possible

    if sum(argument is not None for argument in (poses, loads, case)) != 1:
        raise ValueError("give either poses or loads or a case")
    if rotation is not None and loads is None:
        raise ValueError("rotation says how loads are put on: poses and cases have their own")
    model = (design if isinstance(design, Design) else Design(design)).response
    if case is not None:
        from sitscad.estimates.response.cases import respond_to_cases

        return respond_to_cases(model, (case,) if isinstance(case, str) else tuple(case), frequency, tolerance)
    rows = np.asarray(loads if poses is None else poses, dtype=float)
    widths = (3, 5) if poses is None else (6,)
    if rows.ndim == 0 or rows.shape[-1] not in widths:
        counts = " or ".join(map(str, widths))
        raise ValueError(f"rows of {counts} numbers are wanted, not an array of shape {rows.shape}")
    flat: Array = rows.reshape(-1, rows.shape[-1])
    if poses is None:
        level = np.full(len(flat), is_held(rotation or USUAL_ROTATION))
        if level.any() and np.any(flat[:, 3:]):
            raise ValueError("a face that keeps the target level takes any moment: rotation free")
        return model.respond_to_loads(flat, level, frequency, tolerance)
    require_possible(model.spec, flat)
    return model.respond(flat, frequency, tolerance)


def respond_to(
    design: Design,
    motions: Motions,
    frequency: float | None = None,
    tolerance: float | None = None,
    progress: Callable[[int, int], None] | None = None,
    derivatives: bool = False,
) -> Response:
    """Return the response at poses, loads and load cases, in this order.

    `derivatives` adds the derivatives of the frequencies.
    """
    from sitscad.estimates.response.cases import join_responses, respond_to_cases
    from sitscad.estimates.states.placed import require_possible

    model, parts = design.response, []
    if len(motions.poses):
        require_possible(model.spec, motions.poses)
        parts.append(model.respond(motions.poses, frequency, tolerance, progress))
    if len(motions.loads):
        parts.append(model.respond_to_loads(motions.loads, motions.held, frequency, tolerance, progress))
    if motions.cases:
        parts.append(respond_to_cases(model, motions.cases, frequency, tolerance, progress))
    if not derivatives:
        return join_responses(parts)
    from sitscad.estimates.response.cases import with_derivatives

    return join_responses([with_derivatives(model, part) for part in parts])


def has_same_board(first: SensorSpec, second: SensorSpec) -> bool:
    """Whether two specs have the same board."""
    return _board(first) == _board(second)


def _board(spec: SensorSpec) -> tuple[object, ...]:
    """Return all parts of a spec that determine the board."""
    jaw = spec.jaw
    return spec.coil, spec.array, spec.fpc, spec.readout.chip, (jaw.length, jaw.width) if jaw is not None else None
