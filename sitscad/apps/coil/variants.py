"""Impedance of a nominal coil, and of the same coil with one changed property."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import cache

import numpy as np

from sitscad.assembly.places.state import FREE, REST
from sitscad.basics.arrays import Array, ComplexArray
from sitscad.basics.record import record, replace
from sitscad.estimates.circuits.coils import coil_circuits
from sitscad.estimates.circuits.solved_winding import SolvedWinding
from sitscad.estimates.circuits.tank import CoilCircuit
from sitscad.estimates.circuits.uncertainty import tolerance_sigmas
from sitscad.estimates.states.steps import solve_windings
from sitscad.estimates.targets.finite_target import NO_RATIOS
from sitscad.estimates.tolerances.scatter import DIAMETER, DISTANCE, PERMITTIVITY, THICKNESS, WIDTH
from sitscad.estimates.windings.leads import NO_LEADS, SELF_DISTANCE
from sitscad.estimates.windings.own_capacitance import CAPACITANCE_ERROR
from sitscad.kernels.electromagnetics.inductance.rings import mean_rings
from sitscad.kernels.electromagnetics.inductance.spirals import SpiralLayer
from sitscad.kernels.electromagnetics.special_functions import coaxial_rings
from sitscad.layout import lay_out
from sitscad.layout.board import Layout
from sitscad.spec.circuit import LayerKind, Stackup
from sitscad.spec.coil import CoilSpec
from sitscad.spec.mount import Mount
from sitscad.spec.sensor import SensorSpec


@record(eq=False)
class Impedance:
    """Impedance of a coil at the n `frequencies` (Hz).

    `series` (n; ohm) is the impedance of inductance and resistance in series. `capacitance` (F) is parallel to them.
    """

    frequencies: Array
    series: ComplexArray
    capacitance: float

    @property
    def terminal(self) -> ComplexArray:
        """Impedances (n; ohm) between the terminals, including the capacitance."""
        return self.series / (1.0 + 2j * math.pi * self.frequencies * self.capacitance * self.series)


@record(eq=False)
class CoilVariants:
    """Impedances of one coil and of its variants at n frequencies (Hz).

    `nominal` is the impedance of the unchanged coil with its leads, and `winding` its impedance without leads. `spec`
    contains only this coil. Variants change only the winding; the leads stay the same. `inductance_error` and
    `resistance_errors` (n) are relative errors of the model. `spirals` has one round spiral for each layer of the
    winding, with the layer's pitch and track length.
    """

    frequencies: Array
    spec: SensorSpec
    nominal: Impedance
    winding: Impedance
    inductance_error: float
    resistance_errors: Array
    spirals: tuple[SpiralLayer, ...]

    @classmethod
    def from_layout(cls, layout: Layout, number: int, has_leads: bool, frequencies: Array) -> CoilVariants:
        """Return the variants of coil number `number` (from 0) of a layout, including its leads if `has_leads`."""
        spec = _lone_coil_spec(layout.spec.coil, layout.spec.fpc.stackup, layout.spec.requirements.temperature)
        solved, circuit = _solve(spec)
        winding = _impedance(circuit, FREE, frequencies)
        nominal = winding
        if has_leads:
            windings = solve_windings(layout)
            circuits = coil_circuits(windings.layout, windings.winding, windings.matrix, windings.assembly, NO_RATIOS)
            nominal = _impedance(circuits[number], FREE, frequencies, circuits[number].self_capacitance)
        errors = [solved.bound.relative(circuit.loss.resistance_ratio(f), f) for f in frequencies.tolist()]
        return cls(frequencies, spec, nominal, winding, solved.inductance_error, np.array(errors), solved.spirals)

    def with_coil(self, **changes: object) -> Impedance:
        """Return the impedance with other values of the coil's spec, given as keyword arguments."""
        return self._with_spec(replace(self.spec, coil=replace(self.spec.coil, **changes)))

    def with_width(self, width: float) -> Impedance:
        """Return the impedance with another track width (m). The tracks' centre lines stay in place."""
        coil = self.spec.coil
        wider = width - coil.trace_width
        return self.with_coil(trace_width=width, trace_spacing=coil.trace_spacing - wider,
                              size=(coil.size[0] + wider, coil.size[1] + wider))

    def with_copper(self, factor: float) -> Impedance:
        """Return the impedance with the thickness of all copper layers multiplied by a factor."""
        return self._with_stackup(_scaled_stackup(self.spec.fpc.stackup, factor, of_copper=True))

    def with_films(self, factor: float) -> Impedance:
        """Return the impedance with the thickness of all films between copper layers multiplied by a factor."""
        return self._with_stackup(_scaled_stackup(self.spec.fpc.stackup, factor, of_copper=False))

    def with_metal(self, material: str, distance: float) -> Impedance:
        """Return the impedance with a thick sheet of a metal at a distance (m) below the board's bottom face."""
        mount = _thick_metal_mount(material)
        assert mount.metal_behind is not None
        mount = replace(mount, standoff=distance, metal_behind=replace(mount.metal_behind, distance=distance))
        return self._with_spec(replace(self.spec, mount=mount), REST)

    def with_layer_reversed(self, number: int) -> Impedance:
        """Return the impedance with the opposite sense of one layer's turns. `number` is the layer's position, from 0.

        Notes
        -----
        Two parts in series have the inductance La + Lb + 2M, and La + Lb - 2M with one part reversed. Resistance and
        capacitance are left unchanged, because the current density within the tracks changes little.
        """
        alone, other_layers = (self._layers_impedance(each) for each in ([number], self._other_layers(number)))
        omega = 2.0 * math.pi * self.frequencies
        change = 2.0 * (alone.series.imag + other_layers.series.imag - self.winding.series.imag) / omega
        return replace(self.nominal, series=self.nominal.series + 1j * omega * change)

    def without_layer(self, number: int) -> Impedance:
        """Return the impedance without the turns of one layer. `number` is the layer's position, from 0."""
        parts = self._layers_impedance(self._other_layers(number))
        return self._with_winding(parts)

    def with_turns(self, number: int, more: float) -> Impedance:
        """Return the impedance with `more` turns (negative: fewer) at the inner end of one layer (`number`, from 0)."""
        turns = list(self.spec.coil.layer_turns)
        turns[number] += more
        return self.with_coil(turns=tuple(turns))

    def with_shorted_turn(self, number: int, turn: float) -> Impedance:
        """Return the impedance with one shorted turn on a layer (`number`, from 0).

        Turns count from the outside, from 1. For a fraction, the impedance is interpolated between two turns.
        """
        changes = self.shorted_turn_changes(number)
        low = min(max(math.floor(turn), 1), max(len(changes) - 1, 1))
        pair = changes[low - 1], changes[min(low, len(changes) - 1)]
        return replace(self.nominal, series=self.nominal.series + (low + 1 - turn) * pair[0] + (turn - low) * pair[1])

    def shorted_turn_changes(self, number: int) -> ComplexArray:
        """Return impedance changes (turns, n; ohm) by a short of each whole turn of a layer (`number`, from 0).

        Notes
        -----
        The shorted turn leaves the series circuit and becomes a closed ring, in which the other turns induce a current.
        It adds the impedance (w M)^2 / (R + j w L). R and L are the ring's resistance and inductance, M its mutual
        inductance with the other turns, and w the angular frequency. Inductances are computed for mean rings. R is the
        winding's resistance times the ring's fraction of the track length.
        """
        rings, omega = mean_rings(self.spirals), 2.0 * math.pi * self.frequencies
        way, z, size = np.array([(each.circulation, each.z, SELF_DISTANCE * (each.width + each.thickness))
                                 for each in self.spirals]).T[:, rings.layer]
        apart = np.subtract.outer(rings.radii, rings.radii) ** 2 + np.subtract.outer(z, z) ** 2
        np.fill_diagonal(apart, size**2)
        mutual = np.outer(way, way) * coaxial_rings(rings.radii[:, None], rings.radii, apart)
        turns = np.flatnonzero((rings.layer == number) & (rings.parts > WHOLE))
        own = np.diag(mutual)[turns][:, None]
        linked = (mutual[turns] @ rings.parts)[:, None] - own
        share = rings.radii[turns] / float(rings.radii @ rings.parts)
        resistance = share[:, None] * self.winding.series.real
        induced = (omega * linked) ** 2 / (resistance + 1j * omega * own)
        return np.asarray(induced - resistance - 1j * omega * (own + 2.0 * linked))

    def tolerances(self) -> Mapping[str, ComplexArray]:
        """Return the changes (n; ohm) of the terminal impedance by one sigma, by name of tolerance or model error."""
        coil, sigma = self.spec.coil, tolerance_sigmas(self.spec)
        omega = 2.0 * math.pi * self.frequencies
        series, capacitance = self.nominal.series, self.nominal.capacitance
        moved = {
            "error of the inductance": replace(self.nominal, series=series + 1j * self.inductance_error * series.imag),
            "error of the resistance": replace(self.nominal, series=series + self.resistance_errors * series.real),
            "error of the capacitance": replace(self.nominal, capacitance=capacitance * (1.0 + CAPACITANCE_ERROR)),
            WIDTH: self.with_width(coil.trace_width * (1.0 + sigma[WIDTH])),
            THICKNESS: self.with_copper(1.0 + sigma[THICKNESS]),
            DIAMETER: replace(self.nominal, series=series + 1j * omega * sigma[DIAMETER] * series.imag / omega),
            PERMITTIVITY: replace(self.nominal, capacitance=capacitance * (1.0 + sigma[PERMITTIVITY])),
        }
        if len(coil.layers) > 1:
            moved[DISTANCE] = self.with_films(1.0 + sigma[DISTANCE])
        return {name: each.terminal - self.nominal.terminal for name, each in moved.items()}

    def _other_layers(self, number: int) -> list[int]:
        return [each for each in range(len(self.spec.coil.layers)) if each != number]

    def _layers_impedance(self, numbers: Sequence[int]) -> Impedance:
        """Return the impedance of some layers of the winding in series, without leads.

        `numbers` are the positions of these layers, from 0.
        """
        coil = self.spec.coil
        part = replace(coil, layers=tuple(coil.layers[each] for each in numbers),
                       turns=tuple(coil.layer_turns[each] for each in numbers))
        return _impedance(_solve(replace(self.spec, coil=part))[1], FREE, self.frequencies)

    def _with_stackup(self, stackup: Stackup) -> Impedance:
        return self._with_spec(replace(self.spec, fpc=replace(self.spec.fpc, stackup=stackup)))

    def _with_spec(self, spec: SensorSpec, state: str = FREE) -> Impedance:
        return self._with_winding(_impedance(_solve(spec)[1], state, self.frequencies))

    def _with_winding(self, winding: Impedance) -> Impedance:
        """Return the impedance with another winding and the leads of the nominal coil."""
        capacitance = self.nominal.capacitance + winding.capacitance - self.winding.capacitance
        return Impedance(self.frequencies, self.nominal.series + winding.series - self.winding.series, capacitance)


WHOLE = 0.999
"""Least length of a ring, in whole turns, for which it counts as a turn that can be shorted."""

PLAIN_COIL: Mapping[str, object] = {
    "shape": "circle", "outer_diameter": 8, "turns": 5, "trace_width": "100 um", "trace_spacing": "100 um",
}
"""Coil of a preliminary spec, which is then replaced by the coil of interest."""

THICK_SHEET = 3.0
"""Thickness (mm) of the metal sheet near a coil. Above about 10 kHz, thicker metal has the same effect."""


@cache
def _thick_metal_mount(material: str) -> Mount:
    """Return a mount with thick metal of this material behind the board."""
    behind = {"material": material, "distance": 1.0, "thickness": THICK_SHEET}
    mount = {"kind": "custom", "standoff": 1.0, "metal_behind": behind}
    custom_mount = SensorSpec.from_mapping({"name": "coil", "coil": PLAIN_COIL, "mount": mount}).mount
    assert custom_mount is not None
    return custom_mount


def _lone_coil_spec(coil: CoilSpec, stackup: Stackup, temperature: float) -> SensorSpec:
    """Return a spec with one coil, its stack-up and its temperature (degrees Celsius), and nothing else.

    A coil drawn in a file becomes the spiral with the same dimensions, so that single dimensions can be changed.
    """
    plain = SensorSpec.from_mapping({"name": "coil", "coil": PLAIN_COIL})
    requirements = replace(plain.requirements, temperature=temperature)
    fpc = replace(plain.fpc, stackup=stackup)
    return replace(plain, coil=replace(coil, drawn=None, copper=None), fpc=fpc, requirements=requirements)


def _solve(spec: SensorSpec) -> tuple[SolvedWinding, CoilCircuit]:
    """Return the field solution of the winding of a spec with one coil, and the coil's circuit."""
    windings = solve_windings(lay_out(spec))
    circuits = coil_circuits(windings.layout, windings.winding, windings.matrix, windings.assembly, NO_RATIOS)
    return windings.winding, circuits[0]


def _impedance(circuit: CoilCircuit, state: str, frequencies: Array, capacitance: float | None = None) -> Impedance:
    """Return the impedance of a coil's circuit in a state (with target or without).

    If `capacitance` (F, of winding and leads) is given, the leads are included. Otherwise it is the impedance of the
    winding without leads.
    """
    if capacitance is None:
        circuit = replace(circuit, leads=NO_LEADS, known={})
    inductance, resistance = circuit.impedance_with_open_neighbours(state, frequencies)
    series = resistance + 2j * math.pi * frequencies * inductance
    return Impedance(frequencies, series, circuit.winding_capacitance if capacitance is None else capacitance)


def _scaled_stackup(stackup: Stackup, factor: float, of_copper: bool) -> Stackup:
    """Return a stack-up with some layer thicknesses multiplied by a factor.

    If `of_copper`, these are all copper layers. Otherwise they are all films between copper layers.
    """
    layers = stackup.layers
    copper = [k for k, layer in enumerate(layers) if layer.kind is LayerKind.COPPER]

    def scaled() -> Iterator[object]:
        for k, layer in enumerate(layers):
            is_scaled = k in copper if of_copper else copper[0] < k < copper[-1] and k not in copper
            yield replace(layer, thickness=factor * layer.thickness) if is_scaled else layer

    return replace(stackup, layers=tuple(scaled()))


