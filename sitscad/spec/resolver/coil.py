"""The coil as written to `CoilSpec`, with its turns held against its shape and size."""

from __future__ import annotations

import math

from sitscad.finding import Edit
from sitscad.geometry.shapes import SHAPES
from sitscad.spec.format.documents.spec import CoilDocument
from sitscad.spec.format.remarks import Remarks
from sitscad.spec.sensor import CoilSpec
from sitscad.units import show


def resolve_coil(document: CoilDocument, remarks: Remarks) -> CoilSpec:
    """The coil, with its turns held against its shape and size."""
    shape, outline = document.shape, SHAPES[document.shape]
    turns = tuple(outline.nearest_turns(n) if outline.is_whole(n) else n for n in document.turns)
    if len(turns) not in (1, len(document.layers)):
        message = f"{len(turns)} numbers of turns for {len(document.layers)} layers"
        facts = {"measured": float(len(turns)), "limit": float(len(document.layers))}
        remarks.flaw("SIT009", "coil.turns", message, "write one number for each layer, or one for all", **facts)
    coil = CoilSpec(
        shape=shape,
        size=document.outer_diameter,
        turns=turns if len(set(turns)) > 1 else turns[0],
        layers=document.layers,
        trace_width=document.trace_width,
        trace_spacing=document.trace_spacing,
        start_angle=document.start_angle,
        clockwise=document.sense == "clockwise",
        corner_radius=document.corner_radius,
    )
    check_coil(coil, remarks, turns)
    return coil


def check_coil(coil: CoilSpec, remarks: Remarks, written: tuple[float, ...] = ()) -> None:
    """Whether a coil's size, turns and corners fit its shape and each other; `written` are its turns as they are."""
    turns = written or (coil.layer_turns if coil.has_unequal_turns else coil.layer_turns[:1])
    _check_size(coil, remarks)
    _check_room(coil, remarks)
    for index, number in enumerate(turns):
        _check_turns(coil, number, "coil.turns" if len(turns) == 1 else f"coil.turns.{index}", remarks)
    _check_corner(coil, remarks)


MOST_OF_A_COIL, MOST_OF_ALL = 500.0, 2000.0
"""Turns of all layers of one coil, and of all coils: the memory of an estimate grows with the square of the first (0.5
GB at 400 turns near metal), its time with both.
"""


def check_amount(coil: CoilSpec, coils: int, remarks: Remarks) -> None:
    """Whether all turns together are no more than an estimate can be made of."""
    one = math.fsum(coil.layer_turns)
    for turns, most, whose in ((one, MOST_OF_A_COIL, "a coil"), (one * coils, MOST_OF_ALL, f"all {coils} coils")):
        if turns > most:
            message = (
                f"{turns:g} turns in all layers of {whose} are too many to be estimated: at most {most:g}; memory and "
                "time grow with their square"
            )
            hint = "fewer turns or layers" + (", or fewer coils" if coils > 1 else "")
            remarks.flaw("SIT019", "coil.turns", message, hint, measured=turns, limit=most)
            return


def _check_size(coil: CoilSpec, remarks: Remarks) -> None:
    """Note a size that the shape cannot have."""
    x, y = coil.size
    if not coil.outline.is_long and x != y:
        hint = f"write one number, or choose {' or '.join(name for name, row in SHAPES.items() if row.is_long)}"
        remarks.flaw("SIT009", "coil.outer_diameter", f"a {coil.shape} has one size, not [x, y]", hint)
    if coil.outline.is_long and not coil.outline.sides and x <= y:
        message = f"a {coil.shape}'s x ({show(x, 'm')}) must be larger than its y ({show(y, 'm')})"
        remarks.flaw(
            "SIT009", "coil.outer_diameter", message, "its straight sides run along x: write [x, y] with x > y"
        )


def _check_room(coil: CoilSpec, remarks: Remarks) -> None:
    if _most_turns(coil) <= 0:
        message = f"a trace of {show(coil.trace_width, 'm')} leaves no inside in {show(coil.outer_diameter, 'm')}"
        remarks.flaw("SIT016", "coil.outer_diameter", message, "make the coil larger or the trace finer")


def _most_turns(coil: CoilSpec) -> float:
    return coil.outline.most_turns(coil.size, coil.trace_width, coil.pitch)


def _check_turns(coil: CoilSpec, turns: float, key: str, remarks: Remarks) -> None:
    """Whether the turns of a layer, written at a key, end where the shape has an end, and fit."""
    parts = coil.outline.ends
    if parts and not coil.outline.is_whole(turns):
        nearest = coil.outline.nearest_turns(turns)
        if nearest > (most := _most_turns(coil)) > 0:
            nearest = most
        end = "corner" if coil.outline.sides else "side"
        message = f"{turns:g} turns of a {coil.shape} do not end at a {end}: a multiple of 1/{parts} is wanted"
        whole = (Edit(key, f"{nearest:.7g}"),) if nearest > 0 else ()
        facts = {"measured": turns, "limit": nearest}
        remarks.flaw("SIT015", key, message, f"the nearest is {nearest:.7g}", **facts, edits=whole)
    most = _most_turns(coil)
    if most > 0 and turns > most * (1 + 1e-9):
        fits = f"{int(most * 100) / 100:g}" if parts is None else f"{most:.7g}"
        message = f"{turns:g} turns do not fit in {show(coil.outer_diameter, 'm')}: at most {fits}"
        hint = (
            "fewer turns (vias inside the innermost turn need room as well), a finer trace and spacing, more layers, "
            "or a larger coil"
        )
        remarks.flaw("SIT016", key, message, hint, measured=turns, limit=float(fits))


def _check_corner(coil: CoilSpec, remarks: Remarks) -> None:
    """Note a corner radius that the shape cannot have."""
    if coil.corner_radius and not coil.outline.sides:
        message = f"a {coil.shape} has no corners to round"
        none = (Edit("coil.corner_radius", "0"),)
        remarks.flaw("SIT009", "coil.corner_radius", message, "leave corner_radius out", edits=none)
    elif coil.corner_radius > coil.outer_diameter / 2:
        limit = coil.outer_diameter / 2
        message = f"a corner radius of {show(coil.corner_radius, 'm')} is more than half the size ({show(limit, 'm')})"
        remarks.flaw("SIT009", "coil.corner_radius", message, "", measured=coil.corner_radius, limit=limit, unit="m")
