"""What carries the sensor, as it is written, to its values: jaw, bench, finger or a part of the user's own."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from sitscad.finding import Edit
from sitscad.spec.format.documents.materials import ConductorDocument
from sitscad.spec.format.documents.mount import FingerDocument, HoleDocument, JawDocument, MountDocument
from sitscad.spec.format.remarks import Remarks
from sitscad.spec.materials import Conductor
from sitscad.spec.pieces.mounting import Finger, Hole, HolePattern, Jaw, Mount, Retention, StepPart
from sitscad.spec.profiles import presets
from sitscad.spec.profiles.origin import Origin
from sitscad.spec.resolver.step_file import resolve_step
from sitscad.spec.sensor import Shield
from sitscad.units import show

DEFAULT_STANDOFF = 1e-3
DEFAULT_JAW, DEFAULT_METAL, DEFAULT_PORT, DEFAULT_HOLES = "generic-5mm", "stainless-304", 5e-3, "corners-m2"

BELONGS: dict[str, tuple[str, ...]] = {
    "grasper-pad": ("jaw", "retention"),
    "bench-plate": ("holes",),
    "fingertip": ("finger",),
    "custom": ("step", "datum", "along", "up"),
}
"""The keys that one kind of mount has and the others have not."""

NEEDED = ("width", "length", "height")
"""Figures without which nothing is known of a jaw."""


def resolve_mount(part: MountDocument | None, shield: Shield | None, remarks: Remarks, place: Origin) -> Mount | None:
    """The mount; the shield has to fit between board and metal. Names of files count from `place`, the spec."""
    if part is None:
        return None
    standoff = _standoff(part, shield, remarks)
    _check_keys(part, remarks)
    mount = Mount(part.kind, None, standoff, part.process)
    if part.kind == "bench-plate":
        return replace(mount, holes=_holes(part.holes, remarks))
    if part.kind == "fingertip":
        finger = _finger(part.finger or _whole(FingerDocument))
        if part.finger is None:
            size = " x ".join(show(side, "m") for side in finger.size)
            words = f"{finger.shape}, {size}, grip {show(finger.grip, 'm')}, screws of {show(finger.screw, 'm')}"
            remarks.default("mount.finger", words, "a finger of the usual size: measure yours")
        return replace(mount, finger=finger, backing=finger.material)
    if part.kind == "custom":
        return replace(mount, step=_step(part, "mount.step", place, remarks))
    if part.jaw is None:
        remarks.default("mount.jaw", DEFAULT_JAW)
    mount = _in_jaw(mount, part.jaw or DEFAULT_JAW, place, remarks)
    retention = _retention(part)
    if retention is not None:
        _check_retention(retention, mount, remarks)
    return replace(mount, retention=retention)


def _standoff(part: MountDocument, shield: Shield | None, remarks: Remarks) -> float:
    """The height of the board over what carries it; one that has no room for the shield is a flaw."""
    needed = shield.gap + shield.thickness if shield else 0.0
    standoff = part.standoff
    if standoff is None:
        standoff = max(DEFAULT_STANDOFF, needed)
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


def _check_keys(part: MountDocument, remarks: Remarks) -> None:
    """Keys of another kind of mount are flaws."""
    for kind, names in BELONGS.items():
        for name in names:
            if kind != part.kind and getattr(part, name) is not None:
                message = f"a {part.kind} has no {name}".replace("bench-plate", "bench plate")
                remarks.flaw("SIT009", f"mount.{name}", message, f"leave {name} out, or kind: {kind}")


def _in_jaw(mount: Mount, written: str | JawDocument, place: Origin, remarks: Remarks) -> Mount:
    """The mount with its jaw, or with the STEP file alone where no figure is written beside it."""
    if isinstance(written, str):
        return replace(mount, jaw=presets.jaw(written))
    step = _step(written, "mount.jaw.step", place, remarks)
    missing = [name for name in NEEDED if getattr(written, name) is None]
    material = None if written.material is None else resolve_conductor(written.material)
    if written.based_on is None and missing:
        if written.step is None or len(missing) < len(NEEDED):
            for name in missing:
                hint = "measure it and write it, or take a preset's: based_on: generic-5mm"
                remarks.flaw("SIT003", f"mount.jaw.{name}", f"the jaw has no {name}", hint)
        backing = material or presets.conductor(DEFAULT_METAL)
        return replace(mount, step=step, backing=backing)
    jaw = replace(_written_over(written, material), step=step)
    _check_jaw(jaw, remarks)
    return replace(mount, jaw=jaw)


def _written_over(document: JawDocument, material: Conductor | None) -> Jaw:
    """The jaw that is written, over the preset that it is based on."""
    figures: dict[str, Any] = {
        name: value
        for name, value in document.values().items()
        if value is not None and name not in ("name", "based_on", "material", "step", "datum", "along", "up")
    }
    if material is not None:
        figures["material"] = material
    if document.based_on is None:
        usual: dict[str, Any] = {"port_diameter": DEFAULT_PORT, "material": presets.conductor(DEFAULT_METAL)}
        return Jaw(name=document.name, source="the spec", **(usual | figures))
    base, written = presets.jaw(document.based_on), tuple(sorted(figures))
    source = presets.jaw_source(document.based_on, written)
    own = f"{', '.join(written)}: the spec; {source}" if written else source
    return replace(base, **figures, name=document.name, source=own, written=written)


def _check_jaw(jaw: Jaw, remarks: Remarks) -> None:
    """Whether pockets and window of a jaw lie inside its face, and the other jaw's pad in its pocket."""
    holes = (("pocket", jaw.pocket), ("fenestration", jaw.fenestration), ("opposing_pocket", jaw.opposing_pocket))
    for name, size in holes:
        if size is not None and (size[0] > jaw.length or size[1] > jaw.width):
            shown = f"{show(size[0], 'm')} x {show(size[1], 'm')}"
            message = f"the {name} is {shown}, the face {show(jaw.length, 'm')} x {show(jaw.width, 'm')}"
            remarks.flaw("SIT009", f"mount.jaw.{name}", message, "[length, width], inside length and width of the jaw")
    if jaw.opposing_recess > jaw.opposing_pad_thickness + 1e-9:
        message = (
            f"the other jaw's rims stand {show(jaw.opposing_recess, 'm')} above the floor of its pocket, its pad "
            f"{show(jaw.opposing_pad_thickness, 'm')}: they would meet the board before the pad does"
        )
        facts = {"measured": jaw.opposing_recess, "limit": jaw.opposing_pad_thickness, "unit": "m"}
        hint = "opposing_pad_thickness: that of the pad that lies in the pocket"
        remarks.flaw("SIT009", "mount.jaw.opposing_recess", message, hint, **facts)


def _retention(part: MountDocument) -> Retention | None:
    """What holds the mount besides glue; None for glue alone."""
    written = part.retention
    if written is None or written == "glue":
        return None
    return Retention(written) if isinstance(written, str) else Retention(**written.values())


def _check_retention(retention: Retention, mount: Mount, remarks: Remarks) -> None:
    """Whether the jaw is known that is to be cut, and whether a dovetail can slide in."""
    if mount.jaw is None or mount.jaw.step is not None:
        message = "the jaw is a STEP file, which is not cut here"
        remarks.flaw("SIT009", "mount.retention", message, "retention: glue, and cut the file's jaw yourself")
    elif retention.kind == "dovetail" and mount.jaw.pocket is not None and mount.jaw.recess:
        message = "a dovetail slides in from the tip, where the jaw's pad pocket is closed"
        remarks.flaw("SIT009", "mount.retention", message, "retention: pins, or a jaw without a pocket")


def _holes(written: str | list[HoleDocument] | None, remarks: Remarks) -> HolePattern:
    """The holes of a bench plate."""
    if written is None:
        remarks.default("mount.holes", DEFAULT_HOLES)
    if written is None or isinstance(written, str):
        return presets.hole_pattern(written or DEFAULT_HOLES)
    holes = tuple(Hole(each.at, each.diameter, each.head) for each in written)
    if not holes:
        remarks.flaw("SIT009", "mount.holes", "an empty list", "write [{at: [20, 15], diameter: 6.6, head: 10}], ...")
    for each, hole in zip(written, holes, strict=True):
        if hole.head < hole.diameter:
            message = f"a head of {show(each.head, 'm')} falls through a hole of {show(each.diameter, 'm')}"
            remarks.flaw("SIT009", "mount.holes", message, "head: the diameter of the screw's head")
            break
    return HolePattern("written out", holes, None, "", "the spec")


def _finger(written: FingerDocument) -> Finger:
    metal = None if written.material is None else resolve_conductor(written.material)
    return Finger(written.shape, written.size, written.grip, written.screw, metal)


def _whole(section: type[FingerDocument]) -> FingerDocument:
    """A section of which nothing is written."""
    from sitscad.spec.format.section import validator_of

    found: FingerDocument = validator_of(section).validate_python({})
    return found


def _step(part: Any, key: str, place: Origin, remarks: Remarks) -> StepPart | None:
    """The STEP file of a section with such keys; None without one, or with its faults noted."""
    lies = (part.datum, part.along, part.up)
    if part.step is None:
        for name in _lying(part):
            remarks.flaw("SIT009", f"{key.rpartition('.')[0]}.{name}", f"{name} belongs to a STEP file", "give step")
        return None
    return resolve_step(part.step, lies, key, place, remarks)


def _lying(part: Any) -> Iterator[str]:
    """Which of the keys are written that say how a STEP file lies."""
    return (name for name in ("datum", "along", "up") if getattr(part, name) is not None)


def resolve_conductor(document: str | ConductorDocument) -> Conductor:
    """A metal or magnetic sheet, by name or written out."""
    if isinstance(document, str):
        return presets.conductor(document)
    return Conductor(**document.values(), source="the spec")
