"""Electrical values of a planar spiral coil with given dimensions, and the values that all coil results share."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from sitscad.assembly.places.motions import MotionError, frequency_of
from sitscad.basics.arguments import checked_arguments
from sitscad.basics.quantities import LONE_COIL, LONE_COIL_AT_FREQUENCY, document
from sitscad.basics.record import record, replace
from sitscad.basics.version import __version__
from sitscad.estimates.circuits.coils import coil_circuits, self_resonance
from sitscad.estimates.circuits.tank import CoilCircuit
from sitscad.estimates.coil_estimates import CrossCheck
from sitscad.estimates.states.at_frequency import CoilAtFrequency, FrequencyError, SeriesImpedance, coil_at
from sitscad.estimates.states.steps import solve_windings
from sitscad.estimates.targets.finite_target import NO_RATIOS
from sitscad.estimates.windings.leads import NO_LEADS
from sitscad.estimates.windings.methods import cross_checks, reason_without_cross_check
from sitscad.estimates.windings.own_capacitance import (
    CAPACITANCE_ERROR,
    FEW_TURNS,
    FEW_TURNS_CAPACITANCE_ERROR,
    USUAL_PERMITTIVITY,
)
from sitscad.files.drawing.pictures.layout_picture import coil_extent, layout_svg
from sitscad.files.formats.kicad.coil import coil_footprints
from sitscad.kernels.electromagnetics.constants import SPEED_OF_LIGHT
from sitscad.kernels.electromagnetics.resonator import resonance_frequency
from sitscad.kernels.electromagnetics.threads import one_thread
from sitscad.layout import lay_out
from sitscad.layout.board import Coil, Layout
from sitscad.spec.coil import CoilSpec
from sitscad.spec.load import written_value
from sitscad.spec.reading import SpecError, finding_from_text
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.yaml.source import TextError

USUAL_FREQUENCY = 1e6
"""Frequency (Hz) used if the user states none."""


def parse_frequencies(frequency: str | float | Sequence[str | float]) -> tuple[float, ...]:
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


@record
class Spiral(CoilResult):
    """A planar spiral coil without leads and without metal near it.

    `Spiral` has figures that do not depend on the frequency. `at` has the other figures, one entry for each frequency
    in the order of the call. ``inductance``, ``resistance``, ``quality_factor`` and ``parallel_resistance`` are at the
    first frequency.

    Attributes
    ----------
    layout : Layout
        the drawn coil on its board
    temperature : float
        temperature of the copper in degrees Celsius
    low_frequency_inductance, low_frequency_inductance_error : float
        inductance (H) of a direct current spread evenly over the tracks, and its relative error bound
    direct_current_resistance : float
        ohm
    capacitance, capacitance_error : float
        capacitance (F) between the layers and turns of the winding, and its relative error
    self_resonance : float or None
        frequency (Hz) at which the winding resonates with its own capacitance. None if the track is longer than a tenth
        of a wavelength there: the coil is then no inductance with a capacitance across it
    at : tuple of CoilAtFrequency
        figures at each frequency
    formulas : tuple of CrossCheck
        closed formulas of other authors. Empty if there is none for the shape; `no_formula` then gives the reason
    """

    layout: Layout
    temperature: float
    low_frequency_inductance: float
    low_frequency_inductance_error: float
    direct_current_resistance: float
    capacitance: float
    capacitance_error: float
    self_resonance: float | None
    at: tuple[CoilAtFrequency, ...]
    formulas: tuple[CrossCheck, ...]
    no_formula: str | None

    @property
    def coil(self) -> CoilSpec:
        """Shape, sizes (m), turns and layers."""
        return self.layout.spec.coil

    @property
    def stackup(self) -> str:
        """Name of the stack-up."""
        return self.layout.spec.fpc.stackup.name

    @property
    def track_length(self) -> float:
        """Length (m) of the track on all layers."""
        return track_length(self.layout.coils[0])

    @property
    def self_resonance_error(self) -> float | None:
        """Relative error of the self-resonance.

        It is half of the capacitance's error, because f is proportional to 1 / sqrt(L C).
        """
        return None if self.self_resonance is None else 0.5 * self.capacitance_error

    def picture(self) -> str:
        """Return a picture of the coil as SVG text."""
        return layout_svg(self.layout, self.coil.layers, coil_extent(self.coil, self.layout.coils[0]), name="coil")

    def _repr_svg_(self) -> str:
        """Return the picture, for notebooks."""
        return self.picture()

    def footprint(self) -> str:
        """Return the coil as the text of a KiCad footprint.

        Raises ValueError if the footprint has no room for the holes at the ends of the winding.
        """
        footprints = coil_footprints(self.layout)
        if not footprints:
            raise ValueError("the board has no room for the leads of this coil, so it has no footprint")
        return next(iter(footprints.values()))

    def document(self) -> dict[str, Any]:
        """Return the JSON document of ``sitscad coil``."""
        coil = self.coil
        dimensions = {
            "shape": coil.shape, "outer_size_m": list(coil.size), "inner_size_m": list(coil.inner_size),
            "turns": list(coil.layer_turns), "layers": list(coil.layers), "trace_width_m": coil.trace_width,
            "trace_spacing_m": coil.trace_spacing, "stackup": self.stackup,
        }
        formulas = [{"method": each.method, "inductance_H": each.inductance, "valid": each.is_valid}
                    for each in self.formulas]
        return {
            "sitscad": __version__, "coil": dimensions, "temperature_C": self.temperature, **document(self, LONE_COIL),
            "at_frequency": [document(each, LONE_COIL_AT_FREQUENCY) for each in self.at],
            "formulas": formulas, "no_formula": self.no_formula,
        }


def track_length(coil: Coil) -> float:
    """Return the length (m) of a coil's track on all layers, without leads."""
    return math.fsum(winding.path.length for winding in coil.windings)


@checked_arguments
def coil(
    *, outer_diameter: str | float | Sequence[str | float], trace_width: str | float | None = None,
    trace_spacing: str | float | None = None, turns: float | Sequence[float] | None = None,
    inner_diameter: str | float | Sequence[str | float] | None = None, shape: str = "circle",
    layers: int | Sequence[int] = 1, stackup: str | Sequence[Mapping[str, Any]] | None = None,
    frequency: str | float | Sequence[str | float] = USUAL_FREQUENCY, temperature: float = 20.0, **keys: Any,
) -> Spiral:
    """Estimate a planar spiral coil from its dimensions.

    Parameters
    ----------
    outer_diameter, inner_diameter, trace_width, trace_spacing
        Lengths with their unit, like ``"8 mm"``, or numbers in metres. Diameters are measured across the copper edges
        (polygons: across flats). Rectangles and racetracks have a pair, x and y. The inner diameter replaces turns,
        trace width or trace spacing.
    turns
        Turns on each layer, or a list with a number for each layer.
    shape
        A shape of ``coil.shape`` in a spec, like ``"square"``.
    layers
        Number of copper layers in series, from the top, or a list like ``[1, 3]``.
    stackup
        Name of a stack-up, like ``"flex-2l-30um"``, or layers as in ``fpc.stackup`` of a spec. By default the usual
        stack-up for this number of layers.
    frequency
        A frequency or a list: texts like ``"5 MHz"``, or numbers in hertz.
    temperature
        Temperature of the copper in degrees Celsius.
    keys
        Any other key of section ``coil`` of a spec, like ``corner_radius``.

    Returns
    -------
    Spiral
        Figures of the winding without leads, each with its error.

    Raises
    ------
    SpecError
        if the dimensions contradict each other or lie outside the ranges of a spec
    FrequencyError
        (a ValueError) if a frequency lies outside 10 kHz to 100 MHz, or at or above the self-resonance

    Examples
    --------
    >>> import sitscad
    >>> spiral = sitscad.coil(outer_diameter="8 mm", turns=14, trace_width="100 um", trace_spacing="100 um")
    >>> round(spiral.inductance * 1e6, 2), round(spiral.quality_factor, 1)
    (0.99, 4.8)
    """
    dimensions = {"outer_diameter": outer_diameter, "inner_diameter": inner_diameter, "trace_width": trace_width,
                  "trace_spacing": trace_spacing, "turns": turns, "shape": shape, "layers": layers, **keys}
    try:
        section = {key: written_value(f"coil.{key}", value) for key, value in dimensions.items() if value is not None}
    except TextError as error:
        raise SpecError((finding_from_text(error),)) from None
    return spiral(section, stackup, frequency, temperature)


def spiral(
    section: Mapping[str, Any], stackup: Any, frequency: str | float | Sequence[str | float], temperature: float
) -> Spiral:
    """Return the estimates of a spiral from the section ``coil`` of a spec (values as in a YAML file). See `coil`."""
    frequencies = parse_frequencies(frequency)
    board = {} if stackup is None else {"fpc": {"stackup": stackup}}
    spec = SensorSpec.from_mapping(
        {"name": "coil", "coil": dict(section), **board}, requirements={"temperature": f"{temperature:g} degC"})
    return estimate_spiral(lay_out(spec), frequencies)


@one_thread
def estimate_spiral(layout: Layout, frequencies: tuple[float, ...]) -> Spiral:
    """Return the estimates of a layout's first coil at each frequency (Hz), without its leads.

    Raises FrequencyError if the coil cannot be estimated at a frequency.
    """
    windings = solve_windings(layout)
    winding, layout_coil = windings.winding, layout.coils[0]
    circuit = coil_circuits(windings.layout, winding, windings.matrix, windings.assembly, NO_RATIOS)[0]
    lone = replace(circuit, leads=NO_LEADS, self_capacitance=circuit.winding_capacitance)
    formulas = cross_checks(layout_coil.name, winding.geometry, winding.inductance)
    return Spiral(
        layout, windings.temperature, winding.inductance, winding.inductance_error, lone.resistance,
        lone.self_capacitance,
        FEW_TURNS_CAPACITANCE_ERROR if winding.geometry.fewest_turns < FEW_TURNS else CAPACITANCE_ERROR,
        _self_resonance(lone, layout_coil), tuple(coil_at(lone, windings, each) for each in frequencies),
        formulas, reason_without_cross_check(layout.spec.coil, formulas),
    )


def _self_resonance(lone: CoilCircuit, coil: Coil) -> float | None:
    """Return the self-resonance (Hz), computed with the inductance there. None above `lumped_frequency`."""
    frequency = self_resonance(lone)
    for _ in range(ROUNDS):
        if not lone.loss.is_resolved(frequency):
            break
        inductance = lone.inductance + float(lone.loss.inductance_changes(np.array([frequency]))[0])
        frequency = resonance_frequency(inductance, lone.self_capacitance)
    return frequency if frequency < lumped_frequency(coil) else None


ROUNDS = 3
"""Number of iterations in `_self_resonance`. The inductance changes by about 2 % per decade of frequency."""

LUMPED_WAVELENGTHS = 0.1
"""Largest track length, in wavelengths, for which the current along the track is nearly uniform (textbook)."""


def lumped_frequency(coil: Coil) -> float:
    """Return the frequency (Hz) at which a coil's track is a tenth of a wavelength long, with waves in polyimide."""
    speed = SPEED_OF_LIGHT / math.sqrt(USUAL_PERMITTIVITY)
    return LUMPED_WAVELENGTHS * speed / track_length(coil)
