"""Conversion of the spec's section ``mount``, for a jaw, a bench, a finger or the user's own part.

It also reads STEP files named in the spec. They must lie in its folder or below, have at most `MOST_STEP_BYTES` and be
text in the form of ISO 10303-21.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from sitscad.basics.digest import sha256
from sitscad.basics.finding import Edit
from sitscad.basics.units import show
from sitscad.kernels.geometry.shapes import LONG_PLATE, PLATES
from sitscad.spec import presets
from sitscad.spec.format.section import WRITTEN_SOURCE
from sitscad.spec.materials import Shield
from sitscad.spec.mount import LEVEL, Finger, Hole, HolePattern, Jaw, Mount, Retention, StepPart, half_chord
from sitscad.spec.profiles import Origin
from sitscad.spec.reading import Remarks

DEFAULT_STANDOFF = 1e-3
DEFAULT_JAW, DEFAULT_METAL, DEFAULT_PORT, DEFAULT_HOLES = "generic-5mm", "stainless-304", 5e-3, "corners-m2"

KEYS_BY_KIND: dict[str, tuple[str, ...]] = {
    "grasper-pad": ("jaw", "retention"), "bench-plate": ("holes",), "fingertip": ("finger",),
    "custom": ("step", "datum", "along", "up"),
}
"""Keys that are valid for only one kind of mount, by this kind."""

NEEDED = ("width", "length", "height")
"""Sizes that the spec must give for a jaw, unless it is based on a preset or described by a STEP file."""

MOST_STEP_BYTES = 16 * 2**20
"""Maximum size of a STEP file. A package stores it; a jaw usually has some hundred kilobytes."""

BEGINS, ENDS = b"ISO-10303-21;", b"END-ISO-10303-21;"


def resolve_mount(part: Mount | None, shield: Shield | None, remarks: Remarks, place: Origin) -> Mount | None:
    """Return the mount with presets, files and defaults filled in. None if the spec has no mount.

    `part` is the section as written. `place` is the spec: file names are relative to its folder. Errors are recorded in
    `remarks`; an example is a shield that does not fit between board and metal.
    """
    if part is None:
        return None
    standoff = _standoff(part, shield, remarks)
    _check_keys(part, remarks)
    _check_metal(part, standoff, remarks)
    mount = Mount(part.kind, None, standoff, part.process, metal_behind=part.metal_behind)
    written = part.values()
    if part.kind == "bench-plate":
        return replace(mount, holes=_holes(written["holes"], remarks))
    if part.kind == "fingertip":
        finger = part.finger or Finger()
        finger = replace(finger, shape=computable_plate(finger.shape, "mount.finger.shape", remarks))
        if part.finger is None:
            size = " x ".join(show(side, "m") for side in finger.size)
            usual = f"{finger.shape}, {size}, grip {show(finger.grip, 'm')}, screws of {show(finger.screw, 'm')}"
            remarks.default("mount.finger", usual, "a finger of the usual size: measure yours")
        return replace(mount, finger=finger, backing=finger.material)
    if part.kind == "custom":
        step = _step_part(part, "mount", place, remarks)
        return replace(mount, step=step, datum=part.datum, along=part.along, up=part.up)
    if part.jaw is None:
        remarks.default("mount.jaw", DEFAULT_JAW)
    mount = _with_jaw(mount, part.jaw or presets.jaw(DEFAULT_JAW), place, remarks)
    retention: Retention | str | None = written["retention"]
    if retention is None or retention == "glue":
        return mount
    if isinstance(retention, str):
        retention = Retention(retention)
    _check_retention(retention, mount.jaw, remarks)
    return replace(mount, retention=retention)


def computable_plate(shape: str, key: str, remarks: Remarks) -> str:
    """Return `shape` if plates of this shape can be computed and cut. Otherwise return "rectangle".

    The second case is recorded in `remarks` as an error at `key`.
    """
    if PLATES[shape].plate:
        return shape
    shapes = ", ".join(name for name, row in PLATES.items() if row.plate)
    message = f"a plate of shape {PLATES[shape].name} cannot be computed: the shape declares no form of a plate"
    remarks.flaw("SIT009", key, message, f"choose one of {shapes}")
    return LONG_PLATE


def _standoff(part: Mount, shield: Shield | None, remarks: Remarks) -> float:
    """Return the height (m) of the board's bottom face above the metal. Without metal, above the carrying face.

    A shield that does not fit below the board is recorded as an error in `remarks`.
    """
    needed = shield.gap + shield.thickness if shield else 0.0
    standoff: float | None = part.values()["standoff"]
    if standoff is None:
        room = DEFAULT_STANDOFF if part.metal_behind is None else min(DEFAULT_STANDOFF, part.metal_behind.distance)
        standoff = max(room, needed)
        remarks.default("mount.standoff", show(standoff, "m"))
    if standoff < needed * (1 - 1e-9):
        message = (
            f"the shield ends {show(needed, 'm')} below the board's bottom face, the metal begins at "
            f"{show(standoff, 'm')} (mount.standoff)"
        )
        least = f"{needed * 1e3:.6g} mm"
        hint = f"mount.standoff: {least} or more: shield.gap and shield.thickness together"
        facts = {"measured": standoff, "limit": needed, "unit": "m", "edits": (Edit("mount.standoff", least),)}
        remarks.flaw("SIT009", "mount.standoff", message, hint, **facts)
    return standoff


def _check_keys(part: Mount, remarks: Remarks) -> None:
    for kind, names in KEYS_BY_KIND.items():
        for name in names:
            if kind != part.kind and getattr(part, name) is not None:
                message = f"a {part.kind} has no {name}".replace("bench-plate", "bench plate")
                remarks.flaw("SIT009", f"mount.{name}", message, f"leave {name} out, or kind: {kind}")


def _check_metal(part: Mount, standoff: float, remarks: Remarks) -> None:
    """Record an error if ``mount.metal_behind`` begins inside the mount, or if a jaw or finger screens it."""
    metal = part.metal_behind
    if metal is None:
        return
    is_finger = part.finger is not None and part.finger.material is not None
    if part.kind == "grasper-pad" or is_finger:
        whose, key = ("finger", "mount.finger.material") if is_finger else ("jaw", "mount.jaw")
        message = f"the {whose} is the metal behind the board already, and screens what lies behind it"
        remarks.flaw("SIT009", "mount.metal_behind", message, f"leave metal_behind out: {key} says which metal it is")
    elif metal.distance < standoff * (1 - 1e-9):
        message = (f"the metal begins {show(metal.distance, 'm')} behind the board, inside the mount, which ends at "
                   f"{show(standoff, 'm')} (mount.standoff)")
        least = f"{standoff * 1e3:.6g} mm"
        facts = {"measured": metal.distance, "limit": standoff, "unit": "m",
                 "edits": (Edit("mount.metal_behind.distance", least),)}
        remarks.flaw("SIT009", "mount.metal_behind.distance", message,
                     f"mount.metal_behind.distance: {least} or more, or a smaller mount.standoff", **facts)


def _with_jaw(mount: Mount, written: Jaw, place: Origin, remarks: Remarks) -> Mount:
    """Return the mount with its jaw: a preset, or the sizes in the spec with defaults filled in.

    `written` is the jaw as the spec has it. If the spec gives only a STEP file of the jaw, return the mount with this
    file and without a jaw. Errors are recorded in `remarks`.
    """
    if written.preset:
        return replace(mount, jaw=written)
    step = _step_part(written, "mount.jaw", place, remarks)
    missing = [name for name in NEEDED if getattr(written, name) is None]
    if written.based_on is None and missing:
        if written.step is None or len(missing) < len(NEEDED):
            for name in missing:
                hint = "measure it and write it, or take a preset's: based_on: generic-5mm"
                remarks.flaw("SIT003", f"mount.jaw.{name}", f"the jaw has no {name}", hint)
        return replace(mount, step=step, backing=written.material or presets.conductor(DEFAULT_METAL))
    jaw = _merged_jaw(written, step)
    # pockets and window must lie inside the face, and the other jaw's pad must stand out of its pocket
    holes = (("pocket", jaw.pocket), ("fenestration", jaw.fenestration), ("opposing_pocket", jaw.opposing_pocket))
    for name, size in holes:
        if size is not None and (size[0] > jaw.length or size[1] > jaw.width):
            shown = f"{show(size[0], 'm')} x {show(size[1], 'm')}"
            message = f"the {name} is {shown}, the face {show(jaw.length, 'm')} x {show(jaw.width, 'm')}"
            remarks.flaw("SIT009", f"mount.jaw.{name}", message, "write [length, width] smaller than the face")
    if jaw.opposing_recess > jaw.opposing_pad_thickness + 1e-9:
        message = (
            f"the other jaw's rims stand {show(jaw.opposing_recess, 'm')} above the floor of its pocket, its pad "
            f"{show(jaw.opposing_pad_thickness, 'm')}: they touch the board before the pad"
        )
        facts = {"measured": jaw.opposing_recess, "limit": jaw.opposing_pad_thickness, "unit": "m"}
        hint = "write opposing_pad_thickness of the pad that lies in the pocket"
        remarks.flaw("SIT009", "mount.jaw.opposing_recess", message, hint, **facts)
    chord = 2.0 * half_chord(jaw.height, jaw.port_diameter / 2.0)
    if written.width is not None and jaw.face is None and jaw.step is None and chord < jaw.width - 1e-9:
        remarks.default("mount.jaw.face", show(chord, "m", 4),
                        f"the chord of a back as round as the port; a width of {show(jaw.width, 'm')} has no such face")
    return replace(mount, jaw=jaw)


def _merged_jaw(written_jaw: Jaw, step: StepPart | None) -> Jaw:
    beside = ("name", "based_on", "step", "datum", "along", "up")
    figures = {name: value for name, value in written_jaw.values().items() if value is not None and name not in beside}
    lies: dict[str, Any] = {"step": step, "datum": written_jaw.datum, "along": written_jaw.along, "up": written_jaw.up}
    base = written_jaw.based_on
    if base is None:
        usual: dict[str, Any] = {"port_diameter": DEFAULT_PORT, "material": presets.conductor(DEFAULT_METAL)}
        return Jaw(name=written_jaw.name, source=WRITTEN_SOURCE, **(LEVEL | usual | figures), **lies)
    written = tuple(sorted(figures))
    source = presets.jaw_source(base.name, written)
    if written:
        source = f"{', '.join(written)}: {WRITTEN_SOURCE}; {source}"
    return replace(base, **figures, **lies, name=written_jaw.name, based_on=base, source=source, written=written)


def _check_retention(retention: Retention, jaw: Jaw | None, remarks: Remarks) -> None:
    """Record an error if a joint is impossible: sitscad cannot cut a jaw's STEP file, and a dovetail must slide in."""
    if jaw is None or jaw.step is not None:
        message = "the jaw is a STEP file, which sitscad does not cut"
        remarks.flaw("SIT009", "mount.retention", message, "write retention: glue, and cut the jaw yourself")
    elif retention.kind == "dovetail" and jaw.pocket is not None and jaw.recess:
        message = "a dovetail slides in from the tip, but the jaw's pad pocket is closed there"
        remarks.flaw("SIT009", "mount.retention", message, "write retention: pins, or a jaw without a pocket")


def _holes(written: HolePattern | list[Hole] | None, remarks: Remarks) -> HolePattern:
    if written is None:
        remarks.default("mount.holes", DEFAULT_HOLES)
        return presets.hole_pattern(DEFAULT_HOLES)
    if isinstance(written, HolePattern):
        return written
    if not written:
        remarks.flaw("SIT009", "mount.holes", "an empty list", "write [{at: [20, 15], diameter: 6.6, head: 10}], ...")
    falling = next((hole for hole in written if hole.head < hole.diameter), None)
    if falling is not None:
        message = f"a head of {show(falling.head, 'm')} falls through a hole of {show(falling.diameter, 'm')}"
        remarks.flaw("SIT009", "mount.holes", message, "write head, the diameter of the screw's head")
    return HolePattern("written out", tuple(written), None, "", WRITTEN_SOURCE)


def _step_part(part: Mount | Jaw, section: str, place: Origin, remarks: Remarks) -> StepPart | None:
    # Return the STEP file named in a section, with datum and axes as written. None if there is none, or if it is
    # invalid; a flaw then gives the reason. The CAD kernel reads its content in a separate process
    # (`sitscad.assembly.solids.imported`).
    name, key = part.values()["step"], f"{section}.step"
    if name is None:
        for lies in ("datum", "along", "up"):
            if getattr(part, lies) is not None:
                remarks.flaw("SIT009", f"{section}.{lies}", f"{lies} belongs to a STEP file", "write step, too")
        return None
    datum, long_axis, normal_axis = part.datum or (0.0, 0.0, 0.0), part.along or "x", part.up or "z"
    if long_axis[-1] == normal_axis[-1]:
        message = f"{long_axis} runs to the tail and {normal_axis} stands on the face: they are one line"
        remarks.flaw("SIT009", f"{section}.up", message, "write two axes at right angles, like along: x, up: z")
    if isinstance(datum, str) and (part.along or part.up):
        message = f"the coordinate system {datum} already sets the axes"
        remarks.flaw("SIT009", f"{section}.{'along' if part.along else 'up'}", message, "leave along and up out")
    smaller = "export the jaw alone, without the instrument's other parts"
    file = place.read_named_file(name, key, remarks, "STEP", "jaw.step", MOST_STEP_BYTES, smaller)
    if file is None:
        return None
    content, names = file
    text = content.strip()
    if not text.startswith(BEGINS) or not text.endswith(ENDS) or b"\0" in content:
        message = f"{name} does not begin with {BEGINS.decode()} and end with {ENDS.decode()}"
        remarks.flaw("SIT011", key, message, "write a complete STEP file (AP203, AP214 or AP242)")
        return None
    remarks.files |= dict.fromkeys(names, content)
    point = datum if isinstance(datum, str) else (datum[0], datum[1], datum[2])
    return StepPart(min(names), sha256(content).hexdigest(), point, long_axis, normal_axis)
