"""Steps of the assembly that depend on what carries the sensor and on how it is sealed."""

from __future__ import annotations

from collections.abc import Iterator

from sitscad.fabrication.notes import bend_words
from sitscad.layout.board import Layout
from sitscad.layout.tail.bending import bend_of
from sitscad.parts.mounts.screws import adapter_needed
from sitscad.parts.tooling.mould import LEAST_MIX, Pour
from sitscad.parts.tooling.skin_mould import skin_pour
from sitscad.scene.grasper.seating import joint_clearance, relief, retention, tongue_across
from sitscad.spec.sensor import Encapsulation
from sitscad.units import in_mm

LEAST_FIXED = 3e-3
"""How much of a tail (m) is glued to the jaw where nothing else holds it."""


def jaw_cut(layout: Layout) -> Iterator[str]:
    """What is cut into the jaw for a dovetail or pins."""
    found, mount = retention(layout), layout.spec.mount
    if found is not None and mount is not None and mount.jaw is not None:
        room = joint_clearance(layout)
        if found.kind == "dovetail":
            bottom, top, depth = tongue_across(found, room)
            yield (
                f"Mill the dovetail's groove into the jaw's face, open at the tip: {2e3 * bottom:.2f} mm wide at its "
                f"bottom, {2e3 * top:.2f} mm at the face, {depth * 1e3:.2f} mm deep, as far as the jaw's STEP file has "
                "it. The mount slides in from the tip up to the groove's end."
            )
        else:
            yield (
                f"Drill two holes of {1e3 * (found.diameter + 2.0 * room):.2f} mm through the jaw, "
                f"{in_mm(found.spacing or 0.0)} mm apart along its middle, where the STEP file of the jaw has them."
            )


def tail_held(layout: Layout, glue: str) -> str:
    """How the tail is bent, and where a pull on it ends: on the mount's tongue, else on the jaw."""
    said = _bend(layout)
    if relief(layout) is None:
        return (
            f"{said} Fix the tail with {glue} to the jaw's metal behind the body, over at least "
            f"{in_mm(LEAST_FIXED)} mm, so that a pull on it does not reach the glue of the sensor (the mount has no "
            "tongue for it: between body and heel of the jaw is no room)."
        )
    return (
        f"Glue the tail down with {glue} on the mount's tongue behind the body, over the tongue's whole length: a pull "
        f"on it ends there. {said}"
    )


def _bend(layout: Layout) -> str:
    """Where, how far and how sharply the tail is bent."""
    bend, mount = bend_of(layout), layout.spec.mount
    if bend is None:
        return "Do not bend the tail."
    radius = "" if bend.radius is None else f", inside radius {in_mm(bend.radius)} mm or more"
    away = in_mm(bend.line - layout.body[2], 2)
    said = (
        f"Bend the tail by {bend_words(bend)}{radius}, about the line {away} mm behind the body, and "
        "only where the drawing of the board has its bend zone."
    )
    if mount is None or mount.jaw is None or mount.jaw.hinge is None or bend.is_dynamic:
        return said
    return f"{said} In a jaw that moves against the shaft it bends at every grasp: that wants fpc.tail.bend: dynamic."


def fastened(layout: Layout) -> Iterator[str]:
    """How a plate, a cap or a part of the user's own is put on."""
    mount = layout.spec.mount
    if mount is None:
        return
    if mount.finger is not None:
        screw = f"M{in_mm(mount.finger.screw)}"
        yield (
            f"Tap both holes in the cap's sides {screw}. Glue the board into its recess, the tail over the round lip. "
            f"Slip the cap over the finger and clamp it by two {screw} set screws of plastic or brass: steel is seen."
        )
    elif mount.kind == "custom":
        yield "Put the board on your own mount, and glue its whole body down."
    elif mount.holes is not None and adapter_needed(layout):
        yield (
            f"Screw mount-adapter on ({mount.holes.name}, {len(mount.holes.holes)} screws, their heads sunk). Lay four "
            "M2 nuts into it from below first; they hold the mount's four screws."
        )
        yield "Screw the mount on the adapter and glue the board into its recess, tail in the slot."
    elif mount.holes is not None:
        screws = f" {mount.holes.thread} screws" if mount.holes.thread else " screws"
        yield f"Screw the mount down ({mount.holes.name},{screws}) and lay the board into its recess, tail in the slot."


def skin(layout: Layout, film: Encapsulation) -> str:
    """How the film is put on: cast in its mould, or by hand where it is too thin for one."""
    poured = skin_pour(layout)
    if poured is None:
        return (
            f"Seal board, elastomer and target with {in_mm(film.thickness)} mm of {film.material.name}, brushed on or "
            "dipped, the contacts masked; no copper may be left open. Let it cure. Measure the sensor's height before "
            "and after: a coat that is too thin is given another, of silicone thinned as its maker says."
        )
    sealed = " (its print sealed as said above)" if cures_badly(layout) else ""
    return (
        f"Cast the skin: mix {film.material.name} ({amount(poured)}), fill mould-skin{sealed} lying open, take the "
        "air out, and put the jig's base with the sensor on it face down, so that its pins go into the cup; weigh it "
        "down. What is too much leaves by the grooves. Let it cure, lift the cup off, cut the flash at the grooves."
    )


def cures_badly(layout: Layout) -> bool:
    """Whether the moulds are of photopolymer, on which platinum-cure silicones may stay liquid."""
    return layout.spec.mount is not None and layout.spec.mount.process == "resin"


RAW_RESIN = (
    "Moulds printed in resin, before anything is cast in them: platinum-cure silicones (Ecoflex, Dragon Skin) may not "
    "cure on raw photopolymer. Wash the print, cure it fully under UV and then with heat, seal it (clear acrylic "
    "lacquer, or the barrier coat that the silicone's maker names), let that dry, and try a drop first; or print the "
    "mould in filament or powder. (Lacquer and trial are in Smooth-On's bulletin on Dragon Skin; the rest is general "
    "practice, unverified.)"
)
"""What a mould of resin needs before silicone is poured into it."""


def amount(poured: Pour) -> str:
    """How much is mixed, and how much of it the pieces are."""
    pieces = "the pads'" if poured.pads > 1 else "the piece's"
    own = f"{1e6 * poured.pads * poured.pad:.2g} ml are {pieces}"
    if poured.mixed < LEAST_MIX:
        return f"{1e6 * LEAST_MIX:g} ml, for less cannot be weighed out well; {own}"
    return f"{1e6 * poured.mixed:.2g} ml; {own}"
