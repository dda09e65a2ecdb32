"""A spec and what follows from it, each thing worked out when it is first asked for, and once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field, replace
from functools import cached_property, wraps
from typing import TYPE_CHECKING, Any, TypeVar, cast

from sitscad.basics.arguments import checked_arguments
from sitscad.basics.record import kept, record
from sitscad.kernels.converters.converter import Converter
from sitscad.spec.sensor import SensorSpec, without_text

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sitscad.assembly.places.bodies import Body
    from sitscad.assembly.places.motions import Motions
    from sitscad.basics.arrays import Array
    from sitscad.basics.check_results import Closing, Measure
    from sitscad.estimates import Estimates
    from sitscad.estimates.performance.curves import Curves
    from sitscad.estimates.performance.points import Felt
    from sitscad.estimates.performance_values import Loads, Performance
    from sitscad.estimates.response.model import ResponseModel
    from sitscad.estimates.response.values import Response
    from sitscad.estimates.states.cells import CellCrosstalk, CellGroup, CellTable
    from sitscad.estimates.tolerances.scatter import Scatter
    from sitscad.layout.board import Layout
    from sitscad.layout.panel import Panel
    from sitscad.layout.routing.escape import SearchLimit

Kept = TypeVar("Kept")

ROOM_TEMPERATURE = 20.0
"""The temperature (degrees Celsius) at which boards are tested and sensors are switched on."""


def _without_text(make: Callable[[Design], Kept]) -> cached_property[Kept]:
    """What costs most, kept by the design without text: checks and files of one build ask for it alike."""

    @wraps(make)
    def kept(design: Design) -> Kept:
        return make(design) if design.bare is design else cast(Kept, getattr(design.bare, make.__name__))

    return cached_property(kept)


def _of_one_cell(make: Callable[[Design], Kept]) -> cached_property[Kept]:
    """Like `_without_text`; for a sensor with cells it is the value of the cell with the least signal."""

    @wraps(make)
    def kept(design: Design) -> Kept:
        owner = design.bare.one
        return make(design) if owner is design else cast(Kept, getattr(owner, make.__name__))

    return cached_property(kept)


@record
class Design:
    """A spec with its layout, its scene and its estimates: what checks, searches, packages and programs share.

    Nothing is worked out before it is asked for, and nothing twice. ``given_layout`` and ``given_estimates`` are taken
    for its own where somebody has them already; they have to be those of the spec. ``of_board`` is what was worked out
    of the board alone, which designs with the same board have in common.
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

    def once(self, name: str, make: Callable[[], Kept]) -> Kept:
        """What `make` gives, made once and kept under a name: several rules look at the same distances."""
        return kept(self, f"once: {name}", make)

    def once_a_board(self, name: str, make: Callable[[], Kept]) -> Kept:
        """What `make` gives of the drawn board alone (what `has_board_of` compares), made once for all designs with it:
        trials of another pad measure no copper anew.
        """
        if name not in self.of_board:
            self.of_board[name] = make()
        return cast(Kept, self.of_board[name])

    @cached_property
    def layout(self) -> Layout:
        """The design as drawn."""
        if self.given_layout is not None:
            return self.given_layout
        from sitscad.layout import lay_out

        return lay_out(self.spec)

    @cached_property
    def scene(self) -> tuple[Body, ...]:
        """The bodies of the sensor in their places; raises `PartsError` where shield and standoff contradict."""
        from sitscad.assembly.places.stack import stack

        return stack(self.layout)

    @cached_property
    def fit(self) -> tuple[Measure, ...]:
        """What is measured of the sensor in its jaw; nothing without one, or where the shield does not fit."""
        from sitscad.assembly.places.fit import measures

        return measures(self.layout)

    @cached_property
    def closing(self) -> Closing | None:
        """How the sensor's jaws close; None without a jaw, or where the shield does not fit."""
        from sitscad.assembly.places.fit import closing

        return closing(self.layout) if self.fit else None

    @cached_property
    def estimates(self) -> Estimates:
        """The electrical numbers."""
        if self.given_estimates is not None:
            return self.given_estimates
        from sitscad.estimates import estimated

        return estimated(self.layout)

    @cached_property
    def cells(self) -> tuple[Design, ...]:
        """Every cell as a sensor of its own, read by the converters and capacitors of the whole.

        A sensor without cells is its own only cell.
        """
        if self.spec.cells is None:
            return (self,)
        coils, found = self.spec.cells.coils, []
        for k in range(len(self.layout.coils) // coils):
            layout, own = self.layout.cell(k + 1), self.estimates.part(k * coils, (k + 1) * coils)
            readout = replace(layout.spec.readout, capacitance=own.readout.capacitance)
            spec = replace(layout.spec, readout=readout, name=f"{self.spec.name}-cell-{k + 1}")
            found.append(Design(spec, replace(layout, spec=spec), own))
        return tuple(found)

    def cell(self, number: int) -> Design:
        """One of the `cells` by its number, from 1. Raises ValueError if there is none of that number."""
        if not 1 <= number <= len(self.cells):
            raise ValueError(f"there is no cell {number}: the sensor has {len(self.cells)}")
        return self.cells[number - 1]

    @cached_property
    def weakest_cell(self) -> int:
        """The number of the cell with the least signal: of the longest leads, or the most webs."""
        if self.spec.cells is None:
            return 1
        from sitscad.estimates.states.cells import weakest_cell

        return weakest_cell(self.spec, self.estimates)

    @property
    def one(self) -> Design:
        """The cell with the least signal, which stands for all in curves and solutions; itself without cells."""
        return self.cell(self.weakest_cell)

    @property
    def extremes(self) -> dict[int, Design]:
        """The cells by which all are judged, by number: that with the least signal, then that whose pad is softest.

        They may be one cell; a sensor without cells is its own cell 1.
        """
        softest = (group.extremes[0] for group in self.cell_groups[:1])
        return {number: self.cell(number) for number in (self.weakest_cell, *softest)}

    @_without_text
    def cell_groups(self) -> tuple[CellGroup, ...]:
        """Cells grouped by identical pads and drive, without performance; empty without cells."""
        if self.spec.cells is None:
            return ()
        from sitscad.estimates.states.cells import cell_groups

        return cell_groups(self.layout, self.estimates, self.crosstalk)

    @_without_text
    def cell_table(self) -> CellTable:
        """The cell groups with their performance, which takes seconds of processor time for each group.

        It has no groups without cells, and if a cell has no performance.
        """
        from sitscad.estimates.performance_values import worst_of
        from sitscad.estimates.states.cells import NO_CELLS, CellTable

        found = []
        for group in self.cell_groups:
            felt = [self.cell(number).performance for number in group.extremes]
            if not all(felt):
                return NO_CELLS
            found.append(replace(group, felt=tuple(map(worst_of, zip(*felt, strict=True)))))
        return CellTable(tuple(found), self.weakest_cell, tuple(coil.name for coil in self.one.layout.coils))

    @_without_text
    def crosstalk(self) -> CellCrosstalk | None:
        """What cells read of each other; None without cells, and where they have no signal."""
        if self.spec.cells is None:
            return None
        from sitscad.estimates.states.cells import cell_crosstalk

        return cell_crosstalk(self.layout, self.estimates)

    @_without_text
    def response(self) -> ResponseModel:
        """What the coils read when the target moves.

        Raises `NoResponse` if nothing can respond, and for a sensor with cells: each `cell` has its own response.
        """
        if self.spec.cells is not None:
            from sitscad.estimates.loads.pad import NoResponse

            count = len(self.cells)
            raise NoResponse(f"the sensor has {count} cells, each with a target of its own: ask for one, --cell 1")
        from sitscad.estimates.response.model import response_model

        return response_model(self.layout, self.estimates)

    @_of_one_cell
    def solved(self) -> Felt:
        """What the sensor feels by its response; raises `NoResponse` where there is nothing to feel."""
        from sitscad.estimates.performance.points import feel

        return feel(self.layout, self.estimates, self.response)

    @_without_text
    def performance(self) -> tuple[Performance, ...]:
        """What the sensor feels, in newtons, at rest, half and full load; nothing where it has no target that conducts,
        no pad under it that holds it, or no tank that oscillates. It costs seconds of processor time, once a design.

        For a sensor with cells, each figure is the worst of all cells (`cell_table` has each), and limits of production
        are those of all coils.
        """
        if self.spec.cells is None:
            return self._performance[0]
        from sitscad.estimates.performance.points import production_limits
        from sitscad.estimates.performance_values import worst_of

        points = map(worst_of, zip(*(group.felt for group in self.cell_table.groups), strict=True))
        return tuple(replace(point, production=production_limits(self.estimates)) for point in points)

    @property
    def no_performance(self) -> str:
        """Reason why the sensor has no `performance`; empty if it has one."""
        return self._performance[1]

    @_of_one_cell
    def _performance(self) -> tuple[tuple[Performance, ...], str]:
        # The performance without cells, or the reason why there is none.
        from sitscad.estimates.loads.pad import NoResponse
        from sitscad.estimates.performance.points import performance

        try:
            return performance(self.solved, self.response, lambda: self.twins), ""
        except NoResponse as error:
            return (), str(error)

    @_of_one_cell
    def curves(self) -> Curves | None:
        """What a data sheet draws of the sensor; None where `performance` is nothing."""
        from sitscad.estimates.performance.curves import curves

        return curves(self.solved) if self.performance else None

    @_of_one_cell
    def felt(self) -> Felt | None:
        """What the sensor feels, for checks: `solved`, or at the screen level by shares.

        None if it feels nothing, or if its target is too large to be solved in a check.
        """
        from sitscad.estimates.loads.pad import NoResponse
        from sitscad.estimates.performance.points import feel

        try:
            if self.estimates.is_rough:
                return feel(self.layout, self.estimates)
            return self.solved if self.estimates.is_solved else None
        except NoResponse:
            return None

    @_of_one_cell
    def twins(self) -> tuple[Loads, Loads] | None:
        """Two loads (N) within what is required that give one reading, None where none are found: said alike by checks
        and papers.
        """
        if self.felt is None or not self.felt.is_range_held:
            return None
        return self.felt.working.twins(lambda: self.solved.bench)

    @cached_property
    def scatter(self) -> tuple[Scatter, ...]:
        """The scatter of one unit from the next, cause by cause."""
        from sitscad.estimates.tolerances.scatter import manufacturing_scatter

        return manufacturing_scatter(self.spec, self.estimates)

    @cached_property
    def at_room_temperature(self) -> Design:
        """This design at 20 degrees Celsius: itself, unless `requirements.temperature` is another."""
        if self.estimates.temperature == ROOM_TEMPERATURE:
            return self
        from sitscad.estimates import estimated

        known = self.estimates.is_solved
        return Design(self.spec, self.layout, estimated(self.layout, temperature=ROOM_TEMPERATURE, is_solved=known))

    @cached_property
    def bench_estimates(self) -> Estimates:
        """The electrical numbers at 20 degrees Celsius, at which boards are tested, with what a meter reads of them."""
        from sitscad.estimates.states.steps import metered

        return replace(self.at_room_temperature.estimates, metered=metered(self.layout, ROOM_TEMPERATURE))

    @cached_property
    def panel(self) -> Panel | None:
        """The panel in which the boards are ordered; None where they are ordered singly."""
        from sitscad.layout.panel import plan

        return plan(self.layout)

    @cached_property
    def coupon_estimates(self) -> Estimates | None:
        """The electrical estimate of the panel's coupon, which lies in free air; None where there is no coupon."""
        if self.panel is None or self.panel.coupon is None:
            return None
        from sitscad.estimates import estimated

        return estimated(self.panel.coupon, temperature=ROOM_TEMPERATURE)  # it is measured on the bench

    @cached_property
    def solids(self) -> tuple[Any, ...]:
        """The solids (importing a CAD kernel)."""
        from sitscad.assembly.solids import solids

        return solids(self.layout)

    @cached_property
    def whole(self) -> tuple[Any, ...]:
        """Every piece of the assembly as it is glued and closed (importing a CAD kernel)."""
        from sitscad.assembly.solids.whole import whole
        from sitscad.estimates.loads.gluing import hard_adhesive

        return whole(self.layout, self.solids, hard_adhesive(self.layout))

    @cached_property
    def aids(self) -> tuple[Any, ...]:
        """The solids of what the sensor is put together with: jig and mould (importing a CAD kernel)."""
        from sitscad.assembly.solids import aids

        return aids(self.layout)

    @property
    def converter(self) -> Converter:
        """What the converter can do: its data sheet's limits and formulas."""
        return self.spec.readout.device

    @property
    def distance_key(self) -> str:
        """Where the spec says how far apart the coils stand; of a coil alone, how large it is."""
        keys = {"single": "coil.outer_diameter", "explicit": "array.centres"}
        return keys.get(self.spec.array.pattern, "array.pitch")

    @cached_property
    def bare(self) -> Design:
        """This design without the text that it was read from: comments and file name cannot change what is drawn
        from it. Layout and estimates are this one's.
        """
        spec, source = without_text(self.spec), self.spec.source
        if (source, source.files) == (spec.source, spec.source.files):
            return self
        return Design(spec, replace(self.layout, spec=spec), self.estimates)

    def has_board_of(self, changed: SensorSpec) -> bool:
        """Whether a changed design has the same board."""
        return _board(changed) == _board(self.spec)

    def drawn(self, changed: SensorSpec, searches: SearchLimit | None = None) -> Design:
        """A changed design, drawn anew unless the board stays as it is."""
        from sitscad.layout import arrange

        if self.has_board_of(changed):
            return Design(changed, replace(self.layout, spec=changed), of_board=self.of_board)
        return Design(changed, arrange(changed, searches))


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


def _board(spec: SensorSpec) -> tuple[object, ...]:
    """All that a board is drawn from."""
    jaw = spec.jaw
    return spec.coil, spec.array, spec.fpc, spec.readout.chip, (jaw.length, jaw.width) if jaw is not None else None
