"""Measured values of a check (fit, closing jaws, signal) as text, table rows and JSON."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from sitscad.basics.quantities import FIT, FIT_PART, SIGNAL, Quantity, Table, by_quantity, by_result, plus_minus
from sitscad.basics.units import in_mm, show

if TYPE_CHECKING:
    from sitscad.basics.check_results import Closing, Measure, RequirementResult, Signal
    from sitscad.estimates.coil_estimates import CoilEstimate  # an unchanged build loads no estimates


def fit_lines(fit: Sequence[Measure], whole: bool = False) -> list[str]:
    """Return a line for each size of the sensor in its jaw, with its limit and the room that remains.

    A line has the worst-case size. With `whole`, it also has the nominal size, and the size with the root-sum-square of
    all tolerances.
    """
    lines = []
    for m in fit:
        nominal, likely, worst, limit = (
            in_mm(size, 3) for size in (m.nominal, m.root_sum_square, m.worst, m.limit)
        )
        cases = f"{nominal}, by root-sum-square {likely}, at worst {worst}" if whole else f"at worst {worst}"
        # only the measure of the board beside the face can be negative
        side = " (below zero: back from the face's edge)" if m.nominal < 0.0 else ""
        spare = f"{_length_text(m.margin, 3)} to spare"
        if m.margin < 0.0:
            likely = "" if m.likely_margin >= 0.0 else f" ({_length_text(-m.likely_margin, 3)} by root-sum-square)"
            spare = f"{_length_text(-m.margin, 3)} short{likely}"
        assumed = f", {m.assumption}" if m.assumption else ""
        lines.append(f"{m.name} {cases} of {limit} mm{side}, {spare}{assumed}")
    return lines


def fit_tables(fit: Sequence[Measure]) -> list[Table]:
    """Return two tables: sizes in the jaw with their limits, and parts between the closed jaws, the lowest first."""
    parts = [part for measure in fit[:1] for part in measure.parts]
    return [by_result(fit, FIT, "Fit in the jaw, as glued together"),
            by_result(parts, FIT_PART, "What the closed pair is made of")]


_TISSUE = (0.0, 0.5e-3, 1e-3, 2e-3, 3e-3, 5e-3)


def closing_text(closing: Closing) -> str:
    """Return a line with the tissue thickness at which the jaws' faces are parallel.

    The line also states by how much each further millimetre of tissue increases the angle between the faces.
    """
    tilt = closing.tilt(closing.parallel_at + 1e-3)
    leans = "" if tilt is None else f"; every millimetre more tilts them by {math.degrees(tilt):.1f} deg"
    if closing.parallel_at < 0.0:
        excess = _length_text(-closing.parallel_at, 3)
        return f"the sensor is {excess} too thick for faces that are ever parallel{leans}"
    return f"the faces are parallel on {_length_text(closing.parallel_at, 3)} of tissue{leans}"


def closing_table(closing: Closing) -> Table:
    """Return a table with one row per tissue thickness between the jaws.

    Columns are the thickness (mm), the angle between the faces (degrees), and the place that touches first (heel, tip
    or whole face). The last column is the distance by which the faces slide until they are parallel.
    """
    at = sorted({*_TISSUE, *([closing.parallel_at] if closing.parallel_at > 0.0 else [])})
    most = closing.most
    angles = [(t, closing.tilt(t)) for t in at if most is None or t <= most]
    rows = []
    for t, angle in angles:
        if angle is not None:
            first = "the whole face" if abs(angle) < 1e-6 else "the heel" if angle > 0.0 else "the tip"
            slide = _length_text(abs(closing.slide(t) or 0.0), 3)
            rows.append([_length_text(t, 3), f"{math.degrees(angle) + 0.0:.1f} deg", first, slide])
    return Table(("tissue", "angle between the faces", "touches first", "faces slide until parallel"), rows,
                 "The jaws about their hinge, on tissue between them at the sensor's middle")


def closing_json(closing: Closing) -> dict[str, Any]:
    """Return a dictionary for JSON that describes how the jaws close. Keys contain the units of their values."""
    return {
        "parallel_at_m": closing.parallel_at, "reach_m": closing.reach, "opening_rad": closing.opening,
        "most_m": closing.most, "pivot_offset_m": closing.offset,
        "tilt": [{"thickness_m": t, "tilt_rad": closing.tilt(t), "slide_m": closing.slide(t)} for t in _TISSUE],
    }


def _length_text(value: float, digits: int = 4) -> str:
    return show(round(value, 9) + 0.0, "m", digits)


SIGNAL_TITLE = "Signal from rest to the required force (inductance at the contacts, +- one sigma)"

NO_SIGNAL = (
    "none yet: with a target, an elastomer under it and requirements.normal_force the change per newton stands here"
)


def signal_lines(signals: Iterable[Signal]) -> list[str]:
    """Return lines on the signals of coils: the change of inductance per newton, and the relative change.

    The relative change is from rest to the required normal force. Coils with equal values share a line.
    """
    named: dict[str, list[str]] = {}
    for s in signals:
        change = plus_minus(s.per_newton, s.sigma, "H", "/N")
        text = f"{change}, {BY_INDUCTANCE.plain(s)} of the inductance at the contacts over {show(s.force, 'N')}"
        if s.has_loss_in_it:
            text += f" (of the reading {SHARE.plain(s)}: it follows losses, too)"
        named.setdefault(text, []).append(s.coil)
    return [f"{', '.join(coils)} {text}" for text, coils in named.items()]


def performance_text(reached: RequirementResult) -> str:
    """Return a line with a requirement's estimated value, its limit, the axis and the working point."""
    if reached.limit is None:
        requirement = reached.requirement.replace("_", " ")
        return f"{requirement} {show(reached.measured, reached.unit, 3)} ({reached.axis}, {reached.at})"
    value_text, limit_text = (show(value, reached.unit, 3) if reached.unit else f"{value:.2g}"
                    for value in (reached.measured, reached.limit))
    name = reached.requirement.replace("_", " ")
    name += " by noise alone" if name.endswith("resolution") else ""
    return f"{name} {value_text} of {limit_text} asked ({reached.axis}, {reached.at})"


def signal_table(signals: Sequence[Signal], coils: tuple[CoilEstimate, ...], drive_code: int | None) -> Table:
    """Return a table with a row for each quantity of `Signal`, and a column for each coil.

    If there are no signals, the table has the reason, or no row if `drive_code` is None.
    """
    if not signals:
        missing = [["change per newton", NO_SIGNAL]] if drive_code is not None else []
        return Table(["", ""], missing, SIGNAL_TITLE)
    by_name = {s.coil: s for s in signals}
    quantities = list(SIGNAL)
    if any(s.has_loss_in_it for s in signals):
        quantities.insert(-2, BY_INDUCTANCE)
    rows = by_quantity([by_name.get(coil.name) for coil in coils], quantities)
    return Table(["", *(coil.name for coil in coils)], rows,
                 f"{SIGNAL_TITLE}, {show(signals[0].force, 'N')}")


SHARE = next(each for each in SIGNAL if each.key == "share")
BY_INDUCTANCE = Quantity("by_inductance", "by the inductance alone: the reading follows losses, too", 3, is_share=True)

OTHERS_TITLE = "The same inductance as others see it: to compare with, not to judge by"

OTHERS_MEANING = (
    "at the contacts (all tables above): the coil with its leads; rules, limits and the change per newton are about it",
    "on an LCR meter: the coil's own capacitance lies across it, and so it reads more; for testing a board, at the "
    "sensor frequency",
    "by the firmware's formula: 1 / (C (2 pi f)^2), which counts the coil's own capacitance as inductance and a cable "
    "as coil; for comparing with what the header's formula makes of a reading",
)
"""Texts on the three inductances in the report: at the contacts, on an LCR meter, and from the firmware's formula.

Each states the definition and the use of one inductance.
"""
