"""Response of a design: readings for any pose of the target.

The target's eddy currents are computed once for a range of poses.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import field, replace
from functools import cached_property

import numpy as np

from sitscad.assembly.places.bodies import target_gap, target_lines
from sitscad.basics.arrays import Array, ComplexArray, Flags
from sitscad.basics.record import record
from sitscad.estimates.circuits.solved_winding import SolvedWindings
from sitscad.estimates.circuits.tank import Tank
from sitscad.estimates.coil_estimates import Estimates
from sitscad.estimates.loads.pad import NoResponse, holding_loads, loaded_poses, soft_pad
from sitscad.estimates.loads.pressing import rests_on_pad
from sitscad.estimates.loads.working_range import normal_for_strain, required_range, shear_for_travel
from sitscad.estimates.response.response_arrays import Response, concatenate_responses
from sitscad.estimates.states.near import NearTarget, at_frequencies
from sitscad.estimates.states.placed import PoseRange, TargetPoses, level_poses, target_centre_at_rest
from sitscad.estimates.states.plate import (
    LOSSY,
    loss_error_bounds,
    sheet_spectrum,
    solving_work,
    stated_errors,
)
from sitscad.estimates.states.scan import FEW, Changes, ExactSolver, changes_at_poses
from sitscad.estimates.states.steps import BAND, solve_windings
from sitscad.estimates.targets.assembly import metal_behind
from sitscad.kernels.electromagnetics.metal.half_spaces import Reflector
from sitscad.kernels.electromagnetics.resonator import Network
from sitscad.kernels.electromagnetics.threads import one_thread
from sitscad.kernels.mechanics.elastomer import HELD_SHEAR, HELD_TILT, VALID_SHEAR, VALID_STRAIN
from sitscad.layout.board import Coil, Layout
from sitscad.spec.coil import CoilSpec
from sitscad.spec.materials import ElastomerPad, Target
from sitscad.spec.sensor import SensorSpec

Progress = Callable[[int, int], None]
"""Function that is called with the number of finished poses and the number of all poses."""


AT_ONCE = 250  # Number of poses in a batch without interpolation
LEAST_LOSS = 0.01  # Fraction of the coil's resistance: errors of smaller losses are relative to it


@record(eq=False)
class ResponseModel:
    """Coil readings of a design with a target, at any pose of the target.

    `solved` caches solutions of the target; the key is the range of poses and the frequencies. `known` caches the
    responses of `on_pad` by pose. `finer` multiplies the usual resolution, for convergence tests.
    """

    layout: Layout
    estimates: Estimates
    finer: float = 1.0
    solved: dict[tuple[object, ...], NearTarget] = field(default_factory=dict)
    known: dict[bytes, Response] = field(default_factory=dict)

    @cached_property
    def windings(self) -> SolvedWindings:
        """Solved windings with the metal around the coils at rest."""
        return solve_windings(self.layout)

    @property
    def spec(self) -> SensorSpec:
        """Spec whose metals have their conductivities at the required temperature."""
        return self.windings.spec

    @property
    def target(self) -> Target:
        """Target that moves over the coils."""
        assert self.spec.target is not None
        return self.spec.target

    @cached_property
    def behind(self) -> Reflector | None:
        """Metal behind the board. None if there is no metal."""
        return metal_behind(self.spec)

    @cached_property
    def rest(self) -> Array:
        """Centre (m) of the target's near face at rest, in the layout's coordinates."""
        return target_centre_at_rest(self.spec)

    @cached_property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency (Hz) at which the target's eddy currents are computed.

        They are the ends of the range of tank frequencies in all states, with a margin.
        """
        if self.estimates.target_band is not None:
            return self.estimates.target_band
        frequencies = [s.frequency for coil in self.estimates.coils for s in coil.states.values() if s.frequency > 0.0]
        if not frequencies:
            raise NoResponse("no tank of the design oscillates in any state, so there are no frequencies to look at")
        return BAND[0] * min(frequencies), BAND[1] * max(frequencies)

    @cached_property
    def state_cover(self) -> PoseRange | None:
        """Range of poses at which the estimates of states solved the target's eddy currents.

        None if they used the ratios of an endless plate instead.
        """
        poses = level_poses(self.estimates.states)
        if self.estimates.target_band is None or not len(poses):
            return None
        return self._cover(poses)

    @cached_property
    def tank(self) -> Tank:
        """Circuit between coils and converter: capacitor, pins and cable."""
        return Tank(self.estimates.readout.capacitance, self.spec.readout)

    @cached_property
    def network(self) -> Network:
        """Two-ports between the coils' contacts and the converter's pins, one for each coil."""
        return self.tank.network(np.array([coil.self_capacitance for coil in self.estimates.coils]))

    @cached_property
    def _volts(self) -> Array:
        # Every coil's amplitude (V) by its parallel resistance (ohm)
        readout, converter = self.estimates.readout, self.spec.readout.device
        codes = [readout.code_of(k) for k in range(len(self.layout.coils))]
        return np.array([math.nan if code is None else converter.amplitude(1.0, code, readout.high_current)
                         for code in codes])

    @one_thread
    def respond(
        self, poses: Array, frequency: float | None = None, tolerance: float | None = None,
        progress: Progress | None = None, within: Array | None = None,
    ) -> Response:
        """Return the response at (n, 6; m, rad) poses; see `Response`.

        Results at many poses are interpolated between computed poses if the additional error is small enough. Its limit
        is `tolerance`; if that is None, the stated error of the field solution. Errors are relative to the larger of a
        change and 1 % of the free inductance. `progress` is called with the numbers of finished and of all poses.

        Poses inside the range of the spec's states use the solution of the states. With `within` (further poses, 6),
        one solution serves the range of `poses` and `within` together, so that results change smoothly with the pose.
        """
        poses = np.asarray(poses, dtype=float).reshape(-1, 6)
        if not np.all(np.isfinite(poses)):
            raise ValueError("a pose has six finite numbers: metres and radians")
        if tolerance is not None and not tolerance > 0.0:
            raise ValueError(f"a tolerance is a number above 0, not {tolerance}")
        if within is not None or self.state_cover is None or len(poses) > FEW:
            cover = self._common_cover(poses if within is None else np.vstack([poses, within]))
            return self._respond(poses, cover, frequency, tolerance, progress)
        served = np.array([self.state_cover.serves(self._cover(pose)) for pose in poses], dtype=bool)
        parts, order = [], np.argsort(~served, kind="stable")
        for rows in (order[: served.sum()], order[served.sum() :]):
            if len(rows) or not len(poses):
                cover = self.state_cover if served[rows].all() else self._cover(poses[rows])
                parts.append(self._respond(poses[rows], cover, frequency, tolerance, progress))
        return concatenate_responses(parts).part(np.argsort(order).tolist())

    def _target_poses(self, poses: Array) -> TargetPoses:
        """Return the target in poses (n, 6; m, rad)."""
        return TargetPoses.from_rest(self.target, self.rest, poses)

    def _cover(self, poses: Array) -> PoseRange:
        """Return the range of poses for which the target's currents must be computed to serve poses (n, 6; m, rad)."""
        return self._target_poses(poses.reshape(-1, 6)).pose_range(
            self.target, self.spec.coil, self.layout.coils, self.spec.array.middle)

    def _common_cover(self, poses: Array) -> PoseRange:
        """Return the states' range of poses if it contains all poses (n, 6), otherwise the range of these poses."""
        cover = self._cover(poses)
        return self.state_cover if self.state_cover is not None and self.state_cover.serves(cover) else cover

    @one_thread
    def own_inductance_changes(self, poses: Array, frequency: float) -> ComplexArray:
        """Return the change of each coil's own inductance (n, coils; H, complex) by the target at (n, 6) poses.

        The frequency (Hz) is within the tanks' band, and currents are even across the tracks. One solution serves all
        poses. No tank is solved.
        """
        near, target_poses = self._near(self._common_cover(poses), self.band), self._target_poses(poses)
        return np.einsum("pcc->pc", near.changes(target_poses).complex_at(np.full(len(poses), frequency)))

    def _respond(
        self, poses: Array, cover: PoseRange, frequency: float | None, tolerance: float | None,
        progress: Progress | None,
    ) -> Response:
        """Return the response at (n, 6) poses inside `cover`, by one solution of the target."""
        target_poses = self._target_poses(poses)
        scale, usual = self.windings.winding.inductance, math.sqrt(self.band[0] * self.band[1])

        def changes_by(near: NearTarget) -> Changes:
            def exact(some: Array) -> tuple[ComplexArray, ComplexArray]:
                there = self._target_poses(some)
                return near.plate.changes(there.turns, there.places)

            by_plate = ExactSolver(near.plate.frequencies, exact, sheet_spectrum(self.spec.coil.size, self.spec.target))
            return changes_at_poses(by_plate, poses, scale, tolerance, progress)

        at_tank = self._near(cover, self.band)
        changes = changes_by(at_tank)
        frequencies = {coil.name: next(iter(coil.states.values())).frequency
                       for coil in self.estimates.coils if coil.states}
        start = np.array([frequencies.get(coil.name, usual) for coil in self.layout.coils])
        terminals = at_tank.oscillations(target_poses, changes, self.tank, self.network, start)
        near, shown, taken_at = at_tank, changes, terminals.frequency
        inductance, resistance = (np.where(np.isfinite(taken_at), part, np.nan)
                                  for part in (terminals.inductance, terminals.resistance))
        if frequency is not None:
            near = self._near(cover, (frequency,))
            shown = changes_by(near)
            taken_at = np.full_like(taken_at, frequency)
            inductance, resistance = at_frequencies(near.impedances(target_poses, shown), taken_at, self.tank)
        filled = np.where(np.isfinite(taken_at), taken_at, usual)
        change, lost = shown.at(filled)
        mirror, at = near.plate.mirror_error + LOSSY * near.plate.is_over_a_poor_mirror, float(filled.mean())
        mirror += cover.error
        size, part = np.abs(shown.total).max(axis=0), cover.part(self.target)
        errors = stated_errors(part, self.spec.coil, change, size, scale, target_poses.lowest, shown.error, mirror)
        sizes = np.einsum("pcc->pc", size)
        losses = loss_error_bounds(part, self.spec.coil, lost, sizes, scale, target_poses.lowest, shown.error, mirror,
                                   at)
        pad, wrench = self.spec.elastomer, holding_loads(self.spec, poses)
        strain = None if pad is None else -poses[:, 2] / pad.thickness
        conversion, ran = self.estimates.readout.conversion, terminals.frequency
        counts = np.full_like(ran, np.nan) if conversion is None else conversion.read(ran)
        return Response(
            coils=tuple(coil.name for coil in self.layout.coils), poses=poses, inductance=inductance,
            resistance=resistance, target_change=change, target_change_error=errors, target_resistance=lost,
            target_resistance_error=losses / np.fmax(lost, LEAST_LOSS * resistance), taken_at=taken_at, frequency=ran,
            counts=counts, parallel_resistance=terminals.parallel_resistance,
            amplitude=terminals.parallel_resistance * self._volts,
            strain=strain, force=None if wrench is None else wrench[0], moment=None if wrench is None else wrench[1],
            notes=tuple(_notes(pad if rests_on_pad(self.spec) else None, poses, target_poses.lowest, strain, ran,
                               errors, tolerance)),
            gap=float(target_gap(self.spec) or math.nan), glue=target_lines(self.spec),
        )

    @one_thread
    def respond_to_loads(
        self, loads: Array, is_level: Flags | None = None, frequency: float | None = None,
        tolerance: float | None = None, progress: Progress | None = None,
    ) -> Response:
        """Return the response under loads (n, 3 or 5; N, N m; see `pad.loaded_poses`), with poses by the pad's law.

        `is_level` (n) is True for loads under which the target stays level; None means all loads.
        """
        loads = np.asarray(loads, dtype=float)
        loads = loads.reshape(-1, loads.shape[-1] if loads.ndim > 1 else 3)
        level = np.ones(len(loads), dtype=bool) if is_level is None else is_level
        poses, pad_notes = loaded_poses(self.spec, loads, level)
        response = self.respond(poses, frequency, tolerance, progress)
        notes = tuple((*pose_notes, note) if note else pose_notes
                      for pose_notes, note in zip(response.notes, pad_notes, strict=True))
        return replace(response, force=loads[:, [1, 2, 0]] * [1.0, 1.0, -1.0], notes=notes)

    @cached_property
    def pad_ends(self) -> Array:
        """Poses (n, 6; m, rad) at the limits up to which the pad's law is trusted, one of them slightly tilted.

        The limits are the largest compression and the largest shear. If moments are measured, the corners of the
        required range follow.
        """
        shear = shear_for_travel(self.spec, VALID_SHEAR)
        normal = normal_for_strain(soft_pad(self.spec), VALID_STRAIN)
        loads = np.array([[normal, 0.0, 0.0], [0.0, shear, 0.0], [0.0, 0.0, shear]])
        poses = loaded_poses(self.spec, loads)[0]
        poses[0, 3:5] = 0.02
        required = required_range(self.spec)
        if not required.has_moments:
            return poses
        return np.vstack([poses, loaded_poses(self.spec, required.corners,
                                              np.zeros(len(required.corners), dtype=bool))[0]])

    def on_pad(self, poses: Array) -> Response:
        """Return the response at (n, 6; m, rad) poses, each computed once, cached, and never interpolated.

        One computation of the target's currents serves all poses within the pad's limits. Raises NoResponse without a
        pad.
        """
        # + 0.0 removes the sign of zeros, so that equal poses have equal bytes
        poses = np.asarray(poses, dtype=float).reshape(-1, 6) + 0.0
        new = [row for key, row in {row.tobytes(): row for row in poses}.items() if key not in self.known]
        for first in range(0, len(new), AT_ONCE):
            some = np.array(new[first : first + AT_ONCE])
            response = self.respond(some, within=self.pad_ends)
            self.known.update({row.tobytes(): response.part([k]) for k, row in enumerate(some)})
        return concatenate_responses([self.known[row.tobytes()] for row in poses])

    def lowest(self, poses: Array) -> Array:
        """Return the height (m) of the target's lowest point over the board at (n, 6) poses.

        Negative inside the board.
        """
        return self._target_poses(np.asarray(poses, dtype=float).reshape(-1, 6)).lowest

    def _near(self, cover: PoseRange, band: tuple[float, ...]) -> NearTarget:
        """Return the solution of target and coils for all poses of `cover`; it is cached.

        `band` (Hz) is one frequency, or the two ends of a range.
        """
        if (cover, band) not in self.solved:
            frequency = math.sqrt(band[0] * band[-1])
            _require_affordable(self.target, self.spec.coil, self.layout.coils, frequency, self.behind, cover)
            self.solved[cover, band] = NearTarget(self.windings, cover, band, self.finer)
        return self.solved[cover, band]


MAX_WORK = 1600.0**3
"""Largest work (`solving_work`) to compute a target's currents for a response: half a minute of processor time."""

SECONDS_PER_WORK = 7e-9
"""Processor time (s) of a unit of `solving_work`, for the solutions at both frequencies of a band together.

The estimate is within a factor of 1.5 for plates of 60 to 150 mm, and for discs of 14 to 40 mm over coils on ferrite. A
plate estimated at 25 s took 34 s on a busy processor; discs estimated at 40 s and 61 s took 38 s and 88 s.
"""


def _require_affordable(
    target: Target, coil: CoilSpec, coils: Sequence[Coil], frequency: float, behind: Reflector | None, cover: PoseRange
) -> None:
    """Raise NoResponse if solving the target for the poses of `cover` takes more work than `MAX_WORK`.

    `behind` is the metal behind the board.
    """
    work = solving_work(target, coil, coils, frequency, behind, cover)
    if work <= MAX_WORK:
        return
    x, y = (1e3 * side for side in cover.part(target).size)
    raise NoResponse(
        f"target of {x:.3g} x {y:.3g} mm: about {SECONDS_PER_WORK * work:.0f} s of processor time to solve, "
        f"{SECONDS_PER_WORK * MAX_WORK:.0f} s at most (poses {1e3 * cover.lowest:.3g} mm above the board and "
        f"{1e3 * cover.reach:.0f} mm from the coils' middle). Use higher or nearer poses, or a smaller target"
    )


@one_thread
def response_model(layout: Layout, estimates: Estimates) -> ResponseModel:
    """Return the response model of a design. Raises `NoResponse` if the design has no target."""
    target = layout.spec.target
    if target is None:
        raise NoResponse("the spec has no target: nothing moves over the coils")
    return ResponseModel(layout, estimates)


STRAIN_LIMIT = 0.35  # Strain of the pad beyond which no model of it is trusted


SHEARED = "the pad is sheared by more than half its thickness: what its law says of force and pose is extrapolated"
"""Note for poses whose shear is beyond the tested range of the pad's law."""
TILTED = "the target is tilted by more than 5 degrees: what the pad's law says of force and pose is extrapolated"
"""Note for poses whose tilt is beyond the tested range of the pad's law."""


def _notes(
    pad: ElastomerPad | None, poses: Array, lowest: Array, strain: Array | None, frequency: Array, errors: Array,
    tolerance: float | None,
) -> list[tuple[str, ...]]:
    """Return notes for each pose (n) of a target, on a pad or without a pad.

    They report contact of target and board, and a pad beyond its limits of strain, shear or tilt. They also report a
    tank that does not oscillate, and a stated error above the tolerance. `lowest` (n; m) is the height of the target's
    lowest point over the board, and `errors` (n, coils, coils) are the relative errors of inductance changes.
    """
    notes_by_pose = []
    for k, pose in enumerate(poses):
        notes = []
        if lowest[k] < 0.0:
            notes.append(f"contact: the target's lowest point would be {-1e3 * lowest[k]:.3g} mm inside the board")
        if strain is not None and strain[k] > STRAIN_LIMIT:
            notes.append(f"the pad would be pressed by {100.0 * strain[k]:.0f} % of its thickness")
        # beyond the tested range of the pad's law, which determines force and pose
        if pad is not None and np.hypot(*pose[:2]) > (1.0 + 1e-6) * HELD_SHEAR * pad.thickness:
            notes.append(SHEARED)
        if pad is not None and np.hypot(*pose[3:5]) > (1.0 + 1e-6) * HELD_TILT:
            notes.append(TILTED)
        if not np.all(np.isfinite(frequency[k])):
            notes.append("the tank does not oscillate")
        worst = float(np.diagonal(errors[k]).max())
        if tolerance is not None and worst > tolerance:
            notes.append(f"the stated error is above the tolerance of {tolerance:g}, which limits what a map of many "
                         f"poses adds to it: no pose is solved better than {worst:.1g}")
        notes_by_pose.append(tuple(notes))
    return notes_by_pose
