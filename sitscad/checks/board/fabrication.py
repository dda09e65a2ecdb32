"""SIT101 to SIT106, SIT116, SIT131, SIT137 and SIT138: tracks, gaps, holes, parts and materials that can be made.

The limits are the fabricator's. SIT137 and SIT138 check the materials of the stack-up's layers and the adhesive of its
coverlays.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import combinations, islice

from sitscad.basics.finding import Place, Severity
from sitscad.basics.units import show
from sitscad.checks.fixes.moves import each_read, finer_fabricators, plated_in_holes_alone, read_anew, wider
from sitscad.checks.fixes.search import Family, Fix
from sitscad.checks.rules import ROUNDING, Rule, Undecided, Verdict, Violation, rule_of
from sitscad.data import is_unverified
from sitscad.estimates.design import Design
from sitscad.layout.board import Via
from sitscad.layout.panel import FEWEST_BRIDGES, bridges, is_wanted, least_size, narrower_bridge
from sitscad.spec import presets
from sitscad.spec.circuit import MASK, FpcSpec, LayerKind, StackLayer, Stackup
from sitscad.spec.coil import CoilSpec
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.profiles import installed_rules
from sitscad.spec.sensor import SensorSpec


def via_drill(vias: tuple[Via, ...], rules: DesignRules) -> Iterator[Verdict]:
    """Yield findings on drills smaller than the fabricator's smallest."""
    for via in vias:
        if via.drill < rules.via_drill - ROUNDING:
            yield Violation(
                f"a via of {via.net} is drilled {show(via.drill, 'm')}; {house(rules, 'via_drill')} drills "
                f"{show(rules.via_drill, 'm')} and larger", "", "fpc.rules", via.drill, rules.via_drill, "m",
                source=rules.source_of("via_drill"), place=Place(*via.centre, nets=(via.net,)),
            )


def annular_ring(vias: tuple[Via, ...], rules: DesignRules) -> Iterator[Verdict]:
    """Yield findings on the ring of copper around each drill."""
    for via in vias:
        ring = (via.pad - via.drill) / 2.0
        if ring < rules.annular_ring - ROUNDING:
            yield short_of(
                rules, "annular_ring", ring, f"a via of {via.net} has an annular ring of {show(ring, 'm')}",
                f"a pad of {show(via.drill + 2.0 * rules.annular_ring, 'm')} is needed", "fpc.rules",
                Place(*via.centre, nets=(via.net,)),
            )


def hole_to_hole(vias: tuple[Via, ...], rules: DesignRules) -> Iterator[Verdict]:
    """Yield findings on the wall between each pair of drilled holes."""
    for via, other in combinations(vias, 2):
        wall = via.centre.distance(other.centre) - (via.drill + other.drill) / 2.0
        if wall < rules.hole_to_hole - ROUNDING:
            yield short_of(
                rules, "hole_to_hole", wall, f"two holes ({via.net}, {other.net}) leave {show(wall, 'm')} between them",
                f"move them {show(rules.hole_to_hole - wall, 'm')} apart: a larger inner diameter gives the room",
                "coil.turns", Place((via.centre.x + other.centre.x) / 2.0, (via.centre.y + other.centre.y) / 2.0,
                                    nets=tuple(sorted({via.net, other.net}))),
            )


def part_size(design: Design) -> Iterator[Verdict]:
    """Yield findings on an outline smaller than the smallest part that the fabricator handles."""
    rules, in_panel = design.spec.fpc.rules, is_wanted(design.layout)
    board = design.layout.size
    (width, length), least = sorted(board), sorted(rules.part_size)
    short = next(((size, limit) for size, limit in zip((width, length), least, strict=True)
                  if size < limit - ROUNDING), None)
    if short is not None:
        side = "shorter" if short[0] == width else "longer"
        said = (
            f"the board is {_sides(board)}: its {side} side is below the {show(short[1], 'm')} of the smallest part "
            f"that {house(rules, 'part_size')} handles singly ({_sides(least)})"
        )
        severity, hint = Severity.NOTE, "have that confirmed with the quotation; fpc.panel: auto draws the panel"
        if rules.one_process:  # this service takes no special requests
            severity, hint = Severity.WARNING, "fpc.panel: auto puts it in a panel, held by bridges"
        own = f"{said}; because of fpc.panel: none the order asks for delivery in the fabricator's own panel"
        in_a_panel = partial(each_read, design.spec, "fpc.panel", ["auto"])
        found = Violation(own, hint, "fpc.panel", *short, "m", severity, rules.source_of("part_size"),
                          fixes=(in_a_panel,) if rules.one_process else ())
        name = design.spec.name
        yield found if not in_panel else replace(
            found, message=f"{said}; a panel is ordered instead, in which it is put", key="fpc.rules",
            hint=f"send fpc/{name}-order.zip, which holds the panel and not the single board (its drawing is "
            f"fpc/panel/{name}-panel-drawing.pdf), and cut the parts out yourself", severity=Severity.NOTE,
        )
    if in_panel:
        size, wish = least_size(design.layout.size, design.layout.spec.fpc.panel), design.spec.fpc.panel
        fewer = "fewer parts in a panel (fpc.panel.parts), " if math.prod(wish.parts or (1, 1)) > 1 else ""
        yield from _panel_size(
            rules, size, Violation(f"the panel is at least {_sides(size)}",
                                    f"use {fewer}a shorter tail, or fpc.panel: none", "fpc.panel"))
        yield from _too_few_bridges(design)
    else:
        yield from _panel_size(
            rules, board,
            Violation(f"the board is {_sides(board)}",
                      "use a smaller board or a shorter tail, or a fabricator of larger panels", "fpc.rules"),
            ", out of which a board that is sold singly is cut, too", is_panel=False)


def _too_few_bridges(design: Design) -> Iterator[Verdict]:
    """Yield a finding if too few bridges fit on the part's edge to hold it in its panel, because they are too wide."""
    layout, width = design.layout, design.spec.fpc.panel.bridge
    count = len(bridges(layout))
    if count < FEWEST_BRIDGES:
        least = narrower_bridge(layout)
        held = {0: "no bridge holds", 1: "only 1 bridge holds"}.get(count, f"only {count} bridges hold")
        yield Violation(
            f"{held} the part in its panel: the edge has no more places for bridges {show(width, 'm')} wide off "
            f"contacts, stiffener and bend; {FEWEST_BRIDGES} are needed",
            f"fpc.panel.bridge: {least * 1e3:.1f}, which finds places enough" if least
            else "no narrower bridge finds places enough either: a larger board, or fpc.panel: none",
            "fpc.panel.bridge", float(count), float(FEWEST_BRIDGES), severity=Severity.ERROR,
            source="two bridges are a hinge, three hold a part in its plane",
            fixes=(partial(each_read, design.spec, "fpc.panel.bridge", [round(least * 1e3, 1)] if least else []),
                   partial(each_read, design.spec, "fpc.panel", ["none"])),
        )


def _panel_size(
    rules: DesignRules, size: tuple[float, float], found: Violation, more: str = "", is_panel: bool = True
) -> Iterator[Verdict]:
    """Yield a violation if a delivered part or panel (m) is larger than the fabricator's panel.

    A profile's choice of a convenient panel is no limit. A larger panel gets a note, and only beyond the largest part
    that is made a warning.
    """
    is_choice = is_unverified(rules.source_of("panel_size"))
    for field in ("largest_part", "panel_size") if is_choice else ("panel_size",):
        limits = getattr(rules, field)
        beyond = ((own, most) for own, most in zip(sorted(size), sorted(limits), strict=True) if own > most + ROUNDING)
        side, largest = next(beyond, (None, None))
        if side is None or (is_choice and field == "panel_size" and not is_panel):
            continue
        severity, source = Severity.WARNING, rules.source_of(field)
        makes = f"{house(rules, field)} makes panels of at most {_sides(limits)}{more}"
        if is_choice and field == "panel_size":
            severity, most = Severity.NOTE, rules.largest_part
            makes = f"usual are at most {_sides(limits)}"
            agreed = f"{house(rules, 'largest_part')} makes at most {_sides(most)} by agreement"
            found = replace(found, hint="have its size, which the order states, confirmed with the quotation: "
                            f"{agreed}; or {found.hint}")
        yield replace(found, message=f"{found.message}; {makes}", measured=side, limit=largest, unit="m",
                      severity=severity, source=source)
        return


def _sides(size: Sequence[float]) -> str:
    """Both sides (m) of a rectangle, the longer side first."""
    return f"{show(max(size), 'm')} x {show(min(size), 'm')}"


def house(rules: DesignRules, field: str) -> str:
    """Return the holder of a limit: the profile's name, for a user's profile with file and line.

    Unverified limits are marked.
    """
    mark = " (unverified)" if is_unverified(rules.source_of(field)) else ""
    return rules.holder(field) + mark


def short_of(
    rules: DesignRules, field: str, have: float, what: str, hint: str, key: str, place: Place
) -> Violation:
    """Return the violation for a length (m) smaller than a limit of the fabricator's rules."""
    asked = getattr(rules, field)
    return Violation(f"{what}; {house(rules, field)} asks {show(asked, 'm')}", hint, key, have, asked, "m",
                     source=rules.source_of(field), place=place)


def gap_asked_by(rules: DesignRules, asked: float) -> tuple[str, str]:
    """Return the holder and the source of a gap between copper (m).

    These are the spec itself if the gap is the spacing of its turns and narrower than the fabricator's.
    """
    if asked < rules.trace_spacing - ROUNDING:
        return "the spec (coil.trace_spacing)", "coil.trace_spacing in the spec"
    return house(rules, "trace_spacing"), rules.source_of("trace_spacing")


NAMED = 4
"""Largest number of finer fabricators that a hint names."""

WAIVER = "ask the fabricator for a waiver (no electrical test sees a short between turns)"


def trace_width(design: Design) -> Iterator[Verdict]:
    """Yield findings on tracks narrower than the fabricator's smallest."""
    yield from _too_fine(design.spec, "trace_width", "tracks are {} wide", "wider")
    yield from _thicker_foil(design.spec.coil.layers, design.spec.fpc, "trace_width", "tracks")
    # Tracks drawn narrower than the fabricator makes, if the coil's own width is not the reason
    rules, coil = design.spec.fpc.rules, design.spec.coil
    for trace in design.layout.traces:
        if trace.width < min(rules.trace_width, coil.trace_width) - ROUNDING:
            yield Violation(
                f"the {trace.role.value} of {trace.net} on layer {trace.layer} is drawn {show(trace.width, 'm')} "
                f"wide; {house(rules, 'trace_width')} makes {show(rules.trace_width, 'm')} and wider", "", "fpc.rules",
                trace.width, rules.trace_width, "m", source=rules.source_of("trace_width"),
                place=Place(*trace.path.start, trace.layer, (trace.net,)),
            )


def _too_fine(spec: SensorSpec, field: str, asked: str, more: str) -> Iterator[Violation]:
    """Yield a violation if a value of the coil is below the fabricator's smallest."""
    value, least = getattr(spec.coil, field), getattr(spec.fpc.rules, field)
    if value < least - ROUNDING:
        yield Violation(
            f"{asked.format(show(value, 'm'))}; {house(spec.fpc.rules, field)} makes {show(least, 'm')} and {more}",
            lambda: f"widen tracks and gaps and wind fewer turns, or choose {_finer(spec)}",
            f"coil.{field}", value, least, "m", source=spec.fpc.rules.source_of(field), fixes=_widened(spec, field),
        )


def _thicker_foil(
    layers: tuple[int, ...], fpc: FpcSpec, field: str, word: str, severity: Severity = Severity.ERROR
) -> Iterator[Violation]:
    """Yield a violation if the foil is thicker than every foil for which the fabricator states line widths."""
    rules, foil = fpc.rules, fpc.stackup.line_foil(layers)
    stated = rules.beyond.get(field)
    if stated is not None:
        yield Violation(
            f"{house(rules, field)} gives no figure for {word} in {show(foil, 'm')} copper; the thickest stated is "
            f"{show(stated, 'm')}", f"ask the fabricator, and write {field} in fpc.rules; or choose thinner copper",
            "fpc.rules", foil, stated, "m", severity=severity, source=rules.source_of(field),
        )


def trace_spacing(design: Design) -> Iterator[Verdict]:
    """Yield findings on a spacing smaller than the fabricator's smallest."""
    yield from _too_fine(design.spec, "trace_spacing", "turns stand {} apart", "more")
    yield from _thicker_foil(design.spec.coil.layers, design.spec.fpc, "trace_spacing", "spacings")


def loop_lines(design: Design) -> Iterator[Verdict]:
    """Yield findings on track and spacing of the turns against the fabricator's minimum for coils ("loop lines")."""
    coil, rules = design.spec.coil, design.spec.fpc.rules
    pairs = (("trace_width", "track", coil.trace_width, rules.coil_trace_width),
             ("trace_spacing", "spacing", coil.trace_spacing, rules.coil_trace_spacing))
    if all(smallest is None for *_, smallest in pairs):
        yield Undecided(f"{rules.name} states no minimum of its own for coils")
    copper = f" at {show(rules.coil_copper, 'm')} copper" if rules.coil_copper is not None else ""
    for field, word, value, smallest in pairs:
        if smallest is not None and value < smallest - ROUNDING:
            binds = rules.binds(f"coil_{field}")
            # reason why a fabricator's minimum for coils is only a warning: not every fabricator has this minimum
            holder = rules.holders.get("coil_rule_binding", rules.name)
            why = f"{holder} does not make it binding (coil_rule_binding: no)"
            if rules.unbound:
                why = "it comes from the profile that yours is based on, which does not make it binding"
            yield Violation(
                f"{word} in the coil is {show(value, 'm')}; for coiled tracks {house(rules, f'coil_{field}')} asks "
                f"{show(smallest, 'm')}{copper}",
                f"{_waiver(design.spec.coil, design.spec.fpc)}; or widen tracks and gaps, which takes turns and lowers "
                "L and Rp (see SIT201 and SIT203)",
                f"coil.{field}", value, smallest, "m", Severity.ERROR if binds else Severity.WARNING,
                rules.source_of(f"coil_{field}"),
                fixes=_widened(design.spec, f"coil_{field}", is_all=not binds),
                detail="" if binds else f"this only warns: {why}",
            )
    unknown = next((f for f in ("coil_trace_width", "coil_trace_spacing") if f in rules.beyond), None)
    if unknown is not None:
        severity = Severity.ERROR if rules.binds(unknown) else Severity.WARNING
        yield from _thicker_foil(design.spec.coil.layers, design.spec.fpc, unknown, "coiled tracks", severity)


def _widened(spec: SensorSpec, field: str, is_all: bool = False) -> tuple[Family, ...]:
    """Return changes with wider tracks and gaps, plating of the holes alone, and finer fabricators.

    Widths and gaps are the largest of all binding rules, or of all rules with `is_all`.
    """
    rules = spec.fpc.rules
    width, spacing = (
        max(getattr(rules, name), (getattr(rules, f"coil_{name}") or 0.0)
            if is_all or rules.binds(f"coil_{name}") else 0.0)
        for name in ("trace_width", "trace_spacing")
    )
    houses = () if is_all else (lambda: islice(finer_fabricators(spec), NAMED),)
    return partial(wider, spec, width, spacing), partial(_as_foil, spec, field), *houses


def _as_foil(spec: SensorSpec, field: str) -> Iterator[Fix]:
    """Yield plating in the holes alone if a value of the coil then meets the limit for its foil."""
    value = getattr(spec.coil, field.removeprefix("coil_"))
    for fix in plated_in_holes_alone(spec):
        if value >= (getattr(fix.spec.fpc.rules, field) or 0.0) - ROUNDING:
            yield fix


def _finer(spec: SensorSpec) -> str:
    """Return advice that names finer fabricators whose limits the coil meets."""
    names = [fix.edits[0].new for fix in islice(finer_fabricators(spec), NAMED)]
    if not names:
        return "a finer fabricator (no installed profile is as fine)"
    return f"a finer fabricator by fpc.rules ({', '.join(names)})"


def _waiver(coil: CoilSpec, fpc: FpcSpec) -> str:
    """Return advice to request a waiver of the fabricator's minimum for coils, and to write it into the spec."""
    rules = fpc.rules
    figures = ", ".join(
        f"coil_{field}: {show(getattr(coil, field), 'm', 6)}" for field in ("trace_width", "trace_spacing")
        if getattr(coil, field) < (getattr(rules, f"coil_{field}") or 0.0) - ROUNDING
    )
    foil, count = fpc.stackup.line_foil(coil.layers), len(fpc.stackup.copper)
    # a user's own profile may have the name of an installed profile and other values
    is_preset = rules.name in presets.names("rules") and rules == installed_rules(
        rules.name).for_foil(foil).for_layers(count)
    stated = f"fpc.rules: {{based_on: {rules.name}, {figures}}}" if is_preset else f"{figures} in fpc.rules"
    return f"{WAIVER}; once it is confirmed, write {stated}"


ALIKE = 0.1
"""Largest relative difference of films and foils that count as equal: fabricators' tolerance of films is 10 %."""

GLUES = ("adhesive", "bondply")
"""Dielectrics that bond, in contrast to the core that carries the copper."""


def offered(design: Design) -> Iterator[Verdict]:
    """Yield findings on materials of the board that the fabricator does not list.

    Lists that are not stated are not checked.
    """
    spec = design.spec
    rules, fpc = spec.fpc.rules, spec.fpc
    stated = (rules.layer_counts, rules.foils, rules.cores, rules.covers, rules.stiffeners, rules.finishes)
    if all(each is None for each in stated) and rules.order_multiple == 1:
        yield Undecided(f"{rules.name} does not state which stack-ups, finishes and stiffeners are offered")
        return
    other = partial(each_read, spec)
    refused = list(_refused(fpc.stackup, rules))
    alike = presets.stackups_of(max(spec.coil.layers), presets.is_rigid(fpc.stackup))
    good = [name for name in alike if not any(_refused(presets.stackup(name), rules))]
    hint = (f"fpc.stackup: {' or '.join(good)} is offered; or {ANOTHER}" if good else ANOTHER) if refused else ""
    for field, word, measured, asked in refused:
        yield _complaint(rules, "fpc.stackup", field, f"{word}: {asked}", hint, measured,
                         fixes=(partial(other, "fpc.stackup", good),))
    if rules.finishes is not None and fpc.finish not in rules.finishes:
        hint = f"fpc.finish: {rules.finishes[0]}, or another fabricator" if rules.finishes else ANOTHER
        yield _complaint(rules, "fpc.finish", "finishes", f"contacts: {fpc.finish}", hint,
                         fixes=(partial(other, "fpc.finish", rules.finishes),))
    plate = design.layout.stiffener
    if plate is not None and rules.stiffeners is not None and plate.material not in rules.stiffeners:
        yield _complaint(rules, "fpc.tail", "stiffeners", f"stiffener: {plate.material}",
                         f"contacts for solder need none (fpc.tail.connector: solder-pads); or take {ANOTHER}",
                         fixes=(partial(other, "fpc.tail.connector", ["solder-pads"]),))
    if fpc.boards is not None and fpc.boards % rules.order_multiple:
        more = -(-fpc.boards // rules.order_multiple) * rules.order_multiple
        yield Violation(
            f"{fpc.boards} boards are wanted; {house(rules, 'order_multiple')} sells them in multiples of "
            f"{rules.order_multiple}", f"fpc.boards: {more}", "fpc.boards", float(fpc.boards), float(more),
            severity=Severity.WARNING, source=rules.source_of("order_multiple"),
            fixes=(partial(other, "fpc.boards", [more]),),
        )


def _complaint(
    rules: DesignRules, key: str, field: str, asked: str, hint: str, measured: float | None = None,
    fixes: tuple[Family, ...] = (),
) -> Violation:
    """Return the violation for a requested material, with the fabricator's list."""
    listed = (show(each, "m") if isinstance(each, float) else str(each) for each in getattr(rules, field))
    unit = None if measured is None or field == "layer_counts" else "m"
    return Violation(f"{asked}; {house(rules, field)} offers {', '.join(listed) or 'none'}", hint, key, measured, None,
                     unit, source=rules.source_of(field), fixes=fixes)


def _refused(stackup: Stackup, rules: DesignRules) -> Iterator[tuple[str, str, float | None, str]]:
    """Yield the parts of a stack-up that the fabricator does not offer: field, name, value, and value in words."""
    count = len(stackup.copper)
    if rules.layer_counts is not None and count not in rules.layer_counts:
        yield "layer_counts", "copper layers", float(count), str(count)
    if rules.foils is not None:
        # if the plated part is not stated, all of a layer's copper counts as foil
        is_stated = stackup.is_plating_stated
        foils = ((layer.foil if is_stated else layer.thickness, layer.plated) for layer in stackup.copper)
        for foil, plated in dict.fromkeys(foils):
            if not _is_listed(foil, rules.foils):
                is_known = plated > 0.0 and is_stated
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


def _is_listed(thickness: float, listed: Sequence[float]) -> bool:
    return any(abs(thickness - each) <= ALIKE * each for each in listed)


ANOTHER = "another fabricator (fpc.rules); where yours has told you that it is made, say so in a profile of your own"


BASE, BOND, COVER = "base", "bond", "cover"
USUAL = {LayerKind.DIELECTRIC: "polyimide", LayerKind.COVERLAY: "polyimide-coverlay"}
USES = {LayerKind.DIELECTRIC: (BASE, BOND), LayerKind.COVERLAY: (COVER,)}


def layer_materials(design: Design) -> Iterator[Verdict]:
    """Yield a finding on the first layer of an unsuitable material, or the first copper layer without a base."""
    layers = design.spec.fpc.stackup.layers
    for index, layer in enumerate(layers):
        uses = USES.get(layer.kind, ())
        if uses and not set(uses) & set(presets.dielectric_roles(layer.material)):
            what = "a dielectric between copper layers" if layer.kind is LayerKind.DIELECTRIC else "a coverlay"
            yield _other_material(design, index, f"{layer.material} does not serve as {what}", layer.kind)
            return
    coppers = [index for index, layer in enumerate(layers) if layer.kind is LayerKind.COPPER]
    for index in coppers:
        beside = [*_beside(layers, index, -1), *_beside(layers, index, 1)]
        if not any(BASE in presets.dielectric_roles(layers[k].material) for k in beside):
            number = coppers.index(index) + 1
            if not beside:
                yield Violation(
                    f"copper {number} has no dielectric beside it: it lies between coverlays alone",
                    "write a dielectric below it, like {dielectric: 25 um, material: polyimide}", "fpc.stackup",
                )
            else:
                names = " and ".join(dict.fromkeys(layers[k].material for k in beside))
                said = f"copper {number} lies on {names} alone, a bonding material that does not carry copper"
                yield _other_material(design, beside[0], said, LayerKind.DIELECTRIC)
            return


def _beside(layers: tuple[StackLayer, ...], index: int, step: int) -> Iterator[int]:
    """Yield the indices of the dielectrics between a copper layer and the next one, upwards (-1) or downwards (1)."""
    index += step
    while 0 <= index < len(layers) and layers[index].kind is LayerKind.DIELECTRIC:
        yield index
        index += step


def _other_material(design: Design, index: int, message: str, kind: LayerKind) -> Violation:
    """Return the finding about a layer's material. Its hint names the materials that suit the layer."""
    serving = [name for name in presets.names("dielectric") if set(USES[kind]) & set(presets.dielectric_roles(name))]
    if kind is LayerKind.DIELECTRIC:
        serving = [name for name in serving if BASE in presets.dielectric_roles(name)]
    key = f"fpc.stackup.{index}.material"
    hint = f"{key}: {' or '.join(serving)}"
    usual = "FR4" if kind is LayerKind.DIELECTRIC and presets.is_rigid(design.spec.fpc.stackup) else USUAL[kind]
    return Violation(message, hint, key, fixes=(lambda: read_anew(design.spec, key, usual),))


def coverlay_adhesive(design: Design) -> Iterator[Verdict]:
    """Yield a finding on each coverlay film with less adhesive than the copper under it needs.

    If the adhesive is not stated, the whole coverlay but the thinnest film in stock counts as adhesive.
    """
    stackup, coil = design.spec.fpc.stackup, design.spec.coil
    thinnest = min(film for film, _ in presets.coverlay_films())
    for side, layer, copper in stackup.covers:
        asked = presets.least_adhesive(copper.thickness)
        most = layer.adhesive or max(0.0, layer.thickness - thinnest)
        if layer.material == MASK or most >= asked - ROUNDING:
            continue
        gaps = coil.trace_spacing / (coil.trace_width + coil.trace_spacing) if copper.number in coil.layers else 0.0
        has = show(most, "m") if layer.adhesive else f"at most {show(most, 'm')}"
        film, adhesive = presets.best_film(asked)
        is_preset = stackup.name in presets.names("stackup")
        key = "fpc.stackup" if is_preset else f"fpc.stackup.{0 if side == 'top' else len(stackup.layers) - 1}"
        yield Violation(
            f"the {side} coverlay has {has} of adhesive over {show(copper.thickness, 'm')} of copper, minimum "
            f"{show(asked, 'm', 3)}",
            f"{{coverlay: {show(film + adhesive, 'm')}, adhesive: {show(adhesive, 'm')}}} is in stock; or thinner "
            "copper (fpc.plated: buttons)", key, most, asked, "m",
            Severity.ERROR if 0.0 < layer.adhesive < gaps * copper.thickness - ROUNDING else Severity.WARNING,
            detail="" if layer.adhesive else
            f"the adhesive is not stated; the thinnest film in stock, {show(thinnest, 'm')}, leaves that",
            fixes=(partial(_with_film, design.spec, key, film, adhesive) if not is_preset else tuple,
                   partial(plated_in_holes_alone, design.spec)),
        )


def _with_film(spec: SensorSpec, key: str, film: float, adhesive: float) -> Iterator[Fix]:
    """Yield a coverlay of a film and an adhesive (m) in place of the layer at a key."""
    for thick in read_anew(spec, f"{key}.coverlay", show(film + adhesive, "m")):
        yield from map(thick.with_also, read_anew(thick.spec, f"{key}.adhesive", show(adhesive, "m")))


RULES: tuple[Rule, ...] = (
    rule_of("SIT104", lambda design: via_drill(design.layout.vias, design.spec.fpc.rules)),
    rule_of("SIT105", lambda design: annular_ring(design.layout.vias, design.spec.fpc.rules)),
    rule_of("SIT106", lambda design: hole_to_hole(design.layout.vias, design.spec.fpc.rules)),
    rule_of("SIT116", part_size), rule_of("SIT101", trace_width), rule_of("SIT102", trace_spacing),
    rule_of("SIT103", loop_lines), rule_of("SIT131", offered),
    rule_of("SIT137", layer_materials), rule_of("SIT138", coverlay_adhesive),
)
