"""A simulated LDC1612 or LDC1614, register by register (data sheet SNOSCY9A, 7.4 to 7.6 and 8.1): the twin of
``simulated.c`` in the firmware, to the bit.

What the data sheet leaves open is unverified: that a channel which does not oscillate reads 0 and takes the watchdog's
recovery time, that registers are not written while it converts, that bits without a meaning read 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from sitscad.readout import ldc_registers as at
from sitscad.readout.converter import Converter

READ, WRITE = 122_500, 97_500
"""Nanoseconds that a register takes over I2C at 400 kHz."""

WAKE = 377_512
"""Nanoseconds from sleep to the first settling: 16384 periods of the internal oscillator's typical 43.4 MHz (7.4.2)."""

RECOVERY = 5_200_000
"""Nanoseconds of recovery after a watchdog timeout (6.5)."""

NEVER = 2**64 - 1
DEAD, LOW, HIGH = "amplitude_stable_min", "amplitude_optimum_min", "amplitude_max"
"""Figures of the amplitude: below the first it does not oscillate, outside of the others it is flagged."""

CONFIGURED = (at.ERROR_CONFIG, at.MUX_CONFIG)
OF_CHANNELS = (at.RCOUNT, at.OFFSET, at.SETTLECOUNT, at.CLOCK_DIVIDERS, at.DRIVE_CURRENT)
DRIVE_CODE = 0xF800
"""The bits of DRIVE_CURRENT that are written; INIT_IDRIVE is the converter's own."""

Tank = Callable[[int, int], tuple[float, float]]
"""Resonance (Hz) and R_P (ohm) of a channel's tank at a time (ns); R_P 0 where it does not oscillate."""


class NoAnswer(OSError):
    """The converter does not acknowledge."""


class Registers:
    """A converter with tanks on its channels. `time` (ns) goes on by what each access takes, and by `advance`.

    `noise_steps` is as in the figures of the converter; 0 gives the counts alone. `silent` tells a converter that does
    not answer; `stuck` and `glitch` hold channels whose result stays as it is, and whose next one is wrong: by 0.4 to
    2.7 %, or by 20 to 140 %, as TI's E2E thread 939787 has it of an LDC1612 (once an hour 8.5 to 20 MHz for 7.8 MHz,
    without a flag).
    """

    def __init__(self, device: Converter, clock: float, tank: Tank, noise_steps: float, seed: int = 1) -> None:
        self.device, self.clock, self.tank, self.noise_steps = device, clock, tank, noise_steps
        self.seed, self.time = seed & 0xFFFFFFFF or 1, 0
        self.silent = False
        self.stuck: set[int] = set()
        self.glitch: set[int] = set()
        self.reset()

    def reset(self) -> None:
        """As after power-up: registers at their defaults, asleep."""
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
        """Whether channels are converted in turn."""
        return bool(self.words[at.MUX_CONFIG] & at.AUTOSCAN)

    @property
    def last(self) -> int:
        """The last channel of a scan; the only one where one is converted over and over."""
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
        settling = 16.0 * max(2, self._of(at.SETTLECOUNT, channel)) if is_settling else 0.0
        periods = settling + 16.0 * self._of(at.RCOUNT, channel) + 4.0
        dead = RECOVERY if self._amplitude(channel) < self.device.limit(DEAD) else 0
        self.due = self.time + after + int(periods * 1e9 / self._reference(channel)) + dead

    def _drawn(self) -> int:
        """The next of a row of 32 bits (xorshift by 13, 17 and 5)."""
        word = self.seed
        word ^= word << 13 & 0xFFFFFFFF
        word ^= word >> 17
        word ^= word << 5 & 0xFFFFFFFF
        self.seed = word
        return word

    def _normal(self) -> float:
        """Nearly a normal deviate: twelve even ones added."""
        drawn = [self._drawn() for _ in range(6)]
        return (sum((word >> 16) + (word & 0xFFFF) for word in drawn) + 6.0) / 65536.0 - 6.0

    def _converted(self, channel: int) -> int:
        full = (self._of(at.CLOCK_DIVIDERS, channel) >> 12) * self._reference(channel)
        count = self.tank(channel, self.time)[0] / full * 2.0**self.device.bits
        sigma = self.noise_steps / (32.0 * self._of(at.RCOUNT, channel))
        found = count + count * sigma * self._normal() - 4096.0 * self._of(at.OFFSET, channel)
        if channel in self.glitch:
            self.glitch.discard(channel)
            which = self._drawn() % 14
            found *= 1.0 + (which + 1.0) / 256.0 if which < 7 else 1.0 + (which - 6.0) / 5.0
        return min(max(math.floor(found + 0.5), 0), 2**self.device.bits - 1)

    def _complete(self) -> None:
        channel, let = self.converting, self.words[at.ERROR_CONFIG]
        volts, limit = self._amplitude(channel), self.device.limit
        is_dead = volts < limit(DEAD)
        found = 0 if is_dead else self._converted(channel)
        found = self.result[channel] if channel in self.stuck else found
        wrong = (
            ("ERR_UR", found == 0), ("ERR_OR", found == 2**self.device.bits - 1), ("ERR_WD", is_dead),
            ("ERR_AHE", volts > limit(HIGH)), ("ERR_ALE", volts < limit(LOW)),
        )
        names = [name for name, is_so in wrong if is_so]
        let_out = {name for name, bit in at.ERRORS_TO_RESULTS.items() if let & bit}
        flagged = {"ERR_AE" if name in ("ERR_AHE", "ERR_ALE") else name for name in names if name in let_out}
        self.result[channel] = found
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
        """Let time go by."""
        end = self.time + nanoseconds
        while self.due <= end:
            self.time = self.due
            self._complete()
        self.time = end

    # --------------------------------------------------------------------------------------------------------- access

    def _hold(self) -> None:
        """STATUS keeps what it says until it is read (8.1.8)."""
        if self.held is None:
            self.held = self.errors | (at.DATA_READY if self.ready else 0) | self.unread

    def write(self, register: int, value: int) -> None:
        """Write a register; raises `NoAnswer` where the converter does not acknowledge."""
        asleep = bool(self.words[at.CONFIG] & at.SLEEP)
        self.advance(WRITE)
        if self.silent:
            raise NoAnswer(f"no acknowledge for register 0x{register:02X}")
        if register == at.RESET_DEV and value & 0x8000:
            self.reset()
            return
        channels = (first + channel for first in OF_CHANNELS for channel in range(self.device.channels))
        if register != at.CONFIG and not (asleep and register in (*CONFIGURED, *channels)):
            return
        self.words[register] = value & (DRIVE_CODE if register >= at.DRIVE_CURRENT else 0xFFFF)
        if register == at.CONFIG and value & at.SLEEP:
            self._sleep()
        elif register == at.CONFIG and asleep:
            self._begin(0 if self.is_scanning else self.last, WAKE, True)

    def read(self, register: int) -> int:
        """Read a register, STATUS and the upper ones of results with what that clears; raises `NoAnswer`."""
        self.advance(READ)
        if self.silent:
            raise NoAnswer(f"no acknowledge for register 0x{register:02X}")
        if register == at.STATUS:
            self._hold()
            found, self.held, self.errors, self.ready = self.held or 0, None, 0, False
            return found
        if 0 <= register < 2 * self.device.channels:
            return self.lower[register // 2] if register % 2 else self._upper(register // 2)
        return self.words.get(register, 0)

    def _upper(self, channel: int) -> int:
        found = self.flags[channel] | self.result[channel] >> 16
        self.lower[channel] = self.result[channel] & 0xFFFF
        self.flags[channel] = 0
        self.unread &= ~(at.UNREAD >> channel)
        if self.errors >> at.ERROR_CHANNEL == channel:
            self.errors = 0
        self.held, self.ready = None, False
        return found
