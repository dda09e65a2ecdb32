"""The simulated converters: both twins keep to one file of vectors; the one of a design reads what the design says."""

from __future__ import annotations

import subprocess
from itertools import pairwise

import numpy as np
import pytest
from template_designs import template_design
from tolerance import approx

import sitscad
from sitscad.apps.hardware.converter import FAULTS, Fault, NotAcknowledged, Registers, Tank
from sitscad.data import FOLDER
from sitscad.estimates.circuits.settings import devices
from sitscad.kernels.converters import ldc_registers as at
from sitscad.spec import presets
from tests.hardware.conftest import HERE, SANE, STRICT

VECTORS = HERE / "converter_vectors.txt"


def _masked(value: str) -> set[int]:
    return {channel for channel in range(4) if int(value) >> channel & 1}


def test_python_simulator_matches_test_vectors():
    chip, tanks, refused, reads = None, {}, False, 0

    def tank(channel: int, time: int) -> tuple[float, float]:
        return tanks.get(channel, (0.0, 0.0))

    given: Tank = tank
    for number, line in enumerate(VECTORS.read_text().splitlines(), 1):
        word, *rest = line.split() or [""]
        if word == "start":
            tanks.clear()
            name = "ldc1614" if rest[0] == "4" else "ldc1612"
            chip = Registers(presets.converter(name), float(rest[1]), given, float(rest[2]), int(rest[3]))
        elif word == "tank":
            tanks[int(rest[0])] = (float(rest[1]), float(rest[2]))
        elif word == "advance":
            chip.advance(int(rest[0]))
        elif word in ("stuck", "glitch"):
            setattr(chip, word, _masked(rest[0]))
        elif word == "silent":
            chip.silent = rest[0] == "1"
        elif word == "refused":
            refused = True
        elif word in ("read", "write"):
            where, value = (int(text, 16) for text in rest)
            if refused:
                with pytest.raises(NotAcknowledged):
                    chip.read(where)
                chip.time += 97_500 - 122_500 if word == "write" else 0
                refused = False
            elif word == "write":
                chip.write(where, value)
            else:
                reads += 1
                assert f"{chip.read(where):04X}" == rest[1], (number, line)
        else:
            assert not word or word.startswith("#"), (number, line)
    assert reads > 60


@pytest.mark.clients("gcc")
def test_c_simulator_matches_test_vectors(tmp_path):
    sources = [HERE / "vectors.c", FOLDER / "firmware/simulated/simulated.c"]
    command = ["gcc", *STRICT, *SANE, f"-I{FOLDER / 'firmware'}", "-o", tmp_path / "vectors", *sources, "-lm"]
    subprocess.run([*map(str, command)], check=True, timeout=60)
    done = subprocess.run([tmp_path / "vectors"], input=VECTORS.read_text(), capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stdout + done.stderr


# ------------------------------------------------------------------------------------------------------------- a design

DESIGN = template_design("bench_7mm")


def _simulated(**given: object) -> sitscad.SimulatedConverter:
    """A converter of the design, set up."""
    chip = sitscad.SimulatedConverter(DESIGN, **given)
    for register in devices(DESIGN.spec.readout, DESIGN.estimates.coils, DESIGN.estimates.readout)[0].registers:
        chip.write(register.address, register.value)
    return chip


def _results(chip: sitscad.SimulatedConverter, count: int) -> list[tuple[int, int, int, int]]:
    """So many results: time (ns), channel, counts, flags."""
    result = []
    while len(result) < count:
        chip.advance(200_000)
        status = chip.read(at.STATUS)
        for channel in range(4):
            if status & at.UNREAD >> channel:
                upper, lower = chip.read(2 * channel), chip.read(2 * channel + 1)
                high = upper & DESIGN.spec.readout.device.result_mask
                result.append((chip.time, channel, high << 16 | lower, upper >> 12))
    return result


def test_simulated_counts_have_estimated_mean_noise_and_rate():
    """Mean, standard deviation and rate of a sensor at rest are those of the estimates."""
    chip = _simulated()
    result = _results(chip, 400)
    conversion, readout = DESIGN.estimates.readout.conversion, DESIGN.estimates.readout
    for channel, coil in enumerate(DESIGN.estimates.coils):
        counts = np.array([row[2] for row in result if row[1] == channel], dtype=float)
        rest = coil.states["rest"].frequency
        scale = conversion.frequencies(np.array(1.0))
        assert counts.mean() * scale == approx(rest, rel=1e-6)
        assert counts.std() * scale == approx(conversion.noise(rest), rel=0.2)
    times = [row[0] for row in result if row[1] == 0]
    assert (times[-1] - times[0]) * 1e-9 / (len(times) - 1) == approx(1.0 / readout.scan_rate, rel=0.01)
    assert {row[3] for row in result} == {0}


def test_simulated_load_ramp_matches_response():
    chip = _simulated(loads=[[0.0, 0, 0, 0], [0.5, 4.0, 0, 0]], noise=False)
    result = _results(chip, 120)
    ends = sitscad.respond(DESIGN, loads=[[0, 0, 0], [4.0, 0, 0]], rotation="held").counts[:, 0]
    first = [row for row in result if row[1] == 0]
    assert all(later[2] >= earlier[2] for earlier, later in pairwise(first))
    assert first[-1][0] > 0.55e9 and first[-1][2] == approx(ends[1], rel=1e-7)
    half = min(first, key=lambda row: abs(row[0] - 0.25e9))
    assert half[2] == approx(0.5 * (ends[0] + ends[1]), rel=2e-4)


@pytest.mark.parametrize(
    ("fault", "flags", "changed"),
    [("open:C2", 0xB, 0.0), ("short:C2", 0xB, 0.0), ("low-amplitude:C2", 0x1, 1.0), ("lost-layer:C2", None, None)],
)
def test_simulated_coil_fault_affects_only_that_coil(fault, flags, changed):
    sound, faulty = (_results(_simulated(faults=item, noise=False), 12) for item in ((), fault))
    by_channel = [{row[1]: row for row in result} for result in (sound, faulty)]
    assert by_channel[0][0][2:] == by_channel[1][0][2:]
    before, after = (rows[1] for rows in by_channel)
    assert flags is None or after[3] == flags
    if changed is None:  # two layers: the other alone has a quarter of the inductance, and what the leads have
        assert 1.5 < after[2] / before[2] < 2.0
    else:
        assert after[2] == changed * before[2]


def test_simulated_converter_faults_occur_at_given_times():
    pair = (_simulated(faults="swapped:C1:C2", noise=False), _simulated(noise=False))
    swapped, sound = ({row[1]: row[2] for row in _results(chip, 4)} for chip in pair)
    assert swapped == {0: sound[1], 1: sound[0]}
    chip = _simulated(faults="nack@0.1")
    chip.advance(200_000_000)
    with pytest.raises(NotAcknowledged):
        chip.read(at.STATUS)
    chip = _simulated(faults="reset@0.1")
    assert chip.read(at.CONFIG) == 0x1601
    chip.advance(200_000_000)
    assert chip.read(at.CONFIG) == at.AT_RESET[at.CONFIG] and chip.read(at.STATUS) == 0
    chip = _simulated(faults="stuck:C1@0.1")
    result = [row[2] for row in _results(chip, 80) if row[1] == 0]
    assert len(set(result[-10:])) == 1 and len(set(result[:5])) == 5
    chip = _simulated(faults="glitch:C1@0.3")
    first = [row[2] for row in _results(chip, 200) if row[1] == 0]
    wrong = [count for count in first if abs(count / np.median(first) - 1.0) > 1e-3]
    assert len(wrong) == chip.time // 300_000_000 == 3


def test_unknown_simulated_fault_or_converter_is_refused():
    for fault, words in [("oppen:C1", "is no fault"), ("open:C9", "no coil C9"), ("swapped:C1", "two coils")]:
        with pytest.raises(ValueError, match=words):
            sitscad.SimulatedConverter(DESIGN, faults=fault)
    with pytest.raises(ValueError, match="no converter 1"):
        sitscad.SimulatedConverter(DESIGN, number=1)
    assert Fault.read("reset@0.5") == Fault("reset", (), 0.5) and set(FAULTS) >= {"open", "glitch"}
