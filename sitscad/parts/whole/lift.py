"""By how much glue lifts every piece: solids are drawn where the pieces alone would stand, and moved here."""

from __future__ import annotations

from dataclasses import replace

from sitscad.layout.board import Layout
from sitscad.parts.extras import require
from sitscad.parts.prism import MM
from sitscad.parts.solid import Solid
from sitscad.scene.bodies import MOUNT_PIECES, board_heights, seat_spans, shield_heights, target_lines
from sitscad.scene.column import column, levels
from sitscad.scene.jaws import shield_that_fits


def glued(layout: Layout, solids: tuple[Solid, ...]) -> tuple[Solid, ...]:
    """The solids lifted by the glue lines below them, the board staying where it is."""
    bd = require("build123d")
    lifts = _lifts(layout)
    return tuple(
        replace(s, shape=s.shape.moved(bd.Location((0, 0, lifts.get(s.name, 0.0) * MM)))) if lifts.get(s.name) else s
        for s in solids
    )


def _lifts(layout: Layout) -> dict[str, float]:
    """By how much glue lifts every piece (m): its lower face in the plane tier, less that of the solids."""
    at = levels(column(layout))
    if not at:
        return _on_the_bench(layout)
    board = at["board"][0].nominal - board_heights(layout.spec)[0]
    stands = {part: lower.nominal - board for part, (lower, _) in at.items()}
    bare = _bare_heights(layout)
    found = {part: stands[part] - lower for part, lower in bare.items() if part in stands}
    return found | {"encapsulation": found.get("target", found.get("elastomer", 0.0))}


def _on_the_bench(layout: Layout) -> dict[str, float]:
    """The same (m) without a jaw: glue is under the pad and the target, under the board, and round a shield."""
    spec = layout.spec
    line, all_lines, sheet = spec.assembly.glue_line, target_lines(spec), shield_heights(spec)
    above = all_lines or line * (spec.elastomer is not None)
    below = 0 if sheet is None else 1 + (board_heights(spec)[0] - sheet[1] > SPACED)
    found = {"elastomer": line, "target": all_lines, "encapsulation": above, "opposing-jaw": above}
    spacer = {MOUNT_PIECES[1]: -line, "shield": -line * below} if below else {}
    return found | dict.fromkeys(("mount-adapter", MOUNT_PIECES[0]), -line * (1 + below)) | spacer


SPACED = 1e-9
"""A shield farther from the board than this (m) has a spacer on it."""


def _bare_heights(layout: Layout) -> dict[str, float]:
    """The lower faces (m) of the pieces alone."""
    spec = layout.spec
    bottom, here = board_heights(spec)[0], 0.0
    found = {"board": bottom}
    mount = spec.mount
    assert mount is not None and mount.jaw is not None
    sheet = shield_that_fits(spec)
    for name, (lower, _) in zip(MOUNT_PIECES, seat_spans(bottom, mount.standoff, sheet), strict=False):
        found[name] = lower
    levels_of_sheet = shield_heights(spec)
    if levels_of_sheet is not None:
        found["shield"] = levels_of_sheet[0]
    found["jaw"] = bottom - mount.standoff - mount.jaw.height
    above = (
        ("elastomer", spec.elastomer.thickness if spec.elastomer else None),
        ("target", spec.target.thickness if spec.target else None),
        ("encapsulation", spec.encapsulation.thickness if spec.encapsulation else None),
        ("opposing-pad", mount.jaw.opposing_pad_thickness or None),
        ("opposing-jaw", mount.jaw.height),
    )
    for name, thickness in above:
        if thickness is not None:
            found[name] = here
            here += thickness
    return found
