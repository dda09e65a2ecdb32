"""What is asked for: the sensor as frozen values in SI units, presets resolved, defaults filled in.

Lengths are metres, angles radians; x runs along the jaw to the handle, y across it, z up from the board's top face.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from importlib import import_module
from typing import Any, cast, overload

from sitscad.record import record
from sitscad.spec.issue import Issue
from sitscad.spec.pieces.circuit import MOST_PARTS, Chip, Connector, FpcSpec, PanelSpec, Tail
from sitscad.spec.pieces.coil import ArraySpec, CoilPlacement, CoilSpec
from sitscad.spec.pieces.loads import LoadCase
from sitscad.spec.pieces.mount import Assembly, Shield
from sitscad.spec.pieces.mounting import Jaw, Mount
from sitscad.spec.pieces.plates import Cutting, ElastomerPad, Encapsulation, Target
from sitscad.spec.pieces.readout import Cable, ReadoutSpec
from sitscad.spec.source import SpecSource
from sitscad.spec.stackup import CopperLayer


@record
class Requirements:
    """What the sensor must bear and follow: forces in newtons, bandwidth in hertz, temperature in degrees Celsius.

    What it must tell: resolutions (N, one sigma), `crosstalk` (of full scale), the `tilt` (rad) that the contact may
    have and what that may cost (`tilt_error`, N), `friction_error` of shear over normal, and what a temperature between
    two may cost (`temperature_error`, N).
    """

    normal_force: float | None = None
    shear_force: float | None = None
    bandwidth: float | None = None
    temperature: float = 20.0
    normal_resolution: float | None = None
    shear_resolution: float | None = None
    crosstalk: float | None = None
    tilt: float | None = None
    tilt_error: float | None = None
    friction_error: float | None = None
    temperature_range: tuple[float, float] | None = None
    temperature_error: float | None = None


@record
class SensorSpec:
    """The whole design; parts that are None are not in the sensor, are not made and not checked."""

    name: str
    coil: CoilSpec
    array: ArraySpec
    fpc: FpcSpec
    target: Target | None
    elastomer: ElastomerPad | None
    encapsulation: Encapsulation | None
    mount: Mount | None
    shield: Shield | None
    readout: ReadoutSpec
    requirements: Requirements
    source: SpecSource
    issue: Issue = Issue()
    assembly: Assembly = Assembly()
    cutting: Cutting = Cutting()
    loads: tuple[LoadCase, ...] = ()

    def __repr__(self) -> str:
        """A line: all fields are tens of thousands of characters, too many for a notebook or a debugger."""
        return f"<SensorSpec {self.name}: {len(self.array.placements)} x {self.coil.shape}>"

    @property
    def coil_copper(self) -> tuple[CopperLayer, ...]:
        """The copper layers that the coil is wound on, in winding order, with their heights."""
        copper = self.fpc.stackup.copper
        return tuple(copper[number - 1] for number in self.coil.layers)

    @classmethod
    def from_mapping(cls, sections: Mapping[str, Any] | None = None, /, **named: Any) -> SensorSpec:
        """The sensor that sections say in dictionaries, or as keywords: keys and values as in YAML.

        Bare numbers for lengths are millimetres, other quantities are texts with their unit; what is left out takes its
        default, ``sitscad`` (the version of the format) too. Numbers of numpy serve as well. The spec's text is the
        same in YAML.

        Raises
        ------
        SpecError
            with a finding for each value that is not right, as of a file; it names the key.

        Examples
        --------
        >>> from sitscad import SensorSpec
        >>> coil = {"shape": "circle", "outer_diameter": 7, "turns": 12, "layers": 2,
        ...         "trace_width": "100 um", "trace_spacing": "100 um"}
        >>> SensorSpec.from_mapping(name="bench", coil=coil).coil.outer_diameter
        0.007
        """
        return cast(SensorSpec, _changing().from_mapping({} if sections is None else sections, named))

    @overload
    def replace(self, key: str, value: Any, /) -> SensorSpec: ...

    @overload
    def replace(self, changes: Mapping[str, Any], /) -> SensorSpec: ...

    def replace(self, key: str | Mapping[str, Any], value: Any = None, /) -> SensorSpec:
        """The sensor with another value at a dotted key, or with several at once: keys and values as in YAML.

        ``spec.replace("coil.turns", 7.5)``, ``spec.replace({"coil.turns": 8, "coil.outer_diameter": "9 mm"})``; entries
        of lists are counted from 0 (``array.centres.1``), sections may be given whole, and None takes a key out. The
        change is made in the spec's text, whose comments stay as long as values are changed and not whole sections.

        Raises
        ------
        SpecError
            where there is no such key or the value is not right, as of a file; and where values were changed past the
            text before (`dataclasses.replace`), which would undo them.
        """
        changes = tuple(key.items()) if isinstance(key, Mapping) else ((key, value),)
        return cast(SensorSpec, _changing().replaced(self, changes))

    @property
    def is_known(self) -> bool:
        """Whether it is just as it was read and resolved, and so is known to be right."""
        return "_known" in self.__dict__

    def known(self, source: SpecSource) -> SensorSpec:
        """The same, read from a source, and known to be right: for what resolves specs alone."""
        found = replace(self, source=source)
        found.__dict__["_known"] = True  # no field: what `dataclasses.replace` makes of it has to be looked at anew
        return found


def _changing() -> Any:
    """What makes and changes specs: it reads them, and so knows this module already."""
    return import_module("sitscad.spec.changing")


def without_text(spec: SensorSpec) -> SensorSpec:
    """The spec's values alone, and the solids that it names: comments and file name gone, so that what is drawn cannot
    depend on them.
    """
    files = spec.source.files.items()
    solids = {name: content for name, content in files if name.lower().endswith((".step", ".stp"))}
    return replace(spec, source=SpecSource("", "", defaults=spec.source.defaults, files=solids))


__all__ = [
    "MOST_PARTS",
    "ArraySpec",
    "Assembly",
    "Cable",
    "Chip",
    "CoilPlacement",
    "CoilSpec",
    "Connector",
    "ElastomerPad",
    "Encapsulation",
    "FpcSpec",
    "Jaw",
    "Mount",
    "PanelSpec",
    "ReadoutSpec",
    "Requirements",
    "SensorSpec",
    "Shield",
    "Tail",
    "Target",
    "without_text",
]
