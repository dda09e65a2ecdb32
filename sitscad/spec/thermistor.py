"""Temperature sensor of the readout, and the compensation of drift by its temperature. SI units."""

from __future__ import annotations

from sitscad.basics.record import record
from sitscad.spec.circuit import Chip
from sitscad.spec.format.kinds import Choice, Preset, UnitValue
from sitscad.spec.format.section import Section, key

BOARD, TAIL, CONTROLLER = "board", "tail", "controller"
DESIGN, CALIBRATED = "design", "calibrated"


@record
class DigitalRegisters:
    """I2C registers of a digital temperature sensor.

    * ``address``: 7-bit I2C address with grounded address pins
    * ``temperature``: number of the register with the temperature, 16 bits with sign
    * ``scale`` (K): temperature difference of one step of the temperature register
    * ``identity``: number of the register with the part's identity
    * ``identity_value``: expected lower 12 bits of the identity register
    """

    address: int
    temperature: int
    scale: float
    identity: int
    identity_value: int


@record
class ThermistorPart:
    """An NTC thermistor, or a digital temperature sensor with I2C.

    * ``resistance`` (ohm): at 25 degrees Celsius. None for a digital sensor.
    * ``b`` (K): B value of the thermistor; its resistance is proportional to exp(b / absolute temperature). None for a
      digital sensor.
    * ``resistance_tolerance`` and ``b_tolerance``: largest relative deviations
    * ``error`` (K): largest error of a digital sensor
    * ``noise`` (K): standard deviation of a reading
    * ``registers``: registers of a digital sensor. None for a thermistor.
    * ``chip``: land pattern of a part with two contacts that is soldered to the board. None for parts with wires.
    * ``height`` (m): largest height of a soldered part
    """

    name: str
    resistance: float | None
    resistance_tolerance: float
    b: float | None
    b_tolerance: float
    error: float
    noise: float
    registers: DigitalRegisters | None
    package: str
    product: str
    chip: Chip | None
    height: float
    source: str


@record
class Thermistor(Section):
    """A temperature sensor beside the pad, on the tail's stiffener, or on the controller's board."""

    part: ThermistorPart = key(Preset("thermistor", up=True), "the NTC thermistor or digital sensor, like tmp117")
    at: str = key(
        Choice((BOARD, TAIL, CONTROLLER)), "its place: on the board beside the pad, on the tail's stiffener, or on the "
        "board of converter and controller. An NTC chip is soldered to the first two and has two contacts of the tail. "
        "Other parts are glued there, with wires of their own", BOARD,
    )

    @property
    def is_soldered(self) -> bool:
        """Whether the part has pads on the flexible board and two contacts of the tail."""
        return self.part.chip is not None and self.at != CONTROLLER


@record
class CompensationSpec(Section):
    """The correction of forces by the temperature change since the tare.

    A temperature sensor or a reference coil measures the change. ``rate`` is in K/s. ``difference`` (K) is None until
    the resolver sets it from the position of the temperature sensor. A reference coil counts as a sensor on the board.
    """

    coefficients: str = key(
        Choice((DESIGN, CALIBRATED)), "of the drift: computed for the design, or measured on each unit at two "
        "temperatures, at rest and at full load", DESIGN,
    )
    difference: float | None = key(
        UnitValue("temperature difference", "0 K", "50 K"), "between sensor and pad, one sigma, like 0.5 K. "
        "Default by its place, assumed: measure yours", None,
    )
    rate: float = key(
        UnitValue("temperature rate", "0 K/min", "1000 K/min"), "at which the temperature changes; the pad lags behind",
        "1.7 K/min",
    )
