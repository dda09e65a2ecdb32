"""Electrical values and picture of a coil that is drawn in KiCad: a net of a board, or a footprint."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from sitscad.apps.coil.spiral import USUAL_FREQUENCY, CoilResult, lumped_frequency, parse_frequencies
from sitscad.apps.coil.variants import PLAIN_COIL
from sitscad.basics.arguments import checked_arguments
from sitscad.basics.quantities import DRAWN_COIL, DRAWN_COIL_AT_FREQUENCY, document
from sitscad.basics.record import record, replace
from sitscad.basics.units import show
from sitscad.basics.version import __version__
from sitscad.estimates.states.at_frequency import FrequencyError, SeriesImpedance
from sitscad.estimates.windings.leads import estimate_leads
from sitscad.estimates.windings.losses import bent_track_loss
from sitscad.estimates.windings.methods import bent_path, mitred_path, track_of
from sitscad.estimates.windings.own_capacitance import (
    CAPACITANCE_ERROR,
    FEW_TURNS,
    FEW_TURNS_CAPACITANCE_ERROR,
    self_capacitance,
)
from sitscad.files.drawing.frame import View
from sitscad.files.drawing.pictures.layout_picture import COLOURS, RING
from sitscad.files.drawing.sheet import Pen, Sheet
from sitscad.files.drawing.svg import svg
from sitscad.kernels.electromagnetics.inductance.filaments import via_inductance
from sitscad.kernels.electromagnetics.inductance.track_strands import Track
from sitscad.kernels.electromagnetics.inductance.tracks import winding_inductance
from sitscad.kernels.electromagnetics.loss.current_modes import ProximityLoss
from sitscad.kernels.electromagnetics.loss.proximity import least_gap, resolution_for
from sitscad.kernels.electromagnetics.loss.resistance import conductivity_at
from sitscad.kernels.electromagnetics.resonator import resonance_frequency
from sitscad.kernels.electromagnetics.threads import one_thread
from sitscad.kernels.geometry.path import Line, Path, Point, Segment, bounding_box, circle
from sitscad.layout import arrange
from sitscad.layout.board import Layout
from sitscad.spec import presets
from sitscad.spec.circuit import Stackup
from sitscad.spec.drawn.arcs import with_arcs
from sitscad.spec.drawn.copper import CopperHeight, DrawnCoilError, DrawnCopper
from sitscad.spec.drawn.follow import DrawnConductor, find_conductor
from sitscad.spec.drawn.kicad import read_kicad
from sitscad.spec.drawn.spiral import recognise_coil
from sitscad.spec.sensor import SensorSpec

INDUCTANCE_ERROR, RESISTANCE_ERROR = 0.005, 0.05
"""Relative error bounds of a drawn coil's inductance and resistance, far below its self-resonance.

Coils drawn by sitscad, and whole boards with leads, were read back within 0.25 % and 1.5 %
(tests/coil/test_drawn_coil.py). Nine coils of six other generators differ from FastHenry by at most 0.31 % in
inductance (docs/accuracy.md). If layers have opposite senses, the error bound is relative to the inductance of the same
layers with one sense. A wedge-shaped coil with opposed layers differs by 0.7 %.
"""

TOLERANCE = 3e-2
"""Accepted relative error of the resistance that the finite resolution of the current density in tracks causes."""

CUTS = 8
"""Number of cross-sections along each straight side in which the current density within the track is computed."""


@record
class DrawnAtFrequency(SeriesImpedance):
    """Estimates of a drawn coil at one `frequency` (Hz).

    `inductance` (H) and `resistance` (ohm) are in series. `inductance_error` and `resistance_error` are their relative
    error bounds.
    """

    frequency: float
    inductance: float
    resistance: float
    inductance_error: float = INDUCTANCE_ERROR
    resistance_error: float = RESISTANCE_ERROR


@record
class DrawnCoil(CoilResult):
    """A coil read from a drawing, between two terminals and without metal near it.

    Attributes
    ----------
    conductor : DrawnConductor
        the conductor that was followed in the drawing
    heights : tuple of CopperHeight
        copper layers of the board
    temperature : float
        temperature of the copper in degrees Celsius
    low_frequency_inductance, direct_current_resistance : float
        H and ohm
    low_frequency_inductance_error : float
        relative error bound of the low-frequency inductance
    at : tuple of DrawnAtFrequency
        estimates at each frequency
    notes : tuple of str
        remarks on the drawing: layers that turn the other way, dead ends, unequal turns
    stackup : str
        name of the stack-up that gave the heights; empty if the board's own stack-up did
    layout : Layout or None
        the coil on its board. None if no stack-up was named, or if the turns wind no known shape
    capacitance, self_resonance : float or None
        capacitance (F) between the terminals, and the frequency (Hz) at which the coil resonates with it. None if
        there is no layout. The self-resonance is also None if the track is longer than a tenth of a wavelength there
    """

    conductor: DrawnConductor
    heights: tuple[CopperHeight, ...]
    temperature: float
    low_frequency_inductance: float
    direct_current_resistance: float
    at: tuple[DrawnAtFrequency, ...]
    notes: tuple[str, ...]
    stackup: str = ""
    low_frequency_inductance_error: float = INDUCTANCE_ERROR
    layout: Layout | None = None
    capacitance: float | None = None
    self_resonance: float | None = None

    @property
    def capacitance_error(self) -> float | None:
        """Relative error of the capacitance. None if it is unknown."""
        if self.layout is None:
            return None
        few = min(self.layout.spec.coil.layer_turns) < FEW_TURNS
        return FEW_TURNS_CAPACITANCE_ERROR if few else CAPACITANCE_ERROR

    @property
    def self_resonance_error(self) -> float | None:
        """Relative error of the self-resonance: half of the capacitance's error."""
        return None if self.self_resonance is None else 0.5 * (self.capacitance_error or 0.0)

    @property
    def track_length(self) -> float:
        """Length (m) of the conductor on all layers."""
        return self.conductor.length

    def picture(self) -> str:
        """Return a picture of the conductor as SVG text, seen from the top, each layer in its colour."""
        return _picture(self.conductor)

    def _repr_svg_(self) -> str:
        """Return the picture, for notebooks."""
        return self.picture()

    def document(self) -> dict[str, Any]:
        """Return the JSON document of ``sitscad coil FILE``."""
        runs = [{"layer": layer, "turns": turns} for layer, turns in self.conductor.turns()]
        return {
            "sitscad": __version__, "terminals": list(self.conductor.ends), "runs": runs,
            "stackup": self.stackup or None,
            "trace_width_m": self.conductor.width, "vias": len(self.conductor.vias), "temperature_C": self.temperature,
            **document(self, DRAWN_COIL),
            "at_frequency": [document(each, DRAWN_COIL_AT_FREQUENCY) for each in self.at], "notes": list(self.notes),
        }


def read_drawn_coil(path: str, net: str = "", start: str = "", end: str = "") -> tuple[DrawnCopper, DrawnConductor]:
    """Return the copper in a KiCad file, and the conductor of the coil between its terminals.

    Without a net, all copper is followed from the pad `start` to the pad `end`. A board needs a net or both pads.

    Raises
    ------
    DrawnCoilError
        if the file cannot be read, or its copper is not a single conductor
    OSError
        if the file cannot be opened
    """
    copper = read_kicad(path)
    return copper, find_conductor(copper, net, start, end)


@one_thread
def estimate_drawn_coil(
    conductor: DrawnConductor, heights: Sequence[CopperHeight], frequencies: Sequence[float], temperature: float = 20.0
) -> DrawnCoil:
    """Return the electrical estimates of a drawn coil at each frequency (Hz).

    A run is the part of the conductor on one layer. Each run becomes a track, with the width of most of its length.
    Chords in the drawing that approximate arcs become arcs with equal area. `heights` are the board's copper layers,
    and `temperature` the copper's temperature in degrees Celsius. Raises DrawnCoilError for a layer without a height,
    and FrequencyError if the losses at a frequency cannot be resolved.
    """
    conductivity, width = conductivity_at(temperature), conductor.width
    layers = {layer.name: layer for layer in heights}
    if missing := [run.layer for run in conductor.runs if run.layer not in layers]:
        raise DrawnCoilError(f"the stack-up has no layer {missing[0]}: it has {', '.join(layers) or 'none'}")
    centre = conductor.centre
    paths = [with_arcs(run.path.shifted(-centre.x, -centre.y)) for run in conductor.runs]
    sections = [layers[run.layer] for run in conductor.runs]
    turns = [number for _, number in conductor.turns()]

    def tracks(ways: Sequence[Path]) -> list[Track]:
        return [track_of(mitred_path(path, width), width, layer.thickness, layer.z)
                for path, layer in zip(ways, sections, strict=True)]

    steps = zip(conductor.vias, pairwise(sections), strict=True)
    barrels = [via_inductance(abs(a.z - b.z), min(via.size)) for via, (a, b) in steps if a.z != b.z]
    inductance = winding_inductance(tracks(paths)) + math.fsum(barrels)
    error = INDUCTANCE_ERROR
    if min(turns) <= -LEAST_TURNS and max(turns) >= LEAST_TURNS:
        one_sense = [path if number > 0.0 else path.reversed() for path, number in zip(paths, turns, strict=True)]
        error *= max(1.0, winding_inductance(tracks(one_sense)) / inductance)
    reach = conductor.winding_circle[1]
    winding = [(part, layer) for path, layer, number in zip(paths, sections, turns, strict=True)
               if abs(number) >= LEAST_TURNS for part in winding_parts(path, width, reach)]
    if not winding:
        raise DrawnCoilError("the copper makes less than one turn about its centre: there is no coil")
    bent = [bent_path(path, width, layer.thickness, layer.z) for path, layer in winding]
    gap = least_gap(_smallest_turn_gap(conductor), width, sorted({layer.z for layer in sections}))
    resolution = resolution_for(width, max(layer.thickness for layer in sections), gap, TOLERANCE, conductivity)
    loss = bent_track_loss(bent, conductivity, resolution.modes, CUTS, resolution.steps)
    # stubs, and pieces of another width, carry the same current through other cross-sections
    direct = loss.direct + math.fsum(
        segment.length / (conductivity * layer.thickness * segment_width)
        for run, layer in zip(conductor.runs, sections, strict=True)
        for segment, segment_width in zip(run.path, run.widths, strict=True)
    ) - math.fsum(path.length / (conductivity * layer.thickness * width) for path, layer in winding)
    return DrawnCoil(
        conductor, tuple(heights), temperature, inductance + loss.direct_change, direct,
        tuple(_at_frequency(loss, inductance, error, direct, frequency) for frequency in frequencies),
        tuple(_drawing_remarks(conductor)), low_frequency_inductance_error=error,
    )


STUB = 6.0
"""Length, in track widths, below which a straight piece at an end of a run is not counted as part of the winding."""


def winding_parts(path: Path, width: float, reach: float) -> list[Path]:
    """Return the parts of a run within `reach` (m) of the origin, without short straight pieces at their ends.

    `width` (m) is the run's track width.

    The current density within tracks is computed for neighbouring turns. Short pieces to vias and pads lie in line with
    other pieces, and leads beyond the turns are far from the turns.
    """
    parts: list[list[Segment]] = [[]]
    for segment in path:
        if math.hypot(*segment.at(0.5)) <= reach:
            parts[-1].append(segment)
        elif parts[-1]:
            parts.append([])
    for segments in parts:
        for end in (0, -1):
            while segments and isinstance(segments[end], Line) and segments[end].length < STUB * width:
                del segments[end]
    return [Path(tuple(segments)) for segments in parts if segments]


def _at_frequency(loss: ProximityLoss, inductance: float, error: float, direct: float,
                  frequency: float) -> DrawnAtFrequency:
    if not loss.is_resolved(frequency):
        raise FrequencyError(f"the current within the tracks cannot be resolved at {show(frequency, 'Hz')}: their "
                             "spacing is far smaller than their width or thickness")
    change = float(loss.inductance_changes(np.array([frequency]))[0])
    added = loss.direct * (loss.resistance_ratio(frequency) - 1.0)
    return DrawnAtFrequency(frequency, inductance + change, direct + added, error)


def _drawing_remarks(conductor: DrawnConductor) -> list[str]:
    """Return remarks on the drawing. The most common fault is first: a layer with the opposite sense."""
    turns = [(layer, count) for layer, count in conductor.turns() if abs(count) >= LEAST_TURNS]
    notes = []
    main = math.copysign(1.0, math.fsum(count for _, count in turns)) if turns else 1.0
    for layer, count in turns:
        if count * main < 0.0:
            notes.append(f"layer {layer} turns the other way ({count:+.2f} turns) and cancels the field of the others")
    counts = [abs(count) for _, count in turns]
    if not notes and counts and max(counts) - min(counts) > MAX_TURN_DIFFERENCE:
        each = ", ".join(f"{layer} {abs(count):.2f}" for layer, count in turns)
        notes.append(f"layers have unequal turns: {each}")
    notes += [f"a dead end is left out: {stub}" for stub in conductor.stubs]
    width = conductor.width
    other_length = math.fsum(segment.length for run in conductor.runs
                             for segment, segment_width in zip(run.path, run.widths, strict=True)
                             if segment_width != width)
    if other_length > OTHER_WIDTHS * conductor.length:
        notes.append(f"{other_length / conductor.length:.0%} of the length is not {show(width, 'm')} wide; the "
                     "inductance is computed with this width")
    return notes


LEAST_TURNS = 0.75
"""Least number of turns of a run that is counted as part of the winding."""

MAX_TURN_DIFFERENCE = 0.3
"""Difference of turns between layers above which a remark is given.

The pieces to vias cause differences of about 0.05.
"""

OTHER_WIDTHS = 0.02
"""Fraction of the conductor's length with an unusual track width, above which a remark is given."""


def _smallest_turn_gap(conductor: DrawnConductor) -> float:
    """Return the smallest gap (m) between turns of one layer, from points along the conductor."""
    width, least = conductor.width, math.inf
    for layer in {run.layer for run in conductor.runs}:
        rows, way = [], 0.0
        for run in conductor.runs:
            if run.layer == layer:
                for segment in run.path:
                    count = max(1, min(60, math.ceil(segment.length / (2.0 * width))))
                    rows += [(*segment.at((k + 0.5) / count), way + segment.length * (k + 0.5) / count)
                             for k in range(count)]
                    way += segment.length
        table = np.array(rows[:: max(1, len(rows) // MOST_POINTS)])
        for part in np.array_split(table, max(1, len(table) // 500)):
            apart = np.hypot(part[:, None, 0] - table[:, 0], part[:, None, 1] - table[:, 1])
            apart[np.abs(part[:, None, 2] - table[:, 2]) < LEAST_TURN_SEPARATION * width] = math.inf
            least = min(least, float(apart.min()))
    return max(least - width, 0.02 * width) if math.isfinite(least) else width


MOST_POINTS = 6000
"""Largest number of points on a layer between which gaps are computed."""

LEAST_TURN_SEPARATION = 12.0
"""Least distance along the conductor, in track widths, between two points that belong to different turns."""


@checked_arguments
def drawn_coil(
    path: str, *, net: str = "", start: str = "", end: str = "", stackup: str = "",
    frequency: str | float | Sequence[str | float] = USUAL_FREQUENCY, temperature: float = 20.0,
) -> DrawnCoil:
    """Estimate a coil that is drawn in a KiCad board or footprint.

    Parameters
    ----------
    path
        File ``.kicad_pcb`` or ``.kicad_mod`` of KiCad 6 to 10.
    net
        Net of the coil on a board. Without it, all copper between `start` and `end` is followed.
    start, end
        Names of the pads at the coil's terminals, like ``"J1.1"``. By default the two pads of the net, pads 1 and 2 of
        a footprint, or the two free ends of the tracks.
    stackup
        Name of a stack-up, like ``"flex-2l-30um"``. By default the stack-up of the board. A footprint has none.
    frequency
        A frequency or a list: texts like ``"5 MHz"``, or numbers in hertz.
    temperature
        Temperature of the copper in degrees Celsius.

    Returns
    -------
    DrawnCoil
        Figures of the coil between its terminals, each with its error.

    Raises
    ------
    DrawnCoilError
        (a ValueError) if the file cannot be read, or its copper between the terminals is no single conductor
    FrequencyError
        (a ValueError) if a frequency lies outside 10 kHz to 100 MHz or its losses cannot be resolved
    OSError
        if the file cannot be opened

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import sitscad
    >>> spiral = sitscad.coil(outer_diameter="8 mm", turns=14, layers=2, trace_width="100 um", trace_spacing="100 um")
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "coil.kicad_mod"
    >>> _ = file.write_text(spiral.footprint())
    >>> drawn = sitscad.drawn_coil(str(file), stackup="flex-2l-30um")
    >>> abs(drawn.inductance / spiral.inductance - 1) < 0.02
    True
    """
    frequencies = parse_frequencies(frequency)
    copper, conductor = read_drawn_coil(path, net, start, end)
    coil = estimate_drawn_coil(conductor, copper_heights(copper, stackup), frequencies, temperature)
    return _add_capacitance(replace(coil, stackup=stackup), copper) if stackup else coil


def _add_capacitance(coil: DrawnCoil, copper: DrawnCopper) -> DrawnCoil:
    """Return the coil with its layout, capacitance and self-resonance added.

    If the turns have no known shape, a note that states this is added instead.
    """
    try:
        layout = drawn_coil_layout(copper, coil.conductor, presets.stackup(coil.stackup), coil.temperature)
    except DrawnCoilError as error:
        return replace(coil, notes=(*coil.notes, f"capacitance and self-resonance are not computed: {error}"))
    (winding,), spec = layout.coils, layout.spec
    leads = estimate_leads(winding, spec.fpc.stackup, conductivity_at(spec.requirements.temperature))
    capacitance = self_capacitance(winding, spec.coil, spec.fpc.stackup) + leads.capacitance
    resonance = resonance_frequency(coil.low_frequency_inductance, capacitance)
    return replace(coil, layout=layout, capacitance=capacitance,
                   self_resonance=resonance if resonance < lumped_frequency(winding) else None)


def copper_heights(copper: DrawnCopper, stackup: str = "") -> tuple[CopperHeight, ...]:
    """Return the heights of the copper layers, with the layer names of the file.

    `stackup` is the name of a preset stack-up. If it is empty, the heights come from the file's own stack-up. Raises
    DrawnCoilError if the preset has another number of copper layers, or if no heights are known.
    """
    if not stackup:
        if not copper.heights:
            fitting = ", ".join(_stackups_with_layer_count(copper))
            raise DrawnCoilError(f"the file has no stack-up: name one with --stackup, like {fitting}")
        return tuple(copper.heights)
    names = presets.names("stackup")
    if stackup not in names:
        raise DrawnCoilError(f"there is no stack-up {stackup!r}; known: {', '.join(names)}")
    preset = presets.stackup(stackup)
    layers = copper.names_for(len(preset.copper))
    if not layers:
        fitting = ", ".join(_stackups_with_layer_count(copper)) or "your own"
        raise DrawnCoilError(f"stack-up {stackup} has {len(preset.copper)} copper layers, the file "
                             f"{len(copper.layers)}: choose one of {fitting}")
    pairs = zip(layers, preset.copper, strict=True)
    return tuple(CopperHeight(name, layer.z, layer.thickness) for name, layer in pairs)


def _stackups_with_layer_count(copper: DrawnCopper) -> list[str]:
    """Return the names of preset stack-ups with the same number of copper layers as a file."""
    return [name for name in presets.names("stackup") if len(presets.stackup(name).copper) == len(copper.layers)]


SIDE, MARGIN, ROW_HEIGHT, LETTER_HEIGHT = 900.0, 40.0, 26.0, 16.0
"""Width and margin of the picture, row height of its legend, and letter height (pixels)."""


def _picture(conductor: DrawnConductor) -> str:
    """Return a picture of the conductor as SVG text, seen from the top. Lower layers are drawn first."""
    x0, y0, x1, y1 = bounding_box([run.path for run in conductor.runs])
    scale = (SIDE - 2.0 * MARGIN) / max(x1 - x0, y1 - y0, 1e-6)
    layers = list(dict.fromkeys(run.layer for run in conductor.runs))
    low = ROW_HEIGHT * (len(layers) + 1) + MARGIN
    view = View(scale / 1e3, (MARGIN - x0 * scale, low + MARGIN - y0 * scale))
    sheet = Sheet("conductor of the coil, seen from the top", (SIDE, (y1 - y0) * scale + 2.0 * MARGIN + low), unit="",
                  decimals=2)
    colours = {layer: COLOURS[k % len(COLOURS)] for k, layer in enumerate(layers)}
    for run in reversed(conductor.runs):
        for segment, width in zip(run.path, run.widths, strict=True):
            sheet.draw(view.path(Path((segment,))), Pen(view.length(width), colours[run.layer]))
    for via in conductor.vias:
        at = Point(view.x(via.centre.x), view.y(via.centre.y))
        sheet.draw(circle(at, view.length(min(via.size)) / 2.0), None, RING)
    ends = conductor.runs[0].path.start, conductor.runs[-1].path.end
    for place, name in zip(ends, conductor.ends, strict=True):
        at = Point(view.x(place.x), view.y(place.y))
        sheet.draw(circle(at, 7.0), Pen(2.5, "#222222"))
        sheet.text(at.x + 11.0, at.y + 5.0, name, LETTER_HEIGHT, halo=4.0)
    turns = conductor.turns()
    for k, layer in enumerate(layers):
        y = low - ROW_HEIGHT * (k + 1)
        sheet.line(MARGIN, y + 5.0, MARGIN + 30.0, y + 5.0, Pen(8.0, colours[layer]))
        count = sum(number for name, number in turns if name == layer)
        sheet.text(MARGIN + 42.0, y, f"{layer}: {count:+.2f} turns (counter-clockwise positive)", LETTER_HEIGHT)
    size = f"{show(x1 - x0, 'm', 3)} x {show(y1 - y0, 'm', 3)}"
    sheet.text(SIDE - MARGIN, low - ROW_HEIGHT, size, LETTER_HEIGHT, "end")
    return svg(sheet)


def drawn_coil_layout(
    copper: DrawnCopper, conductor: DrawnConductor, stackup: Stackup, temperature: float
) -> Layout:
    """Return the layout of a drawn coil alone, at a copper temperature in degrees Celsius.

    `stackup` has the same number of copper layers as the file. Raises DrawnCoilError if the turns have no known shape.
    """
    plain = SensorSpec.from_mapping({"name": "coil", "coil": PLAIN_COIL})
    coil = recognise_coil(conductor, copper.names_for(len(stackup.copper)), plain.coil)
    return arrange(replace(
        plain, coil=coil, fpc=replace(plain.fpc, stackup=stackup),
        requirements=replace(plain.requirements, temperature=temperature)))
