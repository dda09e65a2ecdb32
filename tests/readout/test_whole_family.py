"""A family with nothing of TI's: what is printed, judged and chosen for it is its own."""

from __future__ import annotations

import re
import sys
from dataclasses import replace
from types import SimpleNamespace

import pytest

import sitscad
from sitscad.checks.reading.drive import _other_code
from sitscad.checks.reading.readings import readings_of
from sitscad.papers import firmware
from sitscad.readout import ldc_registers
from sitscad.readout.converter import Converter
from sitscad.readout.registers import REQUIRED, RegisterMap
from sitscad.spec import presets
from tests.bench.conftest import TEMPLATES
from tests.readout.family import xdc_registers


def design_with(device: Converter, **readout: object) -> sitscad.Design:
    """The bench's template with another converter."""
    spec = sitscad.load(TEMPLATES / "bench_7mm.yaml")
    return sitscad.Design(replace(spec, readout=replace(spec.readout, device=device, **readout)))


def test_the_header_has_words_of_its_own_registers_alone(xdc2214):
    design = design_with(xdc2214)
    header = firmware.render(design.spec, design.estimates)["firmware/xdc2214_config.h"].decode()
    assert "after power-up or reset; RUN comes last: it starts the scan." in header
    assert re.search(r"20 bits, all of them counts \(XAC0001 7.1\)\.\n \* Faults stand in the upper bits", header)
    assert not re.search("CONFIG comes|ERROR_CONFIG|watchdog|under-range|over-range", header)


def test_a_module_of_registers_has_every_name_that_is_asked_of_it(xdc2214, monkeypatch):
    found: RegisterMap = ldc_registers
    assert set(REQUIRED) == {"MANUFACTURER_ID", "DEVICE_ID", "STATUS", "MANUFACTURER", "DATA_FLAGS", "ORDER",
                             "data_addresses", "registers", "said_of_results"} <= set(vars(found))
    without = {name: value for name, value in vars(xdc_registers).items() if name not in ("STATUS", "registers")}
    monkeypatch.setitem(sys.modules, "sitscad.readout.xdc_registers", SimpleNamespace(**without))
    presets.converter.cache_clear()
    with pytest.raises(ValueError, match="xdc_registers lacks STATUS, registers, which RegisterMap"):
        presets.converter("xdc2214")


def test_a_drive_code_that_the_converter_lacks_is_found_in_the_spec(xdc2214):
    """It ended `check` with an IndexError."""
    text = (TEMPLATES / "bench_7mm.yaml").read_text().replace("device: ldc1614", "device: xdc2214\n  drive_code: {}")
    assert sitscad.load_text(text.format(15)).readout.drive_code == 15
    with pytest.raises(sitscad.SpecError, match=r"XDC2214 has the drive codes 0 to 15, and none of 16") as refused:
        sitscad.load_text(text.format(16))
    assert [(one.rule, one.key) for one in refused.value.findings] == [("SIT006", "readout.drive_code")]


def test_hints_name_drive_codes_of_the_converter_s_own_table(xdc2214):
    weak = design_with(xdc2214, capacitance=3e-9)
    assert weak.estimates.readout.drive_code == 15
    found = next(one for one in sitscad.check(weak.spec).findings if one.rule == "SIT204")
    assert "too low even for the strongest drive" in found.hint
    reading = readings_of(weak, "amplitude", True)[0]
    assert _other_code(weak, reading, 1) == "there is no stronger drive"
    assert _other_code(weak, reading, -1) == "drive code 14 is the next weaker"


def test_a_capacitor_is_chosen_that_keeps_the_lowest_frequency(xdc2214):
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
