"""Changes of the spec that may mend a finding: what to write, in words, and the spec with it. Each is tried before it
is named.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import TypeVar

from sitscad.checks.rules import Left
from sitscad.geometry.footprint import Footprint
from sitscad.record import record
from sitscad.spec import presets
from sitscad.spec.places import footprint
from sitscad.spec.sensor import ElastomerPad, SensorSpec, Target
from sitscad.spec.turns import most_turns, turn_fraction
from sitscad.units import show

MOST_LAYERS = 8


@record
class Change:
    """A change of a spec: its keys and values as they are written, and the changed spec."""

    words: str
    spec: SensorSpec


def first_that_mends(changes: Iterable[Change], left: Left) -> Change | None:
    """The first change with which nothing is left to complain of, else the first that only brings warnings, whose words
    then name those; None where there is none.
    """
    second = None
    for change in changes:
        if left(change.spec):
            continue
        warned = left.warned(change.spec)
        if not warned:
            return change
        second = second or replace(change, words=f"{change.words} ({_warn(warned)} then)")
    return second


def named(changes: Iterable[Change]) -> str:
    """Changes as alternatives, each as it is to be written."""
    return "; or ".join(change.words for change in changes)


def in_vain(changes: Iterable[Change], left: Left) -> str:
    """Changes that mend nothing, each with what it leaves or breaks."""
    return "; ".join(f"{change.words} (then {fail(left(change.spec))})" for change in changes)


def tried(change: Change, left: Left) -> str:
    """What became of a change that was tried, in brackets: that it mends, or what then fails."""
    broken = left(change.spec)
    if broken:
        return f"(tried, but {fail(broken)} then)"
    warned = left.warned(change.spec)
    return f"(it was tried; {_warn(warned)} then)" if warned else "(it was tried)"


def fail(rules: tuple[str, ...]) -> str:
    """That rules fail, in words."""
    return f"{', '.join(rules)} fail{'s' if len(rules) == 1 else ''}"


def _warn(rules: tuple[str, ...]) -> str:
    return f"{', '.join(rules)} warn{'s' if len(rules) == 1 else ''}"


def more_turns(spec: SensorSpec, factor: float) -> Iterator[Change]:
    """So many times the turns, then half the way to the most that the outline takes, then those; whole parts of a turn
    of the shape. Nothing for layers of unequal turns.
    """
    coil = spec.coil
    if coil.unequal_turns:
        return
    parts = turn_fraction(coil.shape) or 4
    most = math.floor(parts * most_turns(coil.shape, coil.size, coil.trace_width, coil.pitch) + 1e-9) / parts
    wanted = min(math.ceil(parts * coil.turns * factor - 1e-9) / parts, most)
    middle = math.ceil(parts * (wanted + most) / 2.0 - 1e-9) / parts
    for turns in dict.fromkeys((wanted, middle, most)):
        if turns > coil.turns:
            yield Change(f"coil.turns: {turns:.7g}", replace(spec, coil=replace(coil, turns=turns)))


def fewer_turns(spec: SensorSpec, room: float, steps: int = 1) -> Iterator[Change]:
    """The turns as they are, then the most that are no more than `room`, then so many times a part of a turn less."""
    coil = spec.coil
    if coil.unequal_turns:
        return
    parts = turn_fraction(coil.shape) or 4
    whole = math.floor(parts * room + 1e-9)
    for turns in dict.fromkeys((coil.turns, *((whole - step) / parts for step in range(steps + 1)))):
        if 0.0 < turns <= most_turns(coil.shape, coil.size, coil.trace_width, coil.pitch):
            yield Change(f"coil.turns: {turns:.7g}", replace(spec, coil=replace(coil, turns=turns)))


def whole_turns(spec: SensorSpec) -> Iterator[Change]:
    """The nearest turns, then those on the other side, that make a whole number in all layers together: the leads then
    come from one place. Nothing for layers of unequal turns.
    """
    coil, layers = spec.coil, len(spec.coil.layers)
    if coil.unequal_turns:
        return
    parts = math.gcd(turn_fraction(coil.shape) or layers, layers)
    below = math.floor(parts * coil.turns + 1e-6) / parts
    most = most_turns(coil.shape, coil.size, coil.trace_width, coil.pitch)
    for turns in sorted((below, below + 1.0 / parts), key=lambda turns: round(abs(turns - coil.turns), 6)):
        if 0.0 < turns <= most and abs(turns - coil.turns) > 1e-6:
            yield Change(f"coil.turns: {turns:.7g}", replace(spec, coil=replace(coil, turns=turns)))


def narrower(spec: SensorSpec, by: float) -> Iterator[Change]:
    """Coils narrower by so much (m) at least, with as many turns as now or as leave the inside as it is."""
    coil = spec.coil
    x, y = coil.size
    across = math.floor((y - by) * 1e5 + 1e-6) / 1e5  # as it is written
    if across <= 2.0 * coil.trace_width:
        return
    long = coil.shape in ("rectangle", "racetrack")
    words = f"coil.outer_diameter: {f'[{x * 1e3:g}, {across * 1e3:g}]' if long else f'{across * 1e3:g}'}"
    small = replace(spec, coil=replace(coil, size=(x if long else across, across)))
    for change in fewer_turns(small, coil.turns - (y - across) / 2.0 / coil.pitch, 0):
        fewer = f" with {change.words}" if change.spec.coil.turns != coil.turns else ""
        yield Change(f"{words}{fewer}", change.spec)


def other_ends(spec: SensorSpec) -> Iterator[Change]:
    """Other start angles, then a part of a turn less and more: what moves the layers' ends, and so their leads."""
    coil, parts = spec.coil, turn_fraction(spec.coil.shape) or 4
    corners = [360.0 * k / parts for k in range(1, parts)]
    for turned in (15.0, 30.0, 45.0, 90.0, 135.0, 180.0, 270.0) if coil.shape == "circle" else corners:
        angle = (math.degrees(coil.start_angle) + turned) % 360.0
        turned_coil = replace(coil, start_angle=math.radians(float(f"{angle:.6g}")))
        yield Change(f"coil.start_angle: {angle:.6g} deg", replace(spec, coil=turned_coil))
    fewer = fewer_turns(spec, coil.turns - 1.0 / parts, 0)
    more = more_turns(spec, 1.0 + 0.5 / (parts * coil.turns))
    yield from (change for change in (*fewer, *more) if change.spec.coil.turns != coil.turns)


def more_layers(spec: SensorSpec, factor: float) -> Iterator[Change]:
    """An even number of layers, so many times as many as now at least, then two more; on the stack-up as it is or on
    the first installed one that has as many.
    """
    coil, now = spec.coil, len(spec.coil.layers)
    if coil.unequal_turns or coil.layers != tuple(range(1, now + 1)):
        return
    first = max(2 * math.ceil(now * factor / 2.0 - 1e-9), now + 2 - now % 2)
    for count in range(first, min(first + 2, MOST_LAYERS) + 1, 2):
        wound, words = replace(coil, layers=tuple(range(1, count + 1))), f"coil.layers: {count}"
        if count <= len(spec.fpc.stackup.copper):
            yield Change(words, replace(spec, coil=wound))
            continue
        name = next((n for n in presets.names("stackup") if len(presets.stackup(n).copper) >= count), None)
        if name is not None:
            stackup = presets.stackup(name)
            rules = spec.fpc.rules.for_foil(stackup.foil_thickness(wound.layers))
            fpc = replace(spec.fpc, stackup=stackup, rules=rules)
            yield Change(f"{words} with fpc.stackup: {name}", replace(spec, coil=wound, fpc=fpc))


def wider(spec: SensorSpec, width: float, spacing: float) -> Iterator[Change]:
    """Tracks and gaps so wide (m) at least, with as many turns as now or as take the room of those."""
    coil = spec.coil
    width, spacing = (math.ceil(size * 1e7 - 1e-3) / 1e7 for size in (width, spacing))  # as it is written
    wide = replace(coil, trace_width=max(coil.trace_width, width), trace_spacing=max(coil.trace_spacing, spacing))
    words = [
        f"coil.{key}: {show(getattr(wide, key), 'm', 6)}"
        for key in ("trace_width", "trace_spacing")
        if getattr(wide, key) > getattr(coil, key) + 1e-12
    ]
    room = coil.turns * coil.pitch / wide.pitch
    for change in fewer_turns(replace(spec, coil=wide), room):
        fewer = [change.words] if change.spec.coil.turns != coil.turns else []
        yield Change(" with ".join([" and ".join(words), *fewer]), change.spec)


def capacitor(spec: SensorSpec, values: Iterable[float]) -> Iterator[Change]:
    """Tank capacitors (F), as they are written with two digits."""
    for value in values:
        rounded = float(f"{value:.1e}")
        readout = replace(spec.readout, capacitance=rounded)
        yield Change(f"readout.capacitance: {show(rounded, 'F', 2)}", replace(spec, readout=readout))


def scans(spec: SensorSpec, rate: float) -> Iterator[Change]:
    """So many scans a second (Hz)."""
    readout = replace(spec.readout, scan_rate=rate)
    yield Change(f"readout.scan_rate: {show(rate, 'Hz', 6)}", replace(spec, readout=readout))


def more_copper(spec: SensorSpec, factor: float, left: Left) -> str:
    """More turns or layers that mend a finding, in words, found by trying those that grow the coil by that factor."""
    families = [list(more_turns(spec, factor)), list(more_layers(spec, factor))]
    found = [change for change in (first_that_mends(changes, left) for changes in families) if change]
    if found:
        return f"{named(found)} mends it (it was tried)"
    if not any(families):
        return "no more of either fit into this outline: a larger coil or a finer pitch"
    most = " and ".join(changes[-1].words for changes in families if changes)
    broken = tuple(sorted({rule for changes in families for change in changes for rule in left(change.spec)}))
    vain = f"tried up to {most}: {fail(broken)}"
    return f"in this outline more of them do not mend it ({vain}); a larger coil or a finer pitch may"


def calmer_tail(spec: SensorSpec) -> Iterator[Change]:
    """A tail of one copper layer, then one that is bent only once."""
    tail = spec.fpc.tail
    assert tail is not None
    for words, calm in (("layers: 1", replace(tail, layers=1)), ("bend: static", replace(tail, bend="static"))):
        if calm != tail:
            yield Change(f"fpc.tail.{words}", replace(spec, fpc=replace(spec.fpc, tail=calm)))


def stiffer_pad(spec: SensorSpec, shear_modulus: float) -> Change:
    """An elastomer of so large a shear modulus (Pa), known as well as the one of now."""
    pad = spec.elastomer
    assert pad is not None
    stiff = replace(pad, material=replace(pad.material, shear_modulus=shear_modulus))
    return Change(f"a shear modulus of {show(shear_modulus, 'Pa', 3)} or more", replace(spec, elastomer=stiff))


def thicker_target(spec: SensorSpec, thickness: float) -> Change:
    """A target so thick (m) at least."""
    assert spec.target is not None
    thick = math.ceil(thickness * 1e6 - 1e-6) * 1e-6  # as it is written
    return Change(
        f"target.thickness: {show(thick, 'm', 6)}", replace(spec, target=replace(spec.target, thickness=thick))
    )


def larger_target(spec: SensorSpec, length: float, width: float) -> Iterator[Change]:
    """A target of such sides (m) on an elastomer that carries the whole of it, then on the one of now; one of a single
    size (a circle, a square) takes the larger side, then becomes a rectangle.
    """
    target, pad = spec.target, spec.elastomer
    assert target is not None
    for words, wanted in resized("target", target, (length, width)):
        here = footprint(spec, wanted)
        if pad is not None and here.hangs_over(footprint(spec, pad).outline()) > SAME:
            for under_it, larger in resized("elastomer", pad, carrying(footprint(spec, pad), here)):
                yield Change(f"{words} with {under_it}", replace(spec, target=wanted, elastomer=larger))
        yield Change(words, replace(spec, target=wanted))


SAME = 1e-9
"""Lengths that differ by less (m) are equal."""


def carrying(pad: Footprint, plate: Footprint) -> tuple[float, float]:
    """The sides (m) of a pad in its place that carries a plate and is no smaller than now; of a disc its diameter."""
    if pad.is_round:
        far = max((pad.centre.distance(p) for p in plate.corners), default=pad.centre.distance(plate.centre))
        side = max(2.0 * far + (plate.size[0] if plate.is_round else 0.0), pad.size[0])
        return (_ceiled(side),) * 2
    aside = abs(plate.centre.x - pad.centre.x), abs(plate.centre.y - pad.centre.y)
    x, y = (_ceiled(max(2.0 * (aside[k] + plate.reach[k]), pad.size[k])) for k in (0, 1))
    return x, y


def _ceiled(length: float) -> float:
    return round(math.ceil(length * 1e6 - 1e-3) * 1e-6, 9)  # as it is written


Plate = TypeVar("Plate", Target, ElastomerPad)


def resized(key: str, plate: Plate, size: tuple[float, float]) -> Iterator[tuple[str, Plate]]:
    """A plate of such sides (m), and how that is written; one of a single size (a circle, a square) takes the larger
    side, then becomes a rectangle.
    """
    sides = [f"{side * 1e3:.6g}" for side in size]
    rectangle = f"{key}.size: [{', '.join(sides)}]"
    if plate.shape == "rectangle":
        yield rectangle, replace(plate, size=size)
        return
    yield f"{key}.size: {max(size) * 1e3:.6g}", replace(plate, size=(max(size),) * 2)
    if size[0] != size[1]:
        yield f"{key}.shape: rectangle with {rectangle}", replace(plate, shape="rectangle", size=size)


def larger_capacitor(changes: list[Change], now: float, left: Left) -> str:
    """The first of some capacitors that mends a finding, in words, instead of the one of now (F)."""
    found = first_that_mends(changes, left)
    if found is not None:
        return f"{found.words} instead of {show(now, 'F', 3)} (it was tried), or more turns"
    vain = f" (tried in vain: {in_vain(changes, left)})" if changes else ""
    return f"more turns or layers, or a larger coil; a larger capacitor alone does not do{vain}"
