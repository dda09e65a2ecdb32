"""`sitscad calibrate --from` on a terminal, loads put on by hand: the command as it is, on a simulated converter behind
what smbus2 is for it; Ctrl-C keeps what was taken.
"""

from __future__ import annotations

import json
import os
import pty
import re
import select
import subprocess
import sys
import time
from pathlib import Path

import pytest

import sitscad
from tests.hardware.conftest import TEMPLATES

pytestmark = pytest.mark.slow

SPEC = TEMPLATES / "bench_7mm.yaml"
BUS = """
import json, os, pathlib, time
import sitscad
from sitscad.apps.hardware.converter import SimulatedConverter

class SMBus:  # in true time; what the coils have stands in a file
    def __init__(self, path):
        self.chip, self.begun, self.on = SimulatedConverter(sitscad.load(os.environ["SPEC"])), time.monotonic(), None

    def now(self):
        on = pathlib.Path(os.environ["ON"]).read_text()
        if on != self.on:
            self.on = on
            self.chip.hold(json.loads(on))
        self.chip.advance(max(0, int((time.monotonic() - self.begun) * 1e9) - self.chip.time))

    def read_i2c_block_data(self, address, register, count):
        self.now()
        return list(self.chip.read(register).to_bytes(2, "big"))

    def write_i2c_block_data(self, address, register, content):
        self.now()
        self.chip.write(register, int.from_bytes(bytes(content), "big"))
"""
PROMPT = r"{} of 6: (?:nothing on it|press ([\d.]+) N(?:, push ([+-][\d.]+) N along x)?)"


class Bench:
    """The command on a terminal of its own, and somebody who reads it and puts loads on."""

    def __init__(self, folder: Path, design: sitscad.Design) -> None:
        self.folder, self.design, self.text = folder, design, ""
        (folder / "smbus2.py").write_text(BUS)
        self.put(0.0, 0.0)
        given = {
            **os.environ, "SPEC": str(SPEC), "ON": str(folder / "on.json"),
            "PYTHONPATH": f"{folder}:{TEMPLATES.parent}", "TERM": "dumb",
        }
        words = ["calibrate", SPEC, "--from", "/dev/i2c-7", "--points", "3", "--creep", "0.2", "-o", folder / "out"]
        self.terminal, theirs = pty.openpty()
        self.process = subprocess.Popen(
            [sys.executable, "-m", "sitscad", *map(str, words)], env=given, cwd=folder,
            preexec_fn=lambda: os.login_tty(theirs),
        )
        os.close(theirs)

    def put(self, normal: float, shear: float) -> None:
        """Put a load on (N)."""
        result = sitscad.respond(self.design, loads=[[normal, shear, 0.0]], rotation="held").frequency
        made = self.folder / "new.json"
        made.write_text(json.dumps(result.tolist()))
        made.replace(self.folder / "on.json")

    def until(self, pattern: str) -> re.Match[str]:
        """What is asked or said next; all before it is left behind."""
        end = time.monotonic() + 60.0
        while not (result := re.search(pattern, self.text)):
            assert time.monotonic() < end, self.text
            if select.select([self.terminal], [], [], 0.2)[0]:
                try:
                    self.text += os.read(self.terminal, 4096).decode()
                except OSError:  # the command has ended
                    raise AssertionError(self.text) from None
        self.text = self.text[result.end() :]
        return result

    def type(self, words: str) -> None:
        os.write(self.terminal, words.encode())

    def stopped(self) -> None:
        """Ctrl-C, and what is said of it."""
        self.type("\x03")
        self.until(r"stopped; the same command goes on after the points in \S+")
        assert self.process.wait(timeout=60) == 2
        os.close(self.terminal)

    @property
    def points(self) -> list[str]:
        """The points of the table."""
        return (self.folder / "out/measured.csv").read_text().splitlines()[3:]


def test_ctrl_c_keeps_recorded_points_and_same_command_resumes(tmp_path):
    design = sitscad.Design(sitscad.load(SPEC))
    bench = Bench(tmp_path, design)
    bench.until(PROMPT.format(1))
    bench.type("\n")
    bench.until("1 of 6 taken")
    load = bench.until(PROMPT.format(2))
    bench.put(float(load[1]), float(load[2] or 0.0))
    bench.type("\n")
    bench.until("to come to rest")
    bench.stopped()  # while it reads
    (first,) = bench.points
    bench = Bench(tmp_path, design)
    load = bench.until(PROMPT.format(2))
    bench.type("\n")  # with nothing on it
    bench.until(r"reads as about .*\. Once more")
    bench.put(float(load[1]), float(load[2] or 0.0))
    bench.type("\n")
    bench.until("2 of 6 taken")
    bench.until(PROMPT.format(3))
    bench.type("back\n")
    bench.until("2 of 6 is taken again")
    bench.until(PROMPT.format(2))
    bench.type(f"{load[1]} {load[2] or 0}\n")
    bench.until("2 of 6 taken")
    bench.until(PROMPT.format(3))
    bench.stopped()  # while it asks
    assert bench.points[0] == first and len(bench.points) == 2
    assert float(bench.points[1].split(",")[0]) == float(load[1])
