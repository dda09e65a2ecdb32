"""SIT131: the stack-up, finish, stiffener and number of boards against what the fabricator offers at all."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from sitscad.checks.board.fabrication import FABRICATOR, house, source_of
from sitscad.checks.cases import Case
from sitscad.checks.rules import Complaint, Rule, Undecided, Verdict
from sitscad.design import Design
from sitscad.finding import Severity
from sitscad.spec import presets
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.stackup import MASK, CopperLayer, LayerKind, Stackup
from sitscad.units import show

ALIKE = 0.1
"""Films and foils that differ by less than this part are the same: fabricators' own tolerance of films is 10 %."""

GLUES = ("adhesive", "bondply")
"""Dielectrics that bond: not the core that copper comes on."""


def offered(design: Design) -> Iterator[Verdict]:
    """What the board is made of, against what the fabricator lists; what nobody states is not judged."""
    spec = design.spec
    rules, fpc = spec.fpc.rules, spec.fpc
    stated = (rules.layer_counts, rules.foils, rules.cores, rules.covers, rules.stiffeners, rules.finishes)
    if all(each is None for each in stated) and rules.order_multiple == 1:
        yield Undecided(f"{rules.name} does not state which stack-ups, finishes and stiffeners are offered")
        return
    refused = list(_refused(fpc.stackup, rules))
    hint = _other_stackup(rules) if refused else ""
    for field, word, measured, asked in refused:
        yield _complaint(design, "fpc.stackup", field, word, asked, hint, measured)
    if rules.finishes is not None and fpc.finish not in rules.finishes:
        hint = f"fpc.finish: {rules.finishes[0]}, or another fabricator" if rules.finishes else ANOTHER
        yield _complaint(design, "fpc.finish", "finishes", "contacts", fpc.finish, hint)
    plate = design.layout.stiffener
    if plate is not None and rules.stiffeners is not None and plate.material not in rules.stiffeners:
        yield _complaint(design, "fpc.tail", "stiffeners", "stiffener", plate.material, STIFF)
    if fpc.boards is not None and fpc.boards % rules.order_multiple:
        more = -(-fpc.boards // rules.order_multiple) * rules.order_multiple
        yield ODD_NUMBER.found("fpc.boards", float(fpc.boards), float(more), source=source_of(design, "order_multiple"),
                               boards=fpc.boards, more=more, house=house(design, "order_multiple"),
                               multiple=rules.order_multiple)


def _complaint(
    design: Design, key: str, field: str, word: str, asked: str, hint: str, measured: float | None = None
) -> Complaint:
    listed = getattr(design.spec.fpc.rules, field)
    found = NOT_OFFERED.found(key, measured, source=source_of(design, field), hint=hint, asked=f"{word}: {asked}",
                              house=house(design, field), offered=_words(listed) or "none")
    return found if measured is None or field == "layer_counts" else replace(found, unit="m")


def _refused(stackup: Stackup, rules: DesignRules) -> Iterator[tuple[str, str, float | None, str]]:
    """What of a stack-up the fabricator does not offer: the field, what it is, its figure, and the same in words."""
    count = len(stackup.copper)
    if rules.layer_counts is not None and count not in rules.layer_counts:
        yield "layer_counts", "copper layers", float(count), str(count)
    if rules.foils is not None:
        for foil, plated in dict.fromkeys((_foil(stackup, layer), layer.plated) for layer in stackup.copper):
            if not _is_listed(foil, rules.foils):
                is_known = plated > 0.0 and stackup.is_plating_stated
                made = f" (finished {show(foil + plated, 'm')}, of which {show(plated, 'm')} are plated on)" * is_known
                yield "foils", "copper foil", foil, show(foil, "m") + made
    films = [layer for layer in stackup.layers if layer.kind is LayerKind.DIELECTRIC and layer.material not in GLUES]
    if rules.cores is not None:
        for thickness in dict.fromkeys(film.thickness for film in films if not _is_listed(film.thickness, rules.cores)):
            yield "cores", "film between copper", thickness, show(thickness, "m")
    if rules.covers is not None:
        covers = [layer for layer in stackup.layers if layer.kind is LayerKind.COVERLAY]
        for kind in dict.fromkeys(MASK if layer.material == MASK else "film" for layer in covers):
            if kind not in rules.covers:
                yield "covers", "cover", None, kind


def _foil(stackup: Stackup, layer: CopperLayer) -> float:
    """The foil (m) that a layer is ordered as; all of its copper where it is not stated how much of it is plated."""
    return layer.foil if stackup.is_plating_stated else layer.thickness


def _is_listed(thickness: float, listed: Sequence[float]) -> bool:
    return any(abs(thickness - each) <= ALIKE * each for each in listed)


def _other_stackup(rules: DesignRules) -> str:
    """The installed stack-ups that the fabricator does offer, or what else there is to do."""
    good = [name for name in presets.names("stackup") if not any(_refused(presets.stackup(name), rules))]
    return f"fpc.stackup: {' or '.join(good)} is offered; or {ANOTHER}" if good else ANOTHER


def _words(listed: Sequence[object]) -> str:
    return ", ".join(show(each, "m") if isinstance(each, float) else str(each) for each in listed)


ANOTHER = "another fabricator (fpc.rules); where yours has told you that it is made, say so in a profile of your own"

STIFF = (
    "contacts for solder need none (fpc.tail.connector: solder-pads); or take another fabricator (fpc.rules); where "
    "yours has told you that it is made, say so in a profile of your own"
)

NOT_OFFERED = Case("{asked}; {house} offers {offered}")

ODD_NUMBER = Case(
    "{boards} boards are wanted; {house} sells them in multiples of {multiple}", hint="fpc.boards: {more}",
    severity=Severity.WARNING,
)


OFFER_RULES: tuple[Rule, ...] = (
    Rule(
        "SIT131", "offered", Severity.ERROR,
        "Stack-up, cover, finish, stiffener and number of boards are among those that the fabricator offers.",
        "A service that makes every board in one way makes this one in that way too, whatever the papers ask for: "
        "coils on another film or in other copper have another inductance and resistance. Only what the profile states "
        "is judged.",
        "Take a stack-up that they list, or a fabricator who makes yours; or state in a profile what you were told.",
        FABRICATOR, apply=offered,
    ),
)
