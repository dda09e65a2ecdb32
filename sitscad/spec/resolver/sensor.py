"""The written spec to the frozen `SensorSpec`: presets looked up, defaults noted, pieces held against each other."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sitscad.finding import Edit
from sitscad.geometry.footprint import Footprint
from sitscad.geometry.path import Point
from sitscad.geometry.shapes import LONG_PLATE, PLATES, plate_shape
from sitscad.spec.format.documents.materials import ElastomerDocument
from sitscad.spec.format.documents.spec import CableDocument, SpecDocument
from sitscad.spec.format.remarks import Remarks
from sitscad.spec.format.section import Section
from sitscad.spec.issue import Issue
from sitscad.spec.materials import ElastomerMaterial, Losses
from sitscad.spec.pieces.plates import Cutting
from sitscad.spec.profiles import presets
from sitscad.spec.profiles.origin import spec_origin
from sitscad.spec.resolver.array import resolve_array
from sitscad.spec.resolver.circuit import resolve_fpc
from sitscad.spec.resolver.coil import check_amount, resolve_coil
from sitscad.spec.resolver.loads import resolve_loads
from sitscad.spec.resolver.mount import resolve_conductor, resolve_mount
from sitscad.spec.sensor import (
    Assembly,
    Cable,
    ElastomerPad,
    Encapsulation,
    ReadoutSpec,
    Requirements,
    SensorSpec,
    Shield,
    Tail,
    Target,
)
from sitscad.spec.source import SpecSource
from sitscad.units import show

_CABLE_PER_METRE = {"inductance": 600e-9, "capacitance": 100e-12, "resistance": 1.0}
_WRITTEN = "written out"


def resolve(document: SpecDocument, source: SpecSource, folder: Path | None = None) -> tuple[SensorSpec, Remarks]:
    """The sensor in SI values, and what there is to say about it: unusable where that has flaws or findings.

    `folder` is the spec's, where the profile files are that it names; None for a text without a file.
    """
    remarks = Remarks()
    coil = resolve_coil(document.coil, remarks)
    array = resolve_array(document.array, coil, remarks)
    check_amount(coil, len(array.placements), remarks)
    shield = resolve_shield(document)
    mount = resolve_mount(document.mount, shield, remarks, spec_origin(source, folder))
    fpc = resolve_fpc(document.fpc, coil, mount, remarks, source, folder)
    _check_contacts(fpc.tail, 2 * len(array.placements), remarks)
    side = max(coil.outer_diameter, array.pitch or 0.0)
    target = resolve_target(document, side, remarks)
    spec = SensorSpec(
        name=document.name,
        coil=coil,
        array=array,
        fpc=fpc,
        target=target,
        elastomer=resolve_elastomer(document, side, target, remarks),
        encapsulation=resolve_encapsulation(document),
        mount=mount,
        shield=shield,
        readout=resolve_readout(document, remarks),
        requirements=Requirements(**document.requirements.values()),
        source=source,
        issue=Issue(document.revision, document.part_number, document.date),
        assembly=resolve_assembly(document, remarks),
        cutting=Cutting(document.cutting.sheet, document.cutting.gap),
        loads=resolve_loads(document, mount, remarks),
    )
    _note_plain_defaults(document, "", source.keys, remarks)
    return spec, remarks


def _note_plain_defaults(section: Section, path: str, written: Mapping[str, Any], remarks: Remarks) -> None:
    """Note every default that is written in the format itself; the others were noted where they were worked out."""
    for name, key in section.keys.items():
        value = getattr(section, name)
        if isinstance(value, Section):
            _note_plain_defaults(value, f"{path}{name}.", written, remarks)
        elif f"{path}{name}" not in written and key.default not in (None, "", _WRITTEN):
            is_bare_length = isinstance(key.default, (int, float)) and getattr(key.kind, "dimension", "") == "length"
            remarks.default(f"{path}{name}", f"{key.default} mm" if is_bare_length else str(key.default))


def _plate(part: Any, key: str, size: tuple[float, float], remarks: Remarks) -> tuple[str, tuple[float, float]]:
    """Shape and size of a plate, with its defaults."""
    if part.size is None:
        shown = show(size[0], "m") if size[0] == size[1] else f"[{show(size[0], 'm')}, {show(size[1], 'm')}]"
        remarks.default(f"{key}.size", shown, "after what lies under it")
    size = part.size or size
    shape = part.shape or plate_shape(size)
    if part.shape is None:
        remarks.default(f"{key}.shape", shape, "after its size")
    if not PLATES[shape].is_long and size[0] != size[1]:
        hint = f"write one number, or shape: {LONG_PLATE}"
        remarks.flaw("SIT009", f"{key}.size", f"a {shape} has one size, not [x, y]", hint)
    return shape, size


def resolve_target(document: SpecDocument, side: float, remarks: Remarks) -> Target | None:
    """The target; by default a square as wide as the coils are far apart, at least as wide as a coil."""
    part = document.target
    if part is None:
        return None
    shape, size = _plate(part, "target", (side, side), remarks)
    return Target(shape, size, part.thickness, resolve_conductor(part.material), part.kerf, part.offset, part.rotation)


def resolve_elastomer(
    document: SpecDocument, side: float, target: Target | None, remarks: Remarks
) -> ElastomerPad | None:
    """The elastomer pad; by default as large as the target, or as it must be to carry one that is turned or offset."""
    part = document.elastomer
    if part is None:
        return None
    size = (side, side) if target is None else _carrying(target, part.offset)
    shape, size = _plate(part, "elastomer", size, remarks)
    return ElastomerPad(_elastomer(part.material), shape, size, part.thickness, part.kerf, part.offset)


def _carrying(target: Target, offset: tuple[float, float]) -> tuple[float, float]:
    """The sides (m) of the least pad, offset so far from the mean of the coils' centres, that carries a target."""
    reach = Footprint(target.outline.is_round, target.size, Point(*target.offset), target.rotation).reach
    x, y = (2.0 * (abs(target.offset[axis] - offset[axis]) + reach[axis]) for axis in (0, 1))
    return x, y


def resolve_encapsulation(document: SpecDocument) -> Encapsulation | None:
    """The encapsulating film."""
    part = document.encapsulation
    return None if part is None else Encapsulation(_elastomer(part.material), part.thickness)


def resolve_shield(document: SpecDocument) -> Shield | None:
    """The shield behind the board."""
    part = document.shield
    return None if part is None else Shield(resolve_conductor(part.material), part.thickness, part.gap, part.kerf)


def resolve_assembly(document: SpecDocument, remarks: Remarks) -> Assembly:
    """What the pieces are glued with, and the tolerances that are written; figures left out are the adhesive's."""
    part = document.assembly
    adhesive = presets.adhesive(part.adhesive or "cyanoacrylate")
    line = adhesive.line if part.glue_line is None else part.glue_line
    spread = min(adhesive.tolerance, line) if part.glue_tolerance is None else part.glue_tolerance
    if any((document.target, document.elastomer, document.mount)):
        for key, value, given in (
            ("adhesive", adhesive.name, part.adhesive),
            ("glue_line", show(line, "m"), part.glue_line),
            ("glue_tolerance", show(spread, "m"), part.glue_tolerance),
        ):
            if given is None:
                remarks.default(f"assembly.{key}", value, "unverified: measure yours")
    if spread > line:
        message = f"a glue line of {show(line, 'm')} cannot come out {show(spread, 'm')} thinner"
        remarks.flaw("SIT009", "assembly.glue_tolerance", message, "at most the thickness of the line itself")
    written = tuple((name, value) for name, value in part.tolerances.values().items() if value is not None)
    return Assembly(adhesive, line, spread, written, part.shaft_bore, part.hinge_pin)


def _elastomer(document: str | ElastomerDocument) -> ElastomerMaterial:
    """The silicone of a preset, or as it is written out."""
    if isinstance(document, str):
        return presets.elastomer(document)
    return ElastomerMaterial(
        name=document.name,
        shear_modulus=document.shear_modulus,
        shear_modulus_sigma=document.uncertainty,
        bulk_modulus=document.bulk_modulus,
        hardness=document.hardness,
        source="the spec",
        ogden_exponent=document.ogden_exponent,
        losses=Losses(
            document.hysteresis,
            document.hysteresis,
            document.creep,
            document.modulus_temperature_coefficient,
            document.expansion,
            "the spec",
        ),
    )


def resolve_readout(document: SpecDocument, remarks: Remarks) -> ReadoutSpec:
    """The converter and its cable."""
    part = document.readout
    cable = None if part.cable is None else _cable(part.cable, remarks)
    chip = None if part.capacitors_on_board is None else presets.chip(part.capacitors_on_board)
    place = part.capacitor_at or ("coil" if chip else "converter")
    if part.capacitor_at is None:
        remarks.default("readout.capacitor_at", place)
    _check_chip(document, remarks)
    device = presets.converter(part.device)
    return ReadoutSpec(device, part.capacitance, place, cable, part.clock, part.scan_rate, chip, part.drive_code)


def _check_contacts(tail: Tail | None, needed: int, remarks: Remarks) -> None:
    """Whether the connector that is written has contacts enough."""
    if tail is None or tail.contacts is None:
        return
    if not tail.connector.positions:
        message = f"a tail that ends in {tail.connector.name} has the contacts that the coils need"
        remarks.flaw("SIT009", "fpc.tail.contacts", message, "leave it out")
    elif tail.contacts < needed:
        message = f"the coils need {needed} contacts, the connector has {tail.contacts}"
        facts = {"measured": float(tail.contacts), "limit": float(needed)}
        enough = (Edit("fpc.tail.contacts", str(needed)),)
        remarks.flaw("SIT009", "fpc.tail.contacts", message, "two contacts a coil, or more", **facts, edits=enough)


def _check_chip(document: SpecDocument, remarks: Remarks) -> None:
    """Whether capacitors on the board have a place there, with the tail's pairs above each other."""
    part, tail, key = document.readout, document.fpc.tail, "readout.capacitors_on_board"
    if part.capacitors_on_board is None:
        return
    if part.capacitor_at == "converter":
        remarks.flaw("SIT009", key, "the capacitors are at the converter", "capacitor_at: coil, or leave it out")
    if tail is None:
        remarks.flaw("SIT009", key, "there is no tail with a stiffener to carry them", "give the spec an fpc.tail")
    elif presets.connector(tail.connector).insertion_thickness <= 0.0:
        message = f"a tail that ends in {tail.connector} has no stiffener, and chips on bare film crack"
        remarks.flaw("SIT009", key, message, "take a connector that is plugged in, like zif-0.5mm")
    elif tail.layers == 1:
        two = (Edit("fpc.tail.layers", "2"),)
        remarks.flaw("SIT009", key, "they need a tail of two copper layers", "fpc.tail.layers: 2", edits=two)


def _cable(document: CableDocument, remarks: Remarks) -> Cable:
    """The cable; what is left out is a thin flexible pair's, in proportion to its length."""
    units = {"inductance": "H", "capacitance": "F", "resistance": "ohm"}
    values = {}
    for name, per_metre in _CABLE_PER_METRE.items():
        given = getattr(document, name)
        values[name] = per_metre * document.length if given is None else given
        if given is None:
            why = f"the default for {show(document.length, 'm')} of cable (unverified: measure yours)"
            remarks.default(f"readout.cable.{name}", show(values[name], units[name]), why)
    return Cable(document.length, **values)
