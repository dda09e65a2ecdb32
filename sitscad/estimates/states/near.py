"""The target and the coils, solved for all poses of a cover: what states and responses have in common."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property

import numpy as np

from sitscad.assembly.places.state import REST, REST_POSE, State
from sitscad.basics.arrays import Array, ComplexArray
from sitscad.basics.record import record, replace
from sitscad.estimates.circuits.coils import coil_circuits
from sitscad.estimates.circuits.solved_winding import SolvedWinding, solve_winding
from sitscad.estimates.circuits.tank import Tank
from sitscad.estimates.circuits.wound import Wound
from sitscad.estimates.states.placed import LEAST_HEIGHT, Cover, Placed, at_rest
from sitscad.estimates.states.plate import TargetPlate, endless_like, plate_over_jaw
from sitscad.estimates.states.scan import Changes
from sitscad.estimates.targets.assembly import AssemblyStates, Surroundings, metal_behind, sheet_of
from sitscad.estimates.targets.finite_target import NO_SHARES
from sitscad.estimates.windings.neighbours import at_contacts, idle_load
from sitscad.kernels.electromagnetics.metal.half_spaces import Reflector, reflected_inductances
from sitscad.kernels.electromagnetics.polynomials import Interpolant, chebyshev_points, shares
from sitscad.kernels.electromagnetics.resonator import Network, Oscillations, oscillate

HEIGHTS = 4
"""Heights, evenly spaced in their logarithm, at which the crowding of the currents is worked out."""

POINTS = 8
"""Chebyshev points in ln f at which values that do not depend on the pose are known."""


@record(eq=False)
class NearTarget:
    """Target and coils for all poses of a cover, at the frequencies of a band: one (Hz), or the two ends of a range.

    Every part is solved when it is first asked for, and once. `finer` is how many times finer than usual the target is
    resolved.
    """

    wound: Wound
    cover: Cover
    band: tuple[float, ...]
    finer: float = 1.0

    @cached_property
    def plate(self) -> TargetPlate:
        """The target."""
        return plate_over_jaw(self.wound.layout, self.band, self.cover, self.finer)

    @cached_property
    def behind(self) -> Reflector | None:
        """Metal behind the board."""
        return metal_behind(self.wound.spec)

    @cached_property
    def heights(self) -> Array:
        """Logarithms of the heights (m) at which `crowding` is known."""
        lowest = self.cover.lowest
        thickest = max(2.0 * float(at_rest(self.wound.spec)[2]), 3.0 * lowest)
        return np.log(np.geomspace(max(lowest, LEAST_HEIGHT), thickest, HEIGHTS))

    @cached_property
    def _assembly(self) -> AssemblyStates:
        # The coils without a target, then with an endless one as low as the cover goes
        nothing = Surroundings(State(REST, REST_POSE), None, self.behind)
        states = nothing, replace(nothing, above=self._endless(self.cover.lowest))
        return replace(self.wound.assembly, states=states)

    @cached_property
    def _winding(self) -> SolvedWinding:
        wound = self.wound
        return solve_winding(wound.spec.coil, wound.layout.coils[0], self._assembly, wound.winding.conductivity,
                             wound.method, wound.tolerance)

    def _endless(self, height: float) -> Reflector:
        """An endless target at a height (m)."""
        target = self.wound.spec.target
        assert target is not None
        return Reflector(max(height, LEAST_HEIGHT), (sheet_of(target.material, target.thickness),))

    @cached_property
    def bare(self) -> Callable[[Array], ComplexArray]:
        """Inductance matrices (H, complex) at the contacts of the coils without the target, by frequency."""
        return curves(self.band, self._bare)

    @cached_property
    def crowding(self) -> Callable[[Array], ComplexArray]:
        """Change of the currents' crowding by an endless target over that target's whole change, by height and
        frequency.
        """
        heights = np.exp(self.heights).tolist()
        return curves(self.band, lambda at: np.stack([self.crowded_at(at, z) for z in heights], axis=1), 4)

    def changes(self, placed: Placed) -> Changes:
        """Changes of the inductance matrix (H) in a few poses, each of them solved."""
        found = self.plate.changes(placed.turns, placed.places, once=True)
        return Changes(self.plate.frequencies, *found,
                       like=endless_like(self.wound.spec.coil.size, self.wound.spec.target))

    def impedances(self, placed: Placed, changes: Changes) -> Callable[[Array], ComplexArray]:
        """Return the inductance matrices (H) of all coils at (n,) frequencies (Hz), one for each pose."""
        heights = self.over_coils(placed)
        diagonal = np.arange(heights.shape[1])

        def whole(frequencies: Array) -> ComplexArray:
            change = changes.complex_at(frequencies)
            more = _between(self.heights, self.crowding(frequencies), heights)
            change[:, diagonal, diagonal] *= 1.0 + more
            return self.bare(frequencies) + change

        return whole

    def crowded(self, frequencies: Array, height: float) -> ComplexArray:
        """The part that the currents' crowding adds to the target's change at a logarithm of the height (m), at (n,)
        frequencies (Hz).
        """
        return _between(self.heights, self.crowding(frequencies), np.full((len(frequencies), 1), height))[:, 0]

    def over_coils(self, placed: Placed) -> Array:
        """Logarithms of the target's heights over the coils (poses, coils; m)."""
        return placed.heights(np.array([coil.placement.centre for coil in self.wound.layout.coils]))

    def oscillations(
        self, placed: Placed, changes: Changes, tank: Tank, network: Network, start: Array
    ) -> Oscillations:
        """Oscillation of every coil's tank in every pose, (poses, coils).

        `network` lies between the coils' contacts and the pins. `start` (coils,; Hz) are frequencies to start from.
        """
        whole = self.impedances(placed, changes)
        return oscillate(network, lambda at: at_frequencies(whole, at, tank),
                         tank.converter.limit("drive_delay"), np.tile(start, (len(placed.places), 1)))

    def _bare(self, frequencies: Array) -> ComplexArray:
        wound, assembly = self.wound, replace(self._assembly, states=self._assembly.states[:1])
        circuits = coil_circuits(wound.layout, self._winding, wound.matrix, assembly, NO_SHARES)
        found = np.zeros((frequencies.size, len(circuits), len(circuits)), dtype=complex)
        centres = [coil.centre for coil in wound.layout.coils]
        for i, circuit in enumerate(circuits):
            inductance, resistance = circuit.own(REST, frequencies)
            found[:, i, i] = inductance - 1j * resistance / (2.0 * math.pi * frequencies)
            for j in range(i):
                distance = round(math.dist(centres[i], centres[j]), 9)
                change = circuit.reflections[REST].mutual((i, j), distance, frequencies)
                found[:, i, j] = found[:, j, i] = wound.matrix[i, j] + change
        return found

    def crowded_at(self, frequencies: Array, height: float) -> ComplexArray:
        """The part that the currents' crowding adds to the change by an endless target at a height (m)."""
        crowding, spectrum, above = self._winding.crowding, self._winding.spectrum, self._endless(height)
        if crowding is None or spectrum is None:
            return np.zeros(frequencies.size, dtype=complex)
        crowded = crowding.changes(frequencies, above, self.behind) - crowding.changes(frequencies, None, self.behind)
        whole = reflected_inductances(spectrum, frequencies, above, self.behind, (0.0,))
        whole = whole - reflected_inductances(spectrum, frequencies, None, self.behind, (0.0,))
        return np.asarray(crowded / whole[:, 0])


def _between(places: Array, values: ComplexArray, at: Array) -> ComplexArray:
    """The polynomial through `values` (n, m) at (m,) even places, at (n, k) others, held beyond the ends."""
    even = np.array([(-1) ** k * math.comb(len(places) - 1, k) for k in range(len(places))], dtype=float)
    weights = shares(places, np.clip(at, places[0], places[-1]).ravel(), even)
    return np.asarray(np.einsum("nkm,nm->nk", weights.reshape(*at.shape, -1), values))


def at_frequencies(impedances: Callable[[Array], ComplexArray], frequencies: Array, tank: Tank) -> tuple[Array, Array]:
    """Inductance (H) and resistance (ohm) at the contacts, (n, coils), each coil at its own (n, coils) frequency (Hz),
    by inductance matrices as `at_contacts` takes them at (n,) frequencies, one a pose.
    """
    found = [at_contacts(k, impedances(at), at, idle_load(2.0 * math.pi * at, tank.readout))
             for k, at in enumerate(frequencies.T)]
    inductance, resistance = (np.stack(parts, axis=1) for parts in zip(*found, strict=True))
    return inductance, resistance


def curves(
    band: tuple[float, ...], exact: Callable[[Array], ComplexArray], points: int = POINTS
) -> Callable[[Array], ComplexArray]:
    """Return an interpolant of `exact` over a band (Hz), a function of frequencies (m,) with values (m, ...).

    It runs through Chebyshev points of ln f between the two ends of the band, and is constant beyond them. If the band
    is one frequency, it returns the value at that frequency.
    """
    if len(band) == 1:
        value = exact(np.array(band))
        return lambda frequencies: np.repeat(value, frequencies.size, axis=0)
    low, high = band
    values = exact(np.exp(chebyshev_points(math.log(low), math.log(high), points)))
    through = Interpolant(np.log([low]), np.log([high]), values)
    return lambda frequencies: through(np.log(frequencies)[:, None])
