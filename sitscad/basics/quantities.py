"""Quantities of results, each defined once: JSON key with SI unit, label, digits, and field of its standard deviation.

JSON documents, texts, pages, data sheets, firmware, studies and the page of `sitscad watch` use these tables.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from sitscad.basics.record import record
from sitscad.basics.units import DASH, quantity

UNIT = re.compile("_(H_per_N|Hz_per_N|H|ohm|F|Hz|V|A|s|m2?|Pa|N)$")
"""Pattern of the SI unit at the end of a JSON key."""


@record
class Quantity:
    """A quantity of a result: its JSON key, its label for people, and the number of significant digits in texts.

    ``path`` is the name of the result's field. Names with dots are fields of fields. An empty ``path`` stands for the
    key without its unit. ``sigma`` is the field of the standard deviation. Fractions (``is_share``) are shown in per
    cent. A quantity without a label is in JSON only.
    """

    key: str
    label: str = ""
    digits: int = 4
    path: str = ""
    sigma: str = ""
    is_share: bool = False

    @property
    def unit(self) -> str:
        """SI unit, such as ``H/N``. Empty for fractions, counts and texts."""
        match = UNIT.search(self.key)
        return match[1].replace("_per_", "/") if match else ""

    @property
    def field(self) -> str:
        """Name of the result's field, with dots for a field of a field."""
        return self.path or UNIT.sub("", self.key)

    def value(self, result: object) -> Any:
        """Return the value of this quantity in a result. None if it is absent."""
        return _field_at_path(result, self.field)

    def number(self, result: object) -> Any:
        """Return the value of this quantity in a result, for JSON. None for numbers that are not finite."""
        value = self.value(result)
        return finite(value) if self.unit or isinstance(value, float) else value

    def deviation(self, result: object) -> float | None:
        """Return one standard deviation of this quantity in a result, in its unit. None if it is unknown."""
        sigma = _field_at_path(result, self.sigma) if self.sigma else None
        return None if sigma is None else float(sigma)

    def plain(self, result: object) -> str:
        """Return the value in a result as text for people, with its unit. A dash if it is absent or not finite."""
        return self.shown(self.value(result))

    def text(self, result: object) -> str:
        """Return the value in a result as text for people, with one standard deviation if it is known."""
        sigma = self.deviation(result)
        return self.plain(result) if sigma is None else self.shown(self.value(result), sigma)

    def shown(self, value: Any, sigma: float | None = None) -> str:
        """Return `value` as text for people, with the standard deviation `sigma` if it is not None."""
        if isinstance(value, bool):
            return "yes" if value else "no"
        if value is None or isinstance(value, (int, str)):
            return DASH if value is None else str(value)
        if self.is_share:
            return plus_minus(100.0 * value, None if sigma is None else 100.0 * sigma, "%", digits=self.digits)
        if self.unit == "m":
            value = round(value, 9) + 0.0  # rounding errors in differences of equal lengths
        unit, slash, per = self.unit.partition("/")
        return plus_minus(value, sigma, unit, slash + per, self.digits)


def _field_at_path(result: object, path: str) -> Any:
    """Return the field of a result at `path`, with dots for a field of a field. None if a part of the path is None."""
    for name in path.split("."):
        result = None if result is None else getattr(result, name)
    return result


class Table(NamedTuple):
    """A table for people: the heads of its columns, its rows, its title, and notes.

    A table without rows is not shown. If all heads are empty, texts leave the line of heads out.
    """

    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    title: str = ""
    notes: Sequence[str] = ()


def document(result: object, quantities: Iterable[Quantity]) -> dict[str, Any]:
    """Return the quantities of a result as a dictionary by their JSON keys."""
    return {each.key: each.number(result) for each in quantities}


def deviations(result: object, quantities: Iterable[Quantity]) -> dict[str, float | None]:
    """Return one standard deviation by JSON key, for the quantities that name a field for it."""
    return {each.key: finite(each.deviation(result)) for each in quantities if each.sigma}


def by_quantity(results: Sequence[object | None], quantities: Iterable[Quantity]) -> list[list[str]]:
    """Return a row for each labelled quantity that any result has: its label, then the text of each result."""
    return [[each.label, *(DASH if result is None else each.text(result) for result in results)]
            for each in quantities
            if each.label and any(each.value(result) not in (None, "") for result in results)]


def by_result(results: Iterable[object], quantities: Iterable[Quantity], title: str = "") -> Table:
    """Return a table with a row for each result and a column for each labelled quantity."""
    columns = [each for each in quantities if each.label]
    return Table([each.label for each in columns], [[each.text(row) for each in columns] for row in results], title)


def finite(value: float | None) -> float | None:
    """Return a number unchanged for JSON. None if it is absent or not finite."""
    return float(value) if value is not None and math.isfinite(value) else None


def plus_minus(value: float, sigma: float | None, unit: str, per: str = "", digits: int = 3) -> str:
    """Return a number and one standard deviation, such as ``1.15 +- 0.087 mm``.

    A much smaller deviation has its own unit prefix. `per` follows the unit.
    """
    shown = quantity(value, unit, digits)
    if sigma is None or not math.isfinite(sigma) or shown == DASH:
        return shown + (per if shown != DASH else "")
    number, _, name = shown.partition(" ")
    scatter, _, other = quantity(sigma, unit, 2).partition(" ")
    if name == other:
        return f"{number} +- {scatter} {name}{per}"
    if sigma < 0.01 * abs(value) or not float(number):
        return f"{shown}{per} +- {scatter} {other}{per}"
    scale = 10.0 ** round(math.log10(float(number) / value))
    return f"{number} +- {float(f'{sigma * scale:.2g}'):.7g} {name}{per}"


COIL = (
    Quantity("winding_inductance_H", "winding inductance, direct current spread evenly"),
    Quantity("inductance_error", "its relative error, at most", 2, is_share=True),
    Quantity("method", "method"),
    Quantity("terminal_inductance_H", "terminal inductance, free, at the sensor frequency"),
    Quantity("lead_inductance_H", "of that, leads and tail"),
    Quantity("bend_inductance_H"),
    Quantity("resistance_dc_ohm", "winding resistance, direct current"),
    Quantity("resistance_ac_ohm", "winding resistance, sensor frequency"),
    Quantity("resistance_error", "relative error of that resistance, at most", 2, is_share=True),
    Quantity("terminal_resistance_dc_ohm", "contact to contact, direct current"),
    Quantity("parallel_resistance_ohm"),
    Quantity("quality_factor"),
    Quantity("capacitance_F", "tank capacitance, in all"),
    Quantity("self_capacitance_F", "of that, the coil's own, with leads and tail"),
    Quantity("winding_capacitance_F", "- between its layers and turns"),
    Quantity("lead_capacitance_F", "- of leads and tail"),
    Quantity("sensor_frequency_Hz", "sensor frequency, free"),
    Quantity("self_resonance_Hz", "self-resonance"),
    Quantity("apparent_inductance_H"),
    Quantity("trace_length_m", "length of the track"),
    Quantity("inner_diameter_m", "inner diameter, between copper edges"),
)
"""Quantities of a coil (`CoilEstimate`)."""

FREQUENCY = Quantity("frequency_Hz", "frequency", sigma="spread.frequency")
TANK = (
    Quantity("inductance_H", "inductance", sigma="spread.inductance"),
    Quantity("resistance_ohm", "resistance", sigma="spread.resistance"),
    FREQUENCY,
    Quantity("parallel_resistance_ohm", "Rp", sigma="spread.parallel_resistance"),
    Quantity("quality_factor", "Q", 3),
    Quantity("amplitude_V", "amplitude", 3, sigma="spread.amplitude"),
)
"""Quantities of a tank at the contacts in one state (`StateEstimate`)."""

COMPUTED_WITHIN = Quantity("resistance_error", "R computed within", 2, is_share=True)
STEPS = (
    Quantity("quantum_H", "step", 3),
    Quantity("noise_H", "quantisation noise (step / sqrt 12)", 3),
    Quantity("coil_amplitude_V", "amplitude at the coil", 3),
)
"""Resolution of the converter in one state."""

OTHERS = (
    Quantity("apparent_inductance_H", "on an LCR meter"),
    Quantity("converter_inductance_H", "by the firmware's formula"),
)
"""Inductances in one state: the reading of an LCR meter, and the result of the firmware's formula."""

STATE = (*TANK, COMPUTED_WITHIN, Quantity("target_change_H"), Quantity("target_change_error"), *OTHERS, *STEPS)
"""All quantities of one state."""

TANK_AND_DRIVE = (
    Quantity("capacitance_F", "tank capacitor"),
    Quantity("capacitance_reason", "why this one"),
    Quantity("capacitor_tolerance", "its tolerance, assumed", 2, is_share=True),
    Quantity("conversion_capacitance_F", "C in L = 1 / (C (2 pi f)^2): capacitor, pins, cable"),
    Quantity("drive_current_A", "drive current"),
    Quantity("drive_code", "drive code"),
)
"""The tank's capacitor and the drive (`ReadoutEstimate`).

Reports list the settings of the converter's family after these quantities.
"""

RATES = (
    Quantity("scan_rate_Hz", "complete scans, of all coils"),
    Quantity("readable_rate_Hz", "scans that I2C can carry"),
    Quantity("read_back_time_s", "reading all results over I2C", 3),
    Quantity("high_current", "high-current drive"),
    Quantity("supply_current_A", "supply current, about", 3),
)
"""Rates of the readout (`ReadoutEstimate`), and its supply."""

SCAN_TIMES = (
    Quantity("dwell_time_s", "time on one coil, of every scan"),
    Quantity("settle_time_s", "- settling"),
    Quantity("conversion_time_s", "- conversion"),
    Quantity("switch_time_s", "- switching to the next coil"),
)
"""Times of a converter that reads several coils."""

LONE_TIMES = (
    Quantity("result_interval_s", "from one result of the coil to the next"),
    Quantity("conversion_time_s", "- conversion"),
    Quantity("switch_time_s", "- pause between conversions, taken as long as a switch of channels"),
    Quantity("settle_time_s", "settling, once, before the first conversion"),
)
"""Times of a converter that reads one coil: nothing is switched."""

COMPRESSION = (
    Quantity("strain", "strain", 3, "compression.strain", "compression_scatter.strain", is_share=True),
    Quantity("least_strain", "strain, at least (only part of the pad may be loaded)", 3, "compression.least_strain",
             is_share=True),
    Quantity("gap_m", "thickness left", 4, "compression.gap", "compression_scatter.gap"),
    Quantity("loaded_area_m2", "loaded area", 4, "compression.loaded_area"),
    Quantity("loaded_share", "loaded part of the pad", 3, "compression.loaded_share", is_share=True),
    Quantity("shape_factor", "shape factor", 3, "compression.shape_factor"),
    Quantity("apparent_modulus_Pa", "apparent modulus", 4, "compression.apparent_modulus",
             "compression_scatter.apparent_modulus"),
    Quantity("valid", "formula within its range", path="compression.valid"),
    Quantity("note", "remark", path="compression.note"),
)
"""Quantities of `Estimates`: the elastomer under the required force."""

METERED = (
    Quantity("coil", "bare coil"),
    Quantity("frequency_Hz", "LCR meter at"),
    Quantity("inductance_H", "inductance read", sigma="inductance_sigma"),
    Quantity("resistance_ohm", "resistance", 3, sigma="resistance_sigma"),
    COMPUTED_WITHIN,
    Quantity("direct_ohm", "resistance, direct current", 3, sigma="direct_sigma"),
)
"""Readings of an ordinary LCR meter on a bare board's coil (`MeterReadings`)."""

BARE_TANK = (
    Quantity("frequency_Hz", "frequency in the tank", sigma="spread.frequency"),
    Quantity("apparent_inductance_H", "inductance read there", sigma="spread.inductance"),
    Quantity("resistance_ohm", "resistance", 3, sigma="spread.resistance"),
    COMPUTED_WITHIN,
)
"""Readings of a meter on a bare board's coil at the frequency of its tank (`StateEstimate`)."""

AT_FREQUENCY = (
    Quantity("coil", "coil"),
    Quantity("frequency_Hz", "frequency"),
    Quantity("winding_inductance_H", "winding L"),
    Quantity("winding_inductance_error", "+-", 2, is_share=True),
    Quantity("winding_resistance_ohm", "winding R"),
    Quantity("winding_resistance_error", "+-", 2, is_share=True),
    Quantity("winding_quality_factor", "Q", 3),
    Quantity("inductance_H", "L"),
    Quantity("resistance_ohm", "R"),
    Quantity("resistance_error", "+-", 2, is_share=True),
    Quantity("quality_factor", "Q", 3),
    Quantity("apparent_inductance_H", "L on an LCR meter"),
    Quantity("apparent_resistance_ohm", "R there"),
    Quantity("self_resonance_Hz"),
)
"""Quantities of a coil alone at a frequency (`CoilAtFrequency`)."""

LONE_COIL = (
    Quantity("low_frequency_inductance_H", "inductance, direct current spread evenly"),
    Quantity("low_frequency_inductance_error", "its error, at most", 2, is_share=True),
    Quantity("direct_current_resistance_ohm", "resistance, direct current"),
    Quantity("capacitance_F", "capacitance between turns and layers", 3),
    Quantity("capacitance_error", "its error", 2, is_share=True),
    Quantity("self_resonance_Hz", "self-resonance", 3),
    Quantity("self_resonance_error", "its error", 2, is_share=True),
    Quantity("track_length_m", "length of the track"),
)
"""Quantities of a coil without a sensor (`Spiral`)."""

LONE_COIL_AT_FREQUENCY = (
    Quantity("frequency_Hz", "frequency"),
    Quantity("inductance_H", "L"),
    Quantity("inductance_error", "+-", 2, "winding_inductance_error", is_share=True),
    Quantity("resistance_ohm", "R"),
    Quantity("resistance_error", "+-", 2, is_share=True),
    Quantity("quality_factor", "Q", 3),
    Quantity("parallel_resistance_ohm", "Rp", 3),
    Quantity("apparent_inductance_H", "L on an LCR meter"),
    Quantity("apparent_resistance_ohm", "R there"),
)
"""Quantities of a coil without a sensor at a frequency (`CoilAtFrequency`)."""

DRAWN_COIL = (
    Quantity("low_frequency_inductance_H", "inductance, direct current"),
    Quantity("low_frequency_inductance_error", "its error, at most", 2, is_share=True),
    Quantity("direct_current_resistance_ohm", "resistance, direct current"),
    *LONE_COIL[3:],
)
"""Quantities of a coil that a user drew (`DrawnCoil`)."""

DRAWN_COIL_AT_FREQUENCY = (
    *LONE_COIL_AT_FREQUENCY[:2], Quantity("inductance_error", "+-", 2, is_share=True), *LONE_COIL_AT_FREQUENCY[3:7]
)
"""Quantities of a drawn coil at a frequency (`DrawnAtFrequency`)."""

RESPONSE = (
    Quantity("pose", path="poses"),
    Quantity("force_N"),
    Quantity("moment_Nm", path="moment"),
    Quantity("inductance_H", "L", 6),
    Quantity("resistance_ohm", "R"),
    Quantity("target_change_H", "by target"),
    Quantity("target_change_error", "+-", 2, is_share=True),
    Quantity("target_resistance_ohm", "its loss"),
    Quantity("target_resistance_error", "+-", 2, is_share=True),
    Quantity("frequency_Hz", "frequency", 7),
    Quantity("counts", "counts", 9),
    Quantity("parallel_resistance_ohm", "Rp"),
    Quantity("strain"),
    Quantity("frequency_by_pose", path="by_pose"),
    Quantity("frequency_by_load", path="by_load"),
)
"""Arrays of a `Response`. Texts show the arrays with a label, one value per coil."""

SIGNAL = (
    Quantity("coil"),
    Quantity("force_N"),
    Quantity("rest_inductance_H", "inductance at rest", path="rest"),
    Quantity("inductance_H_per_N", "change per newton", 3, "per_newton", "sigma"),
    Quantity("sigma_inductance_H_per_N", path="sigma"),
    Quantity("share", "of the reading, over that force", 3, is_share=True),
    Quantity("frequency_share"),
    Quantity("steps", "steps of the converter in that", 3),
    Quantity("frequency_Hz_per_N", "frequency per newton", 3, "frequency_per_newton", "frequency_sigma"),
    Quantity("sigma_frequency_Hz_per_N", path="frequency_sigma"),
)
"""Quantities of a coil's signal (`Signal`)."""

FIT = (
    Quantity("name", "measure"),
    Quantity("nominal_m", "nominal"),
    Quantity("root_sum_square_m", "root-sum-square"),
    Quantity("worst_m", "at worst"),
    Quantity("limit_m", "limit"),
    Quantity("margin_m", "to spare at worst"),
    Quantity("decided_by", "decided by"),
    Quantity("assumption"),
)
"""Quantities of the fit (`Measure`)."""

FIT_PART = (
    Quantity("part", "part"),
    Quantity("nominal_m", "size"),
    Quantity("tolerance_m", "tolerance, +-"),
    Quantity("source", "where that comes from"),
)
"""Quantities of a part of the fit (`Share`)."""
