"""SIT101 to SIT106, SIT116, SIT131, SIT137 and SIT138: tracks, gaps, holes, parts and materials that can be made.

The limits are the fabricator's. SIT137 and SIT138 check the materials of the stack-up's layers and the adhesive of its
coverlays.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cache, partial
from itertools import combinations, islice
from typing import Any

from sitscad.basics.finding import Place, Severity
from sitscad.basics.units import show
from sitscad.checks.fixes.moves import finer_fabricators, hole_plating_only, reread_change, reread_changes, wider_tracks
from sitscad.checks.fixes.search import Family, Fix, with_value
from sitscad.checks.rules import ROUNDING, Rule, Verdict, Violation, not_checked, rule_of, violation_of
from sitscad.data import is_unverified
from sitscad.estimates.design import Design
from sitscad.layout.board import Via
from sitscad.layout.panel import FEWEST_BRIDGES, bridges, is_wanted, least_size, narrower_bridge
from sitscad.spec import presets
from sitscad.spec.circuit import MASK, FpcSpec, LayerKind, StackLayer, Stackup
from sitscad.spec.coil import CoilSpec
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.profiles import installed_rules
from sitscad.spec.resolver.coils import reference_coil_key
from sitscad.spec.sensor import SensorSpec


def via_drill(vias: tuple[Via, ...], rules: DesignRules) -> Iterator[Verdict]:
    """Yield findings on vias whose drill is smaller than the fabricator's minimum."""
    for via in vias:
        if via.drill < rules.via_drill - ROUNDING:
            yield length_violation("via-drill", rules, "via_drill", via.drill, "fpc.rules",
                                   Place(*via.centre, nets=(via.net,)), net=via.net)


def annular_ring(vias: tuple[Via, ...], rules: DesignRules) -> Iterator[Verdict]:
    """Yield findings on vias whose ring of copper around the drill is narrower than the fabricator's minimum."""
    for via in vias:
        ring = (via.pad - via.drill) / 2.0
        if ring < rules.annular_ring - ROUNDING:
            yield length_violation("annular-ring", rules, "annular_ring", ring, "fpc.rules",
                                   Place(*via.centre, nets=(via.net,)), net=via.net,
                                   pad=via.drill + 2.0 * rules.annular_ring)


def hole_to_hole(vias: tuple[Via, ...], rules: DesignRules) -> Iterator[Verdict]:
    """Yield findings on pairs of drilled holes with a wall between them thinner than the fabricator's minimum."""
    for via, other in combinations(vias, 2):
        wall = via.centre.distance(other.centre) - (via.drill + other.drill) / 2.0
        if wall < rules.hole_to_hole - ROUNDING:
            place = Place((via.centre.x + other.centre.x) / 2.0, (via.centre.y + other.centre.y) / 2.0,
                          nets=tuple(sorted({via.net, other.net})))
            yield length_violation("hole-wall", rules, "hole_to_hole", wall, "coil.turns", place,
                                   nets=list(dict.fromkeys((via.net, other.net))), missing=rules.hole_to_hole - wall)


def part_size(design: Design) -> Iterator[Verdict]:
    """Yield findings on an outline smaller than the smallest part that the fabricator handles."""
    spec, rules, board = design.spec, design.spec.fpc.rules, design.layout.size
    in_panel = is_wanted(board, spec.fpc)
    (width, length), least = sorted(board), sorted(rules.part_size)
    short = next(((size, limit) for size, limit in zip((width, length), least, strict=True)
                  if size < limit - ROUNDING), None)
    if short is not None:
        # a service with one process takes no special requests
        case = "part-in-panel" if in_panel else "part-size-service" if rules.one_process else "part-size"
        yield violation_of(
            case, "fpc.rules" if in_panel else "fpc.panel", *short, "m",
            board=_longer_side_first(board), least=_longer_side_first(least), house=limit_document(rules, "part_size"),
            source=rules.source_of("part_size"), name=spec.name,
            severity=Severity.WARNING if case == "part-size-service" else Severity.NOTE,
            fixes=(partial(reread_changes, spec, "fpc.panel", ["auto"]),) if rules.one_process and not in_panel else (),
        )
    if in_panel:
        wish = spec.fpc.panel
        yield from _panel_size(rules, least_size(board, wish), math.prod(wish.parts or (1, 1)))
        count = len(bridges(design.layout))
        if count < FEWEST_BRIDGES:
            narrower = narrower_bridge(design.layout)
            yield violation_of(
                "bridges", "fpc.panel.bridge", float(count), float(FEWEST_BRIDGES), severity=Severity.ERROR,
                source="two bridges are a hinge, three hold a part in its plane", width=wish.bridge,
                hint="" if narrower else "bridges-none", narrower=f"{(narrower or 0.0) * 1e3:.1f}",
                fixes=(partial(reread_changes, spec, "fpc.panel.bridge",
                               [round(narrower * 1e3, 1)] if narrower else []),
                       partial(reread_changes, spec, "fpc.panel", ["none"])),
            )
    else:
        yield from _panel_size(rules, board)


def _panel_size(rules: DesignRules, size: tuple[float, float], parts: int = 0) -> Iterator[Verdict]:
    """Yield a violation if a delivered part or panel of the sides `size` (m) is larger than the fabricator's panel.

    `parts` is the number of parts in the panel, or 0 for a single board. The panel size in the profile may be only a
    usual size and not a limit. A larger panel then has a note, and a larger single board has no finding. If the sides
    exceed the largest part that the fabricator makes, there is a warning.
    """
    is_choice = is_unverified(rules.source_of("panel_size"))
    for field in ("largest_part", "panel_size") if is_choice else ("panel_size",):
        limits = getattr(rules, field)
        beyond = ((length, most) for length, most in zip(sorted(size), sorted(limits), strict=True)
                  if length > most + ROUNDING)
        side, largest = next(beyond, (None, None))
        is_usual = is_choice and field == "panel_size"
        if side is None or (is_usual and not parts):
            continue
        holder = limit_document(rules, "largest_part" if is_usual else field)
        case, hint = ("panel-usual", "panel-usual-parts") if is_usual else ("panel-size", "panel-size-parts")
        yield violation_of(
            case if parts else "board-size", "fpc.panel" if parts else "fpc.rules", side, largest, "m",
            hint=hint if parts > 1 else "", severity=Severity.NOTE if is_usual else Severity.WARNING,
            source=rules.source_of(field), size=_longer_side_first(size), limits=_longer_side_first(limits),
            house=holder, largest=_longer_side_first(rules.largest_part),
        )
        return


def _longer_side_first(size: Sequence[float]) -> list[float]:
    """Both sides (m) of a rectangle, the longer side first."""
    return sorted(size, reverse=True)


def limit_document(rules: DesignRules, field: str) -> str:
    """Return the name of the document that sets a limit: the profile's name, or file and line of a user's own profile.

    `field` is the limit's key in the design rules. " (unverified)" is added if the limit was not verified.
    """
    mark = " (unverified)" if is_unverified(rules.source_of(field)) else ""
    return rules.holder(field) + mark


def length_violation(
    case: str, rules: DesignRules, field: str, have: float, key: str, place: Place, *, hint: str = "",
    fixes: tuple[Family, ...] = (), **values: Any,
) -> Violation:
    """Return the violation for a length `have` (m) smaller than the limit `field` of the fabricator's rules.

    `case` is the key of the texts in ``data/messages.csv``, `key` the key of the spec to which the finding points, and
    `place` the place on the board. The other arguments are as in `violation_of`.
    """
    return violation_of(case, key, have, getattr(rules, field), "m", source=rules.source_of(field), place=place,
                        hint=hint, fixes=fixes, house=limit_document(rules, field), **values)


def minimum_gap_source(rules: DesignRules, gap: float) -> tuple[str, str]:
    """Return (document, source) of the minimum gap `gap` (m) between copper, as texts.

    If `gap` is smaller than the fabricator's minimum, both texts refer to the spec. The spec's spacing of turns is then
    the minimum.
    """
    if gap < rules.trace_spacing - ROUNDING:
        return "the spec (coil.trace_spacing)", "coil.trace_spacing in the spec"
    return limit_document(rules, "trace_spacing"), rules.source_of("trace_spacing")


MAX_NAMED_FABRICATORS = 4
"""Largest number of fabricators with finer tracks that a hint names."""


def trace_width(design: Design) -> Iterator[Verdict]:
    """Yield findings on tracks narrower than the fabricator's minimum, and on copper too thick for this minimum."""
    yield from _fine_line_violations("trace-width", design.spec, "trace_width")
    yield from _thick_foil_violations(design.spec.coil.layers, design.spec.fpc, "trace_width", "tracks")
    # Tracks drawn narrower than the fabricator makes, if the coil's own width is not the reason
    rules, coil = design.spec.fpc.rules, design.spec.coil
    for trace in design.layout.traces:
        if trace.width < min(rules.trace_width, coil.trace_width, design.spec.reference_coil.trace_width) - ROUNDING:
            yield length_violation("track-width", rules, "trace_width", trace.width, "fpc.rules",
                                   Place(*trace.path.start, trace.layer, (trace.net,)), role=trace.role.value,
                                   net=trace.net, layer=trace.layer)


def _fine_line_violations(case: str, spec: SensorSpec, field: str) -> Iterator[Violation]:
    """Yield a violation if the coil's value `field` is below the fabricator's minimum.

    `field` is ``trace_width`` or ``trace_spacing``.
    """
    value, least = getattr(spec.coil, field), getattr(spec.fpc.rules, field)

    @cache
    def finer() -> list[str]:
        return [name for name, _ in islice(finer_fabricators(spec.coil, spec.fpc.stackup), MAX_NAMED_FABRICATORS)]

    if value < least - ROUNDING:
        yield violation_of(
            case, f"coil.{field}", value, least, "m", hint=lambda: "finer-rules" if finer() else "finer-rules-none",
            source=spec.fpc.rules.source_of(field), fixes=_wider_track_families(spec, field),
            house=limit_document(spec.fpc.rules, field), finer=finer,
        )


def _thick_foil_violations(
    layers: tuple[int, ...], fpc: FpcSpec, field: str, lines: str, severity: Severity = Severity.ERROR
) -> Iterator[Violation]:
    """Yield a violation if the copper foil is thicker than every foil for which the fabricator states a minimum.

    `field` is the key of this minimum, and `lines` its name in the message (tracks or spacings).
    """
    rules, foil = fpc.rules, fpc.stackup.line_foil(layers)
    thickest = rules.beyond.get(field)
    if thickest is not None:
        yield violation_of("foil-unstated", "fpc.rules", foil, thickest, "m", severity=severity,
                           source=rules.source_of(field), lines=lines, field=field, house=limit_document(rules, field))


def trace_spacing(design: Design) -> Iterator[Verdict]:
    """Yield findings on a spacing of turns below the fabricator's minimum, and on copper too thick for this minimum."""
    yield from _fine_line_violations("trace-spacing", design.spec, "trace_spacing")
    yield from _thick_foil_violations(design.spec.coil.layers, design.spec.fpc, "trace_spacing", "spacings")


def loop_lines(design: Design) -> Iterator[Verdict]:
    """Yield findings on track width and spacing of the turns below the fabricator's separate minimum for coils.

    The finding is an error if this minimum is binding in the fabricator's rules, otherwise a warning.
    """
    coil, rules = design.spec.coil, design.spec.fpc.rules
    pairs = (("trace_width", coil.trace_width, rules.coil_trace_width),
             ("trace_spacing", coil.trace_spacing, rules.coil_trace_spacing))
    if all(smallest is None for *_, smallest in pairs):
        yield not_checked("no-coil-minimum", profile=rules.name)
    too_fine = {field: value for field, value, smallest in pairs if value < (smallest or 0.0) - ROUNDING}
    for field, value, smallest in pairs:
        if field in too_fine:
            binds = rules.is_binding(f"coil_{field}")
            # not every fabricator has a minimum for coils: it is only a warning unless the rules make it binding
            unbound = "loop-unbound-base" if rules.unbound else "loop-unbound"
            yield violation_of(
                "loop-width" if field == "trace_width" else "loop-spacing", f"coil.{field}", value, smallest, "m",
                hint="" if _is_installed(design.spec.coil, design.spec.fpc) else "loop-own-rules",
                details=(*["loop-copper"] * (rules.coil_copper is not None), *[unbound] * (not binds)),
                severity=Severity.ERROR if binds else Severity.WARNING, source=rules.source_of(f"coil_{field}"),
                fixes=_wider_track_families(design.spec, f"coil_{field}", is_all=not binds), copper=rules.coil_copper,
                house=limit_document(rules, f"coil_{field}"), holder=rules.holders.get("coil_rule_binding", rules.name),
                profile=rules.name,
                waiver=[f"coil_{name}: {show(drawn_value, 'm', 6)}" for name, drawn_value in too_fine.items()],
            )
    unknown = next((f for f in ("coil_trace_width", "coil_trace_spacing") if f in rules.beyond), None)
    if unknown is not None:
        severity = Severity.ERROR if rules.is_binding(unknown) else Severity.WARNING
        yield from _thick_foil_violations(design.spec.coil.layers, design.spec.fpc, unknown, "coiled tracks", severity)


def check_all_windings(apply: Callable[[Design], Iterable[Verdict]]) -> Callable[[Design], Iterator[Verdict]]:
    """Return the function of a rule that checks the coil's windings and a reference coil's own windings.

    `apply` checks the section ``coil``. For the reference coil, no changes are tried.
    """

    def applied(design: Design) -> Iterator[Verdict]:
        yield from apply(design)
        own = design.spec.reference_coil
        if own is not design.spec.coil:
            alone = Design(replace(design.spec, coil=own), replace(design.layout, traces=()), design.estimates)
            for verdict in apply(alone):
                if isinstance(verdict, Violation) and (verdict.key or "").startswith("coil."):
                    yield replace(verdict, key=reference_coil_key(verdict.key or ""), fixes=())

    return applied


def _wider_track_families(spec: SensorSpec, field: str, is_all: bool = False) -> tuple[Family, ...]:
    """Return families of changes: wider tracks and gaps, plating in the holes alone, and finer fabricators.

    The new widths and gaps meet all binding minimums. With `is_all`, they also meet minimums that are not binding, and
    no other fabricator is tried.
    """
    rules = spec.fpc.rules
    width, spacing = (
        max(getattr(rules, name), (getattr(rules, f"coil_{name}") or 0.0)
            if is_all or rules.is_binding(f"coil_{name}") else 0.0)
        for name in ("trace_width", "trace_spacing")
    )

    def finer() -> Iterator[Fix]:
        for name, profile in islice(finer_fabricators(spec.coil, spec.fpc.stackup), MAX_NAMED_FABRICATORS):
            yield with_value(spec, "fpc.rules", profile, name)

    houses = () if is_all else (finer,)
    return partial(wider_tracks, spec, width, spacing), partial(_unplated_tracks, spec, field), *houses


def _unplated_tracks(spec: SensorSpec, field: str) -> Iterator[Fix]:
    """Yield the change to plating in the holes alone, if the coil then meets the limit `field`.

    Without plating on the tracks, the copper is as thin as the foil. The fabricator's limit for thinner copper is
    smaller.
    """
    value = getattr(spec.coil, field.removeprefix("coil_"))
    for fix in hole_plating_only(spec):
        if value >= (getattr(fix.spec.fpc.rules, field) or 0.0) - ROUNDING:
            yield fix


def _is_installed(coil: CoilSpec, fpc: FpcSpec) -> bool:
    """Whether the rules are an installed profile. A user's own profile may have the same name and other values."""
    foil, count = fpc.stackup.line_foil(coil.layers), len(fpc.stackup.copper)
    return fpc.rules.name in presets.names("rules") and fpc.rules == installed_rules(
        fpc.rules.name).for_foil(foil).for_layers(count)


THICKNESS_TOLERANCE = 0.1
"""Largest relative difference at which a thickness in the spec and a thickness in a list count as equal.

The fabricators' tolerance of films is 10 %.
"""

GLUES = ("adhesive", "bondply")
"""Materials of dielectric layers that glue other layers together. Other dielectrics are bases of copper foil."""


def unlisted_materials(design: Design) -> Iterator[Verdict]:
    """Yield findings on parts of the order that the fabricator does not list.

    These parts are layer counts, foils, films, covers, stiffeners and finishes. If the fabricator does not state a
    list, its parts are not checked. There is a warning if the number of boards is not a multiple of the fabricator's
    order multiple.
    """
    spec = design.spec
    rules, fpc = spec.fpc.rules, spec.fpc
    lists = (rules.layer_counts, rules.foils, rules.cores, rules.covers, rules.stiffeners, rules.finishes)
    if all(each is None for each in lists) and rules.order_multiple == 1:
        yield not_checked("no-offers", profile=rules.name)
        return
    other = partial(reread_changes, spec)
    refused = list(_unlisted_parts(fpc.stackup, rules))
    candidates = presets.stackups_with_copper_layers(max(spec.coil.layers), presets.is_rigid(fpc.stackup))
    good = [name for name in candidates if not any(_unlisted_parts(presets.stackup(name), rules))]
    for case, field, measured, value, plated in refused:
        yield _unlisted_violation(case, rules, "fpc.stackup", field, value, measured, hint="offered" if good else "",
                                  details=("foil-finished",) if plated else (), others=good, plated=plated,
                                  fixes=(partial(other, "fpc.stackup", good),))
    if rules.finishes is not None and fpc.finish not in rules.finishes:
        yield _unlisted_violation("finish-offered", rules, "fpc.finish", "finishes", fpc.finish,
                                  hint="" if rules.finishes else "films-offered", others=rules.finishes[:1],
                                  fixes=(partial(other, "fpc.finish", rules.finishes),))
    plate = design.layout.stiffener
    if plate is not None and rules.stiffeners is not None and plate.material not in rules.stiffeners:
        yield _unlisted_violation("stiffener-offered", rules, "fpc.tail", "stiffeners", plate.material,
                                  fixes=(partial(other, "fpc.tail.connector", ["solder-pads"]),))
    if fpc.boards is not None and fpc.boards % rules.order_multiple:
        more = -(-fpc.boards // rules.order_multiple) * rules.order_multiple
        yield violation_of("order-multiple", "fpc.boards", float(fpc.boards), float(more), severity=Severity.WARNING,
                           source=rules.source_of("order_multiple"), fixes=(partial(other, "fpc.boards", [more]),),
                           house=limit_document(rules, "order_multiple"), multiple=rules.order_multiple)


def _unlisted_violation(
    case: str, rules: DesignRules, key: str, field: str, value: object, measured: float | None = None, *,
    hint: str = "", details: tuple[str, ...] = (), fixes: tuple[Family, ...] = (), **values: Any,
) -> Violation:
    """Return the violation for a material, thickness or number of layers that the fabricator does not list.

    `field` is the key of the fabricator's list, which the message contains. `value` is the text of the unlisted value,
    and `measured` its number (thickness in m, or number of layers). The other arguments are as in `violation_of`.
    """
    listed = [show(each, "m") if isinstance(each, float) else str(each) for each in getattr(rules, field)]
    return violation_of(case, key, measured, unit=None if measured is None or field == "layer_counts" else "m",
                        hint=hint,
                        details=details, source=rules.source_of(field), fixes=fixes, house=limit_document(rules, field),
                        value=value, listed=listed, **values)


def _unlisted_parts(stackup: Stackup, rules: DesignRules) -> Iterator[tuple[str, str, float | None, object, float]]:
    """Yield (case, list, number, text, plating) for each part of a stack-up that the fabricator does not offer.

    ``case`` is the key of the message in ``data/messages.csv``, and ``list`` the key of the fabricator's list.
    ``number`` is the number of layers or the thickness (m), None for a kind of cover. ``text`` is the number or kind as
    text. ``plating`` is the thickness (m) of the plating on a foil, 0 for other parts.
    """
    count = len(stackup.copper)
    if rules.layer_counts is not None and count not in rules.layer_counts:
        yield "layers-offered", "layer_counts", float(count), count, 0.0
    if rules.foils is not None:
        # if the plated part is not stated, all of a layer's copper counts as foil
        is_stated = stackup.is_plating_stated
        foils = ((layer.foil if is_stated else layer.thickness, layer.plated) for layer in stackup.copper)
        for foil, plated in dict.fromkeys(foils):
            if not _is_listed(foil, rules.foils):
                yield "foils-offered", "foils", foil, show(foil, "m"), plated * is_stated
    films = [layer for layer in stackup.layers if layer.kind is LayerKind.DIELECTRIC and layer.material not in GLUES]
    if rules.cores is not None:
        for thickness in dict.fromkeys(film.thickness for film in films if not _is_listed(film.thickness, rules.cores)):
            yield "films-offered", "cores", thickness, show(thickness, "m"), 0.0
    if rules.covers is not None:
        covers = [layer for layer in stackup.layers if layer.kind is LayerKind.COVERLAY]
        for kind in dict.fromkeys(MASK if layer.material == MASK else "film" for layer in covers):
            if kind not in rules.covers:
                yield "covers-offered", "covers", None, kind, 0.0


def _is_listed(thickness: float, listed: Sequence[float]) -> bool:
    return any(abs(thickness - each) <= THICKNESS_TOLERANCE * each for each in listed)


BASE, BOND, COVER = "base", "bond", "cover"
USUAL = {LayerKind.DIELECTRIC: "polyimide", LayerKind.COVERLAY: "polyimide-coverlay"}
LAYER_MATERIALS = {LayerKind.DIELECTRIC: (BASE, BOND), LayerKind.COVERLAY: (COVER,)}


def layer_materials(design: Design) -> Iterator[Verdict]:
    """Yield a finding on the first layer of an unsuitable material, or on the first copper layer without a base.

    A base is a dielectric layer that is not glue, beside the copper.
    """
    layers = design.spec.fpc.stackup.layers
    for index, layer in enumerate(layers):
        uses = LAYER_MATERIALS.get(layer.kind, ())
        if uses and not set(uses) & set(presets.dielectric_roles(layer.material)):
            case = "dielectric-material" if layer.kind is LayerKind.DIELECTRIC else "coverlay-material"
            yield _material_violation(case, design.spec, index, layer.kind, material=layer.material)
            return
    coppers = [index for index, layer in enumerate(layers) if layer.kind is LayerKind.COPPER]
    for index in coppers:
        beside = [*_adjacent_dielectrics(layers, index, -1), *_adjacent_dielectrics(layers, index, 1)]
        if not any(BASE in presets.dielectric_roles(layers[k].material) for k in beside):
            number = coppers.index(index) + 1
            if not beside:
                yield violation_of("copper-without-base", "fpc.stackup", number=number)
            else:
                yield _material_violation("copper-on-bond", design.spec, beside[0], LayerKind.DIELECTRIC, number=number,
                                          bonds=list(dict.fromkeys(layers[k].material for k in beside)))
            return


def _adjacent_dielectrics(layers: tuple[StackLayer, ...], index: int, step: int) -> Iterator[int]:
    """Yield the indices of the dielectric layers between a copper layer and the next copper layer.

    `index` is the copper layer's index. `step` is -1 for the layers above it, 1 for the layers below it.
    """
    index += step
    while 0 <= index < len(layers) and layers[index].kind is LayerKind.DIELECTRIC:
        yield index
        index += step


def _material_violation(case: str, spec: SensorSpec, index: int, kind: LayerKind, **values: Any) -> Violation:
    """Return the finding about a layer's material. Its hint names the materials that suit the layer."""
    serving = [name for name in presets.names("dielectric")
               if set(LAYER_MATERIALS[kind]) & set(presets.dielectric_roles(name))]
    if kind is LayerKind.DIELECTRIC:
        serving = [name for name in serving if BASE in presets.dielectric_roles(name)]
    key = f"fpc.stackup.{index}.material"
    usual = "FR4" if kind is LayerKind.DIELECTRIC and presets.is_rigid(spec.fpc.stackup) else USUAL[kind]
    return violation_of(case, key, fixes=(lambda: reread_change(spec, key, usual),), serving=serving, **values)


def coverlay_adhesive(design: Design) -> Iterator[Verdict]:
    """Yield a finding on each coverlay film with less adhesive than the copper under it needs.

    If the adhesive is not stated, its thickness is taken as the coverlay's thickness minus the thinnest film in stock.
    """
    stackup, coil = design.spec.fpc.stackup, design.spec.coil
    thinnest = min(film for film, _ in presets.coverlay_films())
    for side, layer, copper in stackup.covers:
        minimum = presets.least_adhesive(copper.thickness)
        most = layer.adhesive or max(0.0, layer.thickness - thinnest)
        if layer.material == MASK or most >= minimum - ROUNDING:
            continue
        gaps = coil.trace_spacing / (coil.trace_width + coil.trace_spacing) if copper.number in coil.layers else 0.0
        film, adhesive = presets.best_film(minimum)
        is_preset = stackup.name in presets.names("stackup")
        key = "fpc.stackup" if is_preset else f"fpc.stackup.{0 if side == 'top' else len(stackup.layers) - 1}"
        is_short = 0.0 < layer.adhesive < gaps * copper.thickness - ROUNDING
        yield violation_of(
            "cover-adhesive" if layer.adhesive else "cover-adhesive-unstated", key, most, minimum, "m",
            hint="cover-adhesive", side=side,
            severity=Severity.ERROR if is_short else Severity.WARNING, copper=copper.thickness, thinnest=thinnest,
            coverlay=film + adhesive, adhesive=adhesive,
            fixes=(partial(_other_coverlay, design.spec, key, film, adhesive) if not is_preset else tuple,
                   partial(hole_plating_only, design.spec)),
        )


def _other_coverlay(spec: SensorSpec, key: str, film: float, adhesive: float) -> Iterator[Fix]:
    """Yield the change of a coverlay to another thickness of film and adhesive (m). `key` is its place in the spec."""
    for thick in reread_change(spec, f"{key}.coverlay", show(film + adhesive, "m")):
        yield from map(thick.with_also, reread_change(thick.spec, f"{key}.adhesive", show(adhesive, "m")))


RULES: tuple[Rule, ...] = (
    rule_of("SIT104", lambda design: via_drill(design.layout.vias, design.spec.fpc.rules)),
    rule_of("SIT105", lambda design: annular_ring(design.layout.vias, design.spec.fpc.rules)),
    rule_of("SIT106", lambda design: hole_to_hole(design.layout.vias, design.spec.fpc.rules)),
    rule_of("SIT116", part_size), rule_of("SIT101", check_all_windings(trace_width)),
    rule_of("SIT102", check_all_windings(trace_spacing)),
    rule_of("SIT103", check_all_windings(loop_lines)), rule_of("SIT131", unlisted_materials),
    rule_of("SIT137", layer_materials), rule_of("SIT138", coverlay_adhesive),
)
