"""Forces of the sensor for MicroPython, by calibration.h and temperature.h. Copy both files onto the board.

    from forces import BEYOND, NO_TEMPERATURE, OK, Forces
    forces = Forces()                        # of a cell N: Forces("cell-N/", N)
    forces.tare(readings)                    # a list of 16 results of sensor.poll(), without load
    state, newtons = forces(sensor.poll())   # newtons by axis, like {"normal": 1.2}; moments in newton metres

If temperature.h is there, the forces are compensated by the temperature change since the tare. A reference coil in the
design measures it. Otherwise give the temperature (degrees Celsius): ``forces.tare(readings, celsius())`` and
``forces(reading, celsius())``, with `celsius` of thermometer.py. `state` is one of these:

* OK
* NO_READING: a coil has no good reading, or there is no tare; the forces are 0
* BEYOND: the forces are those at the end of the map's range
* NO_TEMPERATURE: no valid temperature change; the forces are not compensated, and may be at the end of the range
"""

import math

import sensor_config

OK, NO_READING, BEYOND, NO_TEMPERATURE = range(4)
GOOD_STATES = (0, 6)  # GOOD and AMPLITUDE of sensor.py
LARGEST = 0xFFFFFFF  # result of a conversion over the range
LEAST = 1e-6  # least argument of the logarithm
AXES = ("normal", "shear_x", "shear_y", "moment_x", "moment_y")
NAN = float("nan")


def read_header(path, cell=None):
    """Return constants and arrays of a calibration header by name, in small letters and without ``sitscad_``.

    Arrays of arrays are flat. `cell` is the number of the cell whose header it is.
    """
    prefix = "sitscad_" if cell is None else f"sitscad_cell{cell}_"
    values, array = {}, None
    with open(path) as lines:
        for line in lines:
            text = line.split("/*")[0].strip().lower()
            words = text.split()
            if len(words) >= 2 and words[0] == "#define" and words[1].startswith(prefix):
                values[words[1][len(prefix):]] = _number(words[2]) if len(words) > 2 else True
            elif text.startswith("static const") and text.endswith("= {"):
                array = values[words[3].split("[")[0][len(prefix):]] = []
            elif text.startswith("};"):
                array = None
            elif array is not None:
                array += [_number(each) for each in text.replace("{", " ").replace("}", " ").replace(",", " ").split()]
    return values


def _number(text):
    return float(text.rstrip("f")) if "." in text else int(text.rstrip("u"), 0)


class Forces:
    """The map of a sensor or of a cell, its tare, and the compensation by temperature.

    `folder` has calibration.h, and temperature.h if there is one. `cell` is the number of a cell, from 1.
    """

    def __init__(self, folder="", cell=None):
        self.map = read_header(folder + "calibration.h", cell)
        try:
            self.drift = read_header(folder + "temperature.h", cell)
        except OSError:
            self.drift = None
        self.is_compensated = getattr(sensor_config, "COMPENSATED", False)
        self.coils = range((cell or 1) * self.map["coils"] - self.map["coils"], (cell or 1) * self.map["coils"])
        self.axes = sorted((name for name in AXES if name in self.map), key=lambda name: self.map[name])
        self.rest = None

    def _counts(self, reading):
        """Return the counts of the cell's coils. None if a coil has no good reading."""
        if reading is None or not all(reading[k][1] in GOOD_STATES for k in self.coils):
            return None
        return [reading[k][0] for k in self.coils]

    def _thermal(self, reading, celsius):
        """Return the quantity that shows the temperature: counts of the reference coil, or degrees Celsius."""
        if self.drift is None or not self.drift.get("by_reference"):
            return celsius
        counts, status = reading[sensor_config.REFERENCE]
        return counts if status in GOOD_STATES and counts else NAN

    def tare(self, readings, celsius=NAN):
        """Store the means of consecutive readings without load, and their temperature (degrees Celsius).

        Return False if a coil has no good reading. The old tare then stays.
        """
        counts = [self._counts(reading) for reading in readings]
        if not counts or None in counts:
            return False
        self.rest = [sum(each) // len(counts) for each in zip(*counts)]
        thermal = sum(self._thermal(reading, celsius) for reading in readings)
        self.thermal = thermal // len(readings) if isinstance(thermal, int) else thermal / len(readings)
        return True

    def warming(self, reading, celsius=NAN):
        """Return the temperature change (K) since the tare. NaN if it is not valid."""
        if self.drift is None or self.rest is None:
            return NAN
        change = self._thermal(reading, celsius) - self.thermal
        if self.drift.get("by_reference"):
            return change / self.thermal / self.drift["by_reference"]
        if "coldest" in self.drift:  # measured coefficients, with a margin for errors of the temperature readings
            low, high = self.drift["coldest"], self.drift["hottest"]
            margin = 0.05 * (high - low)
            if not all(low - margin <= each <= high + margin for each in (celsius, self.thermal)):
                return NAN
        return change

    def __call__(self, reading, celsius=NAN):
        """Return (state, forces by axis) of a reading of all coils at a temperature (degrees Celsius)."""
        counts = self._counts(reading)
        if counts is None or self.rest is None:
            return NO_READING, dict.fromkeys(self.axes, 0.0)
        state, forces = self._mapped(counts)
        if self.is_compensated:
            kelvin = self.warming(reading, celsius)
            if self.drift is not None and abs(kelvin) <= self.drift["warmest"]:
                state, forces = self._compensated(counts, kelvin, forces)
            elif state != NO_READING:
                state = NO_TEMPERATURE
        return state, dict(zip(self.axes, forces))

    def _compensated(self, counts, kelvin, forces):
        """Return (state, forces) with the drift taken off. The drift depends on the force, so it is done thrice."""
        drift, state = self.drift, OK
        for _ in range(3):
            part = min(max(forces[self.map["normal"]] / drift["load"], 0.0), 1.0)
            cold = [count - int(kelvin * (rest + part * loaded) * count)
                    for count, rest, loaded in zip(counts, drift["drift"], drift["drift_loaded"])]
            state, forces = self._mapped(cold)
            forces = [force * (1.0 + drift["stiffening"] * kelvin) for force in forces]
        return state, forces

    def _mapped(self, counts):
        """Return (state, forces) of counts by the map."""
        table, state, seen = self.map, OK, []
        if not all(0 < count < LARGEST for count in counts + self.rest):
            return NO_READING, [0.0] * len(self.axes)
        for now, rest, gain in zip(counts, self.rest, table["gain"]):
            share = (rest - now) / now  # the difference of whole numbers is exact
            seen.append(math.log(max(1.0 - gain * share * (2.0 + share), LEAST)))
        number, width, mixed = len(self.axes), len(seen), []
        for axis in range(number):
            value = sum(m * s for m, s in zip(table["mix"][axis * width:], seen))
            inside = min(max(value, table["low"][axis]), table["high"][axis])
            state = state if inside == value else BEYOND
            mixed.append(inside)
        forces, count = [0.0] * number, table["terms"]
        for k in range(count):
            term = 1.0
            for axis in range(number):
                term *= mixed[axis] ** table["powers"][k * number + axis]
            for axis in range(number):
                forces[axis] += table["coefficients"][axis * count + k] * term
        return state, [force * full for force, full in zip(forces, table["full_scale"])]
