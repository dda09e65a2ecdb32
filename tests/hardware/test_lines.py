"""Lines over a serial port: made by the compiled example, sent through a pseudo-terminal, read by `sitscad read`."""

from __future__ import annotations

import os
import shutil
import subprocess
from binascii import crc_hqx
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from tolerance import approx

import sitscad
from sitscad.apps.hardware.bench_board import LineBoard
from sitscad.calibration.inverse_map import InverseMap
from sitscad.cli import cli
from sitscad.files.formats.calibration_header import header
from tests.hardware.conftest import STRICT, TEMPLATES, Bench

SPEC = TEMPLATES / "three_axis_pad.yaml"


@pytest.fixture(scope="module")
def program(pad: Bench, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The example on the simulated converter."""
    made = tmp_path_factory.mktemp("lines") / "sensor"
    sources = ["example_linux.c", "sensor.c", "ldc161x.c", "simulated/simulated.c"]
    command = ["gcc", *STRICT, "-fsanitize=address,undefined", "-DSIMULATED", "-o", made, *sources, "-lm"]
    done = subprocess.run([*map(str, command)], cwd=pad.folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return made


@pytest.fixture(scope="module")
def sent(program: Path) -> list[bytes]:
    """What it says of 250 scans."""
    return subprocess.check_output([program, "-", "1000", "lines"]).splitlines()


class Written:
    """A port on which everything has come."""

    def __init__(self, lines: list[bytes]) -> None:
        self.content = b"\r\n".join(lines) + b"\r\n"

    @property
    def in_waiting(self) -> int:
        return min(len(self.content), 700)

    def read(self, size: int) -> bytes:
        result, self.content = self.content[:size], self.content[size:]
        return result


def _taken(design: sitscad.Design, lines: list[bytes]) -> tuple[LineBoard, list[dict]]:
    board = LineBoard(design, Written([b"tail of one that began bef*0000", *lines]))
    result = []
    while board.port.content or board.waiting:
        result.append(board.poll(0.0))
    return board, [item for item in result if item]


@pytest.mark.clients("gcc")
def test_all_serial_lines_are_read_with_expected_counts(pad, sent):
    board, rows = _taken(pad.design, sent)
    heads = [line for line in sent if line.startswith(b"id,")]
    assert len(rows) == board.good > 240 and len(heads) == -(-len(rows) // 100) and board.remark.endswith("corrupted")
    drawn = [coil.states["rest"].frequency for coil in pad.design.estimates.coils]
    read = [[board.frequency(item.counts) for _, item in sorted(row.items())] for row in rows]
    assert list(np.mean(read, axis=0)) == approx(drawn, rel=2e-5)
    assert np.ptp(np.array(read)[:, 0]) > 0.0


@pytest.mark.clients("gcc")
def test_lost_corrupted_and_foreign_lines_are_counted_and_unused(pad, sent):
    readings = [line for line in sent if line[:1].isalnum() and not line.startswith(b"id")]
    body = readings[20].rpartition(b"*")[0]
    other = b"%08X" % (int(body[:8], 16) ^ 1) + body[8:]
    wrong = body[:-1] + bytes([body[-1] ^ 1]) + readings[20][len(body) :]
    few = body[: len(body) // 2]
    damaged = [
        *readings[:10], *readings[13:20], wrong, other + b"*%04X" % crc_hqx(other, 0xFFFF),
        few + b"*%04X" % crc_hqx(few, 0xFFFF),
        b"# words", b"\xff\x00" * 9, *readings[21:30], *readings[:5],
    ]
    board, rows = _taken(pad.design, damaged)
    assert (board.good, board.lost, board.corrupted, board.another, board.starts) == (31, 4, 3, 1, 1)
    assert len(rows) == 31 and list(board.comments) == ["words"]
    assert "4 lost, 3 corrupted, 1 of another sensor" in board.remark


@pytest.mark.slow
@pytest.mark.clients("gcc")
def test_read_accepts_terminal_port_and_refuses_board_of_other_design(program):
    pytest.importorskip("serial")
    ours, theirs = os.openpty()
    running = subprocess.Popen([program, "-", "-1", "lines"], stdout=ours)
    try:
        source = f"serial:{os.ttyname(theirs)}"
        done = _read(source, "--design", str(SPEC), "--diagnose", "--seconds", "0.5")
        assert "MET            C1 frequency" in done.stdout and "none lost or corrupted" in done.stdout, done.stdout
        refused = _read(source, "--design", str(TEMPLATES / "bench_7mm.yaml"))
        assert refused.return_value == 2 and "of another sensor" in refused.stdout
        assert "serial:PORT takes ?baud" in str(_read(f"{source}?speed=3", "--design", str(SPEC)).exception)
    finally:
        running.kill()
        running.wait()
        os.close(ours)
        os.close(theirs)
    gone = _read("serial:/dev/no-such-port", "--design", str(SPEC))
    assert gone.return_value == 2 and "could not open" in gone.stdout


def _read(*words: str):
    return CliRunner().invoke(cli, ["read", *words], standalone_mode=False)


@pytest.mark.clients("gcc")
def test_moments_are_sent_in_newton_millimetres(pad, tmp_path):
    """The map has newton metres, of which a line's four decimals would be a tenth of a newton millimetre."""
    folder = tmp_path / "firmware"
    shutil.copytree(pad.folder, folder)
    names = tuple(coil.name for coil in pad.design.estimates.coils)
    conversion = pad.design.estimates.readout.conversion
    rest = np.rint(conversion.counts(np.array([coil.states["rest"].frequency
                                               for coil in pad.design.estimates.coils])))
    result = InverseMap(
        gain=np.full(4, 1e-3),
        mix=np.array([[1.0, 1.0, 1.0, 1.0], [1.0, -1.0, 1.0, -1.0], [1.0, 1.0, -1.0, -1.0]]),
        powers=np.eye(3, dtype=np.int64), coefficients=np.eye(3),
        low=-np.ones(3), high=np.ones(3), sensor="three-axis-pad", revision="",
        coils=names, axes=("normal", "moment_x", "moment_y"), full_scale=np.array([8.0, 4e-3, 4e-3]),
        error=np.zeros(3), rest=rest,
    )
    (folder / "calibration.h").write_bytes(header(result, conversion))
    (folder / "told.c").write_text(TOLD)
    made = folder / "told"
    command = ["gcc", *STRICT, "-o", made, "told.c", "sensor.c", "ldc161x.c", "-lm"]
    done = subprocess.run([*map(str, command)], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    head, line = subprocess.check_output([made]).decode("ascii").splitlines()
    assert [name.partition("*")[0] for name in head.split(",")[-3:]] == ["normal_N", "moment_x_Nmm", "moment_y_Nmm"]
    assert [cell.partition("*")[0] for cell in line.split(",")[-3:]] == ["6.5000", "1.2500", "-3.4375"]
    assert "newton metres" in header(result, conversion).decode("ascii")
    assert result.document()["units"] == ["N", "N m", "N m"]


TOLD = """\
#include <stdio.h>
#include "sensor_line.h"
int main(void)
{
    static sensor_line line;
    static sensor_reading reading;
    float newtons[SENSOR_CELLS][SENSOR_AXES] = {{6.5f, 0.00125f, -0.0034375f}};
    const int good[SENSOR_CELLS] = {0};

    sensor_line_head(&line);
    sensor_line_reading(&line, &reading, good, 0.0f, newtons);
    sensor_line_put(&line, '\\0');
    printf("%s\\n", line.text);
    return 0;
}
"""
