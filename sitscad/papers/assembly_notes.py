"""How the sensor is put together, step by step, with the height to be measured after each: ``mount/assembly.txt``."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator

from sitscad.layout.board import Layout
from sitscad.parts.mould import LEAST_MIX, Pour, pour
from sitscad.scene.column import Levels, column, levels, plate_thickness
from sitscad.scene.fit import measures
from sitscad.scene.toleranced import Toleranced
from sitscad.units import in_mm

WIDTH = 96


def render(layout: Layout) -> dict[str, bytes]:
    """The text, numbered; nothing for a sensor without a mount."""
    return {} if layout.spec.mount is None else {"mount/assembly.txt": text(layout).encode("utf-8")}


def text(layout: Layout) -> str:
    """The whole page."""
    spec = layout.spec
    parts = [f"{spec.name}: how it is put together", "", *_wrapped("", _head(layout)), ""]
    for number, step in enumerate(_steps(layout), 1):
        parts += [*_wrapped(f"{number:>2}. ", step), ""]
    return "\n".join([*parts, *_checks(layout)]).rstrip("\n") + "\n"


def _wrapped(start: str, words: str) -> list[str]:
    return textwrap.wrap(words, WIDTH, initial_indent=start, subsequent_indent=" " * len(start))


def _head(layout: Layout) -> str:
    return (
        "Parts and quantities are in bom.csv. Work under a microscope, with gloves; clean metal and plastic with "
        "isopropanol. Wax the jig, or wipe it with mould release, so that no glue holds it. Lengths are in mm."
    )


def _steps(layout: Layout) -> Iterator[str]:
    spec, at = layout.spec, levels(column(layout))
    yield from _prepared(layout)
    yield "Lay the board, face with the coils up and tail in the slot, into the jig's base (jig-base)."
    if spec.elastomer is not None:
        yield _glued(layout, "elastomer", "the board", _above_board(at, "elastomer"))
    if spec.target is not None:
        under = "the elastomer" if spec.elastomer is not None else "the board"
        yield _glued(layout, "target", under, _above_board(at, "target"))
    yield (
        "Push the board out of the base from below, by the hole. Measure each coil's inductance and compare it with "
        "estimate.json before going on: a sensor that is wrong here is not mended in the jaw."
    )
    yield from _into_jaw(layout, at)
    yield from _sealed(layout)


def _prepared(layout: Layout) -> Iterator[str]:
    """Print, cut and cast."""
    spec, mount, poured = layout.spec, layout.spec.mount, pour(layout)
    assert mount is not None
    counts = (
        ""
        if mount.jaw is None
        else (
            " Measure each printed piece: its thickness counts in the closed pair; rub it down where it is too thick."
        )
    )
    yield f"Make the mount and the jig from mount/ ({mount.process}).{counts}"
    if poured is not None and spec.elastomer is not None:
        yield (
            "Cut the elastomer by laser/, or cast it: mix "
            f"{spec.elastomer.material.name} ({_amount(poured)}), take the air out of it, fill the cavities of "
            "mould-tray a little over, draw mould-lid over it from one side, weigh it down and let it cure as its "
            "maker says. "
            f"Choose a pad that is {_length(plate_thickness(spec, 'elastomer'))} thick."
        )


def _amount(poured: Pour) -> str:
    """How much is mixed, and how much of it the pads are."""
    pads = f"{1e6 * poured.pads * poured.pad:.2g} ml are the pads'"
    if poured.mixed < LEAST_MIX:
        return f"{1e6 * LEAST_MIX:g} ml, for less cannot be weighed out well; {pads}"
    return f"{1e6 * poured.mixed:.2g} ml; {pads}"


def _glued(layout: Layout, part: str, under: str, height: Toleranced | None) -> str:
    """One piece glued on another in the jig."""
    assembly = layout.spec.assembly
    glue = assembly.adhesive
    dries = glue is not None and glue.primer and layout.spec.elastomer is not None
    primer = f", once {glue.primer.partition(' on ')[0]} has dried on the silicone" if glue and dries else ""
    name = glue.product if glue is not None else "glue"
    line = f"{in_mm(assembly.glue_line)} +-{in_mm(assembly.glue_tolerance)} mm"
    measured = "" if height is None else f" From the board's top face to its upper face are {_length(height)} then."
    return (
        f"Put the frame jig-{part} on the base: it goes on one way only. Wet {under} with a thin film of "
        f"{name}{primer}, drop the {part} into the well, and press with jig-{part}-press until its collar lies on the "
        f"frame: the glue line is {line}. Let it set, lift press and frame.{measured}"
    )


def _above_board(at: Levels, part: str) -> Toleranced | None:
    """How high a piece's upper face is above the board's top face; None where no closed pair says it."""
    return at[part][1] - at["board"][1] if part in at and "board" in at else None


def _into_jaw(layout: Layout, at: Levels) -> Iterator[str]:
    mount = layout.spec.mount
    assert mount is not None
    glued = [layer for layer in column(layout) if layer.is_glue]
    below = [layer.part.removeprefix("glue under the ") for layer in glued]
    order = below[: below.index("board") + 1] if "board" in below else []
    if not order:
        if mount.kind == "bench-plate":
            yield "Screw the mount down with four M2 screws and lay the board into its recess, tail in the slot."
        return
    metal = at["jaw"][1]
    heights = ", ".join(f"{part} {_length(at[part][1] - metal)}" for part in order)
    yield (
        f"Degrease the jaw's face. Glue on it, in this order: {', '.join(order)}, the board against the stop at the "
        f"tip; press each until it is as high above the jaw's metal as this: {heights}."
    )
    yield (
        "Bend the tail only where the drawing of the board has its bend zone, and fix it to the jaw behind the body, "
        "so that a pull on it does not reach the glue."
    )


def _sealed(layout: Layout) -> Iterator[str]:
    film, mount = layout.spec.encapsulation, layout.spec.mount
    if film is not None:
        yield (
            f"Seal board, elastomer and target with {in_mm(film.thickness)} mm of {film.material.name}, the contacts "
            "masked; no copper may be left open. Let it cure."
        )
    closes = (
        ""
        if mount is None or mount.jaw is None
        else (" Close the jaws: they must close without force, and pass a gauge as wide as the port.")
    )
    yield f"Measure each coil again.{closes}"


def _checks(layout: Layout) -> list[str]:
    """What the finished sensor measures."""
    pair = next(iter(measures(layout)), None)
    if pair is None:
        return []
    words = (
        f"Closed without force, the pair needs a circle of {pair.nominal * 1e3:.3f} mm as drawn, of "
        f"{pair.worst * 1e3:.3f} mm with every tolerance against you; the port has {in_mm(pair.limit)} mm. Measure "
        "back to back before you order many."
    )
    rows = [f"  {layer.part:<28}{_length(layer.thickness)}" for layer in column(layout)]
    return [*_wrapped("", words), "", "From the jaw's back to the other jaw's:", *rows]


def _length(size: Toleranced) -> str:
    return f"{size.nominal * 1e3:.3f} +-{size.spread * 1e3:.3f} mm"
