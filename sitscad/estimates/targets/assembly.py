"""Metal around the coils in each state: gaps, plates, and the pad's compression."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import Any

import numpy as np

from sitscad.assembly.places.bodies import (
    Body,
    backing_of,
    plates_of,
    target_lines,
)
from sitscad.assembly.places.state import (
    BEHIND_THE_BOARD,
    MOVED_SIDEWAYS,
    PRESSED,
    REST,
    REST_POSE,
    STATES,
    Pose,
    State,
)
from sitscad.basics.arrays import Array, ComplexArray
from sitscad.basics.record import record, replace
from sitscad.basics.units import show
from sitscad.estimates.loads.pressing import (
    BESIDE_PAD,
    GLUE,
    LEAST,
    PAD,
    PressingScatter,
    linearised_cases,
    pressed_cases,
    pressed_pad,
    pressing_scatter,
    rests_on_pad,
)
from sitscad.estimates.tolerances.scatter import BEHIND, HEIGHT, MOVED, TARGET
from sitscad.estimates.windings.losses import LossesNearMetal
from sitscad.kernels.electromagnetics.constants import skin_depth
from sitscad.kernels.electromagnetics.loss.resistance import conductivity_at
from sitscad.kernels.electromagnetics.metal.current_spectrum import CurrentSpectrum
from sitscad.kernels.electromagnetics.metal.half_spaces import MetalLayer, Reflector, reflected_inductances, reflection
from sitscad.kernels.mechanics.elastomer import Compression
from sitscad.spec.materials import Conductor
from sitscad.spec.mount import Mount
from sitscad.spec.sensor import SensorSpec


@record
class Surroundings:
    """Metal around the coils in a state: reflectors above and below.

    Their distances (m) count from the board's top face. None if there is no metal on this side.
    """

    state: State
    above: Reflector | None = None
    below: Reflector | None = None

    @property
    def name(self) -> str:
        """The state's name."""
        return self.state.name


@record
class AssemblyStates:
    """States of a sensor with the metal around the coils, the gaps (m) by name, and notes about the model.

    `ranges` holds a pair of surroundings for each (state, cause of scatter): the cause deviates by minus one and by
    plus one standard deviation. `compressions` holds the deformed pad of each pressed state by the state's name,
    `scatters` the pad's standard deviations. A state of the table `STATES` may be absent although the sensor has the
    required parts; `refused` then holds the reason by the state's name.
    """

    states: tuple[Surroundings, ...]
    gaps: dict[str, float]
    notes: tuple[str, ...]
    ranges: Mapping[tuple[str, str], tuple[Surroundings, Surroundings]] = field(default_factory=dict)
    compressions: Mapping[str, Compression] = field(default_factory=dict)
    scatters: Mapping[str, PressingScatter] = field(default_factory=dict)
    refused: Mapping[str, str] = field(default_factory=dict)

    @property
    def compression(self) -> Compression | None:
        """Pad under the required normal force. None if there is no pad or no required force."""
        return self.compressions.get(PRESSED)


def assemble(spec: SensorSpec, sigmas: Mapping[str, float] | None = None, is_rough: bool = False) -> AssemblyStates:
    """Return all states of the table `STATES` that the sensor has, with the metal around the coils.

    `sigmas` are standard deviations (m) by the names in `scatter.CAUSES`; None means no scatter. If `is_rough`, the
    pressed pad's scatter is linearised.
    """
    sigmas, over, behind = sigmas or {}, plates_of(spec).target, metal_behind(spec)
    around, thicknesses, refused = list[Surroundings](), dict[str, float](), dict[str, str]()
    ranges: dict[tuple[str, str], tuple[Surroundings, Surroundings]] = {}
    compressions, scatters = dict[str, Compression](), dict[str, PressingScatter]()
    force, lines = spec.requirements.normal_force or 0.0, target_lines(spec)
    is_loaded = over is not None and force > 0.0 and rests_on_pad(spec)

    def at_gap(name: str, gap: float, pushed: float = 0.0) -> Surroundings:
        """Return the surroundings in the state `name`, for a target that is lowered without tilt or lateral travel.

        `gap` (m) is the remaining thickness of the pad, `pushed` (N) the normal force.
        """
        assert over is not None
        state = State(name, Pose(z=gap - over.lower), pushed)
        return _surroundings(over, lines, state, behind)

    def between(state: str, cause: str, less: float, more: float) -> None:
        ranges[state, cause] = at_gap(state, less), at_gap(state, more)

    for kind in STATES:
        name = kind.name
        if kind.load is None:
            around.append(Surroundings(State(name)))
        elif not kind.is_straight:
            refused |= {name: MOVED_SIDEWAYS} if is_loaded else {}
        elif not kind.is_pressed:
            if over is not None or behind is not None:
                around.append(_surroundings(over, lines, State(name, REST_POSE), behind))
            if over is not None:
                thicknesses[name] = over.lower
            if over is not None and spec.elastomer is not None and sigmas.get(PAD):
                thickness = spec.elastomer.thickness
                between(name, PAD, max(LEAST * thickness, thickness - sigmas[PAD]), thickness + sigmas[PAD])
        elif is_loaded:
            compressions[name] = nominal = pressed_pad(spec, load=kind.load[0])
            cases = (linearised_cases(spec, sigmas, nominal, kind.load[0]) if is_rough
                     else pressed_cases(spec, sigmas, kind.load[0]))
            around.append(at_gap(name, compressions[name].gap, kind.load[0] * force))
            thicknesses[name], scatters[name] = compressions[name].gap, pressing_scatter(cases)
            for cause, (less, more) in cases.items():
                between(name, cause, less.gap, more.gap)
    gaps = {name: gap + lines for name, gap in thicknesses.items()}
    if sigmas.get(GLUE):
        for name, gap in thicknesses.items():  # remaining pad and glue together
            between(name, GLUE, gap - sigmas[GLUE], gap + sigmas[GLUE])
    assembled = [surroundings for surroundings in around if not surroundings.state.is_free]
    ranges |= _metal_ranges(spec, sigmas, assembled, (HEIGHT,) if is_rough else (*BEHIND, TARGET))
    if behind is not None:
        gaps[BEHIND_THE_BOARD] = backing_of(spec).room
    is_beside = spec.elastomer is not None and not rests_on_pad(spec)
    notes = tuple(_notes(spec.mount, compressions.get(PRESSED), is_beside))
    return AssemblyStates(tuple(around), gaps, notes, ranges, compressions, scatters, refused)


def _metal_ranges(
    spec: SensorSpec, sigmas: Mapping[str, float], states: Sequence[Surroundings], causes: Sequence[str]
) -> dict[tuple[str, str], tuple[Surroundings, Surroundings]]:
    """Return two surroundings by (state, cause): the cause deviates by minus one and plus one standard deviation.

    The `causes` change the thickness of metal or its distance behind the board. Causes without effect are left out.
    `sigmas` (m) are the standard deviations by cause.
    """
    ranges = {}
    for cause in causes:
        if not sigmas.get(cause):
            continue
        units = [MOVED[cause](spec, way * sigmas[cause]) for way in (-1.0, 1.0)]
        below = [metal_behind(unit) for unit in units]
        for state in states:
            above = [state.above if state.above is None or unit.target is None else replace(
                state.above, plates=(replace(state.above.plates[0], thickness=unit.target.thickness),))
                for unit in units]
            less, more = (replace(state, above=a, below=b) for a, b in zip(above, below, strict=True))
            if _is_noticeably_different(less, more):
                ranges[state.name, cause] = less, more
    return ranges


MIN_REFLECTION_CHANGE = 1e-4
"""Largest difference of two reflection factors up to which two surroundings are treated as equal.

A change of metal behind a shield, or deep in a jaw, changes the factor by less.
"""

WAVE_NUMBERS = np.array([3e2, 1e3, 3e3])
"""Wave numbers (1/m) at which reflection factors are compared. They occur in fields of coils of some millimetres."""

COMPARISON_FREQUENCY = 5e6
"""Frequency (Hz) at which reflection factors of two surroundings are compared."""


def _is_noticeably_different(first: Surroundings, second: Surroundings) -> bool:
    """Whether two surroundings differ in a distance, or in a reflection factor by more than `MIN_REFLECTION_CHANGE`."""
    for a, b in ((first.above, second.above), (first.below, second.below)):
        if a is None or b is None or a == b:
            continue
        if a.distance != b.distance:
            return True
        factors = (reflection(WAVE_NUMBERS, COMPARISON_FREQUENCY, reflector.plates) for reflector in (a, b))
        if float(np.abs(np.subtract(*factors)).max()) > MIN_REFLECTION_CHANGE:
            return True
    return False


def surroundings_at_rest(spec: SensorSpec) -> Surroundings | None:
    """Return the metal around the coils at rest. None if no conducting or magnetic target is over the coils."""
    around = _surroundings(plates_of(spec).target, target_lines(spec), State(REST, REST_POSE), metal_behind(spec))
    return around if around.above is not None else None


def _surroundings(over: Body | None, lines: float, state: State, behind: Reflector | None) -> Surroundings:
    # `lines` are the glue below the target (m)
    if over is None or over.metal is None or state.pose is None:
        return Surroundings(state, None, behind)
    gap = over.lower + lines + state.pose.z
    return Surroundings(state, Reflector(gap, (metal_sheet(over.metal, over.thickness),)), behind)


def spec_at_temperature(spec: SensorSpec, temperature: float) -> SensorSpec:
    """Return the spec with the conductivities of its metals at a temperature (degrees Celsius). Unchanged at 20 C."""

    def warm(metal: Conductor) -> Conductor:
        at = conductivity_at(temperature, metal.conductivity, metal.temperature_coefficient)
        return replace(metal, conductivity=at)

    parts: dict[str, Any] = {}
    if spec.target is not None:
        parts["target"] = replace(spec.target, material=warm(spec.target.material))
    if spec.shield is not None:
        parts["shield"] = replace(spec.shield, material=warm(spec.shield.material))
    if spec.mount is not None and spec.mount.metal is not None:
        name = next((part for part in ("metal_behind", "jaw") if getattr(spec.mount, part) is not None), "")
        metal = warm(spec.mount.metal)
        behind = {name: replace(getattr(spec.mount, name), material=metal)} if name else {"backing": metal}
        parts["mount"] = replace(spec.mount, **behind)
    return replace(spec, **parts) if parts and temperature != 20.0 else spec


LEAST_CONDUCTIVITY = 1e-3
"""Least conductivity (S/m) with which a metal is computed.

With this value the skin depth is metres, and the effect of the metal is negligible.
"""


def computed_conductivity(metal: Conductor) -> float:
    """Return the conductivity (S/m) of a metal for computations, at least `LEAST_CONDUCTIVITY`."""
    return max(metal.conductivity, LEAST_CONDUCTIVITY)


def metal_skin_depth(metal: Conductor, frequency: float) -> float:
    """Return the skin depth (m) in a metal at a frequency (Hz)."""
    return skin_depth(frequency, computed_conductivity(metal), metal.relative_permeability)


def metal_sheet(metal: Conductor, thickness: float = math.inf) -> MetalLayer:
    """Return an infinite sheet of a metal with a thickness (m); a half space if the thickness is infinite."""
    return MetalLayer(computed_conductivity(metal), metal.relative_permeability, thickness)


def metal_behind(spec: SensorSpec, without_jaw: bool = False) -> Reflector | None:
    """Return the metal behind the board as layers: the shield, then air, then jaw, finger or `mount.metal_behind`.

    Each part may be missing. None if there is no metal. `without_jaw` leaves out all metal except the shield.
    """
    material = spec.mount.metal if spec.mount is not None and not without_jaw else None
    sheet, metal = backing_of(spec).shield_span, backing_of(spec).metal_face
    plates: list[MetalLayer] = []
    if spec.shield is not None and sheet is not None:
        plates.append(metal_sheet(spec.shield.material, spec.shield.thickness))
        if material is not None and metal is not None and sheet[0] - metal > CONTACT:
            plates.append(MetalLayer(0.0, 1.0, sheet[0] - metal))
    if material is not None and spec.mount is not None:
        plates.append(metal_sheet(material, spec.mount.metal_thickness or math.inf))
    nearest = sheet[1] if sheet is not None else metal if metal is not None else 0.0
    return Reflector(-nearest, tuple(plates)) if plates else None


CONTACT = 1e-9  # Gaps (m) below this count as zero


def _notes(mount: Mount | None, compression: Compression | None, is_beside: bool) -> list[str]:
    """Return notes about the assembly's states. `is_beside` is True if the target stands beside its pad."""
    notes = []
    if compression is not None and not compression.valid:
        notes.append(f"pressed gap: {compression.note}")
    if is_beside:
        notes.append(f"no state pressed: {BESIDE_PAD}")
    if mount is not None and mount.metal is not None:
        whose, thickness = "finger" if mount.finger is not None else "jaw", mount.metal_thickness
        if mount.metal_behind is not None:
            notes.append("the metal behind the board enters as an endlessly wide sheet of "
                         f"{show(mount.metal_behind.thickness, 'm')}, with air behind it")
        elif thickness is None:
            notes.append(f"the {whose}'s metal enters as endlessly wide and deep: the spec has no thickness of it")
        else:
            notes.append(f"the {whose}'s metal enters as an endlessly wide plate of the thickness in its middle, "
                         f"{show(thickness, 'm')}, with air behind it")
        if mount.jaw is not None and mount.jaw.fenestration is not None:
            notes.append(
                "the jaw's window is solved as an opening through endless metal, as deep as the jaw is; how far off "
                "that may be is in the errors of states and signals"
            )
    return notes


def lossless_mirror(reflector: Reflector | None) -> Reflector | None:
    """Return a lossless conductor in the reflector's place, so that all loss occurs in other metal.

    None if no reflector.
    """
    return None if reflector is None else Reflector(reflector.distance, (MetalLayer(LOSSLESS),))


LOSSLESS = 1e18  # Conductivity (S/m) of metal with negligible loss: a hundred thousandth of copper's
SCREENED_AT = 6e6  # Frequency (Hz) of a target's effect in screening


class Reflection:
    """Change of a winding's inductance and resistance by the metal around it, as a function of frequency.

    Results are cached. `spectrum` is the winding's current spectrum, None if there is no metal; all changes are then 0.
    `distances` (m) are the distances of identical coils beside the winding, whose mutual inductances also change.
    `share` holds two ratios: the target's effect divided by an infinite plate's, for inductance and for loss
    (`finite_target`). `unsure` holds the relative errors of both ratios, and an additional error of the inductance (H).
    `crowding` computes the change by eddy currents in the winding's own tracks (None: left out).
    """

    jaw_left = (1.0, 1.0)
    """Fractions of the solid jaw's effect on inductance and resistance that remain if the jaw has a window."""

    def __init__(
        self, spectrum: CurrentSpectrum | None, around: Surroundings, distances: Sequence[float] = (),
        share: tuple[float, float] = (1.0, 1.0), crowding: LossesNearMetal | None = None,
        unsure: tuple[float, float, float] = (0.0, 0.0, 0.0), is_rough: bool = False,
    ) -> None:
        self.is_rough = is_rough
        self._spectrum, self._around, self._share, self._crowding = spectrum, around, share, crowding
        self._distances, self._unsure = (0.0, *distances), unsure
        self._known: dict[bytes, ComplexArray] = {}

    def __call__(self, frequencies: Array) -> tuple[Array, Array]:
        """Return the change of inductance (n; H) and resistance (n; ohm) at (n) frequencies (Hz)."""
        change = self._at(frequencies)[:, 0]
        return change.real, -2.0 * math.pi * frequencies * change.imag

    def mutual(self, pair: tuple[int, int], distance: float, frequencies: Array) -> ComplexArray:
        """Return the change of the mutual inductance (n; H, complex) of two coils by metal, at (n) frequencies (Hz).

        `pair` are the numbers of the coils. `distance` (m) between their centres is one of `distances`.
        """
        return self._at(frequencies)[:, self._distances.index(distance)]

    def crowding(self, frequencies: Array) -> ComplexArray:
        """Return the change of inductance (n; H, complex) because metal changes the eddy currents in the tracks.

        `frequencies` (n) are in Hz. The imaginary part times -omega is a resistance.
        """
        return self.crowding_near(frequencies, self._around.above, self._around.below)

    def crowding_near(self, frequencies: Array, above: Reflector | None, below: Reflector | None) -> ComplexArray:
        """Return the change of `crowding` (n; H, complex) with the metal `above` and `below` the board instead."""
        if self._crowding is None or (above is None and below is None):
            return np.zeros(len(frequencies), dtype=np.complex128)
        full = self._crowding.changes(frequencies, above, below)
        share = self.target_ratios(frequencies) if above is not None else np.ones(1)
        if np.all(share == 1.0):
            return full
        without_target = self._crowding.changes(frequencies, None, below)
        return np.asarray(without_target + share * (full - without_target))

    def target_ratios(self, frequencies: Array) -> ComplexArray:
        """Return the target's inductance change divided by an infinite plate's (n), at (n) frequencies (Hz)."""
        return np.full(len(frequencies), self._share[0], dtype=np.complex128)

    def factors(self, frequency: float) -> tuple[complex, complex]:
        """Return two factors that convert inductance changes by an infinite plate to changes by the real target.

        The first is for all of a change but its part from the plate's own loss. The second is for this part.
        """
        return self._share

    def target_change(self, frequency: float) -> complex:
        """Return the target's change of the winding's inductance (H, complex), for current even across the tracks."""
        if self._around.above is None:
            return 0j
        at = np.array([self._target_frequency(frequency)])
        return complex(self.target_ratios(at)[0] * self._of_target(at)[0, 0])

    def with_factors(self, frequency: float, factors: tuple[complex, complex]) -> complex:
        """Return the target's change of the winding's inductance (H, complex), computed with other `factors`.

        `factors` are like the result of the method `factors`: they convert the change by an infinite plate.
        """
        (ratio, loss_ratio), at = factors, np.array([frequency])
        change = ratio * self._of_target(at)[0, 0]
        return complex(change if loss_ratio == ratio else change + 1j * (loss_ratio - ratio) * self._own_loss(at)[0, 0])

    def infinite_plate_change(self, frequency: float) -> complex:
        """Return the change of the winding's inductance (H, complex) by an infinite plate in place of the target."""
        if self._around.above is None:
            return 0j
        return complex(self._of_target(np.array([self._target_frequency(frequency)]))[0, 0])

    def _target_frequency(self, frequency: float) -> float:
        """Return the frequency (Hz) at which the target's effect is computed. In screening it is a constant."""
        return SCREENED_AT if self.is_rough else frequency

    def target_error_bounds(self, frequency: float) -> tuple[float, float]:
        """Return signed error bounds of the target's inductance change (H) and of its loss (ohm).

        The two errors have a common cause: both have these signs, or both the opposite signs.
        """
        if self._around.above is None or not any(self._unsure):
            return 0.0, 0.0
        frequency = self._target_frequency(frequency)
        at, omega = np.array([frequency]), 2.0 * math.pi * frequency
        whole, lossless = self._of_target(at)[0, 0], self._own_loss(at)[0, 0]
        share, lost = self._share[0] * self._unsure[0], self._share[1] * self._unsure[1]
        more = float(share * whole.real)
        loss = float(-omega * (share * (whole.imag - lossless) + lost * lossless))
        return more + math.copysign(self._unsure[2], more), loss

    def window_error_bounds(self, frequency: float) -> tuple[float, float]:
        """Return signed error bounds of inductance (H) and resistance (ohm) by a window in the jaw.

        The two errors have a common cause: both have these signs, or both the opposite signs. Both are 0 without a
        window.
        """
        return 0.0, 0.0

    def _at(self, frequencies: Array) -> ComplexArray:
        key = frequencies.tobytes()
        if key not in self._known:
            self._known[key] = self._exact(frequencies)
        return self._known[key]

    def _exact(self, frequencies: Array) -> ComplexArray:
        """Return the changes (n, distances; H, complex) of the coil's own and mutual inductances by target and metal.

        The first column is the coil's own inductance.
        """
        above, below = self._around.above, self._around.below
        full = self._changes_by_infinite_plate(frequencies, above, below)
        if above is None or self._share == (1.0, 1.0):
            return full
        without_target = self._changes_by_infinite_plate(frequencies, None, below)
        # The target's effects on the losses behind the board and in the tracks follow the field, like the inductance.
        # Only its own loss has a separate ratio.
        share, lost = self._share
        change = without_target + share * (full - without_target)
        return np.asarray(change if lost == share else change + 1j * (lost - share) * self._own_loss(frequencies))

    def _changes_by_infinite_plate(
        self, frequencies: Array, above: Reflector | None, below: Reflector | None
    ) -> ComplexArray:
        change = self._returned(frequencies, above, below)
        if self._crowding is not None:
            change[:, 0] += self._crowding.changes(frequencies, above, below)
        return change

    def _returned(self, frequencies: Array, above: Reflector | None, below: Reflector | None) -> ComplexArray:
        # The changes of `_changes_by_infinite_plate` without crowding.
        if self._spectrum is None or (above is None and below is None):
            return np.zeros((len(frequencies), len(self._distances)), dtype=np.complex128)
        return reflected_inductances(self._spectrum, frequencies, above, below, self._distances)

    def _of_target(self, frequencies: Array) -> ComplexArray:
        # Changes (H, complex) by an infinite plate at (n,) frequencies, by distance, without crowding.
        above, below = self._around.above, self._around.below
        return np.asarray(self._returned(frequencies, above, below) - self._returned(frequencies, None, below))

    def _own_loss(self, frequencies: Array) -> Array:
        # The imaginary part (H) of this change by loss in the target itself.
        return self._returned(frequencies, self._around.above, lossless_mirror(self._around.below)).imag


class SolvedReflection(Reflection):
    """Changes by metal with the effect of the finite target from its field solution, not from an infinite plate.

    `solved` holds three items: two frequencies (Hz), the changes of the inductance matrix of all coils at both
    (2, coils, coils; H, complex), and the spectrum by which they are interpolated. `number` is the index of this coil.
    `errors` are bounds of its own change (H) and of its loss (ohm). `crowded` is a function of frequency (Hz): the
    inductance change that current crowding adds, as a fraction of the coil's change.
    """

    def __init__(
        self, spectrum: CurrentSpectrum | None, around: Surroundings, distances: Sequence[float],
        crowding: LossesNearMetal | None, solved: tuple[Array, ComplexArray, Callable[[Array], ComplexArray]],
        number: int, errors: tuple[float, float], crowded: Callable[[Array], ComplexArray],
    ) -> None:
        super().__init__(spectrum, around, distances, (1.0, 1.0), crowding)
        self._solved_at, self._changes, self._like = solved
        self._places, self._errors, self._crowded = self._solved_at**-0.5, errors, crowded
        self._ends = self._changes[:, number, number]

    def target_ratios(self, frequencies: Array) -> ComplexArray:
        """Return the target's inductance change divided by an infinite plate's (n, complex), at (n) frequencies (Hz).

        Both changes are complex: their imaginary parts are losses. So the ratio covers the loss, too.
        """
        return np.asarray(self._change(self._ends, frequencies) / self._of_target(frequencies)[:, 0])

    def factors(self, frequency: float) -> tuple[complex, complex]:
        """Return the two factors of `Reflection.factors`: twice the complex ratio, because it also covers the loss."""
        share = complex(self.target_ratios(np.array([frequency]))[0])
        return share, share

    def mutual(self, pair: tuple[int, int], distance: float, frequencies: Array) -> ComplexArray:
        """Return the change of the mutual inductance (n; H, complex) of two coils by target and metal.

        `pair` are the numbers of the coils. `distance` (m) between their centres is one of `distances`.
        """
        more = self._change(self._changes[:, pair[0], pair[1]], frequencies)
        return np.asarray(super().mutual(pair, distance, frequencies) + more)

    def target_error_bounds(self, frequency: float) -> tuple[float, float]:
        """Return signed error bounds of the solved target's inductance change (H) and of its loss (ohm).

        The two errors have a common cause: both have these signs, or both the opposite signs.
        """
        return self._errors

    def _exact(self, frequencies: Array) -> ComplexArray:
        """Return the changes (n, distances; H, complex) of own and mutual inductances at (n) frequencies (Hz).

        The first column is the change of the coil's own inductance by target and metal behind the board. The other
        columns are changes of mutual inductances by the metal behind the board alone.
        """
        change = self._changes_by_infinite_plate(frequencies, None, self._around.below)
        change[:, 0] += self._change(self._ends, frequencies) * (1.0 + self._crowded(frequencies))
        return change

    def _change(self, solved: ComplexArray, frequencies: Array) -> ComplexArray:
        """Return a change (H) at (n) frequencies (Hz), interpolated between the two frequencies of the solution.

        `solved` (2; H, complex) are the changes at these two frequencies.
        """
        # The ratio to `like` is linear in f^(-1/2), as skin depths are, and constant far outside of the solved band.
        (low, high), (first, last) = self._places, solved / self._like(self._solved_at)
        part = np.clip((frequencies**-0.5 - low) / (high - low), -BEYOND, 1.0 + BEYOND)
        return np.asarray(self._like(frequencies) * (first + part * (last - first)))


BEYOND = 1.0
"""Largest extrapolation outside the two frequencies of a solution, as a fraction of the interval between them.

Both are measured on a scale of f^(-1/2).
"""
