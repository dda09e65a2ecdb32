"""Assembly steps that bend and fix the tail, before and after the board is glued."""

from __future__ import annotations

import math
from collections.abc import Sequence

from sitscad.assembly.places.jaws import jaw_range
from sitscad.assembly.places.seating import tail_support
from sitscad.assembly.places.tail_path import ROD, Lip, bending_rod_start, bends, lip, stated_bend, tail_path
from sitscad.basics.units import in_mm
from sitscad.estimates.loads.gluing import hard_adhesive
from sitscad.files.documents.gluing import hard_glue_dose_text
from sitscad.files.order_facts.notes import bend_place, hinge_text
from sitscad.layout.bending import Bend
from sitscad.layout.board import Layout
from sitscad.spec.mount import Jaw, Mount

LEAST_FIXED = 3e-3
"""Length (m) of tail glued to the jaw's face if the mount has no tongue. A shorter face is not used."""

LEAST_MET = 0.05e-3
"""Least overlap (m) of bending rod and mount for which the instructions state a remedy."""


def glued_tail_size(layout: Layout) -> tuple[float, float] | None:
    """Return length and width (m) of the tail's area that is glued to a mount's tongue or a jaw's face.

    None if the tail is not glued to either.
    """
    tongue, edge, path, jaw = tail_support(layout), lip(layout), tail_path(layout), layout.spec.jaw
    if jaw is None or path is None:
        return None
    if tongue is not None:
        end = tongue.along[1] if edge is None else edge.start
        return end - tongue.along[0], tongue.tail[1] - tongue.tail[0]
    low, high = layout.reach_at(path.last_start.x)
    return (LEAST_FIXED, high - low) if jaw_range(layout.body, jaw)[1] - path.last_start.x >= LEAST_FIXED else None


def early_bends(jaw: Jaw | None, tail_bends: tuple[Bend, ...], edge: Lip | None) -> tuple[Bend, ...]:
    """Return the bends made before the board is glued, because a jaw below the tail leaves no room for the rod.

    A bend over the mount's round edge is made later, over this edge. A bend upwards needs no room below. Empty without
    a jaw. `edge` is the mount's round edge; None if it has none.
    """
    if jaw is None:
        return ()
    has_edge = edge is not None
    return tuple(bend for bend in tail_bends if (not has_edge if bend.why else bend.direction == "down"))


def loose_tail_text(layout: Layout) -> str:
    """Describe how the tail of a loose board is bent; empty if no bend is made before the board is glued."""
    early = early_bends(layout.spec.jaw, bends(layout), lip(layout))
    if not early:
        return ""
    below = ""
    if any(bend.why for bend in early) and (path := tail_path(layout)) is not None:
        drop = in_mm(path.start.z - path.last_start.z, 1, 1)
        below = f" Seen from the side, the tail is parallel to the body then, and {drop} mm lower."
    if any(not bend.why for bend in early):
        below = below.replace("then", "between bends 2 and 3")
    piece = "target" if layout.spec.target is not None else "coils" if layout.spec.elastomer is None else "elastomer"
    hinge = hinge_text(layout.spec.fpc.tail, layout.spec.jaw, stated_bend(layout))
    return (
        "Bend the tail while the board is loose: once the board is glued, there is no room for a rod between the tail "
        f"and the jaw. Hold the board by its edges, never by the {piece}. "
        f"{_bend_list_text(layout.body[2], lip(layout), early)}{below} A tail springs back: bend it further until "
        f"it keeps this angle.{hinge}"
    )


def glued_tail_text(layout: Layout) -> str:
    """Describe how the tail of the glued board is bent.

    Empty without a tail, or if all bends are made before gluing.
    """
    if layout.spec.fpc.tail is None:
        return ""
    tail_bends, early = bends(layout), early_bends(layout.spec.jaw, bends(layout), lip(layout))
    late = tuple(bend for bend in tail_bends if bend not in early)
    if not tail_bends:
        return "Do not bend the tail."
    if not late:
        return ""
    hinge = "" if early else hinge_text(layout.spec.fpc.tail, layout.spec.jaw, stated_bend(layout))
    room = _rod_room_text(layout.spec.mount, layout.body[2], tail_bends, bending_rod_start(layout), late)
    return f"Bend the tail now. {_bend_list_text(layout.body[2], lip(layout), late)}{hinge}{room}"


def _bend_list_text(body_end: float, edge: Lip | None, tail_bends: Sequence[Bend]) -> str:
    """Describe bends in their order, with the side and the diameter of the rod, in whole sentences.

    `body_end` is the x (m) of the body's end. `edge` is the mount's round edge; None if it has none.
    """
    has_edge = edge is not None
    sentences, needs_rod = [], False
    for number, bend in enumerate(tail_bends, 1):
        start = f"({number}) " * (len(tail_bends) > 1) + bend_place(body_end, bend)
        if bend.why and bend.direction == "down" and has_edge:
            sentences.append(f"{start}; this edge takes the place of a rod.")
            continue
        needs_rod = True
        side = "under the tail, on the face without the coils" if bend.direction == "down" else (
            "over the tail, on the face with the coils")
        sentences.append(f"{start}; rod {side}.")
    radius = tail_bends[0].radius
    order = "in this order, from the body outwards, and nowhere else. " if len(tail_bends) > 1 else "and nowhere else: "
    rod = _rod_text(radius) if needs_rod else ""
    return f"Bend by hand, slowly, {order}{' '.join(sentences)}{rod} The drawing of the board has the lines."


def _rod_text(radius: float | None) -> str:
    """Describe the rod around which the tail is bent to an inner radius (m). Empty if `radius` is not given."""
    if radius is None or radius <= 0.0:
        return ""
    across = math.ceil(2e4 * radius - 1e-6) / 10.0
    return (
        f" Lay a rod of {across:g} mm diameter, or a little more, across the tail at each line, and bend the tail "
        f"round it: the inside radius is {in_mm(radius)} mm or more."
    )


def _rod_room_text(
    mount: Mount | None, body_end: float, tail_bends: tuple[Bend, ...], clear: float, late: Sequence[Bend]
) -> str:
    """Describe the room below the mount that the rod needs for a bend downwards. Empty if none is needed.

    `body_end` is the x (m) of the body's end. Bends that start at x < `clear` (m) make the rod touch the mount. `late`
    are the bends made on the glued board.
    """
    down = [bend for bend in late if bend.direction == "down"]
    if mount is None or mount.kind not in ("bench-plate", "custom") or not down:
        return ""
    text = " The rod needs room below: lay the mount at a table's edge, with the line beyond it."
    if mount.kind == "custom":
        return f"{text} {custom_mount_end_text(body_end, tail_bends)}"
    start = min(bend.start for bend in down)
    if start < clear - LEAST_MET:
        met = in_mm(clear - start, 1)
        text += f" It meets the mount's lower edge there by {met} mm: chamfer that edge by as much with a file first."
    return text


def custom_mount_end_text(body_end: float, tail_bends: tuple[Bend, ...]) -> str:
    """Describe where a custom mount must end to clear the rod of the first bend downwards.

    `body_end` is the x (m) of the body's end.
    """
    first = min((bend for bend in tail_bends if bend.direction == "down"), key=lambda bend: bend.start)
    end = first.start - (first.radius or 0.0) - ROD - body_end
    side = "behind" if end >= 0.0 else "before"
    return (
        f"Your own part must end at most {in_mm(abs(end), 2)} mm {side} the body's end at the tail, or be cut away "
        "from there on as deep as the rod is thick: rod and tail go down there."
    )


def strain_relief_text(layout: Layout) -> str:
    """Describe the strain relief of the tail, with the bends made on the glued board.

    The tail is fixed to the mount's tongue, else to the jaw's face, else behind the jaw.
    """
    bending, tongue, edge = glued_tail_text(layout), tail_support(layout), lip(layout)
    fixed = glued_tail_size(layout)
    area = 0.0 if fixed is None else fixed[0] * fixed[1]
    glue = hard_glue_dose_text(layout.spec.assembly, hard_adhesive(layout), area)
    if tongue is not None and fixed is not None:
        upto = "over the tongue's whole length" if edge is None else "up to where its end is round"
        return (
            f"Glue the tail down with {glue}, on the mount's tongue behind the body, "
            f"over {in_mm(fixed[0], 2)} mm, {upto}: a pull on it ends there. {bending}"
        ).rstrip()
    # Start (x, m) and length (m) of the tail's contact with the jaw's face, up to the heel
    path, jaw = tail_path(layout), layout.spec.jaw
    assert path is not None and jaw is not None
    begin, room = path.last_start.x, jaw_range(layout.body, jaw)[1] - path.last_start.x
    if fixed is not None:
        return (
            f"{bending} Fix the tail with {glue}, to the jaw's metal from "
            f"{in_mm(begin - layout.body[2], 2)} mm behind "
            f"the body on, over at least {in_mm(LEAST_FIXED)} mm, so that a pull on it does not reach the glue of the "
            "sensor (the mount has no tongue for it)."
        ).lstrip()
    return (
        f"{bending} Nothing is left behind the body to glue the tail to: the mount has no tongue, and of the jaw's "
        f"face the tail lies on {in_mm(max(0.0, room), 2)} mm. Lead it behind the jaw in a slack loop and fix it to "
        "the shaft, so that a pull on it does not reach the glue of the sensor."
    ).lstrip()
