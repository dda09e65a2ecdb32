"""SIT207 to SIT213: channels, clocks and the time that scans take and leave."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from sitscad.checks.reading.readings import worst_of
from sitscad.checks.rules import Case, Rule, Undecided, Verdict, rule_of, worded
from sitscad.design import Design
from sitscad.finding import Severity
from sitscad.remedy.moves import scans
from sitscad.remedy.search import Left, first_that_mends, in_vain, setting, tried
from sitscad.spec import presets
from sitscad.units import show


def _channel_sources(family: str | None = None) -> str:
    parts = [presets.converter(name) for name in presets.names("converter")]
    named = dict.fromkeys(part.source for part in parts if family in (None, part.family))
    return "; ".join([*named, "coupled oscillators (derived)"])


MOST_COUPLING = 2e-3
"""Of coils of different converters: their tanks pull each other within half of this, about what tolerances part."""


def input_frequency(design: Design) -> Iterator[Verdict]:
    """f_IN below a quarter of f_REF, with the divider that fast sensors need."""
    readout = design.estimates.readout
    worst = worst_of(design, "frequency", max)
    if worst is None or readout.input_divider is None:
        yield Undecided("no sensor frequency was estimated")
        return
    if not design.converter.is_input_in_range(worst.value, readout.input_divider, readout.reference_frequency):
        wanted = design.converter.input_divider(worst.value, readout.reference_frequency)
        is_enough, slow = wanted <= 15, readout.input_divider < 2
        yield (INPUT_UNDIVIDED if slow else INPUT_TOO_FAST).found(
            "readout.clock", worst.value / readout.input_divider, 0.25 * readout.reference_frequency, "Hz",
            hint=worded(LARGER_DIVIDER if is_enough else FASTER_CLOCK,
                        {"divider": wanted, "clock": 4.0 * worst.value / 15.0}), value=worst.value,
            input_divider=readout.input_divider, slow=design.converter.limit("input_divider_2_from"),
            reference_frequency=readout.reference_frequency,
        )


def scan_rate(design: Design) -> Iterator[Verdict]:
    """The scan rate that the timing gives, against the wanted one."""
    readout, wanted = design.estimates.readout, design.spec.readout.scan_rate
    if not math.isfinite(readout.scan_rate):
        yield Undecided("no scan rate was estimated")
        return
    if readout.scan_rate < wanted * (1.0 - 1e-6):
        yield TOO_MANY_SCANS.found("readout.scan_rate", readout.scan_rate, wanted, "Hz", coils=_coils(design),
                                   period=1.0 / readout.scan_rate)


def read_back(design: Design) -> Iterator[Verdict]:
    """Whether the results of a scan can be read over I2C before the next one is done."""
    channels, wanted = len(design.spec.array.placements), design.spec.readout.scan_rate
    converter = design.converter
    sure, hopeful = 1.0 / converter.read_back_time(channels), 1.0 / converter.read_back_time_optimistic(channels)
    if wanted > sure:
        impossible = wanted > hopeful
        pause = "" if impossible else ", or a host that reads without any pause, as TI's more hopeful figure takes it"
        yield READ_TOO_SLOWLY.found("readout.scan_rate", wanted, sure, "Hz", is_grave=impossible, coils=_coils(design),
                                    advice=lambda left: _other_rate(design, math.floor(sure), left, pause), pause=pause,
                                    period=1.0 / sure)


def bandwidth(design: Design) -> Iterator[Verdict]:
    """Twice the bandwidth at least, by the sampling theorem."""
    wanted, rate = design.spec.requirements.bandwidth, design.spec.readout.scan_rate
    assert wanted is not None
    if rate < 2.0 * wanted:
        yield TOO_FEW_SCANS.found("readout.scan_rate", rate, 2.0 * wanted, "Hz",
                                  advice=lambda left: _other_rate(design, 2.0 * wanted, left), followed=rate / 2.0,
                                  wanted=wanted)


def _other_rate(design: Design, rate: float, left: Left, otherwise: str = "") -> str:
    """A scan rate (Hz) where trying finds that it keeps all rules; else what may do. None is tried beyond the nearest
    one that is enough: every further scan takes time from conversions, and so signal from the noise.
    """
    changes = [scans(design.spec, rate)]
    found = first_that_mends(changes, left)
    if found is not None:
        return f"{found.words} (it was tried){otherwise}"
    if left.is_cut_short:
        return ""
    return f"fewer coils, or a lower requirements.bandwidth (tried in vain: {in_vain(changes, left)}){otherwise}"


def channels(design: Design) -> Iterator[Verdict]:
    """One channel a coil, on as many converters as one I2C bus can address; how coils of two converters are coupled."""
    names = [placement.name for placement in design.spec.array.placements]
    key = "array.centres" if design.spec.array.pattern == "explicit" else "array.count"
    device = design.spec.readout.device
    each, most = device.channels, device.most_coils
    if len(names) > most:
        parts = (presets.converter(name) for name in presets.names("converter"))
        others = " or ".join(part.part.lower() for part in parts if part.most_coils >= len(names))
        enough = f" (readout.device: {others} has enough)" if others else ""
        yield TOO_FEW_CHANNELS.found(key, float(len(names)), float(most), source=_channel_sources(device.family),
                                     count=len(names), devices=len(device.addresses), device=device.part, each=each,
                                     more_channels=enough, beyond=len(names) - most)
    elif len(names) > each:
        # The largest coupling of two coils of different converters, and their names
        matrix, coils = design.estimates.inductance_matrix, design.estimates.coils
        coupling, one, other = max(
            (math.sqrt(_coupling_squared(matrix, i, j)), coils[i].name, coils[j].name)
            for i in range(each)
            for j in range(each, len(coils))
        )
        if not math.isfinite(coupling):
            yield Undecided("the mutual inductance of the coils was not estimated")
            return
        yield TWO_CONVERTERS.found(
            key, coupling, MOST_COUPLING, source=_channel_sources(device.family), is_grave=coupling >= MOST_COUPLING,
            count=len(names), device=device.part, ones=", ".join(names[:each]), address=device.addresses[0],
            others=", ".join(names[each:]), second_address=device.addresses[1], one=one, other=other,
        )


def idle_neighbour(design: Design) -> Iterator[Verdict]:
    """How much a grounded neighbour on the same converter takes off a coil's inductance: the square of the coupling."""
    matrix, coils = design.estimates.inductance_matrix, design.estimates.coils
    each = design.spec.readout.device.channels
    pairs = [
        (_coupling_squared(matrix, i, j), coils[i].name, coils[j].name)
        for i in range(len(coils))
        for j in range(i)
        if i // each == j // each
    ]
    if any(not math.isfinite(share) for share, *_ in pairs):
        yield Undecided("the mutual inductance of the coils was not estimated")
        return
    share, one, other = max(pairs, default=(0.0, "", ""))
    if share >= 1e-3:
        yield COUPLED.found(design.distance_key, share, 0.05 if share >= 0.05 else 1e-3, None, is_grave=share >= 0.05,
                            one=one, other=other)


def _coupling_squared(matrix: Sequence[Sequence[float]], i: int, j: int) -> float:
    return float(matrix[i][j]) ** 2 / (float(matrix[i][i]) * float(matrix[j][j]))


def clock(design: Design) -> Iterator[Verdict]:
    """The external clock within the converter's range."""
    value = design.spec.readout.clock
    low, high = design.converter.limit("clock_min"), design.converter.limit("clock_max")
    if not low <= value <= high:
        fastest = setting(design.spec, "readout.clock", high, show(high, "Hz", 6))
        yield ODD_CLOCK.found("readout.clock", value, low if value < low else high, "Hz", low=low, high=high,
                              advice=lambda left: f"{fastest.words}{tried(fastest, left)}: the fastest reference gives "
                                                  "the finest reading")


def _coils(design: Design) -> str:
    count = len(design.spec.array.placements)
    return "one coil" if count == 1 else f"{count} coils"


INPUT_TOO_FAST = Case(
    "the sensor frequency {value:Hz} divided by {input_divider} is not below a quarter of the "
    "reference {reference_frequency:Hz}",
)

INPUT_UNDIVIDED = Case(
    "the sensor frequency {value:Hz} divided by {input_divider} is not below a quarter of the "
    "reference {reference_frequency:Hz}, or lacks the divider of 2 that {slow:Hz} and more need",
)

LARGER_DIVIDER = "FIN_DIVIDER {divider} would do"
FASTER_CLOCK = "no divider up to 15 helps: a clock of at least {clock:Hz} is needed"

TOO_MANY_SCANS = Case(
    "the fastest scan of {coils} takes {period:s,3} ({measured:Hz}); {limit:Hz} are asked",
    hint="ask for fewer scans a second, use fewer coils, or a faster clock",
)

READ_TOO_SLOWLY = Case(
    "reading {coils} over I2C at 400 kHz takes {period:s,3}: a scan rate of {limit:Hz} at most; "
    "{measured:Hz} are asked", hint="a lower readout.scan_rate{pause}", severity=Severity.WARNING, grave=Severity.ERROR,
)

TOO_FEW_SCANS = Case(
    "a scan rate of {measured:Hz} follows a bandwidth of {followed:Hz} at most; {wanted:Hz} are required",
    hint="a readout.scan_rate of twice the bandwidth at least",
)

TOO_FEW_CHANNELS = Case(
    "{count} coils, but one I2C bus takes {devices} {device} of {each} channels, and every coil needs a channel of its "
    "own{more_channels}",
    hint="leave {beyond} of them out, or make two sensors, each with a bus of its own; three axes take no more than "
    "three coils under one target (pattern triangle) or four (pattern grid, 2 x 2)",
)

TWO_CONVERTERS = Case(
    "{count} coils take two {device}: {ones} at address 0x{address:02X}, {others} at 0x{second_address:02X}. They "
    "oscillate at the same time; {one} and {other} are coupled most, by {measured:%.2g} %, while the estimate takes "
    "all other coils as grounded",
    hint="tanks whose frequencies come within about half the coupling of each other pull each other: keep those coils "
    "apart, give the second converter another capacitor, or put one to sleep while the other measures",
    severity=Severity.NOTE, grave=Severity.WARNING,
)

COUPLED = Case(
    "{one} and {other} are coupled: while one is read, the other is grounded and takes {measured:%.2g} % off its "
    "inductance",
    hint="keep the coils apart, and leave no coil over another; the estimate's rest and pressed states contain this, "
    "the free state is the coil alone", severity=Severity.NOTE, grave=Severity.WARNING,
)

ODD_CLOCK = Case(
    "the clock is {measured:Hz}; the converter takes {low:Hz} to {high:Hz}",
    hint="use {high:Hz}: the fastest reference gives the finest reading",
)


RULES: tuple[Rule, ...] = (
    rule_of("SIT207", input_frequency),
    rule_of("SIT208", scan_rate),
    rule_of("SIT209", read_back),
    rule_of("SIT210", bandwidth, "bandwidth"),
    rule_of("SIT211", channels, channel_sources=_channel_sources()),
    rule_of("SIT212", idle_neighbour),
    rule_of("SIT213", clock),
)
