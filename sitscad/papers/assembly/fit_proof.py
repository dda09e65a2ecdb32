"""What was measured on the solids of the closed pair: ``mount/fit.json``, from which `build` makes its findings, and
``mount/fit-solids.svg``, a picture of each that is not kept.
"""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np

from sitscad.drawing.pictures.clash import clash_svg
from sitscad.estimates.response.pad import NoResponse, pushed
from sitscad.layout.board import Layout
from sitscad.parts.proof.carried import carried
from sitscad.parts.proof.clash import Clash, at_pin, clashes
from sitscad.parts.proof.moved import Load
from sitscad.parts.proof.prove import Measured, Proof, prove, require_clear
from sitscad.parts.solid import Solid
from sitscad.scene.bodies import elastomer
from sitscad.scene.hinge import pin_gaps
from sitscad.scene.state import Pose
from sitscad.spec.sensor import SensorSpec
from sitscad.units import show

PARABOLA = 1.5
"""A bonded pad's free side bulges as a parabola, half as far again in the middle as on the average (Gent 2012, 2.3)."""


def render(layout: Layout, solids: tuple[Solid, ...]) -> dict[str, bytes]:
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
    drawn = [*clashes(layout, solids, proof, borne), *_tail_at_pin(layout, solids)]
    return files | ({"mount/fit-solids.svg": clash_svg(layout.spec.name, drawn).encode("utf-8")} if drawn else {})


def _as_file(said: dict[str, Any]) -> dict[str, bytes]:
    return {"mount/fit.json": (json.dumps(said, indent=1) + "\n").encode("ascii")}


def _tail_at_pin(layout: Layout, solids: tuple[Solid, ...]) -> list[Clash]:
    """The tail and the hinge's pin, where the one runs into the other while the jaws are closed or open."""
    gap = next((gap for gap in pin_gaps(layout) if not gap.is_free), None)
    return [] if gap is None else [at_pin(layout, solids, gap)]


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
        "closed_pair_radius_m": _rounded(proof.radius),
        "closed_pair_radius_from_figures_m": _rounded(proof.plane_radius),
        "port_radius_m": proof.port_radius,
        "fits": proof.fits,
        "opened_rad": proof.opened,
        "measured": [_measured(each) for each in proof.measured],
        "clearances": [{"first": c.first, "second": c.second, "gap_m": _rounded(c.gap)} for c in proof.clearances],
    }


def _measured(each: Measured) -> dict[str, Any]:
    digits = {"m": 9, "m2": 12}.get(each.unit, 15)
    return {
        "what": each.what, "first": each.first, "second": each.second, "when": each.when,
        "value": round(each.value, digits) + 0.0, "limit": round(each.limit, digits) + 0.0,
        "unit": each.unit, "kept": each.is_kept,
        "where_m": [_rounded(value) for value in each.where],
    }  # fmt: skip


def _rounded(length: float) -> float:
    """To a nanometre: what lies below is the kernel's, and differs between machines."""
    return round(length, 9) + 0.0
