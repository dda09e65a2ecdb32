"""`sitscad read` of simulated boards: what is read, what a diagnosis says of every fault, what it refuses."""

from __future__ import annotations

import csv
import json
import re
import socket
import sys
import urllib.error
import urllib.request
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner
from template_designs import template_design
from tolerance import approx

import sitscad
from sitscad.apps.hardware.bench_board import GOOD, Board, CoilReading
from sitscad.apps.hardware.converter import SimulatedConverter
from sitscad.apps.hardware.diagnosis import (
    MET,
    NOT_EVALUATED,
    NOT_MET,
    Forces,
    _noise_verdict,
    diagnose_board,
    read_scans,
)
from sitscad.apps.hardware.source import Simulation, WiredConverter, _load_ramps, open_source
from sitscad.cli import cli
from sitscad.cli.reading import live
from tests.hardware.conftest import TEMPLATES, sound_boards

SPEC = TEMPLATES / "bench_7mm.yaml"


@pytest.fixture(scope="module")
def design() -> sitscad.Design:
    return sitscad.Design(sitscad.load(SPEC))


def _diagnosed(design: sitscad.Design, seconds: float = 0.5, **given: object) -> dict[str, tuple[str, str]]:
    """Verdict and words by name, of a simulated board."""
    source = Simulation(design, [SimulatedConverter(design, **given)])
    board = Board(design, source.chips)
    wrong = board.set_up()
    rows = list(read_scans(board, source, seconds))
    result = diagnose_board(board, wrong, [[row[k] for row in rows if k in row] for k in range(len(board.bands))])
    return {item.name: (item.verdict, item.observation) for item in result}


def test_scans_contain_all_coils_of_converters_with_different_rates(tmp_path):
    """Three coils on one and two on the other: half of the scans lacked coils, and the log called these stale."""
    path = tmp_path / "strip.yaml"
    path.write_text((TEMPLATES / "skin_strip_6.yaml").read_text().replace("count: 6", "count: 5"))
    design = sitscad.Design(sitscad.load(path))
    simulated, _ = open_source(f"sim:{path}", design)
    board = Board(design, simulated.chips)
    board.set_up()
    result = list(read_scans(board, simulated, 0.1))
    assert {len(scan) for scan in result} == {5}
    assert len(result) == approx(0.1 * design.estimates.readout.scan_rate, rel=0.1)
    simulated.chips[1].reset()  # while the other goes on
    result = list(read_scans(board, simulated, 0.2))
    assert board.restarts == 1 and len(result[-1]) == 5
    board.restore_lost_settings = lambda new: None
    simulated.chips[1].reset()
    assert [set(scan) for scan in read_scans(board, simulated, 0.3)][1:3] == [{0, 1, 2}] * 2


def test_four_coils_on_one_converter_lose_no_result():
    """One poll finds the last coil of a scan and the first of the next."""
    pad = template_design("three_axis_pad")
    source, _ = open_source(f"sim:{TEMPLATES}/three_axis_pad.yaml", pad)
    board = Board(pad, source.chips)
    board.set_up()
    result = list(read_scans(board, source, 0.5))
    assert {len(scan) for scan in result} == {4}
    assert len(result) == approx(0.5 * pad.estimates.readout.scan_rate, rel=0.01)
    steps = np.diff([[scan[k].time for k in range(4)] for scan in result], axis=0) * pad.estimates.readout.scan_rate
    assert np.all(steps > 0.7) and np.all(steps < 1.3)


def test_diagnosis_of_faultless_board_is_met(design):
    result = _diagnosed(design)
    assert {name for name, (verdict, _) in result.items() if verdict != MET} == {"order of coils"}
    assert set(result) >= {"identity", "settings", "C1 frequency", "C2 amplitude", "C2 noise", "rate"}


@pytest.mark.parametrize(
    ("fault", "missed", "words"),
    [
        ("open:C2", "C2 frequency", "open, or shorted"),
        ("short:C2@0.2", "C2 frequency", "does not oscillate, first at 0.2"),
        ("lost-layer:C2", "C2 frequency", "a layer is missing or turns are shorted"),
        ("low-amplitude:C2", "C2 amplitude", "losses or drive code"),
        ("stuck:C2@0.2", "C2 frequency", "stuck"),
        ("reset@0.2", "settings", "lost once"),
        ("glitch:C2@0.2", "C2 frequency", "2 of"),
    ],
)
def test_diagnosis_names_only_the_faulty_coil(design, fault, missed, words):
    result = _diagnosed(design, faults=fault)
    assert result[missed][0] == NOT_MET and words in result[missed][1]
    others = {name for name, (verdict, _) in result.items() if verdict == NOT_MET} - {missed}
    assert not {name for name in others if name.startswith("C1")} and others <= {"rate", "C2 frequency", "C2 amplitude"}


def test_missing_layer_fails_amplitude_requirement(design):
    """It was said to be good: the status told of the band alone."""
    result = _diagnosed(design, faults="lost-layer:C2")
    assert result["C2 amplitude"][0] == NOT_MET and result["C1 amplitude"][0] == MET


def test_noise_of_12_results_is_not_diagnosed_as_excessive(design):
    """The noise of 12 results is found to be twice the design's on three boards of a hundred; of 200, none."""
    board, noise = Board(design, ()), np.random.default_rng(5)
    hertz = design.estimates.readout.conversion.noise(9e6)

    def said(sigma: float, number: int) -> set[str]:
        counts = board.conversion.counts(9e6 + sigma * hertz * noise.normal(size=number)).astype(int)
        return {_noise_verdict(board, 0, [CoilReading(0.0, int(item), "good") for item in counts]).verdict}

    assert set().union(*(said(1.0, 12) for _ in range(1000))) == {MET}
    assert set().union(*(said(2.5, 200) for _ in range(20))) == {NOT_MET}


def test_single_wrong_result_is_omitted_and_step_delayed_one_scan(design):
    """As in the driver; a diagnosis counts it all the same."""
    loads = [[0.0, 0, 0, 0], [1.1, 0, 0, 0], [1.11, 3.0, 0, 0]]
    source = Simulation(design, [SimulatedConverter(design, loads=loads, faults="glitch:C2@0.25")])
    board = Board(design, source.chips)
    board.set_up()
    rows = [row[1] for row in read_scans(board, source, 1.24) if 1 in row]
    quiet = [item for item in rows if item.time < 1.1]
    good = [board.frequency(item.counts) for item in quiet if item.is_good]
    assert len(quiet) - len(good) == 4 and np.ptp(good) < 8.0 * design.estimates.readout.conversion.noise(9e6)
    step = [item.status for item in rows if item.time >= 1.1]
    assert 1 <= step.count("stale") <= 2 and step[-1] == "good"


NO_LOADS = ["normal=5", "normal:5,shear_x=1", "tilt:1", "normal:1:2:3", "normal:5,"]


@pytest.mark.parametrize("load", NO_LOADS)
def test_invalid_simulated_load_is_refused_with_expected_form(load):
    with pytest.raises(ValueError, match=r"load is AXIS:NEWTONS or AXIS:FIRST:LAST with normal, .* a comma between"):
        open_source(f"sim:{SPEC}?load={load}", None)


def test_simulated_loads_are_given_in_one_or_several_keys():
    item, two = _load_ramps(["normal:0:4,shear_x:1"]), _load_ramps(["shear_x:1", "normal:0:4"])
    assert item.tolist() == two.tolist()
    assert (item[0].tolist(), item[-1].tolist()) == ([0.0, 1.0, 0.0, 0.0, 0.0], [4.0, 1.0, 0.0, 0.0, 0.0])
    assert _load_ramps(["moment_y:2"])[-1].tolist() == [0.0, 0.0, 0.0, 0.0, 2e-3]
    open_source(f"sim:{SPEC}?load=normal:0:4,shear_x:1", None)
    with pytest.raises(ValueError, match="load says twice what normal is"):
        open_source(f"sim:{SPEC}?load=normal:4,normal:5", None)
    with pytest.raises(ValueError, match="load of a moment"):
        open_source(f"sim:{SPEC}?load=normal:4,moment_y:2", None)


@pytest.mark.slow
def test_readings_beyond_map_are_flagged(design):
    result = sitscad.calibrate(design).map
    forces, board = Forces([result]), Board(design, ())
    low, high = (
        {k: CoilReading(0.0, int(counts * way), GOOD) for k, counts in enumerate(result.rest)} for way in (1.0, 1.2)
    )
    assert not forces.is_out_of_range(board, low) and forces.is_out_of_range(board, high)


@pytest.mark.slow
def test_read_evaluates_each_cell_with_its_map(tmp_path):
    """The load on the second, nothing on the first; a map of a coil that is not there is refused."""
    text = (TEMPLATES / "skin_strip_6.yaml").read_text(encoding="utf-8").replace("count: 6", "count: 2")
    (tmp_path / "two.yaml").write_text(text, encoding="utf-8")
    skin = sitscad.Design(sitscad.load_text(text))
    for k in (1, 2):
        folder = tmp_path / f"cell-{k}"
        folder.mkdir()
        (folder / "calibration.json").write_text(json.dumps(sitscad.calibrate(skin.cells.by_number(k)).document()))
    source = f"sim:{tmp_path / 'two.yaml'}?load=normal:5&seconds=0.05"
    for unit, least, most in (("", 0.0, 0.05), ("&unit=2", 0.05, 1.0)):  # a unit has errors of its own
        request = ["read", f"{source}&cell=2{unit}", "--tare", "--calibration", str(tmp_path)]
        done = CliRunner().invoke(cli, request)
        item, two = (float(re.findall(rf"C{k}\.normal (\S+) N", done.output)[-1]) for k in (1, 2))
        assert done.exit_code == 0 and abs(item) < 0.05 and least <= abs(two - 5.0) < most
    assert "say on which, like cell=1" in CliRunner().invoke(cli, ["read", source]).output
    ours = ["read", f"sim:{SPEC}?seconds=0.05", "--calibration", str(tmp_path / "cell-2")]
    document = (tmp_path / "cell-2" / "calibration.json").read_text()
    (tmp_path / "cell-2" / "calibration.json").write_text(document.replace('"C2"', '"C9"'))
    assert "its coils C9 are not" in CliRunner().invoke(cli, ours).output


def test_diagnosis_does_not_evaluate_order_of_equal_coils(design):
    assert _diagnosed(design, faults="swapped:C1:C2")["order of coils"][0] == NOT_EVALUATED


def test_manufactured_boards_within_tolerance_pass_diagnosis(design):
    """Boards drawn from manufacture, pressed while they are read."""
    loads = np.array([[0.0, 0, 0, 0], [0.3, 4.0, 0, 0]])
    drawn = sitscad.respond(design, loads=loads[:, 1:], rotation="held").frequency
    rest = np.array([coil.states["rest"].frequency for coil in design.estimates.coils])
    for seed, off in enumerate(sound_boards(design, 8, "rest", 4) - rest, 1):
        result = _diagnosed(design, 0.3, loads=loads, frequencies=drawn + off, seed=seed)
        assert NOT_MET not in {verdict for verdict, _ in result.values()}, result


# ---------------------------------------------------------------------------------------------------------- the command


def _run(*words: str):
    return CliRunner().invoke(cli, ["read", *words], standalone_mode=False)


def test_read_command_diagnoses_logs_and_prints_forces(tmp_path):
    done = _run(f"sim:{SPEC}?seconds=0.4", "--diagnose", "--log", str(tmp_path))
    assert done.return_value == 0 and done.stdout.startswith("MET ") and "NOT MET" not in done.stdout
    rows = list(csv.DictReader((tmp_path / "readings.csv").open()))
    beside = json.loads((tmp_path / "readings.json").read_text())
    assert 30 < len(rows) < 45 and {row["C1_status"] for row in rows} <= {"good", "stale"}
    first = rows[3]
    assert float(first["C1_Hz"]) == approx(
        int(first["C1_counts"]) / 2 ** beside["count_bits"] * beside["full_scale_Hz"], rel=1e-7
    )
    assert _run(f"sim:{SPEC}?seconds=0.4&fault=open:C2", "--diagnose").return_value == 1
    nothing = _run(f"sim:{SPEC}?fault=nack", "--diagnose")
    assert nothing.return_value == 2 and "no acknowledge" in nothing.stdout


@pytest.mark.slow
def test_read_command_prints_applied_force(tmp_path, design):
    """The tare is the mean of 16 scans, so that these come to nothing in the mean; the load comes on after them."""
    result = sitscad.calibrate(design)
    sitscad.write_calibration(result, tmp_path)
    by = ("--tare", "--calibration", str(tmp_path / "calibration.json"))
    lines = _run(f"sim:{SPEC}?load=normal:2&seconds=0.1", *by).stdout.splitlines()
    newtons = [float(line.split("normal ")[1].split(" N")[0]) for line in lines if "normal" in line]
    assert abs(np.mean(newtons[:16])) < 1e-4 and newtons[-1] == approx(2.0, rel=0.02)
    other = _run(f"sim:{TEMPLATES / 'three_axis_triangle.yaml'}?seconds=0.3", *by)
    assert "its coils C1, C2 are not this one's C1, C2, C3" in str(other.exception)
    few = _run(f"sim:{SPEC}", *by, "--seconds", "0.1")
    assert "16 scans with good readings, and 9 came" in few.stderr and "normal" not in few.stdout


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("sim:SPEC?fault=oppen", "is no fault"),
        ("sim:SPEC?speed=3", "none of load"),
        ("sim:SPEC?load=sideways:3", "AXIS:NEWTONS"),
        ("/dev/i2c-1", "--design says"),
        ("com3", "--design says"),
    ],
)
def test_invalid_source_is_refused(source, words):
    done = _run(source.replace("SPEC", str(SPEC)))
    assert words in str(done.exception), done.exception


@pytest.mark.parametrize("said", [
    "seconds=nan", "seconds=-1", "seconds=0", "seconds=inf", "seconds=1e9", "seconds=", "seconds=long", "state=foo",
    "state=", "seed=-5", "seed=1e9", "seed=99999999999", "unit=-1", "unit=x", "unit=99999999999", "cell=0", "cell=9",
    "load=normal:1e26", "load=normal:nan", "load=normal:0:inf", "load=shear_x:-1e26", "load=normal:-4",
    "fault=open:C2@nan", "fault=open:C2@-5", "fault=nack@1e22", "fault=glitch:C1@0", "fault=reset@-",
])
def test_invalid_source_value_is_refused_with_key_and_allowed_values(said, design):
    """A read of nan seconds ended with exit 0 and no reading; any word was a state, and 1e26 N were put on."""
    key, _, value = said.partition("=")
    with pytest.raises(ValueError) as refused:
        open_source(f"sim:{SPEC}?{said}", design)
    words = str(refused.value)
    assert value.split("@")[-1].split(":")[-1] in words
    assert re.search(r"wanted|0 or more|has the|up to|0 to|faults are", words), words
    assert key in words or value.split(":")[0] in words


@pytest.mark.parametrize("said", [
    "seconds=1&seconds=2", "seed=1&seed=1", "state=free&unit=1", "state=free&load=normal:2", "state=rest&cell=1",
])
def test_contradictory_source_keys_are_refused(said, design):
    """The first of two was passed over without a word, and so was a state beside a load."""
    with pytest.raises(ValueError, match=r"given twice|do not go together"):
        open_source(f"sim:{SPEC}?{said}", design)


@pytest.mark.parametrize("arguments", [
    ("read", "sim:SPEC", "--seconds", "nan"), ("read", "sim:SPEC", "--seconds", "inf"),
    ("calibrate", "SPEC", "--from", "sim:SPEC", "--creep", "nan"),
    ("calibrate", "SPEC", "--from", "sim:SPEC", "--creep", "1e300"),
])
def test_infinite_time_option_is_refused(arguments):
    """An infinite one ended in an internal error."""
    done = CliRunner().invoke(cli, [item.replace("SPEC", str(SPEC)) for item in arguments])
    assert done.exit_code == 2 and arguments[-2] in done.output and "is not in the range" in done.output


def test_i2c_bus_is_read_by_smbus2_block_functions(design, monkeypatch):
    """As smbus2 has them: blocks of two bytes, the upper first."""

    class Bus:
        def __init__(self, path):
            assert path == "/dev/i2c-7"
            self.chip = SimulatedConverter(design)

        def read_i2c_block_data(self, address, register, count):
            assert (address, count) == (0x2A, 2)
            return list(self.chip.read(register).to_bytes(2, "big"))

        def write_i2c_block_data(self, address, register, content):
            self.chip.write(register, int.from_bytes(bytes(content), "big"))

    monkeypatch.setitem(sys.modules, "smbus2", SimpleNamespace(SMBus=Bus))
    source, known = open_source("/dev/i2c-7", design)
    board = Board(known, source.chips)
    assert isinstance(source.chips[0], WiredConverter)
    assert board.set_up() == [] and board.identities() == [(0x5449, 0x3055)]
    monkeypatch.setitem(sys.modules, "smbus2", None)
    with pytest.raises(ValueError, match=r"sitscad\[bench\]"):
        open_source("/dev/i2c-7", design)


def test_scans_are_served_as_live_page(design):
    source, _ = open_source(f"sim:{SPEC}", design)
    board = source.board(design)
    board.set_up()
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with live(board, Forces(), (), port) as tell:
        scan = next(row for row in read_scans(board, source, 1.0) if len(row) == 2)
        tell(scan)
        state = json.loads(urllib.request.urlopen(f"http://127.0.0.1:{port}/state").read())
        page = urllib.request.urlopen(f"http://127.0.0.1:{port}/").read()
        strange = urllib.request.Request(f"http://127.0.0.1:{port}/state", headers={"Host": "elsewhere"})
        with pytest.raises(urllib.error.HTTPError, match="403"):
            urllib.request.urlopen(strange)
    assert state["reading"]["counts"] == [scan[0].counts, scan[1].counts] and state["reading"]["tare"] is None
    assert b"bench-7mm, live" in page and b"connect" not in page.partition(b"<script")[0]


def test_simulated_reference_coil_stays_at_rest_under_load():
    spec = f"sim:{TEMPLATES / 'grasper_steady.yaml'}?load=normal:0:5&seconds=0.05"
    source, design = open_source(spec, None)
    board = Board(design, source.chips)
    board.set_up()
    rows = [[row[k].counts for k in range(3)] for row in read_scans(board, source, 0.05) if len(row) == 3]
    first, last = np.array(rows[0]), np.array(rows[-1])
    rest = design.estimates.reference.states["rest"].frequency
    assert board.frequency(int(last[2])) == approx(rest, rel=1e-4)
    assert np.all(last[:2] - first[:2] > 20 * abs(last[2] - first[2]))
