"""Tables of benches: what is read, and what is refused with its place."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from tolerance import approx

from sitscad.calibration.bench_data import BenchError, column_frequencies, read_table, table_points
from sitscad.calibration.refusals import require_plausible
from sitscad.kernels.converters.reference_counter import ReferenceCounter
from sitscad.spec import presets

COILS = ("C1", "C2")


def _read(tmp_path, text):
    path = tmp_path / "bench.csv"
    path.write_text(text)
    return read_table(str(path), COILS)


HEAD = "normal_N,shear_x_N,C1_counts,C2_counts\n"


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        ("", "1:1", "empty"),
        (HEAD + "0,0,5,nan\n", "2:4", "no finite number"),
        (HEAD + "0,0,5,6\n1,0,7,\n", "3:4", "nothing was read here"),
        (HEAD + "# a remark\n\n0,0,5\n", "4:4", "3 cells under 4 columns"),
        (HEAD + "0,0,5,six\n", "2:4", "'six'"),
        ("normal_N,C1,C2\n0,5,6\n", "1:2", "C1 in '': C1_counts"),
        ("normal,C1_counts,C2_counts\n0,5,6\n", "1:1", "normal in '': normal_N"),
        ("normal_kg,C1_counts,C2_counts\n0,5,6\n", "1:1", "normal in 'kg'"),
        ("normal_N,C1_counts,C2_volts\n0,5,6\n", "1:3", "C2 in 'volts'"),
        ("normal_N,C1_counts\n0,5\n", "1:2", "no column for C2"),
        ("normal_N,C1_counts,C2_counts,C1_counts\n0,5,6,5\n", "1:2", "two columns"),
        ("normal_N,C1_counts,C2_counts,C9_counts\n0,5,6,5\n", "1:4", "'C9_counts' is none of"),
        ("C1_counts,C2_counts\n5,6\n", "1:2", "neither loads nor poses"),
        ("normal_N,x_mm,C1_counts,C2_counts\n0,0,5,6\n", "1:4", "one of both"),
        ("normal_N,C1_counts,C2_Hz\n0,5,6\n", "1:3", "several kinds"),
        ("# rotation: free\n" + HEAD + "0,0,5,6\n# rotation: held\n1,0,7,8\n", "4:1", "'held' here, 'free' on line 1"),
    ],
)
def test_unreadable_table_is_reported_with_line_and_column(tmp_path, text, place, words):
    with pytest.raises(BenchError) as error:
        _read(tmp_path, text)
    assert str(error.value).startswith(f"{tmp_path / 'bench.csv'}:{place} ")
    assert words in str(error.value)


def test_counts_outside_converter_results_are_refused(tmp_path):
    """Results of twelve bits as they are read, instead of counts, were taken for a tank at half its frequency."""
    conversion = ReferenceCounter(presets.converter("ldc1314"), 2, 40e6, 1, 2, 9471, 8, 3, (5443, 5510))
    readout = SimpleNamespace(conversion_capacitance=104e-12)
    model = SimpleNamespace(estimates=SimpleNamespace(readout=readout))
    sensors = SimpleNamespace(conversion=conversion, coils=COILS, model=model)
    table = _read(tmp_path, HEAD + "0,0,7500,7600\n1,0,7600,2090\n")
    first, second = table.columns[-2:]
    assert column_frequencies(table, sensors, first) == approx([80e6 * 7500 / 2**16, 80e6 * 7600 / 2**16], rel=1e-12)
    with pytest.raises(BenchError, match=r":3:4 C2: counts of the LDC1314 as it is set lie above 5510 and below 9605"):
        column_frequencies(table, sensors, second)


@pytest.mark.parametrize("said", ["# rotation = held", "#Rotation: HELD, see note", '"# rotation: held",,,'])
def test_rotation_comment_line_sets_how_target_was_loaded(tmp_path, said):
    """An equals sign was taken for a remark, the table for one of either way."""
    assert _read(tmp_path, f"{said}\n{HEAD}0,0,5,6\n{said}\n1,0,7,8\n").rotation == (1, "held")


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("begin", [b"", b"\xef\xbb\xbf"])
def test_table_with_any_line_ends_is_read(tmp_path, end, begin):
    """A file of an old Macintosh ended in a traceback."""
    path = tmp_path / "bench.csv"
    path.write_bytes(begin + (HEAD + "0,0,5,6\n1,0,7,8\n").replace("\n", end).encode())
    result = read_table(str(path), COILS)
    assert result.values.tolist() == [[0, 0, 5, 6], [1, 0, 7, 8]] and result.lines == (2, 3)


def test_table_field_of_200000_digits_is_refused(tmp_path):
    with pytest.raises(BenchError, match=r"bench.csv:1:1 is no table that can be read"):
        _read(tmp_path, HEAD + "0,0,5," + 200_000 * "6" + "\n")


@pytest.mark.more
@pytest.mark.slow
def test_table_values_use_units_of_header(tmp_path, sensors):
    table = _read(tmp_path, "z_um,C1_MHz,C2_kHz\n0,7.5,7500\n-10,7.6,7600\n-20,7.7,7700\n-30,7.8,7800\n")
    points = table_points(table, sensors)
    assert points.loads is None and points.poses[:, 2] == approx(np.array([0.0, -10e-6, -20e-6, -30e-6]), rel=1e-12)
    assert points.frequency[1] == approx(7.6e6, rel=1e-12) and list(points.at_rest) == [True, False, False, False]


@pytest.mark.slow
def test_inductance_columns_are_converted_by_firmware_formula(sensors, bench, table):
    """The header's capacitance turns them into frequencies: what it is drops out, because all goes over rest."""
    capacitance = sensors.model.estimates.readout.conversion_capacitance

    def in_microhenry(head, rows):
        loads = bench.loads[:, sensors.range.columns]
        result = 1e6 / (capacitance * (2.0 * np.pi * bench.frequency) ** 2)
        names = [name.replace("counts", "uH") for name in head]
        return names, [[*map(str, a), *map(repr, map(float, b))] for a, b in zip(loads, result, strict=True)]

    read = table_points(read_table(table(in_microhenry), sensors.coils), sensors)
    assert read.frequency == approx(bench.frequency, rel=1e-12)


def _without_rest(head, rows):
    return head, rows[1:]


def _few(head, rows):
    return head, rows[:3]


def _one(head, rows):
    return head, rows[:2]


def _pull(head, rows):
    return head, [*rows[:-1], ["-1", *rows[-1][1:]]]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (_without_rest, "the tare"),
        (_few, "2 points beside the tare: 3 different points at least"),
        (_one, "1 point beside the tare"),
        (_pull, "presses are positive"),
    ],
)
def test_table_with_too_few_points_or_columns_is_refused(table, sensors, change, words):
    with pytest.raises(BenchError, match=words):
        table_points(read_table(table(change), sensors.coils), sensors)


def _judge(path, sensors):
    result = read_table(path, sensors.coils)
    require_plausible(result, table_points(result, sensors), sensors)


def _swapped(head, rows):
    return head, [[a, b, d, c] for a, b, c, d in rows]


def _mistyped(head, rows):
    return head, [*rows[:3], [*rows[3][:3], str(round(1.12 * int(rows[3][3])))], *rows[4:]]


def _counts_as_hertz(head, rows):
    return [name.replace("counts", "Hz") for name in head], rows


def _still(head, rows):
    return head, [[*row[:2], *rows[0][2:]] for row in rows]


def test_table_of_matching_sensor_is_accepted(table, sensors):
    _judge(table(), sensors)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (_swapped, "bench.csv:1:3 the columns C1 and C2 look exchanged"),
        (_mistyped, "bench.csv:5:4 C2: .* where this design reads about"),
        (_counts_as_hertz, "bench.csv:.* is the header's unit right"),
        (_still, "do not change with the loads"),
    ],
)
def test_table_that_no_sensor_of_the_design_can_produce_is_refused(table, sensors, change, words):
    with pytest.raises(BenchError, match=words):
        _judge(table(change), sensors)
