"""Field solution of target and coils for all poses of a range, shared by the estimates of states and by responses."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np

from sitscad.assembly.places.state import REST, REST_POSE, State
from sitscad.basics.arrays import Array, ComplexArray
from sitscad.basics.record import record, replace
from sitscad.estimates.circuits.coils import coil_circuits
from sitscad.estimates.circuits.solved_winding import SolvedWinding, SolvedWindings, solve_winding
from sitscad.estimates.circuits.tank import Tank
from sitscad.estimates.states.placed import LEAST_HEIGHT, PoseRange, TargetPoses, target_centre_at_rest
from sitscad.estimates.states.plate import TargetPlate, plate_over_jaw, sheet_spectrum
from sitscad.estimates.states.scan import Changes
from sitscad.estimates.targets.assembly import AssemblyStates, Surroundings, metal_behind, metal_sheet
from sitscad.estimates.targets.finite_target import NO_RATIOS
from sitscad.estimates.windings.neighbours import idle_coil_load, impedance_with_idle_coils
from sitscad.kernels.electromagnetics.metal.half_spaces import Reflector, reflected_inductances
from sitscad.kernels.electromagnetics.polynomials import Interpolant, barycentric_weights, chebyshev_points
from sitscad.kernels.electromagnetics.resonator import Network, Oscillations, oscillate

HEIGHTS = 4
"""Number of target heights, evenly spaced in ln(height), at which current crowding in the tracks is computed."""

POINTS = 8
"""Number of Chebyshev points in ln(frequency). Values that do not depend on the pose are computed there."""


@record(eq=False)
class NearTarget:
    """Field solution of target and coils for all poses of a range `cover`, at the frequencies `band`.

    `band` (Hz) is one frequency, or the two ends of a range. `windings` are the solutions of the coils' windings. Each
    part is computed at its first use and cached. `finer` multiplies the usual resolution of the target.
    """

    windings: SolvedWindings
    cover: PoseRange
    band: tuple[float, ...]
    finer: float = 1.0

    @cached_property
    def plate(self) -> TargetPlate:
        """Target with the metal behind the board, from which changes at any pose are computed."""
        return plate_over_jaw(self.windings.layout, self.band, self.cover, self.finer)

    @cached_property
    def behind(self) -> Reflector | None:
        """Metal behind the board. None if there is no metal."""
        return metal_behind(self.windings.spec)

    @cached_property
    def heights(self) -> Array:
        """Logarithms of the heights (m) of an infinite plate at which `crowding` is computed."""
        lowest = self.cover.lowest
        thickest = max(2.0 * float(target_centre_at_rest(self.windings.spec)[2]), 3.0 * lowest)
        return np.log(np.geomspace(max(lowest, LEAST_HEIGHT), thickest, HEIGHTS))

    @cached_property
    def _assembly(self) -> AssemblyStates:
        # The coils without a target, then with an infinite plate at the cover's lowest height
        nothing = Surroundings(State(REST, REST_POSE), None, self.behind)
        states = nothing, replace(nothing, above=self._infinite_plate(self.cover.lowest))
        return replace(self.windings.assembly, states=states)

    @cached_property
    def _winding(self) -> SolvedWinding:
        windings = self.windings
        conductivity = windings.winding.conductivity
        return solve_winding(windings.spec.coil, windings.layout.coils[0], self._assembly, conductivity,
                             windings.method, windings.tolerance)

    def _infinite_plate(self, height: float) -> Reflector:
        """Return an infinite plate at a `height` (m), with the target's metal and thickness."""
        target = self.windings.spec.target
        assert target is not None
        return Reflector(max(height, LEAST_HEIGHT), (metal_sheet(target.material, target.thickness),))

    @cached_property
    def bare(self) -> Callable[[Array], ComplexArray]:
        """Function of frequencies (n; Hz) that returns the inductance matrices at the contacts without the target.

        The matrices are (n, coils, coils; H, complex).
        """
        return interpolate_over_band(self.band, self._bare)

    @cached_property
    def crowding(self) -> Callable[[Array], ComplexArray]:
        """Function of frequencies (n; Hz) that returns the inductance change added by current crowding: (n, heights).

        It is a fraction of the change by an infinite plate at each of `heights`, for current that is even across the
        tracks.
        """
        heights = np.exp(self.heights).tolist()
        return interpolate_over_band(
            self.band, lambda at: np.stack([self.crowding_at_height(at, z, heights) for z in heights], axis=1), 4)

    def changes(self, target_poses: TargetPoses) -> Changes:
        """Return the target's changes of the coils' inductance matrix (H) in a few poses, each solved exactly."""
        solved = self.plate.changes(target_poses.turns, target_poses.places, is_single=True)
        return Changes(self.plate.frequencies, *solved,
                       spectrum=sheet_spectrum(self.windings.spec.coil.size, self.windings.spec.target))

    def impedances(self, target_poses: TargetPoses, changes: Changes) -> Callable[[Array], ComplexArray]:
        """Return a function of frequencies (n; Hz) that returns the inductance matrices at the contacts in n poses.

        The matrices are (n, coils, coils; H, complex). Matrix number k is for pose number k at frequency number k.
        """
        heights = self.log_heights_over_coils(target_poses)
        diagonal = np.arange(heights.shape[1])

        def whole(frequencies: Array) -> ComplexArray:
            change = changes.complex_at(frequencies)
            more = _interpolate(self.heights, self.crowding(frequencies), heights)
            change[:, diagonal, diagonal] *= 1.0 + more
            return self.bare(frequencies) + change

        return whole

    def interpolated_crowding(self, frequencies: Array, height: float) -> ComplexArray:
        """Return the inductance change (n) that current crowding adds, as a fraction of the change by the target.

        It is interpolated between `heights`. `frequencies` (n) are in Hz, `height` is the logarithm of the target's
        height (m).
        """
        return _interpolate(self.heights, self.crowding(frequencies), np.full((len(frequencies), 1), height))[:, 0]

    def log_heights_over_coils(self, target_poses: TargetPoses) -> Array:
        """Return logarithms of the target's heights (m) over the coils' centres: (poses, coils)."""
        return target_poses.heights(np.array([coil.placement.centre for coil in self.windings.layout.coils]))

    def oscillations(
        self, target_poses: TargetPoses, changes: Changes, tank: Tank, network: Network, start: Array
    ) -> Oscillations:
        """Return the oscillation of every coil's tank in every pose: (poses, coils).

        `network` lies between the coils' contacts and the converter's pins. The search begins at the frequencies
        `start` (coils; Hz).
        """
        whole = self.impedances(target_poses, changes)
        return oscillate(network, lambda at: at_frequencies(whole, at, tank),
                         tank.converter.limit("drive_delay"), np.tile(start, (len(target_poses.places), 1)))

    def _bare(self, frequencies: Array) -> ComplexArray:
        windings, assembly = self.windings, replace(self._assembly, states=self._assembly.states[:1])
        circuits = coil_circuits(windings.layout, self._winding, windings.matrix, assembly, NO_RATIOS)
        matrices = np.zeros((frequencies.size, len(circuits), len(circuits)), dtype=complex)
        centres = [coil.centre for coil in windings.layout.coils]
        for i, circuit in enumerate(circuits):
            inductance, resistance = circuit.impedance_with_open_neighbours(REST, frequencies)
            matrices[:, i, i] = inductance - 1j * resistance / (2.0 * math.pi * frequencies)
            for j in range(i):
                distance = round(math.dist(centres[i], centres[j]), 9)
                change = circuit.reflections[REST].mutual((i, j), distance, frequencies)
                matrices[:, i, j] = matrices[:, j, i] = windings.matrix[i, j] + change
        return matrices

    def crowding_at_height(self, frequencies: Array, height: float, expected: Sequence[float] = ()) -> ComplexArray:
        """Return the inductance change (n) that current crowding adds near an infinite plate.

        It is a fraction of the change by the plate for current that is even across the tracks. `frequencies` (n) are in
        Hz. The plate is at a `height` (m). `expected` are heights (m) for which further calls follow; they are solved
        together.
        """
        crowding, spectrum, above = self._winding.crowding, self._winding.spectrum, self._infinite_plate(height)
        if crowding is None or spectrum is None:
            return np.zeros(frequencies.size, dtype=complex)
        plates = [(self._infinite_plate(z), self.behind) for z in expected]
        crowded = crowding.changes(frequencies, above, self.behind, [*plates, (None, self.behind)])
        crowded = crowded - crowding.changes(frequencies, None, self.behind)
        whole = reflected_inductances(spectrum, frequencies, above, self.behind, (0.0,))
        whole = whole - reflected_inductances(spectrum, frequencies, None, self.behind, (0.0,))
        return np.asarray(crowded / whole[:, 0])


def _interpolate(places: Array, values: ComplexArray, at: Array) -> ComplexArray:
    """Return row i of a polynomial through `values` (n, m) at `places` (m), evaluated at row i of `at` (n, k): (n, k).

    The places are evenly spaced. Beyond the first and the last place, the value is constant.
    """
    even = np.array([(-1) ** k * math.comb(len(places) - 1, k) for k in range(len(places))], dtype=float)
    weights = barycentric_weights(places, np.clip(at, places[0], places[-1]).ravel(), even)
    return np.asarray(np.einsum("nkm,nm->nk", weights.reshape(*at.shape, -1), values))


def at_frequencies(impedances: Callable[[Array], ComplexArray], frequencies: Array, tank: Tank) -> tuple[Array, Array]:
    """Return inductance (H) and resistance (ohm) at the contacts: two arrays (n, coils).

    Each coil has its own `frequencies` (n, coils; Hz). `impedances` is a function of n frequencies (Hz) that returns
    inductance matrices: number k is for pose number k at frequency number k.
    """
    contacts = [impedance_with_idle_coils(k, impedances(at), at, idle_coil_load(2.0 * math.pi * at, tank.readout))
             for k, at in enumerate(frequencies.T)]
    inductance, resistance = (np.stack(parts, axis=1) for parts in zip(*contacts, strict=True))
    return inductance, resistance


def interpolate_over_band(
    band: tuple[float, ...], exact: Callable[[Array], ComplexArray], points: int = POINTS
) -> Callable[[Array], ComplexArray]:
    """Return a function that interpolates `exact` over a band (Hz): frequencies (m; Hz) to values (m, ...).

    It runs through Chebyshev points of ln f between the two ends of the band, and is constant outside. If the band is
    one frequency, it returns the value at that frequency.
    """
    if len(band) == 1:
        value = exact(np.array(band))
        return lambda frequencies: np.repeat(value, frequencies.size, axis=0)
    low, high = band
    values = exact(np.exp(chebyshev_points(math.log(low), math.log(high), points)))
    through = Interpolant(np.log([low]), np.log([high]), values)
    return lambda frequencies: through(np.log(frequencies)[:, None])
