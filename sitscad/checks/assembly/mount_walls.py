"""SIT314 and SIT319: are the mount's pieces thick enough to be made, and does what is left of them carry the board."""

from __future__ import annotations

from collections.abc import Iterator

from sitscad.checks.assembly.fit import ROUNDING
from sitscad.checks.cases import Case
from sitscad.checks.rules import Rule, Undecided, Verdict
from sitscad.design import Design
from sitscad.finding import Severity
from sitscad.scene.bodies import MOUNT_PIECES, board_heights, seat_spans
from sitscad.scene.column import print_limit
from sitscad.scene.jaws import PartsError, fitted_jaw, shield_that_fits
from sitscad.scene.support import BODY, HALF_OF_IT, MOST_OF_IT, Support, support
from sitscad.spec.mount import Mount
from sitscad.spec.sensor import SensorSpec


def printed_wall(design: Design) -> Iterator[Verdict]:
    """The mount's pieces are thick enough to be made."""
    mount = design.spec.mount
    assert mount is not None
    limit = print_limit(mount.process, "wall")
    for name, thickness, is_spacer in _pieces(design.spec, mount):
        if thickness < limit.value - ROUNDING:
            yield TOO_THIN_TO_PRINT.found("shield.gap" if is_spacer else "mount.standoff", thickness, limit.value, "m",
                                          hint=_thicker(design.spec, is_spacer, limit.value), source=limit.source,
                                          name=name, process=mount.process)


def _pieces(spec: SensorSpec, mount: Mount) -> list[tuple[str, float, bool]]:
    """The printed pieces under the board, each with its thickness, and whether it lies between shield and board; a
    bench plate's floor has a least thickness of its own, and a mount of one's own is as it is.
    """
    try:
        sheet = shield_that_fits(spec)
    except PartsError:
        return []
    spans = seat_spans(board_heights(spec)[0], mount.standoff, sheet)
    found = [(name, upper - lower, sheet is not None and lower > sheet[0]) for name,
             (lower, upper) in zip(MOUNT_PIECES, spans, strict=False)]
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


def carried(design: Design) -> Iterator[Verdict]:
    """The board's body under what is pressed on lies on the mount, the shield or the metal."""
    mount = design.spec.mount
    assert mount is not None
    if mount.kind == "custom" and mount.step is None:
        yield Undecided("the mount is not part of the spec: nothing says what the board lies on")
        return
    try:
        found = support(design.layout)
    except PartsError:
        yield Undecided("the shield does not fit into the standoff")
        return
    if found is None:
        yield Undecided("a mount or a jaw that is a STEP file: SIT326 measures it on the solids")
    else:
        yield from _uncarried(found, _what_carries(design, mount))


def _uncarried(found: Support, hint: str) -> Iterator[Verdict]:
    """What of the board has nothing under it: where it is pressed on, else of all of it."""
    is_all = found.carried >= HALF_OF_IT * found.pressed and found.body_carried < HALF_OF_IT * found.body
    area, of = (found.body_carried, found.body) if is_all else (found.carried, found.pressed)
    if area >= MOST_OF_IT * of - ROUNDING**2 and not is_all:
        return
    yield NOT_CARRIED.found(
        "mount.standoff",
        area,
        (HALF_OF_IT if is_all else MOST_OF_IT) * of,
        "m2",
        hint=hint,
        is_grave=area < HALF_OF_IT * of,
        under=f"the {BODY}" if is_all else _under(found.name),
        carried=area * 1e6,
        whole=of * 1e6,
        besides=""
        if is_all or found.pressed == found.body
        else f" (of the whole body, on {found.body_carried * 1e6:.3g} of {found.body * 1e6:.3g} mm2)",
    )


def _under(name: str) -> str:
    """What is pressed on, as the message calls it."""
    return f"the {BODY}" if name == BODY else f"the board under the {name}"


def _what_carries(design: Design, mount: Mount) -> str:
    """What would put something under the board."""
    if mount.kind == "fingertip":
        return "mount.standoff: plastic between the finger and the board carries all of it"
    jaw = fitted_jaw(design.layout)
    if jaw is not None and not mount.standoff:
        return "mount.standoff: a seat bridges the jaw's window, and carries what stands beside its face"
    return (
        "the seat is cut back to the port and the pad pocket: a lower stack (a thinner elastomer, a smaller "
        "mount.standoff), which lays the board nearer to the closed pair's middle, a narrower board, or a wider jaw"
    )


NOT_CARRIED = Case(
    "{under} is carried on {carried:.3g} of its {whole:.3g} mm2{besides}; the rest has nothing under it",
    severity=Severity.WARNING, grave=Severity.ERROR,
)

TOO_THIN_TO_PRINT = Case("the {name} is {measured:m,3} thick, which {process} does not make: {limit:m,3} at least",)


MOUNT_WALL_RULES: tuple[Rule, ...] = (
    Rule(
        "SIT314", "printed-wall", Severity.ERROR,
        "Each piece of the mount is as thick as its process (mount.process) can make it.",
        "A standoff a little larger than the shield needs prints a sheet of a few hundredths of a millimetre.",
        "A standoff that lays the shield on the metal, a larger one, or another process.",
        "sitscad/data/print_limits.csv", ("mount",), printed_wall,
    ),
    Rule(
        "SIT319", "board-support", Severity.ERROR,
        "Nine tenths of the board under the elastomer (under the target, or of the body, where there is none) lie on "
        "the mount, the shield or the jaw (a warning); less than half of it, or of the whole body, is an error.",
        "A seat that the port or the pad pocket cuts back to a narrow bar holds nothing: the board bends over it, and "
        "what is felt is the board's bending. A strip of a tenth at the edges bends by micrometres.",
        "A lower stack, a narrower board, a wider jaw; a seat where the board lies on a jaw's window.",
        "geometry: areas from above, the seat as the port leaves it", ("mount",), carried,
    ),
)
