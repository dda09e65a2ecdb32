"""A family with nothing of TI's: what is printed, judged and chosen for it is its own."""

from __future__ import annotations

import re
import sys
from dataclasses import replace
from types import SimpleNamespace

import pytest
from one_rule import findings_of
from tolerance import approx

import sitscad
from sitscad.apps.hardware.source import open_source
from sitscad.checks.reading.drive import _strong_drive_findings
from sitscad.checks.reading.readings import all_readings
from sitscad.cli import report_error
from sitscad.data import DataError
from sitscad.files.documents import firmware
from sitscad.files.documents.firmware_driver import addr_pin_text, render_readme
from sitscad.files.formats.kicad.schematic import _converter
from sitscad.files.report.numbers import readout_table
from sitscad.kernels.converters import ldc_registers, reference_counter
from sitscad.kernels.converters.converter import Converter
from sitscad.kernels.converters.figures import (
    HIGH_CURRENT,
    REGISTER_ROWS,
    REQUIRED_ROWS,
    family_rows,
    required_names,
    source_in_all,
)
from sitscad.kernels.converters.registers import RegisterMap
from sitscad.package.contents import incoming_tests
from sitscad.spec import presets
from tests.converters.conftest import forget
from tests.converters.family import xdc_registers
from tests.hardware.conftest import TEMPLATES


def design_with(device: Converter, **readout: object) -> sitscad.Design:
    """The bench's template with another converter."""
    spec = sitscad.load(TEMPLATES / "bench_7mm.yaml")
    return sitscad.Design(replace(spec, readout=replace(spec.readout, device=device, **readout)))


def test_c_header_of_new_family_mentions_only_its_registers(xdc2214):
    design = design_with(xdc2214)
    header = firmware.render(design.spec, design.estimates)["firmware/xdc2214_config.h"].decode()
    assert "after power-up or reset; RUN comes last: it starts the scan." in header
    assert re.search(r"20 bits, all of them counts \(XAC0001 7.1\)\.\n \* Faults stand in the upper bits", header)
    assert not re.search("CONFIG comes|ERROR_CONFIG|watchdog|under-range|over-range", header)


def test_incomplete_register_module_is_refused_with_missing_names(xdc2214, monkeypatch):
    result: RegisterMap = ldc_registers
    names = {"MANUFACTURER_ID", "DEVICE_ID", "STATUS", "MANUFACTURER", "DATA_FLAGS", "ORDER", "data_addresses",
             "registers", "results_text"}
    assert set(required_names(RegisterMap)) == names <= set(vars(result))
    without = {name: value for name, value in vars(xdc_registers).items() if name not in ("STATUS", "registers")}
    monkeypatch.setitem(sys.modules, "sitscad.kernels.converters.xdc_registers", SimpleNamespace(**without))
    presets.converter.cache_clear()
    with pytest.raises(ValueError, match="xdc_registers lacks STATUS, registers, which a module of register_map"):
        presets.converter("xdc2214")


def test_drive_code_beyond_converter_table_is_refused_on_load(xdc2214):
    """It ended `check` with an IndexError."""
    text = (TEMPLATES / "bench_7mm.yaml").read_text().replace("device: ldc1614", "device: xdc2214\n  drive_code: {}")
    assert sitscad.load_text(text.format(15)).readout.drive_code == 15
    with pytest.raises(sitscad.SpecError, match=r"XDC2214 has the drive codes 0 to 15, not 16") as refused:
        sitscad.load_text(text.format(16))
    assert [(item.rule, item.key) for item in refused.value.findings] == [("SIT006", "readout.drive_code")]


@pytest.mark.slow
def test_amplitude_hints_use_drive_table_of_converter(xdc2214):
    weak = design_with(xdc2214, capacitance=3e-9)
    assert weak.estimates.readout.drive_code == 15
    findings = next(item for item in sitscad.check(weak.spec).findings if item.rule == "SIT204")
    assert "weak-drive" in findings.cases
    loud = replace(all_readings(weak.estimates.coils, "amplitude", True)[0], value=2.0)
    weakest = replace(weak.estimates, readout=replace(weak.estimates.readout, drive_code=0))
    (message,) = _strong_drive_findings(sitscad.Design(weak.spec, given_estimates=weakest), loud)
    assert "50 kohm" in message.text("hint") and "XAC0001 8.2" in message.text("hint")


def test_default_capacitor_keeps_frequency_above_converter_minimum(xdc2214):
    """Of a coil of 24 turns the 100 pF that suit an LDC1614 leave 4.4 MHz."""
    spec = design_with(xdc2214).spec
    spec = replace(spec, coil=replace(spec.coil, turns=24.0, trace_width=50e-6, trace_spacing=50e-6))
    chosen = {}
    for device in (xdc2214, presets.converter("ldc1614")):
        design = sitscad.Design(replace(spec, readout=replace(spec.readout, device=device)))
        chosen[device.part] = (
            design.estimates.readout.capacitance,
            min(state.frequency for coil in design.estimates.coils for state in coil.states.values()),
        )
    assert chosen["XDC2214"][0] < chosen["LDC1614"][0]
    assert chosen["LDC1614"][1] < 5e6 <= chosen["XDC2214"][1]


@pytest.mark.parametrize(("was", "written", "said"), [
    ("switch_delay,400e-9,s", "switch_delay,400,ns", "switch_delay: its unit is 'ns', and 's' is asked"),
    ("switch_delay,400e-9,s", "switch_delay,400,s", "switch_delay: 400 s is not within 0 to 0.001 s"),
    ("switch_delay,400e-9,s", "switch_delay,nan,s", "switch_delay: nan s is not within"),
    ("noise_steps,3,", "noise_step,3,", "noise_steps: no such row, and it is asked of this family"),
    ("noise_steps,3,", "noise_steps,3 4,", "noise_steps: '3 4' is not one number"),
    ("noise_steps,3,", "supply_current,5e-3,A,verified,again\nnoise_steps,3,", "supply_current: it stands there twice"),
    ("rcount_min,20,", "rcount_min,20.5,", "rcount_min: 20.5 is not a whole number"),
    ("rcount_min,20,", "rcount_min,20,1,", "rcount_min: it has more or fewer columns"),
    ("result_bits,20,", "result_bits,twenty,", "result_bits: 'twenty' is not a number"),
    ("pin_capacitance,6e-12,F,verified", "pin_capacitance,6e-12,F,seen", "pin_capacitance: its status is 'seen'"),
    ("clock_min,8e6", "clock_min,88e6", "clock_min: 88e6 is more than clock_max, 80e6"),
    ("50e-6 100e-6", "100e-6 50e-6", "drive_currents: a larger code has to be a stronger drive"),
    ("GND VDD SDA SCL", "GND VDD", "address_nets: 2 nets for the 4 addresses of xdc2214"),
])
def test_invalid_family_data_are_refused_with_message(xdc2214, data, was, written, said, capsys):
    """400 ns were taken as 400 s; a row that was missing, or one more, ended `check` of every LDC1614 spec."""
    place = data / "converters/xdc221x.csv"
    text = place.read_text()
    assert was in text
    place.write_text(text.replace(was, written, 1))
    forget()
    with pytest.raises(DataError, match=re.escape(f"data/converters/xdc221x.csv, {said}")) as refused:
        presets.converter("xdc2214")
    assert report_error(refused.value) == 2
    assert "fault of sitscad" not in (lines := capsys.readouterr().err) and said in lines


@pytest.mark.parametrize(("was", "written", "said"), [
    ("xdc221x,4,", "xdc221x,four,", "invalid literal for int() with base 10: 'four'"),
    ("0x10 0x11", "0x10 0x10", "no channel, no address, or one address twice"),
    ("0x10 0x11", "0x10 0x84", "0x84 cannot be a device's address on an I2C bus"),
])
def test_invalid_converter_row_is_refused_with_message(xdc2214, data, was, written, said):
    place = data / "converters.csv"
    place.write_text(place.read_text().replace(was, written))
    forget()
    with pytest.raises(DataError, match=re.escape(f"data/converters.csv, xdc2214: {said}")):
        presets.converter("xdc2214")


def test_family_may_define_additional_limits(xdc2214, data):
    with (data / "converters/xdc221x.csv").open("a") as table:
        table.write("warm_up_time,4e-5,s,verified,XAC0001 9\nsleep,asleep until RUN,words,verified,XAC0001 9\n")
    forget()
    for device in map(presets.converter, ("xdc2214", "ldc1614")):
        assert device.text_with_own_sources(source_in_all("noise_law")) == device.source_of("noise_law")
    assert presets.converter("xdc2214").limit("warm_up_time") == 4e-5


def test_every_family_row_is_required_by_code():
    request = {*REQUIRED_ROWS, *REGISTER_ROWS, *HIGH_CURRENT, *reference_counter.REQUIRED_ROWS}
    for family in ("ldc161x", "ldc131x"):
        assert set(family_rows(family)) == request


def test_four_addresses_are_selected_by_addr_connection(xdc2214):
    """The third ended `build` with an IndexError."""
    layout = SimpleNamespace(spec=SimpleNamespace(readout=SimpleNamespace(device=xdc2214)),
                             coils=[SimpleNamespace(name=f"C{k}") for k in range(32)])
    drawn = [next(pin.net for pin in _converter(layout.coils, layout.spec.readout.device,
                                                number).left if pin.name == "ADDR") for number in range(8)]
    assert drawn == ["GND", "VDD", "SDA", "SCL", "GND", "VDD", "SDA2", "SCL2"]
    assert [addr_pin_text(xdc2214, address) for address in xdc2214.addresses] == ["low", "high", "to SDA", "to SCL"]


def test_read_of_converter_without_driver_is_refused(xdc2214):
    for text in ("/dev/i2c-1", "serial:/dev/ttyACM0"):
        with pytest.raises(ValueError, match="cannot be read: sitscad has no driver for XDC2214"):
            open_source(text, design_with(xdc2214))


def test_readme_of_converter_without_driver_states_it(xdc2214):
    design = design_with(xdc2214)
    files = render_readme(design.layout, design.estimates, incoming_tests(design).board)
    message = " ".join(files["firmware/readme.txt"].decode().split())
    assert "There is no driver for XDC2214 in this folder" in message and "xdc2214_config.json" in message


def test_read_back_time_uses_i2c_clock_of_family(xdc2214):
    """The report said 400 kHz and 1.2 V of any converter."""
    design = design_with(xdc2214, scan_rate=1e4)
    assert design.estimates.readout.read_back_time == approx(2 * 2 * 49 / 1e6, rel=1e-9)
    (slow,) = findings_of("SIT209", design.spec)
    assert slow.cases[0] == "read-back" and "1 MHz" in slow.message and "196 us" in slow.message
    header = firmware.render(design.spec, design.estimates)["firmware/xdc2214_config.h"].decode()
    assert "reading all results over I2C: 196 us" in header and "fastest clock of I2C: 1 MHz" in header
    apart = replace(design.estimates, readout=replace(design.estimates.readout, drive_codes=(3, 4)))
    rows = dict(readout_table(apart.coils, apart.readout).rows)
    assert rows["a code for every channel"] == "C1 3, C2 4: one for all leaves a coil below 900 mV"
    assert rows["fastest clock of I2C"] == "1 MHz" and "reading all results over I2C" in rows
