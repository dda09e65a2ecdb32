"""The converter and the wires to it."""

from __future__ import annotations

from sitscad.record import record
from sitscad.spec.converter import Converter
from sitscad.spec.pieces.circuit import Chip


@record
class Cable:
    """The wires between tail and converter, per conductor pair and for the whole length."""

    length: float
    inductance: float
    capacitance: float
    resistance: float


@record
class ReadoutSpec:
    """The converter; ``capacitance`` in farads (None: chosen), ``scan_rate`` is complete scans of all coils per s.

    ``drive_code`` (0 to 31) is None where it is chosen; ``chip`` is the land pattern of the tank capacitors on the
    tail's stiffener, None where they are elsewhere.
    """

    device: Converter
    capacitance: float | None
    capacitor_at: str
    cable: Cable | None
    clock: float
    scan_rate: float
    chip: Chip | None = None
    drive_code: int | None = None
