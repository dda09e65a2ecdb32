"""Sensors of templates with their firmware compiled for the simulated converter."""

from __future__ import annotations

import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest
from template_designs import template_design

import sitscad
from sitscad.estimates.tolerances.scatter import CAPACITOR
from sitscad.files.documents import firmware

HERE = Path(__file__).parent
TEMPLATES = HERE.parents[1] / "templates"
STRICT = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-Wshadow", "-Wdouble-promotion"]
SANE = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-g"]


@dataclass
class Bench:
    """A design, the folder of its firmware, and the program that runs its driver on simulated converters."""

    design: sitscad.Design
    folder: Path
    program: Path

    def run(self, *commands: str) -> list[list[str]]:
        """The words of every line that commands give, on a sound board at rest."""
        result = self.design.estimates.all_coils
        states = [coil.states.get("rest") or coil.states["free"] for coil in result]
        coils = [f"coil {k} {one.frequency:.17g} {one.parallel_resistance:.17g}" for k, one in enumerate(states)]
        done = subprocess.run(
            [self.program], input="\n".join([*coils, *commands]) + "\n", capture_output=True, text=True, timeout=600
        )
        assert done.returncode == 0, (done.stdout[-500:], done.stderr[-2000:])
        return [line.split() for line in done.stdout.splitlines()]


def compiled(
    design: sitscad.Design,
    folder: Path,
    flags: list[str] = SANE,
    calibration: bytes | Mapping[str, bytes] = b"",
    replaced: Mapping[str, str] = MappingProxyType({}),
) -> Bench:
    """A design's firmware in a folder, compiled with the harness; with a map to newtons where one is given, of cells
    one for each by its path, and some words of its tables replaced.
    """
    for name, content in firmware.render(design.spec, design.estimates).items():
        path = folder / Path(name).relative_to("firmware")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    for words, others in replaced.items():
        text = (folder / "sensor_config.h").read_text()
        assert words in text
        (folder / "sensor_config.h").write_text(text.replace(words, others))
    maps = calibration if isinstance(calibration, Mapping) else {"calibration.h": calibration} if calibration else {}
    for name, content in maps.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(content)
    device = design.spec.readout.device
    defined = [f"-DCHANNELS={device.channels}", f"-DCLOCK_HZ={design.spec.readout.clock!r}", f"-I{folder}"]
    sources = [HERE / "driver_bench.c", *(folder / name for name in ("sensor.c", "ldc161x.c", "simulated/simulated.c"))]
    program = folder / "driver_bench"
    command = ["gcc", *STRICT, *flags, *defined, "-o", program, *sources, "-lm"]
    done = subprocess.run([*map(str, command)], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return Bench(design, folder, program)


def sound_boards(design: sitscad.Design, count: int, state: str, seed: int) -> np.ndarray:
    """Frequencies (count, coils; Hz) of sound boards: every tolerance drawn, the capacitors each for itself."""
    generator = np.random.default_rng(seed)
    states = [coil.states[state] for coil in design.estimates.coils]
    common = {cause: generator.normal(size=count) for cause in states[0].spread.shifts}
    result = np.array([[item.frequency] * count for item in states]).T
    for k, item in enumerate(states):
        for cause, (_, shift, *_) in item.spread.shifts.items():
            result[:, k] += shift * (generator.normal(size=count) if cause == CAPACITOR else common[cause])
    return result


@pytest.fixture(scope="session")
def pad(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    """Four coils on one converter."""
    design = template_design("three_axis_pad")
    return compiled(design, tmp_path_factory.mktemp("pad"))
