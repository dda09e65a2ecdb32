"""What a check measures beside its findings (fit, closing jaws, signal), in words, rows and JSON."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from sitscad.scene.state import titled
from sitscad.units import NONE, in_mm, quantity, show

if TYPE_CHECKING:
    from sitscad.check_values import Closing, Measure, RequirementResult, Signal
    from sitscad.estimates import Estimates


class Table(NamedTuple):
    """A table as text and page have it: the heads of its columns, its rows (none: it is not shown), its title."""

    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    title: str


def plus_minus(value: float, sigma: float | None, unit: str, per: str = "", digits: int = 3) -> str:
    """A number and one sigma of it, in the number's unit unless sigma is far below it: ``1.15 +- 0.087 mm``."""
    shown = quantity(value, unit, digits)
    if sigma is None or not math.isfinite(sigma) or shown == NONE:
        return shown + (per if shown != NONE else "")
    number, _, name = shown.partition(" ")
    scatter, _, other = quantity(sigma, unit, 2).partition(" ")
    if name == other:
        return f"{number} +- {scatter} {name}{per}"
    if sigma < 0.01 * abs(value) or not float(number):
        return f"{shown}{per} +- {scatter} {other}{per}"
    scale = 10.0 ** round(math.log10(float(number) / value))
    return f"{number} +- {float(f'{sigma * scale:.2g}'):.7g} {name}{per}"


def fit_words(fit: Sequence[Measure], whole: bool = False) -> list[str]:
    """A line a measure: at worst, or in all three cases."""
    found = []
    for m in fit:
        nominal, likely, worst, limit = (
            in_mm(size, 3) for size in (m.nominal, m.root_sum_square, m.worst, m.limit)
        )
        cases = f"{nominal}, by root-sum-square {likely}, at worst {worst}" if whole else f"at worst {worst}"
        # only the board beside the face has a figure below zero
        side = " (below zero: back from the face's edge)" if m.nominal < 0.0 else ""
        spare = f"{_length(m.margin, 3)} to spare"
        if m.margin < 0.0:
            likely = "" if m.likely_margin >= 0.0 else f" ({_length(-m.likely_margin, 3)} by root-sum-square)"
            spare = f"{_length(-m.margin, 3)} short{likely}"
        found.append(f"{m.name} {cases} of {limit} mm{side}, {spare}")
    return found


def fit_table(fit: Sequence[Measure]) -> Table:
    """The measures of the fit, a row each."""
    head = "measure", "nominal", "root-sum-square", "at worst", "limit", "to spare at worst", "decided by"
    rows = []
    for m in fit:
        sizes = map(_length, (m.nominal, m.root_sum_square, m.worst, m.limit, m.margin))
        rows.append([m.name, *sizes, m.decided_by])
    return Table(head, rows, "Fit in the jaw, as glued together")


def part_table(fit: Sequence[Measure]) -> Table:
    """What the first measure, the closed pair, is made of, from the jaw upwards."""
    rows = [
        [share.part, _length(share.nominal) if share.nominal else "", f"+-{_length(share.tolerance)}", share.source]
        for measure in fit[:1]
        for share in measure.parts
    ]
    return Table(("part", "size", "tolerance", "where that comes from"), rows, "What the closed pair is made of")


MEASURE = {
    "name": "name", "nominal_m": "nominal", "root_sum_square_m": "root_sum_square", "worst_m": "worst",
    "limit_m": "limit", "margin_m": "margin", "decided_by": "decided_by",
}
"""What JSON says of a measure beside its parts, and the fields of `Measure` that it stands for (the margin follows)."""

SHARE = {"part": "part", "nominal_m": "nominal", "tolerance_m": "tolerance", "source": "source"}
"""What JSON says of a part, and the fields of `Share` that it stands for."""


_TISSUE = (0.0, 0.5e-3, 1e-3, 2e-3, 3e-3, 5e-3)


def closing_words(closing: Closing) -> str:
    """The grasped thickness at which the faces are parallel, and how much they tilt on thicker tissue, in one line."""
    tilt = closing.tilt(closing.parallel_at + 1e-3)
    leans = "" if tilt is None else f"; every millimetre more tilts them by {math.degrees(tilt):.1f} deg"
    if closing.parallel_at < 0.0:
        return f"the sensor is {_length(-closing.parallel_at, 3)} too thick for faces that are ever parallel{leans}"
    return f"the faces are parallel on {_length(closing.parallel_at, 3)} of tissue{leans}"


def closing_table(closing: Closing) -> Table:
    """Thicknesses of tissue, and how the faces stand on them."""
    at = sorted({*_TISSUE, *([closing.parallel_at] if closing.parallel_at > 0.0 else [])})
    most = closing.most
    angles = [(t, closing.tilt(t)) for t in at if most is None or t <= most]
    rows = []
    for t, angle in angles:
        if angle is not None:
            first = "the whole face" if abs(angle) < 1e-6 else "the heel" if angle > 0.0 else "the tip"
            slide = _length(abs(closing.slide(t) or 0.0), 3)
            rows.append([_length(t, 3), f"{math.degrees(angle) + 0.0:.1f} deg", first, slide])
    return Table(("tissue", "angle between the faces", "touches first", "faces slide until parallel"), rows,
                 "The jaws about their hinge, on tissue between them at the sensor's middle")


def closing_json(closing: Closing) -> dict[str, Any]:
    """How the jaws close, as plain values for JSON."""
    return {
        "parallel_at_m": closing.parallel_at, "reach_m": closing.reach, "opening_rad": closing.opening,
        "most_m": closing.most, "pivot_offset_m": closing.offset,
        "tilt": [{"thickness_m": t, "tilt_rad": closing.tilt(t), "slide_m": closing.slide(t)} for t in _TISSUE],
    }


def _length(value: float, digits: int = 4) -> str:
    return show(round(value, 9) + 0.0, "m", digits)


SIGNAL_TITLE = "Signal from rest to the required force (inductance at the contacts, +- one sigma)"

NO_SIGNAL = (
    "none yet: with a target, an elastomer under it and requirements.normal_force the change per newton stands here"
)


def headline(signals: Iterable[Signal]) -> list[str]:
    """The inductance's change per newton, and how much of it that is over the required force; alike coils together."""
    named: dict[str, list[str]] = {}
    for s in signals:
        change = plus_minus(s.per_newton, s.sigma, "H", "/N")
        words = f"{change}, {_percent(s.by_inductance)} of the inductance at the contacts over {show(s.force, 'N')}"
        if s.has_loss_in_it:
            words += f" (of the reading {_percent(s.share)}: it follows losses, too)"
        named.setdefault(words, []).append(s.coil)
    return [f"{', '.join(coils)} {words}" for words, coils in named.items()]


def felt_words(reached: RequirementResult) -> str:
    """What is felt beside what is required: the figure, what is asked, and where the figure is."""
    if reached.limit is None:
        words = reached.requirement.replace("_", " ")
        return f"{words} {show(reached.measured, reached.unit, 3)} ({reached.axis}, {reached.at})"
    found, asked = (show(value, reached.unit, 3) if reached.unit else f"{value:.2g}"
                    for value in (reached.measured, reached.limit))
    name = reached.requirement.replace("_", " ")
    name += " by noise alone" if name.endswith("resolution") else ""
    return f"{name} {found} of {asked} asked ({reached.axis}, {reached.at})"


def signal_rows(signals: Sequence[Signal], estimates: Estimates) -> list[list[str]]:
    """Each quantity of the signal with one value a coil; what is missing for it where there is none."""
    if not signals:
        return [["change per newton", NO_SIGNAL]] if estimates.readout.drive_code is not None else []
    by_name = {s.coil: s for s in signals}
    found = [by_name.get(coil.name) for coil in estimates.coils]
    rows: list[tuple[str, Callable[[Signal], str]]] = [
        ("inductance at rest", lambda s: quantity(s.rest, "H")),
        ("change per newton", lambda s: plus_minus(s.per_newton, s.sigma, "H", "/N")),
        (f"of the reading (the converter's formula), over {show(signals[0].force, 'N')}", lambda s: _percent(s.share)),
        ("steps of the converter in that", lambda s: quantity(s.steps, "", 3)),
        ("frequency per newton", lambda s: plus_minus(s.frequency_per_newton, s.frequency_sigma, "Hz", "/N")),
    ]
    if any(s.has_loss_in_it for s in signals):
        alone = "by the inductance alone: the reading follows losses, too"
        rows.insert(4, (alone, lambda s: _percent(s.by_inductance)))
    return [[name, *(value(s) if s else NONE for s in found)] for name, value in rows]


OTHERS_TITLE = "The same inductance as others see it: to compare with, not to judge by"

OTHERS_HEAD = ("coil", "state", "on an LCR meter", "by the firmware's formula")

OTHERS_MEANING = (
    "at the contacts (all tables above): the coil with its leads; rules, limits and the change per newton are about it",
    "on an LCR meter: the coil's own capacitance lies across it, and so it reads more; for testing a board, at the "
    "sensor frequency",
    "by the firmware's formula: 1 / (C (2 pi f)^2), which counts the coil's own capacitance as inductance and a cable "
    "as coil; for comparing with what the header's formula makes of a reading",
)
"""What each of the three inductances is for."""


def other_rows(estimates: Estimates) -> list[list[str]]:
    """What a meter at the contacts reads in every state, and what the firmware's formula gives there."""
    found = ((coil.name, coil.converter_sensitivity(estimates.normal_force)) for coil in estimates.coils)
    return [
        [
            coil.name, titled(state.state), quantity(state.apparent_inductance, "H"),
            quantity(state.converter_inductance, "H"),
        ]
        for coil in estimates.coils
        for state in coil.states.values()
        if state.quantum is not None
    ] + [[name, "per newton", NONE, plus_minus(pair[0], pair[1], "H", "/N")] for name, pair in found if pair]


def _percent(share: float) -> str:
    percent = 100.0 * share
    return f"{percent:+.1f} %" if abs(percent) >= 0.995 else f"{percent:+.2g} %"  # 0.995 is 1.0 in two digits
