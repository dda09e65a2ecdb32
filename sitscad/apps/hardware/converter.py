"""Simulation of an LDC1612 or LDC1614 converter at register level (data sheet SNOSCY9A, 7.4 to 7.6 and 8.1).

Its results equal the results of ``simulated.c`` in the firmware, bit by bit. `SimulatedConverter` simulates the
converter of a design, with loads over time and with faults by name.

Three assumptions are not in the data sheet and are unverified. A channel that does not oscillate gives 0 after the
watchdog's recovery time. Registers cannot be written during conversion. Unused bits read as 0.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from sitscad.assembly.places.state import FREE, REST
from sitscad.basics.arguments import checked_arguments
from sitscad.basics.record import record
from sitscad.estimates.coil_estimates import CoilEstimate, StateEstimate
from sitscad.estimates.design import Design
from sitscad.estimates.requested_response import respond
from sitscad.kernels.converters import ldc_registers as at
from sitscad.kernels.converters import reference_counter as law
from sitscad.kernels.converters.converter import Converter
from sitscad.spec.sensor import SensorSpec

READ, WRITE = 122_500, 97_500
"""Duration (ns) of reading and of writing a register over I2C at 400 kHz."""

WAKE = 377_512
"""Time (ns) from sleep to the first settling: 16384 periods of the internal oscillator's typical 43.4 MHz (7.4.2)."""

NEVER = 2**64 - 1
DEAD, LOW, HIGH = "amplitude_stable_min", "amplitude_optimum_min", "amplitude_max"
"""Names of the limits of the tank's amplitude.

Below `DEAD`, the tank does not oscillate. Results with an amplitude below `LOW` or above `HIGH` have an error flag.
"""

SETTING_REGISTERS = (at.ERROR_CONFIG, at.MUX_CONFIG)
CHANNEL_REGISTERS = (at.RCOUNT, at.OFFSET, at.SETTLECOUNT, at.CLOCK_DIVIDERS, at.DRIVE_CURRENT)
DRIVE_CODE = 0xF800
"""Writable bits of DRIVE_CURRENT. The converter itself sets the other bits (INIT_IDRIVE)."""

Tank = Callable[[int, int], tuple[float, float]]
"""Function that returns resonance frequency (Hz) and parallel resistance (ohm) of a tank by channel and time (ns).

The parallel resistance is 0 if the tank does not oscillate.
"""


class NotAcknowledged(OSError):
    """Raised if the converter does not acknowledge an I2C access."""


class Registers:
    """A converter with registers, and a tank on each channel.

    `time` (ns) advances by the duration of each access, and by `advance`. `noise_steps` is the noise parameter of the
    converter's model; with 0, the counts have no noise. If `silent`, the converter does not answer. `stuck` holds
    channels whose result does not change. `glitch` holds channels whose next result is wrong by 0.4 to 2.7 %, or by 20
    to 140 %. TI's E2E thread 939787 reports such results of an LDC1612: once an hour 8.5 to 20 MHz instead of 7.8 MHz,
    without an error flag.
    """

    def __init__(self, device: Converter, clock: float, tank: Tank, noise_steps: float, seed: int = 1) -> None:
        self.device, self.clock, self.tank, self.noise_steps = device, clock, tank, noise_steps
        self.seed, self.time = seed & 0xFFFFFFFF or 1, 0
        self.silent = False
        self.stuck: set[int] = set()
        self.glitch: set[int] = set()
        self.reset()

    def reset(self) -> None:
        """Reset the converter as after power-up: registers have their defaults, and the converter sleeps."""
        self.words = dict.fromkeys(range(128), 0) | at.AT_RESET | {at.DEVICE_ID: self.device.device_id}
        for channel in range(self.device.channels, at.MOST_CHANNELS):
            self.words[at.RCOUNT + channel] = 0
        self._sleep()

    def _sleep(self) -> None:
        self.due, self.converting = NEVER, 0
        self.result, self.lower, self.flags = [0] * 4, [0] * 4, [0] * 4
        self.errors, self.unread, self.ready = 0, 0, False
        self.held: int | None = None

    # ------------------------------------------------------------------------------------------------------ settings

    def _of(self, first: int, channel: int) -> int:
        return self.words[first + channel]

    def _reference(self, channel: int) -> float:
        return self.clock / (self._of(at.CLOCK_DIVIDERS, channel) & 0x3FF)

    @property
    def is_scanning(self) -> bool:
        """Whether several channels are converted in turn."""
        return bool(self.words[at.MUX_CONFIG] & at.AUTOSCAN)

    @property
    def last(self) -> int:
        """Last channel of a scan, or the only channel if a single channel is converted continuously."""
        if not self.is_scanning:
            return self.words[at.CONFIG] >> at.ACTIVE_CHANNEL
        sequence = self.words[at.MUX_CONFIG] >> at.SEQUENCE & 3
        return 1 if sequence == 3 or self.device.channels == 2 else sequence + 1

    def _amplitude(self, channel: int) -> float:
        return self.device.amplitude(self.tank(channel, self.time)[1], self._of(at.DRIVE_CURRENT, channel) >> 11)

    # ---------------------------------------------------------------------------------------------------- conversions

    def _begin(self, channel: int, after: int, is_settling: bool) -> None:
        dividers = self._of(at.CLOCK_DIVIDERS, channel)
        self.converting = channel
        if not dividers & 0x3FF or not dividers >> 12 or self._of(at.RCOUNT, channel) <= 4:
            self.due = NEVER
            return
        settling = law.settle_periods(self._of(at.SETTLECOUNT, channel)) if is_settling else 0.0
        periods = settling + law.conversion_periods(self._of(at.RCOUNT, channel))
        self.due = self.time + after + int(periods * 1e9 / self._reference(channel))
        if self._amplitude(channel) < self.device.limit(DEAD):
            self.due += round(at.WATCHDOG_RECOVERY * 1e9)

    def _next_random(self) -> int:
        """Return the next pseudo-random number with 32 bits (xorshift by 13, 17 and 5)."""
        word = self.seed
        word ^= word << 13 & 0xFFFFFFFF
        word ^= word >> 17
        word ^= word << 5 & 0xFFFFFFFF
        self.seed = word
        return word

    def _conversion_result(self, channel: int) -> int:
        full = (self._of(at.CLOCK_DIVIDERS, channel) >> 12) * self._reference(channel)
        count = self.tank(channel, self.time)[0] / full * 2.0**self.device.bits
        sigma = law.counting_noise(self.noise_steps, 1.0, self._of(at.RCOUNT, channel))
        draws = [self._next_random() for _ in range(6)]  # the sum of twelve uniform deviates is nearly normal
        normal = (sum((word >> 16) + (word & 0xFFFF) for word in draws) + 6.0) / 65536.0 - 6.0
        result = count + count * sigma * normal - 4096.0 * self._of(at.OFFSET, channel)
        if channel in self.glitch:
            self.glitch.discard(channel)
            which = self._next_random() % 14
            result *= 1.0 + (which + 1.0) / 256.0 if which < 7 else 1.0 + (which - 6.0) / 5.0
        return min(max(math.floor(result + 0.5), 0), 2**self.device.bits - 1)

    def _complete(self) -> None:
        channel, let = self.converting, self.words[at.ERROR_CONFIG]
        volts, limit = self._amplitude(channel), self.device.limit
        is_dead = volts < limit(DEAD)
        result = 0 if is_dead else self._conversion_result(channel)
        result = self.result[channel] if channel in self.stuck else result
        wrong = (
            ("ERR_UR", result == 0), ("ERR_OR", result == 2**self.device.bits - 1), ("ERR_WD", is_dead),
            ("ERR_AHE", volts > limit(HIGH)), ("ERR_ALE", volts < limit(LOW)),
        )
        names = [name for name, is_so in wrong if is_so]
        let_out = {name for name, bit in at.ERRORS_TO_RESULTS.items() if let & bit}
        flagged = {"ERR_AE" if name in ("ERR_AHE", "ERR_ALE") else name for name in names if name in let_out}
        self.result[channel] = result
        self.flags[channel] = sum(at.DATA_FLAGS[name][0] for name in flagged)
        self.unread |= at.UNREAD >> channel
        errors = sum(at.STATUS_ERRORS[name] for name in names if let & at.ERRORS_TO_RESULTS[name] >> 8)
        is_first, is_finished = bool(errors) and not self.errors, channel == self.last and bool(let & 1)
        self.ready = self.ready or is_finished
        if is_first:
            self.errors = errors | channel << at.ERROR_CHANNEL
        if is_first or is_finished:
            self._hold()
        pause = round(self.device.limit("switch_delay") * 1e9) + int(5e9 / self._reference(channel))
        following = channel if not self.is_scanning else 0 if channel == self.last else channel + 1
        self._begin(following, pause, self.is_scanning)

    def advance(self, nanoseconds: int) -> None:
        """Advance the simulated time, and complete the conversions that end in this time."""
        end = self.time + nanoseconds
        while self.due <= end:
            self.time = self.due
            self._complete()
        self.time = end

    def pause(self, nanoseconds: int) -> None:
        """Advance the simulated time without conversions. The present conversion ends that much later."""
        self.time += nanoseconds
        self.due += nanoseconds if self.due != NEVER else 0

    # --------------------------------------------------------------------------------------------------------- access

    def _hold(self) -> None:
        """Freeze the value of STATUS until it is read (8.1.8)."""
        if self.held is None:
            self.held = self.errors | (at.DATA_READY if self.ready else 0) | self.unread

    def write(self, register: int, value: int) -> None:
        """Write a register. Raises `NotAcknowledged` if the converter does not answer."""
        asleep = bool(self.words[at.CONFIG] & at.SLEEP)
        self.advance(WRITE)
        if self.silent:
            raise NotAcknowledged(f"no acknowledge for register 0x{register:02X}")
        if register == at.RESET_DEV and value & 0x8000:
            self.reset()
            return
        channels = (first + channel for first in CHANNEL_REGISTERS for channel in range(self.device.channels))
        if register != at.CONFIG and not (asleep and register in (*SETTING_REGISTERS, *channels)):
            return
        self.words[register] = value & (DRIVE_CODE if register >= at.DRIVE_CURRENT else 0xFFFF)
        if register == at.CONFIG and value & at.SLEEP:
            self._sleep()
        elif register == at.CONFIG and asleep:
            self._begin(0 if self.is_scanning else self.last, WAKE, True)

    def read(self, register: int) -> int:
        """Return a register's value. Reading STATUS or the upper word of a result clears flags.

        Raises `NotAcknowledged`.
        """
        self.advance(READ)
        if self.silent:
            raise NotAcknowledged(f"no acknowledge for register 0x{register:02X}")
        if register == at.STATUS:
            self._hold()
            status, self.held, self.errors, self.ready = self.held or 0, None, 0, False
            return status
        if 0 <= register < 2 * self.device.channels:
            return self.lower[register // 2] if register % 2 else self._upper(register // 2)
        return self.words.get(register, 0)

    def _upper(self, channel: int) -> int:
        upper = self.flags[channel] | self.result[channel] >> 16
        self.lower[channel] = self.result[channel] & 0xFFFF
        self.flags[channel] = 0
        self.unread &= ~(at.UNREAD >> channel)
        if self.errors >> at.ERROR_CHANNEL == channel:
            self.errors = 0
        self.held, self.ready = None, False
        return upper


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
"""Description of each simulated fault, by the fault's name."""

_WRITTEN = re.compile(r"(?P<name>[a-z-]+)(?::(?P<coils>[^@]+))?(?:@(?P<at>[0-9.eE+-]+))?")
LONGEST = 86_400.0
"""Longest duration (s) of readings from a simulated board, and latest start of a fault: a day."""

_EVERY = 3600.0
"""Default period (s) of glitches."""


@record
class Fault:
    """A simulated fault: its name, the affected coils, and its start (s).

    A glitch repeats with the period `at`.
    """

    name: str
    coils: tuple[str, ...] = ()
    at: float = 0.0

    @classmethod
    def read(cls, text: str) -> Fault:
        """Return a fault from its text, like ``open:C2``, ``swapped:C1:C2``, ``reset@0.5`` or ``glitch:C1@3600``.

        Raises ValueError for other texts.
        """
        match = _WRITTEN.fullmatch(text)
        if match is None or match["name"] not in FAULTS:
            raise ValueError(f"{text!r} is no fault; faults are {', '.join(FAULTS)}, with :COIL and @SECONDS")
        coils = tuple((match["coils"] or "").split(":")) if match["coils"] else ()
        try:
            at = float(match["at"] or (_EVERY if match["name"] == "glitch" else 0.0))
        except ValueError:
            at = math.nan
        if not 0.0 <= at <= LONGEST or (not at and match["name"] == "glitch"):
            raise ValueError(f"fault {text!r}: @SECONDS is 0 to {LONGEST:g}, and more than 0 between glitches")
        return cls(match["name"], coils, at)


class SimulatedConverter(Registers):
    """A converter of a design, asleep as after power-up. Set it up by its registers, as a driver does.

    Parameters
    ----------
    spec
        The spec or the design.
    loads
        Rows of time (s) and force (N: normal, shear along x, along y) on a level target, linear in between. With two
        moments (N m) more, the target is free to tilt. If None, the target is at rest, or the board is bare if the
        design has no target or `state` is ``free``.
    frequencies
        Frequencies (n, coils; Hz) at the times of `loads`, in place of the computed ones.
    faults
        Faults, or their texts as `Fault.read` takes them.
    state
        State of the coils without loads.
    number
        Number of the converter in the sensor, from 0.
    seed
        Seed of the noise, which is the noise of the estimates.
    noise
        Whether the counts have noise.

    Raises
    ------
    ValueError
        for unknown faults, coils and states, loads without a response, and converters of other families
    """

    @checked_arguments
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
        channels = device.coils_per_converter(len(design.estimates.all_coils))
        if not 0 <= number < len(channels):
            raise ValueError(f"the design has no converter {number}")
        self._first, self._estimates = sum(channels[:number]), design.estimates
        first = self._first
        self.coils = design.estimates.all_coils[first : first + channels[number]]
        self.faults = _parse_faults(faults, [coil.name for coil in design.estimates.all_coils])
        names = self.coils[0].states
        if state not in (*names, REST):
            raise ValueError(f"state={state}: the design has the states {', '.join(names)}")
        states = [coil.states.get(state) or coil.states[FREE] for coil in self.coils]
        self._ohms = [each.parallel_resistance for each in states]
        self._times, self._read = _frequencies_over_time(design, states, loads, frequencies, first)
        self._layers = len(design.spec.coil.layers)
        self._glitches = {fault: 1 for fault in self.faults if fault.name == "glitch"}
        self._resets = {fault for fault in self.faults if fault.name == "reset"}
        steps = device.limit("noise_steps") if noise else 0.0
        super().__init__(device, design.spec.readout.clock, self._tank, steps, seed)

    def advance(self, nanoseconds: int) -> None:
        """Advance the simulated time. Faults that begin in this time take effect."""
        end = self.time + nanoseconds
        self.silent = any(fault.name == "nack" and fault.at * 1e9 <= end for fault in self.faults)
        for fault in [each for each in self._resets if each.at * 1e9 <= end]:
            self._resets.discard(fault)
            self.reset()
        for fault, times in self._glitches.items():
            if times * fault.at * 1e9 <= end:
                self._glitches[fault] = times + 1
                self.glitch |= set(self._affected_channels(fault))
        self.stuck = {channel for fault in self._begun_faults("stuck") for channel in self._affected_channels(fault)}
        super().advance(nanoseconds)

    def hold(self, frequencies: ArrayLike) -> None:
        """Set constant frequencies (Hz) of all coils of the sensor, from now on."""
        columns = slice(self._first, self._first + len(self.coils))
        read = all_coil_frequencies(self._estimates.coils, self._estimates.reference, frequencies)
        self._times, self._read = np.zeros(1), read[:1, columns]

    def _begun_faults(self, name: str) -> list[Fault]:
        return [fault for fault in self.faults if fault.name == name and fault.at * 1e9 <= self.time]

    def _affected_channels(self, fault: Fault) -> list[int]:
        """Return the channels that a fault affects. If the fault has no coils, all channels."""
        return [k for k, coil in enumerate(self.coils) if not fault.coils or coil.name in fault.coils]

    def _tank(self, channel: int, time: int) -> tuple[float, float]:
        """Return resonance frequency (Hz) and parallel resistance (ohm) of the tank on a channel at a time (ns)."""
        wired = channel
        for fault in self._begun_faults("swapped"):
            pair = self._affected_channels(fault)[:2]
            if channel in pair and len(pair) == 2:
                wired = pair[1 - pair.index(channel)]
        if wired >= len(self.coils):
            return 0.0, 0.0
        frequency, ohms = float(np.interp(time * 1e-9, self._times, self._read[:, wired])), self._ohms[wired]
        begun = [fault for fault in self.faults if fault.at * 1e9 <= time]
        hit = {fault.name for fault in begun if wired in self._affected_channels(fault)}
        if hit & {"open", "short"}:
            return 0.0, 0.0
        if "low-amplitude" in hit:
            ohms *= 0.5
        if "lost-layer" in hit:
            # One layer is bridged, or half the turns of a single layer. The winding's inductance is proportional to the
            # square of the remaining turns (layers are close to each other), its resistance to their number.
            # R_P is L / (R C)
            coil, remaining = self.coils[wired], (self._layers - 1) / self._layers if self._layers > 1 else 0.5
            fraction = coil.winding_inductance / (coil.winding_inductance + abs(coil.lead_inductance))
            inductance = 1.0 - fraction * (1.0 - remaining**2)
            return frequency / math.sqrt(inductance), ohms * inductance / remaining
        return frequency, ohms


def _parse_faults(texts: Sequence[str | Fault] | str, names: Sequence[str]) -> tuple[Fault, ...]:
    each = [texts] if isinstance(texts, str) else texts
    faults = tuple(Fault.read(fault_text) if isinstance(fault_text, str) else fault_text for fault_text in each)
    for fault in faults:
        unknown = [name for name in fault.coils if name not in names]
        if unknown:
            raise ValueError(f"{fault.name}: there is no coil {unknown[0]}; coils are {', '.join(names)}")
        if fault.name == "swapped" and len(fault.coils) != 2:
            raise ValueError("swapped takes two coils, as in swapped:C1:C2")
    return faults


def _frequencies_over_time(
    design: Design, states: Sequence[StateEstimate], loads: ArrayLike | None, frequencies: ArrayLike | None, first: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return times (n; s), and the frequencies of the converter's coils at these times (n, coils; Hz).

    `first` is the index of the converter's first coil in the sensor.
    """
    estimates = design.estimates
    if loads is None:
        if frequencies is None:
            by_time = np.array([[state.frequency for state in states]])
        else:
            by_coil = all_coil_frequencies(estimates.coils, estimates.reference, frequencies)
            by_time = by_coil[:, first : first + len(states)]
        return np.arange(len(by_time), dtype=float), by_time
    rows = np.atleast_2d(np.asarray(loads, dtype=float))
    if rows.shape[-1] not in (4, 6):
        raise ValueError("loads are rows of a time (s) and three forces (N), or these and two moments (N m)")
    if frequencies is None:
        frequencies = respond(design, loads=rows[:, 1:], rotation="held" if rows.shape[-1] == 4 else "free").frequency
    by_coil = all_coil_frequencies(estimates.coils, estimates.reference, frequencies)
    return rows[:, 0], by_coil[:, first : first + len(states)]


def all_coil_frequencies(
    coils: Sequence[CoilEstimate], reference: CoilEstimate | None, frequencies: ArrayLike
) -> np.ndarray:
    """Return frequencies (n, coils; Hz) of all coils, the reference coil last.

    If `frequencies` has no column for the reference coil, the coil's frequency at rest is added.
    """
    rows = np.atleast_2d(np.asarray(frequencies, dtype=float))
    if reference is None or rows.shape[1] == len(coils) + 1:
        return rows
    rest = reference.states.get(REST) or reference.states[FREE]
    return np.column_stack([rows, np.full(len(rows), rest.frequency)])
