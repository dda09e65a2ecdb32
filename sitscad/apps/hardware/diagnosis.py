"""Readings of a board on the test bench as lines and as a table, and verdicts on the board with probable faults.

A scan is one result of each coil.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from sitscad.apps.hardware.bench_board import STALE, WATCHDOG, Board, CoilReading, LineBoard
from sitscad.apps.hardware.source import Source
from sitscad.basics.arrays import Array
from sitscad.basics.quantities import document as settings
from sitscad.basics.record import record
from sitscad.basics.units import csv_text, show
from sitscad.basics.version import __version__
from sitscad.calibration.inverse_map import InverseMap
from sitscad.estimates.circuits.settings import Band
from sitscad.estimates.performance.compensation import CALIBRATED_MARGIN
from sitscad.estimates.performance_values import display_factors
from sitscad.kernels.converters import ldc_registers as at
from sitscad.spec.places import map_columns

MET, NOT_MET, NOT_EVALUATED = "MET", "NOT MET", "NOT EVALUATED"

FEWEST = 12
"""Least number of readings of a coil for which its noise and its rate are evaluated."""

NOISY, SLOW = 2.0, 0.95
"""Largest accepted noise divided by the design's noise, and least accepted rate divided by the design's rate."""

FEW = 10.0
"""Allowance for the statistical uncertainty of noise that is measured from few results.

With n results, noise up to 1 + FEW / sqrt(n) times the design's noise is accepted. FEW / sqrt(n) is seven standard
deviations of the measured noise.
"""

JUMP = 12.0
"""Distance from the median above which a result is an outlier, in standard deviations of the design's noise."""


@record
class Verdict:
    """Verdict on one property of a board.

    ``name`` is the property, and ``verdict`` states whether its requirement is met. ``observation`` describes what was
    measured, with the probable fault if the requirement is not met.
    """

    name: str
    verdict: str
    observation: str


def diagnose_board(
    board: Board, wrong: Sequence[str], readings: Sequence[Sequence[CoilReading]]
) -> tuple[Verdict, ...]:
    """Return the verdicts on all properties of a board.

    `wrong` lists registers that did not keep their value during the set-up. `readings` are the results of each coil in
    order of time. Raises OSError if the board no longer answers.
    """
    verdicts = [_serial_line_verdict(board)] if isinstance(board, LineBoard) else [
        _identity_verdict(board), _settings_verdict(board, wrong)]
    states = _board_state(board, readings)
    for k, rows in enumerate(readings):
        verdicts += [_frequency_verdict(board, k, rows, states), _amplitude_verdict(board, k, rows),
                     _noise_verdict(board, k, rows)]
    verdicts += [_rate_verdict(board, readings), _coil_order_verdict(board)]
    return tuple(verdicts)


def _serial_line_verdict(board: LineBoard) -> Verdict:
    """Return the verdict on the lines from a serial port.

    The firmware itself checks converter identity and registers.
    """
    is_so = not (board.lost or board.corrupted or board.another or board.starts)
    more = "" if is_so else f": check the cable, the baud rate ({board.serial.baud}) and the speed of this computer"
    return Verdict("lines", MET if is_so else NOT_MET, board.remark + more)


def _identity_verdict(board: Board) -> Verdict:
    expected = (at.MANUFACTURER, board.design.spec.readout.device.device_id)
    identities = board.identities()
    text = ", ".join(f"0x{maker:04X} 0x{device:04X}" for maker, device in identities)
    is_so = all(each == expected for each in identities)
    return Verdict("identity", MET if is_so else NOT_MET, text + ("" if is_so else ": another part, or a bad bus"))


def _settings_verdict(board: Board, wrong: Sequence[str]) -> Verdict:
    lost = sum(not board.is_configured(k) for k in range(len(board.chips))) + board.restarts
    if wrong:
        return Verdict("settings", NOT_MET, f"{', '.join(wrong)} did not read back: the bus, or another part")
    if lost:
        times = "once" if lost == 1 else f"{lost} times"
        return Verdict("settings", NOT_MET, f"lost {times}: the supply broke down, or SD went high")
    return Verdict("settings", MET, "every register read back, and kept")


def _board_state(board: Board, readings: Sequence[Sequence[CoilReading]]) -> str:
    """Return "bare" or "assembled": the state in which more of the measured frequencies lie inside their bands."""
    fits = {
        state: sum(
            band.low <= board.frequency(rows[0].counts) <= band.high
            for each, rows in zip(board.bands, readings, strict=True)
            for band in [getattr(each, state)]
            if rows
        )
        for state in ("assembled", "bare")
    }
    return max(fits, key=lambda state: fits[state])


def _frequency_verdict(board: Board, coil: int, rows: Sequence[CoilReading], state: str) -> Verdict:
    """Return the verdict on a coil's frequency: whether it is in the band of the board's state, or of any load."""
    bands_of_coil = board.bands[coil]
    band: Band = getattr(bands_of_coil, state)
    name = f"{bands_of_coil.coil} frequency"
    if not rows:
        return Verdict(name, NOT_MET, "no result at all: the converter does not convert this channel")
    dead = [row for row in rows if row.status == WATCHDOG]
    if dead:
        when = f", first at {dead[0].time:.3g} s" if len(dead) < len(rows) else ""
        return Verdict(
            name, NOT_MET, f"does not oscillate{when}: open, or shorted from end to end; measure it with an ohmmeter"
        )
    read = np.array([board.frequency(row.counts) for row in rows])
    frequency = float(np.median(read))
    off = (band.design / frequency) ** 2 - 1.0
    reading = f"{show(frequency, 'Hz', 6)}, design {show(band.design, 'Hz', 6)} ({state}), L {100.0 * off:+.1f} %"
    low, high = min(band.low, bands_of_coil.working.low), max(band.high, bands_of_coil.working.high)
    # results farther from the median of three neighbours than noise can explain
    middle = np.median(np.stack([read[:-2], read[1:-1], read[2:]]), axis=0) if len(read) > 2 else read[1:-1]
    jumps = int(np.sum(np.abs(read[1:-1] - middle) > JUMP * board.conversion.noise(band.design)))
    if not low <= frequency <= high:
        more = (
            "a layer is missing or turns are shorted"
            if off < 0.0
            else "another capacitor, more turns or a longer cable"
        )
        return Verdict(name, NOT_MET, f"{reading}: {more}")
    stuck = len(rows) >= FEWEST and len({row.counts for row in rows[-FEWEST:]}) == 1
    if stuck:
        return Verdict(name, NOT_MET, f"{reading}: the last {FEWEST} results are the same to the bit: stuck")
    if jumps:
        return Verdict(name, NOT_MET, f"{reading}: {jumps} of {len(rows)} results far off: disturbed bus or clock")
    return Verdict(name, MET, reading)


def _amplitude_verdict(board: Board, coil: int, rows: Sequence[CoilReading]) -> Verdict:
    name, bad = f"{board.bands[coil].coil} amplitude", sum(row.is_off for row in rows)
    if not rows or any(row.status == WATCHDOG for row in rows):
        return Verdict(name, NOT_EVALUATED, "there is no oscillation")
    if bad:
        return Verdict(name, NOT_MET, f"outside of 1.2 to 1.8 V in {bad} of {len(rows)} results: losses or drive code")
    return Verdict(name, MET, "within 1.2 to 1.8 V")


def _noise_verdict(board: Board, coil: int, rows: Sequence[CoilReading]) -> Verdict:
    """Return the verdict on a coil's noise.

    It is computed from second differences of the counts, which remove steady motion. The median of their magnitudes is
    insensitive to outliers.
    """
    name, good = f"{board.bands[coil].coil} noise", [row.counts for row in rows if row.is_good]
    if len(good) < FEWEST:
        return Verdict(name, NOT_EVALUATED, f"{len(good)} good results, {FEWEST} are wanted")
    second = np.diff(np.array(good, dtype=float), 2)
    sigma = float(np.median(np.abs(second)) / 0.6745 / np.sqrt(6.0)) * board.frequency(1)
    design_noise = board.conversion.noise(board.bands[coil].assembled.design)
    reading = f"{show(sigma, 'Hz', 3)} (one sigma), design {show(design_noise, 'Hz', 3)}"
    if sigma > max(NOISY, 1.0 + FEW / np.sqrt(len(good))) * design_noise:
        return Verdict(name, NOT_MET, f"{reading}: supply, clock or ground; or the target shakes")
    return Verdict(name, MET, reading)


def _rate_verdict(board: Board, readings: Sequence[Sequence[CoilReading]]) -> Verdict:
    design_rate = board.design.estimates.readout.scan_rate
    if isinstance(board, LineBoard):
        design_rate /= board.serial.scans_per_line
    counted = [(len(rows) - 1) / (rows[-1].time - rows[0].time) for rows in readings if len(rows) >= FEWEST]
    if not counted:
        return Verdict("rate", NOT_EVALUATED, f"fewer than {FEWEST} results of every coil")
    reading = f"{min(counted):.1f} a second, design {design_rate:.1f}"
    if min(counted) < SLOW * design_rate:
        causes = "a slow bus, a channel that does not oscillate, lost settings, or another clock"
        return Verdict("rate", NOT_MET, f"{reading}: {causes}")
    return Verdict("rate", MET, reading)


def _coil_order_verdict(board: Board) -> Verdict:
    """Return the verdict on the order of the coils. Readings of equal coils do not show their order."""
    if len(board.bands) == 1:
        return Verdict("order of coils", MET, "there is one")
    return Verdict(
        "order of coils", NOT_EVALUATED, "coils of one design are alike: press over each and see which moves"
    )


def verdict_lines(verdicts: Sequence[Verdict]) -> Iterator[str]:
    """Yield one line of text per verdict."""
    width = max(len(verdict.name) for verdict in verdicts)
    for verdict in verdicts:
        yield f"{verdict.verdict:<14} {verdict.name:<{width}}  {verdict.observation}"


Scan = dict[int, CoilReading]
"""Newest result of each coil, by the coil's index in the design."""

LATE = 3.0
"""Longest wait for a coil's result, in scan times."""


TARES = 16
"""Number of complete scans whose mean is the tare, as in the C driver's examples and in live.html."""


def read_scans(board: Board, source: Source, seconds: float, every: float = 0.0) -> Iterator[Scan]:
    """Yield scans for `seconds`, by the clock of the source. Raises OSError if a converter does not answer.

    After each scan, the results of the next `every` seconds are left out, but not within the first `TARES` scans.

    A second result of a coil before its scan is complete belongs to the next scan. If a converter with fewer coils is
    faster, its older results are skipped. If a coil has no result for `LATE` scan times, the scan is yielded without
    it. Converters that lost their registers are set up again.
    """
    scan, ahead, rate, began, count = Scan(), Scan(), board.design.estimates.readout.scan_rate, 0.0, 0
    while source.now() < seconds:
        new = board.poll(source.now())
        board.restore_lost_settings(new)
        began = began if scan else source.now()
        for coil, reading in new.items():
            if coil in scan:
                scan[coil], ahead[coil] = ahead.get(coil, scan[coil]), reading
            else:
                scan[coil] = reading
        if len(scan) == len(board.bands) or (scan and source.now() - began > LATE / rate):
            yield scan
            count += 1
            if every and count >= TARES:
                source.skip(every)
                board.skip()
                board.poll(source.now())  # results from before
                board.past.clear()  # the next results may differ from the last ones by any amount
                ahead = Scan()
            scan, ahead, began = ahead, Scan(), source.now()
        source.wait(0.25 / rate)


class Forces:
    """Forces (N) from scans, computed by maps from readings to forces.

    With `tared`, the readings without load are the mean of the first `TARES` complete scans. Otherwise they are taken
    from the maps. Without maps, there are no forces. With cells, each cell has a map for its own coils, and names of
    axes begin with the cell's name. `celsius` returns the temperature (degrees Celsius) at a time (s), NaN if unknown.
    """

    def __init__(
        self, maps: Sequence[InverseMap] = (), tared: bool = False,
        celsius: Callable[[float], float] = lambda when: math.nan,
    ) -> None:
        self.maps, self.tared, self.celsius = maps, tared, celsius
        self.tare_celsius = math.nan
        self.mean: Array | None = None
        self.taken: list[Array] = []

    def add_to_tare(self, board: Board, scan: Scan) -> None:
        """Add a scan to the tare, until the tare is complete."""
        counts = _good_counts(board, scan)
        if self.maps and self.tared and self.mean is None and counts is not None:
            self.taken.append(counts)
            self.tare_celsius = self.celsius(_scan_time(scan))
            self.mean = np.mean(self.taken, axis=0) if len(self.taken) == TARES else None

    def tare(self, board: Board) -> list[float | None] | None:
        """Return the counts of each coil without load. None before the tare is complete, or if there are no maps.

        An element is None if no map uses the coil, or for a reference coil without good readings.
        """
        if not self.maps or (self.tared and self.mean is None):
            return None
        if self.mean is not None:
            return [None if math.isnan(each) else each for each in self.mean.tolist()]
        rests = {name: float(rest) for each in self.maps for name, rest in zip(each.coils, each.rest, strict=True)}
        return [rests.get(band.coil) for band in board.bands]

    def _read(self, board: Board, scan: Scan) -> Iterator[tuple[InverseMap, str, Array, Array]]:
        """Yield (map, prefix of its axes, counts of its coils (1, coils), counts without load) for each map.

        Yields nothing before the tare is complete, or if a coil has no good reading.
        """
        counts = _good_counts(board, scan)
        if counts is None or (self.tared and self.mean is None):
            return
        for each in self.maps:
            columns, prefix = map_columns(board.design.spec, each.coils)
            yield each, prefix, counts[None, columns], each.rest if self.mean is None else self.mean[columns]

    def __call__(self, board: Board, scan: Scan) -> dict[str, float]:
        """Return forces (N) by axis. Empty before the tare is complete, or if a coil has no good reading."""
        return {f"{prefix}{axis}": force for each, prefix, counts, rest in self._read(board, scan)
                for axis, force in zip(each.axes, each(counts, rest)[0].tolist(), strict=True)}

    @property
    def is_compensated(self) -> bool:
        """Whether at least one map has coefficients that compensate the drift by temperature."""
        return any(each.drifts is not None for each in self.maps)

    def temperature_change(self, board: Board, scan: Scan) -> float:
        """Return the temperature change (K) since the tare. NaN if it is not valid, or before the tare is complete.

        A reference coil measures it if the maps have its drift, or else the temperature sensor.
        """
        drifts = next((each.drifts for each in self.maps if each.drifts is not None), None)
        if self.mean is None or drifts is None:
            return math.nan
        if drifts.reference is None:
            celsius = self.celsius(_scan_time(scan))
            low, high = drifts.calibrated or (-math.inf, math.inf)
            margin = (CALIBRATED_MARGIN - 1.0) * (high - low) if drifts.calibrated else 0.0
            is_valid = all(low - margin <= each <= high + margin for each in (celsius, self.tare_celsius))
            return celsius - self.tare_celsius if is_valid else math.nan
        index = len(board.design.estimates.coils)
        is_valid = index in scan and scan[index].is_good
        return float((scan[index].counts / self.mean[index] - 1.0) / drifts.reference) if is_valid else math.nan

    def compensated_forces(self, board: Board, scan: Scan) -> dict[str, float]:
        """Return forces (N) by axis without the drift by temperature.

        Empty if there are no forces, or if the temperature change is unknown or outside the range of the coefficients.
        """
        kelvin, forces = self.temperature_change(board, scan), dict[str, float]()
        for each, prefix, counts, rest in self._read(board, scan):
            if each.drifts is not None and abs(kelvin) <= each.drifts.largest_change:
                values = each.compensated(counts, rest, kelvin)[0].tolist()
                forces |= {f"{prefix}{axis}": force for axis, force in zip(each.axes, values, strict=True)}
        return forces

    def is_out_of_range(self, board: Board, scan: Scan) -> bool:
        """Whether a scan is outside a map's range. Its forces are then the forces at the end of the range."""
        return not all(each.holds(counts, rest)[0] for each, _, counts, rest in self._read(board, scan))


def _good_counts(board: Board, scan: Scan) -> Array | None:
    """Return the counts (coils) of a scan. None if a coil with a target has no good reading.

    The last value is NaN if the reference coil has no good reading.
    """
    good = [float(scan[k].counts) if k in scan and scan[k].is_good else math.nan for k in range(len(board.bands))]
    sensing = good[: len(board.design.estimates.coils)]
    return None if any(map(math.isnan, sensing)) else np.array(good)


def _scan_time(scan: Scan) -> float:
    """Return the time (s) of a scan's last result."""
    return max(each.time for each in scan.values())


def scan_lines(board: Board, rows: Sequence[Scan], newtons: Forces) -> Iterator[str]:
    """Yield one line of text per scan: time, frequency and status of each coil, and forces."""
    for scan in rows:
        texts = [f"{_scan_time(scan):8.4f} s"]
        texts += [
            f"{board.bands[k].coil} {board.frequency(reading.counts) / 1e6:.6f} MHz {reading.status}"
            for k, reading in sorted(scan.items())
        ]
        by_axis = newtons(board, scan)
        texts += _force_texts(by_axis)
        if newtons.is_compensated and by_axis:
            compensated = _force_texts(newtons.compensated_forces(board, scan))
            kelvin = newtons.temperature_change(board, scan)
            texts += [f"compensated by {kelvin:+.2f} K:", *compensated] if compensated else [
                "not compensated: no valid temperature"]
        texts += ["beyond the map: the force where it ends"] if newtons.is_out_of_range(board, scan) else []
        yield "  ".join(texts)


def _force_texts(by_axis: Mapping[str, float]) -> list[str]:
    """Return texts of forces (N) and moments (N m) by axis."""
    return [f"{axis} {scale * force:+.4f} N{' mm' * bool(scale > 1.0)}"
            for (axis, force), scale in zip(by_axis.items(), display_factors(tuple(by_axis)), strict=True)]


def scan_table(board: Board, rows: Sequence[Scan]) -> bytes:
    """Return a CSV file with one row per scan: time (s), and counts, frequency (Hz) and status of each coil.

    Counts and frequency are empty if a scan has no result of the coil.
    """
    names = [result.coil for result in board.bands]
    lines: list[list[object]] = [
        ["time_s", *(f"{name}_{what}" for name in names for what in ("counts", "Hz", "status"))]
    ]
    for scan in rows:
        row: list[object] = [f"{_scan_time(scan):.6f}"]
        for k in range(len(names)):
            result = scan.get(k)
            if result is None:
                row += ["", "", STALE]
            else:
                row += [result.counts, f"{board.frequency(result.counts):.1f}", result.status]
        lines.append(row)
    return csv_text(lines).encode("utf-8")


def scan_document(board: Board, source: str) -> bytes:
    """Return a JSON file that explains the table: the conversion from counts to frequencies and to inductances."""
    conversion, readout = board.conversion, board.design.estimates.readout
    value = {
        "sitscad": __version__, "source": source, "sensor": board.design.spec.name,
        "coils": [band.coil for band in board.bands],
        "full_scale_Hz": conversion.hertz_per_count * 2.0**conversion.count_bits, "count_bits": conversion.count_bits,
        **settings(conversion, conversion.device.law.SETTINGS),
        "scan_rate_Hz": readout.scan_rate,
        "conversion_capacitance_F": readout.conversion_capacitance,
    }
    return (json.dumps(value, indent=2) + "\n").encode("utf-8")
