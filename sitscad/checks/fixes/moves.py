"""Changes of coil, board and readout that may remove a finding, the smallest first. A hint contains only tried changes.

A closed formula gives the room for a single via. If leads, vias and other coils share the room, only a trial shows
whether a change is sufficient. Therefore each amount in a hint was tried.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from itertools import combinations, islice

from sitscad.basics.finding import Edit, Missing
from sitscad.basics.units import show
from sitscad.checks.fixes.search import AMOUNTS, GROWTH, Family, Fix, with_value
from sitscad.layout.clearance import hole_keep_out, joined_hole
from sitscad.layout.routing.branches import least_closing
from sitscad.layout.windings import wind_all
from sitscad.spec import presets
from sitscad.spec.circuit import Plating, Stackup
from sitscad.spec.coil import INNER, CoilPlacement, CoilSpec
from sitscad.spec.design_rules import DesignRules
from sitscad.spec.load import rewritten_spec
from sitscad.spec.materials import ElastomerPad, Target
from sitscad.spec.presets import connector, names
from sitscad.spec.profiles import installed_rules
from sitscad.spec.reading import SpecError
from sitscad.spec.resolver.coils import least_scale
from sitscad.spec.sensor import ArtworkSpec, SensorSpec

MOST_LAYERS = 8

MAX_TURN_RUN_BACK = 0.05
"""Largest arc (turns) in a proposed design along which a lead runs around the coil against the winding's sense."""


def with_turns(spec: SensorSpec, turns: float) -> Fix:
    """Return the change to `turns` turns on each layer of the coil."""
    coil = replace(spec.coil, turns=turns)
    edits = (Edit("coil.turns", f"{turns:.7g}"),) if "coil.turns" in _winding_keys(spec.source.keys) else ()
    return Fix((*edits, *_inner_diameter_edit(spec.source.keys, coil)), replace(spec, coil=coil))


def _winding_keys(keys: Mapping[str, tuple[int, int]]) -> set[str]:
    """Return the keys for turns, trace width, spacing and inner diameter that a change may edit.

    If the spec gives the inner diameter, they are its key and each of the other three keys that the spec contains.
    Otherwise they are the other three keys.
    """
    all_of_them = {f"coil.{key}" for key in CoilSpec.stands_in[1]}
    is_by_inner = INNER in keys
    return {INNER, *(all_of_them & keys.keys())} if is_by_inner else all_of_them


def _inner_diameter_edit(keys: Mapping[str, tuple[int, int]], coil: CoilSpec) -> tuple[Edit, ...]:
    """Return a tuple with the edit that sets the inner diameter to the inner diameter of the changed `coil`.

    `keys` are the keys of the spec. Empty if the spec has no inner diameter.
    """
    return (Edit(INNER, _mm(coil.inner_diameter)),) if INNER in _winding_keys(keys) else ()


def with_each_turns(spec: SensorSpec, numbers: Iterable[float]) -> Iterator[Fix]:
    """Yield the change of `with_turns` for each number of turns."""
    for turns in numbers:
        yield with_turns(spec, turns)


def more_turns(coil: CoilSpec, factor: float) -> Iterator[float]:
    """Yield up to three larger numbers of turns per layer, in the order of trial.

    The first is the present number times `factor`. The second is halfway from there to the largest number that fits
    inside the coil. The third is the largest number. Numbers are multiples of the smallest part of a turn for the
    coil's shape. Numbers with which a lead runs back around the coil are left out. Empty if the layers have unequal
    turns.
    """
    if coil.has_unequal_turns:
        return
    parts = coil.outline.ends_per_turn or 4
    room = math.floor(parts * coil.turns_that_fit + 1e-9)
    most = next((part for part in range(room, 0, -1) if not _has_lead_running_back(coil, part / parts)), room)
    turns = min(_least_turns_forward(coil, math.ceil(parts * coil.most_turns * factor - 1e-9), parts), most)
    middle = min(_least_turns_forward(coil, math.ceil((turns + most) / 2.0 - 1e-9), parts), most)
    for part in dict.fromkeys((turns, middle, most)):
        if part / parts > coil.most_turns:
            yield part / parts


def _least_turns_forward(coil: CoilSpec, part: int, parts: int) -> int:
    """Return the smallest number of turns, counted in parts of a turn, with which no lead runs back around the coil.

    A turn has `parts` parts. The search covers the numbers from `part` up to one turn more. If a lead runs back with
    every number, the result is `part`.
    """
    return next((more for more in range(part, part + parts) if not _has_lead_running_back(coil, more / parts)), part)


def _has_lead_running_back(coil: CoilSpec, turns: float) -> bool:
    """Whether a lead would run around the coil against the winding's sense by more than `MAX_TURN_RUN_BACK` turns.

    `turns` is the number of turns per layer. Such a lead reduces the inductance.
    """
    return turns > 0.0 and least_closing(replace(coil, turns=turns)) < -MAX_TURN_RUN_BACK


def fewer_turns(coil: CoilSpec, room: float, steps: int = 1) -> Iterator[float]:
    """Yield numbers of turns per layer: the present number, then the largest that has room, then smaller numbers.

    `room` is the number of turns for which there is room. At most `steps` smaller numbers follow, each smaller by one
    part of a turn. With all numbers but the first, no lead runs back around the coil. Empty if the layers have unequal
    turns.
    """
    if coil.has_unequal_turns:
        return
    parts = coil.outline.ends_per_turn or 4
    whole = math.floor(parts * room + 1e-9)
    fewer = (part / parts for part in range(whole, 0, -1) if not _has_lead_running_back(coil, part / parts))
    for turns in dict.fromkeys((coil.most_turns, *islice(fewer, steps + 1))):
        if 0.0 < turns <= coil.turns_that_fit:
            yield turns


def turns_with_room_for_vias(spec: SensorSpec, most: float, count: int) -> Iterator[Fix]:
    """Yield up to `count` changes to fewer turns that leave room for all vias inside the coil.

    The numbers of turns are at most `most`. The largest is first. It is found by bisection, because fewer turns leave
    more room.
    """
    now = spec.coil.most_turns
    fixes = [fix for fix in with_each_turns(spec, fewer_turns(spec.coil, most, MOST_STEPS))
             if fix.edits and fix.spec.coil.most_turns < now]
    low, high = 0, len(fixes)
    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if inner_vias_fit(fixes[middle].spec.artwork) else (middle + 1, high)
    yield from fixes[low : low + count]


MOST_STEPS = 24
"""Largest number of steps by which trials reduce the turns to make room inside. A step is one part of a turn."""


def whole_turns(coil: CoilSpec) -> Iterator[float]:
    """Yield numbers of turns per layer that add up to a whole number of turns over all layers.

    Both leads then start at the same place of the coil. The number nearest to the present number is first. The nearest
    number on the other side of the present number follows. Empty if the layers have unequal turns.
    """
    layers = len(coil.layers)
    if coil.has_unequal_turns:
        return
    parts = math.gcd(coil.outline.ends_per_turn or layers, layers)
    below = math.floor(parts * coil.most_turns + 1e-6) / parts
    for turns in sorted((below, below + 1.0 / parts), key=lambda turns: round(abs(turns - coil.most_turns), 6)):
        if 0.0 < turns <= coil.turns_that_fit and abs(turns - coil.most_turns) > 1e-6:
            yield turns


def narrower_coils(spec: SensorSpec, by: float) -> Iterator[Fix]:
    """Yield changes to coils narrower by at least the length `by` (m): with the present turns, then with fewer turns.

    With the fewer turns, the free width inside the coil remains as it is.
    """
    coil = spec.coil
    x, y = coil.size
    across = math.floor((y - by) * 1e5 + 1e-6) / 1e5  # rounded as written
    if across <= 2.0 * coil.trace_width:
        return
    long = coil.outline.is_long
    size = Edit("coil.outer_diameter", f"[{x * 1e3:g}, {across * 1e3:g}]" if long else f"{across * 1e3:g}")
    small = replace(spec, coil=replace(coil, size=(x if long else across, across)))
    room = coil.most_turns - (y - across) / 2.0 / coil.pitch
    for fix in with_each_turns(small, fewer_turns(small.coil, room, 0)):
        yield _with_edits((size,), fix, coil.most_turns)


def smaller_coils(spec: SensorSpec, by: float, keeps_length: bool = False) -> Fix:
    """Return the change to coils smaller by the length `by` (m), with the present gaps between them.

    The turns are reduced if the vias inside the coil would have no room. With `keeps_length`, a long coil becomes
    narrower, but not shorter. The change has no edits if no coil would remain.
    """
    coil = spec.coil
    if keeps_length and coil.outline.is_long:
        size = (coil.size[0], coil.size[1] - by)
        small = Fix((Edit("coil.outer_diameter", f"[{_mm(size[0])}, {_mm(size[1])}]"),),
                    replace(spec, coil=replace(coil, size=size)))
    else:
        small = larger_coils(spec, -by)
    if min(small.spec.coil.size) <= 2.0 * coil.trace_width:
        return Fix((), spec)
    room = coil.most_turns - by / 2.0 / coil.pitch
    for fewer in with_each_turns(small.spec, fewer_turns(small.spec.coil, room, 0)):
        if inner_vias_fit(fewer.spec.artwork):
            turned = (edit for edit in fewer.edits if fewer.spec.coil.most_turns != coil.most_turns)
            return small.with_also(Fix(tuple(turned), fewer.spec))
    return small


def _with_edits(edits: tuple[Edit, ...], turned: Fix, turns: float) -> Fix:
    """Return a change of the turns (`turned`), preceded by the `edits` of another change.

    If the number of turns remains `turns`, the edit of the turns is left out. An edit of the inner diameter remains,
    because the inner diameter depends on both changes.
    """
    turning = (edit for edit in turned.edits if edit.key == INNER or turned.spec.coil.most_turns != turns)
    return replace(turned, edits=(*edits, *turning))


def moved_layer_ends(spec: SensorSpec) -> Iterator[Fix]:
    """Yield changes that move the ends of the coil's layers, and so the leads.

    First come other start angles of the winding, then a part of a turn less, and a part more.
    """
    coil, parts = spec.coil, spec.coil.outline.ends_per_turn or 4
    yield from other_start_angles(spec)
    fewer = fewer_turns(coil, coil.most_turns - 1.0 / parts, 0)
    more = more_turns(coil, 1.0 + 0.5 / (parts * coil.most_turns))
    yield from (fix for fix in with_each_turns(spec, (*fewer, *more)) if fix.spec.coil.most_turns != coil.most_turns)


def more_layers(spec: SensorSpec, factor: float) -> Iterator[Fix]:
    """Yield changes to coils of more layers.

    The first number of layers is even, and at least `factor` times the present number. The second is larger by two. The
    stack-up does not change if it has enough layers. Otherwise it is replaced by the first installed stack-up with the
    needed number of layers.
    """
    coil, now = spec.coil, len(spec.coil.layers)
    if coil.has_unequal_turns or coil.layers != tuple(range(1, now + 1)):
        return
    first = max(2 * math.ceil(now * factor / 2.0 - 1e-9), now + 2 - now % 2)
    for count in range(first, min(first + 2, MOST_LAYERS) + 1, 2):
        deeper, edit = replace(coil, layers=tuple(range(1, count + 1))), Edit("coil.layers", f"{count}")
        if count <= len(spec.fpc.stackup.copper):
            yield Fix((edit,), replace(spec, coil=deeper))
            continue
        name = next(iter(presets.stackups_with_copper_layers(count, presets.is_rigid(spec.fpc.stackup))), None)
        if name is not None:
            stackup, tail = presets.stackup(name), spec.fpc.tail
            if tail is not None and "fpc.tail.layers" not in spec.source.keys:  # left out: all layers
                tail = replace(tail, layers=len(stackup.copper))
            core = tail.layers if tail is not None and 1 < tail.layers < len(stackup.copper) else 0
            stackup = presets.with_stock_coverlays(stackup.built(spec.fpc.stackup.plating, core))
            rules = spec.fpc.rules.for_foil(stackup.line_foil(deeper.layers)).for_layers(len(stackup.copper))
            fpc = replace(spec.fpc, stackup=stackup, rules=rules, tail=tail)
            yield Fix((edit, Edit("fpc.stackup", name)), replace(spec, coil=deeper, fpc=fpc))


KEPT_TURNS_PITCH_RATIO = 1.1
"""Ratio of the new pitch of turns to the present pitch, below which the present number of turns is tried first."""


def wider_tracks(spec: SensorSpec, width: float, spacing: float) -> Iterator[Fix]:
    """Yield changes to tracks of at least `width` and gaps of at least `spacing` (m).

    If the new pitch is less than `KEPT_TURNS_PITCH_RATIO` times the present pitch, the first change does not change the
    number of turns. The next changes reduce the turns, so that the winding is no wider than before.
    """
    coil = spec.coil
    width, spacing = (math.ceil(size * 1e7 - 1e-3) / 1e7 for size in (width, spacing))  # rounded as written
    wide = replace(coil, trace_width=max(coil.trace_width, width), trace_spacing=max(coil.trace_spacing, spacing))
    edits = tuple(
        Edit(f"coil.{key}", show(getattr(wide, key), "m", 6))
        for key in ("trace_width", "trace_spacing")
        if getattr(wide, key) > getattr(coil, key) + 1e-12 and f"coil.{key}" in _winding_keys(spec.source.keys)
    )
    if wide.pitch < KEPT_TURNS_PITCH_RATIO * coil.pitch:
        yield Fix((*edits, *_inner_diameter_edit(spec.source.keys, wide)), replace(spec, coil=wide))
    room = coil.most_turns * coil.pitch / wide.pitch
    for fix in with_each_turns(replace(spec, coil=wide), fewer_turns(wide, room)):
        yield _with_edits(edits, fix, coil.most_turns)


def with_capacitors(spec: SensorSpec, values: Iterable[float]) -> Iterator[Fix]:
    """Yield changes to tank capacitors of these `values` (F), rounded to two significant digits."""
    for value in values:
        rounded = float(f"{value:.1e}")
        yield with_value(spec, "readout.capacitance", rounded, show(rounded, "F", 2))


def with_scan_rate(spec: SensorSpec, rate: float) -> Fix:
    """Return the change to a scan rate of `rate` scans per second (Hz)."""
    return with_value(spec, "readout.scan_rate", rate, show(rate, "Hz", 6))


def thinner_tails(spec: SensorSpec) -> Iterator[Fix]:
    """Yield changes to a tail of two copper layers, then of one layer, if the changed text is a valid spec.

    The other layers of the body are then added above and below the tail's layers.
    """
    tail = spec.fpc.tail
    assert tail is not None
    for layers in (2, 1):
        if layers < tail.layers:
            yield from reread_change(spec, "fpc.tail.layers", layers)


SMALL_PARTS = ("ncp15xh103f03rc",)
"""Soldered thermistors that hints propose, in place of larger parts or of parts without room."""


def reread_change(spec: SensorSpec, key: str, value: float | str) -> Iterator[Fix]:
    """Yield the change of the key `key` to `value`, with the spec read again from its changed text.

    Defaults that depend on the value change with it. Empty if the changed text is not a valid spec.
    """
    try:
        changed = rewritten_spec(spec, ((key, value),))
    except SpecError:
        return
    yield Fix((Edit(key, value if isinstance(value, str) else f"{value:.6g}"),), changed)


def reread_changes(spec: SensorSpec, key: str, values: Iterable[float | str]) -> Iterator[Fix]:
    """Yield the result of `reread_change` for each value."""
    for value in values:
        yield from reread_change(spec, key, value)


def hole_plating_only(spec: SensorSpec) -> Iterator[Fix]:
    """Yield the change to plating on holes and their pads only ("button plating"), so that tracks are unplated foil.

    Such tracks can be etched finer, and the tail is thinner. Empty if only holes and pads are plated already, or if no
    hole is plated.
    """
    if len(spec.fpc.stackup.copper) > 1 and spec.fpc.stackup.plating is not Plating.BUTTONS:
        yield from reread_change(spec, "fpc.plated", "buttons")


SAME = 1e-9
"""Largest difference (m) between two lengths that count as equal."""


def finer_fabricators(coil: CoilSpec, stackup: Stackup) -> Iterator[tuple[str, DesignRules]]:
    """Yield (name, design rules) of installed fabricator profiles whose limits permit the coil's tracks and gaps.

    The rules are for the foil and the number of layers of `stackup`. The profile with the coarsest limits is first. A
    profile that states its layer counts must include this number of layers.
    """
    foil, count = stackup.line_foil(coil.layers), len(stackup.copper)
    fitting = []
    for name in presets.names("rules"):
        rules = installed_rules(name).for_foil(foil).for_layers(count)
        least = [(rules.trace_width, rules.trace_spacing)]
        if rules.coil_rule_binding:
            least.append((rules.coil_trace_width or 0.0, rules.coil_trace_spacing or 0.0))
        counts = rules.layer_counts
        if (
            all(coil.trace_width >= width - SAME and coil.trace_spacing >= gap - SAME for width, gap in least)
            and not {"trace_width", "trace_spacing"} & set(rules.beyond)
            and (counts is None or count in counts)
        ):
            fitting.append((-sum(least[0]), name, rules))
    for _, name, rules in sorted(fitting, key=lambda entry: entry[:2]):
        yield name, rules


START_ANGLES = (15.0, 30.0, 45.0, 90.0, 135.0, 180.0, 225.0, 270.0, 315.0)
"""Angles (degrees) by which the start of a winding without corners is turned in trials, in this order."""

def larger_coils(spec: SensorSpec, by: float) -> Fix:
    """Return the change to coils longer and wider by the length `by` (m), with the present gaps between them."""
    size = (spec.coil.size[0] + by, spec.coil.size[1] + by)
    is_long = spec.coil.outline.is_long
    written = f"[{_mm(size[0])}, {_mm(size[1])}]" if is_long else _mm(size[0])
    edit, apart, coil = Edit("coil.outer_diameter", written), coils_farther_apart(spec, by), replace(spec.coil,
                                                                                                     size=size)
    inner = _inner_diameter_edit(spec.source.keys, coil)
    edits = (*inner, *apart.edits)
    edit_texts = [*(f"{other.key}: {other.new}" for other in inner), *([apart.words] if apart.edits else [])]
    description = f"{_edit_text(edit, by)} with {' and '.join(edit_texts)}" if edit_texts else _edit_text(edit, by)
    return Fix((edit, *edits), replace(apart.spec, coil=coil), description)


LONGER = (1.1, 1.4)
"""Factors by which `longer_coils` multiplies the required length of a coil to obtain further lengths to try."""


def longer_coils(spec: SensorSpec, factor: float) -> Iterator[Fix]:
    """Yield changes to a longer coil, for a single coil of a long shape.

    The first length is the present length times `factor`. The next lengths are the first times each factor of `LONGER`.
    Target and pad grow by the same length as the coil if they cover its ends (`COIL_END_RATIO`). Empty for other shapes
    and for arrays.
    """
    coil = spec.coil
    if not coil.outline.is_long or len(spec.array.placements) > 1:
        return
    for more in LONGER:
        length = math.ceil(more * factor * coil.size[0] * 1e4) * 1e-4
        by = length - coil.size[0]
        edits = [Edit("coil.outer_diameter", f"[{_mm(length)}, {_mm(coil.size[1])}]")]
        changed = replace(spec, coil=replace(coil, size=(length, coil.size[1])))
        plates: tuple[tuple[str, Target | ElastomerPad | None], ...] = (
            ("target", spec.target), ("elastomer", spec.elastomer))
        for key, plate in plates:
            if plate is not None and plate.outline.is_long and plate.size[0] >= COIL_END_RATIO * coil.size[0]:
                size = (rounded_up(plate.size[0] + by), plate.size[1])
                fix = with_value(changed, f"{key}.size", size, f"[{_mm(size[0])}, {_mm(size[1])}]")
                edits, changed = [*edits, *fix.edits], fix.spec
        yield Fix(tuple(edits), changed)


COIL_END_RATIO = 0.9
"""Ratio of a plate's length to the coil's length, above which the plate counts as covering the coil's ends."""


def larger_body(spec: SensorSpec, by: float) -> Fix:
    """Return the change to a board's body that is larger by the length `by` (m) on every side.

    The change has no edits if the spec gives no size of the body, or if its outline is drawn.
    """
    body = spec.fpc.body
    if body is None or body.size is None:
        return Fix((), spec)
    grown = body.sized((body.size[0] + 2.0 * by, body.size[1] + 2.0 * by))
    x, y = (_mm(side) for side in grown.size or body.size)
    return with_value(spec, "fpc.body", grown, grown.written, f"fpc.body.size: {x if x == y else f'[{x}, {y}]'}")


def coils_farther_apart(spec: SensorSpec, by: float) -> Fix:
    """Return the change that scales the array until the nearest coils are farther apart by the length `by` (m).

    The change has no edits for a sensor with a single coil.
    """
    near = nearest_distance(spec.array.placements)
    if near is None:
        return Fix((), spec)
    scale = 1.0 + by / near
    placements = tuple(replace(p, centre=(p.centre[0] * scale, p.centre[1] * scale)) for p in spec.array.placements)
    pitch = None if spec.array.pitch is None else spec.array.pitch + by
    changed = replace(spec, array=replace(spec.array, placements=placements, pitch=pitch))
    if pitch is not None:
        edit = Edit("array.pitch", _mm(pitch))
        return Fix((edit,), changed, _edit_text(edit, by))
    centres = ", ".join(f"[{_mm(p.centre[0])}, {_mm(p.centre[1])}]" for p in placements)
    description = f"array.centres {scale:.4f} times as far from each other"
    return Fix((Edit("array.centres", f"[{centres}]"),), changed, description)


def _edit_text(edit: Edit, by: float) -> str:
    return f"{edit.key}: {edit.new} ({abs(by) * 1e6:.0f} um {'more' if by > 0.0 else 'less'})"


def rounded_up(length: float) -> float:
    """Return a length (m) rounded up to whole micrometres, as the spec's text states it."""
    return round(math.ceil(length * 1e6 - 1e-3) * 1e-6, 9)


def _mm(length: float) -> str:
    return f"{length * 1e3:.9g}"


def nearest_distance(placements: tuple[CoilPlacement, ...]) -> float | None:
    """Return the distance (m) between the centres of the two nearest coils. None for a single coil."""
    return min((math.dist(a.centre, b.centre) for a, b in combinations(placements, 2)), default=None)


def lead_room(placements: tuple[CoilPlacement, ...], coil: CoilSpec, rules: DesignRules) -> float:
    """Return the length (m) by which the gap between the two nearest coils must grow for a via and a lead.

    The result is at least the width of a track plus the fabricator's least spacing.
    """
    pitch = coil.trace_width + rules.trace_spacing
    hole = joined_hole(rules, coil.trace_width)
    gap = (nearest_distance(placements) or 0.0) - coil.size[0]
    return max(2.0 * hole_keep_out(hole, rules, rules.trace_spacing) + pitch - gap, pitch)


def inner_vias_fit(artwork: ArtworkSpec) -> bool:
    """Whether there is room for all vias inside the coils."""
    return not any(lack.what is Missing.INNER_ROOM for coil in wind_all(artwork) for lack in coil.shortfalls)


def other_start_angles(spec: SensorSpec) -> Iterator[Fix]:
    """Yield other start angles of the coils."""
    # Coils that end at a corner also begin at a corner: all angles between two corners are equivalent.
    ends = spec.coil.outline.ends_per_turn
    for turned in START_ANGLES if ends is None else [360.0 * k / ends for k in range(1, ends)]:
        angle = (math.degrees(spec.coil.start_angle) + turned) % 360.0
        yield with_value(spec, "coil.start_angle", math.radians(float(f"{angle:.6g}")), f"{angle:.6g} deg")


def larger_connectors(spec: SensorSpec, length: str) -> Iterator[Fix]:
    """Yield changes to connectors whose dimension `length` is larger than now, the next larger first.

    `length` is the name of a field of `Connector`. Empty if the board has no tail.
    """
    tail = spec.fpc.tail
    if tail is None:
        return
    now, connectors = getattr(tail.connector, length), {name: connector(name) for name in names("connector")}
    for name in sorted(connectors, key=lambda name: getattr(connectors[name], length)):
        if getattr(connectors[name], length) > now + SAME:
            yield with_value(spec, "fpc.tail.connector", connectors[name], name)


def narrower_plugs(spec: SensorSpec, width: float) -> list[tuple[float, Fix]]:
    """Return (tail width in m, change) for each connector with enough contacts and a tail narrower than `width` (m).

    The narrowest tail is first. Empty if the board has no tail.
    """
    tail, used, plugs = spec.fpc.tail, spec.artwork.wires, []
    for name in names("connector") if tail is not None else ():
        plug = connector(name)
        count = min((count for count in plug.positions if count >= used), default=0)
        across = (count - 1) * plug.pitch + 2.0 * plug.edge_margin
        if tail is None or not count or across > width - SAME:
            continue
        edits = [with_value(spec, "fpc.tail.connector", plug, name)] * (name != tail.connector.name)
        if tail.contacts not in (None, count):
            edits.append(with_value(edits[0].spec if edits else spec, "fpc.tail.contacts", count, str(count)))
        plugs.append((across, edits[0] if len(edits) == 1 else edits[0].with_also(edits[1])))
    return sorted(plugs, key=lambda each: each[0])


MOST_COILS = 4
"""Largest number of coils of a sensor for which `families_for_room` returns changes."""

FEWER = 4
"""Largest number of designs with fewer turns that `families_for_room` tries."""


def families_for_room(spec: SensorSpec, is_turns: bool, is_apart: bool) -> tuple[Family, ...]:
    """Return families of changes for a spec that could not be loaded, because its coils or turns lack room.

    If turns lack room (`is_turns`), fewer turns are tried. If coils are too close to each other (`is_apart`), every
    change also moves the coils apart. For other arrays, changes that move the coils apart follow the changes of the
    turns alone. Empty for more than `MOST_COILS` coils and for layers of unequal turns.
    """
    if len(spec.array.placements) > MOST_COILS or spec.coil.has_unequal_turns:
        return ()

    fewer = partial(turns_with_room_for_vias, spec, spec.coil.turns_that_fit, FEWER)

    def both() -> Iterator[Fix]:
        for fix in fewer() if is_turns else [Fix((), spec)]:
            yield from map(fix.with_also, _separated_coils(fix.spec))

    return (both,) if is_apart else (fewer, both) if len(spec.array.placements) > 1 else (fewer,)


def _separated_coils(spec: SensorSpec) -> Iterator[Fix]:
    """Yield changes to coils farther apart: first until they do not touch, then also with room for leads.

    The additional room is first enough for one lead with its via. At each of the `AMOUNTS` steps, it grows by the
    factor `GROWTH`.
    """
    near = nearest_distance(spec.array.placements)
    scale = None if near is None else least_scale(spec.array, spec.coil)
    if near is None or scale is None:
        return
    by = max(0.0, near * (scale - 1.0))
    beside = _larger_pitch(spec, near, by)
    yield beside
    room = lead_room(beside.spec.array.placements, beside.spec.coil, beside.spec.fpc.rules)
    for step in range(AMOUNTS):
        yield _larger_pitch(spec, near, by + room * GROWTH**step)


def _larger_pitch(spec: SensorSpec, near: float, by: float) -> Fix:
    """Return the change to coils farther apart by at least `by` (m). The pitch is rounded up to whole micrometres.

    `near` is the present distance (m) between the centres of the nearest coils. Without a pitch, the places of the
    coils are scaled.
    """
    if spec.array.pitch is None:
        scale = math.ceil((1.0 + by / near) * 1e4 - 1e-6) / 1e4
        return coils_farther_apart(spec, near * (scale - 1.0))
    pitch = math.ceil((spec.array.pitch + by) * 1e6 - 1e-5) * 1e-6
    # the nearest distance grows with the pitch: coils of a triangle and a grid are one pitch apart
    return Fix((Edit("array.pitch", f"{pitch * 1e3:.6g}"),), coils_farther_apart(spec, pitch - spec.array.pitch).spec)
