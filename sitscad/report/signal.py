"""The signal in words and rows, and which of a coil's three inductances is for what."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING

from sitscad.report.quantities import NONE, plus_minus, quantity
from sitscad.scene.state import titled
from sitscad.units import show

if TYPE_CHECKING:
    from sitscad.estimates import Estimates
    from sitscad.measured import Most, Reached, Signal

SIGNAL_TITLE = "Signal from rest to the required force (inductance at the contacts, +- one sigma)"

NO_SIGNAL = (
    "none yet: with a target, an elastomer under it and requirements.normal_force the change per newton stands here"
)


def headline(signals: Iterable[Signal]) -> list[str]:
    """The inductance's change per newton, and how much of it that is over the required force; alike coils together."""
    named: dict[str, list[str]] = {}
    for s in signals:
        change = plus_minus(s.per_newton, s.sigma, "H", "/N")
        words = f"{change}, {_percent(s.by_inductance)} of the inductance over {show(s.force, 'N')}"
        if s.has_loss_in_it:
            words += f" (of the reading {_percent(s.share)}: it follows losses, too)"
        named.setdefault(words, []).append(s.coil)
    return [f"{', '.join(coils)} {words}" for words, coils in named.items()]


def felt_words(reached: Reached) -> str:
    """What is felt beside what is required: the figure, what is asked, and where the figure is."""
    if reached.limit is None:
        return f"temperature moves zero by {show(reached.measured, reached.unit, 2)} ({reached.axis}) {reached.at}"
    found, asked = (show(value, reached.unit, 3) if reached.unit else f"{value:.2g}"
                    for value in (reached.measured, reached.limit))  # fmt: skip
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
        (f"of the reading, over {show(signals[0].force, 'N')}", lambda s: _percent(s.share)),
        ("steps of the converter in that", lambda s: quantity(s.steps, "", 3)),
        (
            "frequency per newton",
            lambda s: plus_minus(s.frequency_per_newton, s.frequency_sigma, "Hz", "/N"),
        ),
    ]
    if any(s.has_loss_in_it for s in signals):
        alone = "by the inductance alone: the reading follows losses, too"
        rows.insert(4, (alone, lambda s: _percent(s.by_inductance)))
    return [[name, *(value(s) if s else NONE for s in found)] for name, value in rows]


MOST_TITLE = "Most signal per newton, all else as it is (within a few per cent: the target as an endless plate's share)"

MOST_HEAD = ("part", "thickness", "change per newton", "thickness now", "now", "ended by")


def most_rows(found: Iterable[Most]) -> list[list[str]]:
    """How thick pad and target are with which the inductance changes most, a row a part, in mm as a spec has them."""
    return [[one.part, f"{1e3 * one.thickness:.4g} mm", f"{quantity(one.per_newton, 'H', 3)}/N",
             f"{1e3 * one.thickness_now:.4g} mm", f"{quantity(one.per_newton_now, 'H', 3)}/N", one.ended_by or NONE]
            for one in found]  # fmt: skip


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
    return [
        [
            coil.name,
            titled(state.state),
            quantity(state.apparent_inductance, "H"),
            quantity(state.converter_inductance, "H"),
        ]
        for coil in estimates.coils
        for state in coil.states.values()
        if state.quantum is not None
    ] + _formula_per_newton(estimates)


def _formula_per_newton(estimates: Estimates) -> list[list[str]]:
    found = ((coil.name, coil.converter_sensitivity(estimates.normal_force)) for coil in estimates.coils)
    return [[name, "per newton", NONE, plus_minus(pair[0], pair[1], "H", "/N")] for name, pair in found if pair]


def _percent(share: float) -> str:
    percent = 100.0 * share
    return f"{percent:+.1f} %" if abs(percent) >= 0.995 else f"{percent:+.2g} %"  # 0.995 is 1.0 in two digits
