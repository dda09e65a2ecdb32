"""Register settings: the header compiles and holds the same words as the JSON; what cannot be read out is refused."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from dataclasses import replace
from types import SimpleNamespace

import layouts
import pytest

from sitscad.writers import firmware

SPEC = layouts.sensor_spec()


def estimates(coils=2, **changes):
    """Estimates of a sensor at 8 MHz, 40 MHz reference, as far as the registers need them."""
    readout = {
        "capacitance": 330e-12, "drive_code": 17, "drive_current": 2e-4, "reference_divider": 1,
        "reference_frequency": 40e6, "input_divider": 1, "rcount": 2000, "settle_count": 10, "scan_rate": 500.0,
        "high_current": False, "settle_time": 4e-6, "conversion_time": 8e-4, "switch_time": 8e-7,
        "read_back_time": 4.9e-4, "supply_current": 2.3e-3,
    }  # fmt: skip
    other = {"parallel_resistance": 4e3, "amplitude": 1.5, "quantum": 5e-11}
    states = {"free": SimpleNamespace(frequency=8.0e6, **other), "pressed": SimpleNamespace(frequency=9.0e6, **other)}
    return SimpleNamespace(
        coils=[SimpleNamespace(name=f"C{i + 1}", states=states) for i in range(coils)],
        readout=SimpleNamespace(**(readout | changes)),
    )


def rendered(found):
    """Header and JSON of some estimates."""
    files = firmware.render(SPEC, found)
    assert list(files) == ["firmware/ldc1614_config.h", "firmware/ldc1614_config.json"]
    return files[firmware.HEADER].decode(), json.loads(files[firmware.TABLE])


def test_words_are_packed_as_the_data_sheet_says():
    _, table = rendered(estimates())
    values = {row["name"]: (row["address"], row["value"]) for row in table["converters"][0]["registers"]}
    assert values["RCOUNT0"] == (0x08, 2000) and values["RCOUNT1"] == (0x09, 2000)
    assert values["SETTLECOUNT1"] == (0x11, 10)
    assert values["CLOCK_DIVIDERS0"] == (0x14, 0x1001)
    assert values["DRIVE_CURRENT1"] == (0x1F, 17 << 11)
    assert values["MUX_CONFIG"] == (0x1B, 0x820D)
    assert list(values)[-1] == "CONFIG"
    assert table["converters"][0]["channels"] == ["C1", "C2"]


@pytest.mark.parametrize("coils", [1, 4, 5, 8])
def test_header_and_json_agree(coils):
    header, table = rendered(estimates(coils))
    assert len(table["converters"]) == (coils + 3) // 4
    for number, device in enumerate(table["converters"]):
        block = re.search(rf"ldc1614_{number}_config\[\] = {{(.*?)}};", header, re.S).group(1)
        words = [(int(a, 16), int(v, 16)) for a, v in re.findall(r"\{0x(\w+)u, 0x(\w+)u\}", block)]
        assert words == [(row["address"], row["value"]) for row in device["registers"]]
        assert f"#define LDC1614_{number}_I2C_ADDRESS 0x{device['i2c_address']:02X}u" in header


@pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")
@pytest.mark.parametrize("language", ["c", "c++"])
def test_header_compiles(language, tmp_path):
    if language == "c++" and shutil.which("g++") is None:
        pytest.skip("g++ is not installed")
    path = tmp_path / "config.h"
    path.write_text(rendered(estimates(5))[0])
    flags = ["-std=c99"] if language == "c" else ["-std=c++11"]
    program = (
        '#include "config.h"\nint main(void)'
        "{return ldc1614_0_config[0].address - 0x08 + ldc1614_1_config[0].address - 0x08;}"
    )
    compile_it = ["gcc" if language == "c" else "g++", "-x", language, *flags, "-Wall", "-Werror", f"-I{tmp_path}", "-"]
    subprocess.run([*compile_it, "-o", tmp_path / "a.out"], input=program, text=True, check=True, timeout=60)
    assert subprocess.run([tmp_path / "a.out"], check=False, timeout=10).returncode == 0


@pytest.mark.parametrize(
    ("found", "reason"),
    [
        (estimates(drive_code=None), "drive_code is unknown"),
        (estimates(rcount=3), "RCOUNT is 3"),
        (estimates(high_current=True), "single-channel"),
        (estimates(9), "3 LDC1614"),
    ],
    ids=["no drive code", "conversion too short", "high current with two coils", "nine coils"],
)
def test_what_cannot_be_set_up_does_not_compile(found, reason):
    header, table = rendered(found)
    assert header.startswith("#error") and reason in header and header.count("\n") == 1
    assert reason in table["refused"] and table["converters"] == []


def test_no_frequency_is_refused():
    found = estimates()
    for coil in found.coils:
        coil.states = {}
    assert "frequency" in rendered(found)[1]["refused"]


def test_comments_cannot_be_ended_from_outside():
    spec = replace(SPEC, name="x*/y")
    header = firmware.render(spec, estimates())[firmware.HEADER].decode()
    assert "x*/y" not in header and "x* /y" in header


def test_the_header_says_what_to_expect_on_the_bench():
    header, table = rendered(estimates())
    for words in (
        "settling 4 us",
        "conversion 800 us",
        "500.0 scans a second",
        "C1 free: 8 MHz",
        "R_P 4 kohm",
        "1.5 V",
    ):
        assert words in header, words
    assert "Supply current about 2.3 mA" in header
    assert table["timing"]["read_back_time_s"] == 4.9e-4
    assert all(len(line) < 160 for line in header.splitlines())
