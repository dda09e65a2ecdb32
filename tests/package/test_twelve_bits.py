"""A package for an LDC1314: its words, registers and counts are that converter's, and its headers decode."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from tolerance import approx

import sitscad
from sitscad.basics.units import show

TEMPLATE = (Path(__file__).parents[2] / "templates" / "bench_7mm.yaml").read_text(encoding="utf-8")

OTHERS = re.compile(rb"28 bits|28-bit|2\^28|MSB|LSB|SNOSCY9A|LDC161[24]_|ldc161|0FFFFFFF|2\*\*28")
"""What only a package for an LDC1612 or LDC1614 may say."""


def spec_of(device: str, **changes: str):
    text = TEMPLATE.replace("ldc1614", device).replace("LDC1614", device.upper())
    for key, value in changes.items():
        text = re.sub(rf"({key}): .*", rf"\1: {value}", text)
    return sitscad.load_text(text, f"{device}.yaml")


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    stages = ["firmware", "datasheet", "calibration", "report"]
    return sitscad.build(spec_of("ldc1314"), tmp_path_factory.mktemp("out"), stages).directory


@pytest.fixture(scope="module")
def settings(package):
    return json.loads((package / "firmware" / "ldc1314_config.json").read_text())


@pytest.mark.more
@pytest.mark.slow
def test_ldc1314_package_mentions_no_other_converter(package):
    sitscad.build(spec_of("ldc1314"), package.parent, ["assembly"])
    files = [path for path in package.rglob("*") if path.is_file()]
    assert len(files) > 20
    text = {str(path.relative_to(package)): OTHERS.findall(path.read_bytes()) for path in files}
    assert {name: words for name, words in text.items() if words} == {}


@pytest.mark.slow
def test_registers_offsets_and_documents_agree(package, settings):
    (device,) = settings["converters"]
    values = {row["name"]: row["value"] for row in device["registers"]}
    estimate = json.loads((package / "estimate.json").read_text())["readout"]
    assert values["RESET_DEV"] == settings["output_gain"] << 9 == estimate["output_gain"] << 9 == 0x600
    offsets = [coil["offset"] for coil in settings["coils"]]
    assert [values["OFFSET0"], values["OFFSET1"]] == offsets == estimate["offsets"]
    assert (settings["result_bits"], settings["count_bits"], settings["result_shift"]) == (12, 16, 0)
    assert settings["device_id"] == 0x3054
    message = "12 of 16 bits, a step of 1.22 kHz (gain 16)"
    assert message in (package / "datasheet.html").read_text() and message in (package / "report.html").read_text()
    assert "LDC1314_COUNTS of results" in (package / "calibration" / "plan.txt").read_text()


def test_every_expected_frequency_is_within_result_range(settings):
    """With two sigma of manufacture to both sides no result comes near its ends."""
    full = settings["input_divider"] * settings["reference_frequency_Hz"]
    for coil in settings["coils"]:
        for state in coil["expected"].values():
            for part in (0.97, 1.0, 1.03):
                result = part * state["frequency_Hz"] / full * 2**16 - coil["offset"]
                assert 0.15 * 2**12 < result < 0.85 * 2**12


PROGRAM = """
#include <stdio.h>
#include "config.h"
int main(void)
{
    for (unsigned coil = 0; coil < LDC1314_COILS; ++coil)
        for (unsigned data = 0; data <= LDC1314_DATA_MASK; data += 63) {
            const unsigned counts = LDC1314_COUNTS(coil, data | LDC1314_ERR_AE);
            printf("%u %u %u %.9e\\n", coil, data, counts, LDC1314_FIN_DIVIDER * LDC1314_F_REF_HZ * counts / 65536.0);
        }
    return LDC1314_DATA1 != 0x02 || LDC1314_DEVICE_ID != 0x3054;
}
"""


@pytest.mark.clients("gcc")
def test_header_converts_results_to_counts_and_frequencies(package, settings, tmp_path):
    """By SNOSCZ0A 8.1.3.1, in the words of its own formula; flags above a result are left out."""
    (tmp_path / "config.h").write_bytes((package / "firmware" / "ldc1314_config.h").read_bytes())
    (tmp_path / "main.c").write_text(PROGRAM)
    command = ["gcc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-o", tmp_path / "a.out", tmp_path / "main.c"]
    subprocess.run(command, check=True, timeout=60)
    text = subprocess.run([tmp_path / "a.out"], check=True, capture_output=True, text=True, timeout=60).stdout
    rows = [line.split() for line in text.splitlines()]
    assert len(rows) == 2 * 66
    bits = (0, 2, 3, 4)[settings["output_gain"]]
    for coil, data, counts, frequency in rows:
        offset = settings["coils"][int(coil)]["offset"]
        wanted = int(data) / 2 ** (12 + bits) + offset / 2**16
        assert float(frequency) == approx(
            settings["input_divider"] * settings["reference_frequency_Hz"] * wanted, rel=1e-8
        )
        assert int(counts) == int(data) + offset


FORCES = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-lm"]


@pytest.mark.clients("gcc")
def test_calibration_code_uses_counts_and_refuses_saturated_results(package, settings, tmp_path):
    folder = package / "calibration"
    document = json.loads((folder / "calibration.json").read_text())["map"]
    rest, offsets = np.array(document["rest"]), np.array([coil["offset"] for coil in settings["coils"]])
    assert np.all((rest > offsets) & (rest < offsets + 0xFFF))
    made = tmp_path / "forces"
    subprocess.run(["gcc", "-o", made, folder / "example.c", f"-I{folder}", *FORCES], check=True, timeout=60)
    rows = [rest, rest, rest + 10, offsets, offsets + 0xFFF, offsets - 1]
    given = "\n".join(" ".join(str(int(count)) for count in row) for row in rows) + "\n"
    text = subprocess.run([made], input=given, capture_output=True, text=True, timeout=60)
    forces = np.array([[float(value) for value in line.split()] for line in text.stdout.splitlines()])
    assert np.all(forces[0] == 0.0) and forces[1][0] > 0.0 and np.all(forces[2:] == 0.0)
    assert forces[1] == approx(sitscad.map_of(folder / "calibration.json")(rows[2], rest)[0], rel=1e-3)


@pytest.mark.slow
def test_signal_below_twelve_bit_step_gives_finding_with_step():
    """120 mN are 36 steps of an LDC1614, and one of an LDC1314: longer conversions would not make that finer."""
    assert "SIT215" not in {f.rule for f in sitscad.check(spec_of("ldc1614", normal_force="0.12 N")).findings}
    spec = spec_of("ldc1314", normal_force="0.12 N")
    (findings,) = (f for f in sitscad.check(spec).findings if f.rule == "SIT215")
    estimates = sitscad.Design(spec).estimates
    state = estimates.coils[0].states["rest"]
    step = estimates.readout.conversion.inductance_step(state.converter_inductance, state.frequency)
    assert f"steps of {show(step, 'H', 3)}" in findings.detail and step > 1.01 * state.quantum
    assert "readout.device: ldc1614" in findings.hint and "scan_rate" not in findings.hint
    assert state.quantum == approx(2.0 * state.inductance * 2 * 40e6 / 2**16 / state.frequency, rel=1e-6)
    (lost,) = (f for f in sitscad.check(spec_of("ldc1314", normal_force="0.02 N")).findings if f.rule == "SIT215")
    assert lost.severity is sitscad.Severity.ERROR
