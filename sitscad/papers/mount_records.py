"""What is known of the solids in ``mount/``: what was measured on the closed pair (``fit.json``, from which `build`
makes its findings, and a picture of each that is not kept), how each printed piece is made (``print.json``), what the
assembly weighs (``assembly.json``), and its picture.
"""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np

from sitscad.drawing.pictures.assembly import assembly_svg
from sitscad.drawing.pictures.rendered import clash_svg
from sitscad.estimates.response.pad import NoResponse, pushed
from sitscad.layout.board import Layout
from sitscad.parts.clash import at_pin, carried, clashes
from sitscad.parts.mass import Balance, Weight, balance, weigh
from sitscad.parts.printable import as_json, printable
from sitscad.parts.proof import Load, Measured, Proof, prove, require_clear
from sitscad.parts.solid import Solid, of_role
from sitscad.scene.bodies import BodyRole, elastomer
from sitscad.scene.column import print_limit
from sitscad.scene.hinge import pin_gaps
from sitscad.scene.state import Pose
from sitscad.scene.tail_path import tail_path
from sitscad.spec.sensor import SensorSpec
from sitscad.units import show

PARABOLA = 1.5
"""A bonded pad's free side bulges as a parabola, half as far again in the middle as on the average (Gent 2012, 2.3)."""


def render_fit(layout: Layout, solids: tuple[Solid, ...]) -> dict[str, bytes]:
    """The proof as JSON, in metres, and a picture of what does not fit; without a jaw whose figures are known only what
    the board is carried on. Raises `PartsError` where a piece stands in a solid that came from a file.
    """
    require_clear(layout)
    borne = loads(layout.spec)
    proof = prove(layout, solids, borne)
    held = carried(layout, solids)
    if proof is None:
        return _as_file({"measured": [_measured(each) for each in held]}) if held else {}
    files = _as_file(document(replace(proof, measured=(*proof.measured, *held))))
    # The tail and the hinge's pin, where the one runs into the other while the jaws are closed or open
    gap = next((gap for gap in pin_gaps(layout) if not gap.is_free), None)
    drawn = [*clashes(layout, solids, proof, borne), *([] if gap is None else [at_pin(layout, solids, gap)])]
    return files | ({"mount/fit-solids.svg": clash_svg(layout.spec.name, drawn).encode("utf-8")} if drawn else {})


def _as_file(said: dict[str, Any]) -> dict[str, bytes]:
    return {"mount/fit.json": (json.dumps(said, indent=1) + "\n").encode("ascii")}


def loads(spec: SensorSpec) -> tuple[Load, ...]:
    """The forces that the spec asks to be borne, shear along every axis; none without a pad or a force."""
    normal, shear = spec.requirements.normal_force or 0.0, spec.requirements.shear_force or 0.0
    if not (normal or shear):
        return ()
    ways = {"": (0.0, 0.0)}
    if shear:
        ways = {"along x": (shear, 0.0), "along -x": (-shear, 0.0), "along y": (0.0, shear), "along -y": (0.0, -shear)}
    rows = np.array([[normal, *way] for way in ways.values()])
    try:
        poses, _ = pushed(spec, rows)
    except NoResponse:
        return ()
    press = f"{show(normal, 'N')} of press"
    names = [f"{press} and {show(shear, 'N')} {way}" if way else press for way in ways]
    return tuple(
        Load(name, Pose(*(float(value) for value in pose)), bulge(spec, -float(pose[2])))
        for name, pose in zip(names, poses, strict=True)
    )


def bulge(spec: SensorSpec, press: float) -> float:
    """How far (m) the elastomer's free sides come out in the middle when it is pressed by so much (m).

    An incompressible pad pushes out what its face takes away: over the whole side that is area times press over
    perimeter times the height that is left, half as far again in the middle of a parabola.
    """
    pad = elastomer(spec)
    if pad is None or press <= 0.0:
        return 0.0
    outline, left = pad.outline(), max(0.05 * pad.thickness, pad.thickness - press)
    return PARABOLA * pad.footprint.area * press / (outline.length * left)


def document(proof: Proof) -> dict[str, Any]:
    """The proof in plain values: lengths in metres, volumes in cubic metres."""
    return {
        "closed_pair_radius_m": _nanometres(proof.radius),
        "closed_pair_radius_from_figures_m": _nanometres(proof.plane_radius),
        "port_radius_m": proof.port_radius,
        "fits": proof.fits,
        "opened_rad": proof.opened,
        "measured": [_measured(each) for each in proof.measured],
        "clearances": [{"first": c.first, "second": c.second, "gap_m": _nanometres(c.gap)} for c in proof.clearances],
    }


def _measured(each: Measured) -> dict[str, Any]:
    digits = {"m": 9, "m2": 12}.get(each.unit, 15)
    return {
        "what": each.what, "first": each.first, "second": each.second, "when": each.when,
        "value": round(each.value, digits) + 0.0, "limit": round(each.limit, digits) + 0.0, "unit": each.unit,
        "kept": each.is_kept, "where_m": [_nanometres(value) for value in each.where],
    }


def _nanometres(length: float) -> float:
    """To a nanometre: what lies below is the kernel's, and differs between machines."""
    return round(length, 9) + 0.0


FIGURES = ("wall", "free_wall", "hole", "clearance", "pin", "groove")


def render_print(solids: tuple[Solid, ...], aids: tuple[Solid, ...], spec: SensorSpec) -> dict[str, bytes]:
    """The measured pieces of mount, jig and moulds with their process's limits; nothing without a mount."""
    if spec.mount is None:
        return {}
    process = spec.mount.process
    pieces = [printable(piece, process) for piece in (*of_role(solids, BodyRole.MOUNT), *aids)]
    limits = {figure: print_limit(process, figure) for figure in FIGURES}
    document = {
        "process": process,
        "limits_m": {name: limit.value for name, limit in limits.items()},
        "sources": {name: limit.source for name, limit in limits.items()},
        "can_be_made": not any(piece.faults for piece in pieces),
        "pieces": [as_json(piece, process) for piece in pieces],
    }
    return {"mount/print.json": (json.dumps(document, indent=1) + "\n").encode("utf-8")}


def render_weights(layout: Layout, solids: tuple[Solid, ...]) -> dict[str, bytes]:
    """The JSON, in kilograms, metres and cubic metres, axes as in ``mount/assembly.step``."""
    weights = weigh(layout, solids)
    sensor = tuple(weight for weight in weights if not weight.is_carrier)
    path = tail_path(layout)
    document = {
        "axes": "x along the jaw towards the handle, y across, z = 0 at the board's top face, metres",
        "sensor": _balance(balance(sensor)),
        "with_jaws": _balance(balance(weights)),
        "tail_drawn_straight_because": path.reason if path is not None and path.reason else None,
        "pieces": [_piece(weight) for weight in weights],
    }
    return {"mount/assembly.json": (json.dumps(document, indent=1) + "\n").encode("utf-8")}


def _balance(found: Balance) -> dict[str, Any]:
    return {
        "mass_kg": _rounded(found.mass, 12), "centre_m": [_rounded(value, 9) for value in found.centre],
        "not_weighed": list(found.unknown),
    }


def _piece(weight: Weight) -> dict[str, Any]:
    return {
        "name": weight.name, "is_carrier": weight.is_carrier, "material": weight.material,
        "volume_m3": _rounded(weight.volume, 16), "share_of_volume": _rounded(weight.share, 6),
        "copper_m3": _rounded(weight.copper, 16), "density_kg_per_m3": weight.density,
        "mass_kg": None if weight.mass is None else _rounded(weight.mass, 12),
        "centre_m": [_rounded(value, 9) for value in weight.centre], "density_source": weight.source,
    }


def _rounded(value: float, digits: int) -> float:
    """What lies below is the kernel's rounding, and differs between machines."""
    return round(value, digits) + 0.0


def render_picture(solids: tuple[Solid, ...], spec: SensorSpec) -> dict[str, bytes]:
    """``mount/assembly.svg``; nothing without a mount."""
    if spec.mount is None:
        return {}
    return {"mount/assembly.svg": assembly_svg(solids, spec).encode("utf-8")}
