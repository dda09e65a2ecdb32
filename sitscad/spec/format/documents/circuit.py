"""The flexible circuit as it is written: stack-up, tail and its bend, panel."""

from __future__ import annotations

from typing import Any

from sitscad.spec.format.documents.fabricator import FINISHES, RulesChoice, RulesDocument
from sitscad.spec.format.kinds.kind import Either, Special
from sitscad.spec.format.kinds.number import Number
from sitscad.spec.format.kinds.preset import Preset
from sitscad.spec.format.kinds.quantity import Pair, Quantity
from sitscad.spec.format.kinds.refusal import described, refuse
from sitscad.spec.format.kinds.word import Choice
from sitscad.spec.format.section import ListOf, NameOr, Part, Section, key
from sitscad.spec.stackup import Plating

InRow = Number(1, 64, whole=True)


def _columns_and_rows(value: Any) -> tuple[int, ...]:
    if not isinstance(value, list) or len(value) != 2:
        refuse("SIT004", f"{described(value)}, where [columns, rows] is wanted", "write [2, 5], or auto")
    return tuple(int(InRow.read(entry)) for entry in value)


PAIR_OF_COUNTS = {"type": "array", "items": InRow.schema(), "minItems": 2, "maxItems": 2}
Margin = Pair(Quantity("length", "0 mm", "100 mm"), single=True)
Run = Quantity("length", "1 mm", "5000 mm")
Offset = Quantity("length", "-500 mm", "500 mm")
TurnRadius = Quantity("length", "0.1 mm", "100 mm")
BendAngle = Quantity("angle", "1 deg", "180 deg")
PanelGap = Quantity("length", "0.5 mm", "20 mm")
Rail = Quantity("length", "3 mm", "30 mm")
Bridge = Quantity("length", "0.2 mm", "3 mm")
BoardCount = Number(1, 100_000, whole=True)
PartCount = Either("auto", Special(_columns_and_rows, PAIR_OF_COUNTS))


class BendDocument(Section):
    """How the tail is bent: about a line across it."""

    kind: str = key(Choice(("static", "dynamic")), "static: bent once at assembly; dynamic: bends in use", "static")
    at: float | None = key(
        Run, "from the sensor's body to the bend's middle line; if left out, the pivot of the jaw's hinge where the "
        "bend has room there, else the middle of the stretch that may be bent", None,
    )  # fmt: skip
    direction: str = key(Choice(("down", "up")), "down: away from the face with the coils; up: towards it", "down")
    angle: float | None = key(
        BendAngle,
        "out of the plane; if left out, half of the opening of a jaw with a hinge, 0 on a finger's cap, else 90 deg",
        None,
    )
    radius: float | None = key(TurnRadius, "inside; the fabricator's least if left out", None)


BendChoice = NameOr(Choice(("none", "static", "dynamic")), Part(BendDocument))


class TailDocument(Section):
    """The strip that leads to the converter."""

    length: float = key(Run, "from the sensor's body to the end", 30)
    connector: str = key(Preset("connector"), "what the tail ends in", "zif-0.5mm")
    contacts: int | None = key(
        Number(2, 200, whole=True), "of the connector that is bought: the fewest that are enough if left out", None
    )
    stiffener: float | None = key(
        Quantity("length", "10 um", "2 mm"),
        "thickness with its adhesive, under contacts that are plugged in: the best of the stock ones if left out",
        None,
    )
    layers: int | None = key(
        Number(1, 8, whole=True),
        "copper layers that run down it; all of the body's if left out. Fewer bend more tightly and are a build of "
        "their own (SIT132)",
        None,
    )
    bend: str | BendDocument = key(
        BendChoice, "static: bent once at assembly; dynamic: bends in use; none; or a section with line and angle",
        "static",
    )  # fmt: skip
    turn: str = key(
        Choice(("none", "left", "right")), "by 90 degrees in its plane before the contacts, seen from the coils", "none"
    )
    offset: float = key(Offset, "or led aside by so much before the contacts, to the left; negative: right", 0)
    turn_radius: float | None = key(TurnRadius, "of the turn's inner edge: 2 mm, or the fabricator's least", None)


class LayerDocument(Section):
    """One layer of a stack-up: exactly one of coverlay, copper and dielectric, with its thickness."""

    coverlay: float | None = key(Quantity("length", "1 um", "2 mm"), "thickness", None)
    copper: float | None = key(Quantity("length", "1 um", "1 mm"), "finished thickness, foil and plating", None)
    dielectric: float | None = key(Quantity("length", "1 um", "5 mm"), "thickness", None)
    material: str | None = key(
        Preset("dielectric"), "of a dielectric or coverlay; polyimide and polyimide-coverlay if left out", None
    )
    permittivity: float | None = key(Number(1, 100), "relative, if not the material's", None)


StackupChoice = NameOr(Preset("stackup"), ListOf(Part(LayerDocument)))


class PanelDocument(Section):
    """A panel, whatever the part's size."""

    parts: tuple[int, int] | None = key(
        PartCount, "[columns, rows] of at most 500 boards, or auto: as many as fit the fabricator's panel", "auto"
    )
    gap: float = key(PanelGap, "between parts", 2)
    rail: float = key(Rail, "width of the frame", 5)
    bridge: float = key(Bridge, "width of what holds a part in its place", 0.5)


PanelChoice = NameOr(Choice(("auto", "none")), Part(PanelDocument))


class FpcDocument(Section):
    """The flexible printed circuit."""

    stackup: str | list[LayerDocument] | None = key(
        StackupChoice,
        "a preset (30um is its finished copper), or the layers from top to bottom; flex-2l-30um, flex-4l, flex-6l or "
        "flex-8l, after the coil's layers, if left out",
        None,
    )
    plating: float | None = key(
        Quantity("length", "1 um", "100 um"),
        "in the holes, one step of it: a preset's foils get thicker by it, of copper that is written out it is a part; "
        "the preset's own, or 12 um, if left out",
        None,
    )
    plated: str | None = key(
        Choice(tuple(Plating)),
        "what is plated with the holes. panel: all outer copper before it is etched; pattern: the tracks, on foil that "
        "is etched afterwards; buttons: holes and their pads alone, so that tracks stay foil. If left out as the "
        "preset has it, of written layers panel",
        None,
    )
    rules: str | RulesDocument = key(
        RulesChoice, "a fabricator's design rules: a preset, a profile file, or written out", "generic-flex"
    )
    tail: TailDocument | None = key(Part(TailDocument), "none: solder pads at the outline", None)
    panel: str | PanelDocument = key(
        PanelChoice, "auto: when the part is too small to be made singly; none; or a section", "auto"
    )
    boards: int | None = key(
        BoardCount, "how many are wanted: the papers of the order then say how many panels that takes", None
    )
    margin: tuple[float, float] = key(
        Margin,
        "by how much the body is larger on each side than coils and leads need it; along and across: [x, y]. The body "
        "also grows until the mean of the coils' centres is its middle, as far as a jaw is long and wide",
        0,
    )
    teardrops: str = key(
        Choice(("auto", "none")), "auto: tracks widen towards vias and contacts wherever the rules leave room", "auto"
    )
    finish: str = key(Choice(FINISHES), "of the bare contacts", "enig")
    copper: str = key(Choice(("rolled-annealed", "electrodeposited")), "kind of the foil", "rolled-annealed")
