"""The simulated converter of a design: its coils under loads over time, and what can be wrong with them by name."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from sitscad.bench.registers import Registers
from sitscad.design import Design, respond
from sitscad.estimates.values import CoilEstimate, StateEstimate
from sitscad.record import record
from sitscad.scene.state import FREE, REST
from sitscad.spec.sensor import SensorSpec

FAULTS = {
    "open": "a coil's circuit is open: its tank does not oscillate",
    "short": "a coil's contacts are bridged: its tank does not oscillate",
    "lost-layer": "one layer of a coil is bridged: the turns of the others are left",
    "low-amplitude": "a coil loses twice what it ought to: its amplitude is half",
    "swapped": "two coils are wired to each other's channels",
    "nack": "the converter does not answer",
    "stuck": "a coil's result stays what it was, though it counts as new",
    "reset": "the supply breaks down for a moment: the converter forgets its settings",
    "glitch": "now and then one result of a coil is wrong, without a flag",
}
"""What can be wrong, by name."""

_WRITTEN = re.compile(r"(?P<name>[a-z-]+)(?::(?P<coils>[^@]+))?(?:@(?P<at>[0-9.eE+-]+))?")
_EVERY = 3600.0
"""Seconds from one glitch to the next where the fault does not say."""


@record
class Fault:
    """Something that goes wrong: its name, the coils that it befalls, and from when on (s); a glitch comes again and
    again after so long.
    """

    name: str
    coils: tuple[str, ...] = ()
    at: float = 0.0

    @classmethod
    def read(cls, text: str) -> Fault:
        """A fault as it is written: ``open:C2``, ``swapped:C1:C2``, ``reset@0.5``, ``glitch:C1@3600``. Raises
        ValueError for others.
        """
        found = _WRITTEN.fullmatch(text)
        if found is None or found["name"] not in FAULTS:
            raise ValueError(f"{text!r} is no fault; faults are {', '.join(FAULTS)}, with :COIL and @SECONDS")
        coils = tuple((found["coils"] or "").split(":")) if found["coils"] else ()
        usual = _EVERY if found["name"] == "glitch" else 0.0
        return cls(found["name"], coils, float(found["at"]) if found["at"] else usual)


class SimulatedConverter(Registers):
    """One converter of a design, asleep as after power-up: set it up by its registers, as a driver does.

    `loads` (n, 4) are times (s) and forces (N: normal, shear along x, along y), straight between, the target level;
    None leaves the target at rest, or the board bare where it has none or `state` is ``free``. `frequencies` (n, coils;
    Hz) go with the times of `loads` in place of what the design reads under them: those of another board.
    `faults` are names as `Fault.read` takes them, or such values. `number` is the converter of the sensor, from 0.

    Noise is that of the estimates, `seed` its row. Raises ValueError for unknown faults and coils, for loads that
    nothing answers, and for converters of other families.
    """

    def __init__(
        self,
        spec: SensorSpec | Design,
        *,
        loads: ArrayLike | None = None,
        frequencies: ArrayLike | None = None,
        faults: Sequence[str | Fault] | str = (),
        state: str = REST,
        number: int = 0,
        seed: int = 1,
        noise: bool = True,
    ) -> None:
        design = spec if isinstance(spec, Design) else Design(spec)
        device = design.spec.readout.device
        if not device.has_driver:
            raise ValueError(f"no {device.part} is simulated: driver and bench are those of LDC1612 and LDC1614")
        shares = device.shares(len(design.estimates.coils))
        if not 0 <= number < len(shares):
            raise ValueError(f"the design has no converter {number}")
        self._first = first = sum(shares[:number])
        self.coils = design.estimates.coils[first : first + shares[number]]
        self.faults = _faults(faults, [coil.name for coil in design.estimates.coils])
        states = [coil.states.get(state) or coil.states[FREE] for coil in self.coils]
        self._ohms = [one.parallel_resistance for one in states]
        self._times, self._read = _course(design, states, loads, frequencies, first)
        self._layers = len(design.spec.coil.layers)
        self._glitches = {fault: 1 for fault in self.faults if fault.name == "glitch"}
        self._resets = {fault for fault in self.faults if fault.name == "reset"}
        steps = device.limit("noise_steps") if noise else 0.0
        super().__init__(device, design.spec.readout.clock, self._tank, steps, seed)

    def advance(self, nanoseconds: int) -> None:
        """Let time go by, with the faults that come in it."""
        end = self.time + nanoseconds
        self.silent = any(fault.name == "nack" and fault.at * 1e9 <= end for fault in self.faults)
        for fault in [one for one in self._resets if one.at * 1e9 <= end]:
            self._resets.discard(fault)
            self.reset()
        for fault, times in self._glitches.items():
            if times * fault.at * 1e9 <= end:
                self._glitches[fault] = times + 1
                self.glitch |= set(self._befallen(fault))
        self.stuck = {channel for fault in self._present("stuck") for channel in self._befallen(fault)}
        super().advance(nanoseconds)

    def hold(self, frequencies: ArrayLike) -> None:
        """From now on the coils have these frequencies (Hz; all coils of the sensor)."""
        own = slice(self._first, self._first + len(self.coils))
        self._times, self._read = np.zeros(1), np.atleast_2d(frequencies)[:1, own]

    def _present(self, name: str) -> list[Fault]:
        return [fault for fault in self.faults if fault.name == name and fault.at * 1e9 <= self.time]

    def _befallen(self, fault: Fault) -> list[int]:
        """The channels that a fault is on; all where it names no coil."""
        return [k for k, coil in enumerate(self.coils) if not fault.coils or coil.name in fault.coils]

    def _tank(self, channel: int, time: int) -> tuple[float, float]:
        """Resonance (Hz) and R_P (ohm) of what is on a channel."""
        wired = channel
        for fault in self._present("swapped"):
            pair = self._befallen(fault)[:2]
            if channel in pair and len(pair) == 2:
                wired = pair[1 - pair.index(channel)]
        if wired >= len(self.coils):
            return 0.0, 0.0
        frequency, ohms = float(np.interp(time * 1e-9, self._times, self._read[:, wired])), self._ohms[wired]
        hit = {fault.name for fault in self.faults if fault.at * 1e9 <= time and wired in self._befallen(fault)}
        if hit & {"open", "short"}:
            return 0.0, 0.0
        if "low-amplitude" in hit:
            ohms *= 0.5
        if "lost-layer" in hit:
            higher, less = lost_layer(self.coils[wired], self._layers)
            return frequency * higher, ohms * less
        return frequency, ohms


def lost_layer(coil: CoilEstimate, layers: int) -> tuple[float, float]:
    """By what frequency and R_P of a tank change when one of a coil's layers is bridged, of one layer half its turns:
    the winding's inductance goes as the square of the turns that are left, which is so for layers near to each other,
    its resistance as their number, and R_P is L / (R C).
    """
    left = (layers - 1) / layers if layers > 1 else 0.5
    own = coil.winding_inductance / (coil.winding_inductance + abs(coil.lead_inductance))
    inductance = 1.0 - own * (1.0 - left**2)
    return 1.0 / math.sqrt(inductance), inductance / left


def _faults(given: Sequence[str | Fault] | str, names: Sequence[str]) -> tuple[Fault, ...]:
    each = [given] if isinstance(given, str) else given
    found = tuple(Fault.read(one) if isinstance(one, str) else one for one in each)
    for fault in found:
        unknown = [name for name in fault.coils if name not in names]
        if unknown:
            raise ValueError(f"{fault.name}: there is no coil {unknown[0]}; coils are {', '.join(names)}")
        if fault.name == "swapped" and len(fault.coils) != 2:
            raise ValueError("swapped takes two coils, as in swapped:C1:C2")
    return found


def _course(
    design: Design, states: Sequence[StateEstimate], loads: ArrayLike | None, frequencies: ArrayLike | None, first: int
) -> tuple[np.ndarray, np.ndarray]:
    """Times (n; s) and what the coils of the converter have at them (n, coils; Hz)."""
    if loads is None:
        drawn = [[state.frequency for state in states]]
        found = np.array(drawn) if frequencies is None else np.atleast_2d(frequencies)[:, first : first + len(states)]
        return np.arange(len(found), dtype=float), found
    rows = np.atleast_2d(np.asarray(loads, dtype=float))
    if rows.shape[-1] != 4:
        raise ValueError("loads are rows of a time (s) and three forces (N)")
    if frequencies is None:
        frequencies = respond(design, loads=rows[:, 1:], rotation="held").frequency
    return rows[:, 0], np.asarray(frequencies, dtype=float)[:, first : first + len(states)]
