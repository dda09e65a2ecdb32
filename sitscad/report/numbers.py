"""An estimate as text for a person and as JSON for a program. A new format is one function and one row of the table."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from sitscad.estimates.performance.values import largest_lasting
from sitscad.estimates.quantities import TANK, field_and_unit, figure_text, sensor_rows
from sitscad.report.findings import CheckedSpec, OutputOptions, finding_json, printable, styled, to_json
from sitscad.report.findings import as_text as as_findings
from sitscad.report.findings.measures import (
    OTHERS_HEAD,
    OTHERS_MEANING,
    OTHERS_TITLE,
    SIGNAL_TITLE,
    Table,
    other_rows,
    plus_minus,
    signal_rows,
)
from sitscad.scene.state import FREE, NAMED, titled
from sitscad.units import NONE, quantity, show
from sitscad.version import __version__

if TYPE_CHECKING:
    from sitscad.estimates import Estimates, ReadoutEstimate
    from sitscad.estimates.at_frequency import CoilAtFrequency
    from sitscad.estimates.performance.values import Performance
    from sitscad.estimates.values import StateEstimate

    Felt = Sequence[Performance] | None


def as_text(
    path: str, estimates: Estimates | None, checked: CheckedSpec, colour: bool = False, felt: Felt = None,
    cells: Mapping[str, Any] | None = None, at: Sequence[CoilAtFrequency] = (),
) -> str:
    """Tables of coils, states and readout settings, then the cross-checks and what the numbers leave out."""
    if estimates is None:
        why = styled(f"{printable(path)} could not be read, so nothing was estimated", "red", colour)
        return f"{as_findings([checked], OutputOptions(colour))}{why}\n"
    from sitscad.estimates.signal import signals  # loads what an unreadable spec does not need

    names, pressed = ["", *(coil.name for coil in estimates.coils)], signals(estimates)
    blocks = [
        styled(printable(estimates.incomplete), "red", colour) if estimates.incomplete else "",
        _titled(SIGNAL_TITLE, table(names if pressed else [], signal_rows(pressed, estimates)), colour),
        table_text(at_table(at), colour),
        table_text(state_table(estimates), colour),
        _titled("Coils", table(names, coil_rows(estimates)), colour),
        _titled(PARTS_TITLE, table(names, part_rows(estimates)), colour),
        table_text(reading_table(estimates), colour),
        _titled(OTHERS_TITLE, [*table(OTHERS_HEAD, other_rows(estimates)), *OTHERS_MEANING], colour),
        _titled(CELLS_TITLE, table(*head_and_rows(cells["in_words"] if cells else ())), colour),
        *felt_blocks(felt or (), colour),
        table_text(spread_table(estimates), colour),
        _matrix(estimates, colour),
        _titled(f"Readout ({estimates.readout.device.part})", table([], readout_rows(estimates)), colour),
        _titled(GAPS_TITLE, table([], gap_rows(estimates)), colour),
        _titled(PRESSED_TITLE, table([], compression_rows(estimates)), colour),
        _titled("Cross-checks", table(CROSS_HEAD, cross_check_rows(estimates)), colour),
        *(f"note: {printable(str(note))}" for note in estimates.notes if note != estimates.incomplete),
    ]
    return "\n\n".join([styled(printable(path), "bold", colour), *(block for block in blocks if block)]) + "\n"


def felt_blocks(felt: Sequence[Performance], colour: bool) -> list[str]:
    """What the sensor feels as blocks of text: the table by load and axis, then its notes; none without a target."""
    if not felt:
        return []
    points = [point.document() for point in felt]
    by_axis = felt[-1].axes
    axes = [f"{name} {'mN mm' if axis.unit == 'N m' else 'mN'}" for name, axis in by_axis.items()]
    causes = ([cause, *(_milli(axis.errors[cause], 1e3 if axis.unit == "N m" else 1.0) for axis in by_axis.values())]
              for cause in next(iter(by_axis.values())).errors)
    blocks = (
        [styled(felt_title(points), "bold", colour), *table(FELT_HEAD, felt_rows(points))],
        [styled(CAUSES_TITLE, "bold", colour), *table(("cause", *axes), causes)],
        [f"note: {note}" for note in felt[-1].notes],
    )
    return ["\n".join(block) for block in blocks if block]


CAUSES_TITLE = "Errors at full load by cause, one sigma; of tilts and of what a sign is known of, the size"


def as_json(
    path: str, estimates: Estimates | None, checked: CheckedSpec, colour: bool = False, felt: Felt = None,
    cells: Mapping[str, Any] | None = None, at: Sequence[CoilAtFrequency] = (),
) -> str:
    """Return the JSON document of ``estimate``.

    It has ``at_frequency``, ``performance`` and the performance of `cells` if the options ask for them. For an
    unreadable spec it has no coils, and ``findings`` give the reason.
    """
    if estimates is None:
        findings = [finding_json(finding) for finding in checked.findings]
        nothing = {"sitscad": __version__, "spec": path, "coils": [], "inductance_matrix_H": []}
        return to_json(nothing | {"findings": findings})
    asked: dict[str, Any] = {} if felt is None else {"performance": [point.document() for point in felt]}
    asked |= {"cells": cells} if cells else {}
    asked |= {"at_frequency": [coil.document() for coil in at]} if at else {}
    return to_json({**estimates.as_json(path), **asked})


CELLS_TITLE = "Cell by cell: below, each figure of what the sensor feels is that of the worst cell of those solved"


Shown = Callable[
    [str, "Estimates | None", CheckedSpec, bool, "Felt", "Mapping[str, Any] | None", "Sequence[CoilAtFrequency]"], str
]

ESTIMATE_FORMATS: Mapping[str, Shown] = {"text": as_text, "json": as_json}
"""Output formats of ``estimate``. Each function takes the path as typed, the estimate (None if the spec is unreadable),
findings, whether to use colour, the performance (None without --performance), the performance of
each cell, and the coils at the frequencies of --at."""


def coil_rows(estimates: Estimates) -> list[list[str]]:
    """Each quantity of the coils with one value a coil."""
    rows = (
        ("winding inductance, direct current spread evenly", "winding_inductance_H"),
        ("its relative error, at most", lambda c: f"{c.inductance_error:.1e}"),
        ("method", lambda c: str(c.method)),
        ("terminal inductance, free, at the sensor frequency", "terminal_inductance_H"),
        ("of that, leads and tail", "lead_inductance_H"),
        (f"winding resistance, direct current, {estimates.temperature:g} C", "resistance_dc_ohm"),
        ("winding resistance, sensor frequency", "resistance_ac_ohm"),
        ("relative error of that resistance, at most", lambda c: percent(c.resistance_error)),
        ("contact to contact, direct current", "terminal_resistance_dc_ohm"),
        ("tank capacitance, in all", "capacitance_F"),
        ("of that, the coil's own, with leads and tail", "self_capacitance_F"),
        ("- between its layers and turns", "winding_capacitance_F"),
        ("- of leads and tail", lambda c: quantity(c.self_capacitance - c.winding_capacitance, "F")),
        ("sensor frequency, free", "sensor_frequency_Hz"),
        ("self-resonance", "self_resonance_Hz"),
        ("length of the track", "trace_length_m"),
        ("inner diameter, between copper edges", "inner_diameter_m"),
    )
    found = [[name, *(figure_text(c, figure) if isinstance(figure, str) else figure(c) for c in estimates.coils)]
             for name, figure in rows]
    # How far off the computed resistance of each state can be, one value a coil; nothing where none is known
    by_state = []
    for state in NAMED:
        errors = [coil.states[state].resistance_error if state in coil.states else None for coil in estimates.coils]
        if any(error is not None for error in errors):
            name = f"resistance at the contacts, {titled(state)}: relative error, at most"
            by_state.append([name, *map(percent, errors)])
    changes = [coil.resistance_change for coil in estimates.coils]
    if any(changes):
        either = [" (either sign)" if c and c[1] > abs(c[0]) else "" for c in changes]
        words = [plus_minus(*c, "ohm") + more if c else NONE for c, more in zip(changes, either, strict=True)]
        by_state.append(["- its change from rest to pressed", *words])
    return found + by_state


def percent(share: float | None) -> str:
    """A share in per cent, or a dash for what is absent or not finite."""
    return f"{100.0 * share:.2g} %" if share is not None and math.isfinite(share) else NONE


PARTS_TITLE = "What the terminal inductance is made of (the coil alone, at its sensor frequency)"

PART_WORDS = {
    "winding": "winding, direct current spread evenly over its tracks",
    "bends": "direct current cuts corners (runs inside bends): change",
    "stubs": "stubs at the layers' ends",
    "leads": "leads on the body, down to their lane in the tail",
    "tail": "tail, to the contacts",
    "coupling": "coupling of stubs, leads and tail with the winding",
    "vias": "vias",
    "crowding": "current crowds at that frequency (skin, proximity)",
}
"""What the parts of the terminal inductance are called."""


def part_rows(estimates: Estimates) -> list[list[str]]:
    """The parts of the terminal inductance, all in nanohenries and rounded alike, with their sum and its frequency."""
    largest = max((abs(coil.winding_inductance) for coil in estimates.coils), default=0.0)
    if not any(coil.inductance_parts for coil in estimates.coils) or largest <= 0.0:
        return []
    places = max(2, 4 - math.floor(math.log10(largest * 1e9)))

    def nanohenries(value: float | None) -> str:
        return f"{value * 1e9:.{places}f} nH" if value is not None and math.isfinite(value) else NONE

    names = [name for name in PART_WORDS if any(name in coil.inductance_parts for coil in estimates.coils)]
    rows = [[PART_WORDS[n], *(nanohenries(c.inductance_parts.get(n)) for c in estimates.coils)] for n in names]
    frequencies = [quantity(coil.sensor_frequency, "Hz") for coil in estimates.coils]
    sums = [nanohenries(coil.terminal_inductance) for coil in estimates.coils]
    return [["sensor frequency", *frequencies], *rows, ["sum: terminal inductance at that frequency", *sums]]


def _by_state(
    estimates: Estimates, title: str, columns: Mapping[str, Callable[[StateEstimate], str]], needed: str = "state"
) -> Table:
    """One row a coil and state, of states that have what is `needed` alone (a field of theirs)."""
    found = [(coil.name, state) for coil in estimates.coils for state in coil.states.values()]
    rows = [[name, titled(state.state), *(told(state) for told in columns.values())]
            for name, state in found if getattr(state, needed) is not None]
    return Table(("coil", "state", *columns), rows, title)


AT_TITLE = "Coil alone at a frequency, no metal near: first the winding without leads, then between the contacts"


def at_table(coils: Sequence[CoilAtFrequency]) -> Table:
    """Return a table with one row for each coil and frequency. Empty if there are no coils."""
    head = ("coil", "frequency", "winding L", "+-", "winding R", "+-", "Q", "L", "R", "+-", "Q", "L, R on an LCR meter")
    rows = [[
        coil.coil, quantity(coil.frequency, "Hz"), quantity(coil.winding_inductance, "H"),
        percent(coil.winding_inductance_error), quantity(coil.winding_resistance, "ohm"),
        percent(coil.winding_resistance_error), quantity(coil.winding_quality_factor, "", 3),
        quantity(coil.inductance, "H"), quantity(coil.resistance, "ohm"), percent(coil.resistance_error),
        quantity(coil.quality_factor, "", 3),
        f"{quantity(coil.apparent_inductance, 'H')}, {quantity(coil.apparent_resistance, 'ohm')}",
    ] for coil in coils]
    return Table(head, rows, AT_TITLE)


def state_table(estimates: Estimates) -> Table:
    """What the tank is at the contacts in every state."""
    return _by_state(estimates, "At the contacts, leads included: what rules and limits judge",
                     {name: partial(figure_text, key=key, digits=digits) for name, (key, digits) in TANK.items()})


def reading_table(estimates: Estimates) -> Table:
    """One step of the converter in every state and one sigma of the noise of quantisation alone, in henries."""
    columns = {"step": "quantum_H", "quantisation noise (step / sqrt 12)": "noise_H",
               "amplitude at the coil": "coil_amplitude_V"}
    return _by_state(estimates, "What the converter resolves",
                     {name: partial(figure_text, key=key, digits=3) for name, key in columns.items()}, "quantum")


def spread_table(estimates: Estimates) -> Table:
    """One sigma of every state's numbers by the tolerances of manufacture, relative, and the largest cause for Rp."""
    def share(name: str) -> Callable[[StateEstimate], str]:
        return lambda s: _share(getattr(s.spread, name), getattr(s, name))

    columns = {name: share(field_and_unit(key)[0]) for name, (key, _) in TANK.items() if name != "Q"}
    columns["Rp mostly by"] = lambda s: s.spread.causes.get("parallel_resistance", NONE) if s.spread else NONE
    return _by_state(estimates, "Scatter of manufacture, one sigma", columns, "spread")


def _share(part: float, whole: float) -> str:
    return f"{100.0 * part / whole:.2g} %" if whole and math.isfinite(part / whole) else NONE


def matrix_rows(estimates: Estimates) -> list[list[str]]:
    """The inductance matrix, one row a coil."""
    names = (coil.name for coil in estimates.coils)
    matrix = zip(names, estimates.inductance_matrix, strict=True)
    return [[name, *(quantity(float(value), "H") for value in row)] for name, row in matrix]


def readout_rows(estimates: Estimates) -> list[list[str]]:
    """The settings of the converter, with the reason for the capacitor."""
    r = estimates.readout
    clock = quantity(r.reference_frequency * r.reference_divider, "Hz")
    least = show(r.device.limit("amplitude_optimum_min"), "V")
    # none where all channels have one code
    codes = ", ".join(f"{coil.name} {code}" for coil, code in zip(estimates.coils, r.drive_codes, strict=False))
    return [
        ["tank capacitor", quantity(r.capacitance, "F")],
        ["why this one", str(r.capacitance_reason)],
        *([["its tolerance, assumed", f"{100.0 * r.capacitor_tolerance:g} %"]] if r.capacitor_tolerance else []),
        *(
            [["C in L = 1 / (C (2 pi f)^2): capacitor, pins, cable", quantity(r.conversion_capacitance, "F")]]
            if r.conversion_capacitance
            else []
        ),
        ["drive current", f"{quantity(r.drive_current, 'A')} (code {_count(r.drive_code)})"],
        *([["a code for every channel", f"{codes}: one for all leaves a coil below {least}"]] if r.drive_codes else []),
        [
            "reference frequency f_REF",
            f"{quantity(r.reference_frequency, 'Hz')} (f_CLK {clock}, divider {r.reference_divider})",
        ],
        ["input divider", _count(r.input_divider)],
        *([["result", f"{r.result_in_words}, OFFSETx {', '.join(map(str, r.offsets))}"]] if r.result_in_words else []),
        ["RCOUNT", _count(r.rcount)],
        ["SETTLECOUNT", _count(r.settle_count)],
        *_timing_rows(r, len(estimates.coils)),
        ["scans of all coils a second", quantity(r.scan_rate, "")],
        ["high-current drive", "yes" if r.high_current else "no"],
        *([["supply current, about", quantity(r.supply_current, "A", 3)]] if r.supply_current else []),
    ]


def _count(value: int | None) -> str:
    return NONE if value is None else str(value)


def _timing_rows(r: ReadoutEstimate, coils: int) -> list[list[str]]:
    """What a conversion takes: of a coil alone nothing is switched, and it settles once, after the start."""
    alone = coils == 1 and r.settle_time is not None
    parts = [("- conversion", r.conversion_time)]
    if alone:
        rows = [["from one result of the coil to the next", quantity(r.dwell_time - (r.settle_time or 0.0), "s")]]
        parts += [
            ("- pause between conversions, taken as long as a switch of channels", r.switch_time),
            ("settling, once, before the first conversion", r.settle_time),
        ]
    else:
        rows = [["time on one coil, of every scan", quantity(r.dwell_time, "s")]]
        parts = [("- settling", r.settle_time), *parts, ("- switching to the next coil", r.switch_time)]
    rows += [[name, quantity(value, "s")] for name, value in parts if value is not None]
    if r.read_back_time is not None:
        clock = r.device.serial_clock_in_words
        rows.append([f"reading all results over I2C at {clock}", quantity(r.read_back_time, "s", 3)])
        rows.append(["scans a second that I2C can carry", quantity(r.readable_rate, "")])
    return rows


GAPS_TITLE = "Gaps, +- one sigma"
PRESSED_TITLE = "Elastomer under the required force, +- one sigma"


def gap_rows(estimates: Estimates) -> list[list[str]]:
    """The gaps by their names."""
    return [
        [titled(name), plus_minus(gap, estimates.gap_sigmas.get(name), "m", digits=4)]
        for name, gap in estimates.gaps.items()
    ]


def incoming_table(bench: Estimates) -> Table:
    """What a usual meter and one at the tank's frequency read of each coil, two rows a coil."""
    found = []
    for read, coil in zip(bench.metered, bench.coils, strict=False):
        usual = [coil.name, quantity(read.frequency, "Hz"),
                 plus_minus(read.inductance, read.inductance_sigma, "H", digits=4),
                 plus_minus(read.resistance, read.resistance_sigma, "ohm"), percent(read.resistance_error),
                 plus_minus(read.direct, read.direct_sigma, "ohm"), NONE]
        found.append(usual)
        if (free := coil.states.get(FREE)) is not None:
            by_l, by_r, by_f = (getattr(free.spread, name, None) for name in ("inductance", "resistance", "frequency"))
            found.append([coil.name, quantity(free.frequency, "Hz"),
                          plus_minus(free.apparent_inductance or math.nan, by_l, "H", digits=4),
                          plus_minus(free.resistance, by_r, "ohm"), percent(free.resistance_error), NONE,
                          plus_minus(free.frequency, by_f, "Hz")])
    head = "coil", "meter at", "inductance read", "resistance", "computed within", "direct current", "in the tank"
    title = "The bare board when it comes, at 20 degC, far from metal: between a coil's contacts, +- one sigma"
    return Table(head, found, title)


def compression_rows(estimates: Estimates) -> list[list[str]]:
    """What the required force does to the elastomer, a row a figure; none without an elastomer and a force."""
    pressed = estimates.compression
    if pressed is None:
        return []
    scatter = estimates.compression_scatter
    strain = f"{100.0 * pressed.strain:.1f}" + (f" +- {100.0 * scatter.strain:.2g} %" if scatter else " %")
    area = f"{pressed.loaded_area * 1e6:.4g} mm2, {100.0 * pressed.loaded_share:.0f} % of the pad"
    at_least = ""
    if pressed.strain - pressed.least_strain > 1e-3:
        at_least = f" (at least {100.0 * pressed.least_strain:.1f} %: only part of the pad is loaded)"
    return [
        ["loaded area", area],
        ["strain", f"{strain}{at_least}"],
        ["thickness left", plus_minus(pressed.gap, scatter.gap if scatter else None, "m", digits=4)],
        ["shape factor", f"{pressed.shape_factor:.3g}"],
        [
            "apparent modulus",
            plus_minus(pressed.apparent_modulus, scatter.apparent_modulus if scatter else None, "Pa", digits=4),
        ],
        *([["one sigma of the strain mostly by", scatter.cause]] if scatter else []),
        ["formula within its range", "yes" if pressed.valid else "NO"],
        ["against finite elements", "one sigma of 2.5 % where the law was held against them, 5 % beyond"],
        *([["remark", pressed.note]] if pressed.note else []),
    ]


CROSS_HEAD = ("coil", "formula", "inductance", "against ours", "in its range", "range")


def cross_check_rows(estimates: Estimates) -> list[list[str]]:
    """The closed formulas beside the estimate, each with its range of validity."""
    if estimates.no_cross_check:
        return [[NONE, "none", NONE, NONE, NONE, estimates.no_cross_check]]
    return [
        [
            check.coil, check.method, quantity(check.inductance, "H"),
            f"{100.0 * check.deviation:+.1f} %" if math.isfinite(check.deviation) else NONE,
            "yes" if check.is_valid else "no", check.validity,
        ]
        for check in estimates.cross_checks
    ]


def head_and_rows(lines: Sequence[Sequence[str]]) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
    """The head of a table, which is the first of its lines, and its rows; both empty where there are no lines."""
    return (lines[0], lines[1:]) if lines else ((), ())


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Lines of aligned columns, numbers to the right and words to the left; none without rows."""
    body = [[printable(str(cell)) for cell in row] for row in rows]
    if not body:
        return []
    cells = [list(head), *body] if head else body
    widths = [max(len(row[i]) for row in cells) for i in range(len(cells[0]))]
    aligned = [">" if is_number else "<" for is_number in number_columns(body)]
    pairs = list(zip(aligned, widths, strict=True))
    lines = ([f"{cell:{side}{width}}" for cell, (side, width) in zip(row, pairs, strict=True)] for row in cells)
    return ["  ".join(line).rstrip() for line in lines]


def html_table(head: Sequence[str], rows: Iterable[Sequence[str]], caption: str) -> str:
    """The table for a page; nothing without rows."""
    from sitscad.drawing import web_page  # text needs none of it

    lines = [[str(cell) for cell in row] for row in rows]
    return web_page.table(head, lines, number_columns(lines), caption)


def number_columns(rows: Sequence[Sequence[str]]) -> list[bool]:
    """Whether all cells of a column are numbers or dashes, for every column."""
    return [all(cell[:1] in _NUMERIC for cell in column) for column in zip(*rows, strict=True)]


_NUMERIC = frozenset("0123456789+-")


def _titled(title: str, lines: Sequence[str], colour: bool) -> str:
    return "\n".join([styled(title, "bold", colour), *(f"  {line}" for line in lines)]) if lines else ""


def table_text(found: Table, colour: bool = False) -> str:
    """Return a table under its title. Empty if it has no rows."""
    return _titled(found.title, table(found.head, found.rows), colour)


def _matrix(estimates: Estimates, colour: bool) -> str:
    if len(estimates.coils) < 2:
        return ""
    names = ["", *(coil.name for coil in estimates.coils)]
    lines = table(names, matrix_rows(estimates))
    pairs = zip(estimates.inductance_matrix, estimates.inductance_matrix_error, strict=False)
    shares = [
        error / abs(value)
        for i, (values, errors) in enumerate(pairs)
        for j, (value, error) in enumerate(zip(values, errors, strict=True))
        if i != j and value
    ]
    lines += [f"mutual ones to {max(shares):.1g} of their value, at most"] if shares else []
    return _titled("Inductance matrix of the windings", lines, colour)


Document = Mapping[str, Any]

FELT_TITLE = (
    "What the sensor feels, after a tare at rest, its target kept level; error: by the largest single cause that "
    "neither tare nor calibration takes away"
)


def felt_title(felt: Sequence[Document]) -> str:
    """The title of that table. Where moments are felt, the target is free to tilt."""
    if not any("range_Nm" in axis for axis in felt[-1]["axes"].values()):
        return FELT_TITLE
    return FELT_TITLE.replace("kept level", "free to tilt, moments in N mm and mN mm")


FELT_HEAD = ("load", "axis", "range N", "ended by", "noise mN", "nonlinear %", "crosstalk %", "error mN", "mostly by",
             "condition")


def felt_rows(felt: Sequence[Document]) -> Iterator[list[str]]:
    """The rows of what the sensor feels, one a working point and axis."""
    for point in felt:
        for name, axis in point["axes"].items():
            unit = "Nm" if "range_Nm" in axis else "N"
            error, cause = largest_lasting(axis[f"errors_{unit}"])
            cross, scale = max(point["crosstalk"][name].values(), default=0.0), 1e3 if unit == "Nm" else 1.0
            yield [
                point["at"], f"{name}, N mm" if unit == "Nm" else name, f"{scale * axis[f'range_{unit}']:.3g}",
                axis["limited_by"], _milli(axis[f"resolution_{unit}"], scale),
                _hundredths(axis["nonlinearity"]), _hundredths(cross), _milli(error, scale), cause,
                f"{point['condition_number']:.2g}",
            ]


def _milli(force: float | None, scale: float = 1.0) -> str:
    """A force (N) in mN, or with a scale of 1000 a moment (N m) in mN mm; of an axis that no reading tells none."""
    return "untold" if force is None or math.isinf(force) else f"{1e3 * scale * force:.3g}"


def _hundredths(share: float) -> str:
    return f"{100.0 * share:.0f}" if share >= 0.1 else f"{100.0 * share:.2g}"


def whole_rows(felt: Sequence[Document]) -> Iterator[Sequence[str]]:
    """What belongs to the sensor as a whole, at full load."""
    if not felt:
        return
    full = felt[-1]
    degrees = f"{math.degrees(full['tilt_rad']):.3g}"
    degrees += " degree" if degrees == "1" else " degrees"
    for key, unit in (("tilt_error_N", "N"), ("tilt_error_Nm", "N m")):
        for name, row in full.get(key, {}).items():
            words = ", ".join(f"{show(value, unit, 3)} by {angle}" for angle, value in row.items())
            yield [f"a contact tilted by {degrees} is misread as {name}", words]
    yield from sensor_rows(felt)
