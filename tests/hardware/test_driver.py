"""The driver in C on simulated converters: how it sets up and reads, what it says of every fault, that it is lean."""

from __future__ import annotations

import re

import numpy as np
import pytest

import sitscad
from sitscad.data import FOLDER
from sitscad.estimates.circuits.settings import devices, frequency_bands
from sitscad.kernels.converters import ldc_registers as at
from tests.hardware.conftest import TEMPLATES, compiled

GOOD, STALE, UNDER, OVER, WATCHDOG, OUT_OF_BAND, AMPLITUDE = range(7)
OK, OPEN, SHORT, TURNS_MISSING, EXCHANGED, BEYOND, SILENT = range(7)
BUS, IDENTITY, SETTINGS, LOST, NO_TARE, NO_MAP = range(-1, -7, -1)

FIRST = ("advance 4200000", "poll")
"""The first poll, right after a scan: none ends while they are read."""

SCAN = ("advance 2896500", "poll")
"""The poll of the next scan: 3.999 ms after the last, which took nine reads."""

pytestmark = pytest.mark.clients("gcc")


def _of_coils(row: list[str]) -> tuple[int, list[int], list[int]]:
    """What a poll said: coils that are new, counts and status of each."""
    result = [int(word) for word in row]
    return result[0], result[1::2], result[2::2]


def _tested(row: list[str]) -> tuple[int, int, int, list[int], list[int]]:
    """What a self-test said: coils that are not good, the state, whether coils are told apart; results, thousandths."""
    return int(row[0]), int(row[1]), int(row[2]), [*map(int, row[4::4])], [*map(int, row[5::4])]


def test_driver_constants_match_converter_data():
    """The C files say them again, for they have no tables: both are one."""
    header = (FOLDER / "firmware/ldc161x.h").read_text()
    words = {name: int(value, 16) for name, value in re.findall(r"#define LDC161X_(\w+) 0x(\w+?)u?l?\b", header)}
    for name in ("STATUS", "ERROR_CONFIG", "CONFIG", "RESET_DEV", "DRIVE_CURRENT", "MANUFACTURER_ID", "DEVICE_ID"):
        assert words[name] == getattr(at, name), name
    assert words["MANUFACTURER"] == at.MANUFACTURER
    flags = {"UNDER_RANGE": "ERR_UR", "OVER_RANGE": "ERR_OR", "WATCHDOG": "ERR_WD", "AMPLITUDE": "ERR_AE"}
    assert all(words[ours] << 12 == at.DATA_FLAGS[theirs][0] for ours, theirs in flags.items())
    device = sitscad.load(TEMPLATES / "bench_7mm.yaml").readout.device
    assert words["DEVICE"] == device.device_id and words["LARGEST"] == 2**device.bits - 1
    text = (FOLDER / "firmware/simulated/simulated.c").read_text()
    drive = re.search(r"drive_A\[32\] = {(.*?)}", text, re.S).group(1)
    assert [float(value) for value in drive.replace("\n", "").split(",") if value.strip()] == [*device.drive_currents]


@pytest.mark.slow
def test_driver_configures_in_sleep_mode_reads_back_and_wakes_last(pad):
    """Today's table left every error off and was trusted unread."""
    (words,) = pad.run("trace", "begin")
    assert words[-2:] == ["0", "good"]
    registers = devices(pad.design.spec.readout, pad.design.estimates.coils, pad.design.estimates.readout)[0].registers
    assert {row.name: row.value for row in registers}["ERROR_CONFIG"] == 0xF801
    *plain, config = registers
    assert config.name == "CONFIG" and len([row for row in plain if row.name.startswith("OFFSET")]) == 4
    assert words[:-2] == [
        "r2A.7E", "r2A.7F", "w2A.1C=8000",
        *(f"w2A.{row.address:02X}={row.value:04X}" for row in plain),
        *(f"r2A.{row.address:02X}" for row in plain),
        f"w2A.1A={config.value:04X}", "r2A.1A",
    ]


@pytest.mark.slow
def test_poll_reads_status_first_and_high_registers_before_low(pad):
    *_, last = pad.run("begin", "advance 8000000", "trace", "poll")
    accesses = [word for word in last if word.startswith("r")]
    assert accesses == ["r2A.18", *(f"r2A.{where:02X}" for where in range(8))]


def test_new_results_are_good_and_repeated_results_are_stale(pad):
    rows = pad.run("begin", "poll", "advance 4200000", *["poll"] * 30)[1:]
    nothing, all_new, *later = map(_of_coils, rows)
    assert nothing == (0, [0] * 4, [STALE] * 4)
    assert all_new[0] == 4 and all_new[2] == [GOOD] * 4
    empty = next(k for k, row in enumerate(later) if row[0] == 0)
    assert later[empty][2] == [STALE] * 4 and later[empty][1] == ([all_new, *later])[empty][1]
    counts = pad.design.estimates.readout.conversion.counts(
        np.array([coil.states["rest"].frequency for coil in pad.design.estimates.coils])
    )
    rcount = pad.design.estimates.readout.conversion.rcount
    assert np.abs(np.array(all_new[1]) / counts - 1.0).max() < 6 * 1.2 / 32 / rcount


def test_coils_polled_within_one_scan_are_not_stale(pad):
    """Polled faster than it scans, the sensor is whole all the same; a coil that does not come any more is told."""
    rows = pad.run("begin", *["next"] * 12)[1:]
    assert all(_of_coils(row)[2] == [GOOD] * 4 for row in rows[4:])


@pytest.mark.parametrize(
    ("changed", "status"),
    [
        ("coil 1 0 0", WATCHDOG),
        ("coil 1 79.9999999e6 4000", OVER),
        ("coil 1 9.5e6 4000", OUT_OF_BAND),
        ("coil 1 7.5e6 4000", OUT_OF_BAND),
        ("coil 1 8.423e6 2000", AMPLITUDE),
    ],
)
def test_coil_fault_is_reported_in_next_scan(pad, changed, status):
    """Out of band, range and watchdog are faults: such counts make no tare. Amplitude is a warning, and counts hold."""
    if status == OVER:
        changed = "coil 1 81e6 4000"
    rows = pad.run("begin", *FIRST, changed, *SCAN * 2, "advance 20000000", "poll", "tare")
    result, _, statuses = _of_coils(rows[-2])
    assert statuses[1] == status and {*statuses} == {GOOD, status} and result >= 1
    assert rows[-1] == (["0"] if status == AMPLITUDE else ["2"])


def test_silent_bus_and_wrong_device_identity_are_reported(pad):
    assert pad.run("nack 0 1", "begin")[0][0] == str(BUS)
    assert pad.run("register 0 7F 3054", "begin")[0][0] == str(IDENTITY)
    assert pad.run("register 0 7E 0000", "begin")[0][0] == str(IDENTITY)
    rows = pad.run("begin", *FIRST, "nack 0 1", "poll", "nack 0 0", *FIRST)
    assert [int(row[0]) for row in rows[1:3]] == [4, BUS] and int(rows[3][0]) > 0
    assert _of_coils(rows[2])[2] == [STALE] * 4


def test_lost_settings_are_detected_at_fourth_poll_and_restored(pad):
    """After a brown-out a converter sleeps for ever, and says nothing."""
    polls = ["poll"] * 4
    rows = pad.run("begin", *FIRST, "reset 0", *polls, *FIRST, "restarts")
    assert [int(row[0]) for row in rows[1:]] == [4, 0, 0, 0, LOST, 4, 1]
    # where it cannot be set up yet, every poll says so and tries again
    rows = pad.run("begin", "reset 0", "register 0 7F 0000", *polls, "poll", "register 0 7F 3055", "poll", "restarts")
    assert [int(row[0]) for row in rows[1:]] == [0, 0, 0, IDENTITY, IDENTITY, LOST, 1]


def test_register_that_does_not_store_its_value_is_reported(pad, tmp_path):
    """Settings that a converter does not take, as those of channels that it has not."""
    bench = compiled(pad.design, tmp_path, [], replaced={"{0u, 0x19u, 0xF801u}": "{0u, 0x1Du, 0xF801u}"})
    assert bench.run("begin")[0][0] == str(SETTINGS)


def test_single_wrong_result_is_held_back(pad):
    """A step that is true comes one scan late; one that is not never does."""
    ready = ["begin", *FIRST]
    rows = pad.run(*ready, "glitch 0 2", *SCAN, *SCAN)[1:]
    before, wrong, after = map(_of_coils, rows)
    assert (before[0], wrong[0], after[0]) == (4, 3, 4)
    assert wrong[2] == [GOOD, STALE, GOOD, GOOD] and wrong[1][1] == before[1][1]
    steps = [f"coil {k} {8.5e6 + 1e5 * k} 4000" for k in range(4)]
    rows = pad.run(*ready, *steps, *SCAN, *SCAN)[1:]
    before, held, through = map(_of_coils, rows)  # the next result of C1 has come before the step
    assert held[1][1:] == before[1][1:] and held[2] == [GOOD, STALE, STALE, STALE]
    assert through[0] == 3 and through[2][1:] == [GOOD] * 3 and through[1][1] > 1.005 * before[1][1]


def test_fast_motion_stays_good(pad):
    """Steps of every scan far beyond the noise: after the first all come through, as fast as they are."""
    words = ["begin", *FIRST]
    for step in range(1, 30):
        words += [f"coil 0 {8.423e6 + 2e3 * step} 4000", *SCAN]
    result = [_of_coils(row) for row in pad.run(*words)[2:]]
    assert [row[2][0] for row in result[2:]] == [GOOD] * len(result[2:])


def test_frozen_result_becomes_stale_within_210_scans(pad):
    words = ["begin", *FIRST, "stuck 0 2", *SCAN * 210]
    result = [_of_coils(row)[2] for row in pad.run(*words)[1:]]
    assert result[150] == [GOOD] * 4 and result[-1] == [GOOD, STALE, GOOD, GOOD]


def test_forces_without_tare_or_map_return_error_codes(pad):
    """Each that is missing is said; nothing is made up."""
    assert pad.run("begin", "settle 4", "forces", "tare", "forces")[2:] == [["-5", "0"], ["0"], ["-6", "0"]]


def test_tare_is_mean_of_16_scans_at_any_poll_rate(pad):
    """Polled four times a scan it was begun anew at every call: the noise of one reading was in all forces after it,
    and made of 14 mN of `square_bench` 23.
    """
    later = ["tares", "tare", "tares", "settle 6", "tare", "tares"]
    rows = pad.run("begin", "settle 6", *["settle 1", "tare"] * 16, *later)
    counts = np.array([_of_coils(row)[1] for row in rows[2:34:2]])
    number, *mean = map(int, rows[34])
    assert number == 16 and np.abs(np.array(mean) - counts.mean(axis=0)).max() < 16
    assert rows[36] == rows[34] and rows[39][0] == "1"  # nothing new; later than two scans


# ----------------------------------------------------------------------------------------------------------- self-test


@pytest.mark.parametrize(
    ("changed", "result", "off"),
    [
        ([], OK, (-30, 30)),
        (["coil 2 0 0"], OPEN, (30_000, 40_000)),
        (["coil 2 9.92e6 3000"], TURNS_MISSING, (-270, -255)),  # 26 % less, as in a published set of sensors
        (["coil 2 25e6 4000"], SHORT, (-900, -800)),
        (["coil 2 7.2e6 4000"], BEYOND, (380, 420)),
    ],
)
def test_self_test_compares_coils_with_design(pad, changed, result, off):
    wrong, state, _, results, thousandths = _tested(pad.run("begin", *changed, "test")[1])
    assert wrong == (result != OK) and state == 1
    assert results == [OK, OK, result, OK] and off[0] <= thousandths[2] <= off[1]


def test_single_wrong_result_fails_no_self_test(pad):
    """As large as one is: half of them leave the design's band."""
    assert {row[0] for row in pad.run("begin", *["settle 3", "glitch 0 2", "test"] * 12)[2::2]} == {"0"}


def test_self_test_recognises_bare_board_and_silent_coils(pad):
    free = [coil.states["free"] for coil in pad.design.estimates.coils]
    bare = [f"coil {k} {one.frequency} {one.parallel_resistance}" for k, one in enumerate(free)]
    assert _tested(pad.run("begin", *bare, "test")[1])[:2] == (0, 0)
    assert pad.run("begin", "reset 0", "test")[1] == [str(LOST)]
    wrong, _, _, results, _ = _tested(pad.run("begin", "register 0 16 0000", "test")[1])
    assert wrong == 2 and results == [OK, OK, SILENT, SILENT]


def test_self_test_reports_exchanged_coils_of_different_inductance(pad, tmp_path):
    """Coils that differ in their leads only cannot be told apart, and the report says so."""
    ours = frequency_bands(pad.design.estimates.coils, 0.005)
    swapped = [f"coil {k} {ours[2 - k].assembled.design} 4000" for k in (0, 2)]
    assert _tested(pad.run("begin", *swapped, "test")[1])[:3] == (0, 1, 0)
    # were manufacture ten times as good, C1 and C3 would be told apart
    width = int(re.search(r"SENSOR_UNLIKE (\d+)u", (pad.folder / "sensor_config.h").read_text()).group(1))
    better = compiled(pad.design, tmp_path, [], replaced={f"SENSOR_UNLIKE {width}u": f"SENSOR_UNLIKE {width // 10}u"})
    wrong, _, _, results, _ = _tested(better.run("begin", *swapped, "test")[1])
    assert wrong == 2 and results == [EXCHANGED, OK, EXCHANGED, OK]
    assert _tested(better.run("begin", "test")[1])[0] == 0
