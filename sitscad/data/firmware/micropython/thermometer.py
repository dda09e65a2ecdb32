"""Temperature sensor of the design (readout.thermistor) for MicroPython. sensor_config.py has its figures.

    from thermometer import Digital
    celsius = Digital(I2C(0, freq=400000))

    from thermometer import Ntc
    celsius = Ntc(ADC(26))

`Digital` is a digital sensor with grounded address pins. `Ntc` is an NTC thermistor between the input and ground, with
a resistor between the input and the supply. A call of `celsius` returns degrees Celsius, or NaN if they are not valid.
"""

import math

import sensor_config

LOWEST, HIGHEST = -55.0, 150.0  # degrees Celsius; temperatures beyond these are faults
NAN = float("nan")


def _checked(celsius):
    return celsius if LOWEST <= celsius <= HIGHEST else NAN


class Digital:
    """A digital sensor on an I2C bus.

    Every call reads the part's identity, so that a hung bus gives no temperature.
    """

    def __init__(self, bus):
        self.bus = bus
        self.address, self.temperature, self.step, self.identity, self.identity_value = sensor_config.DIGITAL

    def _read(self, register):
        upper, lower = self.bus.readfrom_mem(self.address, register, 2)
        return upper << 8 | lower

    def __call__(self):
        """Return the temperature. NaN without an answer, from another part, or before the first conversion."""
        try:
            if self._read(self.identity) & 0xFFF != self.identity_value:
                return NAN
            steps = self._read(self.temperature)
        except OSError:
            return NAN
        return _checked((steps - (steps >> 15 << 16)) * self.step)


class Ntc:
    """An NTC in a divider, at an input with ``read_u16()`` like ``machine.ADC``."""

    def __init__(self, adc):
        self.adc = adc

    def __call__(self):
        """Return the temperature. NaN if the NTC is open or shorted."""
        ratio = self.adc.read_u16() / 65535
        if not 0.001 < ratio < 0.999:
            return NAN
        ohm, b, series = sensor_config.NTC
        return _checked(1.0 / (1.0 / 298.15 + math.log(series / ohm * ratio / (1.0 - ratio)) / b) - 273.15)
