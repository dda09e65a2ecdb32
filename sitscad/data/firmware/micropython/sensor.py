"""Driver of the sensor for MicroPython. sensor_config.py beside this file has its tables.

    from machine import I2C, Pin
    from sensor import Sensor
    sensor = Sensor(I2C(0, freq=400000), sd=Pin(4, Pin.OUT))  # without sd if SD is wired to GND
    while True:                          # more than two converters: Sensor(I2C(0, ...), I2C(1, ...), sd=...)
        reading = sensor.poll()          # None if no result is new
        if reading:
            print(reading)               # (counts, status) of every coil

forces.py computes forces. It needs calibration.h on the board.
"""

import time

from sensor_config import ADDRESSES, BUSES, COILS, SETTINGS, WAKE_MS

STATUS, CONFIG, RESET_DEV, DRIVE_CURRENT, MANUFACTURER_ID, DEVICE_ID = 0x18, 0x1A, 0x1C, 0x1E, 0x7E, 0x7F
IDENTITY = (0x5449, 0x3055)
GOOD, STALE, UNDER_RANGE, OVER_RANGE, WATCHDOG, OUT_OF_BAND, AMPLITUDE = range(7)
NOTHING_NEW = 4
"""Number of polls without a new result, after which the settings of a converter are checked."""


class SensorError(Exception):
    """The sensor cannot be used. The text states the reason."""


class Sensor:
    """The converters (LDC1612 or LDC1614) of a sensor, at most two on each I2C bus, with the settings of its design."""

    def __init__(self, *buses, sd=None):
        if len(buses) != BUSES[-1] + 1:
            raise SensorError(f"the converters are on {BUSES[-1] + 1} buses, not {len(buses)}")
        if sd is not None:  # shut the converters down and wake them
            sd.value(1)
            time.sleep_ms(1)
            sd.value(0)
        time.sleep_ms(WAKE_MS)
        self.buses = buses
        self.idle = [0] * len(ADDRESSES)
        self.restarts = 0
        self.readings = [(0, STALE)] * len(COILS)
        self.behind = [255] * len(COILS)  # results of other coils since the last result of each coil
        for converter in range(len(ADDRESSES)):
            self._set_up(converter)

    def _read(self, converter, register):
        upper, lower = self.buses[BUSES[converter]].readfrom_mem(ADDRESSES[converter], register, 2)
        return upper << 8 | lower

    def _write(self, converter, register, value):
        self.buses[BUSES[converter]].writeto_mem(ADDRESSES[converter], register, bytes((value >> 8, value & 0xFF)))

    def _set_up(self, converter):
        """Check the identity, reset, write all registers and read them back. CONFIG comes last."""
        if (self._read(converter, MANUFACTURER_ID), self._read(converter, DEVICE_ID)) != IDENTITY:
            raise SensorError("no LDC1612 or LDC1614 answers")
        self._write(converter, RESET_DEV, 0x8000)
        rows = [row[1:] for row in SETTINGS if row[0] == converter]
        for register, value in rows[:-1]:
            self._write(converter, register, value)
        for register, value in rows:
            if register == CONFIG:
                self._write(converter, register, value)
            kept = 0xF800 if DRIVE_CURRENT <= register < DRIVE_CURRENT + 4 else 0xFFFF
            if (self._read(converter, register) ^ value) & kept:
                raise SensorError(f"register {register:#04x} does not hold the written value")
        self.idle[converter] = 0

    def _status(self, coil, counts, flags):
        _, _, _, low, high = COILS[coil]
        if flags & 2:
            return WATCHDOG
        if flags & 8 or counts == 0:
            return UNDER_RANGE
        if flags & 4 or counts >= 0xFFFFFFF:
            return OVER_RANGE
        if not low <= counts <= high:
            return OUT_OF_BAND
        return AMPLITUDE if flags & 1 else GOOD

    def poll(self):
        """Return counts and status of every coil. None if no coil has a new result.

        A coil keeps its last result until every other coil has been read twice; then it is STALE. `restarts` is the
        number of times that a converter lost its settings and was set up again.
        """
        fresh = {}
        for converter in range(len(ADDRESSES)):
            status = self._read(converter, STATUS)
            new = [k for k, coil in enumerate(COILS) if coil[1] == converter and status & 8 >> coil[2]]
            for k in new:
                channel = COILS[k][2]
                upper = self._read(converter, 2 * channel)
                counts = (upper & 0xFFF) << 16 | self._read(converter, 2 * channel + 1)
                fresh[k] = (counts, self._status(k, counts, upper >> 12))
                self.behind = [0 if other == k else count + 1 for other, count in enumerate(self.behind)]
            self.idle[converter] = 0 if new else self.idle[converter] + 1
            if self.idle[converter] >= NOTHING_NEW:
                self.idle[converter] = 0
                wanted = [value for where, register, value in SETTINGS if (where, register) == (converter, CONFIG)]
                if self._read(converter, CONFIG) != wanted[0]:
                    self._set_up(converter)
                    self.restarts += 1
        old = 2 * (len(COILS) - 1)
        self.readings = [
            fresh.get(k, (counts, STALE if self.behind[k] > old else status))
            for k, (counts, status) in enumerate(self.readings)
        ]
        return self.readings if fresh else None
