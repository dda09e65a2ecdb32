"""SIT207 to SIT213 and SIT219: channels, clocks, scan times, and crosstalk between coils and between cells."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import combinations

from sitscad.basics.finding import Severity
from sitscad.basics.units import show
from sitscad.checks.fixes.moves import reread_changes, with_scan_rate
from sitscad.checks.fixes.search import with_value
from sitscad.checks.reading.readings import worst_reading
from sitscad.checks.rules import Rule, Verdict, constant_limits, not_checked, rule_of, violation_of
from sitscad.estimates.design import Design
from sitscad.spec import presets


def _channel_sources(family: str | None = None) -> str:
    parts = [presets.converter(name) for name in presets.names("converter")]
    named = dict.fromkeys(part.source for part in parts if family in (None, part.family))
    return "; ".join([*named, "coupled oscillators (derived)"])


MOST_COUPLING = 2e-3
"""Coupling factor between coils of different converters, from which there is a warning.

Tanks synchronise if their relative frequency difference is below half of the coupling factor. Manufacturing tolerances
cause differences of about this size.
"""


def input_frequency(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the converter, as configured, cannot count the fastest tank correctly."""
    readout = design.estimates.readout
    worst, conversion = worst_reading(design.estimates.all_coils, "frequency", max), readout.conversion
    if worst is None or conversion is None:
        yield not_checked("no-estimate", quantity="sensor frequency")
    elif worst.value >= conversion.highest_frequency:
        slowest = conversion.slowest_clock(worst.value)
        yield violation_of(
            "clock-count", "readout.clock" if slowest else "readout.capacitance", worst.value,
            conversion.highest_frequency, "Hz", part=conversion.device.part, clock=slowest,
            hint="clock-slowest" if slowest and slowest > readout.clock else "",
        )


def scan_rate(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the timing does not reach the required scan rate."""
    readout, required = design.estimates.readout, design.spec.readout.scan_rate
    if not math.isfinite(readout.scan_rate):
        yield not_checked("no-estimate", quantity="scan rate")
        return
    if readout.scan_rate < required * (1.0 - 1e-6):
        yield violation_of("scan-rate", "readout.scan_rate", readout.scan_rate, required, "Hz",
                           coils=len(design.spec.all_placements), time=1.0 / readout.scan_rate)


def read_back(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the results of a scan cannot be read over I2C before the next scan ends.

    It is a warning if they can be read in the shorter of the times that the manufacturer states, else an error.
    """
    channels, required = len(design.spec.all_placements), design.spec.readout.scan_rate
    converter = design.spec.readout.device
    sure, hopeful = 1.0 / converter.read_back_time(channels), 1.0 / converter.read_back_time_optimistic(channels)
    if required > sure:
        impossible = required > hopeful
        yield violation_of(
            "read-back", "readout.scan_rate", required, sure, "Hz", hint="" if impossible else "read-back-pause",
            severity=Severity.ERROR if impossible else Severity.WARNING, coils=channels,
            clock=converter.serial_clock_text, time=1.0 / sure,
            fixes=(lambda: [with_scan_rate(design.spec, math.floor(sure))],),
        )


def bandwidth(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the scan rate is below twice the bandwidth (sampling theorem)."""
    required, rate = design.spec.requirements.bandwidth, design.spec.readout.scan_rate
    assert required is not None
    if rate < 2.0 * required:
        # no faster than required: shorter conversions have more noise
        yield violation_of("scan-bandwidth", "readout.scan_rate", rate, 2.0 * required, "Hz", bandwidth=required,
                           fixes=(lambda: [with_scan_rate(design.spec, 2.0 * required)],))


def channels(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the converters have too few channels, or if coils on different converters are coupled.

    Each coil needs one channel. The number of converters is limited by the I2C addresses and the number of buses. The
    finding on coupling is a warning from `MOST_COUPLING`, else a note.
    """
    names = [placement.name for placement in design.spec.all_placements]
    key = "array.centres" if design.spec.array.pattern == "explicit" else "array.count"
    device, buses = design.spec.readout.device, design.spec.readout.buses
    each, most = device.channels, device.most_coils * buses
    if len(names) > most:
        parts = (presets.converter(name) for name in presets.names("converter"))
        converters = [part.part.lower() for part in parts if part.most_coils * buses >= len(names)]
        is_two_enough = buses == 1 and len(names) <= 2 * most
        yield violation_of(
            "channels-one-bus" if buses == 1 else "channels-two-buses", key, float(len(names)), float(most),
            hint="channels-second-bus" if is_two_enough else "channels-fewer",
            details=("channels-others",) if converters else (), source=_channel_sources(device.family),
            parts=buses * len(device.addresses), part=device.part, channels=each, others=converters,
            excess=len(names) - most,
            fixes=(partial(reread_changes, design.spec, "readout.device", converters),
                   partial(reread_changes, design.spec, "readout.buses", [2] * is_two_enough)),
        )
    elif len(names) > each:
        # The largest coupling of two coils of different converters, and their names
        matrix, places = design.estimates.inductance_matrix, device.coil_channels(len(names))
        coupling, *pair = max(
            (math.sqrt(_coupling_squared(matrix, i, j)), names[i], names[j])
            for i, j in combinations(range(len(names)), 2)
            if places[i].converter != places[j].converter
        )
        if not math.isfinite(coupling):
            yield not_checked("no-mutual")
            return
        by_converter: dict[str, list[str]] = {}
        for at, name in zip(places, names, strict=True):
            by_converter.setdefault(at.converter_text, []).append(name)
        yield violation_of(
            "converters-coupled", key, coupling, MOST_COUPLING, coils=len(names), converters=len(by_converter),
            part=device.part, pair=pair, source=_channel_sources(device.family),
            places="; ".join(f"{', '.join(on_converter)} on converter {name}"
                             for name, on_converter in by_converter.items()),
            severity=Severity.WARNING if coupling >= MOST_COUPLING else Severity.NOTE,
        )


def idle_neighbour(design: Design) -> Iterator[Verdict]:
    """Yield a finding on the inductance that a coil loses because a neighbour on the same converter is grounded.

    The relative loss is the square of the coupling factor.
    """
    matrix, coils = design.estimates.inductance_matrix, design.estimates.all_coils
    places = design.spec.readout.device.coil_channels(len(coils))
    pairs = [
        (_coupling_squared(matrix, i, j), coils[i].name, coils[j].name)
        for i in range(len(coils))
        for j in range(i)
        if places[i].converter == places[j].converter
    ]
    if any(not math.isfinite(share) for share, *_ in pairs):
        yield not_checked("no-mutual")
        return
    share, *coupled = max(pairs, default=(0.0, "", ""))
    if share >= 1e-3:
        yield violation_of(
            "idle-neighbour", design.spec.array.distance_key, share, 0.05 if share >= 0.05 else 1e-3, coils=coupled,
            severity=Severity.WARNING if share >= 0.05 else Severity.NOTE,
        )


def _coupling_squared(matrix: Sequence[Sequence[float]], i: int, j: int) -> float:
    return float(matrix[i][j]) ** 2 / (float(matrix[i][i]) * float(matrix[j][j]))


def crosstalk(design: Design) -> Iterator[Verdict]:
    """Yield a finding on the largest change of a cell's reading that loads on neighbouring cells cause.

    The finding states the change as a fraction of the cell's full signal, and compares it with a limit.
    """
    if design.spec.cells is None:
        return
    change, limit = design.cells.skin.crosstalk, constant_limits()["cell_crosstalk"]
    if change is None:
        yield not_checked("no-cell-signal")
        return
    if design.spec.encapsulation is not None:
        yield not_checked("film-crosstalk")
    groups = [f"{group.numbers_text} by {show(100.0 * group.stiffer, '%', 2)}, "
              f"pressed by {show(100.0 * group.strain, '%', 3)}" for group in design.cells.skin.groups]
    yield violation_of(
        "cell-crosstalk", design.spec.array.distance_key, change.total, limit.value,
        hint="cell-crosstalk-webs" if change.webs else "",
        details=("cell-crosstalk-webs" if change.webs else "cell-crosstalk-apart",),
        severity=Severity.WARNING if change.total > limit.value else Severity.NOTE, source=limit.source,
        keeps_limit=change.total <= limit.value, targets=change.targets, target=change.target, waiting=change.coils,
        webs=change.webs, groups=groups,
    )


def clock(design: Design) -> Iterator[Verdict]:
    """Yield a finding if the external clock is outside the converter's range."""
    value = design.spec.readout.clock
    low, high = design.spec.readout.device.limit("clock_min"), design.spec.readout.device.limit("clock_max")
    if not low <= value <= high:
        fastest = with_value(design.spec, "readout.clock", high, show(high, "Hz", 6))
        yield violation_of(
            "clock-range", "readout.clock", value, low if value < low else high, "Hz", low=low, high=high,
            clock=show(high, "Hz", 6), fixes=(lambda: [fastest],),
        )


RULES: tuple[Rule, ...] = (
    rule_of("SIT207", input_frequency), rule_of("SIT208", scan_rate), rule_of("SIT209", read_back),
    rule_of("SIT210", bandwidth, "bandwidth"), rule_of("SIT211", channels, channel_sources=_channel_sources()),
    rule_of("SIT212", idle_neighbour), rule_of("SIT213", clock),
    rule_of("SIT219", crosstalk, limit=100.0 * constant_limits()["cell_crosstalk"].value),
)
