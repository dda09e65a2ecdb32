"""What stands in front of and behind the coils in each state: gaps, plates, and the pad's compression."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sitscad.mechanics.elastomer import Compression, compress
from sitscad.physics.eddy_target import CurrentSpectrum, Plate, Reflector, reflected_impedance
from sitscad.spec.materials import Conductor
from sitscad.spec.sensor import SensorSpec

FREE, REST, PRESSED = "free", "rest", "pressed"


@dataclass(frozen=True)
class Surroundings:
    """One state: reflectors above and below the coils; distances count from the board's top face, z = 0."""

    state: str
    above: Reflector | None
    below: Reflector | None


@dataclass(frozen=True)
class Assembly:
    """The states that exist, their gaps (m) by name, the compression, and what is worth saying about the model."""

    states: tuple[Surroundings, ...]
    gaps: dict[str, float]
    compression: Compression | None
    notes: tuple[str, ...]

    @property
    def nearest(self) -> float:
        """Least distance (m) of any reflector from the board's top face."""
        found = [r.distance for s in self.states for r in (s.above, s.below) if r is not None]
        return min(found, default=math.inf)


def assemble(spec: SensorSpec) -> Assembly:
    """The states of the sensor: free (coil alone), rest, pressed to the required normal force."""
    below, behind = _behind(spec)
    states, gaps = [Surroundings(FREE, None, None)], {}
    compression = None
    if spec.target is not None or below is not None:
        rest = spec.elastomer.thickness if spec.elastomer else 0.0
        states.append(Surroundings(REST, _target(spec, rest), below))
        if spec.target is not None:
            gaps[REST] = rest
    if spec.target is not None and spec.elastomer is not None and spec.requirements.normal_force:
        compression = _compression(spec)
        states.append(Surroundings(PRESSED, _target(spec, compression.gap), below))
        gaps[PRESSED] = compression.gap
    if behind is not None:
        gaps["behind_the_board"] = behind
    return Assembly(tuple(states), gaps, compression, tuple(_notes(spec, compression)))


def _plate(material: Conductor, thickness: float = math.inf) -> Plate:
    return Plate(material.conductivity, material.relative_permeability, thickness)


def _target(spec: SensorSpec, gap: float) -> Reflector | None:
    if spec.target is None:
        return None
    return Reflector(gap, (_plate(spec.target.material, spec.target.thickness),))


def _behind(spec: SensorSpec) -> tuple[Reflector | None, float | None]:
    # The shield, and behind it the jaw's metal across the air that is left between them; or one of the two alone.
    jaw = spec.mount.jaw if spec.mount is not None else None
    standoff = spec.mount.standoff if spec.mount is not None and jaw is not None else math.inf
    board = spec.fpc.stackup.thickness
    if spec.shield is None:
        if jaw is None:
            return None, None
        return Reflector(board + standoff, (_plate(jaw.material),)), standoff
    plates = [_plate(spec.shield.material, spec.shield.thickness)]
    if jaw is not None:
        air = standoff - spec.shield.gap - spec.shield.thickness
        if air > 0.0:
            plates.append(Plate(0.0, 1.0, air))
        plates.append(_plate(jaw.material))
    return Reflector(board + spec.shield.gap, tuple(plates)), spec.shield.gap


def _compression(spec: SensorSpec) -> Compression:
    pad = spec.elastomer
    assert pad is not None
    return compress(*pad.size, pad.thickness, pad.material.shear_modulus, pad.material.bulk_modulus,
                    spec.requirements.normal_force or 0.0, pad.shape == "circle")  # fmt: skip


def _notes(spec: SensorSpec, compression: Compression | None) -> list[str]:
    notes = []
    if compression is not None and not compression.valid:
        notes.append(f"pressed gap: {compression.note}")
    if spec.mount is not None and spec.mount.jaw is not None:
        notes.append("the jaw's metal enters as an endless half-space behind the board")
    return notes


class Reflection:
    """Change of inductance and resistance of a winding by its surroundings, as a smooth function of frequency.

    `share` is how much of an endless target's effect the real one has (see `finite_target`). Sampled at Chebyshev
    points of ln f from 0.2 to 20 MHz; frequencies beyond are computed directly.
    """

    LOW, HIGH, POINTS = 0.2e6, 20e6, 8

    def __init__(self, spectrum: CurrentSpectrum, around: Surroundings, share: float = 1.0) -> None:
        self._spectrum, self._around, self._share = spectrum, around, share
        nodes = np.cos(math.pi * (np.arange(self.POINTS) + 0.5) / self.POINTS)
        self._middle = 0.5 * math.log(self.LOW * self.HIGH)
        self._half = 0.5 * math.log(self.HIGH / self.LOW)
        rows = []
        for x in nodes:
            frequency = math.exp(self._middle + self._half * x)
            inductance, resistance = self._exact(frequency)
            rows.append((inductance, resistance / frequency))
        self._fit = np.polynomial.chebyshev.chebfit(nodes, np.array(rows), self.POINTS - 1)

    def __call__(self, frequency: float) -> tuple[float, float]:
        """Change of inductance (H) and resistance (ohm) at a frequency (Hz)."""
        if not self.LOW <= frequency <= self.HIGH:
            return self._exact(frequency)
        x = (math.log(frequency) - self._middle) / self._half
        found = np.asarray(np.polynomial.chebyshev.chebval(x, self._fit))
        return float(found[0]), float(found[1]) * frequency

    def _exact(self, frequency: float) -> tuple[float, float]:
        above, below = self._around.above, self._around.below
        full = reflected_impedance(self._spectrum, frequency, above, below)
        if self._share == 1.0 or above is None:
            return full
        bare = reflected_impedance(self._spectrum, frequency, None, below)
        return bare[0] + self._share * (full[0] - bare[0]), bare[1] + self._share * (full[1] - bare[1])


def no_reflection(frequency: float) -> tuple[float, float]:
    """The coil alone: nothing changes."""
    return 0.0, 0.0
