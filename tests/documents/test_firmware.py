"""Register settings: the header compiles and holds the same words as the JSON; what cannot be read out is refused."""

from __future__ import annotations

import json
import math
import re
import subprocess
from dataclasses import replace
from statistics import NormalDist
from types import SimpleNamespace

import layouts
import pytest
from tolerance import approx

from sitscad.assembly.places.state import State
from sitscad.basics.quantities import FREQUENCY
from sitscad.basics.units import show
from sitscad.estimates import estimate
from sitscad.estimates.circuits.settings import Band, CoilBands
from sitscad.estimates.design import Design
from sitscad.files.documents import firmware, firmware_driver
from sitscad.files.report.numbers import estimate_tables, reading_table
from sitscad.kernels.converters.reference_counter import ReferenceCounter
from sitscad.layout import lay_out
from sitscad.package.contents import incoming_tests
from sitscad.spec import presets, templates
from sitscad.spec.load import load_text

SPEC = layouts.sensor_spec()
HEADER, TABLE = (firmware.config_path(SPEC.readout.device, ending) for ending in ("h", "json"))


@pytest.fixture(autouse=True)
def without_driver(monkeypatch):
    """Hand-made estimates have no bands for the driver's self-test."""
    monkeypatch.setattr(firmware, "driver_files", lambda *_: {})


def counted(rcount):
    """Settings of a converter for some coils, as far as the registers need them."""
    return ReferenceCounter(SPEC.readout.device, 2, 40e6, 1, 1, rcount, 10)


def estimates(coils=2, **changes):
    """Estimates of a sensor at 8 MHz, 40 MHz reference, as far as the registers need them."""
    readout = {
        "capacitance": 330e-12, "drive_code": 17, "drive_codes": (), "drive_current": 2e-4, "scan_rate": 500.0,
        "high_current": False, "settle_time": 4e-6, "conversion_time": 8e-4, "switch_time": 8e-7,
        "read_back_time": 4.9e-4, "supply_current": 2.3e-3, "conversion_capacitance": 334e-12,
        "conversion": counted(2000), "dwell_time": 8.048e-4, "result_interval": 8.008e-4,
    }
    other = {
        "parallel_resistance": 4e3,
        "amplitude": 1.5,
        "quantum": 5e-11,
        "converter_inductance": 1.2e-6,
        "spread": SimpleNamespace(frequency=1.2e5),
    }
    states = {"free": SimpleNamespace(frequency=8.0e6, **other), "pressed": SimpleNamespace(frequency=9.0e6, **other)}
    every = [
        SimpleNamespace(
            name=f"C{i + 1}",
            states=states,
            centre=(4e-3 * i, -1e-3),
            converter_sensitivity=lambda force: (-1e-9, 2e-10) if force else None,
        )
        for i in range(coils)
    ]
    return SimpleNamespace(
        temperature=20.0,
        coils=every,
        all_coils=every,
        reference=None,
        readout=SimpleNamespace(**(readout | changes)),
        states=(State("free"), State("pressed", force=4.0)),
        failed_states={},
    )


def rendered(found):
    """Header and JSON of some estimates."""
    files = firmware.render(SPEC, found)
    assert list(files)[:2] == [HEADER, TABLE]
    return files[HEADER].decode(), json.loads(files[TABLE])


TWO_CHANNELS = replace(SPEC, readout=replace(SPEC.readout, device=presets.converter("ldc1612")))


@pytest.mark.clients("gcc")
def test_two_channel_converter_header_has_its_names_and_compiles(tmp_path):
    files = firmware.render(TWO_CHANNELS, estimates(3))
    header, table = files["firmware/ldc1612_config.h"].decode(), json.loads(files["firmware/ldc1612_config.json"])
    assert [device["channels"] for device in table["converters"]] == [["C1", "C2"], ["C3"]]
    assert [(coil["converter"], coil["channel"]) for coil in table["coils"]] == [(0, 0), (0, 1), (1, 0)]
    assert table["device"] == "ldc1612" and "1614" not in header
    assert "LDC1612_DATA1_LSB" in header and "LDC1612_DATA2_MSB" not in header
    (tmp_path / "config.h").write_text(header)
    program = '#include "config.h"\nint main(void) {return ldc1612_1_config[0].value == 0 || LDC1612_COILS != 3;}'
    command = ["gcc", "-x", "c", "-std=c99", "-Wall", "-Werror", f"-I{tmp_path}", "-o", tmp_path / "a.out", "-"]
    subprocess.run(command, input=program, text=True, check=True, timeout=60)
    subprocess.run([tmp_path / "a.out"], check=True, timeout=60)


def test_too_many_coils_for_one_bus_are_refused():
    files = firmware.render(TWO_CHANNELS, estimates(5))
    assert "3 LDC1612 are needed" in json.loads(files["firmware/ldc1612_config.json"])["refused"]


def test_second_bus_addresses_third_converter():
    two = replace(TWO_CHANNELS, readout=replace(TWO_CHANNELS.readout, buses=2))
    files = firmware.render(two, estimates(5))
    table = json.loads(files["firmware/ldc1612_config.json"])
    assert [(item["i2c_bus"], item["i2c_address"]) for item in table["converters"]] == [(0, 0x2A), (0, 0x2B), (1, 0x2A)]
    assert (table["coils"][4]["i2c_bus"], table["coils"][4]["converter"]) == (1, 2)
    assert "#define LDC1612_2_I2C_BUS 1u" in files["firmware/ldc1612_config.h"].decode()


def test_register_words_equal_data_sheet_packing():
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
def test_header_and_json_have_equal_registers(coils):
    header, table = rendered(estimates(coils))
    assert len(table["converters"]) == (coils + 3) // 4
    for number, device in enumerate(table["converters"]):
        block = re.search(rf"ldc1614_{number}_config\[\] = {{(.*?)}};", header, re.S).group(1)
        words = [(int(a, 16), int(v, 16)) for a, v in re.findall(r"\{0x(\w+)u, 0x(\w+)u\}", block)]
        assert words == [(row["address"], row["value"]) for row in device["registers"]]
        assert f"#define LDC1614_{number}_I2C_ADDRESS 0x{device['i2c_address']:02X}u" in header


@pytest.mark.clients("gcc", "g++")
@pytest.mark.parametrize("language", ["c", "c++"])
def test_header_compiles_in_c_and_cpp(language, tmp_path):
    path = tmp_path / "config.h"
    path.write_text(rendered(estimates(5))[0])
    flags = ["-std=c99"] if language == "c" else ["-std=c++11"]
    program = (
        '#include "config.h"\nint main(void)'
        "{return ldc1614_0_config[0].address - 0x08 + ldc1614_1_config[0].address - 0x08"
        " + ldc1614_coils[3].channel + (LDC1614_F_CLK_HZ / LDC1614_FREF_DIVIDER != LDC1614_F_REF_HZ);}"
    )
    compile_it = ["gcc" if language == "c" else "g++", "-x", language, *flags, "-Wall", "-Werror", f"-I{tmp_path}", "-"]
    subprocess.run([*compile_it, "-o", tmp_path / "a.out"], input=program, text=True, check=True, timeout=60)
    assert subprocess.run([tmp_path / "a.out"], check=False, timeout=10).returncode == 0


@pytest.mark.parametrize(
    ("found", "reason"),
    [
        (estimates(drive_code=None), "drive_code is unknown"),
        (estimates(conversion=counted(3)), "RCOUNT is 3"),
        (estimates(high_current=True), "single-channel"),
        (estimates(9), "3 LDC1614"),
    ],
    ids=["no drive code", "conversion too short", "high current with two coils", "nine coils"],
)
def test_invalid_settings_give_header_with_error_directive(found, reason):
    header, table = rendered(found)
    assert header.startswith("#error") and reason in header and header.count("\n") == 1
    assert reason in table["refused"] and table["converters"] == []


def test_header_has_result_flag_and_address_constants():
    header, table = rendered(estimates(5))
    macros = {name: int(value, 16) for name, value in re.findall(r"#define LDC1614_(\w+) 0x(\w+)u", header)}
    assert [macros[f"DATA{n}_{word}"] for n in range(4) for word in ("MSB", "LSB")] == list(range(8))
    assert macros["DATA_MSB_MASK"] == 0x0FFF and macros["STATUS"] == 0x18
    assert [macros[f"ERR_{name}"] for name in ("UR", "OR", "WD", "AE")] == [1 << bit for bit in (15, 14, 13, 12)]
    assert (macros["MANUFACTURER_ID_ADDRESS"], macros["DEVICE_ID_ADDRESS"]) == (0x7E, 0x7F)
    assert [device["addr_pin"] for device in table["converters"]] == ["low", "high"]
    assert "Converter 0, its pin ADDR low" in header and "Converter 1, its pin ADDR high" in header
    assert "L_REST_H" not in header  # these hand-made coils have no such state


def test_every_channel_register_has_its_drive_code():
    _, table = rendered(estimates(5, drive_codes=(17, 18, 19, 20, 21)))
    codes = [
        row["value"] >> 11
        for device in table["converters"]
        for row in device["registers"]
        if row["name"].startswith("DRIVE_CURRENT")
    ]
    assert codes == [17, 18, 19, 20, 21]


def test_single_coil_settles_only_before_first_conversion():
    """Its scans a second were those without settling, beside a sum with it."""
    item, two = (" ".join(rendered(estimates(coils))[0].replace("*", " ").split()) for coils in (1, 2))
    assert "from one result of the coil to the next: 800.8 us" in item
    assert "settling, once, before the first conversion: 4 us" in item
    assert "time on one coil, of every scan: 804.8 us settling: 4 us conversion: 800 us" in two


def test_coil_without_frequency_is_refused():
    result = estimates()
    for coil in result.coils:
        coil.states = {}
    assert "frequency" in rendered(result)[1]["refused"]


def test_comment_end_in_name_is_escaped():
    spec = replace(SPEC, name="x*/y")
    header = firmware.render(spec, estimates())[HEADER].decode()
    assert "x*/y" not in header and "x* /y" in header


def test_header_states_expected_bench_values():
    header, table = rendered(estimates())
    for words in (
        "settling: 4 us",
        "conversion: 800 us",
        "complete scans, of all coils: 500 Hz",
        "C1 free: 8 MHz",
        "R_P 4 kohm",
        "1.5 V",
    ):
        assert words in header, words
    assert "supply current, about: 2.3 mA" in header
    assert table["timing"]["read_back_time_s"] == 4.9e-4
    assert all(len(line) < 160 for line in header.splitlines())


RACETRACK = """
sitscad: 1
name: long
coil: {shape: racetrack, outer_diameter: [11, 4], turns: 6.5, layers: 4, trace_width: 80 um, trace_spacing: 80 um}
fpc: {stackup: flex-4l, rules: generic-fine, tail: {length: 30, connector: zif-0.5mm, layers: 2, bend: static}}
target: {shape: rectangle, size: [11, 4.2], thickness: 0.2, material: copper}
elastomer: {material: dragon-skin-10, shape: rectangle, size: [11, 4.2], thickness: 1}
readout: {capacitance: 220 pF, clock: 40 MHz, CABLE}
"""
CABLE = "cable: {length: 300, inductance: 180 nH, capacitance: 30 pF, resistance: 0.3 ohm}"


@pytest.mark.parametrize("cable", ["scan_rate: 500 Hz", CABLE], ids=["no cable", "cable"])
def test_header_formula_gives_printed_inductance(cable):
    """It differed by what 4 pF of the converter's pins make: the header named the capacitor alone."""
    spec = load_text(RACETRACK.replace("CABLE", cable), "long.yaml")
    result = estimate(lay_out(spec))
    header, table = rendered(result)
    macros = dict(re.findall(r"#define LDC1614_(\w+) ([\d.e+-]+)u?$", header, re.M))
    capacitance = float(macros["CAPACITANCE_F"])
    assert capacitance == approx(220e-12 + 4e-12 + (30e-12 if cable is CABLE else 0.0), rel=1e-6)
    expected = re.findall(r"C1 (\w+): ([\d.]+) MHz, L ([\d.]+) uH by the formula", header)
    assert [name for name, *_ in expected] == ["free", "rest"]
    for name, megahertz, microhenries in expected:
        by_formula = 1.0 / (capacitance * (2.0 * math.pi * float(megahertz) * 1e6) ** 2)
        assert by_formula == approx(float(microhenries) * 1e-6, rel=2e-6)
        state = result.coils[0].states[name]
        rows = reading_table(result.coils, result.temperature, result.normal_force).rows
        (row,) = [row for row in rows if row[1].startswith(name) or f" {name} " in row[1]]
        assert show(by_formula, "H") == row[3]
        # what the header says about the difference to the inductance at the contacts
        if cable is not CABLE:
            q, omega = state.quality_factor, 2.0 * math.pi * state.frequency
            high = 1.0 + 1.0 / q**2 + 5e-9 * omega / q
            own = 1.0 / (1.0 - omega**2 * state.inductance * result.coils[0].self_capacitance)
            assert by_formula == approx(state.inductance * high * own, rel=2e-3)
    assert table["conversion_capacitance_F"] == approx(capacitance, rel=1e-6)


def test_header_distinguishes_clock_and_reference_frequency():
    """One coil: 40 MHz at CLKIN, and 20 MHz that are counted; the header's f_REF could be read as either."""
    header, table = rendered(estimate(lay_out(load_text(RACETRACK.replace("CABLE", "scan_rate: 500 Hz"), "long.yaml"))))
    assert "f_CLK 40 MHz at CLKIN; FREF_DIVIDER 2 makes of it f_REF 20 MHz" in header
    macros = dict(re.findall(r"#define LDC1614_(\w+) ([\d.e+-]+)u?$", header, re.M))
    assert float(macros["F_CLK_HZ"]) / int(macros["FREF_DIVIDER"]) == float(macros["F_REF_HZ"]) == 20e6
    assert (table["clock_Hz"], table["reference_divider"], table["reference_frequency_Hz"]) == (40e6, 2, 20e6)
    words = {row["name"]: row["value"] for row in table["converters"][0]["registers"]}
    assert words["CLOCK_DIVIDERS0"] == int(macros["FIN_DIVIDER"]) << 12 | 2


def test_header_and_json_list_channel_and_position_of_coils():
    header, table = rendered(estimates(6))
    rows = re.findall(r'\{"(\w+)", (\d)u, (\d)u, 0u, 0x(\w\w)u, (\S+)f, (\S+)f\}', header)
    assert len(rows) == len(table["coils"]) == 6
    for row, coil, index in zip(rows, table["coils"], range(6), strict=True):
        assert row[0] == coil["name"] == f"C{index + 1}"
        assert (int(row[1]), int(row[2])) == (coil["converter"], coil["channel"]) == divmod(index, 3)
        assert int(row[3], 16) == coil["i2c_address"] == (0x2A, 0x2B)[index // 3]
        assert [float(row[4]), float(row[5])] == coil["centre_m"] == approx([4e-3 * index, -1e-3], rel=1e-6)
        assert table["converters"][coil["converter"]]["channels"][coil["channel"]] == coil["name"]


PRESSED = RACETRACK.replace("CABLE", "scan_rate: 500 Hz") + "requirements: {normal_force: 4 N}\n"


def test_readme_states_frequencies_above_converter_limit():
    """A band ended at 10.11 MHz, and nothing said that the converter does at 10."""
    fast = Band(9.4e6, 8.65e6, 10.15e6)  # one sigma is 150 kHz: 10 MHz are four of them away
    slow = Band(8.8e6, 8.1e6, 9.5e6)
    message = firmware_driver._frequency_warning(SPEC.readout.device, (CoilBands("C1", slow, fast, fast, 1e4),))
    assert "Above 10 MHz" in message and "coil C1, assembled and at rest" in message
    assert f"{100.0 * NormalDist().cdf(-4.0):.2g} %" == "0.0032 %" and "0.0032 %" in message
    assert firmware_driver._frequency_warning(SPEC.readout.device, (CoilBands("C1", slow, slow, slow, 1e4),)) == ""


def test_header_and_json_contain_force_and_sensitivity():
    spec = load_text(PRESSED, "long.yaml")
    result = estimate(lay_out(spec))
    files = firmware.render(spec, result)
    header, table = files[HEADER].decode(), json.loads(files[TABLE])
    macros = {name: float(value) for name, value in re.findall(r"#define LDC1614_(\w+) ([-\d.e+]+)$", header, re.M)}
    states, (change, sigma) = result.coils[0].states, result.coils[0].converter_sensitivity(4.0)
    assert macros["FORCE_PRESSED_N"] == 4.0 and "pressed is with 4 N" in header
    assert macros["COIL0_L_REST_H"] == approx(states["rest"].converter_inductance, rel=1e-6)
    assert macros["COIL0_L_PRESSED_H"] == approx(
        macros["COIL0_L_REST_H"] + 4.0 * macros["COIL0_L_PER_NEWTON_H"], rel=1e-6
    )
    assert (macros["COIL0_L_PER_NEWTON_H"], macros["COIL0_L_PER_NEWTON_SIGMA_H"]) == approx((change, sigma), rel=1e-6)
    (coil,) = table["coils"]
    assert coil["inductance_by"].startswith("1 / (C (2 pi f)^2), C = conversion_capacitance_F;")
    own, known = table["conversion_capacitance_F"], coil["expected"]["rest"]
    assert known["inductance_H"] == approx(1.0 / (own * (2.0 * math.pi * known["frequency_Hz"]) ** 2), rel=1e-9)
    assert [state["force_N"] for state in coil["expected"].values()] == [0.0, 0.0, 4.0]
    assert (coil["inductance_H_per_N"], coil["sigma_inductance_H_per_N"]) == approx((change, sigma), rel=1e-6)


def test_every_state_has_its_force_in_json():
    """A state that was added, by half the force, was pressed by 0 N."""
    result = estimates()
    for coil in result.coils:
        coil.states["half"] = coil.states["pressed"]
    result.states = (*result.states, State("half", force=2.0))
    for coil in rendered(result)[1]["coils"]:
        forces = {name: item["force_N"] for name, item in coil["expected"].items()}
        assert forces == {"free": 0.0, "pressed": 4.0, "half": 2.0}


def test_printed_frequencies_state_temperature_with_equal_digits():
    """The readme had 7.6702 MHz at 37 degC, the assembly notes 7.677 MHz at 20 degC."""
    spec = load_text(templates.read("single_coil")).replace("requirements.temperature", "37 degC")
    design = Design(spec)
    readme = firmware_driver.render_readme(design.layout, design.estimates, incoming_tests(design).board)[
        firmware_driver.README].decode()
    header = firmware.render(spec, design.estimates)[HEADER].decode()
    shown = FREQUENCY.plain(design.estimates.coils[0].states["free"])
    assert "at 37 degC" in readme and "Expected at 37 degC" in header
    assert re.search(rf"bare board +{re.escape(shown)} ", readme) and "C1 free: " in header
    assert spec.fpc.tail is None and "contacts of the tail" not in readme
    tables = estimate_tables(design.estimates)
    named = {table.title for table in tables if {"frequency", "C1"} & set(table.head)}
    assert sum("at 37 degC" in title for title in named) >= 2
