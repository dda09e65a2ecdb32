"""Common parts of results for one coil: frequencies in the user's notation, and values at the first frequency."""

from __future__ import annotations

from collections.abc import Sequence

from sitscad.assembly.places.motions import MotionError, frequency_of
from sitscad.estimates.states.at_frequency import FrequencyError, SeriesImpedance

USUAL_FREQUENCY = 1e6
"""Frequency (Hz) used if the user states none."""


def hertz_of(frequency: str | float | Sequence[str | float]) -> tuple[float, ...]:
    """Return frequencies (Hz) from one or several texts (``"5 MHz"``) or numbers.

    Raises FrequencyError for other values.
    """
    values = [frequency] if isinstance(frequency, (str, float, int)) else frequency
    try:
        return tuple(frequency_of(value if isinstance(value, str) else f"{value!r} Hz") for value in values)
    except MotionError as error:
        raise FrequencyError(str(error)) from None


class CoilResult:
    """Electrical values of one coil without a sensor.

    Properties hold at the first frequency, and `at` has all frequencies.
    """

    at: tuple[SeriesImpedance, ...]

    @property
    def inductance(self) -> float:
        """Inductance (H) at the first frequency, without the coil's own capacitance."""
        return self.at[0].inductance

    @property
    def resistance(self) -> float:
        """Resistance (ohm) at the first frequency, in series with the inductance."""
        return self.at[0].resistance

    @property
    def quality_factor(self) -> float:
        """Quality factor at the first frequency."""
        return self.at[0].quality_factor

    @property
    def parallel_resistance(self) -> float:
        """Parallel resistance (ohm) of a tank that resonates at the first frequency."""
        return self.at[0].parallel_resistance
