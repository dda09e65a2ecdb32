"""A spec and what follows from it, each thing worked out when it is first asked for, and once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar, cast

from sitscad.assembly.places.fit import closing, measures
from sitscad.basics.arguments import checked_arguments
from sitscad.basics.record import kept, record
from sitscad.estimates import estimated
from sitscad.estimates.loads.gluing import hard_adhesive
from sitscad.estimates.loads.pad import NoResponse
from sitscad.layout import arrange, lay_out
from sitscad.spec.sensor import SensorSpec, without_text

# Modules of the response, of performance and of cells are imported in functions: a check of a single coil needs none of
# them, and that of a jaw no performance. The module of the assembly is, too: it is loaded only where solids are built.

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
    from sitscad.estimates.sensing import Sensing
    from sitscad.estimates.skin import Skin
    from sitscad.layout.board import Layout
    from sitscad.layout.routing.escape import SearchLimit

Value = TypeVar("Value")

ROOM_TEMPERATURE = 20.0
"""The temperature (degrees Celsius) at which boards are tested and sensors are switched on."""


@record
class Design:
    """A spec with its layout, its fit and its estimates: what checks, searches, packages and programs share.

    Nothing is worked out before it is asked for, and nothing twice. ``given_layout`` and ``given_estimates`` are taken
    for its own where somebody has them already; they have to be those of the spec. ``of_board`` is what was worked out
    of the board alone, which designs with the same board have in common (`cached_per_board`). What other modules work
    out of a design they keep with it by `sitscad.basics.record.kept`.
    """

    spec: SensorSpec
    given_layout: Layout | None = None
    given_estimates: Estimates | None = None
    of_board: dict[str, Any] = field(default_factory=dict, repr=False, compare=False)

    if not TYPE_CHECKING:  # a copy is made without a spec

        @checked_arguments
        def __new__(
            cls, spec: SensorSpec = None, given_layout: Layout | None = None,
            given_estimates: Estimates | None = None, *_: object, **named: object,
        ) -> Design:
            """Check the types of the arguments. Without arguments, as in copies, check nothing."""
            return object.__new__(cls)

    @cached_property
    def layout(self) -> Layout:
        """The design as drawn."""
        return lay_out(self.spec) if self.given_layout is None else self.given_layout

    @cached_property
    def fit(self) -> tuple[Measure, ...]:
        """What is measured of the sensor in its jaw; nothing without one, or where the shield does not fit."""
        return measures(self.layout)

    @cached_property
    def closing(self) -> Closing | None:
        """How the sensor's jaws close; None without a jaw, or where the shield does not fit."""
        return closing(self.layout) if self.fit else None

    @cached_property
    def estimates(self) -> Estimates:
        """The electrical numbers."""
        return estimated(self.layout) if self.given_estimates is None else self.given_estimates

    @cached_property
    def cells(self) -> Cells:
        """Every cell as a sensor of its own; a sensor without cells is its own only cell."""
        return Cells(self)

    @cached_property
    def response(self) -> ResponseModel:
        """What the coils read when the target moves.

        Raises `NoResponse` if nothing can respond, and for a sensor with cells: each cell has its own response.
        """
        if self.bare is not self:
            return self.bare.response
        if self.spec.cells is not None:
            count = len(self.cells)
            raise NoResponse(f"the sensor has {count} cells, each with a target of its own: ask for one, --cell 1")
        from sitscad.estimates.response.model import response_model

        return response_model(self.layout, self.estimates)

    @cached_property
    def sensing(self) -> Sensing:
        """What the sensor feels by its response; of a sensor with cells, what its weakest cell feels."""
        sensor = self.bare.cells.weakest
        if sensor is not self:
            return sensor.sensing
        from sitscad.estimates.sensing import Sensing

        return Sensing(self)

    @cached_property
    def performance(self) -> tuple[Performance, ...]:
        """What the sensor feels, in newtons, at rest, half and full load; nothing where it has no target that conducts,
        no pad under it that holds it, or no tank that oscillates. It costs seconds of processor time, once a design.

        For a sensor with cells, each figure is the worst of all cells (`Skin.table` has each), and limits of production
        are those of all coils.
        """
        return self.sensing.performance if self.spec.cells is None else self.cells.skin.performance

    @cached_property
    def solids(self) -> Solids:
        """The sensor's solids (importing a CAD kernel)."""
        from sitscad.assembly.solids.whole import Solids

        return Solids(self.layout, hard_adhesive(self.layout))

    @cached_property
    def bare(self) -> Design:
        """This design without the text that it was read from: comments and file name cannot change what is drawn
        from it. Layout and estimates are this one's.
        """
        spec, source = without_text(self.spec), self.spec.source
        if (source, source.files) == (spec.source, spec.source.files):
            return self
        return Design(spec, replace(self.layout, spec=spec), self.estimates)

    def drawn(self, changed: SensorSpec, searches: SearchLimit | None = None) -> Design:
        """A changed design, drawn anew unless the board stays as it is."""
        if has_same_board(changed, self.spec):
            return Design(changed, replace(self.layout, spec=changed), of_board=self.of_board)
        return Design(changed, arrange(changed, searches))


@record(eq=False)
class Cells:
    """The cells of a sensor in the order of their numbers, each as a sensor of its own, read by the converters and
    capacitors of the whole. A sensor without cells is its own only cell.
    """

    whole: Design

    @cached_property
    def parts(self) -> tuple[Design, ...]:
        """Every cell."""
        whole = self.whole
        if whole.spec.cells is None:
            return (whole,)
        coils, cells = whole.spec.cells.coils, []
        for k in range(len(whole.layout.coils) // coils):
            layout, estimates = whole.layout.cell(k + 1), whole.estimates.part(k * coils, (k + 1) * coils)
            readout = replace(layout.spec.readout, capacitance=estimates.readout.capacitance)
            spec = replace(layout.spec, readout=readout, name=f"{whole.spec.name}-cell-{k + 1}")
            cells.append(Design(spec, replace(layout, spec=spec), estimates))
        return tuple(cells)

    def __len__(self) -> int:
        return len(self.parts)

    def __iter__(self) -> Iterator[Design]:
        return iter(self.parts)

    def by_number(self, number: int) -> Design:
        """One cell by its number, from 1. Raises ValueError if there is none of that number."""
        if not 1 <= number <= len(self):
            raise ValueError(f"there is no cell {number}: the sensor has {len(self)}")
        return self.parts[number - 1]

    @cached_property
    def skin(self) -> Skin:
        """What cells have in common and do to each other; empty without cells."""
        if self.whole.bare is not self.whole:
            return self.whole.bare.cells.skin
        from sitscad.estimates.skin import Skin

        return Skin(self.whole.layout, self.whole.estimates, self.parts)

    @property
    def weakest_number(self) -> int:
        """The number of the cell with the least signal: of the longest leads, or the most webs."""
        return 1 if self.whole.spec.cells is None else self.skin.weakest

    @property
    def weakest(self) -> Design:
        """The cell with the least signal, which stands for all in curves and solutions."""
        return self.by_number(self.weakest_number)

    @property
    def extremes(self) -> dict[int, Design]:
        """The cells by which all are judged, by number: that with the least signal, then that whose pad is softest.

        They may be one cell.
        """
        if self.whole.spec.cells is None:
            return {1: self.whole}
        softest = (group.extremes[0] for group in self.skin.groups[:1])
        return {number: self.by_number(number) for number in (self.weakest_number, *softest)}


def cached_per_board(design: Design, name: str, make: Callable[[], Value]) -> Value:
    """What `make` gives of the drawn board alone, made once for all designs with the same board (`has_same_board`):
    trials of another pad measure no copper anew.
    """
    if name not in design.of_board:
        design.of_board[name] = make()
    return cast(Value, design.of_board[name])


def at_room_temperature(design: Design) -> Design:
    """The design at 20 degrees Celsius: itself, unless `requirements.temperature` is another."""
    if design.estimates.temperature == ROOM_TEMPERATURE:
        return design
    return kept(design, "at room temperature", lambda: Design(design.spec, design.layout, estimated(
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
    """What the coils read with the target at `poses` (n, 6: x, y, z in metres, rx, ry, rz in radians, from rest; axes
    as in `sitscad.assembly.places.state.Pose`), under `loads` (n, 3: normal towards the board, shear along +x and +y,
    newtons; or n, 5: with moments about x and y on the middle of the outermost face, newton metres), or in a load case
    that the spec's section `loads` names, or several; "all" is every one of them.

    `rotation` goes with `loads`: "free", the target tilts as it likes (so where it is left out), or "held", a
    flat face keeps it level, as in data sheets and calibrations. A case says so itself.

    `frequency` (Hz) is what inductances and resistances are taken at, each coil's own tank frequency where None;
    `tolerance` limits what interpolation between many poses may be off by. A `Design` keeps what it solved. Raises
    ValueError for other shapes and numbers, for none or several of poses, loads and case, for a rotation without loads
    or of another name, and `NoResponse` (a
    ValueError) where the design has nothing that could respond, no such load case, or no room for a pose: more than a
    metre away, turned over, or with the whole target inside the board.
    """
    import numpy as np

    from sitscad.assembly.places.motions import USUAL_ROTATION, is_held
    from sitscad.estimates.states.placed import require_possible

    if sum(given is not None for given in (poses, loads, case)) != 1:
        raise ValueError("give either poses or loads or a case")
    if rotation is not None and loads is None:
        raise ValueError("rotation says how loads are put on: poses and cases have their own")
    model = (design if isinstance(design, Design) else Design(design)).response
    if case is not None:
        from sitscad.estimates.response.cases import in_cases

        return in_cases(model, (case,) if isinstance(case, str) else tuple(case), frequency, tolerance)
    rows = np.asarray(loads if poses is None else poses, dtype=float)
    wanted = (3, 5) if poses is None else (6,)
    if rows.ndim == 0 or rows.shape[-1] not in wanted:
        counts = " or ".join(map(str, wanted))
        raise ValueError(f"rows of {counts} numbers are wanted, not an array of shape {rows.shape}")
    flat: Array = rows.reshape(-1, rows.shape[-1])
    if poses is None:
        level = np.full(len(flat), is_held(rotation or USUAL_ROTATION))
        if level.any() and np.any(flat[:, 3:]):
            raise ValueError("a face that keeps the target level takes any moment: rotation free")
        return model.under(flat, level, frequency, tolerance)
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
    """Response at poses, loads and load cases, in this order; with the `derivatives` of the frequencies if wanted."""
    from sitscad.estimates.response.cases import in_cases, with_cases
    from sitscad.estimates.states.placed import require_possible

    model, parts = design.response, []
    if len(motions.poses):
        require_possible(model.spec, motions.poses)
        parts.append(model.respond(motions.poses, frequency, tolerance, progress))
    if len(motions.loads):
        parts.append(model.under(motions.loads, motions.held, frequency, tolerance, progress))
    if motions.cases:
        parts.append(in_cases(model, motions.cases, frequency, tolerance, progress))
    if not derivatives:
        return with_cases(parts)
    from sitscad.estimates.response.cases import with_derivatives

    return with_cases([with_derivatives(model, part) for part in parts])


def has_same_board(one: SensorSpec, other: SensorSpec) -> bool:
    """Whether two specs have the same board."""
    return _board(one) == _board(other)


def _board(spec: SensorSpec) -> tuple[object, ...]:
    """All that a board is drawn from."""
    jaw = spec.jaw
    return spec.coil, spec.array, spec.fpc, spec.readout.chip, (jaw.length, jaw.width) if jaw is not None else None
