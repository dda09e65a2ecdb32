"""SIT207 to SIT213 and SIT219: channels, clocks, scan times, and crosstalk between coils and between cells."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import combinations

from sitscad.basics.finding import Severity
from sitscad.basics.units import show
from sitscad.checks.fixes.moves import each_read, scans
from sitscad.checks.fixes.search import setting
from sitscad.checks.reading.readings import worst_of
from sitscad.checks.rules import Rule, Undecided, Verdict, Violation, own_limits, rule_of
from sitscad.estimates.design import Design
from sitscad.spec import presets


def _channel_sources(family: str | None = None) -> str:
    parts = [presets.converter(name) for name in presets.names("converter")]
    named = dict.fromkeys(part.source for part in parts if family in (None, part.family))
    return "; ".join([*named, "coupled oscillators (derived)"])


MOST_COUPLING = 2e-3
"""Coupling factor of coils of different converters from which on there is a warning.

Tanks pull each other's frequencies if these differ by less than half of the coupling factor. Tolerances separate them
by about this much.
"""


def input_frequency(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the converter, as configured, cannot count the fastest tank correctly."""
    readout = design.estimates.readout
    worst, conversion = worst_of(design, "frequency", max), readout.conversion
    if worst is None or conversion is None:
        yield Undecided("no sensor frequency was estimated")
    elif worst.value >= conversion.highest_frequency:
        slowest = conversion.slowest_clock(worst.value)
        yield Violation(
            f"the sensor frequency {show(worst.value, 'Hz')} is not below {show(conversion.highest_frequency, 'Hz')}, "
            f"up to which {conversion.device.part} counts as it is set",
            f"a clock of at least {show(slowest, 'Hz')}" if slowest and slowest > readout.clock else "",
            "readout.clock" if slowest else "readout.capacitance", worst.value, conversion.highest_frequency, "Hz",
        )


def scan_rate(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the timing does not reach the required scan rate."""
    readout, wanted = design.estimates.readout, design.spec.readout.scan_rate
    if not math.isfinite(readout.scan_rate):
        yield Undecided("no scan rate was estimated")
        return
    if readout.scan_rate < wanted * (1.0 - 1e-6):
        count = len(design.spec.array.placements)
        yield Violation(
            f"the fastest scan of {'one coil' if count == 1 else f'{count} coils'} takes "
            f"{show(1.0 / readout.scan_rate, 's', 3)} "
            f"({show(readout.scan_rate, 'Hz')}); {show(wanted, 'Hz')} are asked",
            "ask for fewer scans a second, use fewer coils, or a faster clock", "readout.scan_rate", readout.scan_rate,
            wanted, "Hz",
        )


def read_back(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the results of a scan cannot be read over I2C before the next scan ends."""
    channels, wanted = len(design.spec.array.placements), design.spec.readout.scan_rate
    converter = design.spec.readout.device
    sure, hopeful = 1.0 / converter.read_back_time(channels), 1.0 / converter.read_back_time_optimistic(channels)
    if wanted > sure:
        impossible = wanted > hopeful
        how = ", or a host that reads without any pause, as the maker's more hopeful figure takes it"
        pause, clock = "" if impossible else how, converter.serial_clock_in_words
        yield Violation(
            f"reading {'one coil' if channels == 1 else f'{channels} coils'} over I2C at {clock} takes "
            f"{show(1.0 / sure, 's', 3)}: a scan rate of {show(sure, 'Hz')} at most; {show(wanted, 'Hz')} are asked",
            f"a lower readout.scan_rate, or fewer coils{pause}",
            "readout.scan_rate", wanted, sure, "Hz", severity=Severity.ERROR if impossible else Severity.WARNING,
            fixes=(lambda: [scans(design.spec, math.floor(sure))],),
        )


def bandwidth(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the scan rate is below twice the bandwidth (sampling theorem)."""
    wanted, rate = design.spec.requirements.bandwidth, design.spec.readout.scan_rate
    assert wanted is not None
    if rate < 2.0 * wanted:
        yield Violation(
            f"a scan rate of {show(rate, 'Hz')} follows a bandwidth of {show(rate / 2.0, 'Hz')} at most; "
            f"{show(wanted, 'Hz')} are required",
            "a readout.scan_rate of twice the bandwidth at least, fewer coils, or less bandwidth",
            "readout.scan_rate", rate, 2.0 * wanted, "Hz",
            # no faster than required: shorter conversions have more noise
            fixes=(lambda: [scans(design.spec, 2.0 * wanted)],),
        )


def channels(design: Design) -> Iterator[Verdict]:
    """Yield findings on missing channels, and on coupling between coils of different converters.

    Each coil needs one channel, on as many converters as the buses can address.
    """
    names = [placement.name for placement in design.spec.array.placements]
    key = "array.centres" if design.spec.array.pattern == "explicit" else "array.count"
    device, buses = design.spec.readout.device, design.spec.readout.buses
    each, most = device.channels, device.most_coils * buses
    if len(names) > most:
        parts = (presets.converter(name) for name in presets.names("converter"))
        others = [part.part.lower() for part in parts if part.most_coils * buses >= len(names)]
        enough = f" (readout.device: {' or '.join(others)} has enough)" if others else ""
        is_two_enough = buses == 1 and len(names) <= 2 * most
        second = "readout.buses: 2, where the controller has a second I2C bus for the further converters; or "
        yield Violation(
            f"{len(names)} coils, but {'one I2C bus takes' if buses == 1 else 'two I2C buses take'} "
            f"{buses * len(device.addresses)} {device.part} of {each} channels, and every coil needs a channel of its "
            f"own{enough}",
            f"{second if is_two_enough else ''}leave {len(names) - most} of them out, or make two sensors, each with a "
            "bus of its own; three axes take no more than three coils under one target (pattern triangle) or four "
            "(pattern grid, 2 x 2)", key,
            float(len(names)), float(most), source=_channel_sources(device.family),
            fixes=(partial(each_read, design.spec, "readout.device", others),
                   partial(each_read, design.spec, "readout.buses", [2] * is_two_enough)),
        )
    elif len(names) > each:
        # The largest coupling of two coils of different converters, and their names
        matrix, places = design.estimates.inductance_matrix, device.places(len(names))
        coupling, one, other = max(
            (math.sqrt(_coupling_squared(matrix, i, j)), names[i], names[j])
            for i, j in combinations(range(len(names)), 2)
            if places[i].converter != places[j].converter
        )
        if not math.isfinite(coupling):
            yield Undecided("the mutual inductance of the coils was not estimated")
            return
        by_converter: dict[str, list[str]] = {}
        for at, name in zip(places, names, strict=True):
            by_converter.setdefault(at.converter_in_words, []).append(name)
        told = "; ".join(f"{', '.join(own)} on converter {converter}" for converter, own in by_converter.items())
        yield Violation(
            f"{len(names)} coils take {len(by_converter)} {device.part}: {told}. They oscillate "
            f"at the same time; {one} and {other} are coupled most, by {100.0 * coupling:.2g} %, while the estimate "
            "takes all other coils as grounded",
            "tanks whose frequencies come within about half the coupling of each other pull each other: keep those "
            "coils apart (array.pitch), or put one converter to sleep while the other measures, by firmware of your "
            "own",
            key, coupling, MOST_COUPLING, severity=Severity.WARNING if coupling >= MOST_COUPLING else Severity.NOTE,
            source=_channel_sources(device.family),
        )


def idle_neighbour(design: Design) -> Iterator[Verdict]:
    """Yield a finding on the inductance that a coil loses to a grounded neighbour on the same converter.

    The relative loss is the square of the coupling factor.
    """
    matrix, coils = design.estimates.inductance_matrix, design.estimates.coils
    places = design.spec.readout.device.places(len(coils))
    pairs = [
        (_coupling_squared(matrix, i, j), coils[i].name, coils[j].name)
        for i in range(len(coils))
        for j in range(i)
        if places[i].converter == places[j].converter
    ]
    if any(not math.isfinite(share) for share, *_ in pairs):
        yield Undecided("the mutual inductance of the coils was not estimated")
        return
    share, one, other = max(pairs, default=(0.0, "", ""))
    if share >= 1e-3:
        yield Violation(
            f"{one} and {other} are coupled: while one is read, the other is grounded and takes {100.0 * share:.2g} % "
            "off its inductance",
            "keep the coils apart, and leave no coil over another; the estimate's rest and pressed states contain "
            "this, the free state is the coil alone", design.spec.array.distance_key, share,
            0.05 if share >= 0.05 else 1e-3, severity=Severity.WARNING if share >= 0.05 else Severity.NOTE,
        )


def _coupling_squared(matrix: Sequence[Sequence[float]], i: int, j: int) -> float:
    return float(matrix[i][j]) ** 2 / (float(matrix[i][i]) * float(matrix[j][j]))


def crosstalk(design: Design) -> Iterator[Verdict]:
    """Yield a finding with the change of a cell's reading by neighbouring cells, as a fraction of its full signal.

    The fraction is also checked against a limit.
    """
    if design.spec.cells is None:
        return
    found, limit = design.cells.skin.crosstalk, own_limits()["cell_crosstalk"]
    if found is None:
        yield Undecided("no cell has a signal of its own to hold its neighbours' against")
        return
    if design.spec.encapsulation is not None:
        yield Undecided("what the film over all cells carries from one to the next is not computed")
    names = ("total", "targets", "target", "coils", "webs")
    total, targets, target, coils, webs = (show(100.0 * getattr(found, name), "%", 2) for name in names)
    each = "; ".join(
        f"{one.words} by {show(100.0 * one.stiffer, '%', 2)}, pressed by {show(100.0 * one.strain, '%', 3)}"
        for one in design.cells.skin.groups)
    yield Violation(
        f"cells read each other: with all around it pressed, a cell changes by at most {total} of its own full signal",
        f"cells farther apart (array.pitch), {'narrower webs (cells.web), ' if found.webs else ''}or smaller targets",
        design.spec.array.distance_key, found.total, limit.value,
        severity=Severity.WARNING if found.total > limit.value else Severity.NOTE,
        source=limit.source, keeps_limit=found.total <= limit.value,
        detail=f"through the targets of all neighbours at most {targets} (of one {target}), as if the cell had no "
        f"target of its own to hold that off; through coils that wait grounded at most {coils}; "
        + (f"through webs at most {webs}. Webs make pads stiffer, to a fifth of it: of {each} under full force. "
           "Forces, maps and the signal of each cell count its own webs, states those of a mean pad"
           if found.webs else "pads stand apart"),
    )


def clock(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the external clock is outside the converter's range."""
    value = design.spec.readout.clock
    low, high = design.spec.readout.device.limit("clock_min"), design.spec.readout.device.limit("clock_max")
    if not low <= value <= high:
        fastest = setting(design.spec, "readout.clock", high, show(high, "Hz", 6))
        yield Violation(
            f"the clock is {show(value, 'Hz')}; the converter takes {show(low, 'Hz')} to {show(high, 'Hz')}",
            f"{show(high, 'Hz')}: the fastest reference gives the finest reading", "readout.clock", value,
            low if value < low else high, "Hz",
            fixes=(lambda: [fastest],),
        )


RULES: tuple[Rule, ...] = (
    rule_of("SIT207", input_frequency), rule_of("SIT208", scan_rate), rule_of("SIT209", read_back),
    rule_of("SIT210", bandwidth, "bandwidth"), rule_of("SIT211", channels, channel_sources=_channel_sources()),
    rule_of("SIT212", idle_neighbour), rule_of("SIT213", clock),
    rule_of("SIT219", crosstalk, limit=100.0 * own_limits()["cell_crosstalk"].value),
)
