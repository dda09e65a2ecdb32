"""SIT314: are the mount's pieces thick enough to be made."""

from __future__ import annotations

from collections.abc import Iterator

from sitscad.checks.assembly.fit import ROUNDING
from sitscad.checks.cases import Case
from sitscad.checks.rules import Rule, Verdict
from sitscad.design import Design
from sitscad.finding import Severity
from sitscad.scene.bodies import MOUNT_PIECES, board_heights, seat_spans
from sitscad.scene.grasper.jaws import PartsError, shield_that_fits
from sitscad.scene.printing import print_limit
from sitscad.spec.sensor import Mount, SensorSpec


def printed_wall(design: Design) -> Iterator[Verdict]:
    """The mount's pieces are thick enough to be made."""
    mount = design.spec.mount
    assert mount is not None
    limit = print_limit(mount.process, "wall")
    for name, thickness, is_spacer in _pieces(design.spec, mount):
        if thickness < limit.value - ROUNDING:
            yield TOO_THIN_TO_PRINT.found(
                "shield.gap" if is_spacer else "mount.standoff",
                thickness,
                limit.value,
                "m",
                hint=_thicker(design.spec, is_spacer, limit.value),
                source=limit.source,
                name=name,
                process=mount.process,
            )


def _pieces(spec: SensorSpec, mount: Mount) -> list[tuple[str, float, bool]]:
    """The printed pieces under the board, each with its thickness, and whether it lies between shield and board; a
    bench plate's floor has a least thickness of its own, and a mount of one's own is as it is.
    """
    try:
        sheet = shield_that_fits(spec)
    except PartsError:
        return []
    spans = seat_spans(board_heights(spec)[0], mount.standoff, sheet)
    found = [
        (name, upper - lower, sheet is not None and lower > sheet[0])
        for name, (lower, upper) in zip(MOUNT_PIECES, spans, strict=False)
    ]
    if mount.kind == "custom":
        return []
    return [piece for piece in found if mount.kind != "bench-plate" or piece[2]]


def _thicker(spec: SensorSpec, is_spacer: bool, wall: float) -> str:
    """How the piece is made thick enough, or left out."""
    if spec.shield is None:
        return f"mount.standoff: {wall * 1e3:.6g}, or 0: the board on the metal itself (SIT201 to SIT203 judge that)"
    on_metal = spec.shield.gap + spec.shield.thickness
    if is_spacer:
        return f"shield.gap: {wall * 1e3:.6g} or more"
    return (
        f"mount.standoff: {on_metal * 1e3:.6g} lays the shield on the metal, {(on_metal + wall) * 1e3:.6g} leaves room "
        "for a piece that can be made"
    )


TOO_THIN_TO_PRINT = Case(
    "the {name} is {measured:m,3} thick, which {process} does not make: {limit:m,3} at least",
)


MOUNT_WALL_RULES: tuple[Rule, ...] = (
    Rule(
        "SIT314", "printed-wall", Severity.ERROR,
        "Each piece of the mount is as thick as its process (mount.process) can make it.",
        "A standoff a little larger than the shield needs prints a sheet of a few hundredths of a millimetre.",
        "A standoff that lays the shield on the metal, a larger one, or another process.",
        "sitscad/data/print_limits.csv", ("mount",), printed_wall,
    ),
)  # fmt: skip
