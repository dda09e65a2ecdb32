"""The converter that reads the coils, and the wires to it."""

from __future__ import annotations

from sitscad.readout.converter import Converter
from sitscad.record import record
from sitscad.spec.circuit import Chip
from sitscad.spec.kinds import Choice, Either, Number, Preset, Quantity, Rate, Run
from sitscad.spec.section import Part, Section, key


@record
class Cable(Section):
    """The wires between tail and converter, per conductor pair and for the whole length.

    What is left out is None only until it is worked out by the length.
    """

    length: float = key(Run, "of the cable", 300)
    inductance: float = key(
        Quantity("inductance", "0 nH", "1 mH"),
        "of one pair, whole length, like 180 nH; 600 nH a metre if left out: measure yours",
        None,
    )
    capacitance: float = key(
        Quantity("capacitance", "0 pF", "1 uF"),
        "of one pair, whole length, like 30 pF; 100 pF a metre if left out: measure yours",
        None,
    )
    resistance: float = key(
        Quantity("resistance", "0 ohm", "1 kohm"),
        "of one pair, there and back, like 0.3 ohm; 1 ohm a metre if left out: measure yours",
        None,
    )


@record
class ReadoutSpec(Section):
    """The converter that reads the coils.

    ``capacitance`` and ``drive_code`` are None where they are chosen, ``chip`` where the tank capacitors are elsewhere
    than on the tail's stiffener, ``capacitor_at`` only until it is worked out.
    """

    device: Converter = key(Preset("converter", up=True), "the converter", "ldc1614")
    capacitance: float | None = key(
        Either("auto", Quantity("capacitance", "1 pF", "1 uF")),
        "of the tank, like 330 pF; auto: chosen, with reasons",
        "auto",
    )
    capacitor_at: str = key(
        Choice(("coil", "converter")), "where it is soldered: converter, unless capacitors_on_board", None
    )
    chip: Chip | None = key(
        Preset("chip", up=True),
        "places for the capacitors on the tail's stiffener, and of what size",
        None,
        written="capacitors_on_board",
    )
    cable: Cable | None = key(Part(Cable), "none: the tail plugs into the converter's board", None)
    clock: float = key(Quantity("frequency", "100 kHz", "1 GHz"), "reference clock", "40 MHz")
    scan_rate: float = key(Rate, "complete scans of all coils per second", "100 Hz")
    drive_code: int | None = key(
        Either("auto", Number(0, 31, whole=True)), "of all channels; auto: the strongest one sigma below 1.8 V", "auto"
    )
