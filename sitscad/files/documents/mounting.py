"""Assembly steps that depend on the mount and on the encapsulation, and data of the solids in ``mount/``.

* ``fit.json``: measurements on the closed pair, from which `build` makes its findings, and a picture of collisions
* ``print.json``: sizes and limits of the printed pieces
* ``assembly.json``: mass of the assembly
* pictures of the assembly and of the jig
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from sitscad.assembly.places.bodies import Body, BodyRole, plates_of
from sitscad.assembly.places.column import Layer, Toleranced, layers_on_seat, print_limit
from sitscad.assembly.places.fit import pin_gaps, screw_head_height
from sitscad.assembly.places.jaws import jaw_range
from sitscad.assembly.places.seating import (
    CORNER_SCREW,
    ENGAGED,
    FLOOR,
    adapter_depth,
    adapter_holes,
    cap_size,
    is_near_metal,
    joint_clearance,
    metal_free_distance,
    pin_places,
    plate_floor,
    plate_holes,
    retention,
    screw_spacing,
    tongue_across,
)
from sitscad.assembly.places.state import Pose
from sitscad.assembly.places.tail_path import bends, tail_path
from sitscad.assembly.solids.clash import bending_rod_overlap, clashes, hinge_pin_clash, support_areas
from sitscad.assembly.solids.plates import metal_below
from sitscad.assembly.solids.proof import (
    PadLoad,
    Proof,
    ProofValue,
    as_json,
    check_print,
    measure_solids,
    step_file_overlaps,
)
from sitscad.assembly.solids.solid import MissingExtra, Solid, select_by_role
from sitscad.assembly.solids.step_parts import measured_jaw, read_files
from sitscad.assembly.solids.tooling import BOARD_PRESS, LEAST_MIX, SiliconeMix, skin_silicone
from sitscad.assembly.solids.whole import Balance, balance, weigh
from sitscad.basics.units import in_mm, show
from sitscad.estimates.loads.gluing import board_plan, board_press, glued_area, hard_adhesive
from sitscad.estimates.loads.pad import NoResponse, loaded_poses
from sitscad.files.documents.gluing import board_gluing_text, inhibition_warning, line_areas, toleranced_text
from sitscad.files.documents.piece_places import (
    custom_mount_place_text,
    jig_captions,
    press_captions,
    recess_place_text,
)
from sitscad.files.documents.preparing import cure_text, silicone_mix_text, silicone_volume_text
from sitscad.files.documents.tail_steps import glued_tail_size, glued_tail_text, loose_tail_text
from sitscad.files.drawing.pictures.rendered import assembly_svg, clash_svg
from sitscad.files.writer import json_bytes
from sitscad.kernels.geometry.convex import Box
from sitscad.kernels.geometry.path import Point
from sitscad.layout.bending import Bend
from sitscad.layout.board import Layout
from sitscad.spec.coil import CoilSpec
from sitscad.spec.materials import Encapsulation
from sitscad.spec.mount import Mount
from sitscad.spec.sensor import SensorSpec
from sitscad.spec.yaml.source import SpecSource


def dose_volumes(layout: Layout) -> tuple[float, ...]:
    """Return the volume (m3) of each dose of liquid glue in the assembly steps, smallest first."""
    assembly, hard = layout.spec.assembly, hard_adhesive(layout)
    areas = list[float]()
    if assembly.adhesive is not None and assembly.adhesive.viscosity is not None:
        areas += [glued_area(layout.spec, part) for part in ("elastomer", "target") if getattr(layout.spec, part)]
    if hard is not None and hard.viscosity is not None:
        areas += line_areas(layout).values() if layout.spec.jaw is not None else [board_plan(layout)[1]]
        areas += [length * across for length, across in filter(None, (glued_tail_size(layout),))]
    return tuple(sorted(area * assembly.glue_line for area in areas))


def jaw_joint_steps(body: Box, glue_line: float, mount: Mount | None) -> Iterator[str]:
    """Yield the step that cuts a dovetail groove or pin holes into the jaw; empty without such a joint."""
    joint = retention(body, mount)
    if joint is not None and mount is not None and mount.jaw is not None:
        room, tip, beside = joint_clearance(glue_line, mount), jaw_range(body, mount.jaw)[0], mount.jaw.width / 2
        end = body[2] + room
        if joint.kind == "dovetail":
            bottom, top, depth = tongue_across(joint, room)
            yield (
                f"Mill the dovetail's groove into the jaw's face, open at the tip: {2e3 * bottom:.2f} mm wide at its "
                f"bottom, {2e3 * top:.2f} mm at the face, {depth * 1e3:.2f} mm deep, on the jaw's middle "
                f"({1e3 * beside:.2f} mm from either side to its axis), from the tip {1e3 * (end - tip):.2f} mm long, "
                "as the jaw's STEP file has it. The mount slides in from the tip up to the groove's end."
            )
        else:
            at = " and ".join(f"{1e3 * (x - tip):.2f}" for x, _ in pin_places(body, mount))
            yield (
                f"Drill two holes of {1e3 * (joint.diameter + 2.0 * room):.2f} mm through the jaw, their centres {at} "
                f"mm behind its tip, on its middle ({1e3 * beside:.2f} mm from either side): the STEP file of the jaw "
                "has them."
            )


def board_mounting_steps(layout: Layout) -> Iterator[str]:
    """Yield the steps that glue the board to a plate, a cap or a custom part, and bend the tail."""
    mount = layout.spec.mount
    if mount is None:
        return
    if bending := loose_tail_text(layout):
        yield bending
    slot = ", tail in the slot" if layout.spec.fpc.tail is not None else ""
    recess = recess_place_text(layout.spec.assembly, layout.spec.fpc, layout.spec.mount)
    seat = _seat_height_text(mount, layout.spec.shield is not None, layers_on_seat(layout))
    glued = f"Glue the board into the mount's recess{slot}.{recess} {board_gluing_text(layout)}{seat}"
    if mount.finger is not None:
        yield f"Tap both holes in the cap's sides M{in_mm(mount.finger.screw)}. {glued}"
    elif mount.kind == "custom":
        placing = custom_mount_place_text(layout.body, layout.spec.assembly, layout.spec.fpc.tail, mount.step)
        placing += _custom_mount_height_text(layout.spec.coil, layout.spec.mount)
        yield f"Put the board on your own mount and glue it down.{placing} {board_gluing_text(layout)}"
    elif mount.holes is not None:
        yield glued
    if bending := glued_tail_text(layout):
        yield bending


def _custom_mount_height_text(coil: CoilSpec, mount: Mount | None) -> str:
    """Describe the board's height over the metal behind a custom mount.

    Without such metal, describe its least distance.
    """
    metal = mount.metal_behind if mount is not None else None
    if metal is None:
        return metal_below_text(coil, mount)
    return (
        f" Its face for the board has to lie {in_mm(metal.distance)} mm above the {metal.material.name}, with nothing "
        "of metal between."
    )


def sensor_mounting_steps(layout: Layout) -> Iterator[str]:
    """Yield the steps that mount the finished sensor on its plate or finger, after gluing, bending and sealing.

    Empty without a mount, and for a jaw.
    """
    mount = layout.spec.mount
    if mount is None or mount.jaw is not None:
        return
    if mount.finger is not None:
        width, side = cap_size(layout.body, layout.spec.mount)
        yield (
            f"Slip the cap, {in_mm(width, 2)} mm wide, over the finger and clamp it by two "
            f"M{in_mm(mount.finger.screw)} set screws of plastic: metal nearer to a coil than "
            f"{in_mm(metal_free_distance(layout.spec.coil), 1)} mm changes the readings, brass too, "
            f"and no figure counts the screws. The cap's sides are {in_mm(side, 2)} mm thick there: screws of "
            f"{in_mm(set_screw_length(layout.body, layout.spec.mount))} mm do not stand out."
        )
        return
    if mount.holes is None:
        return
    is_near = is_near_metal(layout.spec.coil, layout.spec.all_placements, plate_holes(layout))
    heads = _screw_head_text(screw_head_height(layout), is_near)
    room_below = _room_below_text(layout.body[2], bends(layout))
    if adapter_holes(layout):
        plate, below = -plate_floor(layout)[1], adapter_depth(adapter_holes(layout))
        yield (
            f"Screw mount-adapter on ({mount.holes.name}, {len(mount.holes.holes)} screws, their heads sunk). "
            f"{screw_text(mount.holes.thread, FLOOR)} Lay four M2 nuts into it from below first; they hold the mount's "
            f"four screws.{metal_below_text(layout.spec.coil, layout.spec.mount)}"
        )
        yield f"Screw the mount on the adapter: {_nut_screw_text(plate + below)}{heads}{room_below}"
    else:
        thread = "M2" if mount.holes.name == "corners-m2" else mount.holes.thread
        yield (
            f"Screw the mount down ({mount.holes.name}{_spacing_text(screw_spacing(plate_holes(layout)))}). "
            f"{screw_text(thread, -plate_floor(layout)[1])}{heads}"
            f"{metal_below_text(layout.spec.coil, mount)}{room_below}"
        )


def _spacing_text(spacing: tuple[float, float] | None) -> str:
    """Describe the spacing of the screws.

    `spacing` holds the sides (m) of the screws' rectangle. If it is None, the text is empty.
    """
    return "" if spacing is None else f"; the screws {in_mm(spacing[0], 2)} x {in_mm(spacing[1], 2)} mm apart"


def _screw_head_text(height: float | None, is_near: bool) -> str:
    """Describe the screws' material, and the height of their heads above the sensor's top face.

    `height` (m) is None for inch threads, and the text is then empty. `is_near` states whether steel would be too near
    to a coil.
    """
    above = height
    if above is None:
        return ""
    plastic = " Take screws of plastic (polyamide): steel would be too near to a coil."
    proud = (
        f" Their heads stand {in_mm(above, 2)} mm above the sensor's top face: what presses it must be narrower than "
        "the room between them."
    )
    return f"{plastic if is_near else ''}{proud if above > SAME else ''}"


NUT = 1.6e-3
"""Height (m) of an M2 nut (ISO 4032)."""

SET_LENGTHS = (2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0)
"""Lengths of set screws (mm; ISO 4026)."""

LENGTHS = (3, 4, 5, 6, 8, 10, 12, 16, 20, 25, 30, 35, 40, 45, 50)
"""Lengths of screws under the head (mm; ISO 4762)."""


def set_screw_length(body: Box, mount: Mount | None) -> float:
    """Return the length (m) of the set screws in a cap's sides: the longest standard length that does not protrude."""
    _, side = cap_size(body, mount)
    return 1e-3 * max((each for each in SET_LENGTHS if 1e-3 * each <= side + SAME), default=SET_LENGTHS[0])


def nut_screw_length(depth: float) -> tuple[int, bool]:
    """Return the length (mm) of the M2 screws through mount and adapter, and whether they must be cut to `depth`.

    `depth` (m) is the distance from the lower side of the screws' heads to the lower face of the adapter, which holds
    the nuts. Screws are cut if the longest standard length within `depth` enters the nuts by less than half.
    """
    grip = depth - CORNER_SCREW.nut_height
    length = max((each for each in LENGTHS if 1e-3 * each <= depth + SAME), default=LENGTHS[0])
    if min(1e-3 * length - grip, NUT) >= NUT / 2:
        return length, False
    return next(each for each in LENGTHS if 1e-3 * each > depth), True


def _nut_screw_text(depth: float) -> str:
    """Describe the M2 screws into the adapter's nuts in a sentence; `depth` (m) is as in `nut_screw_length`."""
    length, is_cut = nut_screw_length(depth)
    if is_cut:
        return f"M2 x {length} screws (ISO 4762), cut to {in_mm(depth, 1)} mm: longer ones stand out of the adapter."
    reach = min(1e-3 * length - depth + CORNER_SCREW.nut_height, NUT)
    return f"M2 x {length} screws (ISO 4762) reach {in_mm(reach, 1)} mm into the nuts and do not stand out."


def screw_length(thread: str, grip: float) -> int | None:
    """Return the standard length (mm) of a metric screw that goes through plastic of a thickness `grip` (m).

    None for threads in inches, and for lengths beyond `LENGTHS`.
    """
    if not thread.startswith("M"):
        return None
    diameter = 1e-3 * float(thread.removeprefix("M"))
    return next((each for each in LENGTHS if 1e-3 * each >= grip + ENGAGED * diameter), None)


def screw_text(thread: str, grip: float) -> str:
    """Describe the screws of a thread, with their length through plastic of the thickness `grip` (m).

    `thread` is a name such as M2 or 1/4-20; if empty, any screw fits.
    """
    lies = f"{in_mm(grip, 1)} mm of plastic lie under each head"
    if not thread.startswith("M"):  # the length table is metric
        whose = f"{thread} screws" if thread else "the screws"
        return f"{lies}: {whose} are longer by {ENGAGED:g} of their diameters at least."
    length = screw_length(thread, grip)
    if length is None:
        least = grip + ENGAGED * 1e-3 * float(thread.removeprefix("M"))
        return f"{lies}: {thread} screws of {in_mm(least, 1)} mm and longer."
    engagement = 1e-3 * length - grip
    return f"{lies}: {thread} x {length} screws (ISO 4762) go {in_mm(engagement, 1)} mm into the part below."


def metal_below_text(coil: CoilSpec, mount: Mount | None) -> str:
    """Describe the distance below the board within which there must be no metal, or no metal besides `metal_behind`.

    Empty for a finger or a jaw.
    """
    if mount is None or mount.jaw is not None or mount.finger is not None:
        return ""
    if mount.metal_behind is not None:
        behind = mount.metal_behind
        return (
            f" Below, {in_mm(behind.distance, 2)} mm and the glue lines under the board, the readings count "
            f"{in_mm(behind.thickness, 2)} mm of {behind.material.name}: nothing else of metal may lie nearer."
        )
    return (
        f" The part below may be of metal only from {in_mm(metal_free_distance(coil), 1)} mm below the board "
        "on: nearer metal changes the readings, and none is counted. For a nearer one write "
        "mount.metal_behind and build anew."
    )


def _room_below_text(body_end: float, tail_bends: tuple[Bend, ...]) -> str:
    """Describe where the part under a plate must end, so that the tail can bend down. Empty if no bend goes down."""
    first = next((bend for bend in tail_bends if bend.direction == "down"), None)
    if first is None:
        return ""
    return (
        f" The part below must end {in_mm(first.start - body_end, 2)} mm behind the body, or have a slot from "
        "there on: the tail goes down there."
    )


SAME = 1e-6  # Smallest difference (m) between two lengths

def _seat_height_text(mount: Mount, has_shield: bool, layers: tuple[Layer, ...]) -> str:
    """Describe the height of the board's top face above the face under the mount; empty with a shield.

    `layers` are the layers between the two faces.
    """
    if has_shield:
        return ""
    height = sum((layer.thickness for layer in layers), Toleranced(0.0))
    face = "the face that the mount stands on" if mount.finger is None else "the cap's face against the finger"
    return f" From {face} to the board's top face are {toleranced_text(height)} then."


def film_text(layout: Layout, film: Encapsulation) -> str:
    """Describe how the film is applied: cast in its mould, or brushed on if it is too thin for casting."""
    poured = skin_silicone(layout)
    caution = inhibition_warning(layout.spec.assembly.adhesive, layout.spec.encapsulation, hard_adhesive(layout))
    if poured is None:
        return (
            f"Seal board, elastomer and target with {in_mm(film.thickness)} mm of {film.material.name}, brushed on: "
            f"mix {1e6 * LEAST_MIX:g} ml of {silicone_mix_text(film.material)}; little of it stays on. Mask the "
            "contacts with polyimide tape (masking tape can keep silicone from curing); no copper may be left open. "
            f"{cure_text(film.material)} Measure the "
            "sensor's height before and after. If the coat is too thin, add another one of silicone that is thinned as "
            f"its maker says.{caution}"
        )
    sealed = " (its print sealed as said above)" if has_resin_moulds(layout.spec.mount) else ""
    return (
        f"Cast the skin: mix {silicone_volume_text(poured)} of {silicone_mix_text(film.material)}, wipe mould release "
        f"into mould-skin{sealed}, "
        "fill it lying open, take the air out, and put the jig's base with the sensor on it face down, so that its "
        "pins go into the cup; weigh it down with 1 kg. What is too much leaves by the grooves. "
        f"{cure_text(film.material)} To open it, drop "
        "isopropanol on the seam, wait a minute, and lift the cup straight up with a thin blade at the grooves, a "
        f"little on one side and a little on the other. Never pull at the skin. Cut the flash at the grooves.{caution}"
    )


def release_text(holes: tuple[tuple[Point, ...], float], skin: SiliconeMix | None) -> str:
    """Describe how the board is pushed out of the jig's base.

    `holes` are the centres (m) of the holes through the base, and their diameter (m). `skin` is the silicone of a cast
    film; None if no film is cast.
    """
    places, size = holes
    holding = "glue" if skin is None else "glue or skin"
    if len(places) == 1:
        return (
            "Push the board out of the base from below, by the hole, with a flat-ended rod just below "
            f"{in_mm(size)} mm."
        )
    return (
        f"Push the board out of the base from below, by its {len(places)} holes in turn, a little at each, with a "
        f"flat-ended rod just below {in_mm(size)} mm: one hole alone would bend the board. If {holding} holds it, let "
        "isopropanol creep round its edge first."
    )


def has_resin_moulds(mount: Mount | None) -> bool:
    """Whether the moulds are of photopolymer, on which platinum-cure silicones may stay liquid."""
    return mount is not None and mount.process == "resin"


PARABOLA = 1.5
"""Ratio of the largest to the mean bulge of a bonded pad's free side, which is a parabola (Gent 2012, 2.3)."""


def render_fit(layout: Layout, solids: tuple[Solid, ...]) -> dict[str, bytes]:
    """Return ``mount/fit.json``, the measurements on the closed jaws in metres, and a picture of solids that collide.

    Without a jaw of known dimensions, the file has only the measurements that need no closed jaws. Examples are the
    board's support and the sizes of STEP files.
    """
    borne = required_loads(layout.spec)
    proof = measure_solids(layout, solids, borne)
    carried_measures = (*support_areas(layout, solids), *bending_rod_overlap(layout, solids))
    measures = (*read_files(layout.spec.mount, layout.spec.source), *step_file_overlaps(layout.spec.mount, solids),
            *measured_jaw(layout), *carried_measures)
    if proof is None:
        return _as_file({"measured": [_value_document(each) for each in measures]}) if measures else {}
    files = _as_file(fit_document(replace(proof, measured=(*proof.measured, *measures))))
    # A collision of the tail with the hinge's pin, with jaws closed or open
    gap = next((gap for gap in pin_gaps(layout) if not gap.is_free), None)
    at_hinge = [] if gap is None else [hinge_pin_clash(layout, solids, gap)]
    collisions = [*clashes(layout, solids, proof, borne), *at_hinge]
    if collisions:
        files["mount/fit-solids.svg"] = clash_svg(layout.spec.name, collisions).encode("utf-8")
    return files


def _as_file(content: dict[str, Any]) -> dict[str, bytes]:
    return {"mount/fit.json": json_bytes(content)}


def unread_files(mount: Mount | None, source: SpecSource) -> str:
    """Return the text of a ``mount/fit.json`` that lists unreadable STEP files; empty if all are readable.

    No solids or files of solids can be made for a spec with unreadable files. The text is also empty without a CAD
    kernel.
    """
    try:
        unread = [each for each in read_files(mount, source) if not each.is_kept]
    except MissingExtra:  # functions that need the CAD kernel report its absence
        return ""
    return json_bytes({"measured": [_value_document(each) for each in unread]}).decode("ascii") if unread else ""


def required_loads(spec: SensorSpec) -> tuple[PadLoad, ...]:
    """Return the required loads with the target's pose and the pad's bulge; empty without a pad or a required force.

    Shear acts along x, -x, y and -y in turn.
    """
    normal, shear = spec.requirements.normal_force or 0.0, spec.requirements.shear_force or 0.0
    if not (normal or shear):
        return ()
    directions = {"": (0.0, 0.0)}
    if shear:
        directions = {"along x": (shear, 0.0), "along -x": (-shear, 0.0), "along y": (0.0, shear),
                      "along -y": (0.0, -shear)}
    rows = np.array([[normal, *way] for way in directions.values()])
    try:
        poses, _ = loaded_poses(spec, rows)
    except NoResponse:
        return ()
    press = f"{show(normal, 'N')} of press"
    names = [f"{press} and {show(shear, 'N')} {way}" if way else press for way in directions]
    return tuple(
        PadLoad(name, Pose(*(float(value) for value in pose)),
                largest_bulge(plates_of(spec).elastomer, -float(pose[2])))
        for name, pose in zip(names, poses, strict=True)
    )


def largest_bulge(pad: Body | None, press: float) -> float:
    """Return the largest bulge (m) of the elastomer's free sides at a compression `press` (m).

    Notes
    -----
    An incompressible pad displaces the volume of its face area times the compression. The mean bulge is this volume
    over perimeter and remaining height. The largest bulge, in the middle of a parabola, is 1.5 times the mean.
    """
    if pad is None or press <= 0.0:
        return 0.0
    outline, remaining = pad.outline(), max(0.05 * pad.thickness, pad.thickness - press)
    return PARABOLA * pad.footprint.area * press / (outline.length * remaining)


def fit_document(proof: Proof) -> dict[str, Any]:
    """Return the measurements as plain values: lengths in metres, volumes in cubic metres."""
    return {
        "closed_pair_radius_m": _rounded(proof.radius),
        "closed_pair_radius_from_figures_m": _rounded(proof.plane_radius),
        "port_radius_m": proof.port_radius,
        "fits": proof.fits,
        "opened_rad": proof.opened,
        "measured": [_value_document(each) for each in proof.measured],
        "clearances": [{"first": c.first, "second": c.second, "gap_m": _rounded(c.gap)} for c in proof.clearances],
    }


def _value_document(each: ProofValue) -> dict[str, Any]:
    digits = {"m": 9, "m2": 12}.get(each.unit, 15)
    return {
        "what": each.what, "first": each.first, "second": each.second, "when": each.condition,
        "value": _rounded(each.value, digits), "limit": _rounded(each.limit, digits), "unit": each.unit,
        "kept": each.is_kept, "where_m": [_rounded(value) for value in each.where],
        **({"key": each.key} if each.key else {}),
    }


FIGURES = ("wall", "free_wall", "hole", "clearance", "pin", "groove")


def render_print(solids: tuple[Solid, ...], aids: tuple[Solid, ...], spec: SensorSpec) -> dict[str, bytes]:
    """Return ``mount/print.json``: the printed pieces of mount, jig and moulds, and the limits of the printing process.

    Empty without a mount. `aids` are the solids of jig and moulds.
    """
    if spec.mount is None:
        return {}
    process = spec.mount.process
    pieces = [check_print(piece, process) for piece in (*select_by_role(solids, BodyRole.MOUNT), *aids)]
    limits = {figure: print_limit(process, figure) for figure in FIGURES}
    document = {
        "process": process,
        "limits_m": {name: limit.value for name, limit in limits.items()},
        "sources": {name: limit.source for name, limit in limits.items()},
        "can_be_made": not any(piece.faults for piece in pieces),
        "pieces": [as_json(piece, process) for piece in pieces],
    }
    return {"mount/print.json": json_bytes(document)}


def render_weights(layout: Layout, solids: tuple[Solid, ...]) -> dict[str, bytes]:
    """Return ``mount/assembly.json``: mass (kg), volume (m3) and centre (m) of each piece and of the sensor.

    The axes are those in ``mount/assembly.step``.
    """
    weights = weigh(layout, solids)
    sensor = tuple(weight for weight in weights if not weight.is_carrier)
    path = tail_path(layout)
    document = {
        "axes": "x along the jaw towards the handle, y across, z = 0 at the board's top face, metres",
        "sensor": _balance_document(balance(sensor)),
        "with_jaws": _balance_document(balance(weights)),
        "tail_drawn_straight_because": path.reason if path is not None and path.reason else None,
        "pieces": [{
            "name": weight.name, "is_carrier": weight.is_carrier, "material": weight.material,
            "volume_m3": _rounded(weight.volume, 16), "share_of_volume": _rounded(weight.share, 6),
            "copper_m3": _rounded(weight.copper, 16), "density_kg_per_m3": weight.density,
            "mass_kg": None if weight.mass is None else _rounded(weight.mass, 12),
            "centre_m": [_rounded(value) for value in weight.centre], "density_source": weight.source,
        } for weight in weights],
    }
    return {"mount/assembly.json": json_bytes(document)}


def _balance_document(total: Balance) -> dict[str, Any]:
    return {
        "mass_kg": _rounded(total.mass, 12), "centre_m": [_rounded(value) for value in total.centre],
        "not_weighed": list(total.unknown),
    }


def _rounded(value: float, digits: int = 9) -> float:
    """Return a value rounded to `digits` decimals (9 is 1 nm for lengths).

    CAD kernels differ between machines in the decimals that are cut off.
    """
    return round(value, digits) + 0.0


def render_picture(layout: Layout, solids: tuple[Solid, ...]) -> dict[str, bytes]:
    """Return ``mount/assembly.svg``. Empty without a mount.

    It also shows a metal finger or the metal behind the mount.
    """
    spec = layout.spec
    if spec.mount is None:
        return {}
    return {"mount/assembly.svg": assembly_svg((*metal_below(layout), *solids), spec).encode("utf-8")}


def render_jig_picture(layout: Layout, solids: tuple[Solid, ...], tools: tuple[Solid, ...]) -> dict[str, bytes]:
    """Return pictures of the jig with its contents, one per glued part (``mount/jig-PART.svg``).

    ``mount/jig-board-press.svg`` shows the press on the board with the pieces below. Empty without a mount or jig.
    """
    spec, jig = layout.spec, select_by_role(tools, BodyRole.JIG)
    if spec.mount is None or not jig:
        return {}
    base, shown, files = jig[0], select_by_role(solids, BodyRole.BOARD), dict[str, bytes]()
    frames = [each for each in jig[1:] if each.name != BOARD_PRESS]
    for frame, press in zip(frames[::2], frames[1::2], strict=True):
        pieces = select_by_role(solids, BodyRole(frame.name.removeprefix("jig-")))
        shown_with = (base, *shown, frame, *pieces, press)
        captions = jig_captions(layout, frame.name.removeprefix("jig-"))
        picture = assembly_svg(shown_with, replace(spec, mount=None), frame.name, captions)  # without the port's circle
        files[jig_picture(frame.name)] = picture.encode("utf-8")
        shown = (*shown, *pieces)
    if jig[-1].name == BOARD_PRESS:
        below = (*select_by_role(solids, BodyRole.MOUNT), *select_by_role(solids, BodyRole.SHIELD))
        captions = press_captions(board_press(layout))
        picture = assembly_svg((*below, *shown, jig[-1]), replace(spec, mount=None), BOARD_PRESS, captions)
        files[jig_picture(BOARD_PRESS)] = picture.encode("utf-8")
    return files


def jig_picture(frame: str) -> str:
    """Return the package path of the picture that shows the jig in use with a frame."""
    return f"mount/{frame}.svg"
