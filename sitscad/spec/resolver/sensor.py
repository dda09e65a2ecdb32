"""Conversion of a written spec to the read-only `SensorSpec`: presets, defaults and checks between parts."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from sitscad.basics.finding import Edit
from sitscad.basics.units import show
from sitscad.kernels.geometry.convex import Footprint
from sitscad.kernels.geometry.path import Point
from sitscad.kernels.geometry.shapes import LONG_PLATE, PLATES
from sitscad.spec import presets
from sitscad.spec.circuit import PanelSpec, Stackup, Tail
from sitscad.spec.coil import CoilSpec
from sitscad.spec.format.kinds import Preset
from sitscad.spec.format.section import NameOr, Part, Section, section_of
from sitscad.spec.load_cases import LoadCase, Mechanism
from sitscad.spec.materials import ElastomerPad, Target
from sitscad.spec.mount import Assembly, Mount, TolerancesDocument
from sitscad.spec.profiles import Origin
from sitscad.spec.reading import Remarks
from sitscad.spec.resolver.circuit import resolve_fpc
from sitscad.spec.resolver.coils import (
    REFERENCE_OFFSET,
    check_cells,
    check_reference,
    check_total_turns,
    check_webs,
    resolve_array,
    resolve_coil,
    resolve_reference,
)
from sitscad.spec.resolver.mount import computable_plate, resolve_mount
from sitscad.spec.sensor import ReadoutSpec, SensorSpec, SpecDocument
from sitscad.spec.thermistor import BOARD, TAIL, CompensationSpec
from sitscad.spec.yaml.source import Issue, SpecSource

Plate = TypeVar("Plate", Target, ElastomerPad)

CELLS_APART = 1e-3
"""Default gap (m) between the plates of neighbouring cells. The plates' default size is the pitch minus this gap."""


def resolve(document: SpecDocument, source: SpecSource, folder: Path | None = None) -> tuple[SensorSpec, Remarks]:
    """Return the sensor in SI units, and the remarks: flaws, findings and defaults.

    The sensor is unusable if there are flaws or findings. `folder` is the folder of the spec; file names in the spec
    are relative to it. None if the text did not come from a file.
    """
    remarks = Remarks()
    # The spec names the rules. Profile files may be in its folder or below.
    place = Origin(source, "fpc.rules.", folder, None if folder is None else folder.resolve())
    coil = resolve_coil(document.coil, remarks, place, _copper_layers(document))
    array = resolve_array(document.array, coil, remarks)
    number = len(array.placements) + (array.reference is not None)
    check_total_turns(coil, number, remarks)
    mount = resolve_mount(document.mount, document.shield, remarks, place)
    fpc = resolve_fpc(document.fpc, coil, mount, remarks, place)
    array = resolve_reference(array, coil, place, len(fpc.stackup.copper), remarks)
    if coil.drawn is not None:
        _check_drawn(coil.drawn, source, remarks)
        _check_heights(coil, fpc.stackup, remarks)
        fpc = replace(fpc, panel=PanelSpec(wish="none"))
    # by default plates are as wide as the coils are far apart, and at least as wide as a coil
    side = max(min(coil.size), array.pitch or 0.0)
    target, pad, cells = document.target, document.elastomer, document.cells
    if cells is not None:
        check_cells(cells.coils, array.placements, target is not None and pad is not None, remarks)
        side = max(min(coil.size), array.pitch - CELLS_APART if array.pitch and cells.coils == 1 else 0.0)
    if target is not None:
        target = _with_size(target, "target", (side, side), remarks)
    if pad is not None:
        pad_size = (side, side) if target is None else _smallest_pad_size(target, pad.offset)
        pad = _with_size(pad, "elastomer", pad_size, remarks)
    if cells is not None:
        check_webs(cells.web, array.pattern, target, pad, document.encapsulation is not None, remarks)
    is_glued = any((target, pad, mount))
    readout = _readout(document.readout, document.fpc.tail, array.reference is not None, remarks)
    assembly = _assembly(document.assembly, is_glued, remarks)
    spec = SensorSpec(
        name=document.name, coil=coil, array=array, fpc=fpc, target=target, elastomer=pad,
        encapsulation=document.encapsulation, mount=mount, shield=document.shield, readout=readout,
        requirements=document.requirements, source=source,
        issue=Issue(document.revision, document.part_number, document.date), assembly=assembly,
        cutting=document.cutting, loads=_loads(document, mount, remarks), cells=cells,
    )
    _check_contacts(fpc.tail, spec.artwork.wires, remarks)
    if (reference := spec.reference_placement) is not None:
        check_reference(spec.all_placements, coil, remarks)
        if array.reference is not None and array.reference.offset is None:
            x = show(reference.centre[0] - array.middle[0], "m")
            remarks.default(REFERENCE_OFFSET, f"[{x}, 0 m]", "beside coils, target and elastomer")
    _check_tolerances(spec, remarks)
    _note_plain_defaults(SpecDocument, document, "", source.keys, remarks)
    return spec, remarks


def _check_drawn(drawn: str, source: SpecSource, remarks: Remarks) -> None:
    """Record an error for each key that has no effect on a board that the user drew. `drawn` is the board's file."""
    for key in ("fpc.tail", "fpc.panel", "fpc.teardrops"):
        if key in source.keys:
            message = f"the board is drawn in {drawn}, with all tracks to its terminals"
            remarks.flaw("SIT009", key, message, f"leave {key} out")


OTHER_HEIGHT, OTHER_THICKNESS = 0.1, 0.3
"""Largest relative differences of layer heights and of copper thicknesses between a board's file and the spec.

A larger difference is an error. The limit for copper is wide, because files often state the foil without plating.
"""


def _check_heights(coil: CoilSpec, stackup: Stackup, remarks: Remarks) -> None:
    """Record an error if heights or copper thicknesses in the file of a drawn coil contradict the spec's stack-up."""
    drawn = {number: (z, thickness) for number, z, thickness in coil.copper.heights} if coil.copper else {}
    ours = {layer.number: (layer.z, layer.thickness) for layer in stackup.copper if layer.number in coil.layers}
    if not ours or not ours.keys() <= drawn.keys():
        return
    columns = [tuple(zip(*(rows[number] for number in ours), strict=True)) for rows in (drawn, ours)]
    spans, thicknesses = [max(z) - min(z) for z, _ in columns], [max(each) for _, each in columns]
    for (theirs, here), share, what in ((spans, OTHER_HEIGHT, "between the middles of the coil's copper layers"),
                                        (thicknesses, OTHER_THICKNESS, "of copper in the coil")):
        if abs(theirs - here) > share * max(theirs, here):
            message = f"{coil.drawn} has {show(theirs, 'm', 3)} {what}, {stackup.name} has {show(here, 'm', 3)}"
            hint = "write the board's own stack-up in fpc.stackup, layer by layer"
            remarks.flaw("SIT009", "fpc.stackup", message, hint, measured=here, limit=theirs, unit="m")


def _copper_layers(document: SpecDocument) -> int | None:
    """Return the number of copper layers of the stack-up in a spec. None if the spec has no stack-up."""
    stackup = document.fpc.values()["stackup"]
    if isinstance(stackup, list):
        return sum(layer.copper is not None for layer in stackup)
    return None if stackup is None else len(stackup.copper)


def _note_plain_defaults(
    section: type[Section], values: Any, path: str, written: Mapping[str, Any], remarks: Remarks
) -> None:
    """Record each default that the format declares for an omitted key of `section`.

    `values` is the section's instance, `path` its dotted key with a dot at the end, and `written` the keys in the text.
    Defaults that depend on other values are recorded elsewhere.
    """
    is_alone = bool(section.alone) and getattr(values, section.attributes[section.alone[0]]) is not None
    for name, key in section.keys.items() if not is_alone else ():
        value, place, kind = getattr(values, section.attributes[name], None), f"{path}{name}", key.kind
        is_section = isinstance(value, Section)
        if isinstance(kind, NameOr) and isinstance(kind.preset, Preset):  # a preset's record is a section as well
            is_section = isinstance(kind.written, Part) and any(each.startswith(f"{place}.") for each in written)
        inner = section_of(kind)
        if is_section and inner is not None:
            _note_plain_defaults(inner, value, f"{place}.", written, remarks)
        elif place not in written and key.default not in (None, "", {}, "written out"):
            is_bare_length = isinstance(key.default, (int, float)) and getattr(kind, "dimension", "") == "length"
            remarks.default(place, f"{key.default} mm" if is_bare_length else str(key.default))


def _with_size(plate: Plate, key: str, usual: tuple[float, float], remarks: Remarks) -> Plate:
    """Return a target or pad with an omitted size and shape filled in. `usual` is the default size (m).

    `key` is the dotted key of its section. Defaults are recorded in `remarks`. Two different sides of a square or round
    plate are recorded as an error.
    """
    written = plate.values()
    if written["size"] is None:
        shown = show(usual[0], "m") if usual[0] == usual[1] else f"[{show(usual[0], 'm')}, {show(usual[1], 'm')}]"
        remarks.default(f"{key}.size", shown, "after what lies under it")
    size = written["size"] or usual
    shape = written["shape"] or ("square" if size[0] == size[1] else LONG_PLATE)
    if written["shape"] is None:
        remarks.default(f"{key}.shape", shape, "after its size")
    shape = computable_plate(shape, f"{key}.shape", remarks)
    if not PLATES[shape].is_long and size[0] != size[1]:
        hint = f"write one number, or shape: {LONG_PLATE}"
        remarks.flaw("SIT009", f"{key}.size", f"a {shape} has one size, not [x, y]", hint)
    return replace(plate, shape=shape, size=size)


def _smallest_pad_size(target: Target, offset: tuple[float, float]) -> tuple[float, float]:
    """Return the sides (m) of the smallest pad that lies below the whole target.

    `offset` is the position (m) of the pad's centre from the mean of the coils' centres.
    """
    reach = Footprint(target.outline.is_disc, target.size, Point(*target.offset), target.rotation).reach
    x, y = (2.0 * (abs(target.offset[axis] - offset[axis]) + reach[axis]) for axis in (0, 1))
    return x, y


def _assembly(part: Assembly, is_glued: bool, remarks: Remarks) -> Assembly:
    """Return the assembly with its adhesive. Values that the spec omits come from the adhesive's preset.

    `is_glued` is False if the sensor has nothing to glue.
    """
    written = part.values()
    adhesive = part.adhesive or presets.adhesive("cyanoacrylate")
    line = adhesive.line if written["glue_line"] is None else part.glue_line
    tolerance = min(adhesive.tolerance, line) if written["glue_tolerance"] is None else part.glue_tolerance
    shown = {"adhesive": adhesive.name, "glue_line": show(line, "m"), "glue_tolerance": show(tolerance, "m")}
    for key, value in shown.items():
        if is_glued and written[key] is None:
            remarks.default(f"assembly.{key}", value, "unverified: measure yours")
    if tolerance > line:
        message = f"a glue line of {show(line, 'm')} cannot come out {show(tolerance, 'm')} thinner"
        remarks.flaw("SIT009", "assembly.glue_tolerance", message, "write at most the thickness of the line")
    return replace(part, adhesive=adhesive, glue_line=line, glue_tolerance=tolerance)


def toleranced_sizes(spec: SensorSpec) -> dict[str, float | None]:
    """Return the size (m) to which each tolerance applies, by the tolerance's key.

    The size is None if the sensor lacks the part.
    """
    jaw = spec.mount.jaw if spec.mount is not None else None
    metal = spec.mount.metal_behind if spec.mount is not None else None
    parts = {"elastomer": spec.elastomer, "target": spec.target}
    plain = {"encapsulation": spec.encapsulation, "shield": spec.shield}
    return {
        "board": spec.fpc.stackup.thickness,
        **{name: part.thickness if part is not None else None for name, part in (parts | plain).items()},
        **{f"{name}_size": min(part.size) if part is not None else None for name, part in parts.items()},
        "mount": spec.mount.standoff if spec.mount is not None else None,
        "jaw": min(jaw.height, jaw.width) if jaw is not None else None,
        "metal_behind": metal.thickness if metal is not None else None,
        "metal_distance": metal.distance if metal is not None else None,
        "opposing_pad": jaw.opposing_pad_thickness if jaw is not None else None,
    }


def _check_tolerances(spec: SensorSpec, remarks: Remarks) -> None:
    """Record an error for each tolerance in the spec that is not smaller than the size to which it applies."""
    sizes = toleranced_sizes(spec)
    for part, tolerance in spec.assembly.tolerances:
        size = sizes.get(part)
        if size and tolerance >= size:
            key = f"assembly.tolerances.{part}"
            what = f"{TolerancesDocument.keys[part].about} is {show(size, 'm')}"
            message = f"{what} and cannot come out {show(tolerance, 'm')} less"
            remarks.flaw("SIT009", key, message, "write half of the band in which your parts were measured",
                         measured=tolerance, limit=size, unit="m")


_CABLE_PER_METRE = {"inductance": (600e-9, "H"), "capacitance": (100e-12, "F"), "resistance": (1.0, "ohm")}


def _readout(part: ReadoutSpec, tail: Tail | None, has_reference: bool, remarks: Remarks) -> ReadoutSpec:
    """Return the converter and its cable, with omitted values filled in. Errors are recorded in `remarks`.

    Omitted values of a cable are typical values of a thin flexible wire pair with the cable's length. `has_reference`
    is True if the array has a reference coil.
    """
    cable, place = part.cable, part.values()["capacitor_at"]
    for name, (per_metre, unit) in _CABLE_PER_METRE.items() if cable is not None else ():
        if cable is not None and getattr(cable, name) is None:
            value, length = per_metre * cable.length, show(cable.length, "m")
            why = f"the default for {length} of cable (unverified: measure yours)"
            remarks.default(f"readout.cable.{name}", show(value, unit), why)
            cable = replace(cable, **{name: value})
    strongest = len(part.device.drive_currents) - 1
    if part.drive_code is not None and part.drive_code > strongest:
        message = f"{part.device.part} has the drive codes 0 to {strongest}, not {part.drive_code}"
        remarks.flaw("SIT006", "readout.drive_code", message, "leave it out: sitscad chooses the code",
                     measured=float(part.drive_code), limit=float(strongest))
    if place is None:
        place = "coil" if part.chip else "converter"
        remarks.default("readout.capacitor_at", place)
    if part.chip is not None:
        # capacitors on the board need a stiffened tail with the two tracks of each pair above each other
        key = "readout.capacitors_on_board"
        if part.capacitor_at == "converter":
            remarks.flaw("SIT009", key, "the capacitors are at the converter",
                         "write capacitor_at: coil, or leave it out")
        if tail is None:
            remarks.flaw("SIT009", key, "there is no tail with a stiffener to carry them", "write fpc.tail")
        elif tail.connector.insertion_thickness <= 0.0:
            message = f"a tail that ends in {tail.connector.name} has no stiffener, and chips on bare film crack"
            remarks.flaw("SIT009", key, message, "use a connector that is plugged in, like zif-0.5mm")
        elif tail.layers == 1:
            two = (Edit("fpc.tail.layers", "2"),)
            remarks.flaw("SIT009", key, "they need a tail of two copper layers", "write fpc.tail.layers: 2", edits=two)
    compensation = _compensation(part, tail, has_reference, remarks)
    return replace(part, cable=cable, capacitor_at=place, compensation=compensation)


def _compensation(
    part: ReadoutSpec, tail: Tail | None, has_reference: bool, remarks: Remarks
) -> CompensationSpec | None:
    """Return the compensation of drift with its defaults.

    None if the spec has neither a temperature sensor nor a reference coil.
    """
    sensor = part.thermistor
    if sensor is None and not has_reference:
        if part.compensation is not None:
            remarks.flaw("SIT009", "readout.compensation", "nothing measures the temperature",
                         "write readout.thermistor, like {part: tmp117}, or array.reference: {}")
        return None
    place = BOARD if sensor is None else sensor.at
    if place == TAIL and tail is None:
        remarks.flaw("SIT009", "readout.thermistor.at", "there is no tail that could carry it",
                     "write fpc.tail, or at: board")
    elif place == TAIL and tail is not None and sensor is not None and sensor.is_soldered and (
            tail.connector.insertion_thickness <= 0.0):
        remarks.flaw("SIT009", "readout.thermistor.at",
                     f"a tail that ends in {tail.connector.name} has no stiffener, and chips on bare film crack",
                     "use a connector that is plugged in, like zif-0.5mm, or write at: board")
    compensation = part.compensation or CompensationSpec()
    if compensation.difference is not None:
        return compensation
    difference = presets.compensation_figure(f"difference at {place}")
    remarks.default("readout.compensation.difference", show(difference, "K"),
                    f"assumed for a sensor at the {place} (unverified: measure yours)")
    return replace(compensation, difference=difference)


def _check_contacts(tail: Tail | None, needed: int, remarks: Remarks) -> None:
    if tail is None or tail.contacts is None:
        return
    if not tail.connector.positions:
        message = f"a tail that ends in {tail.connector.name} has the contacts that the coils need"
        remarks.flaw("SIT009", "fpc.tail.contacts", message, "leave it out")
    elif tail.contacts < needed:
        message = f"the coils need {needed} contacts, the connector has {tail.contacts}"
        facts = {"measured": float(tail.contacts), "limit": float(needed)}
        enough = (Edit("fpc.tail.contacts", str(needed)),)
        remarks.flaw("SIT009", "fpc.tail.contacts", message, "write two contacts per coil", **facts, edits=enough)


def _loads(document: SpecDocument, mount: Mount | None, remarks: Remarks) -> tuple[LoadCase, ...]:
    """Return the load cases in the order of the format.

    Errors are recorded in `remarks`: a case has no normal force, the sensor has no target on an elastomer, or the
    levers cannot close the jaws.
    """
    cases = tuple(_cases(document, mount, remarks))
    for case in cases:
        if document.elastomer is None or document.target is None:
            hint = "write target and elastomer, or leave the load case out"
            remarks.flaw("SIT009", f"loads.{case.name}", "a load needs a target on an elastomer", hint)
    return cases


def _cases(document: SpecDocument, mount: Mount | None, remarks: Remarks) -> Iterator[LoadCase]:
    """Yield a load case for each section of `loads` in the spec. Errors are recorded in `remarks`."""

    def normal(name: str, written: float | None) -> float:
        """Return the normal force (N) of the case `name`: the case's own value `written`, or the required normal force.

        If the spec states neither, return 0 and record an error.
        """
        required = document.requirements.normal_force
        if written is None and required is None:
            hint = f"write loads.{name}.normal, or requirements.normal_force"
            remarks.flaw("SIT009", f"loads.{name}", "no normal force is given, and none is required", hint)
        elif written is None:
            remarks.default(f"loads.{name}.normal", show(required or 0.0, "N"), "the required normal force")
        return (written if written is not None else required) or 0.0

    loads = document.loads
    if (press := loads.press) is not None:
        yield LoadCase("press", normal("press", press.normal))
    if (shear := loads.shear) is not None:
        force, shear_force = normal("shear", shear.normal), (shear.shear_x, shear.shear_y)
        yield LoadCase("shear", force, shear_force, is_held=shear.rotation == "held")
    if (scissor := loads.scissor) is not None:
        force = normal("scissor", scissor.normal)
        yield LoadCase("scissor", force, opening=scissor.opening, is_stuck=scissor.face == "sticks")
    if (edge := loads.edge) is not None:
        force, size = normal("edge", edge.normal), document.target and document.target.values()["size"]
        distance, half = math.hypot(*edge.offset), 0.5 * math.hypot(*(size or ()))
        if size and distance > half:
            message = f"{show(distance, 'm')} from the middle of a target that reaches {show(half, 'm')}"
            remarks.flaw("SIT009", "loads.edge.offset", message, "write an offset on the target")
        yield LoadCase("edge", force, offset=edge.offset, is_held=False)
    if loads.mechanism is not None:
        mechanism = _mechanism(loads.mechanism, mount, remarks)
        yield LoadCase("mechanism", None, opening=2.0 * mechanism.theta, is_stuck=True, mechanism=mechanism)


def _mechanism(written: Mechanism, mount: Mount | None, remarks: Remarks) -> Mechanism:
    """Return the levers that close the jaws, with the distance from the pivot to the tip filled in.

    Record an error if link B does not reach the axis, if no pull can close the jaws, or if the jaw's length is unknown.
    """
    lever_angle = written.theta + written.theta0
    pin_height, reach = written.lever * math.sin(lever_angle), written.values()["reach"]
    if pin_height >= written.link:
        beside = f"lever A's pin, {show(pin_height, 'm')} beside it"
        message = f"link B, {show(written.link, 'm')}, does not reach the axis from {beside}"
        remarks.flaw("SIT009", "loads.mechanism.LB", message, f"write more than {show(pin_height, 'm')}")
    if lever_angle <= 0.0:
        message = "lever A lies along the axis, where no pull closes the jaws"
        remarks.flaw("SIT009", "loads.mechanism.theta", message, "write theta and theta0 with a sum above 0 deg")
    if reach is None and mount is not None and mount.jaw is not None and mount.jaw.hinge is not None:
        reach = mount.jaw.hinge + mount.jaw.length
        remarks.default("loads.mechanism.LJ", show(reach, "m"), "from the pivot to the tip of mount.jaw")
    elif reach is None:
        message = "the distance from the pivot to the pressing point is unknown"
        remarks.flaw("SIT009", "loads.mechanism.LJ", message, "write loads.mechanism.LJ, like 28 mm")
    return replace(written, reach=reach or 1.0)
